"""What counts as right, in one place, and the counts with their confidence limits.

Every rule judges one case: True, False, or None where it does not apply. An effect is *of practical size* where the
truth says that it moves a measured temperature by more than 0.3 K rms (an input by more than its ordinary error); of
smaller ones silence is right, so rules that ask for a name leave them out, and they are counted apart.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import binomtest, quantile_test

from diagnosis.proof.conceal import CONTROLS
from models.gearbox import Gearbox
from models.mechanisms import OPEN_FORM, OPEN_FORMS

CONFIDENCE = 0.95
TIE_PROBABILITY = 0.05  # from which a rival belongs to the tie set
STRENGTH_ERROR = 0.15
EVIDENT = 10.0  # nats for an effect at its best place, as the diagnosis itself weighs it: less is lost in a catalogue
SILENT = ("consistent", "insufficient_data", "refused", "failed")
CANNOT_TELL = ("insufficient_data", "refused")
NO_ANSWER = ("refused", "failed")
OPEN_NAMES = {form.name for form in OPEN_FORMS}
PARAMETER = "parameter"  # one of the definition, out of its prior
FAR, OUTSIDE, NOTHING, TO_FIND = "parameter_far", "outside the catalogue", "nothing", "to find"
# Strengths that mean the same in plant and catalogue, but for their sign; heats are compared as heats.
SAME_STRENGTH = ("sensor_bias", "sensor_gain", "sensor_lag", "clock_offset", "torque_offset", "torque_gain",
                 "speed_gain", "ambient_probe_offset")  # fmt: skip
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)


# ---------------------------------------------------------------------- counts


@dataclass(frozen=True, kw_only=True)
class Count:
    """So many of so many."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        """NaN of nothing."""
        return self.hits / self.of if self.of else math.nan

    @property
    def limits(self) -> tuple[float, float]:
        """Wilson's 95 % confidence limits of the share; 0 and 1 of nothing.

        Examples
        --------
        >>> low, high = Count(hits=57, of=60).limits
        >>> round(low, 3), round(high, 3)
        (0.863, 0.983)
        """
        if not self.of:
            return 0.0, 1.0
        interval = binomtest(self.hits, self.of).proportion_ci(CONFIDENCE, method="wilson")
        return float(interval.low), float(interval.high)

    @classmethod
    def over(cls, verdicts: Sequence[bool | None]) -> Count:
        """Of all that apply."""
        said = [v for v in verdicts if v is not None]
        return cls(hits=sum(said), of=len(said))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        low, high = self.limits
        return {"hits": self.hits, "of": self.of, "low": round(low, 4), "high": round(high, 4)}


@dataclass(frozen=True, kw_only=True)
class Median:
    """Median of numbers with its 95 % confidence limits; NaN where there are too few."""

    value: float
    low: float
    high: float
    of: int

    @classmethod
    def over(cls, values: Sequence[float]) -> Median:
        """Of all finite ones."""
        good = np.array([v for v in values if math.isfinite(v)])
        if not len(good):
            return cls(value=math.nan, low=math.nan, high=math.nan, of=0)
        # As an array: the stubs of SciPy take the interval for a number.
        low, high = np.asarray(quantile_test(good, p=0.5).confidence_interval(CONFIDENCE))
        return cls(value=float(np.median(good)), low=float(low), high=float(high), of=len(good))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        shown = {"median": self.value, "low": self.low, "high": self.high}
        return {"of": self.of, **{k: round(v, 4) if math.isfinite(v) else None for k, v in shown.items()}}


# ---------------------------------------------------------------------- answers and truths


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One thing that is claimed, and what is not ruled out beside it.

    Attributes
    ----------
    mechanism, place, node, family : str
    odds : mapping of mechanism to float
        Its own probability and its rivals', places of the same mechanism together
    parameters : mapping of str to float
        The same of parameters out of their priors, each of which is a claim of its own
    heat_W, heat_sd_W : float
        Mean magnitude, and its stated standard error
    strength, strength_sd : float
        First parameter, and its stated standard error
    """

    mechanism: str
    place: str
    node: str
    family: str
    odds: Mapping[str, float]
    parameters: Mapping[str, float] = field(default_factory=dict)
    heat_W: float
    heat_sd_W: float = math.nan
    strength: float
    strength_sd: float = math.nan

    @property
    def tied(self) -> frozenset[str]:
        """What is named, and what is not ruled out."""
        return frozenset({self.mechanism, *(m for m, p in self.odds.items() if p >= TIE_PROBABILITY)})


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What was said of one case.

    Attributes
    ----------
    verdict : str
        Of the diagnosis; ``refused`` where the recordings were not accepted, ``failed`` where there is no answer
    claims : tuple of Claim
    node : str
        Most probable place, or ``""``
    holdout_K : (float, float, float)
        Held-out error before, calibrated and after; NaN without
    unseen : frozenset of str
        Mechanisms of which is said that these data would not show them
    evidence : mapping of mechanism to float
        Best log Bayes factor over its places in the first look, [nat]; of what is not in the ranking there is none
    """

    verdict: str
    claims: tuple[Claim, ...] = ()
    node: str = ""
    holdout_K: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    unseen: frozenset[str] = frozenset()
    evidence: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, said: Mapping[str, Any] | None, *, otherwise: str = "failed") -> Answer:
        """From what is in ``diagnosis.json``."""
        if said is None:
            return cls(verdict=otherwise)
        errors = said.get("fit", {}).get("holdout", {})
        values = [errors.get(f"rmse_{stage}_K") for stage in ("before", "calibrated", "after")]
        before, calibrated, after = (math.nan if v is None else float(v) for v in values)
        location = said.get("location", [])
        evidence: dict[str, float] = {}
        for row in said.get("ranking", []):
            evidence[row["mechanism"]] = max(row["log_bayes"], evidence.get(row["mechanism"], -math.inf))
        return cls(
            verdict=said["verdict"],
            claims=tuple(_claim(finding) for finding in said.get("findings", [])),
            node=location[0]["node"] if location else "",
            holdout_K=(before, calibrated, after),
            unseen=frozenset(one["mechanism"] for one in said.get("not_visible", [])),
            evidence=evidence,
        )

    @property
    def silent(self) -> bool:
        """Whether nothing is claimed to be amiss."""
        return self.verdict in SILENT

    @property
    def unnamed(self) -> bool:
        """Whether something is amiss, and no name of the catalogue (nor a parameter) is given for it."""
        return not self.silent and not self.known

    @property
    def partly(self) -> bool:
        """Whether a name is given, and said that it does not explain everything."""
        return bool(self.known) and self.verdict == "unexplained"

    @property
    def known(self) -> frozenset[str]:
        """What is named, of all claims, but for open forms."""
        return frozenset(claim.mechanism for claim in self.claims if claim.family != OPEN_FORM)

    @property
    def named(self) -> frozenset[str]:
        """What is named, of all claims."""
        return frozenset(claim.mechanism for claim in self.claims)

    @property
    def tied(self) -> frozenset[str]:
        """What is named or not ruled out, of all claims."""
        return frozenset().union(*(claim.tied for claim in self.claims))


def _claim(finding: Mapping[str, Any]) -> Claim:
    odds: Counter[str] = Counter()
    off: Counter[str] = Counter()
    for one in (finding, *finding.get("confusable_with", [])):
        odds[one["mechanism"]] += one["probability"]
        if one["mechanism"] == PARAMETER:
            off[one["place"]] += one["probability"]
    parameters, heat = finding.get("parameters", []), finding.get("heat_W", {})
    first = parameters[0] if parameters else {}
    return Claim(
        mechanism=finding["mechanism"], place=finding["place"], node=finding["node"], family=finding["family"],
        odds=dict(odds), parameters=dict(off),
        heat_W=heat.get("mean", math.nan), heat_sd_W=heat.get("stderr", math.nan),
        strength=first.get("value", math.nan), strength_sd=first.get("stderr", math.nan),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Judged:
    """An answer beside the truth.

    Attributes
    ----------
    case : str
    truth : mapping
        See :func:`diagnosis.proof.truth.truth_of`
    answer : Answer
    near : mapping of node to set of str
        The node itself and those that share a heat path with it
    far : str
        Parameter that is farthest from its nominal value, in standard deviations
    kin : frozenset of str
        What the same recordings do not rule out with the whole catalogue, where a mechanism was removed
    """

    case: str
    truth: Mapping[str, Any]
    answer: Answer
    near: Mapping[str, frozenset[str]]
    far: str
    kin: frozenset[str] = frozenset()

    @property
    def group(self) -> str:
        """Of the case."""
        return str(self.truth["group"])

    @property
    def answered(self) -> bool:
        """Whether there is an answer at all."""
        return self.answer.verdict not in NO_ANSWER

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects, the dominant one first."""
        return tuple(effect["name"] for effect in self.truth["effects"])

    def practical(self, k: int = 0) -> bool:
        """Whether an effect is large enough to matter; where the truth does not know, it is taken to be."""
        return self.truth["practical"][k] is not False

    def evident(self) -> bool:
        """Whether these data speak for the dominant effect, as the diagnosis itself weighs it in its first look."""
        return bool(self.names) and self.answer.evidence.get(self.names[0], math.inf) >= EVIDENT

    def right(self) -> bool | None:
        """Whether the main thing is said; None where nothing need be said."""
        if self.group == "control":
            return far_parameter(self) if self.truth["control"] == FAR else control_consistent(self)
        if not self.practical():
            return None
        return self.answer.unnamed if self.group == "outside" else self.names[0] in self.answer.tied


