"""From an experiment and its candidates to a posterior: scan, race, refit, second scan, third scan.

The scan is linear and judges everything. A race of a few Gauss-Newton steps corrects it for the best names; the best of
them are fitted to the end, model error in place; a second scan given the best explanation looks for a second effect.
Where there are baselines a third one, given the best two, looks for what they leave; without, two effects and model
error are too much alike.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr, logsumexp

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Expected, Judged, Likeness, Posterior, Repeating, ScaledError
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.candidates import Scan, scan, scope_of
from diagnosis.engine.fit import Fit
from diagnosis.engine.gram import Given, Strengths
from diagnosis.engine.learnt import ErrorClass, rule
from diagnosis.engine.outside import judge_outside
from diagnosis.engine.refit import refit
from diagnosis.engine.sessions import OverSessions, fit_over_sessions, over_sessions, sessions_of
from models.base.errors import InputError
from models.base.progress import Progress, silent
from models.base.types import Array

RACED, PLACES, RACE_STEPS = 18, 2, 4
NEAR_PLACE = 3.0  # nats behind the best place of its name, up to which a second place is raced
REFITTED, SECONDS = 6, 2
SETTLED_NAT, MOST_TURNS = 0.1, 5  # gain at which a fit has ended; how often it goes on at most
IMPOSSIBLE = -1e3  # nats
WHOLE = 0.3  # off 1, up to which two channels count as swapped
WORSE, LEAST_DEVIATION = 2.0, 0.05  # times the deviation between sessions; prior standard deviations
SCALED = (0.5, 1.0, 2.0)  # of the amplitudes of model error: what the scan says with each
OVER_TIME = ("D", "C", "W")  # families whose effects change over time
WORTH, WORTH_SHARE = 1.0, 0.1  # nats, and share of the best, from which a candidate is worth a fit


@dataclass(frozen=True, kw_only=True, eq=False)
class _InClass:
    """Everything judged by straight lines with model error of one class: terms in the order of the scan, parameters."""

    error_class: ErrorClass
    scan: Scan
    over: OverSessions
    ahead: float  # of the most probable class, without any candidate
    log_bayes: Array  # against nothing in the most probable class
    strengths: Strengths


@dataclass(frozen=True, kw_only=True, eq=False)
class _Scanned:
    """Everything judged by straight lines at one point, in the class of model error that suits each candidate best."""

    candidates: tuple[Hypothesis, ...]
    log_prior: Array
    log_bayes: Array
    classes: tuple[_InClass, ...]
    best: tuple[_InClass, ...]

    @property
    def order(self) -> list[int]:
        """Indices of the candidates, most probable first."""
        return [int(index) for index in np.argsort(-(self.log_bayes + self.log_prior))]

    @property
    def most(self) -> float:
        """Log Bayes factor of the most probable candidate, [nat]."""
        return float(self.log_bayes[self.order[0]])

    @property
    def log_e(self) -> float:
        """Log odds of all effects to none, parameters as they may be, [nat]."""
        log = self.log_prior + self.log_bayes
        parameter = np.array([one.how == "P" for one in self.candidates], dtype=bool)
        return _log_sum(log[~parameter]) - _log_sum([0.0, *log[parameter]])

    def in_class(self, error_class: ErrorClass) -> _InClass:
        return next(one for one in self.classes if one.error_class == error_class)


def infer(
    calibration: Calibration, candidates: Sequence[Hypothesis], log_prior: Array, settings: Settings, *,
    outside: Sequence[Hypothesis] = (), progress: Progress = silent,
) -> Posterior:  # fmt: skip
    """Weigh all explanations.

    Parameters
    ----------
    log_prior : Array, shape (candidates,)
        Of every candidate, to 1 of nothing
    outside : sequence of Hypothesis
        Unknown heats, judged where something is missing
    progress : callable
        Told what is being done
    """
    base, chosen = calibration.fit, calibration.chosen
    progress(f"scanning {len(candidates)} candidates")
    found = scan(base, [one for one in candidates if one.term is not None], calibration.near.columns)
    first = _scanned_in_classes(calibration, found, candidates, log_prior)
    judged = _raced(calibration, first, progress)
    alone = {one.label: float(value) for one, value in zip(first.candidates, first.log_bayes, strict=True)}
    gained, pairs = 0.0, list[Judged]()
    best = max(judged.values(), key=_weight, default=None)
    error_class = chosen.error_class if best is None else best.error_class
    placebo = _placebo(calibration, first)
    threshold = max(rule().threshold(chosen.error_class, error_class, settings.false_alarm_rate), placebo)
    if best is not None and best.fit is not None and best.log_bayes > 0.0:
        progress(f"scanning again, given {best.label}")
        second = _scanned_given(calibration, best, candidates, log_prior)
        judged[best.label] = replace(best, left=second.most)
        pairs = sorted(_pairs(calibration, best, second), key=_weight, reverse=True)
        if pairs and second.most > threshold and base.experiment.healthy:
            progress(f"scanning once more, given {pairs[0].label}")
            pairs[0] = replace(pairs[0], left=_scanned_given(calibration, pairs[0], candidates, log_prior).most)
        there = _alone(calibration, best, second, first.in_class(best.error_class).ahead)
        alone |= {label: min(alone[label], value) for label, value in there.items()}
        progress("fitting nothing from there")
        gained = _nothing_gains(calibration, best)
    for index, candidate in enumerate(first.candidates):
        judged.setdefault(candidate.label, _by_scan(first, index, alone[candidate.label]))
    every = (*judged.values(), *pairs)
    parameters = [_weight(one) for one in every if all(effect.term is None for effect in one.effects)]
    effects = [_weight(one) for one in every if sum(effect.term is not None for effect in one.effects) == 1]
    log_e = _log_sum(effects) - _log_sum([gained, *parameters])
    missing = log_e > threshold
    unknown = _unknown(calibration, error_class, outside) if missing else []
    return Posterior(
        nothing=Judged(effects=(), log_prior=0.0, log_bayes=0.0, error_class=chosen.error_class, fit=base),
        judged=tuple(replace(one, log_bayes=one.log_bayes - gained) for one in (*judged.values(), *pairs, *unknown)),
        log_e=log_e,
        log_parameter=_log_sum(parameters) - gained,
        threshold=threshold,
        rule=rule(),
        likeness=_likeness(first, error_class),
        odds_unknown=settings.odds_unknown,
        error_class=(error_class if missing else chosen.error_class).name,
        error_evidence=dict(calibration.evidence),
        session_s=chosen.session_s,
        scaled=tuple(
            _with_scaled_error(calibration, found, candidates, log_prior, factor, settings.false_alarm_rate, placebo)
            for factor in SCALED
        ),
        repeating=_repeating(first, error_class),
        expected=_expected(first.in_class(chosen.error_class), settings),
    )


def _log_sum(log: Sequence[float] | Array) -> float:
    """Logarithm of a sum, of nothing too."""
    return float(np.logaddexp.reduce(np.asarray(log, dtype=float)))


def _placebo(calibration: Calibration, found: _Scanned) -> float:
    """Evidence that healthy sessions hold of an effect that cannot be in them, [nat]; without any, minus infinity.

    Every baseline takes the place of the tested session in turn. What the best laws of the catalogue bring there is
    owed to the model; in longer recordings it grows with their hours.
    """
    experiment = calibration.fit.experiment
    hours = {piece.recording: 0.0 for piece in experiment.pieces}
    for piece in experiment.pieces:
        hours[piece.recording] += float(piece.steps.sum())
    tested = sum(value for name, value in hours.items() if name not in experiment.healthy)
    reached = [-np.inf]
    for pieces in sessions_of(experiment):
        names = {experiment.pieces[i].recording for i in pieces}
        if not names <= experiment.healthy:
            continue
        swapped = replace(experiment, healthy=frozenset(hours) - names)
        able = [
            (one, prior) for one, prior in zip(found.candidates, found.log_prior.tolist(), strict=True)
            if one.how == "P" or (one.how == "U" and scope_of(swapped, one) is not None)
        ]  # fmt: skip
        candidates, log_prior = [one for one, _ in able], np.array([prior for _, prior in able])
        terms = [one for one in candidates if one.term is not None]
        there = scan(replace(calibration.fit, experiment=swapped), terms, calibration.near.columns)
        log_e = _scanned_in_classes(calibration, there, candidates, log_prior).log_e
        reached.append(log_e * max(tested / sum(hours[name] for name in names), 1.0))
    return max(reached)


def _repeating(found: _Scanned, error_class: ErrorClass) -> tuple[Repeating, ...]:
    """Evidence of the scan in a class with the most probable deviation between sessions, and with a larger one."""
    here = found.in_class(error_class)
    deviations, supported = here.over.deviations, here.over.most_probable
    worse = int(np.searchsorted(deviations, WORSE * max(deviations[supported], LEAST_DEVIATION)))
    if worse >= len(deviations):
        return ()
    every = []
    for at in (supported, worse):
        parameters = found.candidates[len(here.scan.candidates) :]
        judged = replace(found, log_bayes=_log_bayes(here.scan, parameters, here.over.given[at]))
        best = judged.candidates[judged.order[0]]
        every.append(Repeating(deviation=float(deviations[at]), log_e=judged.log_e, best=best))
    return tuple(every)


def _scanned_in_classes(
    calibration: Calibration, found: Scan, candidates: Sequence[Hypothesis], log_prior: Array, factor: float = 1.0
) -> _Scanned:
    """The scan at the calibrated point with model error of all classes, their amplitudes scaled."""
    fit, parameters, judged = calibration.fit, _parameters(candidates), []
    for one in calibration.classes:
        scaled = one.scaled(factor)
        here = found.in_directions(calibration.near.directions(scaled))
        over = over_sessions(here.gram, fit.experiment, range(here.further.stop))
        judged.append((scaled, here, over, float(np.log(one.prior)) + over.log_evidence))
    nothing = next(evidence for one, _, _, evidence in judged if one.name == calibration.chosen.error_class.name)
    return _best_of([
        _in_class(one, here, parameters, over, evidence - nothing, fit.experiment.healthy)
        for one, here, over, evidence in judged
    ], candidates, log_prior, parameters)  # fmt: skip


def _in_class(
    error_class: ErrorClass, found: Scan, parameters: Sequence[Hypothesis], over: OverSessions, ahead: float,
    healthy: Collection[str],
) -> _InClass:  # fmt: skip
    """Candidates in one class."""
    strengths = _strengths(found, parameters, over.given[over.most_probable])
    less = _less((*found.candidates, *parameters), error_class, healthy)
    return _InClass(error_class=error_class, ahead=ahead, scan=found, over=over,
                    log_bayes=_weighed(found, parameters, over) + ahead - less, strengths=strengths)  # fmt: skip


def _less(candidates: Sequence[Hypothesis], error_class: ErrorClass, healthy: Collection[str]) -> Array:
    """Nats less that changes over time count where they can stand in for model error: without a baseline."""
    over_time = np.array([one.how in OVER_TIME for one in candidates], dtype=bool)
    return (0.0 if healthy else error_class.over_time) * over_time


def _best_of(
    classes: Sequence[_InClass], candidates: Sequence[Hypothesis], log_prior: Array, parameters: Sequence[Hypothesis]
) -> _Scanned:
    """Every candidate in the class that suits it best."""
    known = {one.label: value for one, value in zip(candidates, log_prior.tolist(), strict=True)}
    every = (*classes[0].scan.candidates, *parameters)
    table = np.stack([one.log_bayes for one in classes])
    return _Scanned(
        candidates=every, log_prior=np.array([known[one.label] for one in every]), log_bayes=table.max(axis=0),
        classes=tuple(classes), best=tuple(classes[at] for at in table.argmax(axis=0).tolist()),
    )  # fmt: skip


def _parameters(candidates: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Parameters outside their priors."""
    return [one for one in candidates if one.unknown is not None]


