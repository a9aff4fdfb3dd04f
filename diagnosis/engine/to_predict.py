"""Machines calibrated to predict, without model error and without random heat: what predicts, and what an FMU holds.

Random heat lets a course drift off, so that where the model lacks much, parameters go far to follow what comes and goes
within minutes while the level is missed by kelvins. Here courses are judged by how far they are from the readings: an
hour counts as one reading of a thermometer, off by an error that is estimated with the parameters.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.engine.fit import NO_SOLUTION, NOISE_ALONE, Experiment, Fit, Guess
from diagnosis.engine.mean_loss import mean_loss, mean_loss_slopes
from diagnosis.engine.predict import overall_rmse, predict
from diagnosis.engine.scale import all_sizes_are_unknown, is_of_temperatures
from diagnosis.engine.set_apart import without_channels
from diagnosis.engine.unknown import Held, NetworkParameter, SensorBias, SensorLag, TermParameter, Unknown
from diagnosis.forward.whitening import AS_ASSUMED, Noise, RandomHeat
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

NO_RANDOM_HEAT = RandomHeat(heat=0.0, wander=0.0)
READING_S = 3600.0  # over which errors of a course belong together; 0.7 to 1.3 h on two machines
LOSS_SHARE = 0.05  # of a measured loss, by which it may be off in an hour
FIRST_K, MOST_TURNS, SETTLED = 0.1, 8, 0.97  # error of the first turn; of the one before, from which it has settled
NEARER_K = 0.3  # by which temperatures come nearer before losses leave their estimates: what thermometers are off by
NEARER_SHARE = 0.2  # of the error that goes away before numbers of a finding leave theirs
LEAST_SHARE = 1e-6  # of the mean loss that an unknown changes per prior standard deviation


@dataclass(frozen=True, kw_only=True, eq=False)
class Levelled:
    """A machine calibrated by the level of its temperatures.

    Attributes
    ----------
    off_K : float
        Root mean square by which its free-running predictions miss the thermometers, [K]
    held : list of int
        Places of the unknowns that stayed
    """

    fit: Fit
    off_K: float
    held: list[int]

    def judged_in(self, experiment: Experiment) -> Fit:
        """Its values, judged by the noise of another experiment on these recordings."""
        return experiment.fit(self.fit.z, self.fit.trajectories, iterations=0)


def calibrated_to_predict(plain: Fit, with_error: Fit) -> Fit:
    """The nominal machine calibrated to predict.

    Parameters
    ----------
    plain : Fit
        A first calibration
    with_error : Fit
        The same machine calibrated with model error: another start, and the estimates of instruments and losses

    Returns
    -------
    Fit
        The first calibration if there is no other solution
    """
    free = replace(plain.experiment, filters=None)
    starts = [(with_error.z, with_error.trajectories), (plain.z, plain.trajectories)]
    with suppress(ArithmeticError):
        return _nearest(free, with_error.z, _estimated(with_error), starts).judged_in(free)
    return plain


def refit_to_predict(fit: Fit, plain: Fit, apart: Collection[str] = ()) -> Fit:
    """An explanation calibrated to predict, with the numbers of its finding as estimated unless others are far nearer.

    Parameters
    ----------
    fit : Fit
        With model error in its metric, and with random heats that go with it
    plain : Fit
        The nominal machine calibrated to predict: a second start of the search, because there may be several basins
    apart : collection of str
        Channels that do not count; what describes their sensors stays as it is

    Raises
    ------
    ArithmeticError
        If there is no solution.
    """
    every = replace(
        fit.experiment, noise=plain.experiment.noise, random_heat=AS_ASSUMED, filters=None, metric=NOISE_ALONE
    )
    counting = without_channels(every, apart) if apart else every
    nominal = fit.z.copy()
    nominal[: len(plain.z)] = plain.z_in(every)
    terms = {term.label: term for term in every.machine.terms}
    own = [index for index, unknown in enumerate(every.unknowns) if _describes(unknown, terms, apart)]
    nominal[own] = fit.z[own]
    estimate = nominal if apart else fit.z  # a broken sensor has bent what was estimated of the others
    held = [[*own, *held] for held in _estimated(fit)]
    starts = [(fit.z, fit.trajectories), (nominal, fit.trajectories)]
    found = _nearest(counting, estimate, held, starts)
    with suppress(ArithmeticError):
        numbers = range(len(plain.z), len(fit.z))
        kept = _nearest(counting, estimate, [[*found.held, *numbers]], starts[:1])
        if found.off_K > (1.0 - NEARER_SHARE) * kept.off_K:
            found = kept
    return found.judged_in(every)


def _estimated(with_error: Fit) -> list[list[int]]:
    """Places of the unknowns that stay as they were estimated with model error, and of those that do so if they can.

    All could stand in for what the model lacks. Where the definition fixes sizes, instruments stay: else a machine may
    be right with the recorder's errors alone, and wrong in an FMU. Where no loss is measured there, all losses stay if
    they can: temperatures identify ratios of heats, conductances and capacities, not their common size.

    Returns
    -------
    list of list of int
        Most are held first; the last one is empty where every size is unknown: nothing separates instruments and
        machine there
    """
    known = with_error.experiment
    if all_sizes_are_unknown(known.network, known.unknowns):
        return [[]]
    instruments = instruments_of(known)
    return [*([[*instruments, *_losses(with_error)]] if is_of_temperatures(known) else []), instruments]


def _losses(fit: Fit) -> list[int]:
    """Places of the unknowns of the machine that its losses depend on, with temperatures as they are."""
    loss, slopes = mean_loss(fit), mean_loss_slopes(fit)
    return [
        index for index, unknown in enumerate(fit.experiment.unknowns)
        if isinstance(unknown, NetworkParameter | TermParameter) and abs(slopes[index]) > LEAST_SHARE * loss
    ]  # fmt: skip


def instruments_of(experiment: Experiment, findings: Collection[str] = ()) -> list[int]:
    """Places of the unknowns of sensors and of recorded inputs, which the machine itself has none of.

    Parameters
    ----------
    findings : collection of str
        Labels of terms that do not count: faults that were found
    """
    others = {term.label for term in experiment.machine.terms if not term.of_measurement} | set(findings)
    return [
        index for index, unknown in enumerate(experiment.unknowns)
        if not isinstance(unknown, NetworkParameter | Held)
        and not (isinstance(unknown, TermParameter) and unknown.label in others)
    ]  # fmt: skip


def _nearest(
    free: Experiment, estimate: Array, held_in_turn: Sequence[list[int]],
    starts: Sequence[tuple[Array, Sequence[Guess]]],
) -> Levelled:  # fmt: skip
    """The calibration with most unknowns at an estimate that comes as near as the nearest, but for :data:`NEARER_K`.

    Raises
    ------
    ArithmeticError
        If there is no solution.
    """
    found = []
    for held in held_in_turn:
        reached = [one for start, guesses in starts for one in _levelled(free, start, guesses, estimate, held)]
        found += [min(reached, key=lambda one: one.off_K)] if reached else []
    nearest = min((one.off_K for one in found), default=np.inf)
    for one in found:
        if one.off_K <= nearest + NEARER_K:
            return one
    raise ArithmeticError("the simulation has no solution without model error")


def _levelled(
    free: Experiment, start: Array, guesses: Sequence[Guess], estimate: Array, held: list[int]
) -> Iterator[Levelled]:
    """A calibration and its error, which settle in turn; nothing where there is no solution."""
    z, off_K = start.copy(), FIRST_K
    z[held] = estimate[held]
    with suppress(*NO_SOLUTION):
        for _ in range(MOST_TURNS):
            before, fit = off_K, _by_level(free, off_K).fit(z, guesses, held=held)
            off_K = before * _missed(fit)
            if SETTLED * before < off_K < before / SETTLED:
                break
            z, guesses = fit.z, fit.trajectories
        yield Levelled(fit=fit, off_K=_missed_when_running_free(free, fit), held=held)


def _by_level(free: Experiment, off_K: float) -> Experiment:
    """Experiment without random heat in which an hour counts as one reading of every channel, off by `off_K`."""
    noises = tuple(_off(free, index, off_K).with_random_heat(NO_RANDOM_HEAT) for index in range(len(free.pieces)))
    return replace(free, noise=noises, random_heat=NO_RANDOM_HEAT, filters=None)


def loss_by_level(experiment: Experiment) -> Experiment:
    """Experiment that judges a measured loss no finer than what predicts has been calibrated to it."""
    return replace(experiment, noise=tuple(_off(experiment, index, 0.0) for index in range(len(experiment.pieces))))


def _off(experiment: Experiment, index: int, off_K: float) -> Noise:
    """Noise of a piece in which an hour of a channel counts as one reading, which is off by so much at least."""
    piece, known = experiment.pieces[index], experiment.noise[index]
    seen = np.isfinite(piece.measured)
    rows = np.where(seen, piece.counts, 0.0).sum(axis=0)
    level = np.abs(np.nansum(piece.measured, axis=0)) / np.maximum(seen.sum(axis=0), 1)
    off = np.where([is_total_loss(name) for name in piece.channels], LOSS_SHARE * level, off_K)
    as_one = np.sqrt(np.maximum(rows, 1.0) / _readings(experiment, index))
    return replace(known, channel_sd=np.maximum(known.channel_sd, off * as_one))


def _readings(experiment: Experiment, index: int) -> float:
    return max(experiment.pieces[index].duration / READING_S, 1.0)


def _missed_when_running_free(free: Experiment, fit: Fit) -> float:
    """Root mean square error of the thermometers, with switches by their own course, [K]."""
    thermometers = [i for i, name in enumerate(free.pieces[0].channels) if not is_total_loss(name)]
    runs = [predict(free, index, fit.z, guess=course.T) for index, course in enumerate(fit.trajectories)]
    return overall_rmse(runs, thermometers)


def _missed(fit: Fit) -> float:
    """Root mean square of the errors of the thermometers, to those that are assumed, start temperatures fitted."""
    squares = readings = 0.0
    for index, part in enumerate(fit.parts):
        piece = fit.experiment.pieces[index]
        thermometers = [not is_total_loss(name) for name in piece.channels]
        seen = np.logical_and(np.isfinite(piece.measured).any(axis=0), thermometers)
        squares += float(np.square(part.residual.reshape(piece.measured.shape)[:, seen]).sum())
        readings += _readings(fit.experiment, index) * float(seen.sum())
    return float(np.sqrt(squares / readings))


def _describes(unknown: Unknown, terms: Mapping[str, Term], channels: Collection[str]) -> bool:
    """True if an unknown is about the sensors of some channels, and nothing else."""
    if isinstance(unknown, SensorBias | SensorLag):
        return unknown.channel in channels
    if not isinstance(unknown, TermParameter):
        return False
    term = terms[unknown.label]
    return term.kind == "sensor" and set(term.target) <= set(channels)
