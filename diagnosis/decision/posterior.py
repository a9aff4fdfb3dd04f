r"""What the readings say about every explanation, and the one rule that turns it into an answer.

An explanation is nothing, one effect, or two. Its probability goes with its prior and its tempered evidence,

.. math:: P_i \propto w_i \exp(\ln B_i / T), \quad T = a + b \max_i \ln B_i

The temper stands for what no catalogue and no model error holds; it is learnt on plants of the zoo
(``diagnosis/decision/learnt.toml``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Fit
from models.base.types import Array

Kind = Literal["nothing", "parameter", "measurement", "mechanism", "pair", "outside"]
KINDS: tuple[Kind, ...] = get_args(Kind)
Grade = Literal["claim", "likely"]
MOST_TIED = 3
MUCH_LEFT, MUCH_LEFT_SHARE = 20.0, 0.05  # of the evidence, [nat]: beside a name, what shows that its law is another


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The four numbers that a user sets.

    Attributes
    ----------
    false_alarm_rate : float
        How often a healthy machine may be called inconsistent, [-]
    matters_K, matters_W : float
        Size from which an effect matters: of a temperature [K], or of a heat [W]; 0 W: 3 % of the typical loss
    claim_from : float
        Probability from which a name is a claim, [-]
    odds_unknown : float
        Prior odds that a cause is in no catalogue, to one that is in it, [-]
    """

    false_alarm_rate: float = 0.05
    matters_K: float = 1.0
    matters_W: float = 0.0
    claim_from: float = 0.9
    odds_unknown: float = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """An explanation, and what the readings say for it.

    Attributes
    ----------
    effects : tuple of Hypothesis
        What it adds to the machine: nothing, one thing, or two; each with one variant left: the most probable shape
    log_prior : float
        Of this effect at this place, [nat]
    log_bayes : float
        Log Bayes factor against nothing, model error and deviations between sessions marginalised, [nat]
    strength, strength_sd : tuple of float
        Most probable size of every effect and its standard deviation, in units of its first parameter
    fit : Fit or None
        Fitted with everything else, model error in place; None if only the scan judged it
    """

    effects: tuple[Hypothesis, ...]
    log_prior: float
    log_bayes: float
    strength: tuple[float, ...] = ()
    strength_sd: tuple[float, ...] = ()
    fit: Fit | None = None

    @property
    def kind(self) -> Kind:
        """What sort of explanation it is."""
        if len(self.effects) != 1:
            return "pair" if self.effects else "nothing"
        (effect,) = self.effects
        if effect.is_open:
            return "outside"
        if effect.term is None:
            return "parameter"
        return "measurement" if effect.term.of_measurement or effect.term.kind == "sensor" else "mechanism"

    @property
    def label(self) -> str:
        """Names and places."""
        return " + ".join(effect.label for effect in self.effects) or "nothing"


