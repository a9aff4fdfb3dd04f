"""Free-running prediction of a recording: its inputs and nothing else, but for the start temperatures.

Start temperatures of parts without a sensor are unknown; they are taken from the first minutes, which do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from diagnosis.engine.fit import NOISE_ALONE, Experiment, Fit, Linear
from diagnosis.engine.point import Setting
from diagnosis.forward.free_running import free_running
from diagnosis.forward.grid import Piece, stands_for
from diagnosis.forward.observation import reading_columns
from diagnosis.forward.trajectory import ROUNDS, Trajectory, complete_start, simulate
from diagnosis.setup.inference_setup import START_S
from models.base.types import Array
from models.quantities.quantities import is_total_loss

LEFT_ALONE_SD_K = 2.0
START_ROUNDS, START_SETTLED_K = 3, 0.01
SETTLED_K, MOST_ROUNDS = 0.02, 30  # thick oil at a cold start takes many rounds


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """Free-running readings of the sensors.

    Attributes
    ----------
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
        """Time that every row represents, shape (K + 1,), [s]."""
        return stands_for(self.piece.time)


def predict(experiment: Experiment, index: int, z: Array | None, *, guess: Array | None = None) -> Prediction:
    """Predict one piece.

    Parameters
    ----------
    index : int
        Which piece
    z : Array, shape (unknowns,), or None
        None: the model as delivered, with sensors without lag and bias
    guess : Array, shape (K + 1, parts), optional
        Temperatures to linearise about first, of another prediction: it saves time and nothing else

    Raises
    ------
    ArithmeticError
        If the temperatures leave all bounds.
    """
    setting, piece = _setting(experiment, index, z), experiment.pieces[index]
    span = float(piece.time[-1] - piece.time[0])
    counts_from = float(piece.time[0]) + min(START_S, 0.2 * span)
    start = _start(experiment, index, setting, counts_from)
    try:
        trajectory = _free_run(setting, piece, start, guess)
    except ArithmeticError:  # what the first minutes ask of it leads nowhere
        trajectory = _free_run(setting, piece, experiment.starts[index], None)
    return Prediction(piece=piece, trajectory=trajectory, read=setting.read(trajectory), counts_from=counts_from)


def _setting(experiment: Experiment, index: int, z: Array | None) -> Setting:
    if z is not None:
        return experiment.setting(index, z)
    setting = experiment.setting(index, np.zeros(len(experiment.unknowns)))
    nothing = np.zeros(len(setting.sensors.channels))
    return replace(setting, sensors=replace(setting.sensors, lag=nothing, bias=nothing, loss_gain=1.0, loss_delay=0.0))


def _free_run(setting: Setting, piece: Piece, start: Array, guess: Array | None) -> Trajectory:
    """The trajectory of a whole piece that nothing measured guides."""
    model, trajectory = setting.machine.model, None
    for _ in range(setting.machine.passes):
        adjusted = replace(setting.piece(piece, trajectory), guided=False)
        if any(state.update is not None for state in model.network.states):
            trajectory = free_running(model, adjusted, setting.values, start, guess=guess)
        else:
            about = guess if trajectory is None else trajectory
            trajectory = simulate(model, adjusted, setting.values, start, guess=about, rounds=MOST_ROUNDS,
                                  settled_K=SETTLED_K)  # fmt: skip
    assert trajectory is not None  # noqa: S101 - one run at least
    return trajectory


def _start(experiment: Experiment, index: int, setting: Setting, until: float) -> Array:
    """Start temperatures of all parts, [degC]: as probable as can be by what the first minutes show."""
    model, whole = experiment.machine.model, experiment.pieces[index]
    likely, covariance = _likely_start(experiment, index)
    start, piece, noise = likely, whole.until(until), experiment.noise[index]
    early = replace(setting, samples=setting.samples[: len(piece.steps)])
    temperatures = [i for i, name in enumerate(piece.channels) if not is_total_loss(name)]
    seen = np.isfinite(piece.measured[:, temperatures])
    channel_sd, precision, count = noise.channel_sd[temperatures], np.linalg.inv(covariance), len(likely)
    trajectory: Trajectory | None = None
    for _ in range(START_ROUNDS):
        adjusted = early.piece(piece, trajectory)
        try:
            trajectory = simulate(model, adjusted, early.values, start, guess=trajectory, settled_K=SETTLED_K)
        except ArithmeticError:
            return np.array(experiment.starts[index])
        free = trajectory.response(np.zeros((len(piece.steps), model.n, count)), np.eye(count))
        columns = reading_columns(model, trajectory, early.sensors, free, np.zeros((len(piece.steps), count)))
        residual = ((piece.measured - early.read(trajectory))[:, temperatures] / channel_sd)[seen]
        J = (columns[:, temperatures] / channel_sd[:, None])[seen]
        step = np.linalg.solve(precision + J.T @ J, J.T @ residual + precision @ (likely - start))
        start = start + step
        if float(np.max(np.abs(step))) < START_SETTLED_K:
            break
    return start