def _strengths(found: Scan, parameters: Sequence[Hypothesis], given: Given) -> Strengths:
    """Of every term in its best shape, then of every parameter outside its prior, in prior standard deviations."""
    terms = found.singles(given)
    wider = np.sqrt(rule().wider ** 2 - 1.0)
    further = given.singles([one.unknown for one in parameters if one.unknown is not None], wider)
    return Strengths(**{name: np.concatenate([getattr(terms, name), getattr(further, name)])
                        for name in ("log_bayes", "value", "sd")})  # fmt: skip


def _weighed(found: Scan, parameters: Sequence[Hypothesis], over: OverSessions) -> Array:
    """Log Bayes factors of all candidates, over variants and deviations between sessions."""
    return over.weighed([_log_bayes(found, parameters, given) for given in over.given])


def _log_bayes(found: Scan, parameters: Sequence[Hypothesis], given: Given) -> Array:
    """Log Bayes factors of all candidates, over variants."""
    best = np.array(_strengths(found, parameters, given).log_bayes)
    best[: len(found.candidates)] -= found.spread
    return best


def _raced(calibration: Calibration, found: _Scanned, progress: Progress) -> dict[str, Judged]:
    """The best candidates after a few steps of a fit, the best of these after a whole one, by label."""
    judged: dict[str, Judged] = {}
    racing = _worth_a_fit(found)
    for step, index in enumerate(racing):
        label = found.candidates[index].label
        progress(f"fitting {label}", step, len(racing))
        start = calibration.in_class(found.best[index].error_class).fit
        judged[label] = _refitted(calibration, start, found, index, RACE_STEPS)
    ahead = sorted(judged.values(), key=_weight, reverse=True)[:REFITTED]
    for step, one in enumerate(ahead):
        progress(f"fitting {one.label} to the end", step, len(ahead))
        if one.fit is not None:
            judged[one.label] = _fitted_on(calibration, one)
    return judged


