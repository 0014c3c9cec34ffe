"""Files of points: what is written is read back, and every format in all its dialects."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from point_files import PLY, PLY_FACES, PLY_HEADER, ROWS, written

from bcut.cli.main import run
from bcut.errors import InputError
from bcut.families import build
from bcut.files import FORMATS, format_points, ply, read_points, write_points
from bcut.files.surfaces import read_surface
from bcut.geometry.configuration import PointConfiguration
from bcut.instance import load_instance

CLOUD = np.array([[0.1, 0.2, 0.7], [1, 0, 0], [0, 1.0 / 3, 0], [0, 0, 1e-5]])


@pytest.mark.parametrize(
    "text",
    ["cube:3", "moae", "random:9,3,seed=4", "dodecahedron", "prism:7", "antiprism:4", "pentagon-center"],
)
@pytest.mark.parametrize("kind", FORMATS)
def test_written_points_are_read_back_exactly(tmp_path: Path, text: str, kind: str) -> None:
    configuration = load_instance(text)
    path = tmp_path / f"points.{kind}"
    if kind == "dat" and configuration.field.degree > 1:
        with pytest.raises(InputError, match="rational coordinates only"):
            write_points(configuration, path)
        assert list(tmp_path.iterdir()) == []
        return
    write_points(configuration, path)
    again = read_points(path)
    assert again.digest == configuration.digest
    assert again.field == configuration.field
    assert again.name == (text if kind == "json" else "points")
    assert path.read_text() == format_points(configuration, kind)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.fractions(), st.fractions()), min_size=3, max_size=8, unique=True), st.data())
def test_rational_points_survive_every_format(
    tmp_path_factory: pytest.TempPathFactory, points: list[tuple[Fraction, Fraction]], data: st.DataObject
) -> None:
    points = [*points, (points[0][0] + 1000, points[0][1]), (points[0][0], points[0][1] + 1000)]
    configuration = PointConfiguration.from_values(list(dict.fromkeys(points)))
    kind = data.draw(st.sampled_from(FORMATS))
    path = tmp_path_factory.mktemp("points") / f"p.{kind}"
    write_points(configuration, path)
    assert read_points(path) == configuration


def test_an_existing_file_survives_a_failed_write(tmp_path: Path) -> None:
    path = written(tmp_path, "keep.dat", "old")
    with pytest.raises(InputError):
        write_points(build("dodecahedron"), path)
    assert path.read_text() == "old"
    write_points(build("moae"), path)
    assert read_points(path) == build("moae")


@pytest.mark.parametrize(
    ("target", "fragment"),
    [
        ("", "folder"),
        ("missing/points.json", "no folder"),
        ("points.txt", "cannot be written as"),
        ("x", "json"),
    ],
)
def test_unwritable_targets_are_refused(tmp_path: Path, target: str, fragment: str) -> None:
    with pytest.raises(InputError, match=fragment):
        write_points(build("moae"), tmp_path / target, kind="json" if not target else None)
    assert list(tmp_path.iterdir()) == []


def test_native_files_hold_a_name_and_notes(tmp_path: Path) -> None:
    document = {
        "schema": 1,
        "name": "mine",
        "points": [[0, 0], [1, 0.5], ["1/3", "sqrt(2)"]],
        "source": "a book",
    }
    configuration = load_instance(written(tmp_path, "a.json", json.dumps(document)))
    assert configuration.name == "mine"
    assert configuration.exact_points() == (("0", "0"), ("1", "1/2"), ("1/3", "sqrt(2)"))
    bare = load_instance(written(tmp_path, "b.json", "\ufeff" + json.dumps(document["points"])))
    assert bare == configuration
    assert bare.name == "b"


def test_json_decimals_are_the_nearest_doubles(tmp_path: Path) -> None:
    configuration = read_points(written(tmp_path, "a.json", '[[0.1, 0], ["0.1", 1], [1e-3, 0.3]]'))
    assert configuration.scalars()[0][0] == configuration.scalars()[1][0] == Fraction(0.1)
    assert configuration.scalars()[2] == (Fraction(1e-3), Fraction(0.3))


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("[[1,0,0],[1,1,0],[1,0,1]]", [[0, 0], [1, 0], [0, 1]]),
        ("[[0,0,1],[1/2,0,1],[0,-3,1]]\n[[1,0,2]]\n", [[0, 0], ["1/2", 0], [0, -3]]),
        ("# comment\n[ [0 0 1]\n  [1 0 1]\n  [0 1 1] ]\n[]", [[0, 0], [1, 0], [0, 1]]),
        # No column of ones: the functionals are the half sum and (1/2, 1, 1/2).
        (
            "[[1,1,0,0],[1,0,1,0],[1,0,0,1],[0,1,1,0],[0,1,0,1],[0,0,1,1]]",
            [[1, 1, 0], [1, 0, 1], [1, 0, 0], [0, 1, 1], [0, 1, 0], [0, 0, 1]],
        ),
        ("[[2,0,0],[0,1,0],[0,0,2]]", [[2, 0], [0, 1], [0, 0]]),
        # Homogeneous points in a hyperplane of their space keep their affine rank.
        ("[[2,0,0,0],[0,2,0,0],[0,0,1,1]]", [[2, 0], [0, 2], [0, 0]]),
    ],
)
def test_topcom_files(tmp_path: Path, text: str, points: list[list[object]]) -> None:
    configuration = read_points(written(tmp_path, "a.dat", text))
    assert configuration == PointConfiguration.from_values(points)


def test_the_barycentric_mother_of_all_examples_is_moae_up_to_an_affine_map(tmp_path: Path) -> None:
    path = written(tmp_path, "a.dat", "[[4,0,0],[0,4,0],[0,0,4],[2,1,1],[1,2,1],[1,1,2]]")
    assert read_points(path) == build("moae")


@pytest.mark.parametrize(
    "text",
    [
        "0,0\n1/2,sqrt(3)\n1,0.5\n",
        "x, y\n0, 0\n1/2, sqrt(3)\n\n# a comment\n1, 0.5",
        "0;0\r\n1/2;sqrt(3)\r\n1;0.5\r\n",
        "first coordinate\tsecond\n0\t0\n1/2\tsqrt(3)\n1\t0.5\n",
        "  0   0\n1/2 sqrt(3)\n1 .5",
        '"0","0"\n"1/2","sqrt(3)"\n"1","5e-1"\n',
        "\ufeff0,0\n1/2,sqrt( 9 / 3 )\n1,1-1/2\n",
    ],
)
def test_tables_in_all_their_dialects(tmp_path: Path, text: str) -> None:
    configuration = read_points(written(tmp_path, "t.csv", text))
    assert configuration.exact_points() == (("0", "0"), ("1/2", "sqrt(3)"), ("1", "1/2"))


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int16, np.uint64, ">f8"])
def test_numpy_files(tmp_path: Path, kind: type) -> None:
    points = (np.random.default_rng(0).random((10, 3)) * 100).astype(kind)
    path = tmp_path / "a.npy"
    np.save(path, points)
    configuration = read_points(path)
    assert configuration.name == "a"
    np.testing.assert_array_equal(configuration.floats, points.astype(float))


def test_off_files_keep_all_vertices_in_order(tmp_path: Path) -> None:
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in CLOUD.tolist()]
    for head, behind, faces in (
        ("OFF\n4 0 0\n", "", ""),
        ("# made by hand\nOFF # the word\n4 1\n\n", "", "3 0 1 2\n"),
        ("OFF 4 1 0\n", "  # a vertex", "3 0 1 2 255 0 0\n"),
        ("COFF\n4 1 0\n", " 255 0 0 255", "4 0 1 2 3\n"),
        ("STCNOFF\n4 0 0\n", " 0 0 1 1 0 0 0.5 0.5", ""),
    ):
        text = head + "".join(f"{row}{behind}\n" for row in rows) + faces
        for kind, newline in (("off", "\n"), ("OFF", "\r\n")):
            path = written(tmp_path, f"cloud.{kind}", text.replace("\n", newline))
            np.testing.assert_array_equal(read_points(path).floats, CLOUD)


def test_ply_files_keep_all_vertices_in_order(tmp_path: Path) -> None:
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in CLOUD.tolist())
    np.testing.assert_array_equal(read_points(written(tmp_path, "a.ply", PLY + rows)).floats, CLOUD)
    path = written(tmp_path, "f.ply", f"{PLY_FACES}{rows}3 0 1 2\n")
    np.testing.assert_array_equal(read_points(path).floats, CLOUD)
    for kind, code in (("double", "<f8"), ("float", "<f4")):
        header = PLY_HEADER.format(encoding="binary_little_endian", kind=kind).encode()
        path = written(tmp_path, f"{kind}.ply", header + CLOUD.astype(code).tobytes())
        np.testing.assert_array_equal(read_points(path).floats, CLOUD.astype(code).astype(float))


def test_ply_elements_stand_in_any_order_with_properties_of_all_kinds(tmp_path: Path) -> None:
    header = (
        "ply\nformat ascii 1.0\ncomment from Å\nelement face 2\nproperty uchar red\n"
        "property list uchar int vertex_index\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
        "element vertex 4\nproperty list uchar float weights\nproperty float z\nproperty float x\n"
        "property float y\nend_header\n"
    )
    body = "7 3 0 1 2\n7 4 0 1 2 3\n0 1\n0 0 0 0\n2 0.5 0.5 1 2 3\n1 1 4 5 6\n0 7 8 10\n"
    path = written(tmp_path, "a.ply", header + body)
    assert read_points(path).floats.tolist() == [[0, 0, 0], [2, 3, 1], [5, 6, 4], [8, 10, 7]]
    assert ply.read(path).faces == [[0, 1, 2], [0, 1, 2, 3]]
    with pytest.raises(InputError, match=r"not all triangles \(face 1 has 4\)"):
        read_surface(path)


def test_quadrilaterals_in_binary_files_are_not_divided(tmp_path: Path) -> None:
    header = PLY_FACES.replace("ascii", "binary_little_endian").encode()
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f8").tobytes()
    for face in ([0, 1, 2], [0, 1, 2, 3]):
        path = written(
            tmp_path, "a.ply", header + points + bytes([len(face)]) + np.array(face, dtype="<i4").tobytes()
        )
        assert read_points(path).n == 4
        if len(face) == 3:
            assert read_surface(path)[1] == [face]
        else:
            with pytest.raises(InputError, match="not all triangles"):
                read_surface(path)


@pytest.mark.parametrize("kind", ["off", "ply"])
def test_coordinates_of_meshes_are_what_their_texts_say(tmp_path: Path, kind: str) -> None:
    head = {"off": "OFF\n4 0 0\n", "ply": PLY}[kind]
    rows = "0 0 0\n1 0 0\n0 9007199254740993 0\n0.1 -.5e-2 +1E3\n"
    configuration = read_points(written(tmp_path, f"a.{kind}", head + rows))
    assert configuration.scalars()[2:] == ((0, 2**53 + 1, 0), (Fraction(0.1), Fraction(-0.005), 1000))


def test_texts_are_read_without_the_library_for_meshes(tmp_path: Path) -> None:
    paths = [
        written(tmp_path, "a.off", f"OFF\n4 0 0\n{''.join(ROWS)}"),
        written(tmp_path, "a.ply", PLY + "".join(ROWS)),
    ]
    code = (
        "import sys, bcut.instance\n"
        f"[bcut.instance.load_instance(path) for path in {[str(path) for path in paths]}]\n"
        "sys.exit('trimesh' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("pattern", ["%r", "%.17g", "%.18e", "%.25f"])
def test_doubles_written_as_texts_keep_their_digest(tmp_path: Path, pattern: str) -> None:
    configuration = load_instance("random:20,3")
    rows = [[pattern % value for value in row] for row in configuration.floats.tolist()]
    counts = "OFF\n20 0 0\n"
    for name, text in {
        "a.csv": "".join(f"{','.join(row)}\n" for row in rows),
        "a.off": counts + "".join(f"{' '.join(row)}\n" for row in rows),
        "a.json": json.dumps(rows).replace('"', ""),
        "texts.json": json.dumps(rows),
    }.items():
        assert read_points(written(tmp_path, name, text)).digest == configuration.digest


@pytest.mark.parametrize("text", ["dodecahedron", "random:9,3,seed=4", "polygon:7"])
def test_a_result_file_is_read_as_its_instance(tmp_path: Path, text: str) -> None:
    configuration = load_instance(text)
    instance = {
        "name": text,
        "dimension": configuration.dimension,
        "points": configuration.exact_points(),
        "digest": configuration.digest,
    }
    path = written(
        tmp_path, "result.json", json.dumps({"schema": 1, "instance": instance, "status": "limit"})
    )
    again = load_instance(path)
    assert (again.name, again.digest) == (text, configuration.digest)


def test_results_of_solve_and_region_are_solved_again(tmp_path: Path) -> None:
    first, second = tmp_path / "first.json", tmp_path / "second.json"
    assert run(["solve", "moae", "--quiet", "--output", str(first)]) == 0
    assert run(["solve", str(first), "--quiet", "--output", str(second)]) == 0
    old, new = json.loads(first.read_text()), json.loads(second.read_text())
    assert (old["instance"], old["value"]) == (new["instance"], new["value"])
    assert run(["region", "schoenhardt", "--output", str(first)]) == 0
    assert run(["region", str(first), "--output", str(second)]) == 0
    assert json.loads(first.read_text())["instance"] == json.loads(second.read_text())["instance"]
    assert load_instance(first).n == 6


def test_a_dash_is_standard_input_and_output(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["generate", "polygon:7", "--output", "-"]) == 0
    text = capsys.readouterr().out
    for content, status, message in (
        (text, 0, ""),
        ("\n", 2, "standard input: it is empty; it should hold points as JSON"),
        ("0,0\n", 2, "standard input: line 1, column 2: not JSON"),
        ("[[0, 0]]", 2, "standard input: 1 point"),
        ("é", 2, "standard input: not UTF-8"),
    ):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content.encode("latin-1"))))
        assert run(["generate", "-"]) == status
        captured = capsys.readouterr()
        assert captured.out == (text if status == 0 else "")
        assert message in captured.err
    assert list(tmp_path.iterdir()) == []
