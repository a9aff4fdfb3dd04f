"""Free-running prediction of a recording: its inputs and nothing else, but for the start temperatures.

Start temperatures of parts without a sensor are unknown; they are taken from the first minutes, which do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.forward.grid import Piece, stands_for
from diagnosis.forward.observation import Sensors, reading_columns, readings
from diagnosis.forward.trajectory import Trajectory, complete_start, free_running, simulate
from diagnosis.inference.posterior import Problem
from models.base.types import Array
from models.quantities.quantities import is_total_loss

START_S = 600.0
LEFT_ALONE_SD_K = 2.0
START_ROUNDS, START_SETTLED_K = 3, 0.01
SETTLED_K, MOST_ROUNDS = 0.02, 30  # thick oil at a cold start takes many rounds


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


def predict(
    problem: Problem, index: int, z: Array, *, as_delivered: bool = False, guess: Array | None = None
) -> Prediction:  # fmt: skip
    """Predict one piece of a problem.

    Parameters
    ----------
    problem : Problem
    index : int
        Which piece
    z : Array, shape (unknowns,)
    as_delivered : bool
        Sensors without lag and bias, as somebody would use the nominal model
    guess : Array, shape (K + 1, parts), optional
        Temperatures to linearise about first, of another prediction: it saves time and nothing else
    """
    model, piece = problem.model, problem.pieces[index]
    span = float(piece.time[-1] - piece.time[0])
    counts_from = float(piece.time[0]) + min(START_S, 0.2 * span)
    sensors = problem.unknowns.sensors(piece.channels, z)
    if as_delivered:
        sensors = sensors.ideal()
    start = _start(problem, index, z, sensors, counts_from, as_delivered=as_delivered)
    try:
        trajectory = _free_run(problem, index, z, start, guess)
    except ArithmeticError:  # what the first minutes ask of it leads nowhere
        trajectory = _free_run(problem, index, z, problem.starts[index], None)
    read = readings(model, trajectory, sensors) if as_delivered else problem.read(trajectory, sensors, z)
    return Prediction(piece=piece, trajectory=trajectory, read=read, counts_from=counts_from)


def _free_run(problem: Problem, index: int, z: Array, start: Array, guess: Array | None) -> Trajectory:
    """The trajectory of a whole piece that nothing measured guides."""
    model, values = problem.model, problem.unknowns.network_values(problem.model.network, z)
    trajectory: Trajectory | None = None
    for _ in range(problem.passes):
        piece = replace(problem.adjusted(index, z, trajectory), guided=False)
        if any(state.update is not None for state in model.network.states):
            trajectory = free_running(model, piece, values, start, guess=guess)
        else:
            about = guess if trajectory is None else trajectory
            trajectory = simulate(model, piece, values, start, guess=about, rounds=MOST_ROUNDS, settled_K=SETTLED_K)
    assert trajectory is not None  # noqa: S101 - one run at least
    return trajectory


def _start(
    problem: Problem, index: int, z: Array, sensors: Sensors, until: float, *, as_delivered: bool
) -> Array:  # fmt: skip
    """Start temperatures of all parts, [degC]: as probable as can be by what the first minutes show."""
    model = problem.model
    likely, sd = _likely_start(problem, index)
    start = likely
    early = problem.changed(pieces=[piece.until(until) if i == index else piece
                                    for i, piece in enumerate(problem.pieces)])  # fmt: skip
    piece, noise = early.pieces[index], problem.noise[index]
    temperatures = [i for i, name in enumerate(piece.channels) if not is_total_loss(name)]
    seen = np.isfinite(piece.measured[:, temperatures])
    channel_sd, precision = noise.channel_sd[temperatures], np.diag(1.0 / sd**2)
    values = problem.unknowns.network_values(model.network, z)
    trajectory: Trajectory | None = None
    for _ in range(START_ROUNDS):
        adjusted = early.adjusted(index, z, trajectory)
        try:
            trajectory = simulate(model, adjusted, values, start, guess=trajectory, settled_K=SETTLED_K)
        except ArithmeticError:
            return np.array(problem.starts[index])
        read = readings(model, trajectory, sensors) if as_delivered else early.read(trajectory, sensors, z)
        count = len(start)
        free = trajectory.response(np.zeros((len(piece.steps), model.n, count)), np.eye(count))
        columns = reading_columns(model, trajectory, sensors, free, np.zeros((len(piece.steps), count)))
        residual = ((piece.measured - read)[:, temperatures] / channel_sd)[seen]
        J = (columns[:, temperatures] / channel_sd[:, None])[seen]
        step = np.linalg.solve(precision + J.T @ J, J.T @ residual + precision @ (likely - start))
        start = start + step
        if float(np.max(np.abs(step))) < START_SETTLED_K:
            break
    return start


def _likely_start(problem: Problem, index: int) -> tuple[Array, Array]:
    """Start temperatures before the first minutes have said anything, and their standard deviations, (unknown,) each.

    What is solved with the temperatures, as oil in a tank, may have been left as it was declared or have gone along
    with the gearbox.
    """
    model, parts = problem.model, problem.starts[index]
    declared = complete_start(model, parts)[model.n :]
    warm = float(np.mean(parts))
    start = np.concatenate([parts, 0.5 * (declared + warm)])
    sd = np.concatenate([problem.noise[index].start_sd, LEFT_ALONE_SD_K + 0.5 * np.abs(warm - declared)])
    return start, sd


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
