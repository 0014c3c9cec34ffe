"""One more row for a formulation: the value of an objective that must not get worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bcut.formulations.formulation import UNBOUNDED, Formulation


def with_value_row(
    formulation: Formulation, coefficients: NDArray[np.int64], upper: int, *, name: str
) -> Formulation:
    """Return the formulation with the row ``coefficients @ x <= upper`` behind all others.

    Parameters
    ----------
    formulation : Formulation
    coefficients : ndarray of int64, shape (m,)
        Of the d-simplices.
    upper : int
    name : str
        Of the row.
    """
    import scipy.sparse as sp

    padded = np.zeros(formulation.width, dtype=np.int64)
    padded[: len(coefficients)] = coefficients
    matrix = sp.vstack((formulation.matrix.astype(np.int64), sp.csr_matrix(padded)), format="csr")
    names = tuple(formulation.row_name(row) for row in range(formulation.matrix.shape[0]))
    shifts = formulation.row_shifts
    return replace(
        formulation,
        matrix=matrix,
        lower=np.append(formulation.lower, -UNBOUNDED),
        upper=np.append(formulation.upper, np.int64(upper)),
        row_faces=(*formulation.row_faces, None),
        row_names=(*names, name),
        row_shifts=None if shifts is None else np.append(shifts, 0),
    )
