"""Machines calibrated by noise alone, without model error: what predicts, and what an FMU holds."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from diagnosis.engine.fit import NO_SOLUTION, NOISE_ALONE, Experiment, Fit, Guess, calibrate
from diagnosis.engine.mean_loss import is_estimated, mean_loss, mean_loss_slopes
from diagnosis.engine.scale import all_sizes_are_unknown, is_of_temperatures
from diagnosis.engine.set_apart import without_channels
from diagnosis.engine.unknown import Held, NetworkParameter, SensorBias, SensorLag, TermParameter, Unknown
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

QUIET = RandomHeat(heat=0.1, wander=0.1)  # times the random heat that is assumed
# By which temperatures have to come nearer before parameters may stand in for what the model lacks: with less random
# heat; with free losses as well, by what thermometers are usually off.
NEARER_K, LOSSES_K = 0.1, 0.3
FAR_OFF = 2.0  # times the least error of the temperatures, beyond which a fit predicts too badly to be chosen
MOST_LOSS = 1.5  # times the mean loss that was estimated, or as much less, beyond which a model is worse for it
LEAST_SHARE = 1e-6  # of the mean loss that an unknown changes per prior standard deviation


@dataclass(frozen=True, kw_only=True)
class Calibrations:
    """Calibrations of one machine with the same unknowns free, from several starts; those without a solution left out.

    Attributes
    ----------
    usual, quiet : tuple of Fit
        With random heat as assumed, and with less
    """

    usual: tuple[Fit, ...]
    quiet: tuple[Fit, ...]


def calibrated_to_predict(plain: Fit, with_error: Fit, start: Array | None = None) -> Fit:
    """The nominal machine calibrated by noise alone: the best of several calibrations.

    Parameters
    ----------
    plain : Fit
        A first calibration, with random heat as assumed
    with_error : Fit
        The same machine calibrated with model error: another start, the instruments, and the size of its losses
    start : Array, shape (unknowns,), or None
        Where the first calibration began; by default at the middles of the priors

    Returns
    -------
    Fit
        The first calibration if none of the others has a solution
    """
    free, estimated = replace(plain.experiment, filters=None), _estimated(with_error)
    first = np.zeros(len(plain.z)) if start is None else start
    tried = _calibrations(free, with_error.z, estimated, [with_error.z], [first])
    if not estimated[-1]:
        tried = [replace(one, usual=(plain, *one.usual)) for one in tried]
    with suppress(ArithmeticError):
        return _best_of(free, tried, with_error)
    return plain


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
    if all_sizes_are_unknown(known.machine.model.network, known.unknowns):
        return [[]]
    instruments = instruments_of(known)
    return [*([[*instruments, *_losses(with_error)]] if is_of_temperatures(known) else []), instruments]


def _calibrations(
    free: Experiment, estimate: Array, held_in_turn: Sequence[Sequence[int]], starts: Sequence[Array],
    quiet_starts: Sequence[Array], guesses: Sequence[Guess] | None = None,
) -> list[Calibrations]:  # fmt: skip
    """Calibrations by noise alone from several starts, with some unknowns at an estimate."""
    quiet = free.with_random_heat(QUIET)

    def calibrated(experiment: Experiment, start: Array, held: Sequence[int]) -> Iterator[Fit]:
        z = start.copy()
        z[held] = estimate[held]
        with suppress(*NO_SOLUTION):
            yield calibrate(experiment, z, guesses, held)

    return [
        Calibrations(
            usual=tuple(fit for start in starts for fit in calibrated(free, start, held)),
            quiet=tuple(fit for start in quiet_starts for fit in calibrated(quiet, start, held)),
        )
        for held in held_in_turn
    ]


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


def _best_of(free: Experiment, tried: Iterable[Calibrations], estimated: Fit) -> Fit:
    """The most probable of some calibrations that predict well, judged by the noise that is assumed.

    Those count that come as near to the temperatures as the best ones of all, but for :data:`LOSSES_K`, the first such
    ones; and of these those with less random heat only where they are nearer by :data:`NEARER_K`. Random heat lets a
    course drift off, so that where the model lacks much, a fit which misses the temperatures by kelvins may be the most
    probable one. With less random heat the courses stay near, but parameters stand in for what the model lacks. Where
    the mean loss is estimated, a fit that is farther from it than :data:`MOST_LOSS` has its error multiplied by the
    excess.
    """
    loss = mean_loss(estimated) if is_estimated(estimated.experiment) else None
    settled = [(_settled(one.usual, loss), _settled(one.quiet, loss)) for one in tried]
    nearest = min((off_K for pair in settled for off_K, _ in chain(*pair)), default=np.inf)
    for usual, quiet in settled:
        near = min((off_K for off_K, _ in (*usual, *quiet)), default=np.inf)
        if near <= nearest + LOSSES_K and np.isfinite(near):
            chosen = usual if any(off_K <= near + NEARER_K for off_K, _ in usual) else quiet
            farthest = FAR_OFF * min(off_K for off_K, _ in chosen)
            best = max((one for off_K, one in chosen if off_K <= farthest), key=lambda one: one.log_evidence)
            if best.experiment.random_heat == AS_ASSUMED:
                return best
            return free.fit(best.z, best.trajectories, iterations=0)
    raise ArithmeticError("the simulation has no solution without model error")


def _settled(fits: Iterable[Fit], loss: float | None) -> list[tuple[float, Fit]]:
    """Fits linearised once more, with their errors [K]: a course that has not settled may look better than it is.

    With an estimated mean loss [W], an error is multiplied by the excess of the fit's own over :data:`MOST_LOSS`.
    """
    found = []
    for one in fits:
        with suppress(*NO_SOLUTION):
            again = replace(one.experiment, filters=None).fit(one.z, iterations=0)
            off_K = _off_by(again)
            if loss:
                own = mean_loss(again)
                off_K *= max(own / loss, loss / own, MOST_LOSS) / MOST_LOSS
            found.append((off_K, again))
    return found


def _off_by(fit: Fit) -> float:
    """Root mean square by which the course misses the temperatures that count, [K]."""
    thermometers = [not is_total_loss(name) for name in fit.experiment.pieces[0].channels]
    return float(np.sqrt(np.nanmean(np.square(np.concatenate([p.point.residual[:, thermometers] for p in fit.parts])))))


def refit_to_predict(fit: Fit, plain: Fit, apart: Collection[str] = ()) -> Fit:
    """An explanation calibrated as the nominal machine is, by noise alone: what predicts, and what an FMU holds.

    Parameters
    ----------
    fit : Fit
        With model error in its metric, and with random heats that go with it
    plain : Fit
        The nominal machine so calibrated: a second start of the search, because there may be several basins
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
    found = _best_of(counting, _calibrations(
        counting, nominal if apart else fit.z,  # a broken sensor has bent what was estimated of the others
        [[*own, *held] for held in _estimated(fit)], [fit.z, nominal], [fit.z, nominal], fit.trajectories,
    ), fit)  # fmt: skip
    return every.fit(found.z, found.trajectories, iterations=0) if apart else found


def _describes(unknown: Unknown, terms: Mapping[str, Term], channels: Collection[str]) -> bool:
    """True if an unknown is about the sensors of some channels, and nothing else."""
    if isinstance(unknown, SensorBias | SensorLag):
        return unknown.channel in channels
    if not isinstance(unknown, TermParameter):
        return False
    term = terms[unknown.label]
    return term.kind == "sensor" and set(term.target) <= set(channels)
