"""Calibration with model error in place: the point that everything is linearised at."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from diagnosis.engine.fit import FIRST_ITERATIONS, ITERATIONS, Experiment, Fit, Linear
from diagnosis.engine.learnt import ErrorClass, error_classes
from diagnosis.engine.metric import leading_directions
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.products import gram_of, whitened_base
from diagnosis.engine.sessions import fit_over_sessions, over_sessions, with_deviation
from diagnosis.engine.set_apart import without_channels
from diagnosis.forward.trajectory import Trajectory
from models.base.types import Array

TURNS = 3  # with the chosen class: point, columns of model error and deviation between sessions settle together
WIDEST_CLASS = "full"  # the point is calibrated with it: no parameter has to stand in for what the model cannot know


@dataclass(frozen=True, kw_only=True, eq=False)
class InClass:
    """The machine without the effect that is looked for, with model error of one class.

    Attributes
    ----------
    error_class : ErrorClass
    fit : Fit
        Model error in its metric, with the most probable deviation between sessions
    log_evidence : float
        Over all deviations between sessions, prior of the class included
    session_s, deviation : float
        Deviation between sessions, mean and most probable, in prior standard deviations
    """

    error_class: ErrorClass
    fit: Fit
    log_evidence: float
    session_s: float
    deviation: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """The machine without the effect that is looked for.

    Attributes
    ----------
    chosen : InClass
        The most probable class
    evidence : mapping of str to float
        Log evidence of every class, prior included, less that of the best
    error : ModelError
    parts : sequence of Linear
        Every piece near the readings
    columns : sequence of Array, shape (M, unknowns of model error)
        Whitened, per unit, there
    of_others : Calibration or None
        By the readings without the channels set apart alone, if there are any
    """

    chosen: InClass
    evidence: Mapping[str, float]
    error: ModelError
    parts: Sequence[Linear]
    columns: Sequence[Array]
    of_others: Calibration | None = None
    _known: dict[str, InClass] = field(default_factory=dict)

    @property
    def fit(self) -> Fit:
        """In the most probable class."""
        return self.chosen.fit

    @property
    def classes(self) -> tuple[ErrorClass, ...]:
        """Classes that candidates are judged in: all, or that of the sound channels where others were set apart.

        No model error is to stand in for a broken sensor.
        """
        return error_classes() if self.of_others is None else (self.chosen.error_class,)

    def directions(self, one: ErrorClass) -> Array:
        """Leading combinations of model error in a class with the prior N(0, 1) each, shape (unknowns, n)."""
        return _directions(self.columns, self.error.amplitudes(one))

    def in_class(self, one: ErrorClass) -> InClass:
        """The machine with model error of another class, at the same point: a start for fits in that class."""
        if one == self.chosen.error_class:
            return self.chosen
        if one.name not in self._known:
            self._known[one.name] = _in_class(self.fit.experiment, one, self.fit, self.parts, self.error, self.columns,
                                              self.chosen.deviation, iterations=0)  # fmt: skip
        return self._known[one.name]


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
    columns = _columns(error, parts)
    chosen = _in_class(experiment, found.chosen.error_class, found.fit, parts, error, columns, found.chosen.deviation,
                       iterations=0)  # fmt: skip
    return replace(found, chosen=chosen, parts=parts, columns=columns, of_others=found, _known={})


def _calibrated(experiment: Experiment, error: ModelError, classes: Sequence[ErrorClass], start: Fit) -> Calibration:
    (widest,) = (one for one in classes if one.name == WIDEST_CLASS)
    fit, parts = start, _linearised_at(experiment, start)
    columns = _columns(error, parts)
    for iterations in (FIRST_ITERATIONS, ITERATIONS):
        here = _judged(experiment, parts, error, columns, error.amplitudes(widest), 0.0)
        fit = here.fit(fit.z, _courses(parts), iterations=iterations)
        parts = _linearised_at(experiment, fit)
        columns = _columns(error, parts)
    evidence = _evidence_of_classes(experiment, fit.z, parts, columns, error, classes)
    best = max(classes, key=lambda one: evidence[one.name])
    chosen = _in_class(experiment, best, fit, parts, error, columns, 0.0)
    for _ in range(TURNS - 1):
        parts = _linearised_at(experiment, chosen.fit)
        columns = _columns(error, parts)
        chosen = _in_class(experiment, best, chosen.fit, parts, error, columns, chosen.deviation)
    largest = max(evidence.values())
    return Calibration(
        chosen=chosen, evidence={name: value - largest for name, value in evidence.items()}, error=error, parts=parts,
        columns=columns,
    )  # fmt: skip


def _in_class(
    experiment: Experiment, one: ErrorClass, near: Fit, parts: Sequence[Linear], error: ModelError,
    columns: Sequence[Array], deviation: float, *, iterations: int = FIRST_ITERATIONS,
) -> InClass:  # fmt: skip
    """Fit with model error of one class and some deviation between sessions."""
    here = _judged(experiment, parts, error, columns, error.amplitudes(one), deviation)
    fit = here.fit(near.z, _courses(near.parts), iterations=iterations)
    over = fit_over_sessions(fit, len(fit.z))
    return InClass(error_class=one, fit=fit, log_evidence=float(np.log(one.prior)) + over.log_evidence,
                   session_s=over.mean, deviation=float(over.deviations[over.most_probable]))  # fmt: skip


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
