"""Channels that a calibration should not start from: a broken sensor pulls every parameter to its bounds."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.recordings.cleaning import stuck_rows
from models.base.types import Array
from models.quantities.quantities import is_total_loss

SUSPECT, MANY = 3.0, 10.0  # times what the median channel is missed by: with the channel in the fit, and without it
# At the start: 56 of 57 machines by other authors and of the zoo miss their worst channel there by less than 2.7 times.
SUSPECT_AT_START = 4.0
STILL_ROWS = 10  # grid points in a row, between which a reading stands still
MOST_SHARE = 0.25  # of the temperatures: more that are off are no fault of a sensor
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