def _likely_start(experiment: Experiment, index: int) -> tuple[Array, Array]:
    """Start temperatures by the first rows alone, shape (unknown,), and their covariance, (unknown, unknown).

    A state that is solved with the temperatures, as the rise of oil in a tank above the air, may be as it was
    declared, or have risen as much as the gearbox.
    """
    model, parts = experiment.machine.model, experiment.starts[index]
    declared, inputs = complete_start(model, parts)[model.n :], tuple(model.laws.inputs)
    risen = 0.0
    if "T_ambient" in inputs:
        risen = float(np.mean(parts) - experiment.pieces[index].inputs[0, inputs.index("T_ambient")])
    start = np.concatenate([parts, declared + 0.5 * risen])
    alone = (LEFT_ALONE_SD_K + 0.5 * abs(risen)) ** 2 * np.eye(len(declared))
    return start, block_diag(experiment.noise[index].start, alone)


def rmse(residuals: Array, weights: Array) -> Array:
    """Root mean square per channel, shape (channels,); NaN where nothing was measured.

    Parameters
    ----------
    residuals : Array, shape (rows, channels)
    weights : Array, shape (rows,)
        Time that every row represents
    """
    good = np.isfinite(residuals)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt((weights @ np.where(good, residuals, 0.0) ** 2) / (weights @ good)))


def overall_rmse(predictions: Sequence[Prediction], columns: Sequence[int]) -> float:
    """Root mean square of the residuals of some channels of several predictions; NaN where nothing was measured.

    Parameters
    ----------
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


def with_pieces_of(experiment: Experiment, other: Experiment) -> Experiment:
    """Machine and unknowns of one experiment with the recordings of another one, judged by noise alone."""
    return replace(experiment, pieces=other.pieces, noise=other.noise, starts=other.starts, filters=None,
                   metric=NOISE_ALONE)  # fmt: skip


def log_score_gain(
    final: Fit, plain: Fit, held_out: Experiment, runs: tuple[Sequence[Prediction], Sequence[Prediction]]
) -> float:
    r"""Log predictive density of held-out readings of one fit, less that of another one, [nat].

    What a fit is unsure of widens its prediction: ``r ~ N(0, S + J C J^T)`` with its own noise filter S and the
    posterior covariance C of its unknowns. Each is judged by its nearer course of every recording: with switches that
    follow what was measured, as in learning, or with its own. A set-point that readings nearly reach decides the first
    by chance; the second falls out of step.

    Parameters
    ----------
    runs : (sequence of Prediction, same)
        Of every piece, by `final` and by `plain`

    Returns
    -------
    float
        NaN without held-out recordings, or without a prediction
    """
    if not held_out.pieces:
        return float("nan")
    try:
        return _log_density(final, held_out, runs[0]) - _log_density(plain, held_out, runs[1])
    except (ArithmeticError, np.linalg.LinAlgError):
        return float("nan")


def _log_density(fit: Fit, held_out: Experiment, runs: Sequence[Prediction]) -> float:
    there = with_pieces_of(fit.experiment, held_out)
    learnt = replace(there, machine=fit.parts[0].point.machine)
    parts = [learnt.linearise_piece(i, fit.z, run.trajectory.T, rounds=ROUNDS) for i, run in enumerate(runs)]
    if learnt.machine is not there.machine:  # model error is written into the one that predicts
        parts = [there.linearise_piece(i, fit.z, run.trajectory.T, rounds=ROUNDS, kept=part)
                 for i, (run, part) in enumerate(zip(runs, parts, strict=True))]  # fmt: skip
    residual = np.concatenate([_nearer(part, run) for part, run in zip(parts, runs, strict=True)])
    X = solve_triangular(fit.root, np.concatenate([part.columns for part in parts]).T, lower=True).T
    inner, along = np.eye(X.shape[1]) + X.T @ X, X.T @ residual
    quadratic = float(residual @ residual - along @ np.linalg.solve(inner, along))
    determinants = float(np.linalg.slogdet(inner)[1]) + sum(part.filter.log_determinant for part in parts)
    return -0.5 * (quadratic + determinants)


def _nearer(part: Linear, run: Prediction) -> Array:
    """Innovations of the course that is nearer, shape (readings,)."""
    own = part.filter((part.point.piece.measured - run.read)[:, :, None])[:, 0]
    return min((part.residual, own), key=lambda innovations: float(innovations @ innovations))
