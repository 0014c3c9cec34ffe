"""Surfaces of polyhedra, and what a settled question about one is."""

from __future__ import annotations

import numpy as np

import bcut
from bcut.solving.region import RegionResult

Faces = list[list[int]]

CUBE = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
# Each square is divided by a diagonal between two of the vertices 0, 3, 5, 6.
EVEN: Faces = [
    *([0, 3, 2], [0, 1, 3], [4, 6, 5], [6, 7, 5], [0, 5, 1], [0, 4, 5]),
    *([2, 3, 6], [3, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 3], [3, 5, 7]),
]


def boundary(tetrahedra: list[list[int]], points: list[list[int]]) -> Faces:
    """Outward triangles of a union of tetrahedra that meet face to face."""
    once: dict[tuple[int, ...], list[int]] = {}
    for tetrahedron in tetrahedra:
        for apex in tetrahedron:
            a, b, c = (vertex for vertex in tetrahedron if vertex != apex)
            rows = np.array([points[v] for v in (b, c, apex)]) - np.array(points[a])
            face = [a, b, c] if np.linalg.det(rows.astype(float)) < 0 else [a, c, b]
            key = tuple(sorted(face))
            if once.pop(key, None) is None:
                once[key] = face
    return list(once.values())


def settled(found: RegionResult) -> RegionResult:
    verification = bcut.verify(found)
    assert verification.proven_optimal
    assert found.status in ("optimal", "infeasible")
    assert verification.statement.startswith("triangulable" if found.status == "optimal" else "infeasible")
    return found
