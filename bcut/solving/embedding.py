"""The costs that a result file must hold, so that it alone is enough to verify the value."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bcut.geometry.configuration import PointConfiguration
from bcut.objectives.measures import read_costs
from bcut.objectives.objective import Objective
from bcut.objectives.syntax import MeasureName, ObjectiveName
from bcut.solving.search import Search

# A function's costs of more simplices than this would make the file too large; then only those of the triangulation
# are written, and the bound is not re-checked.
MAX_COSTS = 200_000


def costs_to_embed(
    name: ObjectiveName, objective: Objective, configuration: PointConfiguration, search: Search
) -> dict[str, Any] | None:
    """Return the costs of a file or of a user's function; None for measures that can be evaluated again.

    Parameters
    ----------
    name : ObjectiveName
    objective : Objective
        On all columns of the search.
    configuration : PointConfiguration
    search : Search
        Finished.

    Returns
    -------
    dict or None
        A default, None where there is none, and pairs of a simplex and its cost.
    """
    measure = MeasureName.parse(name.measure)
    if measure.source == "costs":
        default, table = read_costs(Path(measure.argument), configuration)
        entries = [[list(simplex), str(cost)] for simplex, cost in sorted(table.items())]
        return {"default": str(default), "costs": entries}
    if not measure.is_function:
        return None
    simplices = search.whole.formulation.simplices
    if len(simplices) <= MAX_COSTS:
        columns = np.arange(len(simplices))
    else:
        columns = np.array([], dtype=np.int64) if search.columns is None else np.sort(search.columns)
    numbers = objective.numerators[columns].tolist()
    return {
        "default": None,
        "costs": [
            [simplex, number] for simplex, number in zip(simplices[columns].tolist(), numbers, strict=True)
        ],
    }
