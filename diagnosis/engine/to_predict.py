"""Machines calibrated by noise alone, without model error: what predicts, and what an FMU holds."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from diagnosis.engine.fit import NO_SOLUTION, NOISE_ALONE, Experiment, Fit, Guess, calibrate
from diagnosis.engine.mean_loss import mean_loss, rests_on_the_definition
from diagnosis.engine.set_apart import without_channels
from diagnosis.engine.unknown import Held, NetworkParameter, TermParameter
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat
from models.base.types import Array
from models.quantities.quantities import is_total_loss

QUIET = RandomHeat(heat=0.1, wander=0.1)  # times the random heat that is assumed
# By which temperatures have to come nearer before parameters may stand in for what the model lacks: with less random
# heat; with free losses as well, by what thermometers are usually off.
NEARER_K, LOSSES_K = 0.1, 0.3
FAR_OFF = 2.0  # times the least error of the temperatures, beyond which a fit predicts too badly to be chosen
LEAST_SHARE = 1e-6  # of the mean loss that an unknown changes per prior standard deviation


def calibrated_to_predict(plain: Fit, with_error: Fit, start: Array | None = None) -> Fit:
    """The nominal machine calibrated by noise alone, with instruments as estimated: the best of several calibrations.

    Parameters
    ----------
    plain : Fit
        A first calibration, with random heat as assumed
    with_error : Fit
        The same machine calibrated with model error: another start, the instruments, and the size of its losses
    start : Array, shape (unknowns,), or None
        Where the first calibration began; by default at the middles of the priors

    Raises
    ------
    ArithmeticError
        If there is no solution.
    """
    free = replace(plain.experiment, filters=None)
    first = np.zeros(len(plain.z)) if start is None else start
    return _best_of(free, _calibrations(free, with_error, [plain.z, with_error.z], [first]))


def _calibrations(
    free: Experiment, with_error: Fit, starts: Sequence[Array], quiet_starts: Sequence[Array],
    guesses: Sequence[Guess] | None = None,
) -> Mapping[float, Sequence[Fit]]:  # fmt: skip
    """Calibrations in groups, by what the first ones may be farther off than the best, [K]; those without a solution
    are left out.

    Instruments stay as estimated with model error in all of them. By noise alone their gains, offsets and lags would
    stand in for what the model lacks, and a machine that is right with the recorder's errors alone is wrong in an FMU.

    In the first group losses stay as well, where none is measured but the definition fixes their size. Temperatures
    identify ratios of heats, conductances and capacities: their common size would stand in for what the model lacks.
    """
    quiet, of_instruments, of_losses = free.with_random_heat(QUIET), _instruments(with_error.experiment), list[int]()
    if rests_on_the_definition(with_error.experiment):
        loss, slopes = mean_loss(with_error)
        of_losses = [
            index for index, unknown in enumerate(with_error.experiment.unknowns)
            if isinstance(unknown, NetworkParameter | TermParameter) and abs(slopes[index]) > LEAST_SHARE * loss
        ]  # fmt: skip

    def calibrated(experiment: Experiment, start: Array, held: Sequence[int]) -> Iterator[Fit]:
        z = start.copy()
        z[held] = with_error.z[held]
        with suppress(*NO_SOLUTION):
            yield calibrate(experiment, z, guesses, held)

    as_estimated, both = list[Fit](), sorted({*of_instruments, *of_losses})
    for experiment in (free, quiet) if of_losses else ():
        as_estimated += calibrated(experiment, as_estimated[-1].z if as_estimated else with_error.z, both)
    return {
        LOSSES_K: as_estimated,
        NEARER_K: [fit for start in starts for fit in calibrated(free, start, of_instruments)],
        0.0: [fit for start in quiet_starts for fit in calibrated(quiet, start, of_instruments)],
    }


def _instruments(experiment: Experiment) -> list[int]:
    """Places of the unknowns of sensors and of recorded inputs, which the machine itself has none of."""
    of_machine = {term.label for term in experiment.machine.terms if not term.of_measurement}
    return [
        index for index, unknown in enumerate(experiment.unknowns)
        if not isinstance(unknown, NetworkParameter | Held)
        and not (isinstance(unknown, TermParameter) and unknown.label in of_machine)
    ]  # fmt: skip


def _best_of(free: Experiment, groups: Mapping[float, Sequence[Fit]]) -> Fit:
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
        With model error in its metric, and with random heats that go with it: instruments stay as they are there
    plain : Fit
        The nominal machine so calibrated: a second start of the search, because there may be several basins
    apart : collection of str
        Channels that do not count

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
    starts = [fit.z, nominal]
    found = _best_of(counting, _calibrations(counting, fit, starts, starts, fit.trajectories))
    return every.fit(found.z, found.trajectories, iterations=0) if apart else found
