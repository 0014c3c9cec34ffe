"""From what a user writes to a separator: built-in names, files, entry points, parameters."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from bcut.errors import SeparatorError, SeparatorLoadError
from bcut.separation.resolve import Specification, available, built_in_names, parameters_of, resolve
from bcut.separation.seam import Separator

GOOD = """
from bcut.separation.seam import Cut, Separator

class Mine(Separator):
    name = "mine"
    def __init__(self, depth: int = 3, share: float = 0.5, loud: bool = False, mode: str = "a", free=None):
        if depth < 0:
            raise ValueError("depth is at least 0")
        self.depth, self.share, self.loud, self.mode, self.free = depth, share, loud, mode, free
    def separate(self, point):
        return ()
"""

TWO = (
    GOOD
    + """
class Other(Mine):
    name = "other"
"""
)


def file(folder: Path, text: str, name: str = "my_cuts.py") -> str:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("clique", ("clique", None, {})),
        ("odd-cycle:max_cuts=40", ("odd-cycle", None, {"max_cuts": "40"})),
        (
            "odd-cycle:max_cuts=40,backend=networkx",
            ("odd-cycle", None, {"max_cuts": "40", "backend": "networkx"}),
        ),
        ("a: b = 1 , c=2 ", ("a", None, {"b": "1", "c": "2"})),
        ("./my_cuts.py", ("./my_cuts.py", None, {})),
        ("./my_cuts.py:Mine", ("./my_cuts.py", "Mine", {})),
        ("./my_cuts.py:Mine:depth=3", ("./my_cuts.py", "Mine", {"depth": "3"})),
        ("./my_cuts.py:depth=3", ("./my_cuts.py", None, {"depth": "3"})),
        ("C:\\cuts\\my.py:Mine", ("C:\\cuts\\my.py", "Mine", {})),
        ("/a:b/my.py:Mine", ("/a:b/my.py", "Mine", {})),
        ("/a.python/my.py", ("/a.python/my.py", None, {})),
        ("x:mode=k=v", ("x", None, {"mode": "k=v"})),
    ],
)
def test_specifications_are_split(text: str, expected: tuple[str, str | None, dict[str, str]]) -> None:
    found = Specification.parse(text)
    assert (found.source, found.class_name, found.parameters) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("clique:", "cannot read ''"),
        ("clique:a b", "cannot read 'a b'"),
        ("clique:A:B", "cannot read 'B'"),
        ("clique:max_cuts=4,3", "cannot read the parameter '3'"),
        ("clique:=4", "cannot read the parameter '=4'"),
        ("clique:a=1,a=2", "parameter 'a' is given twice"),
    ],
)
def test_specifications_that_cannot_be_read(text: str, message: str) -> None:
    with pytest.raises(SeparatorLoadError, match=message):
        Specification.parse(text)


@pytest.mark.parametrize("name", built_in_names())
def test_every_built_in_family_is_found_under_its_own_name(name: str) -> None:
    separator = resolve(name)
    assert separator.name == name
    assert available()[name] is type(separator)


def test_the_families_of_the_paper_are_built_in() -> None:
    assert {"clique", "odd-cycle"} <= set(built_in_names())


def test_parameters_are_read_as_the_type_of_their_default(tmp_path: Path) -> None:
    path = file(tmp_path, GOOD)
    separator = resolve(f"{path}:depth=7,share=0.25,loud=yes,mode=b,free=x")
    assert vars(separator) == {"depth": 7, "share": 0.25, "loud": True, "mode": "b", "free": "x"}
    assert resolve(f"{path}:loud=Off").loud is False  # type: ignore[attr-defined]
    assert parameters_of(type(separator)) == {
        "depth": 3,
        "share": 0.5,
        "loud": False,
        "mode": "a",
        "free": None,
    }


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ("depth=x", "parameter depth is of type int, not 'x'"),
        ("depth=1.5", "parameter depth is of type int, not '1.5'"),
        ("share=", "parameter share is of type float, not ''"),
        ("loud=maybe", "parameter loud is true or false, not 'maybe'"),
        ("height=3", "no parameter 'height'; its parameters are: depth, share, loud, mode, free"),
        ("depth=-1", "depth is at least 0"),
    ],
)
def test_parameters_that_do_not_fit(tmp_path: Path, parameters: str, message: str) -> None:
    with pytest.raises(SeparatorLoadError, match=message):
        resolve(f"{file(tmp_path, GOOD)}:{parameters}")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("odd-cycel", "unknown separator 'odd-cycel': did you mean 'odd-cycle'"),
        ("zzzz", "known are .*clique"),
        ("", "unknown separator ''"),
    ],
)
def test_unknown_names_come_with_a_hint(name: str, message: str) -> None:
    with pytest.raises(SeparatorLoadError, match=message):
        resolve(name)


def test_a_file_with_one_separator_needs_no_class(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file(tmp_path, GOOD)
    monkeypatch.chdir(tmp_path)
    for text in ("./my_cuts.py", "my_cuts.py", f"{tmp_path}{os.sep}my_cuts.py", "my_cuts.py:Mine"):
        assert resolve(text).name == "mine"


def test_a_class_is_chosen_where_a_file_has_several(tmp_path: Path) -> None:
    path = file(tmp_path, TWO)
    assert resolve(f"{path}:Other:depth=1").name == "other"
    with pytest.raises(SeparatorLoadError, match=r"defines Mine, Other; say which by .*:CLASS"):
        resolve(path)


def test_imported_separators_do_not_count_as_defined(tmp_path: Path) -> None:
    text = "from bcut.separators.clique import *\n" + GOOD
    assert resolve(file(tmp_path, text)).name == "mine"


def test_files_of_one_name_in_two_folders_are_two_modules(tmp_path: Path) -> None:
    first = resolve(file(tmp_path / "a", GOOD))
    second = resolve(file(tmp_path / "b", GOOD.replace('"mine"', '"other"')))
    assert (first.name, second.name) == ("mine", "other")
    assert type(first).__module__ != type(second).__module__


def test_a_folder_with_a_colon_in_its_name(tmp_path: Path) -> None:
    assert resolve(file(tmp_path / "a:b", GOOD) + ":Mine:depth=4").name == "mine"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "defines no separator; derive a class from bcut.Separator"),
        (GOOD.replace("def separate", "def separat"), "defines no separator; .*give it separate"),
        (GOOD.replace('name = "mine"', ""), 'class Mine has no name; set `name = "my-cuts"`'),
    ],
)
def test_files_without_a_separator(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SeparatorLoadError, match=message):
        resolve(file(tmp_path, text))


def test_files_that_are_no_python_files(tmp_path: Path) -> None:
    with pytest.raises(SeparatorLoadError, match=r"none\.py: there is no such file"):
        resolve(str(tmp_path / "none.py"))
    with pytest.raises(SeparatorLoadError, match=r"its name must end in \.py"):
        resolve(file(tmp_path, GOOD, "my_cuts.txt"))
    with pytest.raises(SeparatorLoadError, match="it has no class 'Yours'"):
        resolve(file(tmp_path, GOOD) + ":Yours")
    with pytest.raises(SeparatorLoadError, match="it has no class 'Cut'"):
        resolve(file(tmp_path, GOOD) + ":Cut")


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("def broken(:\n", "SyntaxError"),
        ("import no_such_module_anywhere\n", "ModuleNotFoundError"),
        ("1 / 0\n", "ZeroDivisionError"),
        ("import sys\nsys.exit(0)\n", "SystemExit"),
        (GOOD.replace("self.depth,", "self.undefined.depth,"), "AttributeError"),
    ],
)
def test_files_whose_own_code_raises_are_named_with_the_traceback(
    tmp_path: Path, text: str, kind: str
) -> None:
    path = file(tmp_path, text)
    with pytest.raises(SeparatorError, match=f"loading it raised {kind}") as caught:
        resolve(path)
    assert caught.value.exit_status == 5
    assert caught.value.separator == path
    assert kind in caught.value.trace
    assert "my_cuts.py" in caught.value.trace


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A distribution with entry points, as an installer would leave it."""
    (tmp_path / "their_cuts.py").write_text(GOOD + "\nGOOD = 1\n", encoding="utf-8")
    info = tmp_path / "their_cuts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: their-cuts\nVersion: 1.0\n", encoding="utf-8"
    )
    (info / "entry_points.txt").write_text(
        "[bcut.separators]\ntheirs = their_cuts:Mine\nbroken = their_cuts:Nothing\nno-class = their_cuts:GOOD\n"
        "clique = their_cuts:Mine\n",
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "their_cuts", raising=False)
    return tmp_path


@pytest.mark.usefixtures("installed")
def test_installed_packages_offer_separators() -> None:
    separator = resolve("theirs:depth=9")
    assert isinstance(separator, Separator)
    assert (separator.name, separator.depth) == ("mine", 9)  # type: ignore[attr-defined]


@pytest.mark.usefixtures("installed")
def test_a_built_in_name_cannot_be_taken_by_a_package() -> None:
    assert type(resolve("clique")).__module__ == "bcut.separators.clique"


@pytest.mark.usefixtures("installed")
def test_entry_points_that_are_no_separators() -> None:
    with pytest.raises(SeparatorError, match="'broken': loading it raised AttributeError"):
        resolve("broken")
    with pytest.raises(
        SeparatorLoadError, match=r"entry point 'no-class' \(their_cuts:GOOD\) is no subclass"
    ):
        resolve("no-class")
