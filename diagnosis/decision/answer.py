"""The one rule that turns the probabilities of all explanations into an answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Literal

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.learnt import Rule
from diagnosis.engine.scan import course_of_heat
from models.network.laws import symbol
from models.terms.term import Term

Grade = Literal["claim", "likely"]
MOST_TIED = 3
WEIGHT = attrgetter("weight")


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """One effect that is reported: a name, or a set of names that these data do not separate.

    Attributes
    ----------
    best : Judged
        The most probable one, refitted
    effect : Hypothesis
        Which of its effects
    grade : str
        ``claim`` or ``likely``
    probability : float
        Of the name, whatever its place and shape
    joint : float
        Of all names that it may be: of a tie set, of those that look alike or act on the same thing; else `probability`
    tied : tuple of (Hypothesis, float)
        Names of a tie set with their probabilities, `effect` first; empty of a claim
    acts_like : bool
        True if this is only the nearest name: by names that look alike or act on the same thing, by what remains, by
        the kind of the effect (a course over the hours, a parameter where model error is large), because it begins
        together with another one, or because held-out recordings contradict it
    discounted : bool
        True if only the share :attr:`Rule.nearest` of the probability is stated
    one_event : bool
        True if another effect begins at the same time, or acts on the same thing at the same times: one cause is more
        probable than two
    """

    best: Judged
    effect: Hypothesis
    grade: Grade
    probability: float
    joint: float
    tied: tuple[tuple[Hypothesis, float], ...] = ()
    acts_like: bool = False
    discounted: bool = False
    one_event: bool = False


def decide(posterior: Posterior) -> tuple[Answer, ...]:
    """The answers of a posterior: empty if nothing is missing and no parameter outside its prior, or without a name.

    A name is a claim if its probability reaches :attr:`Settings.claim_from`. Else at most three names that reach it
    together are a tie. Else names that look alike in these readings, or act on the same thing, and reach it together
    are one answer: it "acts like" the best of them. So does what leaves much unexplained, and what only has a course
    over the hours: the nearest name is found, not the cause. Where much is left, what is stated of it is only the
    share :attr:`Rule.nearest` of its probability, because most names that were nearest turned out wrong. The same holds
    if model error is large, of a parameter outside its prior, which stands in for another structure of the machine, and
    of every name with less evidence than :attr:`Rule.named_if_large`; and of two that begin at the same time, or act on
    one thing at the same times, because they are probably one cause that has another name.
    """
    if not posterior.detected and not posterior.parameter_outside:
        return ()
    best = _best_fitted(posterior)
    answers = (_answer(posterior, best, effect) for effect in best.effects)
    return tuple(answer for answer in answers if answer is not None)


def withdraw_claim(answer: Answer, rule: Rule) -> Answer:
    """An answer that held-out recordings contradict: no claim and no tie, but the nearest name at most."""
    if answer.discounted:
        return answer
    return replace(answer, grade="likely", tied=(), acts_like=True, discounted=True,
                   probability=rule.nearest * answer.probability, joint=rule.nearest * answer.joint)  # fmt: skip


def _best_fitted(posterior: Posterior) -> Judged:
    """The most probable explanation; if it has no fit, the one with its names whose fit has the most evidence.

    Far from a straight line the refit of the best place may fail, and that of another one end without the effect. A fit
    at the same place goes before others. A heat that is like no law is never fitted: a law with more evidence that acts
    on the same part, or on its thermometer, goes before it.
    """
    explanation = next(
        one for one in posterior.explanations if one.members[0].of_parameters == posterior.parameter_outside
    )
    first = explanation.members[0]
    if first.fit is not None:
        return first
    if first.effects[0].is_open:
        there = _changed(first.effects[0].added)
        singles = [one for one in posterior.judged if len(one.effects) == 1 and one.effects[0].term is not None]
        known = [one for one in singles if one.fit is not None and one.weight > first.weight
                 and not there.isdisjoint(_changed(one.effects[0].added))]  # fmt: skip
        return max(known, key=WEIGHT, default=first)
    fitted = [one for one in posterior.judged if one.fit is not None and set(explanation.names) <= set(one.names)]
    alone = [one for one in fitted if one.names == explanation.names]  # a further effect is not an answer by itself
    labels = {effect.label for effect in first.effects}
    same = [one for one in fitted if labels <= {effect.label for effect in one.effects}]
    return max(same or alone or fitted, key=WEIGHT, default=first)


def _answer(posterior: Posterior, best: Judged, effect: Hypothesis) -> Answer | None:
    """The narrowest set of names that holds enough probability."""
    name, enough = effect.law, posterior.settings.claim_from
    doubtful = effect.term is None or posterior.log_e < posterior.rule.named_if_large
    chance, overlap = posterior.rule.one_event
    together = _begin_together(best, chance) or _act_together(best, overlap)
    much = posterior.leaves_much(best) or (doubtful and best.error_class.is_large) or together
    vague = effect.how == "over_hours" or effect.is_open or much
    sure = posterior.rule.nearest if much else 1.0
    own = posterior.of_names([name])
    answer = Answer(best=best, effect=effect, grade="likely", probability=sure * own, joint=sure * own, acts_like=vague,
                    discounted=much, one_event=together)  # fmt: skip
    if own >= enough:
        return answer if vague else replace(answer, grade="claim")
    names = _best_of_names(posterior, effect)
    rivals = [one for other, one in names.items()
              if other == name or not (other in best.names or _comes_along(posterior, name, other))]  # fmt: skip
    for count in range(2, MOST_TIED + 1):
        joint = posterior.of_names([one.law for one in rivals[:count]])
        if joint >= enough:
            tied = tuple((one, sure * posterior.of_names([one.law])) for one in rivals[:count])
            return replace(answer, tied=tied, joint=sure * joint)
    least, likeness = posterior.rule.alike, posterior.likeness
    alike = [one.law for one in rivals if likeness.of(effect, one) >= least]
    alike += [other for other, one in names.items() if act_on_the_same(effect, one)]
    joint = posterior.of_names([name, *alike])
    return replace(answer, joint=sure * joint, acts_like=True) if joint >= enough else None


def _begin_together(best: Judged, chance: float) -> bool:
    """True if the two effects of a pair begin closer together than two dates would by such a chance."""
    names = [effect.date for effect in best.effects if effect.date is not None]
    if best.fit is None or len(names) < 2:
        return False
    experiment = best.fit.experiment
    first, second = (
        unknown.value(z) for unknown, z in zip(experiment.unknowns, best.fit.z.tolist(), strict=True)
        if unknown.parameter.name in names
    )  # fmt: skip
    tested = sum(experiment.pieces[i].duration for i in experiment.tested)
    return abs(first - second) < 0.5 * chance * tested


def _act_together(best: Judged, overlap: float) -> bool:
    """True if a pair are laws of the time whose heats into one thing come and go together, with any signs."""
    terms = [effect.term for effect in best.effects if effect.term is not None and effect.in_network]
    of_time = [term for term in terms if symbol("time") in term.expression.free_symbols]
    if best.fit is None or len(of_time) < 2 or _changed(of_time[0]).isdisjoint(_changed(of_time[1])):
        return False
    first, second = (course_of_heat(best.fit, term) for term in of_time)
    return abs(float(first @ second)) > overlap * float(np.linalg.norm(first) * np.linalg.norm(second))


def _comes_along(posterior: Posterior, name: str, other: str) -> bool:
    """True if another name is a further effect next to a name, rather than one that stands in its place."""
    theirs = [one for one in posterior.explanations if other in one.names]
    beside = [one.probability for one in theirs if name in one.names]
    return bool(beside) and 2.0 * sum(beside) >= sum(one.probability for one in theirs)


def _best_of_names(posterior: Posterior, effect: Hypothesis) -> dict[str, Hypothesis]:
    """Best effect of every name, that of one effect's own name first, then the most probable first."""
    found = {effect.law: effect}
    for judged, _ in posterior.ranked:
        for one in judged.effects:
            found.setdefault(one.law, one)
    return found


def act_on_the_same(first: Hypothesis, second: Hypothesis) -> bool:
    """True if two effects change the same thing: the same heats, links, channels or inputs."""
    if first.term is None or second.term is None:
        return False
    return first.term.kind == second.term.kind and not _changed(first.term).isdisjoint(_changed(second.term))


def _changed(term: Term) -> set[str]:
    """Names of what a term acts on; of a link without its other end, which many share."""
    return set(term.target[:-1] if term.kind == "link" else term.target)
