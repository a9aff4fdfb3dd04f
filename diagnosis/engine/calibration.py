"""Calibration with model error in place: the point that everything is linearised at."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

import numpy as np

from diagnosis.engine.fit import FIRST_ITERATIONS, ITERATIONS, NO_SOLUTION, Experiment, Fit, Linear
from diagnosis.engine.gram import Gram, gram_of, whitened_base
from diagnosis.engine.learnt import ErrorClass, error_classes, rule, widest_class
from diagnosis.engine.metric import Metric, leading_directions
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.sessions import fit_over_sessions, most_deviation, over_sessions
from diagnosis.engine.set_apart import without_channels
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat, Whitening
from models.base.types import Array

TURNS = 3  # with the chosen class: point, columns of model error and deviation between sessions settle together
LONGEST = 16.0  # times as long as assumed, random heats may last where only the form of the laws is known
PART_STEPS = (0.25, 0.5, 2.0, 4.0)  # in the random heat of one part
WORTH = 1.0  # nats that another random heat has to bring
FAR_SD = 4.0  # of a prior, from which a calibration without the effect may be far from the machine with it


@dataclass(frozen=True, kw_only=True, eq=False)
class InClass:
    """The machine without the effect that is looked for, with model error of one class.

    Attributes
    ----------
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
class NearReadings:
    """All pieces linearised near the readings, and what model error does there.

    Attributes
    ----------
    experiment : Experiment
        With the noise filters of this linearisation
    columns : tuple of Array, shape (M, unknowns of model error)
        Whitened, per unit, of every piece
    """

    experiment: Experiment
    parts: tuple[Linear, ...]
    error: ModelError
    columns: tuple[Array, ...]

    @classmethod
    def of(cls, experiment: Experiment, error: ModelError, fit: Fit) -> NearReadings:
        """Linearise about the courses of a fit, with the model error assumed there and new noise filters."""
        free = replace(experiment, filters=None)
        parts = tuple(free.linearise_piece(i, fit.z, trajectory, error=trajectory.piece.error)
                      for i, trajectory in enumerate(fit.trajectories))  # fmt: skip
        return cls(experiment=free.with_filters(parts), parts=parts, error=error,
                   columns=tuple(error.whitened(part) for part in parts))  # fmt: skip

    def directions(self, one: ErrorClass) -> Array:
        """Leading combinations of model error in a class with the prior N(0, 1) each, shape (unknowns, n)."""
        amplitudes = self.error.amplitudes(one)
        there = np.flatnonzero(amplitudes > 0.0)
        scale = amplitudes[there]
        leading = leading_directions(self._products[np.ix_(there, there)] * np.outer(scale, scale))
        directions = np.zeros((len(amplitudes), leading.shape[1]))
        directions[there] = amplitudes[there, None] * leading
        return directions

    @cached_property
    def _products(self) -> Array:
        """Inner products of all columns, shape (unknowns of model error, unknowns of model error)."""
        return np.asarray(np.sum([N.T @ N for N in self.columns], axis=0))

    def gram(self, one: ErrorClass, z: Array) -> Gram:
        """Of residual, unknowns and model error of a class, where the unknowns are `z`."""
        directions = self.directions(one)
        return gram_of(self.parts, whitened_base(self.parts, z, [N @ directions for N in self.columns]))

    def log_evidence(self, one: ErrorClass, z: Array) -> float:
        """Log evidence of a class where the unknowns are `z`, its prior included, all deviations weighed."""
        gram = self.gram(one, z)
        return float(np.log(one.prior)) + over_sessions(gram, self.experiment, range(gram.count)).log_evidence

    def evidence_of(self, one: ErrorClass, z: Array) -> Callable[[RandomHeat], float]:
        """Log evidence of random heats with model error of a class, where everything is linearised.

        It is that of the innovations (Harvey 1989, section 3.4; see :mod:`diagnosis.forward.whitening`).

        Parameters
        ----------
        z : Array, shape (unknowns,)
            Where everything is linearised
        """
        model, directions = self.experiment.machine.model, self.directions(one)
        raw = [
            np.concatenate([part.point.residual_without_error[:, :, None], self.experiment.columns(part.point, z),
                            self.error.combined_responses(part.point, directions)], axis=2)
            for part in self.parts
        ]  # fmt: skip

        @cache
        def log_evidence(times: RandomHeat) -> float:
            parts, errors = [], []
            for part, noise, columns in zip(
                self.parts, self.experiment.with_random_heat(times).noise, raw, strict=True
            ):
                there = Whitening(model, part.point.trajectory, part.point.sensors, noise)
                residual, known, error = np.split(there(columns), [1, 1 + len(z)], axis=1)
                parts.append(Linear(point=part.point, filter=there, residual=residual[:, 0], columns=known))
                errors.append(error)
            gram = gram_of(parts, whitened_base(parts, z, errors))
            return over_sessions(gram, self.experiment, range(gram.count)).log_evidence

        return log_evidence

    def most_probable(self, log_evidence: Callable[[RandomHeat], float], start: RandomHeat) -> RandomHeat:
        """Random heats with the most evidence, searched for from a start; without draughts there, without.

        All are halved by the step that brings most evidence as long as one does. They are never more than assumed.
        Where no more than the form of the laws is known they may last longer, and each part has as much as its
        readings show (Kristensen, Madsen, Jorgensen 2004). With geometry an effect of hours would pass for random.
        """
        noise, (most, _) = self.experiment.noise[0], rule().draughts
        longest = LONGEST if noise.goes_with_capacity else 1.0

        def of_all(now: RandomHeat) -> list[RandomHeat]:
            tried = [replace(now, **{name: times * getattr(now, name)})
                     for name in ("heat", "wander", "time", "draught") for times in (0.5, 2.0)]  # fmt: skip
            # Less heat that lasts longer does nearly the same: both change at once, or neither would alone.
            tried += [replace(now, heat=times * now.heat, time=now.time / times) for times in (0.5, 2.0)]
            return [one for one in tried if max(one.heat, one.wander, one.draught / most) <= 1.0 <= one.time <= longest]

        def of_part(part: int, now: RandomHeat) -> list[RandomHeat]:
            has = now.parts or (1.0,) * len(noise.heat_sd)
            return [replace(now, parts=(*has[:part], times * has[part], *has[part + 1 :]))
                    for times in PART_STEPS if times * has[part] <= 1.0]  # fmt: skip

        steps: list[Callable[[RandomHeat], list[RandomHeat]]] = [of_all]
        if noise.goes_with_capacity:
            steps += [partial(of_part, part) for part in range(len(noise.heat_sd))]
        best, before = start, None
        while best != before:
            before = best
            for step in steps:
                while log_evidence(other := max(step(best), key=log_evidence)) >= log_evidence(best) + WORTH:
                    best = other
        return best

    def fitted(
        self, one: ErrorClass, start: Fit, deviation: float = 0.0, *, iterations: int = FIRST_ITERATIONS
    ) -> InClass:
        """Fit with model error of one class and some deviation between sessions.

        Parameters
        ----------
        deviation : float
            In prior standard deviations
        iterations : int
            At most
        """
        directions = self.directions(one)
        shared, count = tuple(N @ directions for N in self.columns), directions.shape[1]
        metric = Metric(
            sessions=self.experiment.sessions, columns=shared, shared=count, own=count,
            courses=tuple(self.error.courses(part.point, directions) for part in self.parts),
        )  # fmt: skip
        if deviation > 0.0:
            both = tuple(np.column_stack([N, part.columns]) for N, part in zip(shared, self.parts, strict=True))
            metric = replace(metric, columns=both, own=0, deviation=deviation)
        fit = replace(self.experiment, metric=metric).fit(start.z, start.trajectories, iterations=iterations)
        over = fit_over_sessions(fit, len(fit.z))
        return InClass(error_class=one, fit=fit, log_evidence=float(np.log(one.prior)) + over.log_evidence,
                       session_s=over.mean, deviation=float(over.deviations[over.most_probable]))  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """The machine without the effect that is looked for.

    Attributes
    ----------
    chosen : InClass
        The most probable class
    evidence : mapping of str to float
        Log evidence of every class, prior included, less that of the best
    near : NearReadings
        Where it is linearised
    of_others : Calibration or None
        By the readings without the channels set apart alone, if there are any
    """

    chosen: InClass
    evidence: Mapping[str, float]
    near: NearReadings
    of_others: Calibration | None = None
    _known: dict[str, InClass] = field(default_factory=dict, init=False)
    _fitted: set[str] = field(default_factory=set, init=False)
    _middles: dict[str, Fit] = field(default_factory=dict, init=False)

    @property
    def fit(self) -> Fit:
        """In the most probable class."""
        return self.chosen.fit

    @property
    def is_far(self) -> bool:
        """True if an unknown is far from the middle of its prior: the machine may be another one."""
        return float(np.max(np.abs(self.fit.z), initial=0.0)) > FAR_SD

    @property
    def classes(self) -> tuple[ErrorClass, ...]:
        """Classes that candidates are judged in: all, or that of the sound channels where others were set apart.

        No model error is to stand in for a broken sensor.
        """
        return error_classes() if self.of_others is None else (self.chosen.error_class,)

    @property
    def assumes_error(self) -> bool:
        """True if there is any model error in the classes that candidates are judged in."""
        return any(self.near.error.amplitudes(one).any() for one in self.classes)

    def in_class(self, one: ErrorClass) -> InClass:
        """The machine with model error of another class, at the same point: a start for fits in that class."""
        if one == self.chosen.error_class:
            return self.chosen
        if one.name not in self._known:
            self._known[one.name] = self.near.fitted(one, self.fit, self.chosen.deviation, iterations=0)
        return self._known[one.name]

    def fitted_in_class(self, one: ErrorClass) -> InClass:
        """The machine fitted with model error of another class; fits in that class start there from then on."""
        if one.name not in self._fitted:
            self._known[one.name] = self.near.fitted(one, self.fit, self.chosen.deviation)
            self._fitted.add(one.name)
        return self._known[one.name]

    def at_middles(self, one: ErrorClass) -> Fit:
        """The machine with model error of a class at the middles of the priors: another start for fits in that class.

        Raises
        ------
        ArithmeticError
            If the simulation has no solution there.
        """
        if one.name not in self._middles:
            experiment = self.in_class(one).fit.experiment
            z = np.zeros(len(experiment.unknowns))
            self._middles[one.name] = Fit(experiment=experiment, z=z, linearised=experiment.linearise(z))
        return self._middles[one.name]


