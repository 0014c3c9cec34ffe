"""What users get wrong: each case ends with the right status and one message that says what, where and the mend.

Every case runs in a fresh folder with `solve ... --output out.json` (or its own command), and must leave no output
file, print nothing on standard output and show no traceback of the program.
"""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import bcut
from bcut.cli.main import run

Captured = pytest.CaptureFixture[str]


@dataclass(frozen=True)
class Bad:
    """A command line that must be refused.

    Attributes
    ----------
    name : str
    command : str
        With `FILE` for the file below.
    says : tuple of str
        Regular expressions that the message must match: what, where, the mend.
    content : str, bytes or callable, optional
        Of the file; a callable writes it.
    file : str
        Its name.
    status : int
    """

    name: str
    command: str
    says: tuple[str, ...]
    content: str | bytes | Callable[[Path], object] | None = None
    file: str = "points.json"
    status: int = 2


def points(content: str | bytes | Callable[[Path], object] | None, file: str, *says: str) -> Bad:
    """A file of points that is no point configuration."""
    name = f"{file}: {content!r}" if not callable(content) else f"{file}: {content.__name__}"
    return Bad(name, "solve FILE --output out.json", (re.escape(file), *says), content, file)


def separator(content: str | None, *says: str, parameters: str = "", status: int = 2) -> Bad:
    """A separator that cannot be used."""
    command = f"solve random:12,3,seed=1000 --spanning --separator ./cuts.py{parameters} --output out.json"
    name = f"separator{parameters} {content or 'missing'!r}"
    return Bad(name, command, (r"cuts\.py|separator '", *says), content, "cuts.py", status)


def option(arguments: str, *says: str) -> Bad:
    """Options that cannot be used."""
    return Bad(arguments, f"solve {arguments} --output out.json", says)


def costs(content: str | None, *says: str) -> Bad:
    """A costs file that cannot be used, for points 0..7 of a cube."""
    command = "solve cube:3 --objective costs:FILE --output out.json"
    return Bad(f"costs {content!r}", command, (r"costs\.json", *says), content, "costs.json")


def result(change: str, *says: str) -> Bad:
    """A result file that is refused; `change` is Python code on its data."""

    def write(path: Path) -> None:
        data = json.loads(bcut.solve("cube:3").to_json())
        exec(change, {"data": data})
        path.write_text(json.dumps(data))

    return Bad(f"verify after {change}", "verify FILE", (r"result\.json", *says), write, "result.json")


def save_strings(path: Path) -> None:
    np.save(path, np.array([["a", "b"], ["c", "d"]]))


def save_objects(path: Path) -> None:
    np.save(path, np.array([[1, 2], [3, None]], dtype=object), allow_pickle=True)


def save_infinity(path: Path) -> None:
    np.save(path, np.array([[0, 0], [1, 0], [0, np.inf]]))


def save_cube(path: Path) -> None:
    np.save(path, np.zeros((2, 2, 2)))


CUTS = "from bcut import Cut, Separator\n\nclass Cuts(Separator):\n    name = 'cuts'\n"
EMPTY_CUTS = CUTS + "    def separate(self, point):\n        return []\n"

