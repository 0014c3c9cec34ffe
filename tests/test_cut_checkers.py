"""Checkers of cuts: no triangulation exceeds the right-hand side that they derive, whatever the cut."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bcut.errors import VerificationError
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.triangulations import triangulations
from bcut.instance import load_instance
from bcut.verification import heavy_sets, sphere_cuts
from bcut.verification.cuts import CUT_CHECKERS, Candidates, CertificateCut, UncheckedError
from bcut.verification.exact_points import ExactPoints, SideTable
from bcut.verification.heavy_sets import HeavySets

Simplex = tuple[int, ...]

HUGE = Fraction(10**9)


def cut(
    family: str, coefficients: dict[Simplex, int], rhs: Fraction | int, proof: dict[str, Any]
) -> CertificateCut:
    values = tuple(map(Fraction, coefficients.values()))
    return CertificateCut(family, tuple(coefficients), values, Fraction(rhs), Fraction(0), proof)


class Configuration:
    """A small configuration with all its triangulations."""

    def __init__(self, name: str, *, spanning: bool = False) -> None:
        self.configuration: PointConfiguration = load_instance(name)
        self.points = ExactPoints(self.configuration.scalars())
        self.sides = Candidates(self.points, spanning=spanning)
        self.n, self.d = self.points.n, self.points.dimension
        self.simplices = [s for s in combinations(range(self.n), self.d + 1) if s in self.sides]
        chirotope = Chirotope.of(self.configuration)
        rows = [tuple(row) for row in candidate_simplices(chirotope, spanning=spanning).tolist()]
        found = triangulations(chirotope, spanning=spanning)
        self.triangulations = [{rows[row] for row in chosen} for chosen in found]

    def most(self, coefficients: dict[Simplex, int]) -> int:
        return max(sum(coefficients.get(s, 0) for s in t) for t in self.triangulations)


SMALL = {
    "a point inside": Configuration("polygon:5,center"),
    "aligned points": Configuration("grid:3,3"),
    "aligned points, all used": Configuration("grid:3,3", spanning=True),
    "space": Configuration("random:7,3,seed=5"),
    "an edge inside": Configuration("random:8,3,seed=3", spanning=True),
    "degenerate space": Configuration("cube:3"),
}


def interior_faces(config: Configuration) -> list[Simplex]:
    found = []
    for face in combinations(range(config.n), config.d - 1):
        try:
            CUT_CHECKERS["link"](config.sides, cut("link", {}, 0, {"face": list(face)}))
        except VerificationError:
            continue
        found.append(face)
    return found


@pytest.mark.parametrize("name", ["a point inside", "aligned points", "an edge inside"])
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_walks_around_a_face_bound_every_inequality_over_its_star(name: str, data: st.DataObject) -> None:
    config = SMALL[name]
    face = data.draw(st.sampled_from(interior_faces(config)))
    star = [simplex for simplex in config.simplices if set(face) <= set(simplex)]
    drawn = data.draw(st.lists(st.integers(-3, 3), min_size=len(star), max_size=len(star)))
    coefficients = dict(zip(star, drawn, strict=True))
    derived = CUT_CHECKERS["link"](config.sides, cut("link", coefficients, HUGE, {"face": list(face)}))
    assert derived >= config.most(coefficients)
    # Nothing smaller is accepted.
    assert (
        CUT_CHECKERS["link"](config.sides, cut("link", coefficients, derived, {"face": list(face)}))
        == derived
    )
    with pytest.raises(VerificationError, match="wind around it once"):
        CUT_CHECKERS["link"](config.sides, cut("link", coefficients, derived - 1, {"face": list(face)}))


@pytest.mark.parametrize("name", ["a point inside", "an edge inside"])
def test_three_simplices_and_no_fewer_surround_a_face(name: str) -> None:
    config = SMALL[name]
    for face in interior_faces(config):
        star = [simplex for simplex in config.simplices if set(face) <= set(simplex)]
        least = CUT_CHECKERS["link"](
            config.sides, cut("link", dict.fromkeys(star, 1), HUGE, {"face": list(face)})
        )
        assert least >= config.most(dict.fromkeys(star, 1)) >= 3
        # A triangulation without the face has none of them: less than nothing does not follow.
        proof = {"face": list(face)}
        assert CUT_CHECKERS["link"](config.sides, cut("link", dict.fromkeys(star, -1), 0, proof)) == 0


def test_a_face_of_the_boundary_has_no_link_cuts() -> None:
    sides = SMALL["a point inside"].sides
    with pytest.raises(VerificationError, match="lies in a facet"):
        CUT_CHECKERS["link"](sides, cut("link", {}, 0, {"face": [1]}))
    assert interior_faces(SMALL["a point inside"]) == [(5,)]


def test_three_points_on_a_line_have_no_link_cuts() -> None:
    sides = Candidates(ExactPoints(load_instance("grid:3,2,2,2").scalars()))
    tetrahedra = [s for s in combinations(range(24), 4) if any(sides[s])]
    (line, *_) = [f for f in combinations(range(24), 3) if not any(set(f) <= set(s) for s in tetrahedra)]
    with pytest.raises(VerificationError, match="affinely dependent"):
        CUT_CHECKERS["link"](sides, cut("link", {}, 0, {"face": list(line)}))


@pytest.mark.parametrize("face", [None, [0, 1], [99], "x", [0.5]])
def test_a_link_cut_needs_its_face(face: Any) -> None:
    with pytest.raises(VerificationError, match="face"):
        CUT_CHECKERS["link"](SMALL["a point inside"].sides, cut("link", {}, 0, {"face": face}))


@pytest.mark.parametrize("name", ["a point inside", "aligned points", "space", "degenerate space"])
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_lifted_cycles_that_pass_are_valid(name: str, data: st.DataObject) -> None:
    config = SMALL[name]
    crossing = {
        (a, b): config.sides.crossing(a, b) for a in config.simplices for b in config.simplices if a != b
    }
    size = data.draw(st.sampled_from([3, 5]))
    start = data.draw(st.sampled_from(config.simplices))
    cycle = [start]
    while len(cycle) < size:
        last = len(cycle) == size - 1
        following = [
            s
            for s in config.simplices
            if s not in cycle and crossing[cycle[-1], s] and (not last or crossing[s, start])
        ]
        if not following:
            return
        cycle.append(data.draw(st.sampled_from(following)))
    rest = [s for s in config.simplices if s not in cycle]
    lifted = data.draw(st.lists(st.sampled_from(rest), max_size=4, unique=True)) if rest else []
    coefficients = dict.fromkeys(cycle, 1) | {s: data.draw(st.integers(1, 2)) for s in lifted}
    rhs = (size - 1) // 2
    proof = {"cycle": [list(s) for s in cycle], "lifted": [list(s) for s in lifted]}
    asked = cut("odd-cycle", coefficients, rhs, proof)
    if heaviest(coefficients, crossing) <= rhs:
        assert CUT_CHECKERS["odd-cycle"](config.sides, asked) == rhs
        assert config.most(coefficients) <= rhs
    else:
        with pytest.raises(VerificationError, match="is larger than what lifting it gives"):
            CUT_CHECKERS["odd-cycle"](config.sides, asked)


def heaviest(coefficients: dict[Simplex, int], crossing: dict[tuple[Simplex, Simplex], bool]) -> int:
    """The largest weight of simplices that do not cross each other, by trying all sets."""
    best = 0
    for count in range(1, len(coefficients) + 1):
        for chosen in combinations(coefficients, count):
            if not any(crossing[a, b] for a, b in combinations(chosen, 2)):
                best = max(best, sum(coefficients[s] for s in chosen))
    return best


@pytest.mark.parametrize(
    ("proof", "says"),
    [
        ({}, "has no list 'cycle'"),
        ({"cycle": []}, "has no list 'lifted'"),
        ({"cycle": [], "lifted": []}, "its cycle has 0 simplices"),
        ({"cycle": [[0, 1]], "lifted": []}, "which is no simplex"),
        ({"cycle": [[0, 1, 99]], "lifted": []}, "which is no simplex"),
        ({"cycle": [[0, 1, 2], [0, 1, 3], [0, 1, 2]], "lifted": []}, "name each of its simplices once"),
        ({"cycle": [[0, 1, 2], [0, 2, 3], [0, 3, 4]], "lifted": []}, "do not cross"),
    ],
)
def test_an_odd_cycle_needs_its_proof(proof: dict[str, Any], says: str) -> None:
    sides = SMALL["a point inside"].sides
    with pytest.raises(VerificationError, match=says):
        CUT_CHECKERS["odd-cycle"](sides, cut("odd-cycle", {(0, 1, 2): 1}, 1, proof))


@given(st.data())
def test_the_search_for_heavy_sets_agrees_with_all_sets(data: st.DataObject) -> None:
    size = data.draw(st.integers(1, 8))
    crossing = {pair for pair in combinations(range(size), 2) if data.draw(st.booleans())}
    weights = [Fraction(data.draw(st.integers(-1, 4)), data.draw(st.integers(1, 3))) for _ in range(size)]
    start = data.draw(st.integers(0, size - 1))

    def heaviest_with(last: int) -> Fraction:
        """The largest weight of a set that has this node, and no later one."""
        return max(
            sum((weights[v] for v in chosen), weights[last])
            for k in range(last + 1)
            for chosen in combinations(range(last), k)
            if not crossing & set(combinations((*chosen, last), 2))
        )

    by_last = [heaviest_with(last) for last in range(size)]
    # The limits at which the answer changes, and some just below and above them.
    limits = {max(Fraction(0), weight + step * Fraction(1, 12)) for weight in by_last for step in (-1, 0, 1)}
    for limit in limits:
        expected = next(
            (v for v in range(start, size) if weights[v] > 0 and by_last[v] > limit),
            None,
        )
        found = HeavySets(weights, lambda a, b: (a, b) in crossing).first_excess(start, limit)
        assert found == expected


def circles(count: int, *, length: int = 5) -> HeavySets:
    """Separate cycles: no two neighbours in one of five is two nodes at most, but its cover by cliques has three."""

    def crossing(first: int, second: int) -> bool:
        return first // length == second // length and (second - first) % length in (1, length - 1)

    return HeavySets([Fraction(1)] * (length * count), crossing)


def test_what_a_cover_by_cliques_bounds_takes_no_steps() -> None:
    # All 2 ** 60 sets of sixty nodes would be looked at otherwise.
    alone = HeavySets([Fraction(1, 3)] * 60, lambda first, second: False)
    assert alone.first_excess(0, 20) is None
    assert alone.steps == 0
    assert alone.first_excess(0, 19) == 57
    triangles = circles(20, length=3)
    assert triangles.first_excess(0, 20) is None
    assert triangles.steps == 0
    assert triangles.first_excess(0, Fraction(39, 2)) == 57


def test_a_proof_that_would_keep_the_check_busy_is_not_called_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    assert circles(4).first_excess(0, 8) is None
    assert circles(4).first_excess(0, 7) == 17
    monkeypatch.setattr(heavy_sets, "_MOST_STEPS", 5000)
    search = circles(20)
    says = "more than 5,000 steps to check a cut over 100 simplices or faces"
    with pytest.raises(UncheckedError, match=says) as caught:
        search.first_excess(0, 40)
    assert not isinstance(caught.value, VerificationError)
    assert caught.value.exit_status == 3
    # The steps of all nodes are counted together.
    assert search.steps == 5001
    with pytest.raises(UncheckedError):
        search.first_excess(0, 40)


def test_a_sphere_cut_that_takes_too_long_is_not_called_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    config = SMALL["space"]
    star = [simplex for simplex in config.simplices if 0 in simplex]
    proof = {"face": [0], "alpha": 1, "direction": list(star[0]), "light": [[list(s), 0] for s in star]}
    asked = cut("sphere", {}, 0, proof)
    with pytest.raises(VerificationError, match="but one weighs 0"):
        CUT_CHECKERS["sphere"](config.sides, asked)
    monkeypatch.setattr(sphere_cuts, "_BRANCHES", 2)
    with pytest.raises(UncheckedError, match=r"more than 2 branches to check a sphere cut at \[0\]"):
        CUT_CHECKERS["sphere"](config.sides, asked)


def test_polygons_have_room_for_two_triangles_less_than_points() -> None:
    hexagon = Configuration("polygon:6")
    coefficients = dict.fromkeys(hexagon.simplices, 1)
    check = CUT_CHECKERS["convex-polygon"]
    for size in range(3, 7):
        for polygon in combinations(range(6), size):
            inside = {s: 1 for s in coefficients if set(s) <= set(polygon)}
            derived = check(hexagon.sides, cut("convex-polygon", inside, HUGE, {"polygon": list(polygon)}))
            assert derived == size - 2 >= hexagon.most(inside)
    # Points inside an edge count; points inside the polygon do not belong to it.
    grid = SMALL["aligned points"]
    boundary = [v for v in range(9) if v != 4]
    inside = {s: 1 for s in grid.simplices if 4 not in s}
    proof = {"polygon": boundary}
    assert check(grid.sides, cut("convex-polygon", inside, HUGE, proof)) == 6 >= grid.most(inside)
    with pytest.raises(VerificationError, match="6 is all that 8 points give"):
        check(grid.sides, cut("convex-polygon", inside, 5, proof))
    with pytest.raises(VerificationError, match="point 4 lies inside"):
        check(grid.sides, cut("convex-polygon", inside, 7, {"polygon": list(range(9))}))
    with pytest.raises(VerificationError, match="is no triangle with vertices in its polygon"):
        check(grid.sides, cut("convex-polygon", {**inside, (0, 1, 4): 1}, 6, proof))
    with pytest.raises(VerificationError, match="belongs to the plane"):
        check(SMALL["space"].sides, cut("convex-polygon", {}, 0, proof))


@pytest.mark.parametrize("polygon", [None, [0, 1], [0, 0, 1], [0, 1, 99]])
def test_a_polygon_cut_needs_its_polygon(polygon: Any) -> None:
    with pytest.raises(VerificationError, match="polygon"):
        CUT_CHECKERS["convex-polygon"](
            SMALL["a point inside"].sides, cut("convex-polygon", {}, 9, {"polygon": polygon})
        )


def test_candidates_are_what_triangulations_can_be_made_of() -> None:
    for name, config in SMALL.items():
        used = {simplex for t in config.triangulations for simplex in t}
        assert used <= set(config.simplices), name
    spanning, free = SMALL["aligned points, all used"], SMALL["aligned points"]
    assert set(spanning.simplices) < set(free.simplices)
    some = free.sides.only(free.simplices[:3])
    assert [s for s in free.simplices if s in some] == free.simplices[:3]
    assert all(s in free.sides for s in free.simplices)


def test_a_plain_table_of_sides_means_that_every_simplex_is_a_candidate() -> None:
    config = SMALL["aligned points"]
    plain = SideTable(config.points)
    star = [s for s in config.simplices if 4 in s]
    rng = np.random.default_rng(0)
    coefficients = dict(zip(star, rng.integers(-2, 3, len(star)).tolist(), strict=True))
    asked = cut("link", coefficients, HUGE, {"face": [4]})
    assert CUT_CHECKERS["link"](plain, asked) == CUT_CHECKERS["link"](config.sides, asked)
