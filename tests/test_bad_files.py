"""Files and arrays that hold no points: refused with file, place and reason."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from point_files import PLY, PLY_FACES, ROWS, written

from bcut.errors import InputError
from bcut.files import read_points
from bcut.instance import load_instance

BAD_FILES: list[tuple[str, str | bytes, str]] = [
    ("empty.json", "", "empty"),
    ("blank.csv", " \n\n", "empty"),
    ("broken.json", '{"points": [[0, 0],\n [1, }', "line 2, column 6: not JSON"),
    ("number.json", "5", "holds int"),
    ("other.json", '{"schema": 1}', '"points" is missing'),
    ("future.json", '{"schema": 2, "points": []}', "schema 2 is unknown"),
    ("name.json", '{"name": 5, "points": [[0,0],[1,0],[0,1]]}', '"name" must be a text'),
    ("nan.json", "[[0, 0], [1, NaN], [0, 1]]", "coordinate 1 of point 1 .* nan"),
    ("infinite.json", "[[0, 0], [1, Infinity], [0, 1]]", "coordinate 1 of point 1 .* inf"),
    ("large.json", "[[0, 0], [1, 1e999], [0, 1]]", "coordinate 1 of point 1 .*'1e999': .* beyond the range"),
    (
        "small.json",
        '[[0, 0], ["1e-400", 1], [0, 1]]',
        "coordinate 0 of point 1 .*'1e-400': .* become 0; write",
    ),
    (
        "long.json",
        "[[0.12345678901234567890123, 0], [1, 0], [0, 1]]",
        "point 0 .* is 0.12345678901234568; write that",
    ),
    ("odd.csv", "0,0\n1,9007199254740993.0\n0,1\n", "line 2, column 2: .* is 9007199254740992.0; write that"),
    ("undigested.json", '{"instance": {"points": [[0,0],[1,0],[0,1]]}}', "instance.digest is missing"),
    (
        "tampered.json",
        '{"schema": 1, "instance": {"points": [[0,0],[1,0],[0,1]], "digest": "0"}}',
        "digest does not belong to instance.points: one of them was changed",
    ),
    ("null.json", "[[0, 0], [1, null], [0, 1]]", "None, not an integer"),
    ("ragged.json", "[[0, 0], [1], [0, 1]]", "point 1 has 1 coordinates"),
    ("deep.json", "[" * 100_000, "nested too deeply"),
    ("digits.json", f"[[{'9' * 5000}, 1]]", "too long a number"),
    ("latin.json", "[[0, 0], [1, 0], [0, 1]] é".encode("latin-1"), "not UTF-8"),
    ("garbage.dat", bytes(range(128, 256)), "not UTF-8"),
    ("zeros.csv", b"1,2\0\n3,4\n", "binary data"),
    ("flat.json", "[[0, 0], [1, 1], [2, 2]]", "hyperplane"),
    ("twice.json", "[[0, 0], [1, 0], [0, 1], [1, 0]]", "points 1 and 3 .* equal"),
    ("open.dat", "[[1,0,0],\n[1,1", "line 2: the list of points does not end"),
    ("none.dat", "# nothing\n", "no list of points"),
    ("words.dat", "hello", "'hello' stands outside"),
    ("decimal.dat", "[[1,0,0],\n[1,0.5,2]]", "line 2: point 1, coordinate 1 .*'0.5'"),
    ("zero.dat", "[[1/0,1,1]]", "divides by zero"),
    ("vectors.dat", "[[1,0,0],[2,0,0],[0,1,0],[0,0,1]]", "no homogeneous coordinates"),
    ("ragged.dat", "[[1,0,0],[1,1]]", r"point 1 .* has 2 coordinates, point 0 has 3"),
    ("deep.dat", "[[[1]]]", "too many opening brackets"),
    ("empty.dat", "[]", "no points"),
    ("header.csv", "x,y\n", "no points"),
    ("word.csv", "1,2\n3,abc\n5,9\n", "line 2, column 2: .*'abc'"),
    ("ragged.csv", "1,2\n3,4,5\n", "line 2 has 3 entries but line 1 has 2"),
    ("gap.csv", "1,2\n3,\n5,9\n", "line 2, column 2: .* empty"),
    ("comma.csv", "0,5;1,5\n2;3\n4;4\n", "line 1, column 1: .*','"),
    ("nan.csv", "nan,1\n2,3\n4,9\n", "line 1, column 1: .* finite"),
    ("quote.csv", '1,"2\n3,4\n5,9\n', "line 1"),
    ("text.npy", "hello", "not an .npy file"),
    ("cut.npy", b"\x93NUMPY\x01\x00v\x00{'descr'", "no readable .npy"),
    ("hello.off", "hello", "the first line is 'hello'"),
    ("four.off", "4OFF\n1 0 0\n1 2 3 4\n", "dimension 3"),
    ("note.off", "# nothing\n", "the first line is ''"),
    (
        "cut.off",
        "OFF\n4 0 0\n0 0 0\n1 0 0\n",
        "ends before vertex 2 .* line 2 promises 4 vertices and 0 faces; is it cut",
    ),
    ("head.off", "OFF", "line 1: the numbers of vertices, faces and edges are expected, such as 4 4 6"),
    ("binary.off", "OFF BINARY\n4 1 0\n", "line 1: the numbers of vertices, .* not 'BINARY'"),
    ("word.off", "OFF\n3 0 0\n0 0 0\n1 0 x\n0 1 1\n", "line 4: 'x' is no decimal number"),
    (
        "formula.off",
        "OFF\n3 0 0\n0 0 0\n1 0 1/2\n0 1 1\n",
        "line 4: '1/2' is no decimal number; .* csv and json",
    ),
    ("nan.off", "OFF\n3 0 0\n0 0 0\n1 0 nan\n0 1 1\n", "line 4: .*'nan': coordinates must be finite"),
    ("dots.off", "OFF\n3 0 0\n0 0 0\n1 0 1.2.3\n0 1 1\n", "line 4: .*'1.2.3'"),
    (
        "missing.off",
        f"OFF\n4 1 0\n{ROWS[0]}{ROWS[1]}{ROWS[2]}3 0 1 2\n",
        "line 6: a vertex .* '3 0 1 2', as line 2",
    ),
    (
        "faces.off",
        f"OFF\n# 9 faces\n4 9 0\n{''.join(ROWS)}3 0 1 2\n",
        "ends before face 1 .*, but line 3 promises",
    ),
    (
        "more.off",
        f"OFF\n4 0 0\n{''.join(ROWS)}1 1 1\n",
        "line 7: '1 1 1' is too much, as line 2 promises 4 vertices",
    ),
    (
        "point.off",
        f"OFF\n4 1 0\n{''.join(ROWS)}1 1 1\n",
        "line 7: a face is expected, .* not '1 1 1', as line 2",
    ),
    ("index.off", f"OFF\n4 1 0\n{''.join(ROWS)}3 0 1 4\n", "line 7: '4' is no vertex; .* from 0 to 3"),
    ("hello.ply", "hello", "the first line is 'hello', not ply"),
    ("format.ply", "ply\nformat text 1.0\n", "line 2: the format is expected next, one of ascii, binary"),
    (
        "plane.ply",
        PLY.replace("property double z\n", "") + "0 0\n1 0\n0 1\n1 1\n",
        "no vertices with .* x, y and z",
    ),
    ("open.ply", PLY.replace("end_header\n", ""), "the header does not end"),
    (
        "header.ply",
        PLY.replace("property", "attribute"),
        "line 4: 'attribute double x' is no line of a header",
    ),
    (
        "cut.ply",
        PLY + "0 0 0\n1 0 0\n",
        "ends before vertex 2 .* line 3 promises 'element vertex 4'; is it cut off",
    ),
    ("word.ply", PLY + "0 0 0\n1 0 0\n0 x 1\n1 1 1\n", "line 10: 'x' is no decimal number"),
    ("tail.ply", PLY + "0 0 0\n1 0 0\n0 1 1\n1 1 2x\n", "line 11: '2x' is no decimal number"),
    (
        "missing.ply",
        f"{PLY_FACES}{ROWS[0]}{ROWS[1]}{ROWS[2]}3 0 1 2\n",
        "line 13: '3 0 1 2' is no vertex .* as line 3",
    ),
    ("more.ply", f"{PLY}{''.join(ROWS)}1 1 1\n", "line 12: '1 1 1' is too much, as line 3"),
    ("face.ply", f"{PLY_FACES}{''.join(ROWS)}4 0 1 2\n", "line 14: '4 0 1 2' is no face .* as line 7"),
    ("index.ply", f"{PLY_FACES}{''.join(ROWS)}3 0 1 7\n", "line 14: '7' is no vertex"),
    ("short.ply", PLY.replace("ascii", "binary_little_endian").encode() + b"1234", "no readable PLY"),
    ("points.xyz", "0 0\n1 0\n0 1\n", "unknown suffix '.xyz'"),
    ("points", "0 0\n1 0\n0 1\n", "unknown suffix ''"),
]


@pytest.mark.parametrize(("name", "content", "fragment"), BAD_FILES, ids=[name for name, _, _ in BAD_FILES])
def test_bad_files_are_refused_with_file_place_and_reason(
    tmp_path: Path, name: str, content: str | bytes, fragment: str
) -> None:
    path = written(tmp_path, name, content)
    with pytest.raises(InputError, match=fragment) as caught:
        load_instance(str(path))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert len(message) < len(str(path)) + 400
    with pytest.raises(InputError, match=fragment):
        read_points(path)


def test_bad_arrays_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    for array, fragment in (
        (np.array([[{}]], dtype=object), "allow_pickle"),
        (np.zeros((3, 2), dtype=complex), "complex"),
        (np.zeros(3), "shape"),
        (np.zeros((0, 2)), "no points"),
    ):
        np.save(path, array)
        with pytest.raises(InputError, match=fragment):
            read_points(path)
    np.savez(tmp_path / "b.npz", points=np.zeros((3, 2)))
    os.replace(tmp_path / "b.npz", path)
    with pytest.raises(InputError, match="archive"):
        read_points(path)


def test_missing_files_and_folders_are_named(tmp_path: Path) -> None:
    folder = tmp_path / "folder.json"
    folder.mkdir()
    for path, fragment in (
        (tmp_path / "no.json", "no such file"),
        (folder, "directory"),
        (tmp_path, "directory"),
    ):
        with pytest.raises(InputError, match=fragment):
            load_instance(path)
        with pytest.raises(InputError, match=fragment):
            load_instance(str(path))
    with pytest.raises(InputError, match="no valid path"):
        load_instance("a\0b.json")
