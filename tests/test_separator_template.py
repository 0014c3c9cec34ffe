"""The template of a separator: it passes the contract suite, overwrites nothing and refuses bad names."""

from __future__ import annotations

from pathlib import Path

import pytest
from contract import FEW

from bcut.errors import InputError
from bcut.separation.check import check_separator
from bcut.separation.resolve import resolve
from bcut.separation.template import template, write_template


def test_the_template_is_a_separator_that_passes(tmp_path: Path) -> None:
    path = write_template("two-words", tmp_path)
    assert path == tmp_path / "two_words.py"
    separator = resolve(f"{path}:max_cuts=3")
    assert separator.name == "two-words"
    assert type(separator).__name__ == "TwoWords"
    report = check_separator(lambda: resolve(str(path)), FEW)
    assert report.ok, report.summary
    assert report.violated > 0


def test_the_template_never_overwrites(tmp_path: Path) -> None:
    path = write_template("mine", tmp_path)
    path.write_text("precious")
    with pytest.raises(InputError, match="exists already"):
        write_template("mine", tmp_path)
    assert path.read_text() == "precious"
    with pytest.raises(InputError, match="cannot be written"):
        write_template("mine", tmp_path / "nowhere")


@pytest.mark.parametrize(
    "name", ["", "Mine", "two words", "-x", "x-", "clique", "odd-cycle", "../x", "x_y", "9x"]
)
def test_the_template_refuses_names(name: str) -> None:
    with pytest.raises(InputError, match="separator name"):
        template(name)
