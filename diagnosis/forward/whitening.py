"""The noise of a recording, and the filter that turns residuals into independent standard normal numbers.

A free-running residual wanders for hours: one forgotten watt in the oil shows in every later row. Judged row by row it
looks like overwhelming evidence. The noise model therefore holds what a real gearbox always has besides its model: a
random heat in every part (an Ornstein-Uhlenbeck process, the *structural floor*; larger where much heat goes to the
surroundings), draughts that change the heat of all parts to their surroundings by one random share, unknown start
temperatures, and white sensor noise. A Kalman filter of the
linearised network gives the innovations of any signal under this noise; the same filter applied to a derivative gives
that derivative in the same, whitened units.

References
----------
Kristensen, Madsen, Jorgensen, Automatica 40 (2004), for stochastic grey-box models; Harvey, Forecasting, Structural
Time Series Models and the Kalman Filter (1989), section 3.4, for the same filter on regressors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtri

from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import Sensors, to_points
from diagnosis.forward.trajectory import Trajectory
from models.base.types import Array
from models.quantities.quantities import is_total_loss

MISSING_VARIANCE = 1e12
AT_ONCE = 128  # columns, so that a step stays in the processor's cache
JUMP_SHARE = 0.3  # of a change within one interval: whether it came early or late in it is not known


@dataclass(frozen=True, kw_only=True)
class RandomHeat:
    """How much random heat there is.

    Attributes
    ----------
    heat, wander, time : float
        Factors on what is assumed in the parts, of what surroundings take from each, and of the correlation time
    draught : float
        Random share of all heat to the surroundings, as :attr:`Noise.draught`
    parts : tuple of float, length parts or 0
        Further factors on that of each part; none: 1
    """

    heat: float = 1.0
    wander: float = 1.0
    time: float = 1.0
    draught: float = 0.0
    parts: tuple[float, ...] = ()

    @property
    def heats(self) -> Array:
        """Factors on what is assumed in each part, shape (parts,), or (1,) if they are all the same."""
        return self.heat * np.array(self.parts or (1.0,))


AS_ASSUMED = RandomHeat()


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise of a recording: everything that its model leaves out.

    Attributes
    ----------
    channel_sd : Array, shape (channels,)
        White noise of one row, [K] or [W]
    floor_sd : Array, shape (channels,)
        White part that averaging does not reduce (a step of the display), [K] or [W]
    loss_relative_sd : float
        White noise of the total loss as a fraction of it, [-]
    heat_sd : Array, shape (parts,)
        Random heat in the parts, [W]
    heat_time : float
        Its correlation time, [s]
    start : Array, shape (parts, parts)
        Covariance of the start temperatures, [K^2]
    wander : float
        Random share of the heat that a part gives to its surroundings, of each part by itself, [-]
    draught : float
        Random share of the heat that all parts give to their surroundings together, [-]
    capacity : float
        Sum of the heat capacities that `heat_sd` is given for, [J/K]: it goes with them, else the floor would decide on
        the size of a gearbox whose recordings determine ratios only; 0 where it is fixed
    """

    channel_sd: Array
    floor_sd: Array
    loss_relative_sd: float
    heat_sd: Array
    heat_time: float
    start: Array
    wander: float = 0.0
    draught: float = 0.0
    capacity: float = 0.0

    @property
    def goes_with_capacity(self) -> bool:
        """True of a machine without geometry: its watts are known but for a common factor."""
        return self.capacity > 0.0

    def with_random_heat(self, times: RandomHeat) -> Noise:
        """Noise with its random heats multiplied, and draughts."""
        return replace(self, heat_sd=self.heat_sd * times.heats, wander=self.wander * times.wander,
                       heat_time=self.heat_time * times.time, draught=times.draught)  # fmt: skip


