"""A bracketed root finder that works on whole arrays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from models.base.types import Array


def decreasing_root(
    f: Callable[[Array], Array], low: Array, high: Array, *, f_tol: float, max_iterations: int = 60
) -> Array:
    """Root of ``f`` in each of many brackets, by regula falsi with the Illinois modification.

    Parameters
    ----------
    f : callable, (...) -> (...)
        Continuous, elementwise; ``f(low) >= 0 >= f(high)``
    low, high : Array, shape (...)
        Ends of the brackets
    f_tol : float
        Every element ends with ``abs(f) <= f_tol``
    max_iterations : int
        Evaluations of `f` inside the brackets

    Returns
    -------
    Array, shape (...)

    Raises
    ------
    ArithmeticError
        If an element has not met `f_tol` after `max_iterations`.

    References
    ----------
    Dowell, Jarratt, "A modified regula falsi method for computing the root of an equation", BIT 11 (1971).

    Examples
    --------
    >>> decreasing_root(lambda x: 2.0 - x**3, np.array([0.0]), np.array([4.0]), f_tol=1e-9).round(6)
    array([1.259921])
    """
    f_low, f_high = f(low), f(high)
    x = np.where(np.abs(f_low) < np.abs(f_high), low, high)
    fx = np.where(np.abs(f_low) < np.abs(f_high), f_low, f_high)
    side = np.zeros(np.shape(x))
    for _ in range(max_iterations):
        if np.all(np.abs(fx) <= f_tol):
            return x
        spread = f_low - f_high
        x_new = np.where(spread > 0.0, (high * f_low - low * f_high) / np.where(spread > 0.0, spread, 1.0), x)
        x = np.where(np.abs(fx) <= f_tol, x, x_new)  # a root once found stays: it must not depend on its neighbours
        fx = f(x)
        above = fx >= 0.0
        # Illinois: an end that is kept twice running counts half, so that both ends close in.
        f_high = np.where(above, np.where(side > 0.0, 0.5 * f_high, f_high), fx)
        f_low = np.where(above, fx, np.where(side < 0.0, 0.5 * f_low, f_low))
        low, high = np.where(above, x, low), np.where(above, high, x)
        side = np.where(above, 1.0, -1.0)
    raise ArithmeticError(f"{np.sum(np.abs(fx) > f_tol)} roots not found to {f_tol} in {max_iterations} iterations")