def _worth_a_fit(found: _Scanned) -> list[int]:
    """Places of the best candidates by name, with a second place where it is near."""
    of_name: dict[str, list[int]] = {}
    for index in found.order:
        mine = of_name.setdefault(found.candidates[index].name, [])
        if not mine and len(of_name) > RACED:
            break
        if not mine or (len(mine) < PLACES and found.log_bayes[mine[0]] - found.log_bayes[index] < NEAR_PLACE):
            mine.append(index)
    worth = max(WORTH, WORTH_SHARE * float(found.log_bayes.max(initial=0.0)))
    every = [index for mine in list(of_name.values())[:RACED] for index in mine]
    return [index for index in every if found.log_bayes[index] > worth]


def _refitted(calibration: Calibration, fit: Fit, found: _Scanned, index: int, iterations: int) -> Judged:
    """A candidate fitted together with everything else; judged by the scan if there is no solution."""
    candidate, one = found.candidates[index], _by_scan(found, index, float(found.log_bayes[index]))
    here = found.best[index]
    try:
        if candidate.unknown is not None:
            reached = _with_wider_prior(fit, candidate.unknown, iterations)
        else:
            strength = float(here.strengths.value[index])
            reached = refit(fit, candidate, here.scan.best[index], strength, further=here.scan.starts[index],
                            iterations=iterations)  # fmt: skip
    except (InputError, ArithmeticError, np.linalg.LinAlgError):
        return one
    return _judged(calibration, replace(one, fit=reached), _spread(found, index))