class Whitening:
    """The Kalman filter of one trajectory: its gains depend on the noise and the linearisation, not on the data."""

    def __init__(self, model: NetworkOnGrid, trajectory: Trajectory, sensors: Sensors, noise: Noise) -> None:
        n, piece = trajectory.decay.shape[-1], trajectory.piece
        if noise.goes_with_capacity:
            share = float(trajectory.capacities.sum()) / noise.capacity
            noise = replace(noise, heat_sd=noise.heat_sd * share)
        shaken = np.flatnonzero(noise.heat_sd > 0.0)
        size, steps = n + len(shaken) + (noise.draught > 0.0), piece.steps
        count = len(steps)
        rho = np.exp(-steps / noise.heat_time)
        outside, balance = np.abs(model.to_parts.sum(axis=1)) > 0.5, trajectory.balance  # not between parts
        flows, into = (balance.conductances * balance.differences)[:, outside], model.to_parts[outside]
        # The states are of variance 1; how much heat they are goes with the heat that the surroundings take.
        heat_sd = np.hypot(noise.heat_sd, noise.wander * np.sqrt(np.square(flows) @ np.abs(into)))[:, shaken]
        per_capacity = trajectory.gain[:, :, shaken] * (heat_sd / trajectory.capacities[shaken])[:, None, :]
        transition = np.zeros((count, size, size))
        transition[:, :n, :n] = trajectory.decay
        transition[:, :n, n : n + len(shaken)] = per_capacity
        if noise.draught > 0.0:
            rates = noise.draught * (flows @ into) / trajectory.capacities
            transition[:, :n, -1] = np.einsum("kij,kj->ki", trajectory.gain[:, :, : model.n], rates)
        transition[:, range(n, size), range(n, size)] = rho[:, None]
        renewed = np.zeros((count, size, size))
        renewed[:, range(n, size), range(n, size)] = 1.0 - rho[:, None] ** 2
        observe = _observation(model, trajectory, sensors, size)
        self._seen = np.isfinite(piece.measured)
        points, m = self._seen.shape
        variance = np.zeros((points, m, m))
        white = reading_variance(model, trajectory, sensors, noise)
        variance[:, range(m), range(m)] = np.where(self._seen, white, MISSING_VARIANCE)
        root, gains = np.empty((points, m, m)), np.empty((points, size, m))
        covariance = np.zeros((size, size))
        covariance[range(n), range(n)] = noise.start.max()  # of a tank it is as little known as can be
        covariance[: model.n, : model.n] = noise.start
        covariance[range(n, size), range(n, size)] = 1.0
        for k, (H, white_k) in enumerate(zip(observe, variance, strict=True)):
            if k:
                step = transition[k - 1]
                covariance = step @ covariance @ step.T + renewed[k - 1]
            PH = covariance @ H.T
            factor, failed = dpotrf(H @ PH + white_k, lower=True)  # NumPy's take six times as long for 7 x 7
            if failed:
                raise np.linalg.LinAlgError("the covariance of readings is not positive definite")
            root[k], _ = dtrtri(factor, lower=True)
            gains[k] = gain = PH @ root[k].T
            covariance = covariance - gain @ gain.T
        gains = gains @ root
        self.log_determinant = -2.0 * float(np.log(np.diagonal(root, axis1=1, axis2=2)[self._seen]).sum())
        # One matrix per step takes (state, reading) to (next state, innovation).
        self._step = np.zeros((points, size + m, size + m))
        self._step[:-1, :size, :size] = transition - transition @ gains[:-1] @ observe[:-1]
        self._step[:-1, :size, size:] = transition @ gains[:-1]
        self._step[:, size:, :size] = -root @ observe
        self._step[:, size:, size:] = root

    def __call__(self, columns: Array) -> Array:
        """Innovations of signals.

        Parameters
        ----------
        columns : Array, shape (K + 1, channels, columns)
            Readings: a residual, or derivatives

        Returns
        -------
        Array, shape ((K + 1) channels, columns)
            Standardised innovations; 0 where nothing was measured
        """
        points, m, count = columns.shape
        size = self._step.shape[1] - m
        result = np.empty((points, m, count))
        for first in range(0, count, AT_ONCE):
            some = slice(first, first + AT_ONCE)
            given = np.where(self._seen[:, :, None], columns[:, :, some], 0.0)
            now, after = np.zeros((2, size + m, given.shape[2]))
            for step, reading, innovation in zip(self._step, given, result[:, :, some], strict=True):
                now[size:] = reading
                np.dot(step, now, out=after)
                innovation[...] = after[size:]
                now, after = after, now
        result[~self._seen] = 0.0
        return result.reshape(points * m, count)


def reading_variance(model: NetworkOnGrid, trajectory: Trajectory, sensors: Sensors, noise: Noise) -> Array:
    """White variance of every reading, shape (K + 1, channels), [K^2] or [W^2]: instruments, and jumps of operation."""
    piece = trajectory.piece
    variance = noise.channel_sd**2 / np.maximum(piece.counts, 1.0) + noise.floor_sd**2
    for index, name in enumerate(sensors.channels):
        if is_total_loss(name):
            total = trajectory.loss
            at = to_points(total)
            variance[:, index] += (noise.loss_relative_sd * at) ** 2 / np.maximum(piece.counts[:, index], 1.0)
            # Where the operating point jumps, a reading may belong to either side.
            jump = np.abs(np.diff(total, prepend=total[0], append=total[-1]))
            jump = np.maximum(jump, np.maximum(np.roll(jump, 1), np.roll(jump, -1)))
            variance[:, index] += (JUMP_SHARE * jump) ** 2
        else:
            moved = np.abs(np.diff(trajectory.T[:, model.part_index(name)]))
            variance[:, index] += (JUMP_SHARE * np.maximum(np.append(moved, 0.0), np.append(0.0, moved))) ** 2
    return np.asarray(variance)


def _observation(model: NetworkOnGrid, trajectory: Trajectory, sensors: Sensors, size: int) -> Array:
    """Readings per state, shape (K + 1, channels, size). Lags of the random part are not followed: it is slow."""
    points = len(trajectory.T)
    H = np.zeros((points, len(sensors.channels), size))
    for index, name in enumerate(sensors.channels):
        if is_total_loss(name):
            slope = trajectory.loss_slope
            H[:, index, : model.n] = to_points(slope)
        else:
            H[:, index, model.part_index(name)] = 1.0
    return H
