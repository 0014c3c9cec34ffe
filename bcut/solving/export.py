"""`export`: the integer program of an instance as a file that other solvers read."""

from __future__ import annotations

from pathlib import Path

from bcut.errors import InputError
from bcut.files.atomic import check_writable, replacing
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance
from bcut.objectives.objective import make_objective
from bcut.solving.api import FORMULATIONS, InstanceLike

#: Suffixes of model files, each a format.
MODEL_SUFFIXES = (".lp", ".mps")


def export(
    instance: InstanceLike,
    path: str | Path,
    *,
    objective: str = "cardinality",
    sense: str = "min",
    formulation: str = "2",
    spanning: bool = False,
) -> None:
    """Write the integer program of an instance as an LP or MPS file.

    Parameters
    ----------
    instance : str, path or PointConfiguration
    path : str or path
        Ends in ".lp" or ".mps". The variable of a simplex is called ``x_v0_v1_..._vd``, a cocircuit row after
        its (d-1)-simplex.
    objective, sense, formulation, spanning
        As for `bcut.solve`.

    Raises
    ------
    InputError
        If the suffix is another one, the file cannot be written, or the instance or an option cannot be used.
    """
    target = Path(path)
    if target.suffix not in MODEL_SUFFIXES:
        raise InputError(
            f"{target}: unknown suffix '{target.suffix}'; models are written as {', '.join(MODEL_SUFFIXES)}"
        )
    check_writable(target)
    if formulation not in FORMULATIONS:
        raise InputError(f"unknown formulation '{formulation}': known are {', '.join(FORMULATIONS)}")
    configuration = instance if isinstance(instance, PointConfiguration) else load_instance(instance)
    program = FORMULATIONS[formulation](configuration, spanning=spanning)
    costs = make_objective(objective, program, sense=sense)
    from bcut.scip.model import write_model

    with replacing(target) as temporary:
        write_model(program, costs, temporary)
