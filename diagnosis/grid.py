"""From the rows of a recording to the working grid of the inference: pieces, intervals, means.

The inference walks over intervals of about :data:`INTERVAL_S`. Inputs are means over an interval, measurements means
around a grid point (a symmetric window, so that a steady drift leaves no error). Recordings that are sampled more
slowly keep their own times; where their rows are means over the time before their stamp, as those of SCADA are, inputs
and measurements are late by the same half step, which makes no difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.recording import Recording
from models.types import Array

INTERVAL_S = 20.0
SAMPLES = 5  # of the inputs per interval, at which losses are computed: they are not linear in speed
SHORTEST_PIECE = 5  # grid points
SLOW_S = 60.0  # rows further apart are means that hide what switches do, see :class:`Piece`


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
    """

    recording: str
    time: Array
    samples: Array
    channels: tuple[str, ...]
    measured: Array
    counts: Array
    slow: bool = False
    guided: bool = False

    @cached_property
    def steps(self) -> Array:
        """Lengths of the intervals, shape (K,), [s]."""
        return np.diff(self.time)

    def finer(self) -> Piece:
        """The same in intervals as long as the samples of the inputs lie apart, without measurements."""
        count = self.samples.shape[1]
        shares = np.arange(count) / count
        time = np.append((self.time[:-1, None] + self.steps[:, None] * shares).ravel(), self.time[-1])
        nothing = np.empty((len(time), 0))
        return replace(
            self, time=time, samples=self.samples.reshape(-1, 1, self.samples.shape[2]), channels=(),
            measured=nothing, counts=nothing, guided=False,
        )  # fmt: skip

    def seen(self, T: Array, parts: Sequence[str]) -> Array:
        """Temperatures of the parts that memories follow: measured where the piece is guided, else as simulated.

        Parameters
        ----------
        T : Array, shape (K + 1, parts)
            Simulated, at the grid points, [degC]
        parts : sequence of str
        """
        measured = self.guide(parts)
        return np.where(np.isfinite(measured), measured, T)

    def guide(self, parts: Sequence[str]) -> Array:
        """What was measured of the parts where the piece is guided, else NaN; shape (K + 1, parts), [degC]."""
        found = np.full((len(self.time), len(parts)), np.nan)
        for index, name in enumerate(self.channels):
            if self.guided and name in parts:
                found[:, list(parts).index(name)] = _sharpened(self.measured[:, index])
        return found

    @cached_property
    def middle(self) -> Array:
        """Middles of the intervals, shape (K,), [s]."""
        return 0.5 * (self.time[1:] + self.time[:-1])

    @cached_property
    def inputs(self) -> Array:
        """Means of the inputs over the intervals, shape (K, inputs)."""
        return np.asarray(self.samples.mean(axis=1))


def pieces(recordings: Sequence[Recording], inputs: Sequence[str], channels: Sequence[str]) -> tuple[Piece, ...]:
    """All pieces of all recordings.

    Parameters
    ----------
    recordings : sequence of Recording
    inputs : sequence of str
        Names of the network's inputs, speed and torque first
    channels : sequence of str
        Channels of the result, the same for every piece; those that a recording lacks are NaN there

    Returns
    -------
    tuple of Piece
        Pieces too short to learn anything from are left out
    """
    return tuple(piece for recording in recordings for piece in _pieces_of(recording, inputs, channels))


def slow_rows(recordings: Sequence[Recording]) -> bool:
    """Whether the rows of all recordings lie minutes apart."""
    return bool(recordings) and all(float(np.median(np.diff(r.time))) > SLOW_S for r in recordings)


def _pieces_of(recording: Recording, inputs: Sequence[str], channels: Sequence[str]) -> Iterator[Piece]:
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
            grid = grid[grid <= time[-1] + 1e-9]
        if len(grid) < SHORTEST_PIECE:
            continue
        fractions = (np.arange(SAMPLES) + 0.5) / SAMPLES
        at = grid[:-1, None] + np.diff(grid)[:, None] * fractions
        samples = np.stack([np.interp(at, time, recording.inputs[name][rows]) for name in inputs], axis=-1)
        measured = np.full((len(grid), len(channels)), np.nan)
        counts = np.zeros((len(grid), len(channels)))
        edges = np.concatenate([[-np.inf], 0.5 * (grid[1:] + grid[:-1]), [np.inf]])
        cell = np.searchsorted(edges, time, side="right") - 1
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


def _sharpened(means: Array) -> Array:
    """Peaks and valleys that means over the rows hide, from their second differences, shape (K + 1,).

    A corner between two slopes that lies at the edge of a row is cut off by half of the second difference there, one in
    its midst by a sixth.
    """
    bend = np.zeros_like(means)
    bend[1:-1] = 2.0 * means[1:-1] - means[:-2] - means[2:]
    return np.asarray(means + 0.5 * np.nan_to_num(bend))


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
