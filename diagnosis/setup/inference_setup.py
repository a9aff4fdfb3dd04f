"""Everything that is known before anything is explained: the gearbox, its recordings on the grid, noise and priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.candidates.explain import Explanation, calibrated, evidence_of, settled
from diagnosis.forward.grid import Piece, pieces, slow_rows
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.inference.noise import channel_noise, loss_noise, noise_of, start_guess
from diagnosis.inference.posterior import Problem
from diagnosis.inference.predict import START_S
from diagnosis.inference.shapes import shape_terms
from diagnosis.inference.unknowns import Unknowns, unknowns_of
from diagnosis.inference.whitening import Whitening
from diagnosis.recordings.recording import Recording
from diagnosis.setup.shaft import shafts, torque_gain, with_shaft
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import Scale
from models.quantities.quantities import GEARBOX_INPUTS, TOTAL_LOSS, is_total_loss
from models.simulation.thermal_network import Losses, ThermalNetwork
from models.terms.term import Term

STANDSTILL_RPM = 10.0
HELD_OUT_SHARE = 0.25  # of every recording, where none is held out as a whole
CAPACITY_SD = 0.3  # at least: one temperature stands for a body that has many
FLOORS = (1.0, 2.0, 4.0)  # times the structural floor that is assumed at least
FLOOR_GAIN = 10.0  # log evidence that a higher floor has to bring


@dataclass(frozen=True, kw_only=True, eq=False)
class InferenceSetup:
    """A gearbox and its recordings.

    Attributes
    ----------
    gearbox : Gearbox
    nominal : ThermalNetwork
        As the definition has it
    losses : Losses
    scale : Scale
        Typical sizes in these recordings
    channels : tuple of str
    train, holdout : Problem
        The same network, unknowns and noise with the pieces to learn from and to judge by
    loss_W : float
        Typical total loss, [W]
    noise_K : float
        White noise of a temperature row, [K]
    shapes : tuple of Term
        Tilts of the formulas, which the nominal network lacks
    """

    gearbox: Gearbox
    nominal: ThermalNetwork
    losses: Losses
    scale: Scale
    channels: tuple[str, ...]
    train: Problem
    holdout: Problem
    loss_W: float
    noise_K: float
    shapes: tuple[Term, ...] = ()


def prepare(
    gearbox: Gearbox,
    recordings: Sequence[Recording],
    holdout: Sequence[Recording],
    baseline: Sequence[Recording] = (),
    *,
    even: bool = False,
) -> InferenceSetup:
    """Set up the inference.

    Parameters
    ----------
    gearbox : Gearbox
    recordings, holdout : sequence of Recording
        To learn from, and to judge by
    baseline : sequence of Recording
        To learn from as well, as a whole; they do not decide on the scale
    even : bool
        Whether all intervals shall be of one length, see :func:`diagnosis.forward.grid.pieces`
    """
    as_defined, losses = gearbox.network(), gearbox.loss_laws()
    nominal = with_shaft(as_defined)
    recordings, holdout = shafts(recordings, as_defined), shafts(holdout, as_defined)
    scale = scale_of(gearbox, recordings)
    beside = shafts(baseline, as_defined)
    everything = (*recordings, *beside)
    network = nominal
    shapes = shape_terms(nominal, scale)
    for term in shapes:
        network = term.apply(network)
    model = NetworkOnGrid(network, losses)
    measured = {c.name for r in everything for c in r.channels}
    temperatures = sorted((c for c in measured if not is_total_loss(c)), key=lambda c: (model.part_index(c), c))
    channels = (*temperatures, *([TOTAL_LOSS] if TOTAL_LOSS in measured else []))
    stated = [c for r in everything for c in r.channels]
    unknowns = _wider_capacities(unknowns_of(
        network, channels, lags={c.name: c.lag_s for c in stated if c.lag_s is not None},
        bias_sd={c.name: c.bias_sd for c in stated if c.bias_sd is not None}, slow=slow_rows(everything),
        interval=scale.interval, ambient_assumed=any("T_ambient" in r.assumed for r in everything),
        torque_gain=torque_gain(as_defined),
    ))  # fmt: skip
    white = channel_noise(everything, channels)
    loss_sd = loss_noise(everything) if TOTAL_LOSS in channels else (0.0, 0.0)
    loss_W = typical_loss(model, recordings)
    problems = []
    learnt, judged = (pieces(given, model.laws.inputs, channels, even=even) for given in (recordings, holdout))
    if not holdout:
        learnt, judged = split(learnt)
    learnt = (*learnt, *pieces(beside, model.laws.inputs, channels, even=even))
    for cut in (learnt, judged):
        problems.append(Problem(
            model, cut, unknowns,
            [noise_of(model, p, white, loss_W, loss_noise=loss_sd, parametric=gearbox.is_parametric) for p in cut],
            [start_guess(model, p) for p in cut],
        ))  # fmt: skip
    noises = [white[name] for name in channels if not is_total_loss(name)]
    return InferenceSetup(
        gearbox=gearbox, nominal=nominal, losses=losses, scale=scale, channels=channels, train=problems[0],
        holdout=problems[1], loss_W=loss_W, noise_K=float(np.median(noises)) if noises else 0.0,
        shapes=shapes,
    )  # fmt: skip


def split(whole: Sequence[Piece]) -> tuple[tuple[Piece, ...], tuple[Piece, ...]]:
    """Split pieces in time: readings of the first part to learn from, those of the last part held out.

    The readings of the first minutes stay in both, for the start temperatures.
    """
    learnt, judged = [], []
    for piece in whole:
        span = piece.time[-1] - piece.time[0]
        late = piece.time > piece.time[0] + (1.0 - HELD_OUT_SHARE) * span
        early = piece.time <= piece.time[0] + min(START_S, 0.2 * span)
        learnt.append(replace(piece, measured=np.where(late[:, None], np.nan, piece.measured)))
        judged.append(replace(piece, measured=np.where((late | early)[:, None], piece.measured, np.nan)))
    return tuple(learnt), tuple(judged)


def scale_of(gearbox: Gearbox, recordings: Sequence[Recording]) -> Scale:
    """Typical sizes of the operation in recordings."""
    speed = np.concatenate([np.abs(r.inputs["speed"]) for r in recordings])
    torque = np.concatenate([np.abs(r.inputs["torque"]) for r in recordings])
    ambient = [np.median(r.inputs["T_ambient"]) for r in recordings if "T_ambient" in r.inputs]
    running = speed > STANDSTILL_RPM
    duration = max(float(r.time[-1]) for r in recordings)
    interval = float(np.median(np.concatenate([np.diff(r.time) for r in recordings])))
    named = [name for name in recordings[0].inputs if name not in GEARBOX_INPUTS]
    typical = {name: float(np.mean(np.concatenate([r.inputs[name] for r in recordings]))) for name in named}
    if not running.any():
        return Scale.of(gearbox, inputs=typical, duration=duration, interval=interval)
    # Without geometry the nominal steady state is a guess; how hot it gets was measured.
    oil = np.concatenate([c.values for r in recordings for c in r.channels if c.name == "oil"] or [np.zeros(0)])
    hot = float(np.nanpercentile(oil, 95)) if gearbox.is_parametric and np.isfinite(oil).any() else None
    return Scale.of(
        gearbox, temperature=hot, speed=float(np.percentile(speed[running], 90)),
        torque=max(float(np.percentile(torque[running], 75)), 1.0),
        ambient=float(np.median(ambient)) if ambient else None, inputs=typical, duration=duration, interval=interval,
    )  # fmt: skip


def typical_loss(model: NetworkOnGrid, recordings: Sequence[Recording]) -> float:
    """Median total loss while running, by the loss model at what the oil, or else anything, was measured at, [W]."""
    values = []
    for recording in recordings:
        rows = slice(None, None, max(1, len(recording.time) // 500))
        speed, torque = recording.inputs["speed"][rows], recording.inputs["torque"][rows]
        known = {c.name: c.values[rows] for c in recording.channels if not is_total_loss(c.name)}
        T = np.nan_to_num(known.get("oil", next(iter(known.values()), np.full(len(speed), 60.0))), nan=60.0)
        power = model.losses.power(speed, torque, np.repeat(T[:, None], len(model.loss_nodes), axis=1)).sum(axis=-1)
        values.append(power[np.abs(speed) > STANDSTILL_RPM])
    found = np.concatenate(values) if values else np.zeros(0)
    return float(np.median(found)) if len(found) else 1.0


def _wider_capacities(unknowns: Unknowns) -> Unknowns:
    items = [
        replace(i, parameter=replace(i.parameter, sd=max(i.parameter.sd, CAPACITY_SD)))
        if i.role == "network" and i.target.startswith("C_") else i
        for i in unknowns.items
    ]  # fmt: skip
    return Unknowns(items)


# ---------------------------------------------------------------------- the structural floor


def floored(explanation: Explanation) -> Explanation:
    """The explanation judged by the structural floor that its own remainder asks for.

    A formula that is a little wrong leaves a remainder like any other effect. How large such remainders are on this
    gearbox is not known beforehand; so the floor is raised where the data ask for it, by the evidence under the present
    explanation, and falls again when a better one has been found (not where rows are means over minutes).

    Returns
    -------
    Explanation
        Fitted again if the noise floor changed and the fit has a solution
    """
    evidences = [_evidence(explanation, times) for times in FLOORS]
    best = int(np.argmax(evidences))
    times = FLOORS[best] if evidences[best] - evidences[0] >= FLOOR_GAIN else FLOORS[0]
    if explanation.problem.slow:
        # Means over minutes do not show when a switch acted. What that leaves is no small random heat, and stays,
        # whatever explains the rest: with a floor that falls, looks took it for effects (seen on wind turbines).
        times = max(times, explanation.problem.floor)
    if times == explanation.problem.floor:
        return explanation
    problem = explanation.problem.changed(floor=times, whitenings=None)
    try:
        fit = problem.fit(explanation.fit.z, [part.trajectory for part in explanation.fit.parts], iterations=2)
        again = settled(problem, fit)
    except ArithmeticError:  # at the edge of what can be simulated
        return explanation
    found = explanation.found
    return replace(again, found=found, log_evidence=evidence_of(found, again.fit))


def _evidence(explanation: Explanation, times: float) -> float:
    """Log evidence with another floor, the linearisation kept, determinants of the filters included."""
    problem, fit = explanation.problem, explanation.fit
    residuals, columns, determinant = [], [], 0.0
    for part, noise in zip(fit.parts, problem.noise, strict=True):
        whitening = Whitening(problem.model, part.trajectory, part.sensors, noise.with_floor(times))
        white = whitening(np.concatenate([part.residual[:, :, None], part.columns], axis=2))
        residuals.append(white[:, 0])
        columns.append(white[:, 1:])
        determinant += whitening.log_determinant
    J = np.concatenate(columns)
    residual = np.concatenate(residuals) + J @ fit.z
    normal, right = np.eye(J.shape[1]) + J.T @ J, J.T @ residual
    quadratic = float(residual @ residual - right @ np.linalg.solve(normal, right))
    return -0.5 * (quadratic + float(np.linalg.slogdet(normal)[1]) + determinant)


def first(case: InferenceSetup) -> Explanation:
    """The calibrated model, judged by the floor that it asks for."""
    return floored(calibrated(case.train))


def heat_over_time(parts: Sequence[Piece], heats: Sequence[Array]) -> dict[str, tuple[Array, Array]]:
    """Heats of pieces [W] by recording: time at the middles of the intervals [s], and heat."""
    result: dict[str, tuple[Array, Array]] = {}
    for piece, heat in zip(parts, heats, strict=True):
        time, before = piece.middle, result.get(piece.recording)
        result[piece.recording] = (time, heat) if before is None else (
            np.concatenate([before[0], time]), np.concatenate([before[1], heat]))  # fmt: skip
    return result
