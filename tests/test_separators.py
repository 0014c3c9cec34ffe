"""The built-in cut families clique, odd-cycle and convex-polygon: what they find, and that it is right."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from itertools import combinations

import networkx as nx
import numpy as np
import pytest
from numpy.typing import NDArray

from bcut.bounds.root import RootBound, root_bound
from bcut.errors import SeparatorLoadError
from bcut.families import build
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.formulation import Formulation
from bcut.geometry.chirotope import Chirotope
from bcut.objectives.objective import Objective, make_objective
from bcut.separation.driver import Separation, to_integers
from bcut.separation.graphs.cliques import heavy_cliques
from bcut.separation.graphs.odd_cycles import (
    chordless_cycle,
    heaviest_stable,
    hole_gains,
    odd_closed_walks,
    sequential_lifting,
)
from bcut.separation.resolve import resolve
from bcut.separation.seam import FractionalPoint, Problem, Separator
from bcut.separators.clique import Clique
from bcut.separators.convex_polygon import ConvexPolygon, Lines, violated_polygons
from bcut.separators.odd_cycle import OddCycle


def problem(instance: str, *, spanning: bool = False) -> Problem:
    return Problem(cocircuit_formulation(build(instance), spanning=spanning))


def ready(separator: Separator, given: Problem) -> Separator:
    separator.setup(given)
    return separator


def loop(formulation: Formulation, objective: Objective, *separators: str) -> tuple[RootBound, Separation]:
    separation = Separation([resolve(text) for text in separators], Problem(formulation))
    return root_bound(formulation, objective, separation), separation


def random_graph(size: int, density: float, random: np.random.Generator) -> NDArray[np.bool_]:
    upper = np.triu(random.random((size, size)) < density, 1)
    return upper | upper.T


def stable_sets(graph: NDArray[np.bool_]) -> list[list[int]]:
    """All stable sets: those of the nodes before one, and the same with it where it has no neighbour in them."""
    found: list[list[int]] = [[]]
    for node, row in enumerate(graph.tolist()):
        found += [[*nodes, node] for nodes in found if not any(row[other] for other in nodes)]
    return found


def cycle_graph(size: int) -> NDArray[np.bool_]:
    nodes = np.arange(size)
    return (np.abs(nodes[:, None] - nodes) % (size - 2)) == 1


# --- clique -----------------------------------------------------------------------------------------------


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


# --- odd-cycle --------------------------------------------------------------------------------------------


def least_odd_walks(graph: NDArray[np.bool_], values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Lengths of shortest odd closed walks through each node, by repeated (min, +) products of all walk lengths."""
    size = len(values)
    lengths = np.where(graph, np.maximum(0, 1 - values[:, None] - values), np.inf)
    odd, even = lengths, np.where(np.eye(size, dtype=bool), 0.0, np.inf)
    for _ in range(2 * size):
        even = np.minimum(even, (odd[:, :, None] + lengths[None]).min(axis=1))
        odd = np.minimum(odd, (even[:, :, None] + lengths[None]).min(axis=1))
    return odd.diagonal()


@pytest.mark.parametrize("seed", range(8))
def test_both_backends_find_walks_of_the_least_length(seed: int) -> None:
    random = np.random.default_rng(seed)
    graph = random_graph(15, random.choice([0.2, 0.4]), random)
    values = random.choice([0.1, 0.25, 0.4, 0.5], 15)
    least = least_odd_walks(graph, values)
    lengths = []
    for backend in ("scipy", "networkx"):
        found = {}
        for walk in odd_closed_walks(graph, values, backend):
            assert len(walk) % 2 == 1
            steps = list(zip(walk, [*walk[1:], walk[0]], strict=True))
            assert all(graph[u, v] for u, v in steps)
            found[walk[0]] = sum(max(0.0, 1 - values[u] - values[v]) for u, v in steps)
        assert set(found) >= set(np.flatnonzero(least < 1.1 - 1e-9).tolist())
        for node, length in found.items():
            assert length == pytest.approx(least[node])
        lengths.append(found)
    assert lengths[0] == pytest.approx(lengths[1])