# ---------------------------------------------------------------------- rules


def control_consistent(j: Judged) -> bool | None:
    """Nothing concealed, every parameter inside its prior (or noise or lag misstated): the verdict is consistent."""
    if j.group != "control" or j.truth["control"] == FAR:
        return None
    return j.answer.verdict == "consistent"


def false_alarm(j: Judged) -> bool | None:
    """Of the same cases: anything is claimed to be amiss."""
    if j.group != "control" or j.truth["control"] == FAR or not j.answered:
        return None
    return not j.answer.silent


def far_parameter(j: Judged) -> bool | None:
    """A parameter five standard deviations off, nothing else: a parameter error, that parameter among those named."""
    if j.group != "control" or j.truth["control"] != FAR:
        return None
    places = {claim.place for claim in j.answer.claims if claim.mechanism == PARAMETER}
    return j.answer.verdict == "parameter_error" and j.far in places


def single_tied(j: Judged) -> bool | None:
    """One effect of practical size: named, or in the tie set (a rival of at least 5 %)."""
    if j.group != "single" or not j.practical():
        return None
    return j.names[0] in j.answer.tied


def single_exact(j: Judged) -> bool | None:
    """One effect of practical size: the first thing that is named."""
    if j.group != "single" or not j.practical():
        return None
    return bool(j.answer.claims) and j.answer.claims[0].mechanism == j.names[0]


