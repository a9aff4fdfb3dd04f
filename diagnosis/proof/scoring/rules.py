"""The rules of scoring as one table: what a rule counts, and which answers it counts as right."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from diagnosis.proof.scoring.answers import CERTAIN, PARAMETER, Claim, ReadAnswer
from diagnosis.proof.scoring.truth import CONTROL, MEASUREMENT, TrueEffect, Truth
from diagnosis.proof.zoo.setting import Changed

SIZE_ERROR = 0.2
VISIBLE, UNSEEN = 10.0, 3.0  # nats that the recordings hold: enough to name an effect, too few to see it


@dataclass(frozen=True, kw_only=True)
class Item:
    """One concealed effect with the answer to its case, or a case with nothing concealed.

    Attributes
    ----------
    near : mapping of node to frozenset of str
        The node and those that share a heat path with it
    first : bool
        True of one item per case
    """

    case: str
    truth: Truth
    effect: TrueEffect | None
    answer: ReadAnswer
    near: Mapping[str, frozenset[str]]
    first: bool = True

    @property
    def concealed(self) -> TrueEffect:
        """The effect of an item that has one."""
        assert self.effect is not None  # noqa: S101 - rules ask only items with an effect
        return self.effect

    @property
    def named(self) -> bool:
        """True if a finding gives the name of the effect."""
        return any(claim.name == self.concealed.name != "" for claim in self.answer.claims)

    @property
    def tied(self) -> bool:
        """True if a finding or one of its at most two rivals has the name of the effect."""
        return self.named or any(
            self.concealed.name in claim.tied and self.concealed.name for claim in self.answer.claims
        )

    @property
    def alike(self) -> bool:
        """True if it is named, or the same kind of thing at the same node or link is reported with the same sign."""
        return self.named or any(acts_like(c, one) for c in self.answer.claims for one in self.concealed.changed)

    @property
    def found(self) -> bool:
        """True if the effect is named, tied or, from outside the catalogue, reported by what it acts like."""
        return self.tied or (not self.concealed.name and self.alike)

    @property
    def located(self) -> bool:
        """True if the most probable place or that of a finding is a node of the effect, or next to one."""
        return self.answer.node in self._around or any(self._around & claim.nodes for claim in self.answer.claims)

    @property
    def located_by_chance(self) -> float:
        """Share of the machine's parts that are the right place: how often one drawn at random would be."""
        return len(self._around & self.near.keys()) / len(self.near)

    @property
    def _around(self) -> frozenset[str]:
        """Nodes of the effect, and those next to them."""
        return frozenset(n for node in self.concealed.nodes for n in self.near.get(node, {node}))


@dataclass(frozen=True, kw_only=True)
class ScoringRule:
    """A row of the table.

    Attributes
    ----------
    when : callable
        True if the rule counts the item
    right : callable
        True if the answer is right, or wrong where the rule counts errors
    bad : bool
        True if the rule counts errors
    chance : callable, optional
        Probability that an answer drawn at random is right
    """

    name: str
    meaning: str
    when: Callable[[Item], bool]
    right: Callable[[Item], bool]
    bad: bool = False
    chance: Callable[[Item], float] | None = None


def acts_like(claim: Claim, truth: Changed) -> bool:
    """True if a finding reports the kind of thing that was changed, at the same node or link, with the same sign.

    Parts of a split node have the name of the nominal node. Both nodes of a link must be those of the claim; links to
    something outside the network have one. An effect that neither adds nor takes away goes with both signs.
    """
    if claim.what != truth.what or truth.sign not in (0, claim.sign):
        return False
    if truth.what == "clock":
        return True
    if truth.what == "link":
        return bool(truth.nodes) and set(truth.nodes) <= claim.nodes
    return bool({truth.of, *truth.nodes} & claim.nodes)


def is_right(claim: tuple[str, str], odds_of: Claim, truth: Truth) -> bool:
    """True if a stated name is among the effects of a case.

    A parameter is right if it is the one that is far off; an open form or a finding that only acts like something, if
    it acts like an effect.

    Parameters
    ----------
    claim : (str, str)
        Mechanism, and the parameter if it is one
    odds_of : Claim
        The finding that states it
    """
    mechanism, parameter = claim
    if mechanism == PARAMETER:
        return bool(truth.far) and parameter in (truth.far, f"factor_{truth.far}")
    if mechanism == odds_of.mechanism and not odds_of.name:
        return any(acts_like(odds_of, one) for effect in truth.effects for one in effect.changed)
    return mechanism in {effect.name for effect in truth.effects}


def has_effect(i: Item) -> bool:
    """An effect is concealed."""
    return i.effect is not None


