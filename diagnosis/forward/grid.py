"""From the rows of a recording to the working grid of the inference: pieces, intervals, means.

The inference walks over intervals of :data:`INTERVAL_S` where something happens, and of up to :data:`LONGEST` times as
long where for a while nothing has. Inputs are means over an interval, measurements means around a grid point (so wide
that a steady drift leaves no error). Recordings that are sampled more slowly keep their own times; where their rows are
means over the time before their stamp, as those of SCADA are, inputs and measurements are late by the same half step,
which makes no difference.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.special import ndtri

from diagnosis.recordings.recording import Recording
from models.base.types import Array
from models.quantities.quantities import is_total_loss

INTERVAL_S = 20.0
SAMPLES = 5  # of the inputs per interval, at which losses are computed: they are not linear in speed
LONGEST = 5  # times INTERVAL_S: of an interval in which nothing happens
CALM_SHARE = 0.5  # of the time since something happened, that an interval may last
STEADY_INPUT, STEADY_AMBIENT_K = 0.01, 1.0  # range of the inputs inside an interval, of their usual size; and in K
NOISE_SDS, MOST_NOISE = 6.0, 0.03  # noise of an input is no change: range that it may have, and at most of its size
BEND_REACH = 3  # intervals to either side of a grid point, over which means are compared to see a temperature bend
BEND_SDS, LEAST_BEND_K, LEAST_BEND_W = 6.0, 0.3, 2.0  # a bend that counts: of its noise, and at least
SETTLING_S = 600.0  # after a jump of the inputs, in which temperatures bend because of it, and smoothly
SHORTEST_PIECE = 5  # grid points
DOUBT_SDS, TURN_SDS = 2.0, 6.0  # of the noise: benefit of the doubt at a turning point, and how clear that has to be
FREE_S = 5.0  # length of intervals in which switches run free
SLOW_S = 60.0  # rows further apart are means that hide what switches do, see :class:`Piece`


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorCourse:
    """Model error along a piece, which may be assumed while the piece is simulated; or courses per unit of n unknowns.

    Attributes
    ----------
    heat : Array, shape (K, parts) or (K, parts, n)
        Into every part, [W]
    loss : Array, shape (K,) or (K, n)
        Part of it that is mechanical loss, [W]
    reading : Array, shape (K + 1, channels) or (K + 1, channels, n)
        Change of the readings of sound sensors, [K] or [W]
    """

    heat: Array
    loss: Array
    reading: Array

    def along(self, values: Array) -> ErrorCourse:
        """All unknowns together, with values of shape (n,)."""
        return ErrorCourse(heat=self.heat @ values, loss=self.loss @ values, reading=self.reading @ values)


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """One gap-free piece of a recording on the working grid of K intervals.

    Attributes
    ----------
    recording : str
        Name of the recording
    time : Array, shape (K + 1,)
        Since the first row of the recording, [s]
    samples : Array, shape (K, S, inputs)
        Inputs inside every interval, evenly spread
    channels : tuple of str
        What is measured: nodes, or ``P_loss``
    measured : Array, shape (K + 1, channels)
        [degC] or [W]; NaN where nothing was measured
    counts : Array, shape (K + 1, channels)
        Rows behind every mean
    slow : bool
        Whether rows lie minutes apart: a switch then acts within an interval, not after it
    guided : bool
        Whether memories (switches above all) follow the measured temperatures where there are any. A simulated
        two-point control soon loses its phase, and then no fit can find its set-point; what it does next depends on
        what was there, and that was measured. For learning only: a prediction runs free
    lags : Array, shape (channels,), or None
        Time constants of the sensors, [s]: switches feel what a slow sensor does not show yet
    late_s : float
        By how much the clock of the temperatures is behind that of the inputs: switches felt them so much earlier
    error : ErrorCourse or None
        Model error that is assumed
    """

    recording: str
    time: Array
    samples: Array
    channels: tuple[str, ...]
    measured: Array
    counts: Array
    slow: bool = False
    guided: bool = False
    lags: Array | None = None
    late_s: float = 0.0
    error: ErrorCourse | None = None

    @cached_property
    def steps(self) -> Array:
        """Lengths of the intervals, shape (K,), [s]."""
        return np.diff(self.time)

    @property
    def duration(self) -> float:
        """How long it lasts, [s]."""
        return float(self.steps.sum())

    def until(self, time: float) -> Piece:
        """The piece up to a time [s], with at least one interval."""
        return self.part(0, max(int(np.searchsorted(self.time, time, side="right")), 2) - 1)

    def part(self, first: int, last: int) -> Piece:
        """The piece from one interval up to another one (excluded)."""
        return replace(self, time=self.time[first : last + 1], samples=self.samples[first:last],
                       measured=self.measured[first : last + 1], counts=self.counts[first : last + 1])  # fmt: skip

    def finer(self) -> tuple[Piece, NDArray[np.intp]]:
        """The piece in intervals of about :data:`FREE_S`; for slow rows, of half the sampling interval of the inputs.

        Returns
        -------
        piece : Piece
            Without measurements
        at : Array of int, shape (K + 1,)
            Where the grid points are in it
        """
        most = self.samples.shape[1]
        parts = np.full(len(self.steps), 2 * most)
        if not self.slow:
            parts = np.maximum(np.rint(self.steps / FREE_S), 1).astype(int)
        at = np.concatenate([[0], np.cumsum(parts)])
        owner = np.repeat(np.arange(len(parts)), parts)
        place, count = np.arange(at[-1]) - at[owner], parts[owner]
        time = np.append(self.time[owner] + self.steps[owner] * place / count, self.time[-1])
        inside = (place[:, None] + (np.arange(most) + 0.5) / most) / count[:, None] * most
        nothing = np.empty((len(time), 0))
        fine = replace(
            self, time=time, samples=self.samples[owner[:, None], inside.astype(int)], channels=(), measured=nothing,
            counts=nothing, guided=False, lags=None,
        )  # fmt: skip
        return fine, at

    def guide(self, parts: Sequence[str]) -> Array:
        """Measured temperatures of parts if the piece is guided, else NaN; shape (K + 1, parts), [degC]."""
        found = np.full((len(self.time), len(parts)), np.nan)
        for index, name in enumerate(self.channels):
            if self.guided and name in parts:
                lag = 0.0 if self.lags is None else float(self.lags[index])
                found[:, list(parts).index(name)] = self._without_sensor(self.measured[:, index], lag)
        if self.late_s:
            moved = [np.interp(self.time + self.late_s, self.time, course, np.nan, np.nan) for course in found.T]
            found = np.stack(moved, axis=1)
        return found

    def _without_sensor(self, measured: Array, lag: float) -> Array:
        """Estimated true temperature of a part: sensor lag removed, so that peaks are not cut off.

        Of the measured course alone: taken from the simulated one, it would be another one in every round.
        """
        sharp, behind = _sharpened(measured, self.steps), lag * _slope(measured, self.steps)
        if self.slow:
            return np.asarray(sharp + behind)
        turns, noise = _turning(measured)
        # Noise must not decide whether the switch acted that made the temperature turn.
        return np.asarray(sharp + np.where(turns == 0.0, behind, DOUBT_SDS * noise * turns))

    @cached_property
    def middle(self) -> Array:
        """Middles of the intervals, shape (K,), [s]."""
        return 0.5 * (self.time[1:] + self.time[:-1])

    @cached_property
    def inputs(self) -> Array:
        """Means of the inputs over the intervals, shape (K, inputs)."""
        return np.asarray(self.samples.mean(axis=1))


def pieces(
    recordings: Sequence[Recording], inputs: Sequence[str], channels: Sequence[str], *, even: bool = False
) -> tuple[Piece, ...]:
    """All pieces of all recordings.

    Parameters
    ----------
    inputs : sequence of str
        Names of the network's inputs, speed and torque first
    channels : sequence of str
        Channels of the result, the same for every piece; those that a recording lacks are NaN there
    even : bool
        Whether the intervals shall all be :data:`INTERVAL_S` long where rows lie closer together

    Returns
    -------
    tuple of Piece
        Pieces too short to learn anything from are left out
    """
    return tuple(piece for recording in recordings for piece in _pieces_of(recording, inputs, channels, even=even))


def too_short(recordings: Sequence[Recording], made: Sequence[Piece]) -> Iterator[str]:
    """A note on every recording with gap-free pieces that are too short to simulate; `made` by :func:`pieces`."""
    used = Counter(piece.recording for piece in made)
    for recording in recordings:
        every = len(recording.segments)
        if left := every - used[recording.name]:
            yield f"{recording.name}: {left} of {every} pieces without gaps are too short to simulate and not used"


def slow_rows(recordings: Sequence[Recording]) -> bool:
    """True if the rows of all recordings lie minutes apart."""
    return bool(recordings) and all(float(np.median(np.diff(r.time))) > SLOW_S for r in recordings)


def _pieces_of(recording: Recording, inputs: Sequence[str], channels: Sequence[str], *, even: bool) -> Iterator[Piece]:
    values = {channel.name: channel.values for channel in recording.channels}
    for rows in recording.segments:
        time = recording.time[rows]
        if len(time) < SHORTEST_PIECE:
            continue
        native = float(np.median(np.diff(time)))
        if 2.0 * native > INTERVAL_S:
            grid = time
        else:
            grid = np.arange(time[0], time[-1] + 0.5 * INTERVAL_S, INTERVAL_S)
            grid = np.minimum(grid[grid <= time[-1] + 1e-9], time[-1])
        if not even and native <= SLOW_S:
            driven = {name: recording.inputs[name][rows] for name in inputs}
            grid = _thinned(grid, time, driven, {n: values[n][rows] for n in channels if n in values})
            if any(np.ptp(course[time >= grid[-1]]) > _steady(name, course) for name, course in driven.items()):
                grid = np.append(grid, time[-1])  # the machine stops, say, in what is left of an interval
        if len(grid) < SHORTEST_PIECE:
            continue
        edges = grid[:-1, None] + np.diff(grid)[:, None] * np.linspace(0.0, 1.0, SAMPLES + 1)
        samples = np.stack([_means_of_lines(time, recording.inputs[name][rows], edges) for name in inputs], axis=-1)
        measured = np.full((len(grid), len(channels)), np.nan)
        counts = np.zeros((len(grid), len(channels)))
        middles = np.concatenate([[-np.inf], 0.5 * (grid[1:] + grid[:-1]), [np.inf]])
        cell = np.searchsorted(middles, time, side="right") - 1
        for index, name in enumerate(channels):
            if name in values:
                measured[:, index], counts[:, index] = _means(values[name][rows], time, cell, grid)
        yield Piece(
            recording=recording.name,
            time=grid,
            samples=samples,
            channels=tuple(channels),
            measured=measured,
            counts=counts,
            slow=native > SLOW_S,
            guided=True,
        )


def stands_for(time: Array) -> Array:
    """Quadrature weight of each grid point (trapezoidal rule), shape (K + 1,), [s].

    Examples
    --------
    >>> stands_for(np.array([0.0, 20.0, 40.0, 100.0]))
    array([10., 20., 40., 30.])
    """
    return np.asarray(np.diff(np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])))


def _means_of_lines(time: Array, values: Array, edges: Array) -> Array:
    """Means of the straight lines between rows over stretches of time.

    Parameters
    ----------
    time, values : Array, shape (rows,)
    edges : Array, shape (K, n + 1)
        Inside the rows

    Returns
    -------
    Array, shape (K, n)
    """
    steps, rise = np.diff(time), np.diff(values)
    areas = np.concatenate([[0.0], np.cumsum(0.5 * steps * (values[1:] + values[:-1]))])
    row = np.clip(np.searchsorted(time, edges, side="right") - 1, 0, len(steps) - 1)
    into = edges - time[row]
    area = areas[row] + into * (values[row] + 0.5 * into * (rise / steps)[row])
    return np.asarray(np.diff(area, axis=1) / np.diff(edges, axis=1))


def white_sd(*pieces: Array) -> float:
    """White noise of a signal from the second differences of its known values, robust against steps and outliers.

    Differences of a display are whole steps, so more than half of them may be at most the median. With a continuity
    correction, that share of normal noise lies below the middle between the median and the next step.

    Parameters
    ----------
    *pieces : Array, shape (rows,) each
        Without gaps; all of one noise

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> bool(abs(white_sd(np.linspace(0, 50, 4000) + rng.normal(0, 0.2, 4000)) - 0.2) < 0.01)
    True
    """
    second = np.concatenate([np.zeros(0), *(np.diff(values[np.isfinite(values)], 2) for values in pieces)])
    if not second.size:
        return 0.0
    away = np.round(np.abs(second - np.median(second)), 9)
    middle = float(np.median(away))
    below = away <= middle
    if middle == 0.0 or below.all():
        return float(1.4826 * middle / np.sqrt(6.0))
    edge = 0.5 * (middle + float(np.min(away[~below])))
    return float(edge / ndtri(0.5 + 0.5 * np.mean(below)) / np.sqrt(6.0))


def _thinned(even: Array, time: Array, inputs: Mapping[str, Array], values: Mapping[str, Array]) -> Array:
    """Grid points without those that lie amidst a calm.

    Parameters
    ----------
    even : Array
        Grid points :data:`INTERVAL_S` apart, or the rows
    time : Array, shape (rows,)
    values : mapping of str to Array
        What was measured, with gaps
    """
    if len(even) < SHORTEST_PIECE:
        return even
    count, step = len(even) - 1, float(np.median(np.diff(even)))
    cell = np.clip(np.searchsorted(even, time + 1e-9, side="right") - 1, 0, count - 1)
    happens = np.zeros(count, dtype=bool)
    most = int(LONGEST * INTERVAL_S / step + 1e-9)
    longest = np.full(count, most)  # of the interval that begins there
    for name, rows in inputs.items():
        means = _cell_means(rows, cell, count)
        usual = _steady(name, rows)
        allowed = max(usual, min(NOISE_SDS * white_sd(means), MOST_NOISE / STEADY_INPUT * usual))
        moved = np.abs(np.diff(means)) > allowed
        happens[1:] |= moved
        happens[:-1] |= moved
        for length in range(most, 1, -1):
            windows = sliding_window_view(np.append(means, np.full(length - 1, means[-1])), length)
            longest[np.ptp(windows, axis=-1) > allowed] = length - 1  # the shortest is the last to say so
    at = np.arange(count)
    jumped = np.maximum.accumulate(np.where(happens, at, -count))
    settled = (at - jumped) * step > SETTLING_S
    for name, rows in values.items():
        bends, turns = _bends(_cell_means(rows, cell, count), LEAST_BEND_W if is_total_loss(name) else LEAST_BEND_K)
        happens |= (settled & bends) | turns
    chosen, k, calm = [0], 0, 0
    upcoming = np.append(np.flatnonzero(happens), count)
    while k < count:
        ahead = int(upcoming[np.searchsorted(upcoming, k)]) - k  # intervals until something happens
        length = max(1, min(int(CALM_SHARE * calm), int(longest[k]), ahead))
        calm = calm + length if ahead else 0
        k += length
        chosen.append(k)
    return np.asarray(even[chosen])


def _steady(name: str, rows: Array) -> float:
    """By how much an input may move within an interval that counts as calm, in its unit."""
    return STEADY_AMBIENT_K if name == "T_ambient" else STEADY_INPUT * float(np.percentile(np.abs(rows), 95))


def _cell_means(rows: Array, cell: NDArray[np.intp], count: int) -> Array:
    """Means over cells, shape (count,); empty cells are interpolated between their neighbours."""
    good = np.isfinite(rows)
    seen = np.bincount(cell[good], minlength=count)
    known = np.flatnonzero(seen)
    if not len(known):
        return np.zeros(count)
    means = np.bincount(cell[good], rows[good], minlength=count)[known] / seen[known]
    return np.asarray(np.interp(np.arange(count), known, means))


def _bends(means: Array, least: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where the slope of a signal changes by more than its noise would make it, and where it turns round; (K,) each."""
    bends, turns, width = np.zeros(len(means), dtype=bool), np.zeros(len(means), dtype=bool), 2 * BEND_REACH
    if len(means) < 3 * width:
        return bends, turns
    total = np.concatenate([[0.0], np.cumsum(means)])
    box = (total[width:] - total[:-width]) / width
    before, after = box[width:-width] - box[: -2 * width], box[2 * width :] - box[width:-width]
    noise = white_sd(means)
    middle = slice(width + BEND_REACH, width + BEND_REACH + len(before))
    bends[middle] = np.abs(after - before) > max(BEND_SDS * noise * np.sqrt(6.0 / width), least)
    peak, valley = np.minimum(before, -after), np.minimum(-before, after)
    turns[middle] = np.maximum(peak, valley) > max(BEND_SDS * noise * np.sqrt(2.0 / width), 0.5 * least)
    return bends, turns


