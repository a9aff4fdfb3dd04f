"""Cleaning of measured columns: impossible values become missing, short holes are bridged, and each case is noted.

A sensor that hangs is noted and left: finding it is the task of the diagnosis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from models.base.types import Array

Mask = NDArray[np.bool_]

# A value is an outlier if it is alone (at most two rows) and differs from its surroundings by so many robust standard
# deviations and by so much.
OUTLIER_SDS, OUTLIER_K, OUTLIER_OF_LOSS = 15.0, 8.0, 0.3
LONGEST_OUTLIER = 2  # rows
ALONE = 0.25  # how far the neighbours may leave their surroundings, of the outlier's deviation
WINDOW = 7  # rows of the running median
STEADY_INPUT = 0.02  # of an input's range: the loss may jump where inputs move by more
# A dropout is a constant that is entered and left by a jump.
DROPOUT_JUMP_K, DROPOUT_SDS = 15.0, 20.0
# A sensor hangs if it stays the same for so long while another one moves.
STUCK_S, STUCK_ROWS, OTHER_MOVES_K = 1800.0, 20, 2.0
ROUNDING_K = 1e-9  # of means of equal readings
FINEST_RESOLUTION = 1e-4


def runs(mask: Mask) -> Iterator[tuple[int, int]]:
    """Yield first row and row after the last of every run of True.

    Examples
    --------
    >>> list(runs(np.array([True, False, True, True])))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def rows_text(rows: NDArray[np.int64]) -> str:
    """Format row numbers as ranges; a long list is cut short.

    Examples
    --------
    >>> rows_text(np.array([3, 4, 5, 9]))
    'rows 3-5, 9'
    """
    rows = np.sort(rows)
    breaks = np.flatnonzero(np.diff(rows) > 1)
    firsts, lasts = rows[np.concatenate([[0], breaks + 1])], rows[np.concatenate([breaks, [len(rows) - 1]])]
    parts = [f"{a}" if a == b else f"{a}-{b}" for a, b in zip(firsts[:4], lasts[:4], strict=True)]
    more = ", ..." if len(firsts) > 4 else ""
    return f"row{'s' if len(rows) > 1 else ''} {', '.join(parts)}{more}"


def time_pieces(time: Array, gap_s: float) -> list[slice]:
    """Split time into pieces without a step longer than `gap_s`, [s].

    Examples
    --------
    >>> time_pieces(np.array([0.0, 1.0, 9.0, 10.0]), 5.0)
    [slice(0, 2, None), slice(2, 4, None)]
    """
    ends = [0, *(np.flatnonzero(np.diff(time) > gap_s) + 1).tolist(), len(time)]
    return [slice(first, end) for first, end in pairwise(ends)]


def outliers(values: Array, *, least: float, steady: Mask | None = None) -> Mask:
    """Return True for values that differ from all their neighbours, shape (rows,).

    Parameters
    ----------
    values : Array, shape (rows,)
        NaN where missing
    least : float
        Smallest deviation from the running median that counts
    steady : array of bool, shape (rows,), optional
        Rows that may be outliers

    Examples
    --------
    >>> values = np.full(50, 40.0); values[20] = 95.0
    >>> np.flatnonzero(outliers(values, least=OUTLIER_K)).tolist()
    [20]
    """
    found = np.zeros(len(values), dtype=bool)
    good = np.flatnonzero(np.isfinite(values))
    if len(good) < 2 * WINDOW:
        return found
    median = median_filter(values[good], WINDOW, mode="nearest")
    deviation = np.abs(values[good] - median)
    robust_sd = 1.4826 * float(np.median(deviation))
    far = deviation > max(OUTLIER_SDS * robust_sd, least)
    for first, end in runs(far):
        if first == 0 or end == len(good) or end - first > LONGEST_OUTLIER:
            continue
        # The top of a wave has neighbours on its way up and down; an outlier has none.
        aside = values[good[[first - 1, end]]] - median[first]
        if np.abs(aside).max() < ALONE * deviation[first:end].min():
            found[good[first:end]] = True
    return found if steady is None else found & steady


def dropouts(values: Array) -> Mask:
    """Return True for rows in which a temperature jumps to a constant and back from it, shape (rows,)."""
    found = np.zeros(len(values), dtype=bool)
    good = np.flatnonzero(np.isfinite(values))
    if len(good) < 2 * WINDOW:
        return found
    steps = np.diff(values[good])
    jump = max(DROPOUT_JUMP_K, DROPOUT_SDS * 1.4826 * float(np.median(np.abs(steps))))
    jumps = np.flatnonzero(np.abs(steps) > jump)
    for before, last in pairwise(jumps):
        there_and_back = steps[before] * steps[last] < 0.0
        if there_and_back and not np.any(steps[before + 1 : last]):
            found[good[before + 1 : last + 1]] = True
    return found