@dataclass(frozen=True, kw_only=True, eq=False)
class Expected:
    """What an effect of the size that matters would leave in these recordings.

    Attributes
    ----------
    effect : Hypothesis
    log_bayes : float
        Expected evidence for it, [nat]
    """

    effect: Hypothesis
    log_bayes: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Likeness:
    """How much alike effects look in these readings, with everything unknown marginalised.

    Attributes
    ----------
    labels : tuple of str
        Of effects
    cosines : Array, shape (effects, effects)
        Magnitude of the cosine between what two of them do to the readings, 0 to 1
    """

    labels: tuple[str, ...]
    cosines: Array

    def of(self, first: Hypothesis, second: Hypothesis) -> float:
        """Magnitude of the cosine between two effects."""
        return float(self.cosines[self.labels.index(first.label), self.labels.index(second.label)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """All explanations that were judged.

    Attributes
    ----------
    nothing : Judged
        The calibrated machine with model error
    judged : tuple of Judged
        Everything else, of the scan or refitted
    log_e : float
        Log of the mean Bayes factor over everything that competes with nothing, [nat]
    threshold : float
        From which something is missing, [nat]
    temper : (float, float)
        a and b
    likeness : Likeness
    error_class : str
        Class of model error that the evidence chose
    error_evidence : mapping of str to float
        Log evidence of every class, prior included, less that of the best
    session_s : float
        Mean deviation between sessions that the readings support, in prior standard deviations; 0 of one session
    remainder : float
        Log Bayes factor of the best further effect beside the best explanation, [nat]
    expected : tuple of Expected
    """

    nothing: Judged
    judged: tuple[Judged, ...]
    log_e: float
    threshold: float
    temper: tuple[float, float]
    likeness: Likeness = Likeness(labels=(), cosines=np.zeros((0, 0)))
    error_class: str = ""
    error_evidence: dict[str, float] = field(default_factory=dict)
    session_s: float = 0.0
    remainder: float = 0.0
    expected: tuple[Expected, ...] = ()

    @property
    def much_is_left(self) -> bool:
        """True if the second scan finds much beside the best explanation: its law is not the true one."""
        gain = self.ranked[0][0].log_bayes
        return self.remainder > MUCH_LEFT and self.remainder > MUCH_LEFT_SHARE * gain

    @property
    def detected(self) -> bool:
        """True if something is missing."""
        return self.log_e > self.threshold

    @cached_property
    def probabilities(self) -> Array:
        """Of nothing, then of everything judged, shape (1 + judged,)."""
        a, b = self.temper
        log_bayes = np.array([0.0, *(one.log_bayes for one in self.judged)])
        prior = np.array([self.nothing.log_prior, *(one.log_prior for one in self.judged)])
        log = prior + log_bayes / (a + b * max(float(log_bayes.max()), 0.0))
        return np.asarray(np.exp(log - np.logaddexp.reduce(log)))

    @cached_property
    def ranked(self) -> tuple[tuple[Judged, float], ...]:
        """Everything judged with its probability, most probable first."""
        return tuple(sorted(zip(self.judged, self.probabilities[1:].tolist(), strict=True), key=lambda one: -one[1]))

    def of(self, kind: Kind) -> float:
        """Probability of a kind of explanation."""
        if kind == "nothing":
            return float(self.probabilities[0])
        return float(sum(p for one, p in self.ranked if one.kind == kind))


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """One effect that is reported: a name, or a set of names that these data do not tell apart.

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
    tied : tuple of (Hypothesis, float)
        Names of a tie set with their probabilities, `effect` first; empty of a claim
    acts_like : bool
        True if what remains, or the kind of the effect (a course over the hours), says that only law and place are
        found
    """

    best: Judged
    effect: Hypothesis
    grade: Grade
    probability: float
    tied: tuple[tuple[Hypothesis, float], ...] = ()
    acts_like: bool = False


def decide(posterior: Posterior, settings: Settings) -> tuple[Answer, ...]:
    """The answers of a posterior: empty if nothing is missing, or if nothing can be named.

    A name counts with all its places and shapes. It is a claim from :attr:`Settings.claim_from` on, unless the second
    scan finds that much is left beside it, or it is a course over the hours without a cause: then only law and place
    are found, and it "acts like" that name. Otherwise at most three names that hold the probability together are a tie.
    """
    if not posterior.detected:
        return ()
    found: list[Answer] = []
    best = posterior.ranked[0][0]
    for effect in best.effects:
        names = _by_name(posterior, beside=tuple(one for one in best.effects if one is not effect))
        first = next((index for index, one in enumerate(names) if one[0].name == effect.name), None)
        if first is None:
            continue
        names = [names[first], *names[:first], *names[first + 1 :]]
        held, tied = 0.0, []
        for one in names[:MOST_TIED]:
            tied.append(one)
            held += one[1]
            if held >= settings.claim_from:
                break
        if held < settings.claim_from:
            continue
        claimed = len(tied) == 1
        vague = effect.how == "W" or posterior.much_is_left
        found.append(Answer(
            best=best, effect=effect, grade="claim" if claimed and not vague else "likely", probability=tied[0][1],
            tied=() if claimed else tuple(tied), acts_like=vague,
        ))  # fmt: skip
    return tuple(found)


def _by_name(posterior: Posterior, beside: Sequence[Hypothesis]) -> list[tuple[Hypothesis, float]]:
    """Names with their probabilities, each with its most probable place, most probable first.

    Of an effect beside another one, all explanations that hold the other one count.
    """
    kept = {one.label for one in beside}
    total: dict[str, float] = {}
    shown: dict[str, Hypothesis] = {}
    whole = 0.0
    for judged, probability in posterior.ranked:
        rest = [one for one in judged.effects if one.label not in kept]
        if kept and len(rest) == len(judged.effects):
            continue
        whole += probability
        for one in rest:
            shown.setdefault(one.name, one)
            total[one.name] = total.get(one.name, 0.0) + probability
    if not kept:
        whole = 1.0
    ranked = sorted(total.items(), key=lambda item: -item[1])
    return [(shown[name], value / max(whole, 1e-300)) for name, value in ranked]
