"""Scores of a set of answers: counts with exact limits by kind of plant, claims, misses and time, ready for JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import binomtest

from diagnosis.proof.scoring.answers import CERTAIN, read_answer
from diagnosis.proof.scoring.lines import ProofSettings, Task, kept_columns
from diagnosis.proof.scoring.rules import RULES, Item, ScoringRule, is_right
from diagnosis.proof.scoring.seeds import role_of
from diagnosis.proof.scoring.truth import Truth
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError

SCHEMA = 3
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
ALL = "all"


def outcome(
    truths: Mapping[str, Truth],
    records: Mapping[Task, Mapping[str, Any]],
    gearbox: Gearbox,
    *,
    settings: ProofSettings | None = None,
    code: str = "",
) -> dict[str, Any]:
    """Score all answers.

    Parameters
    ----------
    truths : mapping of case to Truth
    records : mapping of Task to mapping
        ``status``, ``seconds`` and ``answer`` of each diagnosis
    gearbox : Gearbox
        Nominal definition of cases whose truth names no other
    code : str
        Hash of the code that decided

    Returns
    -------
    dict
        Ready for JSON

    Raises
    ------
    InputError
        If a case has no truth.
    """
    unknown = [task.case for task in records if task.case not in truths]
    if unknown:
        raise InputError(f"case {unknown[0]!r} has an answer but no truth; the truth is of another set")
    machines = {name: load_gearbox(name) for name in {truth.machine for truth in truths.values()} if name}
    machines[""] = gearbox
    near = {name: near_nodes(machine) for name, machine in machines.items()}
    groups: dict[str, list[Item]] = {}
    seconds: dict[str, list[float]] = {}
    for task, record in records.items():
        truth = _seen(truths[task.case], task)
        answer = read_answer(record["answer"], machines[truth.machine], otherwise=record["status"])
        name = ", ".join(filter(None, (truth.plant, task.cell)))
        effects = truth.effects or (None,)
        groups.setdefault(name, []).extend(
            Item(case=task.case, truth=truth, effect=effect, answer=answer, near=near[truth.machine], first=k == 0)
            for k, effect in enumerate(effects)
        )
        if "seconds" in record:
            # On a machine with other work processor time is what a diagnosis costs; older lines lack it.
            seconds.setdefault(name, []).append(record.get("processor_s") or record["seconds"])
    whole = [item for name, items in groups.items() if "," not in name for item in items]
    tables = {ALL: whole, **groups} if len(groups) > 1 else groups
    return {
        "schema": SCHEMA,
        "gearbox": gearbox.name,
        "settings": None if settings is None else vars(settings),
        "role_of_seed": None if settings is None else role_of(settings.plant, settings.seed),
        "code": code,
        "cases": {name: len({item.case for item in items}) for name, items in tables.items()},
        "failed": sum(record["status"] != "answered" for record in records.values()),
        "rules": [
            {"name": rule.name, "meaning": rule.meaning, "bad": rule.bad,
             "counts": {n: _counted(rule, items) for n, items in tables.items()}}
            for rule in RULES
        ],
        "claims": {n: count([right for p, right in stated(items) if p >= CERTAIN]) for n, items in tables.items()},
        "reliability": reliability(stated(whole)),
        "seconds": {n: {"median": float(np.median(s)), "max": max(s)} for n, s in seconds.items()},
        "misses": [_row(item) for item in sorted(whole, key=lambda i: i.case) if _missed(item)],
        "lines": [_row(item) for items in groups.values() for item in items],
    }  # fmt: skip


def _counted(rule: ScoringRule, items: Sequence[Item]) -> dict[str, Any]:
    """Hits of a rule; where a random answer may be right, also how often it would be."""
    asked = [item for item in items if rule.when(item)]
    counted = count([rule.right(item) for item in asked])
    if rule.chance is None or not asked:
        return counted
    return counted | {"chance": round(float(np.mean([rule.chance(item) for item in asked])), 4)}


def near_nodes(gearbox: Gearbox) -> dict[str, frozenset[str]]:
    """Each part of the network with the parts that share a heat path with it."""
    network = gearbox.network()
    parts = [part.name for part in network.parts]
    ends = [link.nodes for link in network.links]
    return {p: frozenset({p, *(n for nodes in ends if p in nodes for n in nodes if n in parts)}) for p in parts}


def count(verdicts: Sequence[bool]) -> dict[str, Any]:
    """Hits among cases with the exact (Clopper and Pearson) 95 % limits of their share.

    Examples
    --------
    >>> count([True] * 5 + [False])
    {'hits': 5, 'of': 6, 'low': 0.3588, 'high': 0.9958}
    """
    hits, of = sum(map(bool, verdicts)), len(verdicts)
    limits = binomtest(hits, of).proportion_ci(0.95, method="exact") if of else (0.0, 1.0)
    return {"hits": hits, "of": of, "low": round(float(limits[0]), 4), "high": round(float(limits[1]), 4)}


def stated(items: Sequence[Item]) -> list[tuple[float, bool]]:
    """Every stated probability of a name, and True if the name is right."""
    return [
        (min(p, 1.0), is_right(key, claim, item.truth))
        for item in items if item.first for claim in item.answer.claims for key, p in claim.odds.items()
    ]  # fmt: skip


def reliability(probabilities: Sequence[tuple[float, bool]]) -> list[dict[str, Any]]:
    """Stated probabilities in bins, each with the count of right ones."""
    rows = []
    for low, high in pairwise(BINS):
        inside = [(p, right) for p, right in probabilities if low <= p < high or p == high == BINS[-1]]
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        rows.append({"from": low, "to": high, "stated": mean, **count([right for _, right in inside])})
    return rows


def _seen(truth: Truth, task: Task) -> Truth:
    if task.removed:
        return truth.without_entry()
    columns = kept_columns([f"T_{name}_degC" for name in truth.channels], task.sensors)
    return truth.seen_with([c[2:-5] for c in columns]) if task.cell else truth


def _missed(item: Item) -> bool:
    if item.effect is None:
        return item.answer.verdict not in item.truth.verdicts
    return not item.found


def _row(item: Item) -> dict[str, Any]:
    effect, answer = item.effect, item.answer
    nats = effect.nats if effect else (math.nan, math.nan)
    return {
        "case": item.case,
        "plant": item.truth.plant,
        "group": item.truth.group,
        "truth": _label(item),
        "D_plant_nats": nats[0] if math.isfinite(nats[0]) else None,
        "D_tool_nats": nats[1] if math.isfinite(nats[1]) else None,
        "verdict": answer.verdict,
        "answer": [f"{c.mechanism} at {c.place} ({c.probability:.2f})" for c in answer.claims],
        "found": not _missed(item),
    }


def _label(item: Item) -> str:
    if item.effect is None:
        return f"nothing, {item.truth.far} far off" if item.truth.far else "nothing"
    places = ", ".join(dict.fromkeys(one.of for one in item.effect.changed))
    return f"{item.effect.label} at {places}" + (f", {item.effect.course}" if item.effect.course else "")


def tables_of(result: Mapping[str, Any], kinds: Sequence[str]) -> list[tuple[str, list[str], list[list[str]]]]:
    """Title, header and rows of the tables that are printed and published, with a column per kind of plant."""
    rules = [
        [rule["name"], *(_share(rule["counts"][kind]) for kind in kinds)]
        for rule in result["rules"] if any(rule["counts"][kind]["of"] for kind in kinds)
    ]  # fmt: skip
    rules.append([f"claims of {CERTAIN} and more that are right", *(_share(result["claims"][kind]) for kind in kinds)])
    time = result["seconds"]
    if time:
        times = [f"{time[k]['median']:.0f} s ({time[k]['max']:.0f} s)" if k in time else "" for k in kinds]
        rules.append(["time per case, median (longest)", *times])
    bins = [
        [f"{b['from']:.1f} to {b['to']:.1f}", "" if b["stated"] is None else f"{b['stated']:.2f}", _share(b)]
        for b in result["reliability"]
    ]
    misses = [
        [m["case"], m["group"], m["truth"], m["verdict"].replace("_", " "), "; ".join(m["answer"]) or "-",
         _nats(m["D_plant_nats"]), _nats(m["D_tool_nats"])]
        for m in result["misses"]
    ]  # fmt: skip
    header = ["rule", *(f"{k} ({result['cases'][k]} cases)" for k in kinds)]
    return [
        ("Right, of all, with exact 95 % limits", header, rules),
        ("Stated probabilities", ["stated", "mean", "right"], bins),
        ("Misses, with the nats (D / 2) that the recordings hold",
         ["case", "group", "truth", "verdict", "answer", "plant", "tool"], misses),
    ]  # fmt: skip


def _share(c: Mapping[str, Any]) -> str:
    if not c["of"]:
        return "-"
    chance = f"; {100 * c['chance']:.0f} % by chance" if "chance" in c else ""
    return f"{c['hits']}/{c['of']} ({100 * c['low']:.0f} to {100 * c['high']:.0f} %{chance})"


def _nats(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
