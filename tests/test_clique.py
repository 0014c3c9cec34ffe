"""Clique cuts: heavy cliques are found, lifted and limited, and what they do to a bound."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import networkx as nx
import numpy as np
import pytest
from cut_families import loop, problem, random_graph, ready
from numpy.typing import NDArray

from bcut.bounds.root import root_bound
from bcut.families import build
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.objectives.objective import make_objective
from bcut.separation.graphs.cliques import heavy_cliques
from bcut.separation.seam import FractionalPoint, Problem
from bcut.separators.clique import Clique
from bcut.separators.odd_cycle import OddCycle


def test_a_heavy_clique_is_found_exactly_where_there_is_one() -> None:
    random = np.random.default_rng(0)
    answers = []
    for _ in range(60):
        graph = random_graph(12, random.choice([0.3, 0.6]), random)
        values = random.random(12) * 0.6
        weights = {node: {"weight": round(value * 1e6)} for node, value in enumerate(values)}
        whole = nx.from_numpy_array(graph)
        nx.set_node_attributes(whole, weights)
        heaviest = nx.max_weight_clique(whole, "weight")[1] / 1e6
        found = heavy_cliques(graph, values, effort=1_000_000)
        for clique in found:
            assert all(graph[i, j] for i, j in combinations(clique, 2))
            assert values[clique].sum() > 1
        answers.append(bool(found))
        assert answers[-1] == (heaviest > 1.0001)
    assert any(answers)
    assert not all(answers)


def test_little_effort_still_gives_cliques() -> None:
    graph = random_graph(60, 0.7, np.random.default_rng(1))
    for clique in heavy_cliques(graph, np.full(60, 0.4), effort=1):
        assert all(graph[i, j] for i, j in combinations(clique, 2))


def three_that_cross(given: Problem) -> NDArray[np.int64]:
    """Three simplices that cross pairwise, at most two of which contain any generic point."""
    from bcut.geometry.generic_point import simplices_containing_generic_point

    crossing = given.crossings(np.arange(len(given.simplices)))
    for triple in combinations(range(len(crossing)), 3):
        rows = list(triple)
        if crossing[np.ix_(rows, rows)].sum() == 6:
            flags = [flag for simplex in given.simplices.tolist() for flag in (simplex, simplex[::-1])]
            covered = [
                simplices_containing_generic_point(
                    given.chirotope, given.simplices[rows], np.array(flag)
                ).sum()
                for flag in flags
            ]
            if max(covered) < 3:
                return np.array(rows)
    raise AssertionError("there are such triples")


def test_a_clique_without_a_common_point_is_cut_and_lifted() -> None:
    given = problem("random:7,3,seed=1")
    three = three_that_cross(given)
    x = np.zeros(len(given.simplices))
    x[three] = 0.5
    point = FractionalPoint(given, x)
    (bare,) = ready(Clique(lift=0), given).separate(point)
    assert list(bare.simplices) == three.tolist()
    assert bare.rhs == 1
    (cut,) = ready(Clique(), given).separate(point)
    members = np.asarray(cut.simplices)
    crossing = given.crossings(members)
    assert set(three.tolist()) < set(members.tolist())
    assert (crossing | np.eye(len(members), dtype=bool)).all(), "all members cross each other"
    others = given.crossing_rows(members).all(axis=0)
    assert not others.any(), "nothing is left that crosses all of them"


def test_simplices_over_a_common_point_are_no_cut_in_formulation_2() -> None:
    given = problem("cube:3")
    objective = make_objective("cardinality", given.formulation)
    x = root_bound(given.formulation, objective).point
    other = root_bound(given.formulation, replace(objective, sense="max")).point
    assert x is not None
    assert other is not None
    assert list(ready(Clique(), given).separate(FractionalPoint(given, (x + other) / 2))) == []


def test_max_cuts_and_max_nodes_are_respected() -> None:
    given = problem("random:8,3,seed=1")
    point = FractionalPoint(given, np.full(len(given.simplices), 0.5))
    for family in (Clique, OddCycle):
        assert len(list(ready(family(max_cuts=2), given).separate(point))) <= 2
        few = list(ready(family(max_nodes=5, lift=0), given).separate(point))
        assert {column for cut in few for column in np.asarray(cut.simplices).tolist()} <= set(range(5))


def test_cliques_close_half_of_a_gap() -> None:
    formulation = cocircuit_formulation(build("random:20,3,seed=1001"), spanning=True)
    bound, _ = loop(formulation, make_objective("cardinality", formulation), "clique")
    assert bound.lp == pytest.approx(34 + 1 / 3)
    assert bound.lp_after_cuts is not None
    assert bound.lp_after_cuts > 34.49
