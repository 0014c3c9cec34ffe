"""Provably optimal triangulations of point configurations, by branch-and-cut.

>>> import bcut
>>> result = bcut.solve("cube:3")
>>> result.value, result.status
(5, 'optimal')

Names are loaded when they are first used, so that ``import bcut`` is instant.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from bcut.errors import BcutError as BcutError
    from bcut.files.registry import write_points as write_points
    from bcut.geometry.configuration import PointConfiguration as PointConfiguration
    from bcut.instance import load_instance as load_instance
    from bcut.plotting.plot import plot as plot
    from bcut.result import Result as Result
    from bcut.separation.check import check_separator as check_separator
    from bcut.separation.seam import Cut as Cut
    from bcut.separation.seam import FractionalPoint as FractionalPoint
    from bcut.separation.seam import Problem as Problem
    from bcut.separation.seam import Separator as Separator
    from bcut.solving.api import bound as bound
    from bcut.solving.api import solve as solve
    from bcut.solving.export import export as export
    from bcut.solving.information import info as info
    from bcut.solving.region import region as region
    from bcut.solving.regularity import regular as regular
    from bcut.verification.verify import verify as verify

_HOMES = {
    "BcutError": "bcut.errors",
    "Cut": "bcut.separation.seam",
    "FractionalPoint": "bcut.separation.seam",
    "PointConfiguration": "bcut.geometry.configuration",
    "Problem": "bcut.separation.seam",
    "Result": "bcut.result",
    "Separator": "bcut.separation.seam",
    "bound": "bcut.solving.api",
    "check_separator": "bcut.separation.check",
    "export": "bcut.solving.export",
    "info": "bcut.solving.information",
    "load_instance": "bcut.instance",
    "plot": "bcut.plotting.plot",
    "region": "bcut.solving.region",
    "regular": "bcut.solving.regularity",
    "solve": "bcut.solving.api",
    "verify": "bcut.verification.verify",
    "write_points": "bcut.files.registry",
}

__all__ = ["__version__", *sorted(_HOMES)]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'bcut' has no attribute '{name}'")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