def single_answered(j: Judged) -> bool | None:
    """One effect of practical size: named or tied; or nothing is said but that these data would not show it."""
    if j.group != "single" or not j.practical():
        return None
    return j.names[0] in j.answer.tied or (j.answer.silent and j.names[0] in j.answer.unseen)


def single_evident(j: Judged) -> bool | None:
    """One effect of practical size that the first look itself scored with 10 nats or more: named, or in the tie set."""
    return single_tied(j) if j.evident() else None


def single_small(j: Judged) -> bool | None:
    """One effect too small to matter: nothing of the catalogue is named without it."""
    if j.group != "single" or j.practical() or not j.answered:
        return None
    return all(j.names[0] in claim.tied for claim in j.answer.claims if claim.family != OPEN_FORM)


def near_place(j: Judged) -> bool | None:
    """One effect of practical size, something claimed: the most probable place is its node or one linked to it.

    Effects on an input (torque, ambient) have no node and are left out.
    """
    if j.group != "single" or not j.practical() or j.answer.silent:
        return None
    nodes = [node for node in j.truth["effects"][0]["nodes"] if node in j.near]
    if not nodes:
        return None
    return any(j.answer.node in j.near[node] for node in nodes)


def exact_place(j: Judged) -> bool | None:
    """The same cases: the most probable place is a node of the effect itself."""
    if near_place(j) is None:
        return None
    return j.answer.node in j.truth["effects"][0]["nodes"]