@pytest.mark.parametrize("backend", ["scipy", "networkx"])
def test_both_backends_cut_the_same_point_as_deeply(backend: str) -> None:
    given = problem("random:12,3,seed=1000", spanning=True)
    x = root_bound(given.formulation, make_objective("cardinality", given.formulation)).point
    assert x is not None
    point = FractionalPoint(given, x)
    cuts = list(ready(OddCycle(backend=backend, lift=0), given).separate(point))
    assert cuts
    assert max(point.value(cut) - float(cut.rhs) for cut in cuts) == pytest.approx(0.5)


def test_a_walk_becomes_a_cycle_without_chords_that_is_no_less_violated() -> None:
    random = np.random.default_rng(3)
    lengths = []
    for _ in range(200):
        graph = random_graph(14, 0.3, random)
        # Edges are satisfied: the values of two neighbours add up to 1 at most.
        values = random.choice([0.3, 0.4, 0.5], 14)
        for walk in odd_closed_walks(graph, values):
            cycle = chordless_cycle(walk, graph)
            size = len(cycle)
            assert size % 2 == 1
            assert len(set(cycle)) == size
            among = graph[np.ix_(cycle, cycle)]
            assert (among == (cycle_graph(size) if size > 3 else ~np.eye(3, dtype=bool))).all()
            assert values[cycle].sum() - (size - 1) / 2 >= values[walk].sum() - (len(walk) - 1) / 2 - 1e-9
            lengths.append(size)
    assert {3, 5} <= set(lengths)


def test_a_long_walk_with_repetitions_and_chords_is_cut_down() -> None:
    graph = np.zeros((9, 9), dtype=bool)
    for u, v in [(0, 1), (1, 2), (2, 0), (2, 3), (3, 4), (4, 5), (5, 6), (6, 2), (5, 7)]:
        graph[u, v] = graph[v, u] = True
    # There and back again, then round the triangle.
    assert sorted(chordless_cycle([3, 2, 1, 0, 2], graph)) == [0, 1, 2]
    assert sorted(chordless_cycle([7, 5, 6, 2, 3, 4, 5], graph)) == [2, 3, 4, 5, 6]


@pytest.mark.parametrize("size", [3, 5, 7, 9])
def test_gains_count_what_a_column_takes_away(size: int) -> None:
    graph = cycle_graph(size) if size > 3 else ~np.eye(3, dtype=bool)
    patterns = np.array([[mask >> i & 1 for mask in range(1 << size)] for i in range(size)], dtype=bool)
    stable = stable_sets(graph)
    gains = hole_gains(patterns)
    for pattern, gain in zip(patterns.T, gains.tolist(), strict=True):
        most = max(len(nodes) for nodes in stable if not pattern[nodes].any())
        assert gain == (size - 1) // 2 - most


def test_the_heaviest_stable_set_is_exact_up_to_the_cap() -> None:
    random = np.random.default_rng(5)
    for _ in range(40):
        graph = random_graph(9, 0.4, random)
        weights = dict(enumerate(random.integers(1, 4, 9).tolist()))
        adjacent = [sum(1 << int(j) for j in np.flatnonzero(row)) for row in graph]
        best = max(sum(weights[i] for i in nodes) for nodes in stable_sets(graph))
        for cap in (1, 3, 100):
            assert heaviest_stable((1 << 9) - 1, adjacent, weights, cap) == min(cap, best)


@pytest.mark.parametrize("size", [3, 5, 7])
def test_lifted_cycles_are_valid_and_no_coefficient_can_grow(size: int) -> None:
    random = np.random.default_rng(size)
    grown = 0
    for _ in range(25):
        graph = random_graph(size + 5, 0.75, random)
        graph[:size, :size] = cycle_graph(size) if size > 3 else ~np.eye(3, dtype=bool)
        coefficients = np.concatenate((np.ones(size, dtype=int), sequential_lifting(size, graph, 5)))
        left_sides = [(sum(coefficients[node] for node in nodes), nodes) for nodes in stable_sets(graph)]
        assert max(left for left, _ in left_sides) == (size - 1) // 2
        last = size + 4
        with_last = [left for left, nodes in left_sides if last in nodes]
        assert max(with_last) == (size - 1) // 2 or coefficients[last] == 0
        grown += int((coefficients[size:] > 0).sum())
    assert grown > 0


