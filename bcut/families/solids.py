"""Platonic and Archimedean solids, the 24-cell and the 600-cell, in Q, Q(sqrt 2) or Q(sqrt 5).

Each solid is the union of the orbits of a few points: the signs of the coordinates are changed in all ways,
and the coordinates permuted cyclically (the even permutations of three) or in all ways. Points are listed
orbit by orbit, the permutations in lexicographic order, the sign changes innermost. The snub solids are
missing: they need cubic fields.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from typing import Any

from bcut.families.parameters import Parameters
from bcut.geometry.numbers import AlgebraicNumber, parse_number

Number = int | Fraction | AlgebraicNumber
Point = tuple[Number, ...]


def solid(name: str) -> Callable[[Parameters], list[Point]]:
    """Return the builder of a solid by its name."""

    def build(parameters: Parameters) -> list[Point]:
        points = SOLIDS[name][1]()
        parameters.finish(len(points), len(points[0]))
        return points

    return build


def _signed(point: Sequence[Number]) -> Iterator[Point]:
    for signs in itertools.product((1, -1), repeat=len(point)):
        yield tuple(sign * value if sign < 0 else value for sign, value in zip(signs, point, strict=True))


def _is_even(permutation: Sequence[int]) -> bool:
    return sum(a > b for a, b in itertools.combinations(permutation, 2)) % 2 == 0


def _orbits(seeds: Iterable[Sequence[Number]], *, even: bool) -> list[Point]:
    """All images of the seeds under sign changes and (even or all) permutations, each once."""
    found: dict[Point, None] = {}
    for seed in seeds:
        for permutation in itertools.permutations(range(len(seed))):
            if not even or _is_even(permutation):
                found.update(dict.fromkeys(_signed([seed[i] for i in permutation])))
    return list(found)


def _all(*seeds: Sequence[Any]) -> Callable[[], list[Point]]:
    """Orbits under all permutations and sign changes; texts are parsed when they are needed."""
    return lambda: _orbits([[_number(value) for value in seed] for seed in seeds], even=False)


def _cyclic(*seeds: Sequence[Any]) -> Callable[[], list[Point]]:
    """Orbits under the even permutations and all sign changes."""
    return lambda: _orbits([[_number(value) for value in seed] for seed in seeds], even=True)


def _half(parity: int, seed: Sequence[int]) -> Callable[[], list[Point]]:
    """Return the images with an even number of minus signs: half of an orbit."""

    def build() -> list[Point]:
        points = _orbits([seed], even=False)
        return [point for point in points if sum(1 for value in point if _negative(value)) % 2 == parity]

    return build


def _negative(value: Number) -> bool:
    return value < 0


def _number(value: Any) -> Number:
    """Integers as they are; (a, b) is a + b * phi with the golden ratio phi; texts are parsed."""
    if isinstance(value, tuple):
        return parse_number(f"{value[0]}+{value[1]}*(1+sqrt(5))/2")
    return parse_number(value) if isinstance(value, str) else value


_PHI = (0, 1)
_PHI_2 = (1, 1)  # phi^2 = 1 + phi
_PHI_3 = (1, 2)
_1_PHI = (-1, 1)  # 1 / phi = phi - 1

#: Name -> description and builder of the vertices.
SOLIDS: dict[str, tuple[str, Callable[[], list[Point]]]] = {
    "tetrahedron": ("regular tetrahedron", _half(0, (1, 1, 1))),
    "octahedron": ("regular octahedron", _all((1, 0, 0))),
    "icosahedron": ("regular icosahedron", _cyclic((0, 1, _PHI))),
    "dodecahedron": ("regular dodecahedron", _cyclic((1, 1, 1), (0, _1_PHI, _PHI))),
    "cuboctahedron": ("cuboctahedron", _all((0, 1, 1))),
    "truncated-tetrahedron": ("truncated tetrahedron", _half(0, (3, 1, 1))),
    "truncated-cube": ("truncated cube", _all(("sqrt(2)-1", 1, 1))),
    "truncated-octahedron": ("truncated octahedron", _all((0, 1, 2))),
    "rhombicuboctahedron": ("rhombicuboctahedron", _all((1, 1, "1+sqrt(2)"))),
    "truncated-cuboctahedron": ("truncated cuboctahedron", _all((1, "1+sqrt(2)", "1+2*sqrt(2)"))),
    "icosidodecahedron": ("icosidodecahedron", _cyclic((0, 0, (0, 2)), (1, _PHI, _PHI_2))),
    "truncated-dodecahedron": (
        "truncated dodecahedron",
        _cyclic((0, _1_PHI, (2, 1)), (_1_PHI, _PHI, (0, 2)), (_PHI, 2, _PHI_2)),
    ),
    "truncated-icosahedron": (
        "truncated icosahedron",
        _cyclic((0, 1, (0, 3)), (1, (2, 1), (0, 2)), (_PHI, 2, _PHI_3)),
    ),
    "rhombicosidodecahedron": (
        "rhombicosidodecahedron",
        _cyclic((1, 1, _PHI_3), (_PHI_2, _PHI, (0, 2)), ((2, 1), 0, _PHI_2)),
    ),
    "truncated-icosidodecahedron": (
        "truncated icosidodecahedron",
        _cyclic(
            (_1_PHI, _1_PHI, (3, 1)),
            ((-2, 2), _PHI, (1, 2)),
            (_1_PHI, _PHI_2, (-1, 3)),
            ((-1, 2), 2, (2, 1)),
            (_PHI, 3, (0, 2)),
        ),
    ),
    "24-cell": ("regular 24-cell, dimension 4", _all((1, 1, 0, 0))),
    "600-cell": (
        "regular 600-cell, dimension 4",
        _cyclic((2, 0, 0, 0), (1, 1, 1, 1), (_PHI, 1, _1_PHI, 0)),
    ),
}
