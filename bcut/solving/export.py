"""`export`: the integer program of an instance as a file that other solvers read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bcut.errors import InputError, TooLargeError
from bcut.files.atomic import check_writable, replacing
from bcut.geometry.restrictions import Restrictions
from bcut.instance import load_instance
from bcut.objectives.objective import sum_objective
from bcut.objectives.syntax import ObjectiveLike
from bcut.solving.options import InstanceLike, Options
from bcut.solving.programs import formulation_name, make_formulation

#: Suffixes of model files, each a format.
MODEL_SUFFIXES = (".lp", ".mps")


def export(
    instance: InstanceLike,
    path: str | Path,
    *,
    objective: ObjectiveLike = "cardinality",
    sense: str | None = None,
    formulation: str | int | None = None,
    spanning: bool = False,
    dissection: bool = False,
    require: Sequence[Sequence[int]] = (),
    forbid: Sequence[Sequence[int]] = (),
    star: int | None = None,
) -> None:
    """Write the integer program of an instance as an LP or MPS file.

    Parameters
    ----------
    instance : str, path, points or PointConfiguration
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
    asked = Options.of(
        objective=objective,
        sense=sense,
        formulation=formulation,
        spanning=spanning,
        dissection=dissection,
        require=require,
        forbid=forbid,
        star=star,
    )
    name = formulation_name(asked.formulation, dissection=asked.dissection)
    configuration = load_instance(instance)
    program = make_formulation(
        name,
        configuration,
        spanning=asked.spanning,
        dissection=asked.dissection,
        restrictions=Restrictions.of(
            configuration, require=asked.require, forbid=asked.forbid, star=asked.star
        ),
    )
    if program.lazy:
        raise TooLargeError(
            f"{configuration.name}: formulation {name} has rows that are only made when a point violates them, because "
            "they are many, or because volumes are no small integers; a file would lack them. Export formulation 2"
        )
    costs = sum_objective(asked.objective, program, sense=asked.sense, purpose="a model file")
    from bcut.scip.model import write_model

    with replacing(target) as temporary:
        write_model(program, costs, temporary)