def calibrate_with_error(experiment: Experiment, start: Fit, apart: Collection[str] = ()) -> Calibration:
    """Fit the unknowns with all model error, choose the class by evidence, fit again with that class.

    Parameters
    ----------
    start : Fit
        Where to start, besides the middles of the priors: the machine calibrated without model error
    apart : collection of str
        Channels that do not count until the class and the point are found, see
        :func:`diagnosis.engine.set_apart.calibrate_apart`

    Raises
    ------
    ArithmeticError
        If the simulation has no solution at the starts.
    """
    error = ModelError.of(experiment)
    found = _calibrated(without_channels(experiment, apart) if apart else experiment, error, start)
    if not apart:
        return found
    sound, others = found.near.experiment, found.chosen
    whole = replace(experiment.with_random_heat(sound.random_heat), most_deviation=sound.most_deviation)
    near = NearReadings.of(whole, error, found.fit)
    chosen = near.fitted(others.error_class, found.fit, others.deviation, iterations=0)
    return replace(found, chosen=chosen, near=near, of_others=found)


def _calibrated(experiment: Experiment, error: ModelError, start: Fit) -> Calibration:
    widest = widest_class()  # no parameter has to stand in for what the model cannot know
    # There may be several basins: without model error, parameters may have gone far to stand in for it.
    middles = experiment.fit(np.zeros(len(experiment.unknowns)), iterations=0)
    first = [NearReadings.of(experiment, error, one).fitted(widest, one) for one in (start, middles)]
    fit = max(first, key=lambda one: one.log_evidence).fit
    near = NearReadings.of(experiment, error, fit)
    random_heat = near.most_probable(near.evidence_of(widest, fit.z), AS_ASSUMED)
    return _from_middles(_with_random_heat(experiment.with_random_heat(random_heat), error, fit))


