"""Linear recurrences along the rows of a recording: banded triangular systems, which LAPACK solves row by row."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dtbtrs

from models.base.types import Array


def recurrence(slope: Array, driven: Array) -> Array:
    """``y[k] = slope[k] y[k-1] + driven[k]`` along the first axis, from ``y[0] = driven[0]``.

    Parameters
    ----------
    slope : Array, shape (N, V), or (N, 1) for one that all columns have
        The first row is not used
    driven : Array, shape (N, V)

    Returns
    -------
    Array, shape (N, V)

    Examples
    --------
    >>> recurrence(np.array([[0.0], [0.5], [1.0], [0.0]]), np.array([[8.0], [1.0], [0.0], [2.0]]))[:, 0]
    array([8., 5., 5., 2.])
    """
    if not driven.size:
        return driven  # without a column LAPACK, as scipy calls it, writes where there is nothing
    band = np.ones((2, len(driven)), order="F")  # the diagonal, and below it what one row takes from the row before
    if slope.shape[1] == 1:
        band[1, :-1] = -slope[1:, 0]
        return np.asarray(dtbtrs(band, driven, uplo="L", diag="U")[0])
    result = np.empty(driven.shape, order="F")
    for column, one in enumerate(slope.T):
        band[1, :-1] = -one[1:]
        result[:, column] = dtbtrs(band, driven[:, column], uplo="L", diag="U")[0]
    return result


def lagged(values: Array, steps: Array, lag: float) -> Array:
    """A first-order lag, exact for straight lines between the points.

    Parameters
    ----------
    values : Array, shape (K + 1, ...)
    steps : Array, shape (K,)
        [s]
    lag : float
        Time constant, [s]

    Returns
    -------
    Array, shape (K + 1, ...)
        Starting at the first value
    """
    if lag <= 0.0:
        return values
    decays = np.exp(-steps / lag)
    shares = lag * (1.0 - decays) / steps
    flat = values.reshape(len(values), -1)
    driven, decays, shares = np.array(flat, dtype=float), decays[:, None], shares[:, None]
    driven[1:] = (shares - decays) * flat[:-1] + (1.0 - shares) * flat[1:]
    return recurrence(np.concatenate([decays[:1], decays]), driven).reshape(values.shape)
