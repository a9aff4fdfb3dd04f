"""The search: is anything missing, what is it, is anything else.

Step by step: scan everything, fit the best few in earnest, keep the best if the data want it and the held-out
recordings do not object; drop what is no longer needed beside it; look again at what remains. The structural floor
follows the explanation, see :func:`diagnosis.setup.inference_setup.floored`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.candidates.explain import (
    Explanation,
    best_fits,
    distorted,
    evidence_of,
    in_the_middle,
    linearised,
    without,
)
from diagnosis.candidates.hypotheses import (
    Hypothesis,
    Scored,
    hypothesis_of,
    parameter_hypotheses,
    scan,
    sharpened,
    two_point_columns,
)
from diagnosis.decision.acceptance import SECOND_GAIN, holds_out, judged
from diagnosis.decision.beside import Found, settled_beside
from diagnosis.decision.holdout import Judge
from diagnosis.decision.stage import OPEN_PENALTY, Stage, log_e_value, penalised
from diagnosis.inference.evidence import Marginal
from diagnosis.setup.inference_setup import InferenceSetup, first, floored
from models.base.parallel import run_parallel, starting_processes
from models.mechanisms import OPEN_FORMS, Mechanism
from models.quantities.quantities import TOTAL_LOSS

# Set on development cases (seed 1 of `conceal`) and by the four open ones, what is about open forms and the calibration
# on opened proofs (seeds 2033 and 2034); a proof draws others.
THRESHOLD = 5.0  # log e-value at a false-alarm rate of 5 %
# An open form alone, where the catalogue sees nothing, has this taken off: consistent recordings leave up to 14 nats,
# since formulas are a little wrong. It is more than the logarithm of how many forms there are, so an e-value stays one.
OPEN_ALONE = 25.0
# Best hypotheses and best open forms whose shapes are sought between the grid, from this score on.
SHARPENED, SHARPENED_FORMS, SHARPEN_FROM = 15, 4, 2.0
FITTED, WORTH = 5, 0.12  # hypotheses that are fitted in earnest, and the share of the best score that they need
MOST_FITTED, NEAR = 12, 0.6  # where more of them score about as well as the best: the scan is only linear
# So strong a first effect bends so much that what is best in a straight line may be far from best: other names from
# this share of the best score are fitted as well.
STRONG, WORTH_OF_STRONG = 200.0, 0.04
# What was nearly as likely as what was accepted may be right beside a further effect: so many are seen, from this share
# of its probability.
OTHERS, LIKELY = 2, 0.1
BETTER = 3.0  # log evidence of a calibration that replaces another one
FORM_REST = 0.25  # of the log evidence of an open form
FORM_DOUBT = 0.3  # that a further effect is only what the form of the one before lacks
MOST_EFFECTS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """All that the search found.

    Attributes
    ----------
    calibrated, final : Explanation
    stages : tuple of Stage
        The last one found nothing more, unless the search ended at its greatest number of effects
    findings : tuple of (Hypothesis, Stage)
        What is left of what was found, each ranked beside all the others; what hardly matters comes last
    threshold : float
        Log e-value that the first stage had to reach
    judge : Judge
        What the held-out recordings say of the final explanation
    """

    calibrated: Explanation
    final: Explanation
    stages: tuple[Stage, ...]
    findings: tuple[Found, ...]
    threshold: float
    judge: Judge

    @property
    def detected(self) -> bool:
        """Whether anything is amiss that matters: found, or sought in vain."""
        return any(stage.matters for stage in self.stages)


def threshold_at(false_alarm_rate: float) -> float:
    """Log e-value that consistent recordings exceed with this probability at most.

    An e-value exceeds 1/alpha with probability alpha at most (Markov), if the model is true. The threshold at 5 % lies
    higher, as a margin for formulas that are not exactly the gearbox's; which rate that gives the proof measures.
    """
    return THRESHOLD + float(np.log(0.05 / false_alarm_rate))


def candidates_of(case: InferenceSetup, catalogue: Mapping[str, Mechanism]) -> tuple[Hypothesis, ...]:
    """Every mechanism and every open form at each of its places."""
    forms = [form for form in OPEN_FORMS if TOTAL_LOSS in case.channels or not form.is_loss]
    return tuple(
        hypothesis_of(placed)
        for mechanism in (*catalogue.values(), *forms)
        for placed in mechanism.placed(case.train.model.network, case.scale, case.channels)
    )


def hypotheses_of(candidates: Sequence[Hypothesis], explanation: Explanation) -> list[Hypothesis]:
    """Everything that may be added to an explanation: what it lacks of the candidates, and parameters."""
    taken = set(explanation.labels)
    found = list(candidates)
    own = {p.name for h in explanation.found if h.term is not None for p in h.term.parameters}
    found += [h for h in parameter_hypotheses(explanation.problem) if h.place not in own]
    return [h for h in found if h.label not in taken]


def search(
    case: InferenceSetup, catalogue: Mapping[str, Mechanism], *, false_alarm_rate: float = 0.05, jobs: int = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> Search:  # fmt: skip
    """Look for effects one after another.

    Parameters
    ----------
    case : InferenceSetup
    catalogue : mapping of str to Mechanism
    false_alarm_rate : float
    jobs : int
        Processes
    progress : callable
        Told what is being done
    """
    progress("calibrating the model inside its priors")
    with starting_processes(jobs, __name__):
        start = base = first(case)
    threshold = threshold_at(false_alarm_rate)
    candidates = candidates_of(case, catalogue)
    stages: list[Stage] = []
    others: list[Explanation] = []
    for look in range(MOST_EFFECTS):
        progress("scoring everything that may be missing" if not look else "looking for a further effect")
        needed = max([SECOND_GAIN, *_rests_of_forms(stages)]) if look else threshold
        judge = Judge(case, base)
        stage = _look(judge, start, candidates, needed, jobs, progress, others)
        if not look and (better := _recalibrated(judge, stage)) is not None:
            start = base = floored(better)
            judge = Judge(case, base)
            stage = _look(judge, start, candidates, needed, jobs, progress, others)
        if stage.accepted is None and stages and stages[-1].tentative:
            alone = stages.pop()
            stage = alone.otherwise or replace(alone, accepted=None, tentative=False)
            base = start
            judge = Judge(case, base)
        stages.append(stage)
        if stage.accepted is None:
            break
        stages = _reconsidered(stages, base)
        if stage.tentative:
            base = stage.accepted
            others = _others(base, stage)
            continue
        slim = _needed_of(judge, start, stage.accepted)
        base = floored(slim)
        if base is not slim and not holds_out(judge, start, base):
            base = slim  # fitted anew with another floor it went astray
        others = _others(base, stage)
    if not any(stage.matters for stage in stages):
        base = start  # what is too small to matter is not told; so nothing else may hang on it
    if judge.base is not base:
        judge = Judge(case, base)
    progress("comparing what was found once more")
    judge, found = settled_beside(judge, start, _left(base, stages), jobs=jobs)
    return Search(calibrated=start, final=judge.base, stages=tuple(stages), findings=tuple(found), threshold=threshold,
                  judge=judge)  # fmt: skip


def _left(final: Explanation, stages: Sequence[Stage]) -> list[Found]:
    """What is left of what was found, with the look that found it; what hardly matters comes last."""
    by = {stage.accepted.found[-1].label: stage for stage in stages if stage.accepted is not None}
    return sorted(((h, by[h.label]) for h in final.found), key=lambda pair: not pair[1].matters)


def _rests_of_forms(stages: Sequence[Stage]) -> list[float]:
    """What every open form that was accepted may leave unexplained: a form is not the law, its rest no effect."""
    found = [stage for stage in stages if stage.accepted is not None and stage.accepted.found[-1].is_open]
    return [FORM_REST * max(stage.gains) for stage in found]


def _recalibrated(judge: Judge, stage: Stage) -> Explanation | None:
    """The calibration once more, from where the best fit of the first look left it, if that is better; else None.

    From a false optimum anything looks as if it were missing that leads out of it.
    """
    base = judge.base
    if not stage.fits or not distorted(base) or base.problem.slow:  # weeks under wide priors have no one optimum
        return None
    best = linearised(max(stage.fits, key=lambda fit: fit.log_evidence))
    if best is None:
        return None
    try:
        again = without(base, best, 0)
    except ArithmeticError:
        return None
    better = again.log_evidence > base.log_evidence + BETTER and holds_out(judge, base, again)
    return again if better else None


def _others(base: Explanation, stage: Stage) -> list[Explanation]:
    """What was nearly as likely as what a look accepted, judged by the same noise as the base that came of it."""
    accepted = stage.accepted
    if accepted is None or base.labels != accepted.labels:
        return []
    probability = {fit.found[-1].label: p for fit, p in zip(stage.fits, stage.probabilities(), strict=True)}
    likely = LIKELY * probability[accepted.found[-1].label]
    found = []
    for fit in stage.fits:
        last = fit.found[-1]
        if last.label == accepted.found[-1].label or last.is_open or probability[last.label] < likely:
            continue
        if fit.labels[:-1] != accepted.labels[:-1]:
            continue  # found beside something else than the base has: no rival of it
        problem = fit.problem.changed(floor=base.problem.floor, whitenings=base.problem.whitenings)
        same = fit.problem.whitenings is base.problem.whitenings
        try:
            again = problem.fit(fit.fit.z, fit.fit.courses, iterations=0 if same else 2)
        except ArithmeticError:
            continue
        found.append(replace(fit, problem=problem, fit=again, log_evidence=evidence_of(fit.found, again)))
    return found[:OTHERS]


def _reconsidered(stages: Sequence[Stage], base: Explanation) -> list[Stage]:
    """The looks, where the last one accepted its effect beside another one than the base has: that one stands then."""
    *before, last = stages
    assert last.accepted is not None  # noqa: S101 - the caller looked
    now = last.accepted.labels[:-1]
    gone, come = set(base.labels) - set(now), set(now) - set(base.labels)
    if len(gone) != 1 or len(come) != 1:
        return list(stages)
    beside_base = [fit.log_evidence for fit in last.fits if fit.labels[:-1] == base.labels]
    ahead = last.accepted.log_evidence - max([base.log_evidence, *beside_base])
    for index, stage in enumerate(before):
        labels = [fit.found[-1].label for fit in stage.fits]
        if stage.accepted is not None and stage.accepted.found[-1].label in gone and come <= set(labels):
            mine, old = (labels.index(next(iter(which))) for which in (come, gone))
            gains = list(stage.gains)
            gains[mine] = gains[old] + ahead
            before[index] = replace(stage, gains=tuple(gains), accepted=stage.fits[mine]).ranked()
    return [*before, last]


def _needed_of(judge: Judge, calibrated: Explanation, accepted: Explanation) -> Explanation:
    """What was accepted, without anything found earlier that is not needed beside it."""
    for index in reversed(range(len(accepted.found) - 1)):
        try:
            slim = without(calibrated, accepted, index)
        except ArithmeticError:
            continue
        if accepted.log_evidence - slim.log_evidence < SECOND_GAIN and holds_out(judge, calibrated, slim):
            accepted = slim
    return accepted


def _look(
    judge: Judge, calibrated: Explanation, candidates: Sequence[Hypothesis], needed: float, jobs: int,
    progress: Callable[[str], None], others: Sequence[Explanation],
) -> Stage:  # fmt: skip
    """Look for one more effect than the judge's base has; it may be found beside one of `others` instead."""
    base = judge.base
    real, opened = _scanned(base, hypotheses_of(candidates, base), jobs)
    scored = sorted([*real, *opened], key=lambda s: -s.log_bayes)
    log_e = max(log_e_value(real), opened[0].log_bayes - OPEN_ALONE)
    if log_e < needed:
        return Stage(scored=tuple(scored), log_e_value=log_e, note="nothing reaches the threshold")
    progress("fitting the best explanations in earnest")
    first_look = not base.found
    chosen = [(base, s) for s in [*_worth(real, strong=first_look), *_worth_of_open(real, opened)]]
    views = list(others)
    if distorted(base) and first_look:
        seen = {s.hypothesis.name for _, s in chosen}
        chosen += [(base, s) for s in _controls(real, base) if s.hypothesis.name not in seen]
        if (middle := in_the_middle(base)) is not None:
            views.append(middle)
    for view in views:
        known = [h for h in hypotheses_of(candidates, view) if not h.is_open]
        chosen += [(view, s) for s in _worth(_scanned(view, known, jobs)[0], strong=first_look)]
    fits = best_fits(base, chosen, jobs=jobs)
    if not fits:
        return Stage(scored=tuple(scored), log_e_value=log_e, note="no explanation has a solution")
    gains = [penalised(fit) - base.log_evidence for fit in fits]
    fitted = {fit.found[-1].label: gain for fit, gain in zip(fits, gains, strict=True)}
    stage = Stage(scored=tuple(scored), log_e_value=log_e, fits=tuple(fits), gains=tuple(gains), fitted=fitted).ranked()
    return judged(judge, calibrated, stage, needed)