def test_a_hub_gets_the_whole_right_hand_side_and_lifting_stops_when_told() -> None:
    graph = np.zeros((9, 9), dtype=bool)
    graph[:7, :7] = cycle_graph(7)
    graph[7:, :7] = graph[:7, 7:] = True
    assert sequential_lifting(7, graph, 2).tolist() == [3, 0], "two hubs that do not cross share it"
    graph[7, 8] = graph[8, 7] = True
    assert sequential_lifting(7, graph, 2).tolist() == [3, 3]
    assert sequential_lifting(7, graph, 1).tolist() == [3, 0]


def test_the_pentagon_with_centre_of_the_paper() -> None:
    """Sec. 2.5: the relaxation gives 0; odd-cycle cuts raise it to 1; the convex polygon cut is redundant."""
    formulation = cocircuit_formulation(build("polygon:5,center"))
    # The paper's corners 1..5 are 0..4 here, and its centre 0 is 5.
    free = ["123", "234", "345", "145", "125", "013", "024", "035", "014", "025"]
    simplices = {tuple(sorted((int(v) - 1) % 6 for v in text)) for text in free}
    costs = np.array([int(tuple(simplex) not in simplices) for simplex in formulation.simplices.tolist()])
    assert costs.sum() == 10
    bound, separation = loop(formulation, Objective("paper", "min", costs), "odd-cycle", "convex-polygon")
    assert bound.lp == pytest.approx(0)
    assert bound.lp_after_cuts == pytest.approx(1)
    assert separation.statistics["odd-cycle"].added > 0
    assert separation.statistics["convex-polygon"].calls > 0
    assert separation.statistics["convex-polygon"].found == 0


def test_the_fractional_point_of_the_paper_is_cut_off() -> None:
    formulation = cocircuit_formulation(build("polygon:5,center"))
    without_centre = formulation.columns_of(np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4], [0, 3, 4], [0, 1, 4]]))
    with_centre = formulation.columns_of(np.array([[0, 2, 5], [1, 3, 5], [2, 4, 5], [0, 3, 5], [1, 4, 5]]))
    given = Problem(formulation)
    x = np.zeros(20)
    x[without_centre] = 0.5
    (cut,) = ready(OddCycle(lift=0), given).separate(FractionalPoint(given, x))
    assert sorted(np.asarray(cut.simplices).tolist()) == sorted(without_centre.tolist())
    assert cut.rhs == 2
    x[with_centre] = 0.5
    assert (formulation.matrix @ x == formulation.lower).all(), "it is a point of Formulation 2"
    point = FractionalPoint(given, x)
    cuts = list(ready(OddCycle(), given).separate(point))
    assert len(cuts) > 1
    assert all(point.value(cut) >= 2.5 and cut.rhs == 2 for cut in cuts)


@pytest.mark.parametrize(
    ("instance", "before", "after"),
    [
        ("random:12,3,seed=1000", 16.5, 17),
        ("random:14,3,seed=1000", 20.5, 21),
        ("random:16,3,seed=1000", 24.5, 25),
    ],
)
def test_lifted_odd_cycles_close_the_gap(instance: str, before: float, after: float) -> None:
    formulation = cocircuit_formulation(build(instance), spanning=True)
    bound, _ = loop(formulation, make_objective("cardinality", formulation), "clique", "odd-cycle")
    assert bound.lp == pytest.approx(before)
    assert bound.lp_after_cuts == pytest.approx(after)


def test_cliques_close_half_of_a_gap() -> None:
    formulation = cocircuit_formulation(build("random:20,3,seed=1001"), spanning=True)
    bound, _ = loop(formulation, make_objective("cardinality", formulation), "clique")
    assert bound.lp == pytest.approx(34 + 1 / 3)
    assert bound.lp_after_cuts is not None
    assert bound.lp_after_cuts > 34.49


# --- convex-polygon ---------------------------------------------------------------------------------------


