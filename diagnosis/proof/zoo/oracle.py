r"""Oracle: evidence that the training recordings of a case hold for what is concealed, without a law of the diagnosis.

With x, the noise-free readings of the plant with the effect minus those without it, the evidence is half of

.. math:: D = x^T (\Sigma + C C^T)^{-1} x,

on means of 120 s. :math:`\Sigma` holds noise, quantisation and a coloured floor of every channel, the plant's random
heat and its start temperatures; the columns C are what a method cannot know: the parameters of this plant
(``plant``), or also the model error of a tool with lumped laws (``tool``). Every column is scaled by its prior
standard deviation. The numbers are fixed by the definition of the zoo; no method chooses them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from models.base.types import Array

MEAN_S = 120.0
LOSS = "P_loss"  # channel of the measured total loss
FLOOR_K, FLOOR_W = 0.1, 1.5
FLOOR_TAU_S = (600.0, 1500.0, 3600.0)  # in equal parts of variance


@dataclass(frozen=True, kw_only=True)
class OracleNats:
    """Evidence for an effect, D / 2, [nats].

    Attributes
    ----------
    plant : float
        If only the parameters of the plant are unknown
    tool : float
        If the model error of a lumped model is unknown, too; at most `plant`
    """

    plant: float
    tool: float

    @property
    def facts(self) -> dict[str, float]:
        """Evidence by the keys of the truth."""
        return {"D_plant_nats": round(self.plant, 2), "D_tool_nats": round(self.tool, 2)}


@dataclass(frozen=True, kw_only=True)
class RecordingColumns:
    """Columns of one recording on means, each for one standard deviation of its unknown.

    Attributes
    ----------
    channels : tuple of str
        Temperatures, and :data:`LOSS` if the loss is measured
    rows : int
        Of the recording
    step_s : float
        Interval of the means, [s]
    white : Array, shape (channels, means)
        Standard deviation of white noise of the means, [K] and [W]
    local : Array, shape (unknowns, channels, means)
        Random heat and start temperatures, which every recording has for itself
    plant : Array, shape (unknowns, channels, means)
        Parameters of the plant, shared by all recordings
    tool : Array, shape (unknowns, channels, means)
        Model error, shared by all recordings
    """

    channels: tuple[str, ...]
    rows: int
    rows_per_mean: int
    step_s: float
    white: Array
    local: Array
    plant: Array
    tool: Array


class OracleDesign:
    """All that does not depend on the effect: the whitened columns of the training recordings.

    Parameters
    ----------
    recordings : sequence of RecordingColumns
        The shared unknowns in the same order everywhere
    """

    def __init__(self, recordings: Sequence[RecordingColumns]) -> None:
        self.recordings = tuple(recordings)
        self._parts = [_WhiteColumns(columns) for columns in self.recordings]
        self._unknowns = len(self.recordings[0].plant)
        self._gram = sum(part.gram for part in self._parts) + np.eye(len(self._parts[0].gram))

    def nats_of(self, x: Sequence[Mapping[str, Array]]) -> OracleNats:
        """Evidence for one effect.

        Parameters
        ----------
        x : sequence of mappings of channel to Array, shape (rows,)
            By training recording: readings with the effect minus those without it, noise-free, [K] and [W]; a channel
            that is not given does not change
        """
        squared, cross = 0.0, np.zeros(len(self._gram))
        for part, readings in zip(self._parts, x, strict=True):
            own_squared, own_cross = part.project(readings)
            squared, cross = squared + own_squared, cross + own_cross

        def half_distance(unknowns: int) -> float:
            b = cross[:unknowns]
            explained = b @ cho_solve(cho_factor(self._gram[:unknowns, :unknowns]), b)
            return 0.5 * max(squared - float(explained), 0.0)

        return OracleNats(plant=half_distance(self._unknowns), tool=half_distance(len(cross)))


class _WhiteColumns:
    """Whitened columns of one recording, its local unknowns marginalised.

    Attributes
    ----------
    gram : Array, shape (shared, shared)
    """

    def __init__(self, columns: RecordingColumns) -> None:
        self.columns = columns
        local = _flat(whitened(columns.local, columns.white, self._floor(), columns.step_s))
        shared = np.concatenate([columns.plant, columns.tool])
        self.shared = _flat(whitened(shared, columns.white, self._floor(), columns.step_s))
        self.root = np.linalg.cholesky(local @ local.T + np.eye(len(local)))
        self.local = local
        self.shared_local = solve_triangular(self.root, local @ self.shared.T, lower=True)
        self.gram = self.shared @ self.shared.T - self.shared_local.T @ self.shared_local

    def project(self, readings: Mapping[str, Array]) -> tuple[float, Array]:
        """Square of an effect's readings, and their products with the shared columns, shape (shared,)."""
        columns = self.columns
        quiet = np.zeros(columns.rows)
        rows = np.stack([readings.get(channel, quiet) for channel in columns.channels])
        means = averaged(rows, columns.rows_per_mean)[None]
        x = _flat(whitened(means, columns.white, self._floor(), columns.step_s))[0]
        x_local = solve_triangular(self.root, self.local @ x, lower=True)
        return float(x @ x - x_local @ x_local), self.shared @ x - self.shared_local.T @ x_local

    def _floor(self) -> Array:
        return np.array([FLOOR_W if channel == LOSS else FLOOR_K for channel in self.columns.channels])


def averaged(values: Array, rows_per_mean: int) -> Array:
    """Means of successive rows, shape (..., means); rows at the end that do not fill a mean are left out."""
    means = values.shape[-1] // rows_per_mean
    whole = values[..., : means * rows_per_mean]
    return np.asarray(whole.reshape(*values.shape[:-1], means, rows_per_mean).mean(axis=-1))


def whitened(values: Array, white: Array, floor: Array, step_s: float) -> Array:
    """Innovations of series under white noise plus a coloured floor, each over its standard deviation.

    The floor is a sum of three Ornstein-Uhlenbeck processes of :data:`FLOOR_TAU_S` and equal variance; a Kalman filter
    with one state for each of them, stationary at the start.

    Parameters
    ----------
    values : Array, shape (series, channels, steps)
    white : Array, shape (channels, steps)
        Standard deviation of the white noise
    floor : Array, shape (channels,)
        Standard deviation of the whole floor
    step_s : float
        [s]

    Returns
    -------
    Array, shape (series, channels, steps)
        Uncorrelated, variance 1 under this noise
    """
    keep = np.exp(-step_s / np.array(FLOOR_TAU_S))
    variance = (floor**2 / len(keep))[:, None, None] * np.eye(len(keep))
    fresh = variance * (1.0 - keep**2)
    covariance = variance
    state = np.zeros((len(floor), len(keep), len(values)))
    out = np.empty((values.shape[2], values.shape[1], values.shape[0]))
    series = np.ascontiguousarray(values.transpose(2, 1, 0))
    for step in range(len(series)):
        seen = covariance.sum(axis=2)
        total = seen.sum(axis=1) + white[:, step] ** 2
        gain = seen / total[:, None]
        surprise = series[step] - state.sum(axis=1)
        out[step] = surprise / np.sqrt(total)[:, None]
        state = keep[:, None] * (state + gain[:, :, None] * surprise[:, None, :])
        covariance = (covariance - gain[:, :, None] * seen[:, None, :]) * np.outer(keep, keep) + fresh
    return np.asarray(out.transpose(2, 1, 0))


def _flat(values: Array) -> Array:
    return values.reshape(len(values), int(np.prod(values.shape[1:])))
