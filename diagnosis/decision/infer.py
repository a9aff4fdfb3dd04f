"""From an experiment and its candidates to a posterior: scan, race, refit, second scan, third scan.

The scan is linear and judges everything. A race of a few Gauss-Newton steps corrects it for the best names; the best of
them are fitted to the end, model error in place. Where the calibration went far from the priors, as it does to stand in
for a large effect, there is a scan and a race from their middles too. A second scan given the best explanation looks
for a second effect. Where there are baselines a third one, given the best two, looks for what they leave; without, two
effects and model error are too much alike.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.special import log_ndtr

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.answer import WEIGHT
from diagnosis.decision.placebo import CandidatesIn, judge_baselines
from diagnosis.decision.posterior import Assumed, Judged, Posterior
from diagnosis.decision.scanned import (
    WHOLE,
    Scanned,
    as_fits_show,
    counts_less,
    expected_of,
    judge_alone,
    likeness_of,
    log_sum,
    repeating_of,
    scan_given,
    scan_in_classes,
    with_scaled_error,
)
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.fit import NO_SOLUTION, Fit
from diagnosis.engine.learnt import ErrorClass, rule
from diagnosis.engine.outside import judge_outside
from diagnosis.engine.refit import refit
from diagnosis.engine.scan import Scan, scan
from diagnosis.engine.sessions import fit_over_sessions
from diagnosis.engine.switch_grid import held_numbers, switch_numbers, with_refined_switches
from models.base.progress import Progress, silent

StartOf = Callable[[ErrorClass], Fit]  # where fits with model error of a class begin
RACED, PLACES, RACE_STEPS = 18, 2, 4
NEAR_PLACE = 3.0  # nats behind the best place of its name, up to which a second place is raced
REFITTED, SECONDS = 6, 2
SETTLED_NAT, MOST_TURNS = 0.1, 5  # gain at which a fit has ended; how often it goes on at most
IMPOSSIBLE = -1e3  # nats
FAR_BETTER = 10.0  # nats, from which the calibration was in the wrong basin
SCALED = (0.5, 1.0, 2.0)  # of the amplitudes of model error: what the scan says with each
WORTH, WORTH_SHARE = 1.0, 0.1  # nats, and share of the best, from which a candidate is worth a fit


def infer(
    calibration: Calibration, found: Scan, settings: Settings, *,
    outside: Sequence[Hypothesis] = (), candidates_in: CandidatesIn = lambda _: (), rival: float = -np.inf,
    progress: Progress = silent,
) -> Posterior:  # fmt: skip
    """Weigh all explanations.

    Parameters
    ----------
    found : Scan
        Of all candidates at the calibrated point, with their priors
    outside : sequence of Hypothesis
        Unknown heats, judged where something is missing
    candidates_in : callable
        Gives the candidates of an experiment in which a baseline is tested
    rival : float
        Log evidence of the machine without an effect in other random heat, which an effect has to exceed too
    progress : callable
        Told what is being done
    """
    base, chosen = calibration.fit, calibration.chosen
    if base.experiment.healthy:
        progress("judging the baselines as if they were tested")
    placebo, candidates = judge_baselines(calibration, found.candidates, candidates_in)
    found = replace(found, candidates=candidates)
    first = as_fits_show(calibration, scan_in_classes(calibration, found))
    starts: list[tuple[Scanned, StartOf]] = [(first, lambda one: calibration.in_class(one).fit)]
    if calibration.is_far:
        progress("scanning from the middles of the priors too")
        with suppress(*NO_SOLUTION):
            middles = scan(calibration.at_middles(chosen.error_class), candidates, calibration.near.columns)
            starts.append((scan_in_classes(calibration, middles), calibration.at_middles))
    judged = _raced(calibration, starts, progress)
    alone = {one.label: float(value) for one, value in zip(first.candidates, first.log_bayes, strict=True)}
    gained, pairs, elsewhere = 0.0, list[Judged](), None
    best = max(judged.values(), key=WEIGHT, default=None)
    error_class = chosen.error_class if best is None else best.error_class
    detection, of_class = rule().thresholds(chosen.error_class, error_class, settings.false_alarm_rate)
    least = -np.inf if placebo is None else placebo.log_e_value
    if best is not None and best.fit is not None and best.log_bayes > 0.0:
        progress(f"scanning again, given {best.label}")
        second = scan_given(calibration, best, candidates)
        judged[best.label] = replace(best, left=second.most)
        pairs = sorted(_pairs(calibration, best, second), key=WEIGHT, reverse=True)
        if pairs and second.most > of_class and base.experiment.healthy:
            progress(f"scanning once more, given {pairs[0].label}")
            pairs[0] = replace(pairs[0], left=scan_given(calibration, pairs[0], candidates).most)
        if not best.of_parameters:  # else the wider prior would stay in what is called nothing
            there = judge_alone(calibration, best, second, first.in_class(best.error_class).ahead)
            alone |= {label: min(alone[label], value) for label, value in there.items()}
        progress("fitting the machine without an effect from there")
        gained, elsewhere = _nothing_gains(calibration, best)
    judged |= _left_to_the_scan(judged, first, alone)
    every = (*judged.values(), *pairs)
    parameters = [one.weight for one in every if one.of_parameters]
    effects = [one.weight for one in every if sum(effect.term is not None for effect in one.effects) == 1]
    ahead = max(rival - calibration.chosen.log_evidence - gained, 0.0)
    log_e = log_sum(effects) - log_sum([gained + ahead, *parameters])
    threshold = max(detection, least)
    missing = log_e > threshold
    unknown = _unknown(calibration, error_class, outside) if missing else []
    return Posterior(
        nothing=Judged(effects=(), log_bayes=0.0, error_class=chosen.error_class, fit=base),
        judged=tuple(replace(one, log_bayes=one.log_bayes - gained) for one in (*every, *unknown)),
        log_e=log_e,
        log_parameter=log_sum(parameters) - gained - ahead,
        threshold=threshold,
        class_threshold=of_class,
        rule=rule(),
        likeness=likeness_of(first, error_class),
        settings=settings,
        assumed=Assumed(
            error_class=(error_class if missing else chosen.error_class).name,
            error_evidence=dict(calibration.evidence),
            scaled_error=tuple(
                with_scaled_error(calibration, found, factor, first, settings.false_alarm_rate, least)
                for factor in (SCALED if calibration.assumes_error else ())
            ),
            session_s=chosen.session_s,
            repeating=repeating_of(first, error_class),
            placebo=placebo,
            draughts_ahead=ahead,
        ),
        expected=expected_of(first, chosen.error_class, settings),
        # Where channels were set apart the others chose the basin: a broken one is not to draw the machine elsewhere.
        elsewhere=elsewhere if gained > FAR_BETTER and calibration.of_others is None else None,
    )


def _left_to_the_scan(
    judged: Mapping[str, Judged], first: Scanned, alone: Mapping[str, float]
) -> dict[str, Judged]:  # fmt: skip
    """Candidates without a fit: evidence that a fit takes from a law at one place is not left at the others either."""
    taken: dict[str, float] = {}
    for one, scanned in zip(first.candidates, first.log_bayes.tolist(), strict=True):
        here = judged.get(one.label)
        if here is not None and here.fit is not None and one.how == "always":
            taken[one.law] = min(taken.get(one.law, np.inf), max(scanned - here.log_bayes, 0.0))
    return {
        one.label: _by_scan(first, index, alone[one.label] - (taken.get(one.law, 0.0) if one.how == "always" else 0.0))
        for index, one in enumerate(first.candidates) if one.label not in judged or judged[one.label].fit is None
    }  # fmt: skip


def _raced(
    calibration: Calibration, starts: Sequence[tuple[Scanned, StartOf]], progress: Progress
) -> dict[str, Judged]:
    """The best candidates after a few steps of a fit, the best of these after a whole one, by label.

    A machine that was calibrated without a large effect may be far from the one with it, so fits may begin at several
    points, each with its scan.
    """
    judged: dict[str, Judged] = {}
    racing = [(found, index, start_of) for found, start_of in starts for index in _worth_a_fit(found)]
    for step, (found, index, start_of) in enumerate(racing):
        label = found.candidates[index].label
        progress(f"fitting {label}", step, len(racing))
        one = _refitted(start_of(found.best[index].error_class), found, index, RACE_STEPS)
        one = one if one.fit is None else _judged(calibration, one, _spread(found, index))
        judged[label] = max(judged.get(label, one), one, key=lambda one: (one.fit is not None, one.weight))
    ahead = sorted(judged.values(), key=WEIGHT, reverse=True)[:REFITTED]
    able = [one for one in ahead if one.weight > 0.0] or ahead[:1]  # to others a few nats more change nothing
    for step, one in enumerate(able):
        progress(f"fitting {one.label} to the end", step, len(able))
        if one.fit is not None:
            judged[one.label] = _fitted_on(calibration, one)
    best = max((judged[one.label] for one in ahead), key=WEIGHT, default=None)
    if best is not None and best.fit is not None and best.effects[0].has_course:
        progress(f"fitting what may have begun instead of {best.label}")
        for one in (judged[one.label] for one in ahead):
            first = one.effects[0]
            if one.fit and one is not best and first.has_course and first.ending == best.effects[0].ending:
                judged[one.label] = max(one, _with_course_of(calibration, best, one), key=WEIGHT)
    return judged


def _with_course_of(calibration: Calibration, best: Judged, one: Judged) -> Judged:
    """A change that is fitted once more from the course of the best one: dates and durations have several optima."""
    first = len(calibration.fit.z)
    of_best, own = (
        [unknown.value(z) for unknown, z in zip(fit.experiment.unknowns[first:], fit.z[first:].tolist(), strict=True)]
        for fit in (best.fitted, one.fitted)
    )
    shape = np.array([[1.0, *own[1:-3], *of_best[-3:-1], own[-1]]])  # last are date, duration and clock
    start = calibration.in_class(one.error_class).fit
    try:
        reached = refit(start, replace(one.effects[0], variants=shape), 0, own[0], iterations=RACE_STEPS)
    except NO_SOLUTION:
        return one
    return _fitted_on(calibration, _judged(calibration, replace(one, fit=reached), spread=0.0))


def _worth_a_fit(found: Scanned) -> list[int]:
    """Places of the best candidates by name, with a second place where it is near, and of every control that switches.

    A straight line from a machine without it, calibrated far off, does not see a control that switches.
    """
    of_name: dict[str, list[int]] = {}
    for index in found.order:
        mine = of_name.setdefault(found.candidates[index].name, [])
        if not mine and len(of_name) > RACED:
            break
        if not mine or (len(mine) < PLACES and found.log_bayes[mine[0]] - found.log_bayes[index] < NEAR_PLACE):
            mine.append(index)
    worth = max(WORTH, WORTH_SHARE * float(found.log_bayes.max(initial=0.0)))
    every = [index for mine in list(of_name.values())[:RACED] for index in mine]
    controls: dict[str, int] = {}
    for index in found.order:
        one = found.candidates[index]
        if one.how == "always" and one.term is not None and switch_numbers(one.term):
            controls.setdefault(one.name, index)
    return list(dict.fromkeys([*(index for index in every if found.log_bayes[index] > worth), *controls.values()]))


def _refitted(fit: Fit, found: Scanned, index: int, iterations: int) -> Judged:
    """A candidate, judged by the scan, with its fit together with everything else if that has a solution."""
    candidate, one = found.candidates[index], _by_scan(found, index, float(found.log_bayes[index]))
    here = found.best[index]
    try:
        if candidate.unknown is not None:
            reached = _with_wider_prior(fit, candidate.unknown, iterations)
        else:
            strength = float(here.strengths.value[index])
            reached = refit(fit, candidate, here.scan.best[index], strength, further=here.scan.starts[index],
                            iterations=iterations)  # fmt: skip
    except NO_SOLUTION:
        return one
    return replace(one, fit=reached)


def _with_wider_prior(fit: Fit, index: int, iterations: int) -> Fit:
    """Everything fitted with one parameter outside its prior."""
    experiment, z = fit.experiment, fit.z.copy()
    unknowns, prior = list(experiment.unknowns), experiment.unknowns[index].parameter
    unknowns[index] = replace(unknowns[index], parameter=replace(prior, sd=rule().wider * prior.sd))
    z[index] /= rule().wider
    wider = replace(experiment, unknowns=tuple(unknowns))
    return wider.fit(z, fit.trajectories, iterations=iterations)


def _by_scan(found: Scanned, index: int, log_bayes: float) -> Judged:
    """A candidate in its best shape, without a fit."""
    candidate = found.candidates[index]
    variant = found.best[index].scan.best[index]
    return Judged(
        effects=(replace(candidate, variants=candidate.variants[[variant]]),), log_bayes=log_bayes,
        error_class=found.best[index].error_class,
    )  # fmt: skip


def _fitted_on(calibration: Calibration, one: Judged) -> Judged:
    """A raced fit continued to its end."""
    fit = one.fitted
    reached, base = fit, len(calibration.fit.z)
    held = held_numbers(fit.experiment, one.effects, base)
    try:
        for _ in range(MOST_TURNS):
            before, reached = reached, fit.experiment.fit(reached.z, at=reached.linearised, held=held)
            if before.objective - reached.objective < 2.0 * SETTLED_NAT:
                reached = with_refined_switches(reached, one.effects, base)
            if before.objective - reached.objective < 2.0 * SETTLED_NAT:
                break
        if held:  # between two points of the grid
            free = fit.experiment.fit(reached.z, at=reached.linearised)
            reached = min(reached, free, key=lambda one: one.objective)
    except NO_SOLUTION:
        pass  # what was reached counts
    if reached is fit:
        return one
    gained = fit_over_sessions(reached, base).log_evidence - fit_over_sessions(fit, base).log_evidence
    final = _judged(calibration, replace(one, fit=reached), spread=0.0)
    return replace(final, log_bayes=min(final.log_bayes, one.log_bayes + gained))


def _judged(calibration: Calibration, one: Judged, spread: float) -> Judged:
    """A fitted explanation with its evidence against nothing."""
    fit = one.fitted
    at = len(calibration.fit.z)  # where the effects' unknowns begin
    log_evidence = fit_over_sessions(fit, at).log_evidence + float(np.log(one.error_class.prior))
    log_bayes = log_evidence - calibration.chosen.log_evidence - spread
    log_bayes -= float(counts_less(one.effects, calibration.chosen.error_class, one.error_class).sum())
    for effect in one.effects:
        if effect.term is None:
            continue  # a parameter is not further
        z = float(fit.z[at])
        least, most = WHOLE.get(effect.term.form or "", (-np.inf, np.inf))
        if not least <= fit.experiment.unknowns[at].value(z) <= most:
            log_bayes = IMPOSSIBLE  # a share of a swap, or of a held reading, is no fault of an instrument
        if effect.sign:  # only the half of the normal distribution with this sign is possible, with twice the prior
            log_bayes += float(np.log(2.0) + log_ndtr(effect.sign * z / np.sqrt(fit.covariance[at, at])))
        at += len(effect.term.parameters)
    return replace(one, log_bayes=log_bayes)


def _spread(found: Scanned, index: int) -> float:
    """Nats that the best course over the hours is ahead of the mean over all; other shapes are fitted."""
    if found.candidates[index].how != "over_hours":
        return 0.0
    return float(found.best[index].scan.spread[index])


def _pairs(calibration: Calibration, best: Judged, second: Scanned) -> list[Judged]:
    """The best explanation with the best second effects of other names, fitted."""
    pairs = []
    others = [index for index in second.order if second.candidates[index].law not in best.names]
    for index in others[:SECONDS]:
        one = _refitted(best.fitted, second, index, RACE_STEPS + 2)
        if one.fit is None:
            continue
        both = replace(one, effects=(*best.effects, *one.effects))
        both = _judged(calibration, both, _spread(second, index))
        pairs.append(_fitted_on(calibration, both))
    return pairs


def _nothing_gains(calibration: Calibration, best: Judged) -> tuple[float, Fit | None]:
    """Nats by which nothing does better from the point and in the class of the best explanation, at least 0; its fit.

    The calibration may have ended in another basin, and its classes are compared by straight lines.
    """
    fit, known = best.fitted, calibration.in_class(best.error_class)
    found, alone = max(calibration.chosen.log_evidence, known.log_evidence), None
    try:
        there = known.fit.experiment.fit(fit.z_in(known.fit.experiment), fit.trajectories)
        reached = fit_over_sessions(there, len(there.z)).log_evidence + float(np.log(best.error_class.prior))
        if reached > found:
            found, alone = reached, there
    except NO_SOLUTION:
        pass  # what is known counts
    return found - calibration.chosen.log_evidence, alone


def _unknown(calibration: Calibration, error_class: ErrorClass, outside: Sequence[Hypothesis]) -> list[Judged]:
    """Heats that no catalogue has, all functions of each marginalised."""
    names, here = Counter(one.name for one in outside), calibration.in_class(error_class)
    ahead = here.log_evidence - calibration.chosen.log_evidence
    return [
        Judged(effects=(replace(heat, log_prior=-float(np.log(names[heat.name]))),), log_bayes=log_bayes + ahead,
               error_class=error_class)
        for heat, log_bayes in judge_outside(here.fit, outside)
    ]  # fmt: skip