def polygons_by_trying_all(chirotope: Chirotope) -> list[set[int]]:
    """All sets of points that are all points of their hull, with none inside it, from orientations alone."""

    def turn(a: int, b: int, c: int) -> int:
        if len({a, b, c}) < 3:
            return 0
        order = sorted((a, b, c))
        swaps = (a > b) + (a > c) + (b > c)
        return int(chirotope.orientations(np.array(order))) * (-1) ** swaps

    def inside(point: int, corners: tuple[int, ...]) -> bool:
        """Strictly inside the hull: every line through the point has corners strictly on both sides."""
        others = [q for q in corners if q != point]
        signs = [{turn(point, q, r) for r in others} for q in others]
        return all({1, -1} <= found for found in signs)

    def in_hull(point: int, corners: tuple[int, ...]) -> bool:
        for a, b, c in combinations(corners, 3):
            side = turn(a, b, c)
            if side and all(turn(*edge, point) * side >= 0 for edge in ((a, b), (b, c), (c, a))):
                return True
        return False

    result = []
    for size in range(3, chirotope.n + 1):
        for corners in combinations(range(chirotope.n), size):
            if not any(turn(*triple) for triple in combinations(corners, 3)):
                continue
            contained = [p for p in range(chirotope.n) if p in corners or in_hull(p, corners)]
            if tuple(contained) == corners and not any(inside(p, corners) for p in corners):
                result.append(set(corners))
    return result


@pytest.mark.parametrize(
    "instance",
    [
        "random:8,2,seed=1",
        "random:8,2,seed=2",
        "grid:3,3",
        "grid:4,2",
        "polygon:7",
        "moae",
        "polygon:6,center",
    ],
)
def test_polygon_separation_is_exact(instance: str) -> None:
    given = problem(instance)
    lines, polygons = Lines(given.chirotope), polygons_by_trying_all(given.chirotope)
    random = np.random.default_rng(7)
    count, fired = len(given.simplices), 0
    for _ in range(15):
        x = np.where(random.random(count) < random.choice([0.2, 0.5, 1.0]), random.random(count), 0.0)
        x *= random.choice([0.2, 0.5, 1.0])
        best = max(
            sum(x[i] for i, simplex in enumerate(given.simplices.tolist()) if set(simplex) <= polygon)
            - len(polygon)
            + 2
            for polygon in polygons
        )
        support = np.flatnonzero(x)
        found = violated_polygons(lines, given.simplices[support], x[support], effort=10**6)
        assert all(set(polygon) in polygons for polygon, _ in found)
        if best > 1e-3:
            fired += 1
            assert found[0][1] == pytest.approx(best, abs=1e-4)
        elif best < 0:
            assert found == []
    assert fired


def test_points_in_convex_position_need_no_branching() -> None:
    """24 points have 2**24 polygons; minimum cuts find the best at once."""
    given = problem("polygon:24")
    x = np.where(np.random.default_rng(0).random(len(given.simplices)) < 0.1, 0.3, 0.0)
    support = np.flatnonzero(x)
    found = violated_polygons(
        Lines(given.chirotope), given.simplices[support], x[support], effort=len(support)
    )
    assert found[0][0] == list(range(24))
    assert found[0][1] == pytest.approx(x.sum() - 22)


@pytest.mark.parametrize(
    ("instance", "spanning"),
    [
        ("random:12,2,seed=1", True),
        ("random:9,2,seed=2", False),
        ("grid:4,4", True),
        ("grid:3,3", False),
        ("polygon:9", False),
        ("polygon:5,center", False),
        ("random:25,2,seed=3", True),
    ],
)
def test_polygon_cuts_never_fire_in_formulation_2(instance: str, spanning: bool) -> None:
    """Conjecture 1 of the paper, at vertices of the relaxation and at mixtures of them."""
    given = problem(instance, spanning=spanning)
    separator = ready(ConvexPolygon(), given)
    random = np.random.default_rng(11)
    vertices = []
    for _ in range(6):
        costs = random.integers(-20, 20, len(given.simplices))
        found = root_bound(given.formulation, Objective("random", "min", costs)).point
        assert found is not None
        vertices.append(found)
    mixtures = [random.dirichlet(np.ones(6)) @ np.array(vertices) for _ in range(6)]
    for x in [*vertices, *mixtures]:
        assert list(separator.separate(FractionalPoint(given, x))) == []


def test_polygon_cuts_fire_outside_formulation_2() -> None:
    """Half of every triangle of a pentagon satisfies all crossings (Formulation 0), but is 5 triangles where 3 fit."""
    given = problem("polygon:5")
    x = np.full(10, 0.5)
    rows, columns = np.nonzero(given.crossings(np.arange(10)))
    assert (x[rows] + x[columns] <= 1).all()
    cut = next(iter(ready(ConvexPolygon(), given).separate(FractionalPoint(given, x))))
    assert sorted(np.asarray(cut.simplices).tolist()) == list(range(10))
    assert cut.rhs == 3
    assert cut.proof == {"polygon": [0, 1, 2, 3, 4]}


