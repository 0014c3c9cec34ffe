"""Random points: exactly the doubles that NumPy's default generator makes from the seed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bcut.families.parameters import Parameters


def uniform(parameters: Parameters) -> npt.NDArray[np.float64]:
    """Rows of `numpy.random.default_rng(seed).random((n, d))`."""
    n, d, seed = _read(parameters)
    return np.random.default_rng(seed).random((n, d))


def on_sphere(parameters: Parameters) -> npt.NDArray[np.float64]:
    """Rows of `numpy.random.default_rng(seed).normal(size=(n, d))`, each divided by its norm."""
    n, d, seed = _read(parameters)
    points = np.random.default_rng(seed).normal(size=(n, d))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def _read(parameters: Parameters) -> tuple[int, int, int]:
    n, d = parameters.integer("N", 3), parameters.integer("D", 2)
    if n < d + 1:
        parameters.fail(f"N must be at least D + 1 = {d + 1}, not {n}")
    seed = parameters.option("seed", 0)
    parameters.finish(n, d)
    return n, d, seed
