"""When something acts: time windows, and the simplest words for the operation in which it does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from models.base.types import Array

ACTIVE_SHARE = 0.3  # of the largest magnitude
SHORTEST_WINDOW_S, SHORTEST_GAP_S = 120.0, 300.0
GOOD_ENOUGH = 0.9  # of the intervals told rightly


def active(heat: Array, steps: Array) -> NDArray[np.bool_]:
    """Where a heat acts, shape (K,): where it is at least a third of the size that it has for a hundredth of the time.

    Parameters
    ----------
    heat : Array, shape (K,)
    steps : Array, shape (K,)
        Lengths of the intervals
    """
    size = np.abs(heat)
    order = np.argsort(-size)
    largest = size[order[int(np.searchsorted(np.cumsum(steps[order]), 0.01 * steps.sum()))]]
    return np.asarray(size > ACTIVE_SHARE * max(float(largest), 1e-9))


def windows(time: Array, acting: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Time windows in which something acts, short gaps closed and short windows left out, [s].

    Examples
    --------
    >>> time = np.arange(0.0, 4000.0, 100.0)
    >>> windows(time, (time >= 1000.0) & (time < 2500.0) & (time != 1500.0))
    [(1000.0, 2400.0)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], acting, [False]]).astype(int)))
    found: list[tuple[float, float]] = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        window = float(time[begin]), float(time[end - 1])
        if found and window[0] - found[-1][1] <= SHORTEST_GAP_S:
            found[-1] = (found[-1][0], window[1])
        else:
            found.append(window)
    return [w for w in found if w[1] - w[0] >= SHORTEST_WINDOW_S]


def regime(acting: NDArray[np.bool_], signals: Mapping[str, tuple[Array, str]], steps: Array) -> str:
    """The operation in which something acts, as one threshold (a percentile) of one signal, if enough.

    Parameters
    ----------
    acting : bool array, shape (K,)
    signals : mapping of name to (values of shape (K,), unit)
    steps : Array, shape (K,)
        Lengths of the intervals

    Examples
    --------
    >>> n = np.linspace(0.0, 3000.0, 301)
    >>> regime(n > 2000.0, {"speed": (n, "1/min")}, np.ones(301))
    'speed above 1980 1/min'
    """
    share = float(np.average(acting, weights=steps))
    if share > 0.95:
        return "always"
    if share < 0.02:
        return "rarely"
    best, words = 0.0, ""
    for name, (values, unit) in signals.items():
        for threshold in np.unique(np.percentile(values, np.arange(2, 99, 2))):
            above = values > threshold
            # Both sides count alike, however rare one is.
            hit = 0.5 * (float(np.average(above[acting], weights=steps[acting]))
                         + float(np.average(~above[~acting], weights=steps[~acting])))  # fmt: skip
            for told, side in ((hit, "above"), (1.0 - hit, "below")):
                if told > best + 0.005:
                    best, words = told, f"{name} {side} {threshold:.3g} {unit}"
                    exact = f"{threshold:.0f}" if threshold >= 100.0 else f"{threshold:.3g}"
                    words = f"{name} {side} {exact} {unit}"
    if best >= GOOD_ENOUGH:
        return words
    return f"{share:.0%} of the time; no single threshold of {', '.join(signals)} separates it" + (
        f" (nearest: {words})" if best > 0.75 else "")  # fmt: skip
