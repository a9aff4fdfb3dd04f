"""Everything judged by straight lines: all candidates at one point, in every class of model error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Expected, Judged, Likeness, Repeating, ScaledError
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.families import with_priors
from diagnosis.engine.gram import Strengths
from diagnosis.engine.learnt import ErrorClass, rule
from diagnosis.engine.scan import Scan, scan
from diagnosis.engine.sessions import OverSessions, over_sessions
from models.base.types import Array

WHOLE = {"swapped": (0.7, 1.3), "stuck": (0.3, np.inf)}  # share that a fault has which an instrument has or has not
AHEAD = 1.0  # nats, from which a class that was not chosen has to show by a fit what straight lines promise
LEAST_SHARE = 0.1  # the least of these by a straight line, which may be far off
OVER_TIME = ("from_date", "carried_on", "over_hours")  # effects that change over time
WORSE, LEAST_DEVIATION = 2.0, 0.05  # times the deviation between sessions; prior standard deviations


@dataclass(frozen=True, kw_only=True, eq=False)
class ScanInClass:
    """Everything judged by straight lines with model error of one class."""

    error_class: ErrorClass
    scan: Scan
    over: OverSessions
    ahead: float  # of the most probable class, without any candidate
    log_bayes: Array  # against nothing in the most probable class
    strengths: Strengths


@dataclass(frozen=True, kw_only=True, eq=False)
class Scanned:
    """Everything judged by straight lines at one point, in the class of model error that suits each candidate best."""

    candidates: tuple[Hypothesis, ...]
    log_bayes: Array
    classes: tuple[ScanInClass, ...]
    best: tuple[ScanInClass, ...]

    @property
    def weights(self) -> Array:
        """Evidence and prior of every candidate, [nat]."""
        return np.asarray(self.log_bayes + [one.log_prior for one in self.candidates])

    @property
    def order(self) -> list[int]:
        """Indices of the candidates, most probable first."""
        return [int(index) for index in np.argsort(-self.weights)]

    @property
    def most(self) -> float:
        """Log Bayes factor of the most probable candidate, [nat]."""
        return float(self.log_bayes[self.order[0]])

    @property
    def log_e(self) -> float:
        """Log odds of all effects to none, parameters as they may be, [nat]."""
        parameter = np.array([one.how == "parameter" for one in self.candidates], dtype=bool)
        return log_sum(self.weights[~parameter]) - log_sum([0.0, *self.weights[parameter]])

    def to_its_best(self, rate: float) -> tuple[Scanned, float]:
        """All against nothing in the class that suits nothing best; evidence from which something is missing, [nat].

        Parameters
        ----------
        rate : float
            False-alarm rate that a user asks for
        """
        nothing = max(self.classes, key=lambda one: one.ahead)
        detection, _ = rule().thresholds(nothing.error_class, self.best[self.order[0]].error_class, rate)
        return replace(self, log_bayes=self.log_bayes - nothing.ahead), detection

    def in_class(self, error_class: ErrorClass) -> ScanInClass:
        """Everything with model error of one class."""
        return next(one for one in self.classes if one.error_class == error_class)


def scan_at(calibration: Calibration, candidates: Sequence[Hypothesis]) -> Scan:
    """All candidates at the calibrated point, with their priors and model error."""
    return scan(calibration.fit, with_priors(candidates), calibration.near.columns)


def scan_in_classes(calibration: Calibration, found: Scan, classes: Sequence[ErrorClass] = ()) -> Scanned:
    """The scan at the calibrated point with model error of all classes, or of others in their place."""
    judged = []
    for one in classes or calibration.classes:
        here = found.in_directions(calibration.near.directions(one))
        over = over_sessions(here.gram, calibration.fit.experiment, range(here.further.stop))
        judged.append((one, here, over, float(np.log(one.prior)) + over.log_evidence))
    chosen = [one for one in judged if one[0].name == calibration.chosen.error_class.name] or judged
    nothing, *_, reached = max(chosen, key=lambda one: one[-1])
    each = [_in_class(one, here, over, evidence - reached, nothing) for one, here, over, evidence in judged]
    return in_best_classes(each)


def as_fits_show(calibration: Calibration, found: Scanned) -> Scanned:
    """The scan, with each class that is ahead of the chosen one held to what a fit without an effect reaches in it.

    A class that lacks what the chosen one has needs other values of the unknowns, and straight lines may go too far.
    """
    each = []
    for one in found.classes:
        ahead = one.ahead
        if ahead > AHEAD:
            reached = calibration.fitted_in_class(one.error_class)
            ahead = min(ahead, reached.log_evidence - calibration.chosen.log_evidence)
        each.append(replace(one, ahead=ahead, log_bayes=one.log_bayes + ahead - one.ahead))
    return in_best_classes(each)


def scan_given(calibration: Calibration, given: Judged, candidates: Sequence[Hypothesis]) -> Scanned:
    """All others scanned at the fit of an explanation, against that explanation, with model error of its class."""
    fit, mine = given.fitted, {effect.label for effect in given.effects}
    found, base = scan(fit, [one for one in candidates if one.label not in mine]), len(calibration.fit.z)
    over = over_sessions(found.gram, fit.experiment, [*range(base), *found.further], range(base, len(fit.z)))
    return in_best_classes([_in_class(given.error_class, found, over, 0.0, given.error_class)])


def judge_alone(calibration: Calibration, best: Judged, second: Scanned, ahead: float) -> dict[str, float]:
    """Log Bayes factors of all other candidates against nothing, by the scan at the best explanation, without it."""
    fit, found = best.fitted, second.classes[0].scan
    without = over_sessions(found.gram, fit.experiment, [*range(len(calibration.fit.z)), *found.further])
    log_bayes = _weighed(found, without) + ahead
    log_bayes -= counts_less(second.candidates, calibration.chosen.error_class, best.error_class)
    return dict(zip((one.label for one in second.candidates), log_bayes.tolist(), strict=True))


def _in_class(
    error_class: ErrorClass, found: Scan, over: OverSessions, ahead: float, nothing: ErrorClass
) -> ScanInClass:
    """Candidates in one class; `nothing`: that without any effect."""
    strengths = found.singles(over.given[over.most_probable])
    log_bayes = _weighed(found, over) - counts_less(found.candidates, nothing, error_class)
    hardly = hardly_there(found.candidates, strengths.value)
    log_bayes[hardly] = np.minimum(log_bayes[hardly], 0.0)
    return ScanInClass(error_class=error_class, ahead=ahead, scan=found, over=over, log_bayes=log_bayes + ahead,
                       strengths=strengths)  # fmt: skip


def _weighed(found: Scan, over: OverSessions) -> Array:
    """Log Bayes factors of all candidates, over variants and deviations between sessions."""
    return over.weighed([found.means(given) for given in over.given])


def hardly_there(candidates: Sequence[Hypothesis], strengths: Array) -> NDArray[np.intp]:
    """Places of faults of which an instrument would have a small share only; a strength per candidate."""
    return np.array([
        index for index, (one, value) in enumerate(zip(candidates, strengths.tolist(), strict=True))
        if one.term is not None and one.term.form in WHOLE and abs(value) < LEAST_SHARE
    ], dtype=np.intp)  # fmt: skip


def in_best_classes(classes: Sequence[ScanInClass]) -> Scanned:
    """Every candidate in the class that suits it best."""
    table = np.stack([one.log_bayes for one in classes])
    return Scanned(
        candidates=classes[0].scan.candidates, log_bayes=table.max(axis=0),
        classes=tuple(classes), best=tuple(classes[at] for at in table.argmax(axis=0).tolist()),
    )  # fmt: skip


def counts_less(candidates: Sequence[Hypothesis], nothing: ErrorClass, here: ErrorClass) -> Array:
    """Nats that changes over time count less: the mean of both classes, or what baselines bring if that is more.

    Both are about a model that is wrong in the very hours that a change over time can pick. Of what is trusted only
    counts less what baselines bring beyond the mean of both classes. No model is wrong as a reading that stands still.
    """
    of_class = 0.5 * (nothing.over_time + here.over_time)
    return np.array([
        max(one.less, of_class) - of_class * one.trusted if one.how in OVER_TIME and not one.holds_a_reading else 0.0
        for one in candidates
    ])  # fmt: skip


def log_sum(log: Sequence[float] | Array) -> float:
    """Logarithm of a sum, of nothing too."""
    return float(np.logaddexp.reduce(np.asarray(log, dtype=float)))


def repeating_of(found: Scanned, error_class: ErrorClass) -> tuple[Repeating, ...]:
    """Evidence of the scan in a class with the most probable deviation between sessions, and with a larger one."""
    here = found.in_class(error_class)
    deviations, supported = here.over.deviations, here.over.most_probable
    worse = int(np.searchsorted(deviations, WORSE * max(deviations[supported], LEAST_DEVIATION)))
    if worse >= len(deviations):
        return ()
    every = []
    for at in (supported, worse):
        log_bayes = here.scan.means(here.over.given[at])
        judged = replace(found, log_bayes=log_bayes - counts_less(found.candidates, error_class, error_class))
        best = judged.candidates[judged.order[0]]
        every.append(Repeating(deviation_in_sd=float(deviations[at]), log_e_value=judged.log_e,
                               mechanism=best.mechanism, place=best.place))  # fmt: skip
    return tuple(every)


def with_scaled_error(
    calibration: Calibration, found: Scan, factor: float, first: Scanned, rate: float, least: float
) -> ScaledError:
    """Evidence of the scan if all model error were larger or smaller than assumed."""
    scaled = [one.scaled(factor) for one in calibration.classes]
    there = first if factor == 1.0 else scan_in_classes(calibration, found, scaled)
    there, detection = there.to_its_best(rate)
    best = there.candidates[there.order[0]]
    return ScaledError(factor=factor, log_e_value=there.log_e, threshold=max(detection, least),
                       mechanism=best.mechanism, place=best.place)  # fmt: skip


def likeness_of(found: Scanned, error_class: ErrorClass) -> Likeness:
    """How much alike candidates look in these readings, each in its best shape, with model error of one class."""
    here = found.in_class(error_class)
    given = here.over.given[here.over.most_probable]
    at = here.scan.of_candidates + 1
    inner = given.matrix[np.ix_(at, at)]
    norm = np.sqrt(np.maximum(np.diag(inner), 1e-12))
    return Likeness(labels=tuple(one.label for one in found.candidates), cosines=np.abs(inner / norm / norm[:, None]))


def expected_of(scanned: Scanned, error_class: ErrorClass, settings: Settings) -> tuple[Expected, ...]:
    """Expected evidence of every term at the size that matters: of a temperature or a heat, whichever is less."""
    here = scanned.in_class(error_class)
    given, found = here.over.given[here.over.most_probable], here.scan
    at = found.of_candidates + 1
    b = np.maximum(given.matrix[at, at], 0.0)
    sd, size = found.sd, np.full(len(b), np.inf)
    for matters, peak in ((settings.matters_K, found.peak_K), (settings.matters_W, found.peak_W)):
        reached = (peak > 0.0) & (matters > 0.0)
        size[reached] = np.minimum(size[reached], matters / peak[reached])
    size = np.where(np.isfinite(size), size, sd)
    log_bayes = 0.5 * np.square(b * size) / (b + 1.0 / np.square(sd)) - 0.5 * np.log1p(b * np.square(sd))
    log_bayes -= counts_less(found.candidates, error_class, error_class)
    each = zip(found.candidates, log_bayes.tolist(), strict=True)
    return tuple(Expected(effect=one, log_bayes=value) for one, value in each if one.term is not None)
