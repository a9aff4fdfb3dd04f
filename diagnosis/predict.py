"""Free-running prediction of a recording: its inputs and nothing else, but for the start temperatures.

Start temperatures of parts without a sensor are unknown; they are taken from the first minutes, which do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.grid import Piece, stands_for
from diagnosis.mapping import LOSS
from diagnosis.observation import reading_columns, readings
from diagnosis.posterior import Problem
from diagnosis.trajectory import Trajectory, free_running, simulate
from models.types import Array

START_S = 600.0
START_ROUNDS = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """What the sensors would read, free-running.

    Attributes
    ----------
    piece : Piece
    trajectory : Trajectory
    read : Array, shape (K + 1, channels)
        [degC] or [W]
    counts_from : float
        Time from which it counts, [s]
    """

    piece: Piece
    trajectory: Trajectory
    read: Array
    counts_from: float

    @property
    def residual(self) -> Array:
        """Measured minus read where it counts, NaN elsewhere, shape (K + 1, channels)."""
        late = self.piece.time >= self.counts_from
        return np.where(late[:, None], self.piece.measured - self.read, np.nan)

    @property
    def weights(self) -> Array:
        """Time that every row stands for, shape (K + 1,), [s]."""
        return stands_for(self.piece.time)


def predict(problem: Problem, index: int, z: Array, *, as_delivered: bool = False) -> Prediction:
    """Predict one piece of a problem.

    Parameters
    ----------
    problem : Problem
    index : int
        Which piece
    z : Array, shape (unknowns,)
    as_delivered : bool
        Sensors without lag and bias, as somebody would use the nominal model
    """
    model, piece = problem.model, problem.pieces[index]
    span = float(piece.time[-1] - piece.time[0])
    counts_from = float(piece.time[0]) + min(START_S, 0.2 * span)
    early = piece.time <= counts_from
    before = start = np.array(problem.starts[index])
    prior = problem.noise[index].start_sd
    trajectory: Trajectory | None = None
    switching = any(state.update is not None for state in model.network.states)
    for _ in range(START_ROUNDS):
        adjusted = replace(problem.adjusted(index, z, trajectory), guided=switching)
        values = problem.unknowns.network_values(model.network, z)
        try:
            trajectory = simulate(model, adjusted, values, start, guess=trajectory, rounds=4, settled_K=0.02)
        except ArithmeticError:
            if trajectory is None:
                raise
            start = before  # what the first minutes ask of it leads nowhere
            break
        sensors = problem.unknowns.sensors(piece.channels, z)
        if as_delivered:
            sensors = sensors.ideal()
        read = readings(model, trajectory, sensors) if as_delivered else problem.read(trajectory, sensors, z)
        free = trajectory.response(np.zeros((len(piece.steps), model.n, model.n)), np.eye(model.n))
        columns = reading_columns(model, trajectory, sensors, free, np.zeros((len(piece.steps), model.n)))
        temperatures = [i for i, name in enumerate(piece.channels) if name != LOSS]
        seen = early[:, None] & np.isfinite(piece.measured)
        seen = seen[:, temperatures]
        sd = problem.noise[index].channel_sd[temperatures]
        residual = ((piece.measured - read)[:, temperatures] / sd)[seen]
        J = (columns[:, temperatures] / sd[:, None])[seen]
        precision = np.diag(1.0 / prior**2)
        step = np.linalg.solve(precision + J.T @ J, J.T @ residual + precision @ (problem.starts[index] - start))
        if float(np.max(np.abs(step))) < 0.01:
            break
        before, start = start, start + step
    assert trajectory is not None  # noqa: S101 - START_ROUNDS >= 1
    if switching:
        # Until here switches followed what was measured, which is good enough for the start and for nothing else.
        trajectory = free_running(model, problem.adjusted(index, z, trajectory), trajectory.values, start)
        read = readings(model, trajectory, sensors) if as_delivered else problem.read(trajectory, sensors, z)
    return Prediction(piece=piece, trajectory=trajectory, read=read, counts_from=counts_from)


def rmse(residuals: Array, weights: Array) -> Array:
    """Root mean square per channel, shape (channels,); NaN where nothing was measured.

    Parameters
    ----------
    residuals : Array, shape (rows, channels)
    weights : Array, shape (rows,)
        Time that every row stands for
    """
    good = np.isfinite(residuals)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt((weights @ np.where(good, residuals, 0.0) ** 2) / (weights @ good)))


def overall_rmse(predictions: Sequence[Prediction], columns: Sequence[int]) -> float:
    """Root mean square of the residuals of some channels of several predictions; NaN where nothing was measured.

    Parameters
    ----------
    predictions : sequence of Prediction
    columns : sequence of int
        Which channels
    """
    squares = total = 0.0
    for predicted in predictions:
        residual = predicted.residual[:, columns]
        good = np.isfinite(residual)
        squares += float((predicted.weights @ np.where(good, residual, 0.0) ** 2).sum())
        total += float((predicted.weights @ good).sum())
    return float(np.sqrt(squares / total)) if total > 0.0 else float("nan")
