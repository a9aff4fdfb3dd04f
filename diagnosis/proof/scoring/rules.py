"""The rules of a proof as a table: which cases a rule counts, and which answers it counts as right.

An effect is *of practical size* if it moves a measured temperature by more than 0.3 K rms (an input by more than its
ordinary error). For smaller effects silence is right, so rules that ask for a name leave them out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from diagnosis.proof.scoring.answers import NO_ANSWER, PARAMETER, Answer
from diagnosis.proof.scoring.counts import Count
from models.mechanisms import OPEN_FORM

STRENGTH_ERROR = 0.15
EVIDENT = 10.0  # nats of the first scan for an effect at its best place: with less it is lost among the catalogue
FAR = "parameter_far"
# Strengths that mean the same in plant and catalogue, but for their sign; heats are compared as heats.
SAME_STRENGTH = ("sensor_bias", "sensor_gain", "sensor_lag", "clock_offset", "torque_offset", "torque_gain",
                 "speed_gain", "ambient_probe_offset")  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ScoredCase:
    """Answer and truth of one case.

    Attributes
    ----------
    case : str
    truth : mapping
        See :func:`diagnosis.proof.cases.truth.truth_of`
    answer : Answer
    near : mapping of node to set of str
        The node and those that share a heat path with it
    far : str
        Parameter that is farthest from its nominal value, in standard deviations
    kin : frozenset of str
        Tie set on the same recordings with the whole catalogue, if a mechanism was removed
    """

    case: str
    truth: Mapping[str, Any]
    answer: Answer
    near: Mapping[str, frozenset[str]]
    far: str
    kin: frozenset[str] = frozenset()

    @property
    def group(self) -> str:
        """Group of the case."""
        return str(self.truth["group"])

    @property
    def answered(self) -> bool:
        """True if there is an answer."""
        return self.answer.verdict not in NO_ANSWER

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects, the dominant one first."""
        return tuple(effect["name"] for effect in self.truth["effects"])

    @property
    def first_tied(self) -> bool:
        """True if the dominant effect is named or tied."""
        return self.names[0] in self.answer.tied

    @property
    def nodes(self) -> list[str]:
        """Nodes of the dominant effect; empty for effects on an input (torque, ambient)."""
        return [node for node in self.truth["effects"][0]["nodes"] if node in self.near]

    def practical(self, k: int = 0) -> bool:
        """True if an effect is of practical size, or if the truth does not know."""
        return self.truth["practical"][k] is not False

    @property
    def evident(self) -> bool:
        """True if the first scan gives the dominant effect at least 10 nats, or there is no scan."""
        return self.answer.evidence.get(self.names[0], math.inf) >= EVIDENT

    @property
    def right(self) -> bool | None:
        """True if the main effect is found (or nothing, in a control); None if there is nothing to find."""
        if self.group == "control":
            return apply("far", self) if self.truth["control"] == FAR else apply("consistent", self)
        if not self.practical():
            return None
        return self.answer.unnamed if self.group == "outside" else self.first_tied

    def strengths(self) -> tuple[float, float, float] | None:
        """Claimed strength, its stated error and the true strength of one effect; None unless it is named exactly."""
        if self.group not in ("single", "sensor") or not self.practical() or not self.answer.claims:
            return None
        claim, effect = self.answer.claims[0], self.truth["effects"][0]
        if claim.mechanism != effect["name"]:
            return None
        if effect["name"] in SAME_STRENGTH:
            return abs(claim.strength), claim.strength_sd, abs(float(effect["parameters"]["a"]))
        if effect["kind"] == "signal" or self.group == "sensor":
            return None
        return claim.heat_W, claim.heat_sd_W, float(effect["heat_magnitude_W"]["train"])


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A row of the table.

    Attributes
    ----------
    key, text : str
    meaning : str
        Definition that the page shows
    when : callable
        True if the rule counts the case
    right : callable
        True if the answer is right, of the cases that it counts
    needed : float or None
        Required share; None if nothing is required
    at_most : bool
        True if the share must not exceed `needed`
    """

    key: str
    text: str
    meaning: str
    when: Callable[[ScoredCase], bool]
    right: Callable[[ScoredCase], bool]
    needed: float | None = None
    at_most: bool = False

    def apply(self, case: ScoredCase) -> bool | None:
        """Score one case; None if the rule does not count it."""
        return self.right(case) if self.when(case) else None

    def met(self, count: Count) -> bool | None:
        """True if the share is as required; None if nothing is required or counted."""
        if self.needed is None or not count.of:
            return None
        return count.share <= self.needed if self.at_most else count.share >= self.needed


# ---------------------------------------------------------------------- cases that rules count


def healthy(c: ScoredCase) -> bool:
    """Nothing concealed, every parameter inside its prior."""
    return c.group == "control" and c.truth["control"] != FAR


def far_off(c: ScoredCase) -> bool:
    """Nothing concealed, one parameter five standard deviations off."""
    return c.group == "control" and c.truth["control"] == FAR


def of_group(group: str) -> Callable[[ScoredCase], bool]:
    """Cases of a group whose dominant effect is of practical size."""
    return lambda c: c.group == group and c.practical()


single, messy, sensor, outside = map(of_group, ("single", "messy", "sensor", "outside"))


def located(c: ScoredCase) -> bool:
    """One effect with a node, and a fault claimed."""
    return single(c) and not c.answer.silent and bool(c.nodes)


def double(c: ScoredCase) -> bool:
    """Two effects of practical size."""
    return c.group == "double" and c.practical(0) and c.practical(1)


def outside_forced(c: ScoredCase) -> bool:
    """An effect outside the catalogue, and a name given."""
    return c.group == "outside" and c.answered and bool(c.answer.known)


def removed_forced(c: ScoredCase) -> bool:
    """An effect whose entry is removed, and a name given that is no kin."""
    return c.answered and not c.answer.known <= c.kin


# ---------------------------------------------------------------------- answers that are right


def named_parameter(c: ScoredCase) -> bool:
    """The parameter that is off is among the claims."""
    places = {claim.place for claim in c.answer.claims if claim.mechanism == PARAMETER}
    return c.answer.verdict == "parameter_error" and c.far in places


def within(c: ScoredCase, share: float | None) -> bool:
    """The claimed strength is within a share of the truth, or within twice the stated error if that is None."""
    claimed, sd, true = c.strengths() or (math.nan,) * 3
    return abs(claimed - true) <= (2.0 * sd if share is None else share * true)


def dominant_first(c: ScoredCase) -> bool:
    """The first claim names or ties the dominant effect."""
    return bool(c.answer.claims) and c.names[0] in c.answer.claims[0].tied


def no_other(c: ScoredCase) -> bool:
    """No claim of the catalogue leaves the effect out."""
    return all(c.names[0] in claim.tied for claim in c.answer.claims if claim.family != OPEN_FORM)


RULES = (
    Rule(
        key="consistent", text="consistent recordings called consistent", needed=0.95,
        meaning="Nothing concealed, every parameter inside its prior (or noise or lag misstated): the verdict is "
                "consistent.",
        when=healthy, right=lambda c: c.answer.verdict == "consistent",
    ),
    Rule(
        key="false_alarm", text="false alarms", needed=0.05, at_most=True,
        meaning="Of the same cases: any fault is claimed.",
        when=lambda c: healthy(c) and c.answered, right=lambda c: not c.answer.silent,
    ),
    Rule(
        key="far", text="parameter far off: called so, and which",
        meaning="A parameter five standard deviations off, nothing else: a parameter error, that parameter among those "
                "named.",
        when=far_off, right=named_parameter,
    ),
    Rule(
        key="single_tied", text="single effect named or in the tie set", needed=0.95,
        meaning="One effect of practical size: named, or in the tie set (a rival of at least 5 %).",
        when=single, right=lambda c: c.first_tied,
    ),
    Rule(
        key="single_exact", text="single effect named exactly", needed=0.85,
        meaning="One effect of practical size: the first name given.",
        when=single, right=lambda c: bool(c.answer.claims) and c.answer.claims[0].mechanism == c.names[0],
    ),
    Rule(
        key="single_answered", text="single effect named, tied, or reported as not detectable in these data",
        meaning="One effect of practical size: named or tied, or nothing is claimed and it is reported as not "
                "detectable.",
        when=single, right=lambda c: c.first_tied or (c.answer.silent and c.names[0] in c.answer.unseen),
    ),
    Rule(
        key="single_evident", text="single effect that the first scan scores with 10 nats: named or in the tie set",
        meaning="One effect of practical size that the first scan scores with 10 nats or more: named, or in the tie "
                "set.",
        when=lambda c: single(c) and c.evident, right=lambda c: c.first_tied,
    ),
    Rule(
        key="single_small", text="single effect too small to matter: no other named",
        meaning="One effect too small to matter: no claim of the catalogue leaves it out.",
        when=lambda c: c.group == "single" and not c.practical() and c.answered, right=no_other,
    ),
    Rule(
        key="place", text="place right, or next to it", needed=0.95,
        meaning="One effect of practical size, a fault claimed: the most probable place is its node or one linked to "
                "it. Effects on an input (torque, ambient) have no node and are left out.",
        when=located, right=lambda c: any(c.answer.node in c.near[node] for node in c.nodes),
    ),
    Rule(
        key="place_exact", text="place right exactly",
        meaning="The same cases: the most probable place is a node of the effect.",
        when=located, right=lambda c: c.answer.node in c.truth["effects"][0]["nodes"],
    ),
    Rule(
        key="strength", text="strength within 15 %", needed=0.90,
        meaning="One effect, exactly named: its mean heat (the size, of a fault of measurement) within 15 % of the "
                "truth.",
        when=lambda c: c.strengths() is not None, right=lambda c: within(c, STRENGTH_ERROR),
    ),
    Rule(
        key="strength_as_stated", text="strength within twice the stated error",
        meaning="The same cases: within twice the standard error that the diagnosis states.",
        when=lambda c: math.isfinite((c.strengths() or (math.nan,) * 3)[1]), right=lambda c: within(c, None),
    ),
    Rule(
        key="both", text="two effects: both", needed=0.75,
        meaning="Two effects, both of practical size: both named or tied.",
        when=double, right=lambda c: set(c.names) <= c.answer.tied,
    ),
    Rule(
        key="one", text="two effects: at least one", needed=0.95,
        meaning="Two effects, both of practical size: at least one named or tied.",
        when=double, right=lambda c: bool(set(c.names) & c.answer.tied),
    ),
    Rule(
        key="messy", text="one dominant, six minor: the dominant one first",
        meaning="One dominant effect among six minor ones: the first claim names it or ties it.",
        when=messy, right=dominant_first,
    ),
    Rule(
        key="sensor", text="fault of measurement named or in the tie set", needed=0.90,
        meaning="A fault of measurement of practical size: named or tied.",
        when=sensor, right=lambda c: c.first_tied,
    ),
    Rule(
        key="sensor_evident",
        text="fault of measurement that the first scan scores with 10 nats: named or in the tie set",
        meaning="A fault of measurement that the first scan scores with 10 nats or more: named or tied.",
        when=lambda c: sensor(c) and c.evident, right=lambda c: c.first_tied,
    ),
    Rule(
        key="outside", text="outside the catalogue: reported as such",
        meaning="Practical size, in no catalogue: called unexplained or an open form, and no name of the catalogue "
                "given.",
        when=outside, right=lambda c: c.answer.unnamed,
    ),
    Rule(
        key="outside_forced", text="outside the catalogue: forced into a name", needed=0.0, at_most=True,
        meaning="In no catalogue, of any size: a name of the catalogue is given, or a parameter.",
        when=lambda c: c.group == "outside" and c.answered, right=outside_forced,
    ),
    Rule(
        key="outside_partly", text="of those: reported as well that more is missing",
        meaning="Of these: reported as well that the name does not explain everything.",
        when=outside_forced, right=lambda c: c.answer.partly,
    ),
    Rule(
        key="heldout", text="held-out error improves on calibration",
        meaning="An effect of practical size is there and a claim is made: the held-out error is below that of "
                "calibration alone.",
        when=lambda c: c.group != "control" and c.practical() and bool(c.answer.claims)
        and math.isfinite(c.answer.holdout_K[2]),
        right=lambda c: c.answer.holdout_K[2] < c.answer.holdout_K[1],
    ),
)  # fmt: skip
# For single effects whose entry was removed from the catalogue.
REMOVED_RULES = (
    Rule(
        key="removed", text="entry removed: reported as outside the catalogue",
        meaning="Practical size, its entry removed: called unexplained or an open form, and no name of the catalogue "
                "given.",
        when=lambda c: c.practical(), right=lambda c: c.answer.unnamed,
    ),
    Rule(
        key="removed_kin", text="entry removed: only a kin named that was tied before",
        meaning="Practical size, its entry removed: only names that the whole catalogue does not rule out on these "
                "recordings either.",
        when=lambda c: c.practical(), right=lambda c: bool(c.answer.known) and c.answer.known <= c.kin,
    ),
    Rule(
        key="removed_forced", text="entry removed: forced into another name", needed=0.0, at_most=True,
        meaning="Its entry removed, of any size: another name of the catalogue is given, and it is no kin.",
        when=lambda c: c.answered, right=removed_forced,
    ),
    Rule(
        key="removed_partly", text="entry removed, of those: reported as well that more is missing",
        meaning="Of these: reported as well that the name does not explain everything.",
        when=removed_forced, right=lambda c: c.answer.partly,
    ),
)  # fmt: skip
BY_KEY: Mapping[str, Rule] = {rule.key: rule for rule in (*RULES, *REMOVED_RULES)}


def apply(key: str, case: ScoredCase) -> bool | None:
    """Score one case by the rule of a key; None if the rule does not count it."""
    return BY_KEY[key].apply(case)
