"""Channels that a calibration should not start from: a broken sensor pulls every parameter to its bounds."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from diagnosis.engine.fit import NO_SOLUTION, NOISE_ALONE, Experiment, Fit, Guess, calibrate
from diagnosis.engine.unknown import SensorBias, SensorLag, TermParameter, Unknown
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat
from diagnosis.recordings.cleaning import stuck_rows
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

SUSPECT, MANY = 3.0, 10.0  # times what the median channel is missed by: with the channel in the fit, and without it
# At the start: 56 of 57 machines by other authors and of the zoo miss their worst channel there by less than 2.7 times.
SUSPECT_AT_START = 4.0
STILL_ROWS = 10  # grid points in a row, between which a reading stands still
MOST_SHARE = 0.25  # of the temperatures: more that are off are no fault of a sensor
QUIET = (0.3, 0.1)  # times the random heat that is assumed
FEWEST = 4  # temperatures, for a median that means something


def calibrate_apart(experiment: Experiment, plain: Fit, start: Array | None = None) -> tuple[Fit, tuple[str, ...]]:
    """Calibrate the nominal machine without the channels that are at odds with all others.

    A channel is set apart if the machine, calibrated by the other ones, misses it by :data:`MANY` times what it misses
    the median channel by. Suspects are the channel that the calibration misses most, the one that its start misses
    most, and those that stand still for a while: a fit may have bent itself round a broken sensor until it misses all
    channels alike. Its readings count again in the search: what is wrong there is still to be found.

    Parameters
    ----------
    plain : Fit
        Of all channels
    start : Array, shape (unknowns,), or None
        Where calibrations begin; by default at the middles of the priors

    Returns
    -------
    fit : Fit
        Of the channels that are left
    apart : tuple of str
        Channels that were set apart, mostly none
    """
    fit, apart = plain, tuple[str, ...]()
    names = [name for name in experiment.pieces[0].channels if not is_total_loss(name)]
    if len(names) < FEWEST:
        return fit, apart
    first, still = experiment.fit(start, iterations=0), [name for name in standing_still(experiment) if name in names]
    for _ in range(max(int(MOST_SHARE * len(names)), 1)):
        suspects = dict.fromkeys(
            [name for one, least in ((fit, SUSPECT), (first, SUSPECT_AT_START))
             for name in _worst(_missed_by(experiment, one, apart), least)]
            + [name for name in still if name not in apart]
        )  # fmt: skip
        for name in suspects:
            with suppress(ArithmeticError):  # no solution without it
                tried = calibrate(without_channels(experiment, (*apart, name)), start)
                if _missed_by(experiment, tried, apart)[name] >= MANY:
                    fit, apart = tried, (*apart, name)
                    break
        else:
            break
    return fit, apart


def standing_still(experiment: Experiment) -> dict[str, list[tuple[float, float]]]:
    """Times on the axis in which a channel stands still while a thermometer moves, [s].

    Returns
    -------
    dict of channel to list of (float, float)
        Beginning and end, at most one of every piece; none of healthy recordings
    """
    spans: dict[str, list[tuple[float, float]]] = {}
    for piece in experiment.pieces:
        if piece.recording in experiment.healthy:
            continue
        shown = {name: piece.measured[:, i] for i, name in enumerate(piece.channels)}
        thermometers = {name: values for name, values in shown.items() if not is_total_loss(name)}
        hanging = stuck_rows(piece.time, thermometers, least_rows=STILL_ROWS)
        for name in shown.keys() - thermometers.keys():
            losing = np.where(shown[name] == 0.0, np.nan, shown[name])  # a machine that stands loses nothing
            with_loss = stuck_rows(piece.time, thermometers | {name: losing}, least_rows=STILL_ROWS)
            if name in with_loss:
                hanging[name] = with_loss[name]
        start = experiment.starts_at.get(piece.recording, 0.0)
        for name, (first, end, _, _) in hanging.items():
            # What has not moved again by the last reading stands still until the end.
            goes_on = not np.isfinite(shown[name][end:]).any()
            last = float(piece.time[-1 if goes_on else end - 1])
            # It began within the interval of the mean before the first of the equal ones.
            spans.setdefault(name, []).append((start + float(piece.time[max(first - 1, 0)]), start + last))
    return spans


def _worst(missed_by: Mapping[str, float], least: float) -> list[str]:
    """The channel that is missed most, if by so much."""
    worst = max(missed_by, key=lambda name: missed_by[name])
    return [worst] if missed_by[worst] >= least else []


def without_channels(experiment: Experiment, names: Collection[str]) -> Experiment:
    """The experiment without what some channels show."""
    left = [name not in names for name in experiment.pieces[0].channels]
    pieces = (replace(piece, measured=np.where(left, piece.measured, np.nan)) for piece in experiment.pieces)
    return replace(experiment, pieces=tuple(pieces))


def _missed_by(experiment: Experiment, fit: Fit, apart: Collection[str]) -> dict[str, float]:
    """How much every temperature is missed by, to the median one; without those that are apart."""
    # Of all readings, also those that the fit left out.
    pairs = zip(experiment.pieces, fit.parts, strict=True)
    squares = np.square(np.concatenate([piece.measured - part.point.read for piece, part in pairs]))
    seen = np.isfinite(squares).sum(axis=0)
    rms = np.sqrt(np.nansum(squares, axis=0) / np.maximum(seen, 1))
    found = {name: float(value) for name, value in zip(experiment.pieces[0].channels, rms, strict=True)
             if not is_total_loss(name) and name not in apart}  # fmt: skip
    middle = max(float(np.median(list(found.values()))), 1e-9)
    return {name: value / middle for name, value in found.items()}


def calibrated_to_predict(plain: Fit, with_error: Fit, start: Array | None = None) -> Fit:
    """The nominal machine calibrated by noise alone, as well as starts and sizes of random heat allow.

    Parameters
    ----------
    plain : Fit
        A first calibration, with random heat as assumed
    with_error : Fit
        The same machine calibrated with model error: another start
    start : Array, shape (unknowns,), or None
        Where the first calibration began; by default at the middles of the priors
    """
    return _most_probable(replace(plain.experiment, filters=None), [plain], [start], [with_error.z])


def _most_probable(
    free: Experiment, reached: list[Fit], quiet: Sequence[Array | None], starts: Sequence[Array],
    guesses: Sequence[Guess] | None = None,
) -> Fit:  # fmt: skip
    """The most probable of some fits and of calibrations from further starts, judged by the noise that is assumed.

    Random heat lets a course drift off, so that a fit which misses the temperatures by kelvins may have the lowest
    objective where the model lacks much. With less random heat such fits are not found, and where the model allows it
    their evidence is greater.

    Parameters
    ----------
    quiet : sequence of Array, shape (unknowns,), or None
        Starts with less random heat; None: at the middles of the priors
    starts : sequence of Array, shape (unknowns,)
        Starts with random heat as assumed

    Raises
    ------
    ArithmeticError
        If there is no solution.
    """
    tried: list[tuple[Experiment, Array | None]] = [(free, z) for z in starts]
    tried += [(free.with_random_heat(RandomHeat(heat=times, wander=times)), z) for times in QUIET for z in quiet]
    for experiment, z in tried:
        with suppress(*NO_SOLUTION):
            reached.append(calibrate(experiment, z, guesses))
    if not reached:
        raise ArithmeticError("the simulation has no solution without model error")
    best = max(reached, key=lambda one: one.log_evidence)
    return best if best.experiment.random_heat == AS_ASSUMED else free.fit(best.z, best.trajectories, iterations=0)


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
    found = _most_probable(counting, [], [fit.z], [fit.z, nominal], fit.trajectories)
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