def _strengths(j: Judged) -> tuple[float, float, float] | None:
    """Of one effect, exactly named: how strong it is said to be, the stated error, and the truth."""
    if j.group not in ("single", "sensor") or not j.practical() or not j.answer.claims:
        return None
    claim, effect = j.answer.claims[0], j.truth["effects"][0]
    if claim.mechanism != effect["name"]:
        return None
    if effect["name"] in SAME_STRENGTH:
        return abs(claim.strength), claim.strength_sd, abs(float(effect["parameters"]["a"]))
    if effect["kind"] == "signal" or j.group == "sensor":
        return None
    return claim.heat_W, claim.heat_sd_W, float(effect["heat_magnitude_W"]["train"])


def strength(j: Judged) -> bool | None:
    """One effect, exactly named: its mean heat (of a fault of measurement, its size) within 15 % of the truth."""
    said = _strengths(j)
    return None if said is None else abs(said[0] - said[2]) <= STRENGTH_ERROR * said[2]


def strength_as_stated(j: Judged) -> bool | None:
    """The same cases: within twice the standard error that the diagnosis states."""
    said = _strengths(j)
    return None if said is None or not math.isfinite(said[1]) else abs(said[0] - said[2]) <= 2.0 * said[1]


def both_of_two(j: Judged) -> bool | None:
    """Two effects, both of practical size: both named or tied."""
    if j.group != "double" or not (j.practical(0) and j.practical(1)):
        return None
    return set(j.names) <= j.answer.tied


def one_of_two(j: Judged) -> bool | None:
    """Two effects, both of practical size: at least one named or tied."""
    if j.group != "double" or not (j.practical(0) and j.practical(1)):
        return None
    return bool(set(j.names) & j.answer.tied)


def dominant_first(j: Judged) -> bool | None:
    """One dominant effect among six minor ones: the first claim names it or ties it."""
    if j.group != "messy" or not j.practical():
        return None
    return bool(j.answer.claims) and j.names[0] in j.answer.claims[0].tied


def sensor_named(j: Judged) -> bool | None:
    """A fault of measurement of practical size: named or tied."""
    if j.group != "sensor" or not j.practical():
        return None
    return j.names[0] in j.answer.tied


def sensor_evident(j: Judged) -> bool | None:
    """A fault of measurement that the first look itself scored with 10 nats or more: named or tied."""
    return sensor_named(j) if j.evident() else None


def outside_unnamed(j: Judged) -> bool | None:
    """Practical size, in no catalogue: called unexplained or an open form, and nothing of the catalogue named."""
    if j.group != "outside" or not j.practical():
        return None
    return j.answer.unnamed


def outside_forced(j: Judged) -> bool | None:
    """In no catalogue, of any size: something of the catalogue is named, or a parameter."""
    if j.group != "outside" or not j.answered:
        return None
    return bool(j.answer.known)


def outside_partly(j: Judged) -> bool | None:
    """Of these: said as well that it does not explain everything."""
    return j.answer.partly if outside_forced(j) else None


def removed_unnamed(j: Judged) -> bool | None:
    """Practical size, its entry removed: called unexplained or an open form, and nothing of the catalogue named."""
    return j.answer.unnamed if j.practical() else None


def removed_kin(j: Judged) -> bool | None:
    """Practical size, its entry removed: only what the whole catalogue does not rule out on these recordings either."""
    if not j.practical():
        return None
    return bool(j.answer.known) and j.answer.known <= j.kin


def removed_forced(j: Judged) -> bool | None:
    """Its entry removed, of any size: something else of the catalogue is named, and no kin."""
    return not j.answer.known <= j.kin if j.answered else None


def removed_partly(j: Judged) -> bool | None:
    """Of these: said as well that it does not explain everything."""
    return j.answer.partly if removed_forced(j) else None