def _sharpened(means: Array, steps: Array) -> Array:
    """Peaks and valleys that means over the rows hide, from their change of slope, shape (K + 1,).

    A corner between two slopes that lies at the edge of a row is cut off by half of the second difference there, one in
    its midst by a sixth.
    """
    bend, slope = np.zeros_like(means), np.diff(means) / steps
    bend[1:-1] = (slope[:-1] - slope[1:]) * np.minimum(steps[:-1], steps[1:])
    return np.asarray(means + 0.5 * np.nan_to_num(bend))


def _slope(means: Array, steps: Array) -> Array:
    """How fast means over the rows change, shape (K + 1,)."""
    slope, result = np.diff(means) / steps, np.zeros_like(means)
    result[1:-1] = 0.5 * (slope[1:] + slope[:-1])
    return np.nan_to_num(result)


def _turning(means: Array) -> tuple[Array, float]:
    """Where means over the rows turn round, 1 at a peak and -1 in a valley, shape (K + 1,); and their noise."""
    result, reach = np.zeros(len(means)), 2 * BEND_REACH
    noise = white_sd(means)
    if len(means) <= 2 * reach:
        return result, noise
    for sign in (1.0, -1.0):
        around = sliding_window_view(np.nan_to_num(sign * means, nan=-np.inf), 2 * reach + 1)
        here = around[:, reach]
        foot = np.maximum(around[:, 0], around[:, -1])
        result[reach:-reach][(here >= around.max(axis=1)) & (here - foot > TURN_SDS * noise)] = sign
    return result, noise


def _means(values: Array, time: Array, cell: NDArray[np.intp], grid: Array) -> tuple[Array, Array]:
    """Mean of the rows around every grid point, moved to the grid point where the rows lie to one side of it."""
    good = np.isfinite(values)
    size = len(grid)
    count = np.bincount(cell[good], minlength=size).astype(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell[good], values[good], minlength=size) / count
        offset = np.bincount(cell[good], time[good], minlength=size) / count - grid
    known = np.flatnonzero(count > 0)
    if len(known) > 1:
        slope = np.gradient(mean[known], grid[known] + offset[known])
        mean[known] -= slope * offset[known] * (np.abs(offset[known]) > 1e-9)
    return mean, count
