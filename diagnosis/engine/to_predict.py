"""Machines calibrated by noise alone, without model error: what predicts, and what an FMU holds."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product

import numpy as np

from diagnosis.engine.fit import NO_SOLUTION, NOISE_ALONE, Experiment, Fit, Guess, calibrate
from diagnosis.engine.mean_loss import mean_loss, rests_on_the_definition
from diagnosis.engine.set_apart import without_channels
from diagnosis.engine.unknown import NetworkParameter, SensorBias, SensorLag, TermParameter, Unknown
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

QUIET = RandomHeat(heat=0.1, wander=0.1)  # times the random heat that is assumed
# By which temperatures have to come nearer before parameters may stand in for what the model lacks: with less random
# heat; with free losses as well, by what thermometers are usually off.
NEARER_K, LOSSES_K = 0.1, 0.3
FAR_OFF = 2.0  # times the least error of the temperatures, beyond which a fit predicts too badly to be chosen
LEAST_SHARE = 1e-6  # of the mean loss that an unknown changes per prior standard deviation


def calibrated_to_predict(plain: Fit, with_error: Fit, start: Array | None = None) -> Fit:
    """The nominal machine calibrated by noise alone: the best of several calibrations.

    Parameters
    ----------
    plain : Fit
        A first calibration, with random heat as assumed
    with_error : Fit
        The same machine calibrated with model error: another start, and the size of its losses
    start : Array, shape (unknowns,), or None
        Where the first calibration began; by default at the middles of the priors

    Raises
    ------
    ArithmeticError
        If there is no solution.
    """
    free = replace(plain.experiment, filters=None)
    quiet = free.with_random_heat(QUIET)
    return _best_of(free, {
        LOSSES_K: _as_estimated(with_error, [free, quiet]),
        NEARER_K: [plain, *_calibrations([(free, with_error.z)])],
        0.0: _calibrations([(quiet, start)]),
    })  # fmt: skip


def _as_estimated(
    with_error: Fit, experiments: Sequence[Experiment], guesses: Sequence[Guess] | None = None
) -> Iterator[Fit]:
    """Calibrations, each from the one before, with all losses as estimated with model error.

    None if a loss is measured, or nothing in the definition fixes its size. Temperatures identify ratios of heats,
    conductances and capacities: by noise alone their common size would stand in for what the model lacks.
    """
    if not rests_on_the_definition(with_error.experiment):
        return
    loss, slopes = mean_loss(with_error)
    held = [
        index for index, unknown in enumerate(with_error.experiment.unknowns)
        if isinstance(unknown, NetworkParameter | TermParameter) and abs(slopes[index]) > LEAST_SHARE * loss
    ]  # fmt: skip
    z = with_error.z
    for experiment in experiments:
        with suppress(*NO_SOLUTION):
            reached = calibrate(experiment, z, guesses, held)
            z = reached.z
            yield reached


def _calibrations(
    tried: Iterable[tuple[Experiment, Array | None]], guesses: Sequence[Guess] | None = None
) -> Iterator[Fit]:
    """Experiments calibrated from starts; those without a solution are left out."""
    for experiment, start in tried:
        with suppress(*NO_SOLUTION):
            yield calibrate(experiment, start, guesses)


def _best_of(free: Experiment, groups: Mapping[float, Iterable[Fit]]) -> Fit:
    """The most probable of some calibrations that predict well, judged by the noise that is assumed.

    The first group counts that comes as near to the temperatures as the best one, but for its allowance [K]. Random
    heat lets a course drift off, so that where the model lacks much, a fit which misses the temperatures by kelvins may
    be the most probable one. With less random heat the courses stay near, but parameters stand in for what the model
    lacks.
    """
    settled: dict[float, list[tuple[float, Fit]]] = {allowed_K: [] for allowed_K in groups}
    for allowed_K, group in groups.items():
        for one in group:  # a course that has not settled may look better than it is
            with suppress(*NO_SOLUTION):
                again = replace(one.experiment, filters=None).fit(one.z, iterations=0)
                settled[allowed_K].append((_off_by(again), again))
    nearest = min((off_K for group in settled.values() for off_K, _ in group), default=np.inf)
    first = next((group for allowed_K, group in settled.items()
                  if any(off_K <= nearest + allowed_K for off_K, _ in group)), None)  # fmt: skip
    if first is None:
        raise ArithmeticError("the simulation has no solution without model error")
    farthest = FAR_OFF * min(off_K for off_K, _ in first)
    best = max((one for off_K, one in first if off_K <= farthest), key=lambda one: one.log_evidence)
    return best if best.experiment.random_heat == AS_ASSUMED else free.fit(best.z, best.trajectories, iterations=0)


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
    quiet = counting.with_random_heat(QUIET)
    starts, near = (fit.z, nominal), fit.trajectories
    found = _best_of(counting, {
        LOSSES_K: _as_estimated(fit, [counting, quiet], near),
        NEARER_K: _calibrations(product([counting], starts), near),
        0.0: _calibrations(product([quiet], starts), near),
    })  # fmt: skip
    if not apart:
        return found
    terms = {term.label: term for term in every.machine.terms}
    own = [_describes(unknown, terms, apart) for unknown in every.unknowns]
    return every.fit(np.where(own, fit.z, found.z), found.trajectories, iterations=0)


def _describes(unknown: Unknown, terms: Mapping[str, Term], channels: Collection[str]) -> bool:
    """True if an unknown is about the sensors of some channels, and nothing else."""
    if isinstance(unknown, SensorBias | SensorLag):
        return unknown.channel in channels
    if not isinstance(unknown, TermParameter):
        return False
    term = terms[unknown.label]
    return term.kind == "sensor" and set(term.target) <= set(channels)