def _with_wider_prior(fit: Fit, index: int, iterations: int) -> Fit:
    """Everything fitted with one parameter outside its prior."""
    experiment, z = fit.experiment, fit.z.copy()
    unknowns = list(experiment.unknowns)
    unknowns[index] = replace(unknowns[index], amplitude=rule().wider)  # type: ignore[type-var]
    z[index] /= rule().wider
    wider = replace(experiment, unknowns=tuple(unknowns))
    return wider.fit(z, fit.trajectories, iterations=iterations)


def _by_scan(found: _Scanned, index: int, log_bayes: float) -> Judged:
    """A candidate in its best shape, without a fit."""
    candidate = found.candidates[index]
    variant = found.best[index].scan.best[index] if candidate.term is not None else 0
    return Judged(
        effects=(replace(candidate, variants=candidate.variants[[variant]]),), log_prior=float(found.log_prior[index]),
        log_bayes=log_bayes, error_class=found.best[index].error_class,
    )  # fmt: skip


def _fitted_on(calibration: Calibration, one: Judged) -> Judged:
    """A raced fit continued to its end."""
    fit = one.fit
    assert fit is not None  # noqa: S101
    reached, base = fit, len(calibration.fit.z)
    try:
        for _ in range(MOST_TURNS):
            further = fit.experiment.fit(reached.z, at=reached.linearised)
            gained, reached = 0.5 * (reached.objective - further.objective), further
            if gained < SETTLED_NAT:
                break
    except (InputError, ArithmeticError, np.linalg.LinAlgError):
        pass  # what was reached counts
    if reached is fit:
        return one
    gained = fit_over_sessions(reached, base).log_evidence - fit_over_sessions(fit, base).log_evidence
    final = _judged(calibration, replace(one, fit=reached), spread=0.0)
    return replace(final, log_bayes=min(final.log_bayes, one.log_bayes + gained))


