"""Pictures: what is drawn, in which order, and the same file from the same result."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

import bcut
from bcut.errors import InputError, VerificationError
from bcut.plotting.depth import back_to_front
from bcut.plotting.drawing import neighbour_colours

TOWARDS = np.array([0.48, -0.6, 0.64])


def tetrahedra(instance: str, explode: float) -> np.ndarray:
    """The corners of an optimal triangulation, moved apart."""
    result = bcut.solve(instance, separators=[])
    corners = bcut.load_instance(instance).floats[np.array(result.triangulation)]
    return corners + explode * (corners.mean(axis=1, keepdims=True) - corners.mean(axis=(0, 1)))


def depth_range(corners: np.ndarray, origin: np.ndarray) -> tuple[float, float] | None:
    """Where the line through `origin` along `TOWARDS` is inside a tetrahedron; None where it misses or grazes it."""
    matrix = np.vstack((corners.T, np.ones(4)))
    start = np.linalg.solve(matrix, [*origin, 1.0])
    slope = np.linalg.solve(matrix, [*TOWARDS, 0.0])
    low, high = -np.inf, np.inf
    for value, rate in zip(start, slope, strict=True):
        if abs(rate) < 1e-12:
            if value < 0:
                return None
        elif rate > 0:
            low = max(low, -value / rate)
        else:
            high = min(high, -value / rate)
    return (low, high) if high - low > 1e-6 else None


@pytest.mark.parametrize(
    ("instance", "explode"),
    [("cube:3", 0.0), ("icosahedron", 0.0), ("icosahedron", 0.5), ("random:12,3,seed=3", 0.2)],
)
def test_nearer_tetrahedra_are_painted_later(instance: str, explode: float) -> None:
    corners = tetrahedra(instance, explode)
    order = back_to_front(corners, TOWARDS)
    assert sorted(order) == list(range(len(corners)))
    place = {number: position for position, number in enumerate(order)}
    random = np.random.default_rng(1)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    crossings = 0
    for origin in low + (high - low) * random.random((200, 3)):
        hits = [(depth, n) for n, corner in enumerate(corners) if (depth := depth_range(corner, origin))]
        painted = [place[number] for _, number in sorted(hits)]
        assert painted == sorted(painted)
        crossings += len(hits) > 1
    assert crossings > 50


def test_a_cycle_of_tetrahedra_that_hide_each_other_still_has_an_order() -> None:
    # Three long thin pieces, each over the next one.
    ends = [np.array([np.cos(t), np.sin(t), 0.0]) for t in 2 * np.pi * np.arange(3) / 3]
    pieces = []
    for k in range(3):
        a, b = ends[k] + [0, 0, 0.3], ends[(k + 1) % 3] * 1.3 - [0, 0, 0.3]
        a, b = a + 0.3 * (a - b), b + 0.3 * (b - a)
        pieces.append([a, b, (a + b) / 2 + [0, 0, 0.01], (a + b) / 2 + 0.01 * np.cross(a - b, [0, 0, 1])])
    assert sorted(back_to_front(np.array(pieces), np.array([0.0, 0.0, 1.0]))) == [0, 1, 2]


@pytest.mark.parametrize("instance", ["dodecahedron", "grid:4,3"])
def test_neighbours_have_different_colours(instance: str) -> None:
    simplices = np.array(bcut.solve(instance, separators=[]).triangulation)
    colours = neighbour_colours(simplices)
    shared = [len(set(a) & set(b)) for a in simplices.tolist() for b in simplices.tolist()]
    pairs = [(a, b) for a in colours for b in colours]
    d = simplices.shape[1] - 1
    neighbours = [pair for pair, count in zip(pairs, shared, strict=True) if count == d]
    assert neighbours
    assert all(a != b for a, b in neighbours)


def filled_paths(picture: Path) -> int:
    """The number of polygons in an SVG picture."""
    root = ElementTree.parse(picture).getroot()
    paths = root.iter("{http://www.w3.org/2000/svg}path")
    return sum("stroke: #2b2b33" in path.get("style", "") and " L " in path.get("d", "") for path in paths)


def test_every_triangle_is_drawn_and_the_picture_is_reproducible(tmp_path: Path) -> None:
    result = bcut.solve("grid:4,4", sense="max", separators=[])
    for name in ("a.svg", "b.svg"):
        bcut.plot(result, tmp_path / name, labels=True)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert result.triangulation is not None
    assert filled_paths(tmp_path / "a.svg") == len(result.triangulation) == 18


def test_see_through_tetrahedra_show_all_faces_and_opaque_ones_the_front(tmp_path: Path) -> None:
    result = bcut.solve("icosahedron", separators=[])
    assert result.triangulation is not None
    count = len(result.triangulation)
    bcut.plot(result, tmp_path / "through.svg", explode=0)
    bcut.plot(result.to_dict(), tmp_path / "opaque.svg", normalize=True, title="icosahedron")
    assert filled_paths(tmp_path / "through.svg") == 4 * count
    assert count <= filled_paths(tmp_path / "opaque.svg") <= 3 * count


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_other_formats(suffix: str, start: bytes, tmp_path: Path) -> None:
    file = tmp_path / f"moae{suffix}"
    bcut.plot(bcut.solve("moae"), file)
    assert file.read_bytes().startswith(start)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


def test_what_is_covered_of_a_region_is_drawn_inside_its_surface(tmp_path: Path) -> None:
    found = bcut.region("twisted-prism:5,twist=10")
    assert found.triangulation is not None
    bcut.plot(found, tmp_path / "prism.svg", explode=0)
    picture = (tmp_path / "prism.svg").read_text()
    # All edges of the surface: two triangulated pentagons, and ten triangles at the sides.
    assert picture.count("stroke-dasharray") == 24
    assert filled_paths(tmp_path / "prism.svg") == 4 * len(found.triangulation) + 24


def test_a_region_of_which_nothing_is_covered_or_that_does_not_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing of the region is covered"):
        bcut.plot(bcut.region("schoenhardt"), tmp_path / "nothing.svg")
    data = bcut.region("twisted-prism:5,twist=10").to_dict()
    with pytest.raises(VerificationError, match="the tetrahedra cover"):
        bcut.plot({**data, "triangulation": data["triangulation"][1:]}, tmp_path / "less.svg")
    assert not list(tmp_path.iterdir())