def spikes_of_temperature(values: Array) -> Mask:
    """Return True for dropouts and outliers of a temperature [degC], shape (rows,)."""
    found = dropouts(values)
    return found | outliers(np.where(found, np.nan, values), least=OUTLIER_K)


def spikes_of_loss(values: Array, steady: Mask) -> Mask:
    """Return True for outliers of a loss [W] while its inputs are steady, shape (rows,)."""
    known = np.abs(values[np.isfinite(values)])
    usual = float(np.quantile(known, 0.95)) if len(known) else 0.0
    return outliers(values, least=OUTLIER_OF_LOSS * usual, steady=steady)


def steady_rows(inputs: Mapping[str, Array]) -> Mask:
    """Return True for rows with unchanged inputs around them, shape (rows,)."""
    moves = np.zeros(len(next(iter(inputs.values()))), dtype=bool)
    for values in inputs.values():
        most = STEADY_INPUT * _span(values)
        step = ~(np.abs(np.diff(values, prepend=values[:1])) <= most)  # what is not known may move
        for shift in range(-LONGEST_OUTLIER, LONGEST_OUTLIER + 2):
            moves |= np.roll(step, shift)
    return ~moves


def bridged(time: Array, values: Array, longest_s: float) -> tuple[Array, Mask]:
    """Close short holes by straight lines.

    Parameters
    ----------
    time : Array, shape (rows,)
        [s]
    values : Array, shape (rows,)
        NaN where missing
    longest_s : float
        Longest time between two known values, [s]; at least three times the usual one, so that a slowly sampled input
        has no holes

    Returns
    -------
    values : Array, shape (rows,)
    known : array of bool, shape (rows,)
        Measured or bridged; the other rows are NaN
    """
    good = np.isfinite(values)
    known = good.copy()
    at = np.flatnonzero(good)
    if len(at) < 2:
        return values, known
    longest_s = max(longest_s, 3.0 * float(np.median(np.diff(time[at]))))
    for first, last in pairwise(at):
        if last - first > 1 and time[last] - time[first] <= longest_s:
            known[first:last] = True
    # The last sample of a slow input holds until the next one would have come.
    known[at[-1] :] |= time[at[-1] :] - time[at[-1]] <= longest_s / 3.0
    known[: at[0]] |= time[at[0]] - time[: at[0]] <= longest_s / 3.0
    filled = np.interp(time, time[good], values[good])
    return np.where(known, filled, np.nan), known


def stuck_rows(
    time: Array, values: Mapping[str, Array], *, least_rows: int = STUCK_ROWS
) -> dict[str, tuple[int, int, str, float]]:
    """Find channels that hang: first row, row after the last, the other channel that moves most meanwhile, by how much.

    Parameters
    ----------
    time : Array, shape (rows,)
        [s]
    values : mapping of channel to Array, shape (rows,)
        [degC]
    least_rows : int
        For so many steps from row to row it stays the same, at least
    """
    found: dict[str, tuple[int, int, str, float]] = {}
    for name, own in values.items():
        good = np.flatnonzero(np.isfinite(own))
        same = np.abs(np.diff(own[good])) < ROUNDING_K
        hanging = [(good[a], good[b] + 1) for a, b in runs(same) if b - a >= least_rows]
        if not hanging:
            continue
        first, end = max(hanging, key=lambda run: time[run[1] - 1] - time[run[0]])
        if time[end - 1] - time[first] < STUCK_S:
            continue
        moves = {other: _span(others[first:end]) for other, others in values.items() if other != name}
        other = max(moves, key=lambda key: moves[key], default="")
        if other and moves[other] > OTHER_MOVES_K:
            found[name] = (int(first), int(end), other, moves[other])
    return found


def _span(values: Array) -> float:
    good = values[np.isfinite(values)]
    return float(np.ptp(good)) if len(good) else 0.0


def resolution_of(values: Array) -> float:
    """Return the quantum of the values; 0 if there is none above 1e-4.

    Examples
    --------
    >>> resolution_of(np.array([20.1, 20.3, 20.2, 47.9])), resolution_of(np.array([0.0, 1.0, 1.41421356]))
    (0.1, 0.0)
    """
    distinct = np.unique(values[np.isfinite(values)])
    if len(distinct) < 3:
        return 0.0
    steps = np.diff(distinct)
    quantum = float(steps.min())
    if quantum < FINEST_RESOLUTION:
        # Conversions leave equal values apart by rounding errors.
        steps = steps[steps > FINEST_RESOLUTION / 2.0]
        quantum = float(steps.min()) if len(steps) else 0.0
    if quantum < FINEST_RESOLUTION:
        return 0.0
    multiples = steps / quantum
    if np.max(np.abs(multiples - np.round(multiples))) > 0.02:
        return 0.0
    return float(f"{np.sum(steps) / np.sum(np.round(multiples)):.6g}")