TABLE = [
    # Points.
    points("", "points.json", r"is empty", r"should hold points"),
    points("# x\n", "points.csv", r"no points", r"write one point a line"),
    points("# x\n", "points.dat", r"no list of points", r"write \[\["),
    points("{", "points.json", r"line 1, column", r"not JSON"),
    points('{"schema": 1}', "points.json", r'"points" is missing', r"write \{"),
    points('{"schema": 7, "points": []}', "points.json", r"schema 7", r"reads schema 1"),
    points('"cube"', "points.json", r"holds str", r"write \{"),
    points("[]", "points.json", r"no points", r"at least dimension \+ 1"),
    points("[[0, 0], [1, 0], [0, NaN]]", "points.json", r"point 2", r"nan", r"finite"),
    points("[[0, 0], [1, 0], [0, -Infinity]]", "points.json", r"point 2", r"inf", r"finite"),
    points("0,0\n1,0\n0,nan\n", "points.csv", r"line 3", r"nan"),
    points("0,0\n1,0\n0,x\n", "points.csv", r"line 3", r"column 2|entry 2|'x'"),
    points("0,0\n1,0,3\n0,1\n", "points.csv", r"line 2 has 3 entries", r"same number"),
    points("[[0, 0], [1, 0], [0, 1, 2]]", "points.json", r"point 2", r"3 coordinates", r"2"),
    points('[[0, 0], [1, 0], [0, "sqrt(-2)"]]', "points.json", r"point 2", r"sqrt\(-2\)"),
    points('[[0, 0], [1, 0], [0, "1/0"]]', "points.json", r"point 2", r"zero"),
    points("[[0], [1], [2]]", "points.json", r"1 coordinate", r"at least 2"),
    points("[[0, 0, 0]]", "points.json", r"1 point\(s\)", r"at least 4 are needed"),
    points(
        "[[0, 0], [1, 1], [2, 2], [3, 3]]",
        "points.json",
        r"common hyperplane",
        r"span dimension 1 of 2; add a point outside",
    ),
    points(
        "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 3, 0]]",
        "points.json",
        r"span dimension 2 of 3; give them in 2 coordinates, or add a point outside",
    ),
    points("[[0, 0], [1, 0], [0, 1], [1, 0]]", "points.json", r"points 1 and 3", r"equal", r"remove one"),
    points("[[1, 0], [1, 1, 2]]", "points.dat", r"point 1", r"give every point the same"),
    points("[[1,0,0],[1,1,0],[1,0,1.5]]", "points.dat", r"line 1", r"1\.5", r"rational p/q"),
    points("[[0,0],[1,0],[0,1]]", "points.dat", r"no homogeneous coordinates", r"add a column of ones"),
    points("[[1,0,0],[1,1,0]", "points.dat", r"does not end", r"write \[\["),
    points(b"\xff\xfe\x00", "points.csv", r"UTF-8|text"),
    points(b"not numpy", "points.npy", r"not an \.npy file", r"numpy\.save"),
    points(save_strings, "points.npy", r"coordinate 0 of point 0", r"'a'", r"write it like"),
    points(save_objects, "points.npy", r"pickle|Object", r"numpy\.save"),
    points(save_infinity, "points.npy", r"point 2", r"inf"),
    points(save_cube, "points.npy", r"\(n, d\)|dimensions|shape"),
    points("PLY\n3 0 0\n0 0 0\n", "points.off", r"not OFF"),
    points("OFF\n4 0 0\n0 0 0\n1 0 0\n", "points.off", r"ends before vertex 2", r"line 2", r"cut off"),
    points(
        "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "points.off",
        r"line 6",
        r"'3 0 1 2'",
        r"is a line missing",
    ),
    points("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n", "points.off", r"line 6", r"take the line out"),
    points('[[0, 0], ["1e-400", 0], [0, 1]]', "points.json", r"point 1", r"would become 0", r"1/10\*\*400"),
    points("0,0\n1,0.12345678901234567890123\n", "points.csv", r"line 1|line 2, column 2", r"fraction p/q"),
    points(
        '{"schema": 1, "instance": {"points": [["0", "0"], ["1", "0"], ["0", "1"]], "digest": "f00"}}',
        "points.json",
        r"instance\.digest does not belong",
        r"give the points alone",
    ),
    points(None, "missing.json", r"no such file", r"missing\.json"),
    points("[[0, 0]]", "points.xyz", r"unknown suffix '\.xyz'", r"\.json, \.dat, \.csv"),
    Bad("a folder as instance", "solve ./ --output out.json", (r"folder|directory",)),
    # Names of instances.
    option("tesseract", r"no instance 'tesseract'", r"a family \("),
    option("cubes:3", r"no instance 'cubes:3'", r"did you mean cube"),
    option("cube:x", r"family 'cube'", r"must be an integer, not 'x'", r"for example cube:4"),
    option("cube:-3", r"at least", r"not -3", r"cube:4"),
    option("cube:", r"nothing follows the colon", r"cube:4"),
    option("cyclic", r"parameter N is missing", r"write cyclic:N,D"),
    option("cube:40", r"too many", r"at most 100000 points"),
    option("cyclic:3,3", r"family 'cyclic'", r"at least", r"cyclic:9,3"),
    option("random:3,5", r"N must be at least D \+ 1 = 6, not 3"),
    option("random:9,3,speed=1", r"no parameter 'speed=1'", r"random:N,D"),
    option("icosahedron:3", r"no parameter '3'", r"without parameters"),
    option("random:2000,3,seed=1", r"2000 points in dimension 3", r"1,999,000 ridges", r"ewer points"),
    option("''", r"no instance ''", r"a family"),
    # Options.
    option("cube:3 --time-limit -1", r"time limit -1", r"not negative"),
    option("cube:3 --time-limit nan", r"time limit nan", r"number of seconds"),
    option("cube:3 --time-limit inf", r"time limit inf", r"leave it out|finite"),
    option("cube:3 --time-limit soon", r"--time-limit", r"'soon' is not a valid float"),
    option("cube:3 --seed -4", r"seed -4", r"not negative"),
    option("cube:3 --sense least", r"--sense", r"'least'", r"min.*max"),
    option("cube:3 --formulation 9", r"unknown formulation '9'", r"known are 0, 1, 2, chambers"),
    option("cube:3 --method magic", r"--method", r"auto.*listing.*orbits.*scip"),
    option("cube:3 --objective cardinal", r"unknown objective 'cardinal'", r"did you mean 'cardinality'"),
    option("cube:3 --objective cardinality:3", r"'cardinality' takes no argument", r"'3'"),
    option("cube:3 --objective random-costs:x", r"random-costs:x", r"random-costs:SEED"),
    option("cube:3 --no-separators --separator clique", r"contradict", r"drop one"),
    option("cube:3 --fast", r"No such option", r"--fast"),
    Bad("no instance at all", "solve", (r"Missing argument 'INSTANCE'", r"Usage")),
    Bad("unknown command", "sove cube:3", (r"No such command 'sove'",)),
    # Costs.
    costs(None, r"cannot be read", r"No such file"),
    costs("[1, 2", r"line 1, column 6"),
    costs('{"cost": []}', r"expected \{"),
    costs('{"costs": [[[0, 1, 2], 3]]}', r"entry 0", r"4 distinct vertices"),
    costs('{"costs": [[[0, 1, 2, 9], 3]]}', r"entry 0", r"from 0 to 7"),
    costs('{"costs": [[[0, 1, 2, 4], NaN]]}', r"entry 0", r'finite number or "p/q"'),
    costs('{"costs": [[[0, 1, 2, 4], 1], [[4, 2, 1, 0], 1]]}', r"entry 1", r"has a cost already"),
    # Separators.
    option("cube:3 --separator cliques", r"unknown separator 'cliques'", r"did you mean 'clique'"),
    option(
        "cube:3 --separator zzz", r"unknown separator 'zzz'", r"known are", r"a file is given by its path"
    ),
    option("cube:3 --separator clique:speed=3", r"no parameter 'speed'", r"its parameters are: max_cuts"),
    option("cube:3 --separator clique:max_cuts=many", r"max_cuts", r"int", r"'many'"),
    option("cube:3 --separator clique:max_cuts=-1", r"clique:max_cuts=-1", r"at least|positive"),
    option("cube:3 --separator clique:max_cuts", r"clique:max_cuts", r"parameter=value"),
    option("cube:3 --separator odd-cycle:backend=magic", r"backend", r"magic", r"scipy", r"networkx"),
    option("cube:3 --separator clique --separator clique:max_cuts=3", r"'clique' is given twice", r"once"),
    separator(None, r"there is no such file"),
    separator("points = 3\n", r"defines no separator", r"derive a class from bcut\.Separator"),
    separator(EMPTY_CUTS, r"no class 'Others'", parameters=":Others"),
    separator(EMPTY_CUTS, r"no parameter 'depth'", r"its parameters are: none", parameters=":depth=3"),
    separator(EMPTY_CUTS.replace("'cuts'", "''"), r"has no name", r"set `name ="),
    separator(
        EMPTY_CUTS + EMPTY_CUTS.replace("Cuts(", "Others("),
        r"defines Cuts, Others|defines .*Others",
        r"say which",
    ),
    separator("def broken(:\n", r"SyntaxError", status=5),
    separator("raise OSError('no network')\n", r"OSError: no network", status=5),
    separator(
        CUTS + "    def separate(self, point):\n        return [point.x]\n",
        r"must yield Cut objects",
        status=5,
    ),
    separator(
        CUTS + "    def separate(self, point):\n        yield Cut([0, 0], 1)\n", r"distinct columns", status=5
    ),
    separator(
        CUTS + "    def separate(self, point):\n        yield Cut([0, 1], 0.5)\n",
        r"exact \(int or Fraction\)",
        status=5,
    ),
    separator(
        CUTS
        + "    def setup(self, problem):\n        1 / 0\n    def separate(self, point):\n        return []\n",
        r"setup\(\) raised ZeroDivisionError",
        status=5,
    ),
    Bad(
        "a text as separator",
        "solve cube:3 --separator ./FILE --output out.json",
        (r"notes\.txt", r"must end in \.py"),
        "x",
        "notes.txt",
    ),
    Bad("check of an unknown separator", "separators check cliques", (r"did you mean 'clique'",)),
    Bad(
        "new separator with a bad name",
        "separators new 'My Cuts'",
        (r"separator name 'My Cuts'", r"such as my-cuts"),
    ),
    Bad("new separator None", "separators new none", (r"'none'", r"meaning in Python", r"such as my-cuts")),
    Bad("new separator Cut", "separators new cut", (r"'cut'", r"in the file", r"take another")),
    Bad(
        "new objective of a keyword",
        "objectives new class",
        (r"'class'", r"meaning in Python", r"such as longest"),
    ),
    Bad("new objective of a module", "objectives new random", (r"'random'", r"take another")),
    Bad("new separator of a built-in name", "separators new clique", (r"'clique'", r"take another")),
    Bad(
        "new separator over a file",
        "separators new my-cuts",
        (r"my_cuts\.py", r"exists already", r"another name"),
        "x = 1",
        "my_cuts.py",
    ),
    # Outputs.
    Bad(
        "output in no folder",
        "solve cube:3 --output nowhere/out.json",
        (r"nowhere/out\.json", r"no folder nowhere", r"make it"),
    ),
    Bad("output that is a folder", "solve cube:3 --output .", (r"is a folder", r"name a file")),
    Bad(
        "output that is a device",
        "solve cube:3 --output /dev/null",
        (r"/dev/null", r"no regular file", r"standard output"),
    ),
    Bad(
        "output below a file",
        "solve cube:3 --output FILE/out.json",
        (r"points\.json", r"Not a directory|no folder"),
        "[]",
    ),
    Bad(
        "output with too long a name",
        f"solve cube:3 --output {'x' * 300}",
        (r"cannot be written", r"name too long"),
    ),
    Bad(
        "output over the instance",
        "solve FILE --output FILE",
        (r"is the file that is read", r"another"),
        "[[0,0],[1,0],[0,1]]",
    ),
    Bad(
        "output of an unknown format",
        "generate cube:3 --output out.xyz",
        (r"'xyz'", r"json, dat, csv, and off"),
    ),
    Bad(
        "irrational points for TOPCOM",
        "generate prism:5 --output out.dat",
        (r"rational coordinates only", r"use json or csv"),
    ),
    Bad("generate without an instance", "generate", (r"name an instance", r"--list")),
    Bad("generate of an instance and the list", "generate cube:3 --list", (r"--list takes no instance",)),
    Bad("export to an unknown format", "export cube:3 out.txt", (r"unknown suffix '\.txt'", r"\.lp, \.mps")),
    Bad(
        "export of an unknown formulation",
        "export cube:3 out.lp --formulation 9",
        (r"formulation '9'", r"known are 0, 1, 2, chambers"),
    ),
    Bad("export to no folder", "export cube:3 nowhere/out.lp", (r"no folder nowhere", r"make it")),
    Bad("export without a file", "export cube:3", (r"Missing argument 'FILE",)),
    # Result files.
    Bad("verify of a missing file", "verify missing.json", (r"missing\.json", r"no such file")),
    Bad(
        "verify of no JSON",
        "verify FILE",
        (r"points\.json", r"is not JSON", r"as 'bcut solve --output' wrote it"),
        "{",
    ),
    Bad(
        "verify of other JSON",
        "verify FILE",
        (r"points\.json", r"no entry 'schema'", r"solve"),
        '{"points": []}',
    ),
    result('data["schema"] = 2', r"has schema 2", r"reads schema 1", r"version that wrote it"),
    result('del data["problem"]', r"no entry 'problem'", r"solve the instance again"),
    result('data["triangulation"].pop()', r"simplex|facet|volume"),
    result('data["triangulation"][0][0] = 7', r"simplex|facet|vert"),
    result('data["triangulation"][0][0] = 99', r"99"),
    result('data["value"] = 4', r"value", r"4", r"5"),
    result('data["bound"] = 6', r"bound"),
    result('data["instance"]["points"][0][0] = "1/3"', r"digest"),
    result('data["instance"]["points"][0][0] = 1', r"as text"),
    result('data["certificate"]["bound"] = "6"', r"certificate|multipliers"),
    Bad(
        "plot of a result of dimension 4",
        "plot FILE out.svg",
        (r"dimension 4", r"2 and 3"),
        lambda path: bcut.solve("cube:4").save(path),
        "result.json",
    ),
    Bad(
        "plot without a triangulation",
        "plot FILE out.svg",
        (r"no triangulation to draw", r"solve the instance"),
        lambda path: bcut.bound("cube:3").save(path),
        "result.json",
    ),
    Bad("plot to an unknown format", "plot FILE out.gif", (r"unknown suffix '\.gif'", r"\.svg, \.png"), "{}"),
]


