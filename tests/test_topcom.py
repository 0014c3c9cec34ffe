"""TOPCOM, where it is installed, counts as many triangulations and finds the same optima."""

from __future__ import annotations

import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from solving import assert_solved

import bcut
import bcut.instances
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.triangulations import count_by_size


def homogeneous(configuration: PointConfiguration) -> str:
    return json.dumps([[*(int(value) for value in point), 1] for point in configuration.scalars()]) + "\n"


def topcom(command: str, configuration: PointConfiguration) -> str:
    return subprocess.run(
        [command], input=homogeneous(configuration), capture_output=True, text=True, check=True, timeout=60
    ).stdout


def integer_points(number: int, n: int, d: int, most: int) -> PointConfiguration:
    points = np.random.default_rng(number).integers(0, most, size=(2 * n, d))
    return PointConfiguration.from_values(
        np.unique(points, axis=0)[:n].tolist(), name=f"integer points {number}"
    )


TOPCOM_CASES = [(1, 8, 2, 5), (2, 9, 2, 100), (3, 7, 3, 3), (4, 8, 3, 50), (5, 8, 3, 4), (6, 8, 4, 3)]


@pytest.mark.skipif(shutil.which("topcom-points2nalltriangs") is None, reason="TOPCOM is not installed")
@pytest.mark.parametrize("case", TOPCOM_CASES)
def test_topcom_counts_as_many_triangulations(case: tuple[int, int, int, int]) -> None:
    configuration = integer_points(*case)
    chirotope = Chirotope.of(configuration)
    for command, spanning in (("topcom-points2nalltriangs", False), ("topcom-points2nallfinetriangs", True)):
        counted = int(topcom(command, configuration).split()[-1])
        assert sum(count_by_size(chirotope, spanning=spanning).values()) == counted


@pytest.mark.skipif(shutil.which("topcom-points2mintriang") is None, reason="TOPCOM is not installed")
@pytest.mark.parametrize("case", TOPCOM_CASES)
def test_topcom_finds_the_same_smallest_size(case: tuple[int, int, int, int]) -> None:
    configuration = integer_points(*case)
    last = topcom("topcom-points2mintriang", configuration).strip().splitlines()[-1]
    size = len(re.findall(r"\{[\d,]+\}", last))
    assert_solved(bcut.solve(configuration), size)
