r"""Probabilities of all explanations of the readings.

An explanation is nothing, one effect, or two. Effects of one law (at all places, from a date on, over the hours) are
one name. The evidence of a name is the Bayesian mean over its places, courses and shapes. Between names it is tempered,

.. math:: P_i \propto \exp(\ln B_i / T), \quad T = a + b \max_i \ln B_i

because no law of the catalogue has exactly the form that the machine has: what a name is behind the best one counts in
proportion to what there is to be explained. Names that explain less than a share of it are refuted. The numbers are
learnt on plants of the zoo and of a stranger, see ``diagnosis/engine/learnt.toml``.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from scipy.special import expit, logsumexp, softmax

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.settings import Settings
from diagnosis.engine.fit import Fit
from diagnosis.engine.learnt import ErrorClass, Rule
from models.base.types import Array

Kind = Literal["nothing", "parameter", "measurement", "mechanism", "pair", "outside"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """An explanation, and what the readings say for it.

    Attributes
    ----------
    effects : tuple of Hypothesis
        What it adds to the machine: nothing, one thing, or two; each with one variant left: the most probable shape
    log_bayes : float
        Log Bayes factor against nothing, model error and deviations between sessions marginalised, [nat]
    error_class : ErrorClass
        Of model error: the one in which the scan gives it the largest evidence
    fit : Fit or None
        Fitted with everything else, model error in place; None if only the scan judged it
    left : float or None
        Log Bayes factor of the best further effect, given this explanation, [nat]; None: none was looked for
    """

    effects: tuple[Hypothesis, ...]
    log_bayes: float
    error_class: ErrorClass
    fit: Fit | None = None
    left: float | None = None

    @property
    def log_prior(self) -> float:
        """Of its effects at their places, [nat]."""
        return float(sum(effect.log_prior for effect in self.effects))

    @property
    def weight(self) -> float:
        """Evidence and prior, [nat]."""
        return self.log_bayes + self.log_prior

    @property
    def fitted(self) -> Fit:
        """The fit of one that has one."""
        assert self.fit is not None, self.label  # noqa: S101
        return self.fit

    @property
    def kind(self) -> Kind:
        """Sort of explanation."""
        if len(self.effects) != 1:
            return "pair" if self.effects else "nothing"
        (effect,) = self.effects
        if effect.is_open:
            return "outside"
        if effect.term is None:
            return "parameter"
        return "measurement" if effect.of_measurement else "mechanism"

    @property
    def of_parameters(self) -> bool:
        """True if nothing is missing, but parameters are outside their priors."""
        return bool(self.effects) and all(effect.term is None for effect in self.effects)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the laws, whatever their places and courses."""
        return tuple(sorted(effect.law for effect in self.effects))

    @property
    def label(self) -> str:
        """Names and places."""
        return " + ".join(effect.label for effect in self.effects) or "nothing"


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """A name, or two, at whatever places.

    Attributes
    ----------
    members : tuple of Judged
        Most probable first
    log_bayes : float
        Mean Bayes factor over places, courses and shapes; of a pair with the prior of a second effect, [nat]
    """

    names: tuple[str, ...]
    members: tuple[Judged, ...]
    log_bayes: float
    probability: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Expected:
    """Evidence that an effect of the size that matters would leave in these recordings.

    Attributes
    ----------
    log_bayes : float
        Expected evidence for it, [nat]
    """

    effect: Hypothesis
    log_bayes: float

    @property
    def weight(self) -> float:
        """Evidence and prior, which may reach the threshold, [nat]."""
        return self.log_bayes + self.effect.log_prior