def test_the_table_is_of_some_length() -> None:
    assert len(TABLE) >= 100
    assert len({bad.name for bad in TABLE}) == len(TABLE)


@pytest.mark.parametrize("bad", TABLE, ids=lambda bad: bad.name)
def test_bad_input_is_refused(
    bad: Bad, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path(bad.file)
    if callable(bad.content):
        bad.content(path)
    elif bad.content is not None:
        path.write_bytes(bad.content.encode() if isinstance(bad.content, str) else bad.content)
    before = {file: file.read_bytes() for file in Path().iterdir()}
    arguments = [argument.replace("FILE", bad.file) for argument in shlex.split(bad.command)]
    assert run(arguments) == bad.status
    captured = capsys.readouterr()
    assert not captured.out
    message = captured.err
    for pattern in bad.says:
        assert re.search(pattern, message), message
    if bad.status == 2:
        assert "Traceback" not in message
        assert len(message.splitlines()) <= 5, "more than the usage and one message"
    else:
        # The plug-in's own traceback comes first; none of it is about the program's inner life.
        assert message.splitlines()[-1].startswith("Error: separator ")
    after = {file: file.read_bytes() for file in Path().iterdir() if file.name != "__pycache__"}
    assert after == before


def test_the_program_itself_ends_as_the_function_does(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "bcut", "solve", "cubes:3", "--output", "out.json"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "Error: there is no instance 'cubes:3'; did you mean cube?\n"
    assert not list(tmp_path.iterdir())
