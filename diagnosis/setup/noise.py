"""Assumed noise of a recording, before anything is explained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from diagnosis.forward.grid import Piece, slow_rows, white_sd
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.whitening import Noise
from diagnosis.recordings.recording import Recording
from diagnosis.setup.start import start_covariance, start_guess
from models.base.types import Array
from models.quantities.quantities import is_total_loss

LOWEST_SD_K, LOWEST_SD_W = 0.02, 0.5
HARMONICS = np.arange(1.0, 51.0)  # of the error of rounding
FEWEST_ROWS, DEFAULT_LOSS_RELATIVE = 50, 0.02
HEAT_FRACTION = 0.005  # random heat in every part, of the typical total loss
HEAT_TIME_S = 1200.0
WANDER = 0.03  # of the heat to the surroundings: draughts; strangers' healthy machines ask for it (17 to 58 nats each)
# Laws of which only the form is known miss more, in every part; a part of little heat capacity is at once where its
# heat and conductances put it, so its floor is told as a temperature.
PARAMETRIC_FRACTION, PARAMETRIC_K = 0.05, 0.7
SLOW_SD_K = 0.3  # at most, of rows minutes apart: what differs from row to row is operation then, not instrument


def loss_noise(recordings: Sequence[Recording]) -> tuple[float, float]:
    """White noise of one row of the measured total loss: a constant part [W] and one relative to the loss [-].

    From the second differences in five classes of loss, by least squares of the variances.
    """
    seconds, levels = [], []
    for recording in recordings:
        for channel in recording.channels:
            if is_total_loss(channel.name):
                for rows in recording.segments:
                    values = channel.values[rows]
                    values = values[np.isfinite(values)]
                    seconds.append(np.diff(values, 2))
                    levels.append(values[1:-1])
    second, level = np.concatenate(seconds), np.abs(np.concatenate(levels))
    if len(second) < FEWEST_ROWS:
        return LOWEST_SD_W, DEFAULT_LOSS_RELATIVE
    classes = np.array_split(np.argsort(level), 5)
    # Steps of the operating point are rare; the median does not see them.
    variance = np.array([(1.4826 * np.median(np.abs(second[c]))) ** 2 / 6.0 for c in classes])
    square = np.array([np.median(level[c]) ** 2 for c in classes])
    weight = 1.0 / (variance + 1e-6 * variance.max() + 1e-12)
    (constant, relative), _ = nnls(np.stack([weight, weight * square], axis=1), weight * variance)
    return max(float(np.sqrt(constant)), LOWEST_SD_W), float(np.sqrt(relative))


def channel_noise(recordings: Sequence[Recording], channels: Sequence[str]) -> Mapping[str, float]:
    """White noise of one row of every temperature, [K]: as the rows show it, or as stated where they are too few."""
    result = {}
    for name in channels:
        if is_total_loss(name):
            continue  # see loss_noise: it goes with the loss
        found = [c for r in recordings for c in r.channels if c.name == name]
        stated = [c.noise for c in found if c.noise is not None]
        rows = sum(int(np.isfinite(c.values).sum()) for c in found)
        # What the rows show is worth more than what a data sheet says.
        if stated and rows < FEWEST_ROWS:
            result[name] = max(stated)
        else:
            # Of the noisiest long piece, or of all together: a few rows show a noise of any size.
            pieces = [c.values[rows] for r in recordings for c in r.channels if c.name == name for rows in r.segments]
            long = [white_sd(values) for values in pieces if len(values) >= FEWEST_ROWS]
            result[name] = max(max(long) if long else white_sd(*pieces), LOWEST_SD_K)
            if slow_rows(recordings):
                result[name] = min(result[name], SLOW_SD_K)
    return result


def display_noise(
    recordings: Sequence[Recording], channels: Sequence[str], white: Mapping[str, float], loss_W: float
) -> Array:  # fmt: skip
    """Standard deviation of what rounding leaves in a mean of many rows, shape (channels,), [K] or [W].

    Of the coarsest display of every channel; 0 if none is known. Noise of half a step and more lets the mean read
    between the steps.

    Parameters
    ----------
    white : mapping of str to float
        Noise of one row of every temperature, rounding included, [K]
    loss_W : float
        The same of the total loss, [W]
    """
    steps = [[c.resolution or 0.0 for r in recordings for c in r.channels if c.name == name] for name in channels]
    coarsest = [max(found, default=0.0) for found in steps]
    return np.array([left_by_rounding(step, white.get(name, loss_W))
                     for name, step in zip(channels, coarsest, strict=True)])  # fmt: skip


def left_by_rounding(step: float, sd: float) -> float:
    """Standard deviation of the error of the mean of many rounded readings of one value.

    The mean error of a value x is the Fourier series of the error of rounding, every harmonic k multiplied by the
    characteristic function of the noise, exp(-2 (pi k noise / step)^2) (Widrow, Kollar, Quantization Noise (2008), on
    dither; from memory, checked against drawn readings). Without noise it is that of rounding, step / sqrt(12).

    Parameters
    ----------
    sd : float
        Of one reading, rounding included
    """
    if step == 0.0:
        return 0.0
    noise = np.sqrt(max(sd * sd - step * step / 12.0, 0.0)) / step
    kept = np.average(np.exp(-np.square(2.0 * np.pi * HARMONICS * noise)), weights=1.0 / HARMONICS**2)
    return step * float(np.sqrt(kept / 12.0))


def noise_of(
    model: NetworkOnGrid, piece: Piece, white: Mapping[str, float], loss_W: float, *,
    loss_noise: tuple[float, float] = (0.0, 0.0), display: ArrayLike = 0.0, parametric: bool = False,
) -> Noise:  # fmt: skip
    """The noise of one piece.

    Parameters
    ----------
    white : mapping of channel to float
        White noise of one row
    loss_W : float
        Typical total loss, [W]
    loss_noise : (float, float)
        Of the measured total loss, see :func:`loss_noise`
    display : array_like, shape (channels,)
        What rounding leaves in a mean of many rows, see :func:`display_noise`, [K] or [W]
    parametric : bool
        Whether only the form of the laws is known: the structural floor (random heat in every part) is higher then
    """
    capacities = model.capacities(model.start)
    heavy = capacities > 0.01 * capacities.max()
    heat_sd = np.where(heavy, HEAT_FRACTION * loss_W, 0.0)
    if parametric:
        heat_sd = np.where(heavy, PARAMETRIC_FRACTION * loss_W, PARAMETRIC_K * _conductances(model, piece))
    return Noise(
        channel_sd=np.array([white.get(name, loss_noise[0]) for name in piece.channels]),
        floor_sd=np.maximum([LOWEST_SD_W if is_total_loss(one) else LOWEST_SD_K for one in piece.channels], display),
        loss_relative_sd=loss_noise[1],
        heat_sd=heat_sd,
        heat_time=HEAT_TIME_S,
        start=start_covariance(model, piece),
        wander=WANDER,
        capacity=float(capacities.sum()) if parametric else 0.0,
    )


def _conductances(model: NetworkOnGrid, piece: Piece) -> Array:
    """Sum of the conductances of every part, mean over a piece, as delivered, [W/K], shape (parts,)."""
    T = np.broadcast_to(start_guess(model, piece), (len(piece.steps), model.n))
    memory = np.zeros((len(T), len(model.network.states)))
    each = model.conductances(model.signals(piece, T, model.start, memory), model.start, (len(T),))
    return np.asarray(each.mean(axis=0) @ np.abs(model.to_parts))
