"""Tables of a proof: outcomes, confusion, stated probabilities, held-out errors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from diagnosis.proof.cases.concealed_case import CONTROLS
from diagnosis.proof.scoring.answers import CANNOT_TELL, PARAMETER
from diagnosis.proof.scoring.counts import Count, Median
from diagnosis.proof.scoring.rules import FAR, ScoredCase
from models.assembly.gearbox import Gearbox
from models.mechanisms import OPEN_FORMS

OUTCOMES = ("right", "cannot tell", "missed", "wrong", "failed")
OPEN_NAMES = {form.name for form in OPEN_FORMS}
OUTSIDE, NOTHING, TO_FIND = "outside the catalogue", "nothing", "to find"
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)


def near_nodes(gearbox: Gearbox) -> dict[str, frozenset[str]]:
    """Each part of the network with the parts that share a heat path with it."""
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


def outcome_of(j: ScoredCase) -> str:
    """Outcome of a case in a word; one of :data:`OUTCOMES` if it has something to find."""
    if j.answer.verdict == "failed":
        return "failed"
    right = j.right
    if right:
        return "right"
    if j.answer.verdict in CANNOT_TELL:
        return "cannot tell"
    if right is None:
        return "nothing to find" if j.answer.silent else "small, yet something claimed"
    return "missed" if j.answer.silent else "wrong"


def cell_counts(cases: Sequence[ScoredCase]) -> dict[str, Count]:
    """Counts of the outcomes among the cases with something to find."""
    found = Counter(outcome_of(j) for j in cases)
    total = sum(found[name] for name in OUTCOMES)
    return {name: Count(hits=found[name], of=total) for name in OUTCOMES}


def seen_by(truth: Mapping[str, Any], channels: Sequence[str]) -> Mapping[str, Any]:
    """Truth for a set of sensors: a fault of a sensor that is not recorded makes the case a control.

    Parameters
    ----------
    truth : mapping
    channels : sequence of str
        Recorded temperatures
    """
    effects = truth["effects"]
    if truth["group"] != "sensor" or effects[0]["kind"] != "sensor" or effects[0]["nodes"][0] == "clock":
        return truth
    if set(effects[0]["nodes"]) & set(channels):
        return truth
    return {**truth, "group": "control", "control": CONTROLS[0], "effects": [], "practical": []}


def label_of(j: ScoredCase) -> str:
    """Row of the confusion matrix: the truth in a word."""
    if j.group == "control":
        return f"{NOTHING} ({j.truth['control'].replace('_', ' ')})"
    label = OUTSIDE if j.group == "outside" else j.names[0]
    return label if j.practical() else f"{label} (small)"


def said_of(j: ScoredCase) -> str:
    """Column of the confusion matrix: the first name given, or the right name if any claim has it."""
    if j.answer.silent:
        return j.answer.verdict.replace("_", " ")
    if j.answer.unnamed and not set(j.names) & j.answer.named:
        return "not in the catalogue"
    own = [name for name in j.names if name in j.answer.named]
    return own[0] if own and j.names[0] == own[0] else j.answer.claims[0].mechanism


def confusion(cases: Sequence[ScoredCase]) -> dict[str, dict[str, int]]:
    """Confusion counts of controls, singles, faults of measurement and effects outside the catalogue."""
    found: dict[str, Counter[str]] = {}
    for j in cases:
        if j.group in ("control", "single", "sensor", "outside"):
            found.setdefault(label_of(j), Counter())[said_of(j)] += 1
    return {label: dict(counts) for label, counts in sorted(found.items())}


def stated_probabilities(cases: Sequence[ScoredCase]) -> list[tuple[float, bool]]:
    """Every stated probability, and True if its claim is right.

    A mechanism is right if it is among the case's effects, a parameter if it is the one that is far off, an open form
    if the hidden effect is in no catalogue.
    """
    stated: list[tuple[float, bool]] = []
    for j in cases:
        for claim in j.answer.claims:
            stated += [(p, _is_there(j, name)) for name, p in claim.odds.items() if name != PARAMETER]
            stated += [(p, j.truth["control"] == FAR and name == j.far) for name, p in claim.parameters.items()]
    return [(min(probability, 1.0), right) for probability, right in stated]


def _is_there(j: ScoredCase, name: str) -> bool:
    return j.group == "outside" if name in OPEN_NAMES else name in j.names


def reliability(stated: Sequence[tuple[float, bool]]) -> list[dict[str, Any]]:
    """Stated probabilities in bins, each with the count of right ones."""
    rows = []
    for low, high in pairwise(BINS):
        inside = [(p, true) for p, true in stated if low <= p < high or (high == BINS[-1] and p == high)]
        count = Count(hits=sum(true for _, true in inside), of=len(inside))
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        rows.append({"from": low, "to": high, "mean_stated": mean, "right": count.as_dict()})
    return rows


def errors_by_group(cases: Sequence[ScoredCase]) -> dict[str, dict[str, Any]]:
    """Median held-out errors of every group: as delivered, calibrated, with the findings."""
    groups: dict[str, list[ScoredCase]] = {}
    for j in cases:
        groups.setdefault(j.group, []).append(j)
    groups[TO_FIND] = [j for j in cases if j.group != "control" and j.practical()]
    result = {}
    for group, members in groups.items():
        columns = {
            stage: [j.answer.holdout_K[k] for j in members] for k, stage in enumerate(("before", "calibrated", "after"))
        }
        result[group] = {stage: Median.over(values).as_dict() for stage, values in columns.items()}
    return result