def heldout_better(j: Judged) -> bool | None:
    """Something of practical size is there and claimed: the held-out error is below that of calibration alone."""
    _, calibrated, after = j.answer.holdout_K
    if j.group == "control" or not j.practical() or not j.answer.claims or not math.isfinite(after):
        return None
    return after < calibrated


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A row of the table.

    Attributes
    ----------
    key, text : str
    judge : callable
    needed : float or None
        Share that is asked for; None where nothing is
    at_most : bool
        Whether it must stay below instead
    """

    key: str
    text: str
    judge: Callable[[Judged], bool | None]
    needed: float | None = None
    at_most: bool = False

    def met(self, count: Count) -> bool | None:
        """Whether the share is what is asked for; None where nothing is asked or counted."""
        if self.needed is None or not count.of:
            return None
        return count.share <= self.needed if self.at_most else count.share >= self.needed


RULES = (
    Rule(key="consistent", text="consistent recordings called consistent", judge=control_consistent, needed=0.95),
    Rule(key="false_alarm", text="false alarms", judge=false_alarm, needed=0.05, at_most=True),
    Rule(key="far", text="parameter far off: called so, and which", judge=far_parameter),
    Rule(key="single_tied", text="single effect named or in the tie set", judge=single_tied, needed=0.95),
    Rule(key="single_exact", text="single effect named exactly", judge=single_exact, needed=0.85),
    Rule(key="single_answered", text="single effect named, tied, or said to be invisible in these data",
         judge=single_answered),
    Rule(key="single_evident", text="single effect that the first look scores with 10 nats: named or in the tie set",
         judge=single_evident),
    Rule(key="single_small", text="single effect too small to matter: no other named", judge=single_small),
    Rule(key="place", text="place right, or next to it", judge=near_place, needed=0.95),
    Rule(key="place_exact", text="place right exactly", judge=exact_place),
    Rule(key="strength", text="strength within 15 %", judge=strength, needed=0.90),
    Rule(key="strength_as_stated", text="strength within twice the stated error", judge=strength_as_stated),
    Rule(key="both", text="two effects: both", judge=both_of_two, needed=0.75),
    Rule(key="one", text="two effects: at least one", judge=one_of_two, needed=0.95),
    Rule(key="messy", text="one dominant, six minor: the dominant one first", judge=dominant_first),
    Rule(key="sensor", text="fault of measurement named or in the tie set", judge=sensor_named, needed=0.90),
    Rule(key="sensor_evident", judge=sensor_evident,
         text="fault of measurement that the first look scores with 10 nats: named or in the tie set"),
    Rule(key="outside", text="outside the catalogue: said to be so", judge=outside_unnamed),
    Rule(key="outside_forced", text="outside the catalogue: forced into a name", judge=outside_forced, needed=0.0,
         at_most=True),
    Rule(key="outside_partly", text="of those: said as well that more is missing", judge=outside_partly),
    Rule(key="heldout", text="held-out error improves on calibration", judge=heldout_better),
)  # fmt: skip
REMOVED_RULES = (
    Rule(key="removed", text="entry removed: said to be outside the catalogue", judge=removed_unnamed),
    Rule(key="removed_kin", text="entry removed: only a kin named that was tied before", judge=removed_kin),
    Rule(key="removed_forced", text="entry removed: forced into another name", judge=removed_forced, needed=0.0,
         at_most=True),
    Rule(key="removed_partly", text="entry removed, of those: said as well that more is missing",
         judge=removed_partly),
)  # fmt: skip


# ---------------------------------------------------------------------- tables


def near_nodes(gearbox: Gearbox) -> dict[str, frozenset[str]]:
    """Every part of the network with those that share a heat path with it."""
    network = gearbox.network()
    parts = [part.name for part in network.parts]
    ends = [link.nodes for link in network.links]
    return {p: frozenset({p, *(n for nodes in ends if p in nodes for n in nodes if n in parts)}) for p in parts}


def far_of(truth: Mapping[str, Any], gearbox: Gearbox) -> str:
    """The parameter that is farthest from its nominal value, in standard deviations of its prior."""

    def distance(name: str) -> float:
        sd = min(gearbox.priors.get(f"factors.{name}", 0.2), 0.6)
        return abs(math.log(truth["base_parameters"][name] / gearbox.factors[name])) / sd

    return str(max(truth["base_parameters"], key=distance))


def outcome_of(j: Judged) -> str:
    """Short word for what became of a case: right, cannot tell, missed, false name, nothing to find."""
    if j.answer.verdict == "failed":
        return "failed"
    right = j.right()
    if right:
        return "right"
    if j.answer.verdict in CANNOT_TELL:
        return "cannot tell"
    if right is None:
        return "nothing to find" if j.answer.silent else "small, yet something claimed"
    return "missed" if j.answer.silent else "wrong"


OUTCOMES = ("right", "cannot tell", "missed", "wrong", "failed")


def cell_counts(cases: Sequence[Judged]) -> dict[str, Count]:
    """Outcomes of one cell, of all cases in which there is something to be right about."""
    found = Counter(outcome_of(j) for j in cases)
    total = sum(found[name] for name in OUTCOMES)
    return {name: Count(hits=found[name], of=total) for name in OUTCOMES}


def seen_by(truth: Mapping[str, Any], channels: Sequence[str]) -> Mapping[str, Any]:
    """The truth as far as a set of sensors is touched by it: a fault of a sensor that is not there is none.

    Parameters
    ----------
    truth : mapping
    channels : sequence of str
        Temperatures that are recorded
    """
    effects = truth["effects"]
    if truth["group"] != "sensor" or effects[0]["kind"] != "sensor" or effects[0]["nodes"][0] == "clock":
        return truth
    if set(effects[0]["nodes"]) & set(channels):
        return truth
    return {**truth, "group": "control", "control": CONTROLS[0], "effects": [], "practical": []}


def label_of(j: Judged) -> str:
    """What is true of a case in a word, for the confusion matrix."""
    if j.group == "control":
        return f"{NOTHING} ({j.truth['control'].replace('_', ' ')})"
    label = OUTSIDE if j.group == "outside" else j.names[0]
    return label if j.practical() else f"{label} (small)"


def said_of(j: Judged) -> str:
    """What is said first, for the confusion matrix; the right name where it is anywhere among the claims."""
    if j.answer.silent:
        return j.answer.verdict.replace("_", " ")
    if j.answer.unnamed and not set(j.names) & j.answer.named:
        return "not in the catalogue"
    own = [name for name in j.names if name in j.answer.named]
    return own[0] if own and j.names[0] == own[0] else j.answer.claims[0].mechanism


def confusion(cases: Sequence[Judged]) -> dict[str, dict[str, int]]:
    """How often what was said of what; controls, singles, faults of measurement and effects outside the catalogue."""
    found: dict[str, Counter[str]] = {}
    for j in cases:
        if j.group in ("control", "single", "sensor", "outside"):
            found.setdefault(label_of(j), Counter())[said_of(j)] += 1
    return {label: dict(counts) for label, counts in sorted(found.items())}


def stated_probabilities(cases: Sequence[Judged]) -> list[tuple[float, bool]]:
    """Every probability that was stated, and whether it was right.

    A mechanism is right if it is among the case's effects, a parameter if it is the one that is far off, an open form
    if what is hidden is in no catalogue.
    """
    stated: list[tuple[float, bool]] = []
    for j in cases:
        for claim in j.answer.claims:
            stated += [(p, _is_there(j, name)) for name, p in claim.odds.items() if name != PARAMETER]
            stated += [(p, j.truth["control"] == FAR and name == j.far) for name, p in claim.parameters.items()]
    return [(min(probability, 1.0), right) for probability, right in stated]


def _is_there(j: Judged, name: str) -> bool:
    return j.group == "outside" if name in OPEN_NAMES else name in j.names


def reliability(stated: Sequence[tuple[float, bool]]) -> list[dict[str, Any]]:
    """Stated probabilities in bins, each with how many were right."""
    rows = []
    for low, high in pairwise(BINS):
        inside = [(p, true) for p, true in stated if low <= p < high or (high == BINS[-1] and p == high)]
        count = Count(hits=sum(true for _, true in inside), of=len(inside))
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        rows.append({"from": low, "to": high, "mean_stated": mean, "right": count.as_dict()})
    return rows


def errors_by_group(cases: Sequence[Judged], network_K: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    """Median held-out errors of every group: as delivered, calibrated, with what was found, and of a residual network.

    Parameters
    ----------
    cases : sequence of Judged
    network_K : mapping of case to float
        Error of the black-box network, where it was tried
    """
    groups: dict[str, list[Judged]] = {}
    for j in cases:
        groups.setdefault(j.group, []).append(j)
    groups[TO_FIND] = [j for j in cases if j.group != "control" and j.practical()]
    result = {}
    for group, members in groups.items():
        columns = {
            stage: [j.answer.holdout_K[k] for j in members] for k, stage in enumerate(("before", "calibrated", "after"))
        }
        columns["black_box"] = [network_K.get(j.case, math.nan) for j in members]
        result[group] = {stage: Median.over(values).as_dict() for stage, values in columns.items()}
    return result