def _from_middles(calibration: Calibration) -> Calibration:
    """The calibration, or a more probable one that is reached from the middles of the priors, if it is far from them.

    A few steps do not show yet which start is better.
    """
    if not calibration.is_far:
        return calibration
    try:
        start = calibration.at_middles(calibration.chosen.error_class)
        reached = start.experiment.fit(start.z, iterations=ITERATIONS, at=start.linearised)
    except NO_SOLUTION:
        return calibration
    return recalibrate(calibration, reached)


def _with_random_heat(experiment: Experiment, error: ModelError, fit: Fit) -> Calibration:
    widest = widest_class()
    fit = NearReadings.of(experiment, error, fit).fitted(widest, fit, iterations=ITERATIONS).fit
    near = NearReadings.of(experiment, error, fit)
    most = most_deviation(near.gram(widest, fit.z), experiment)
    return _settled(replace(near, experiment=replace(near.experiment, most_deviation=most)), fit)


def calibrate_in_draughts(calibration: Calibration) -> Calibration | None:
    """Calibration in draughts, which change the heat of all parts to the surroundings by one random share.

    None if they bring less evidence than :attr:`Rule.draughts` asks for, have no solution, or channels were set apart:
    a broken sensor is no draught.
    """
    if calibration.of_others is not None:
        return None
    near, fit, widest = calibration.near, calibration.fit, widest_class()
    log_evidence, has = near.evidence_of(widest, fit.z), near.experiment.random_heat
    most, worth = rule().draughts
    times = near.most_probable(log_evidence, replace(has, draught=most))
    if log_evidence(times) < log_evidence(has) + worth:
        return None
    free = replace(near.experiment.with_random_heat(times), most_deviation=np.inf)
    try:
        found = _with_random_heat(free, near.error, fit)
    except NO_SOLUTION:
        return None
    return found if found.chosen.log_evidence > calibration.chosen.log_evidence else None


def recalibrate(calibration: Calibration, fit: Fit) -> Calibration:
    """Calibration about the courses of another fit of the same machine, if it is more probable, in the best class."""
    try:
        again = _settled(NearReadings.of(calibration.near.experiment, calibration.near.error, fit), fit)
    except NO_SOLUTION:
        return calibration
    better = again.chosen.log_evidence > calibration.chosen.log_evidence
    return replace(again, of_others=calibration.of_others) if better else calibration


def _settled(near: NearReadings, fit: Fit) -> Calibration:
    """The class of model error by the evidence about a fit near it, and the machine with it."""
    classes = error_classes()
    evidence = {one.name: near.log_evidence(one, fit.z) for one in classes}
    best = max(classes, key=lambda one: evidence[one.name])
    chosen = near.fitted(best, fit)
    for _ in range(TURNS - 1):
        near = NearReadings.of(near.experiment, near.error, chosen.fit)
        chosen = near.fitted(best, chosen.fit, chosen.deviation)
    largest = max(evidence.values())
    return Calibration(chosen=chosen, evidence={name: value - largest for name, value in evidence.items()}, near=near)
