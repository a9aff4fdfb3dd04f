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
from diagnosis.engine.sessions import fit_over_sessions, over_sessions, sessions_of, with_deviation
from diagnosis.engine.set_apart import without_channels
from diagnosis.forward.trajectory import Trajectory
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


def calibrate_with_error(experiment: Experiment, start: Fit, apart: Collection[str] = ()) -> Calibration:
    """Fit the unknowns with all model error, choose the class by evidence, fit again with that class.

    Parameters
    ----------
    experiment : Experiment
    start : Fit
        Where to start: the machine calibrated without model error, which is near the readings
    apart : collection of str
        Channels that do not count until the class and the point are found, see
        :func:`diagnosis.engine.set_apart.calibrate_apart`

    Raises
    ------
    ArithmeticError
        If the simulation has no solution at the start.
    """
    error, classes = ModelError.of(experiment), error_classes()
    found = _calibrated(without_channels(experiment, apart) if apart else experiment, error, classes, start)
    if not apart:
        return found
    parts = _linearised_at(experiment, found.fit)
    here = _judged(experiment, parts, error, _columns(error, parts), error.amplitudes(found.chosen), found.session_s)
    fit = here.fit(found.fit.z, _courses(parts), iterations=0)
    over = fit_over_sessions(fit, len(fit.z))
    return replace(found, fit=fit, log_evidence=over.log_evidence, session_s=over.mean, of_others=found)


def _calibrated(experiment: Experiment, error: ModelError, classes: Sequence[ErrorClass], start: Fit) -> Calibration:
    (widest,) = (one for one in classes if one.name == WIDEST_CLASS)
    fit, parts = start, _linearised_at(experiment, start)
    for iterations in (FIRST_ITERATIONS, ITERATIONS):
        here = _judged(experiment, parts, error, _columns(error, parts), error.amplitudes(widest), 0.0)
        fit = here.fit(fit.z, _courses(parts), iterations=iterations)
        parts = _linearised_at(experiment, fit)
    columns = _columns(error, parts)
    evidence = _evidence_of_classes(experiment, fit.z, parts, columns, error, classes)
    chosen = max(classes, key=lambda one: evidence[one.name])
    best = max(evidence.values())
    s = 0.0
    for _ in range(2 if len(sessions_of(experiment)) > 1 else 1):
        here = _judged(experiment, parts, error, columns, error.amplitudes(chosen), s)
        fit = here.fit(fit.z, _courses(parts), iterations=FIRST_ITERATIONS)
        over = fit_over_sessions(fit, len(fit.z))
        s = float(over.deviations[over.most_probable])
    return Calibration(fit=fit, chosen=chosen, evidence={name: value - best for name, value in evidence.items()},
                       log_evidence=over.log_evidence, session_s=over.mean)  # fmt: skip


def _linearised_at(experiment: Experiment, fit: Fit) -> list[Linear]:
    """All pieces near the courses of a fit, with the model error assumed there; whitened by their own filters."""
    courses = _courses(fit.parts)
    return [experiment.linearised(i, fit.z, course, error=course.piece.error) for i, course in enumerate(courses)]


def _courses(parts: Sequence[Linear]) -> list[Trajectory]:
    return [part.point.trajectory for part in parts]


def _columns(error: ModelError, parts: Sequence[Linear]) -> list[Array]:
    """Whitened columns of all model error, per unit, of every piece, shape (M, n)."""
    return [error.whitened(part) for part in parts]


def _judged(
    experiment: Experiment, parts: Sequence[Linear], error: ModelError, columns: Sequence[Array], amplitudes: Array,
    s: float,
) -> Experiment:  # fmt: skip
    """The experiment with the filters of a linearisation and the leading directions of model error in its metric."""
    directions = _directions(columns, amplitudes)
    return with_deviation(
        experiment.with_filters(parts), [part.columns for part in parts], [N @ directions for N in columns], s,
        [error.courses(part.point, directions) for part in parts],
    )  # fmt: skip


def _directions(columns: Sequence[Array], amplitudes: Array) -> Array:
    """Combinations of unknowns per unit with the prior N(0, 1) each, shape (unknowns, n)."""
    there = np.flatnonzero(amplitudes > 0.0)
    scaled = [N[:, there] * amplitudes[there] for N in columns]
    leading = leading_directions(np.sum([N.T @ N for N in scaled], axis=0))
    directions = np.zeros((len(amplitudes), leading.shape[1]))
    directions[there] = amplitudes[there, None] * leading
    return directions


def _evidence_of_classes(
    experiment: Experiment, z: Array, parts: Sequence[Linear], columns: Sequence[Array], error: ModelError,
    classes: Sequence[ErrorClass],
) -> dict[str, float]:  # fmt: skip
    """Log evidence of every class at one point, prior included, over all deviations between sessions."""
    found = {}
    for one in classes:
        directions = _directions(columns, error.amplitudes(one))
        gram = gram_of(parts, whitened_base(parts, z, [N @ directions for N in columns]))
        found[one.name] = float(np.log(one.prior)) + over_sessions(gram, experiment, range(gram.count)).log_evidence
    return found
