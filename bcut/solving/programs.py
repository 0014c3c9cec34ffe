"""The integer program of a question: a formulation by its name, on the simplices that the question admits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bcut.errors import InputError
from bcut.formulations.chambers import chamber_formulation
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.face_sets import face_set_formulation
from bcut.formulations.formulation import Formulation
from bcut.formulations.stable_sets import stable_set_formulation
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.restrictions import Restrictions

FORMULATIONS: dict[str, Callable[..., Formulation]] = {
    "0": stable_set_formulation,
    "1": face_set_formulation,
    "2": cocircuit_formulation,
    "chambers": chamber_formulation,
}
#: Those whose 0/1 points can be dissections.
DISSECTING = ("0", "chambers")


def formulation_name(given: str | int | None, *, dissection: bool) -> str:
    """Return the formulation that is meant.

    Raises
    ------
    InputError
        If there is no such one, or it knows no dissections and they are wanted.
    """
    name = ("chambers" if dissection else "2") if given is None else str(given)
    if name not in FORMULATIONS:
        raise InputError(f"unknown formulation '{name}': known are {', '.join(FORMULATIONS)}")
    if dissection and name not in DISSECTING:
        raise InputError(
            f"formulation {name}: its solutions are triangulations; for dissections take one of {', '.join(DISSECTING)}"
        )
    return name


def make_formulation(
    name: str,
    configuration: PointConfiguration,
    *,
    spanning: bool = False,
    dissection: bool = False,
    restrictions: Restrictions | None = None,
    **options: bool,
) -> Formulation:
    """Build the program of a question.

    Parameters
    ----------
    name : str
        As `formulation_name` returns it.
    configuration : PointConfiguration
    spanning : bool
    dissection : bool
    restrictions : Restrictions, optional
    **options
        For the formulation alone.

    Raises
    ------
    InputError
        If a required or forbidden face is no face of any simplex.
    """
    if dissection:
        options["dissection"] = True
    formulation = FORMULATIONS[name](configuration, spanning=spanning, **options)
    if not restrictions:
        return formulation
    allowed = restrictions.allowed(
        configuration, formulation.chirotope, formulation.simplices, dissection=dissection
    )
    return formulation.restricted_to(np.flatnonzero(allowed))