def _judged(calibration: Calibration, one: Judged, spread: float) -> Judged:
    """A fitted explanation with its evidence against nothing."""
    fit = one.fit
    assert fit is not None  # noqa: S101
    at = len(calibration.fit.z)  # where the effects' unknowns begin
    log_evidence = fit_over_sessions(fit, at).log_evidence + float(np.log(one.error_class.prior))
    log_bayes = log_evidence - calibration.chosen.log_evidence - spread
    log_bayes -= float(_less(one.effects, one.error_class, fit.experiment.healthy).sum())
    for effect in one.effects:
        if effect.term is None:
            continue  # a parameter is not further
        z = float(fit.z[at])
        if effect.term.form == "swapped" and abs(fit.experiment.unknowns[at].value(z) - 1.0) > WHOLE:
            log_bayes = IMPOSSIBLE  # a share of a swap is no fault of an instrument
        if effect.sign:  # only the half of the normal distribution with this sign is possible, with twice the prior
            log_bayes += float(np.log(2.0) + log_ndtr(effect.sign * z / np.sqrt(fit.covariance[at, at])))
        at += len(effect.term.parameters)
    return replace(one, log_bayes=log_bayes)


def _spread(found: _Scanned, index: int) -> float:
    """Nats that the best course over the hours is ahead of the mean over all; other shapes are fitted."""
    if found.candidates[index].how != "W":
        return 0.0
    return float(found.best[index].scan.spread[index])


def _weight(one: Judged) -> float:
    """Evidence and prior of an explanation, [nat]."""
    return one.log_bayes + one.log_prior


def _pairs(calibration: Calibration, best: Judged, second: _Scanned) -> list[Judged]:
    """The best explanation with the best second effects, fitted."""
    fit, pairs = best.fit, []
    assert fit is not None  # noqa: S101
    for index in second.order[:SECONDS]:
        one = _refitted(calibration, fit, second, index, RACE_STEPS + 2)
        if one.fit is None:
            continue
        both = replace(one, effects=(*best.effects, *one.effects), log_prior=best.log_prior + one.log_prior)
        both = _judged(calibration, both, _spread(second, index))
        pairs.append(_fitted_on(calibration, both))
    return pairs


def _alone(calibration: Calibration, best: Judged, second: _Scanned, ahead: float) -> dict[str, float]:
    """Log Bayes factors of all other candidates against nothing, by the scan at the best explanation, without it."""
    fit, found = best.fit, second.classes[0].scan
    assert fit is not None  # noqa: S101
    without = over_sessions(found.gram, fit.experiment, [*range(len(calibration.fit.z)), *found.further])
    log_bayes = _weighed(found, _parameters(second.candidates), without) + ahead
    log_bayes -= _less(second.candidates, best.error_class, fit.experiment.healthy)
    return dict(zip((one.label for one in second.candidates), log_bayes.tolist(), strict=True))


def _scanned_given(
    calibration: Calibration, given: Judged, candidates: Sequence[Hypothesis], log_prior: Array
) -> _Scanned:
    """All others scanned at the fit of an explanation, against that explanation, with model error of its class."""
    fit, mine = given.fit, {effect.label for effect in given.effects}
    assert fit is not None  # noqa: S101
    left = [index for index, one in enumerate(candidates) if one.label not in mine]
    others = [candidates[index] for index in left]
    found, parameters = scan(fit, [one for one in others if one.term is not None]), _parameters(others)
    base = len(calibration.fit.z)
    over = over_sessions(found.gram, fit.experiment, [*range(base), *found.further], range(base, len(fit.z)))
    here = _in_class(given.error_class, found, parameters, over, 0.0, fit.experiment.healthy)
    return _best_of([here], others, log_prior[left], parameters)


