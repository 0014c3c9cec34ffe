"""A result with a certificate, written by hand, for tests to change."""

from __future__ import annotations

import copy
from typing import Any

from bcut.geometry.configuration import PointConfiguration

# 2---3
# |   |
# 0---1
SQUARE = [[0, 0], [1, 0], [0, 1], [1, 1]]

# By hand: with y = 2 on the coverage row, 1 on the diagonal 0-3 and -1 on 1-2 all reduced costs are zero.
# The generic point of the flag lies in 012 and 013. Point 1 is on the - side of 03, 0 on the + side of 12.
CERTIFICATE = {
    "bound": "2",
    "flag": [0, 1, 2],
    "multipliers": [["coverage", "2"], [[0, 3], "1"], [[1, 2], "-1"]],
    "cuts": [],
    "reason": None,
}


def square_result(**changes: Any) -> dict[str, Any]:
    """The optimal result for the square with its certificate; changes go to the certificate."""
    configuration = PointConfiguration.from_values(SQUARE)
    return {
        "schema": 1,
        "instance": {
            "name": "square",
            "dimension": 2,
            "points": [list(point) for point in configuration.exact_points()],
            "digest": configuration.digest,
        },
        "problem": {"objective": "cardinality", "sense": "min", "spanning": False},
        "status": "optimal",
        "value": 2,
        "bound": 2,
        "gap": 0,
        "triangulation": [[0, 1, 2], [1, 2, 3]],
        "certificate": {**copy.deepcopy(CERTIFICATE), **changes},
    }
