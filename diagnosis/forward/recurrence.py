"""Linear recurrences along the rows of a recording, all rows at once: by doubling how far back every row looks."""

from __future__ import annotations

import numpy as np

from models.base.types import Array

FORGOTTEN = 1e-15  # share of an older value in a later one


def recurrence(slope: Array, driven: Array) -> Array:
    """``y[k] = slope[k] y[k-1] + driven[k]`` along the first axis, from ``y[0] = driven[0]``.

    Parameters
    ----------
    slope : Array, shape (N, ...)
        Broadcastable against `driven`; the first one is not used
    driven : Array, shape (N, ...)

    Returns
    -------
    Array, shape (N, ...)

    Examples
    --------
    >>> recurrence(np.array([0.0, 0.5, 1.0, 0.0]), np.array([8.0, 1.0, 0.0, 2.0]))
    array([8., 5., 5., 2.])
    """
    result, left, reach = np.array(driven, dtype=float), np.array(slope, dtype=float), 1
    left[:1] = 0.0
    while reach < len(result) and float(np.abs(left).max()) > FORGOTTEN:
        result[reach:] += left[reach:] * result[:-reach]
        left[reach:] = left[reach:] * left[:-reach]
        left[:reach] = 0.0
        reach *= 2
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
    decays, shares = (x.reshape(-1, *[1] * (values.ndim - 1)) for x in (decays, shares))
    driven = np.array(values, dtype=float)
    driven[1:] = (shares - decays) * values[:-1] + (1.0 - shares) * values[1:]
    return recurrence(np.concatenate([decays[:1], decays]), driven)