@dataclass(frozen=True, kw_only=True, eq=False)
class ScaledError:
    """Evidence of the scan if all amplitudes of model error are larger or smaller than assumed; nothing is fitted.

    Attributes
    ----------
    factor : float
        On the amplitudes; 1: as assumed
    log_e_value, threshold : float
        Evidence that something is missing, and what it has to reach, [nat]
    mechanism, place : str
        The candidate ahead
    """

    factor: float
    log_e_value: float
    threshold: float
    mechanism: str
    place: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Repeating:
    """Evidence of the scan if the machine differs between sessions by so much.

    Attributes
    ----------
    deviation_in_sd : float
        In standard deviations of the priors
    log_e_value : float
        Evidence that something is missing, [nat]
    mechanism, place : str
        The candidate ahead
    """

    deviation_in_sd: float
    log_e_value: float
    mechanism: str
    place: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Placebo:
    """Evidence that a baseline holds of an effect that cannot be in it: owed to the model.

    Attributes
    ----------
    session : str
        Of the baseline that holds most
    log_e_value : float
        As if it were as many hours as the tested recordings, [nat]
    mechanism, place : str
        The law ahead
    """

    session: str
    log_e_value: float
    mechanism: str
    place: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Assumed:
    """Assumptions that the evidence rests on, next to the explanations, and how it changes with them.

    Attributes
    ----------
    error_class : str
        Class of model error of the best explanation; of nothing where nothing is missing
    error_evidence : mapping of str to float
        Log evidence of every class without any effect, prior included, less that of the best, [nat]
    scaled_error : tuple of ScaledError
    session_s : float
        Mean deviation between sessions that the readings support, in prior standard deviations; 0 of one session
    repeating : tuple of Repeating
        With the deviation between sessions that the readings support, and with twice that or more; empty of one
        session, and if none is larger
    placebo : Placebo or None
        What a healthy session brings, which the tested recordings have to exceed; None without baselines
    draughts_ahead : float
        What the machine without an effect has more in draughts than in still air, which is off the evidence, [nat]
    """

    error_class: str = ""
    error_evidence: Mapping[str, float] = field(default_factory=dict)
    scaled_error: tuple[ScaledError, ...] = ()
    session_s: float = 0.0
    repeating: tuple[Repeating, ...] = ()
    placebo: Placebo | None = None
    draughts_ahead: float = 0.0


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
        """Magnitude of the cosine between two effects; 0 of those that were not compared."""
        if first.label not in self.labels or second.label not in self.labels:
            return 0.0
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
        Evidence that something is missing: log odds of all effects, parameters as they may be, to none, [nat]
    log_parameter : float
        Evidence that a parameter is outside its prior: log odds to all inside theirs, without any effect, [nat]
    threshold, class_threshold : float
        From which something is missing, [nat]; that of the class of model error, from which a parameter is outside its
        prior and a further effect competes
    settings : Settings
        As asked for
    assumed : Assumed
    elsewhere : Fit or None
        A far better fit of nothing, seen from the best explanation: everything is to be judged again from there
    """

    nothing: Judged
    judged: tuple[Judged, ...]
    log_e: float
    threshold: float
    class_threshold: float
    rule: Rule
    log_parameter: float = -np.inf
    likeness: Likeness = Likeness(labels=(), cosines=np.zeros((0, 0)))
    settings: Settings = field(default_factory=Settings)
    assumed: Assumed = field(default_factory=Assumed)
    expected: tuple[Expected, ...] = ()
    elsewhere: Fit | None = None

    def left_by(self, one: Judged | None = None) -> float:
        """Log Bayes factor of the best further effect, given an explanation or else the best single one, [nat].

        0 if none was looked for.
        """
        return self._scanned_beyond(one).left or 0.0

    def _scanned_beyond(self, one: Judged | None) -> Judged:
        """An explanation if a further effect was looked for with it, else the single one; nothing if there is none."""
        if one is not None and one.left is not None:
            return one
        singles = (one for one in self.judged if len(one.effects) == 1)
        return next((one for one in singles if one.left is not None), self.nothing)

    def leaves_much(self, one: Judged) -> bool:
        """True if a scan finds much more, given an explanation; of those without a scan, given the best single one.

        A second effect looks like that, and so does a law that is not the true one (seen on the stranger's cases).
        """
        least, share = self.rule.much_left
        return self.left_by(one) > max(least, share * self._scanned_beyond(one).log_bayes)

    @property
    def detected(self) -> bool:
        """True if something is missing."""
        return self.log_e > self.threshold

    @property
    def something(self) -> float:
        """Probability that something is missing: one half at the threshold."""
        return float(expit((self.log_e - self.threshold) / self.rule.doubt))

    @property
    def parameter_outside(self) -> bool:
        """True if nothing is missing, but a parameter is outside its prior."""
        return not self.detected and self.log_parameter > self.class_threshold

    @property
    def evidence(self) -> float:
        """Evidence for what is answered: that something is missing, or that a parameter is outside its prior, [nat]."""
        return self.log_parameter if self.parameter_outside else self.log_e

    @property
    def needed(self) -> float:
        """Threshold that :attr:`evidence` has to exceed, [nat]."""
        return self.class_threshold if self.parameter_outside else self.threshold

    @property
    def _of_parameters(self) -> float:
        """Probability that nothing is missing and a parameter is outside its prior."""
        return (1.0 - self.something) * float(expit((self.log_parameter - self.class_threshold) / self.rule.doubt))

    @cached_property
    def explanations(self) -> tuple[Explanation, ...]:
        """Names, or pairs of names, with their probabilities; most probable first."""
        of_names: dict[tuple[str, ...], list[Judged]] = {}
        for one in self.judged:
            of_names.setdefault(one.names, []).append(one)
        log_bayes = np.array([self._mean_log_bayes(names, members) for names, members in of_names.items()])
        able = np.ones(len(log_bayes), dtype=bool)
        if self.left_by() <= self.class_threshold:  # a second effect needs evidence of its own
            able = np.array([len(names) == 1 for names in of_names], dtype=bool)
        parameter = np.array([members[0].of_parameters for members in of_names.values()], dtype=bool)
        log_prior = np.array([self._log_odds(members[0].kind) for members in of_names.values()])
        a, b = self.rule.temper
        chance = np.zeros(len(log_bayes))
        for side, whole in ((parameter, self._of_parameters), (~parameter, self.something)):
            most = float(log_bayes[side & able].max(initial=0.0))
            left = np.flatnonzero(side & able & ((log_bayes >= self.rule.refuted * most) | (most == 0.0)))
            if len(left):
                chance[left] = whole * softmax(log_prior[left] + log_bayes[left] / (a + b * most))
        found = [
            Explanation(names=names, members=tuple(sorted(members, key=lambda one: -one.weight)),
                        log_bayes=value, probability=p)
            for (names, members), value, p in zip(of_names.items(), log_bayes.tolist(), chance.tolist(), strict=True)
        ]  # fmt: skip
        return tuple(sorted(found, key=lambda one: -one.probability))

    @cached_property
    def _known_names(self) -> dict[str, float]:
        """Prior of every name of the catalogue over all places, courses and shapes."""
        mass: dict[str, float] = {}
        for one in self.judged:
            if len(one.effects) == 1 and one.kind != "outside":
                mass[one.names[0]] = mass.get(one.names[0], 0.0) + float(np.exp(one.log_prior))
        return mass

    def _mean_log_bayes(self, names: tuple[str, ...], members: Sequence[Judged]) -> float:
        """Evidence of a name over its places and shapes; of a pair with the prior of a second effect, [nat]."""
        within = sum(np.log(self._known_names.get(name, 1.0)) for name in names)
        mean = float(logsumexp([one.weight for one in members]) - within)
        pair = float(np.log(self.rule.pair / max(len(self._known_names), 1)))
        return mean + (pair if len(names) > 1 else 0.0)

    def _log_odds(self, kind: Kind) -> float:
        """Prior of a name to one of the catalogue, [nat]."""
        if kind != "outside":
            return 0.0
        unknown = {one.names for one in self.judged if one.kind == "outside"}
        known = {one.names for one in self.judged if len(one.effects) == 1 and one.kind not in ("outside", "parameter")}
        return float(np.log(self.settings.odds_unknown * max(len(known), 1) / max(len(unknown), 1)))

    @cached_property
    def ranked(self) -> tuple[tuple[Judged, float], ...]:
        """Everything judged with its probability, most probable first."""
        result = []
        for explanation in self.explanations:
            log = np.array([one.weight for one in explanation.members])
            shares = explanation.probability * np.exp(log - logsumexp(log))
            result += list(zip(explanation.members, shares.tolist(), strict=True))
        return tuple(sorted(result, key=lambda one: -one[1]))

    def of(self, kind: Kind) -> float:
        """Probability of a kind of explanation."""
        if kind == "nothing":
            return 1.0 - self.something - self._of_parameters
        return min(float(sum(p for one, p in self.ranked if one.kind == kind)), 1.0)

    def of_names(self, names: Collection[str]) -> float:
        """Probability that any of some names is there."""
        # Sums of many shares may come out a rounding error above 1.
        return min(
            float(sum(one.probability for one in self.explanations if not set(names).isdisjoint(one.names))), 1.0
        )
