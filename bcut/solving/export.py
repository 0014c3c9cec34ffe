"""`export`: the integer program of an instance as a file that other solvers read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bcut.errors import InputError, TooLargeError
from bcut.files.atomic import check_writable, replacing
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.restrictions import Restrictions
from bcut.instance import load_instance
from bcut.objectives.objective import sum_objective
from bcut.solving.options import InstanceLike
from bcut.solving.programs import formulation_name, make_formulation

#: Suffixes of model files, each a format.
MODEL_SUFFIXES = (".lp", ".mps")


def export(
    instance: InstanceLike,
    path: str | Path,
    *,
    objective: str = "cardinality",
    sense: str | None = None,
    formulation: str | None = None,
    spanning: bool = False,
    dissection: bool = False,
    require: Sequence[Sequence[int]] = (),
    forbid: Sequence[Sequence[int]] = (),
    star: int | None = None,
) -> None:
    """Write the integer program of an instance as an LP or MPS file.

    Parameters
    ----------
    instance : str, path or PointConfiguration
    path : str or path
        Ends in ".lp" or ".mps". The variable of a simplex is called ``x_v0_v1_..._vd``, a cocircuit row after
        its (d-1)-simplex.
    objective, sense, formulation, spanning, dissection, require, forbid, star
        As for `bcut.solve`. Rows that `solve` adds when they are needed are written down where they are few.

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
    name = formulation_name(formulation, dissection=dissection)
    configuration = instance if isinstance(instance, PointConfiguration) else load_instance(instance)
    program = make_formulation(
        name,
        configuration,
        spanning=spanning,
        dissection=dissection,
        restrictions=Restrictions.of(configuration, require=require, forbid=forbid, star=star),
    )
    if program.lazy:
        raise TooLargeError(
            f"{configuration.name}: formulation {name} has rows that are only made when a point violates them, because "
            "they are many, or because volumes are no small integers; a file would lack them. Export formulation 2"
        )
    costs = sum_objective(objective, program, sense=sense, purpose="a model file")
    from bcut.scip.model import write_model

    with replacing(target) as temporary:
        write_model(program, costs, temporary)
