"""The enumerator of dissections finds each of them, once, and nothing else."""

from __future__ import annotations

from itertools import combinations

import networkx as nx
import numpy as np
import pytest

from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.dissections import dissections
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.verification.cut_data import Candidates
from bcut.verification.dissection import check_dissection, overlap
from bcut.verification.exact_points import ExactPoints, Simplex
from bcut.verification.hull import hull_volume


def found_by_volumes(
    configuration: PointConfiguration, *, spanning: bool = False
) -> set[tuple[Simplex, ...]]:
    """Of all inclusionwise largest sets of simplices that do not overlap, those with all of the hull's volume.

    Nothing in here knows chambers, generic points or chirotopes.
    """
    points = ExactPoints(configuration.scalars())
    candidates = Candidates(points, spanning=spanning)
    graph = nx.Graph()
    graph.add_nodes_from(s for s in combinations(range(points.n), points.dimension + 1) if s in candidates)
    pairs = combinations(list(graph), 2)
    graph.add_edges_from((a, b) for a, b in pairs if not overlap(candidates, a, b))
    volume = {simplex: points.volume(simplex) for simplex in graph}
    hull = hull_volume(points, next(iter(volume)))
    largest = (tuple(sorted(clique)) for clique in nx.find_cliques(graph))
    return {clique for clique in largest if sum(volume[simplex] for simplex in clique) == hull}


@pytest.mark.parametrize("spanning", [False, True])
@pytest.mark.parametrize(
    "instance",
    [
        "grid:3,2",
        "grid:3,3",
        "polygon:5,center",
        "polygon:6,center",
        "moae",
        "cross-polytope:3",
        "prism:3",
        "cube:3",
        "antiprism:4",
        "random:7,3,seed=1",
        "cross-polytope:4",
        "simplex-product:3,1",
    ],
)
def test_they_are_the_sets_without_overlaps_that_fill_the_hull(instance: str, spanning: bool) -> None:
    configuration = load_instance(instance)
    chirotope = Chirotope.of(configuration)
    simplices = candidate_simplices(chirotope, spanning=spanning)
    found = list(dissections(chirotope, spanning=spanning))
    assert len(set(found)) == len(found) > 0
    assert all(list(columns) == sorted(columns) for columns in found)
    by_vertices = {tuple(sorted(map(tuple, simplices[list(columns)].tolist()))) for columns in found}
    assert by_vertices == found_by_volumes(configuration, spanning=spanning)
    assert set(triangulations(chirotope, spanning=spanning)) <= set(found)


@pytest.mark.parametrize("instance", ["polygon:5,center", "random:8,2,seed=1", "cyclic:7,3"])
def test_in_general_position_they_are_the_triangulations(instance: str) -> None:
    chirotope = Chirotope.of(load_instance(instance))
    assert sorted(dissections(chirotope)) == sorted(triangulations(chirotope))


def test_products_of_triangles_have_some_that_are_no_triangulations() -> None:
    """A sample in dimension 4, where all sets without overlaps are too many to list."""
    configuration = load_instance("simplex-product:2,2")
    chirotope = Chirotope.of(configuration)
    found = list(dissections(chirotope))
    face_to_face = set(triangulations(chirotope))
    assert (len(found), len(face_to_face)) == (270, 108)
    assert face_to_face < set(found)
    points = ExactPoints(configuration.scalars())
    for number in np.random.default_rng(0).choice(len(found), size=25, replace=False).tolist():
        check_dissection(points, chirotope.bases[list(found[number])].tolist())