def in_catalogue(i: Item) -> bool:
    """An effect of the catalogue is concealed."""
    return i.effect is not None and bool(i.effect.name)


def nothing(i: Item) -> bool:
    """Nothing is concealed and no parameter is far off."""
    return i.truth.group == CONTROL and not i.truth.far


def visible(i: Item) -> bool:
    """The oracle gives the effect enough evidence."""
    return i.effect is not None and i.effect.nats[1] >= VISIBLE


def outside(i: Item) -> bool:
    """An effect that is in no catalogue is concealed."""
    return i.effect is not None and not i.effect.name


def in_machine(i: Item) -> bool:
    """The effect has a place in the machine."""
    return i.effect is not None and bool(i.effect.nodes) and all(c.what not in MEASUREMENT for c in i.effect.changed)


def sized(i: Item) -> bool:
    """The effect is named and its heat is known."""
    return in_catalogue(i) and i.named and math.isfinite(i.concealed.heat_W) and i.concealed.heat_W > 0.0


def heat_right(i: Item) -> bool:
    """The heat of the finding is that of the effect."""
    heat = next(claim.heat_W for claim in i.answer.claims if claim.name == i.concealed.name)
    return abs(heat / i.concealed.heat_W - 1.0) <= SIZE_ERROR


RULES = (
    ScoringRule(name="false alarm", bad=True, when=nothing, right=lambda i: i.answer.alarm,
         meaning="Nothing concealed, no parameter far outside its prior: the verdict is missing_physics, sensor_fault "
                 "or unexplained."),
    ScoringRule(name="control answered right", when=nothing, right=lambda i: i.answer.verdict in i.truth.verdicts,
         meaning="The same cases: the verdict is consistent or parameter_error."),
    ScoringRule(name="far parameter named", when=lambda i: bool(i.truth.far),
         right=lambda i: i.answer.verdict == "parameter_error"
         and any(is_right(key, c, i.truth) for c in i.answer.claims for key in c.odds if key[0] == PARAMETER),
         meaning="A parameter five standard deviations off: a parameter error, that parameter among those named."),
    ScoringRule(name="verdict right", when=lambda i: i.first, right=lambda i: i.answer.verdict in i.truth.verdicts,
         meaning="All cases: the verdict is one of those that the truth allows."),
    ScoringRule(name="named", when=in_catalogue, right=lambda i: i.named,
         meaning="Effects of the catalogue: a finding has the name."),
    ScoringRule(name="named or tied", when=in_catalogue, right=lambda i: i.tied,
         meaning="Effects of the catalogue: at most three names of a finding (it and its rivals of at least 5 %) hold "
                 "the true one."),
    ScoringRule(name="acts like", when=has_effect, right=lambda i: i.alike,
         meaning="All effects: named, or the same kind of thing (loss, link, capacity, heat, sensor, input, clock) at "
                 "the same node or link is reported with the same sign."),
    ScoringRule(name="place right", when=in_machine, right=lambda i: i.located, chance=lambda i: i.located_by_chance,
         meaning="Effects in the machine: the most probable place or that of a finding is a node of the effect or "
                 "linked to it."),
    ScoringRule(name="named or tied, visible", when=lambda i: in_catalogue(i) and visible(i), right=lambda i: i.tied,
         meaning=f"Effects of the catalogue for which D_tool / 2 is {VISIBLE:.0f} nats or more: named or tied."),
    ScoringRule(name="acts like, visible", when=visible, right=lambda i: i.alike,
         meaning=f"All effects for which D_tool / 2 is {VISIBLE:.0f} nats or more: acts like."),
    ScoringRule(name="silent where nothing can be seen", when=lambda i: has_effect(i) and i.concealed.nats[1] < UNSEEN,
         right=lambda i: i.answer.answered and not i.answer.alarm,
         meaning=f"Effects for which D_tool / 2 is below {UNSEEN:.0f} nats: no fault is reported."),
    ScoringRule(name="outside: no wrong name", when=outside,
         right=lambda i: i.answer.alarm and not any(c.name and c.probability >= CERTAIN for c in i.answer.claims),
         meaning=f"Effects in no catalogue: a fault is reported, and no name of the catalogue with "
                 f"{CERTAIN:.0%} or more."),
    ScoringRule(name="heat within 20 %", when=sized, right=heat_right,
         meaning="Effects that are named and make heat: the mean heat of the finding is within 20 % of the truth."),
    ScoringRule(name="held-out error improves", when=lambda i: i.first and has_effect(i) and bool(i.answer.claims)
         and math.isfinite(i.answer.holdout_K[1]),
         right=lambda i: i.answer.holdout_K[1] < i.answer.holdout_K[0],
         meaning="Something is concealed and found: the held-out error is below that of calibration alone."),
)  # fmt: skip