def _scanned(base: Explanation, hypotheses: Sequence[Hypothesis], jobs: int) -> tuple[list[Scored], list[Scored]]:
    """Scores of what is known and of open forms, each best first."""
    marginal = Marginal.of(base.fit)
    scored = scan(base.problem, base.fit, marginal, hypotheses, jobs=jobs)
    real = [s for s in scored if not s.hypothesis.is_open]
    opened = [s for s in scored if s.hypothesis.is_open]
    near = [s for s in [*real[:SHARPENED], *opened[:SHARPENED_FORMS]] if s.log_bayes > SHARPEN_FROM]
    work = [(base.problem, base.fit, marginal, s) for s in near]
    finer = run_parallel(sharpened, work, jobs=jobs, batches=jobs)
    by_label = {s.hypothesis.label: s for s in finer}
    real, opened = (
        sorted((by_label.get(s.hypothesis.label, s) for s in some), key=lambda s: -s.log_bayes)
        for some in (real, opened)
    )
    return real, opened


def _worth(scored: Sequence[Scored], *, strong: bool) -> list[Scored]:
    """What of a scan is worth a fit, two at least; more where an effect may be `strong`."""
    most = scored[0].log_bayes
    found = [s for s in scored[:FITTED] if s.log_bayes > WORTH * most]
    found += [s for s in scored[FITTED:MOST_FITTED] if s.log_bayes > NEAR * most]
    if strong and most > STRONG:
        for s in scored:
            new = s.hypothesis.name not in {f.hypothesis.name for f in found}
            if new and s.log_bayes > WORTH_OF_STRONG * most and len(found) < MOST_FITTED:
                found.append(s)
    return found if len(found) > 1 else list(scored[:2])


def _controls(scored: Sequence[Scored], base: Explanation) -> list[Scored]:
    """Two-point controls, each at its best place.

    What a strong one does is so far from a straight line that the scan may hold it for next to nothing.
    """
    best: dict[str, Scored] = {}
    for s in scored:
        if two_point_columns(s.hypothesis, base.problem) is not None:
            best.setdefault(s.hypothesis.name, s)
    return list(best.values())


def _worth_of_open(real: Sequence[Scored], opened: Sequence[Scored]) -> list[Scored]:
    """What of the open forms is worth a fit: two at most, of two kinds where what they explain is strong.

    They have to be ahead of the catalogue; not where the scan, being linear, tells little of who is.
    """
    best_known = real[0].log_bayes
    found = [s for s in opened[:2] if s.log_bayes > best_known + OPEN_PENALTY]
    if found or opened[0].log_bayes < max(STRONG, NEAR * best_known):
        return found
    other = next((s for s in opened if s.hypothesis.name != opened[0].hypothesis.name), opened[0])
    return [opened[0], other]