def _nothing_gains(calibration: Calibration, best: Judged) -> float:
    """Nats by which nothing does better from the point and in the class of the best explanation, at least 0.

    The calibration may have ended in another basin, and its classes are compared by straight lines.
    """
    assert best.fit is not None  # noqa: S101
    fit, known = best.fit, calibration.in_class(best.error_class)
    found = [calibration.chosen.log_evidence, known.log_evidence]
    try:
        count = len(calibration.fit.z)
        alone = known.fit.experiment.fit(fit.z[:count], fit.trajectories)
        found.append(fit_over_sessions(alone, count).log_evidence + float(np.log(best.error_class.prior)))
    except (InputError, ArithmeticError, np.linalg.LinAlgError):
        pass  # what is known counts
    return max(found) - calibration.chosen.log_evidence


def _unknown(calibration: Calibration, error_class: ErrorClass, outside: Sequence[Hypothesis]) -> list[Judged]:
    """Heats that no catalogue has, all functions of each marginalised."""
    names, here = Counter(one.name for one in outside), calibration.in_class(error_class)
    ahead = here.log_evidence - calibration.chosen.log_evidence
    return [
        Judged(effects=(one.hypothesis,), log_prior=-float(np.log(names[one.hypothesis.name])),
               log_bayes=one.log_bayes + ahead, error_class=error_class)
        for one in judge_outside(here.fit, outside)
    ]  # fmt: skip


def _with_scaled_error(
    calibration: Calibration,
    found: Scan,
    candidates: Sequence[Hypothesis],
    log_prior: Array,
    factor: float,
    rate: float,
    placebo: float,
) -> ScaledError:
    """Evidence of the scan if all model error were larger or smaller than assumed."""
    there = _scanned_in_classes(calibration, found, candidates, log_prior, factor)
    nothing = max(there.classes, key=lambda one: one.ahead)
    there = replace(there, log_bayes=there.log_bayes - nothing.ahead)
    best = there.order[0]
    threshold = max(rule().threshold(nothing.error_class, there.best[best].error_class, rate), placebo)
    return ScaledError(factor=factor, log_e=there.log_e, threshold=threshold, best=there.candidates[best])


def _likeness(found: _Scanned, error_class: ErrorClass) -> Likeness:
    """How much alike candidates look in these readings, each in its best shape, with model error of one class."""
    here = found.in_class(error_class)
    given = here.over.given[here.over.most_probable]
    unknown = [one.unknown for one in found.candidates if one.unknown is not None]
    at = np.array([*here.scan.of_candidates, *unknown], dtype=int) + 1
    inner = given.matrix[np.ix_(at, at)]
    norm = np.sqrt(np.maximum(np.diag(inner), 1e-12))
    return Likeness(labels=tuple(one.label for one in found.candidates), cosines=np.abs(inner / norm / norm[:, None]))


def _expected(found: _InClass, settings: Settings) -> tuple[Expected, ...]:
    """Expected evidence of every candidate at the size that matters: of a temperature or a heat, whichever is less."""
    given, terms = found.over.given[found.over.most_probable], found.scan
    at = np.array(terms.of_candidates) + 1
    b = np.maximum(given.matrix[at, at], 0.0)
    sd, size = terms.sd, np.full(len(b), np.inf)
    for matters, peak in ((settings.matters_K, terms.peak_K), (settings.matters_W, terms.peak_W)):
        reached = (peak > 0.0) & (matters > 0.0)
        size[reached] = np.minimum(size[reached], matters / peak[reached])
    size = np.where(np.isfinite(size), size, sd)
    log_bayes = 0.5 * np.square(b * size) / (b + 1.0 / np.square(sd)) - 0.5 * np.log1p(b * np.square(sd))
    return tuple(Expected(effect=one, log_bayes=float(value))
                 for one, value in zip(terms.candidates, log_bayes, strict=True))  # fmt: skip