def test_polygon_cuts_count_points_inside_an_edge() -> None:
    """A triangle with a point in the middle of each edge has room for four triangles, not for one."""
    formulation = cocircuit_formulation(build("grid:3,3"))
    given = Problem(formulation)
    # Corners 0, 2, 6 and the points between them: the lower left half of the grid.
    corners = {0, 1, 2, 3, 4, 6}
    inside = [set(simplex) <= corners for simplex in formulation.simplices.tolist()]
    point = FractionalPoint(given, np.where(inside, 0.45, 0.0))
    cuts = {tuple(cut.proof["polygon"]): cut for cut in ready(ConvexPolygon(), given).separate(point)}
    assert tuple(sorted(corners)) in cuts
    assert cuts[tuple(sorted(corners))].rhs == 4


def test_polygon_cuts_are_for_the_plane() -> None:
    given = problem("cube:3")
    point = FractionalPoint(given, np.full(len(given.simplices), 0.9))
    assert list(ready(ConvexPolygon(), given).separate(point)) == []


def test_small_effort_ends_the_polygon_search() -> None:
    given = problem("grid:4,4", spanning=True)
    point = FractionalPoint(given, np.full(len(given.simplices), 0.9))
    separator = ready(ConvexPolygon(effort=1, max_cuts=3), given)
    assert len(list(separator.separate(point))) <= 3


# --- all of them ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["clique", "odd-cycle", "convex-polygon"])
def test_every_cut_is_violated_and_says_why(name: str) -> None:
    given = problem("grid:3,3")
    separator = ready(resolve(name), given)
    point = FractionalPoint(given, np.where(np.arange(len(given.simplices)) % 3 == 0, 0.6, 0.1))
    cuts = list(separator.separate(point))
    assert cuts
    for cut in cuts:
        assert to_integers(cut, name, len(given.simplices)).violation(point.x) > 0
        assert cut.proof


@pytest.mark.parametrize(
    "text",
    [
        "clique:max_cuts=0",
        "clique:lift=-1",
        "clique:effort=0",
        "odd-cycle:max_cuts=0",
        "odd-cycle:backend=scip",
        "odd-cycle:max_nodes=0",
        "convex-polygon:effort=0",
        "convex-polygon:depth=3",
    ],
)
def test_bad_parameters_are_refused(text: str) -> None:
    with pytest.raises(SeparatorLoadError, match=text.split(":")[0]):
        resolve(text)


def test_families_load_without_heavy_imports() -> None:
    code = (
        "import sys; from bcut.separation.resolve import available; available();"
        "print([name for name in ('scipy', 'networkx', 'highspy', 'pyscipopt') if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_remembered_rows_are_those_of_the_crossing_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    from bcut.separation import seam

    whole = problem("cube:3")
    columns = np.array([7, 3, 50, 3])
    expected = whole.crossings(columns, np.arange(58))
    monkeypatch.setattr(seam, "_SMALL", 0)
    monkeypatch.setattr(seam, "_ROW_CACHE", 16)
    given = problem("cube:3")
    for _ in range(2):
        assert (given.crossing_rows(columns) == expected).all()
    assert (given.crossings(columns, np.arange(58)) == expected).all()
    assert given.crossing_rows(np.empty(0, dtype=np.int64)).shape == (0, 58)


def test_near_simplices_come_first() -> None:
    given = problem("random:8,3,seed=1")
    columns = np.array([0, 1])
    ordered = given.nearest_first(np.arange(len(given.simplices)), columns)
    occurrences = np.bincount(given.simplices[columns].ravel(), minlength=8)
    shared = occurrences[given.simplices[ordered]].sum(axis=1)
    assert (np.diff(shared) <= 0).all()
    assert sorted(ordered.tolist()) == list(range(len(given.simplices)))


def test_the_heaviest_columns_and_their_crossings() -> None:
    given = problem("cube:3")
    x = np.linspace(0, 1, 58)
    point = FractionalPoint(given, x)
    assert point.heaviest(3).tolist() == [54, 55, 56]
    assert (point.crossings_among(point.heaviest(3)) == given.crossings(np.array([54, 55, 56]))).all()
    assert point.crossings_among(point.heaviest(100)) is point.crossings
