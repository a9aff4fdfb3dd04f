"""Calibration with model error in place: the point that everything is linearised at."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.engine.fit import FIRST_ITERATIONS, ITERATIONS, Experiment, Fit, Linear
from diagnosis.engine.learnt import ErrorClass, error_classes
from diagnosis.engine.metric import leading_directions
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.products import gram_of, whitened_base
from diagnosis.engine.sessions import fit_over_sessions, sessions_of, with_deviation
from diagnosis.engine.set_apart import without_channels
from models.base.types import Array

WIDEST_CLASS = "full"  # the point is calibrated with it: no parameter has to stand in for what the model cannot know


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """The machine without the effect that is looked for.

    Attributes
    ----------
    fit : Fit
        Model error of the chosen class in its metric, with the most probable deviation between sessions; all readings
        at the point that those without a channel set apart lead to
    chosen : ErrorClass
    evidence : mapping of str to float
        Log evidence of every class, prior included, less that of the best
    log_evidence : float
        Over all deviations between sessions, of the most probable unknowns of all readings
    session_s : float
        Their mean, in prior standard deviations
    of_others : Calibration or None
        By the readings without the channels set apart alone, if there are any
    """

    fit: Fit
    chosen: ErrorClass
    evidence: Mapping[str, float]
    log_evidence: float
    session_s: float
    of_others: Calibration | None = None


def calibrate_with_error(experiment: Experiment, apart: Collection[str] = ()) -> Calibration:
    """Fit the unknowns with all model error, choose the class by evidence, fit again with that class.

    Parameters
    ----------
    experiment : Experiment
    apart : collection of str
        Channels that do not count until the class and the point are found, see
        :func:`diagnosis.engine.set_apart.calibrate_apart`

    Raises
    ------
    ArithmeticError
        If the simulation has no solution with the priors' middles.
    """
    error, classes = ModelError.of(experiment), error_classes()
    found = _calibrated(without_channels(experiment, apart) if apart else experiment, error, classes)
    if not apart:
        return found
    fit = found.fit
    courses = [part.point.trajectory for part in fit.parts]
    at = experiment.linearise(fit.z, courses)
    amplitudes = error.amplitudes(found.chosen)
    all_readings = _judged(experiment, at.parts, _columns(error, at.parts), amplitudes, found.session_s)
    over = fit_over_sessions(all_readings.fit(fit.z, courses), len(fit.z))
    return replace(found, fit=all_readings.fit(fit.z, courses, iterations=0), log_evidence=over.log_evidence,
                   session_s=over.mean, of_others=found)  # fmt: skip


def _calibrated(experiment: Experiment, error: ModelError, classes: Sequence[ErrorClass]) -> Calibration:
    (widest,) = (one for one in classes if one.name == WIDEST_CLASS)
    z = np.zeros(len(experiment.unknowns))
    at = experiment.linearise(z)
    for iterations in (FIRST_ITERATIONS, ITERATIONS):
        here = _judged(experiment, at.parts, _columns(error, at.parts), error.amplitudes(widest), 0.0)
        fit = here.fit(z, [part.point.trajectory for part in at.parts], iterations=iterations)
        z, at = fit.z, experiment.linearise(fit.z, [part.point.trajectory for part in fit.parts])
    columns = _columns(error, at.parts)
    evidence = _evidence_of_classes(z, at.parts, columns, error, classes)
    chosen = max(classes, key=lambda one: evidence[one.name])
    best = max(evidence.values())
    s = 0.0
    for _ in range(2 if len(sessions_of(experiment)) > 1 else 1):
        here = _judged(experiment, at.parts, columns, error.amplitudes(chosen), s)
        fit = here.fit(z, [part.point.trajectory for part in at.parts], iterations=FIRST_ITERATIONS)
        over = fit_over_sessions(fit, len(z))
        z, s = fit.z, float(over.deviations[over.most_probable])
    return Calibration(fit=fit, chosen=chosen, evidence={name: value - best for name, value in evidence.items()},
                       log_evidence=over.log_evidence, session_s=over.mean)  # fmt: skip


def _columns(error: ModelError, parts: Sequence[Linear]) -> list[Array]:
    """Whitened columns of all model error, per unit, of every piece, shape (M, n)."""
    return [error.whitened(part) for part in parts]


def _judged(
    experiment: Experiment, parts: Sequence[Linear], columns: Sequence[Array], amplitudes: Array, s: float
) -> Experiment:
    """The experiment with the filters of a linearisation and the leading directions of model error in its metric."""
    there = amplitudes > 0.0
    scaled = [N[:, there] * amplitudes[there] for N in columns]
    directions = leading_directions(np.sum([N.T @ N for N in scaled], axis=0))
    shared = [N @ directions for N in scaled]
    return with_deviation(experiment.with_filters(parts), [part.columns for part in parts], shared, s)


def _evidence_of_classes(
    z: Array, parts: Sequence[Linear], columns: Sequence[Array], error: ModelError, classes: Sequence[ErrorClass]
) -> dict[str, float]:  # fmt: skip
    """Log evidence of every class at one point, prior included."""
    gram, count = gram_of(parts, whitened_base(parts, z, columns)), len(z)
    given = gram.given(range(count))
    places = range(count, gram.count)
    return {one.name: float(np.log(one.prior)) + given.given(places, error.amplitudes(one)).log_evidence
            for one in classes}  # fmt: skip
