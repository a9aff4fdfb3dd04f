"""From verdicts and truths to the numbers of a proof: ``proof.json``, and all that its page shows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.proof import score
from diagnosis.proof.baselines import METHODS, NAMING
from diagnosis.proof.protocol import (
    DATA,
    DEVELOPMENT_SEEDS,
    FIRST,
    SENSORS,
    Settings,
    Task,
    kept_columns,
    mix_of,
    scoring_hash,
)
from diagnosis.proof.score import REMOVED_RULES, RULES, Answer, Count, Judged, Rule
from models.gearbox import Gearbox
from models.version import project_version

SCHEMA = 1
STATED_FALSE_ALARMS = 0.05  # what diagnose is asked for unless told otherwise
CERTAIN = 0.9  # a claim of at least this probability


def outcome(
    settings: Settings,
    gearbox: Gearbox,
    truths: Mapping[str, Mapping[str, Any]],
    records: Mapping[Task, Mapping[str, Any]],
    *,
    code: str,
    hashes: str,
    scored_as_begun: bool,
) -> dict[str, Any]:
    """All numbers of a proof.

    Parameters
    ----------
    settings : Settings
    gearbox : Gearbox
    truths : mapping of case to truth
    records : mapping of Task to what its process gave
    code : str
        Hash of the code that was tried
    hashes : str
        SHA-256 of the list of verdict hashes
    scored_as_begun : bool
        Whether the rules of judging were not changed since the cases were made

    Returns
    -------
    dict
        Ready for JSON; every share as hits, of how many, and its 95 % limits
    """
    near = score.near_nodes(gearbox)
    far = {case: score.far_of(truth, gearbox) for case, truth in truths.items()}
    measured = [f"T_{name}_degC" for name in next(iter(truths.values()))["K_all"]["train"]]
    channels = {s: [c[2:-5] for c in kept_columns(measured, s)] for s in SENSORS}

    def judged(task: Task, answer: Answer, kin: frozenset[str] = frozenset()) -> Judged:
        truth = score.seen_by(truths[task.case], channels[task.sensors])
        return Judged(case=task.case, truth=truth, answer=answer, near=near, far=far[task.case], kin=kin)

    answers = {
        task: Answer.of(record.get("said"), otherwise=record["status"])
        for task, record in records.items()
        if task.kind == "diagnose"
    }
    whole = {task: answer for task, answer in answers.items() if task.removed is None}
    main = {task.case: judged(task, answer) for task, answer in whole.items() if _cell(task) == FIRST}
    removed = [
        judged(task, answer, main[task.case].answer.tied) for task, answer in answers.items() if task not in whole
    ]
    others = {t.case: r.get("said") for t, r in records.items() if t.kind == "baselines"}
    tool = list(main.values())
    stated = score.stated_probabilities(tool)
    certain = [true for p, true in stated if p >= CERTAIN]
    return {
        "schema": SCHEMA,
        "gearbox": gearbox.name,
        "protocol": {
            "seed": settings.seed,
            "development_seeds": list(DEVELOPMENT_SEEDS),
            "on_development_seed": settings.seed in DEVELOPMENT_SEEDS,
            "cases": mix_of(settings.cases),
            "diagnoses": len(answers),
            "cells_every": settings.cells_every,
            "code_sha256": code,
            "scoring_sha256": scoring_hash(),
            "scored_as_begun": scored_as_begun,
            "gearbox_sha256": gearbox.hash,
            "verdicts_sha256": hashes,
            "version": project_version(),
            "failed": sum(record["status"] == "failed" for record in records.values()),
            "refused": sum(record["status"] == "refused" for record in records.values()),
            "processor_s": round(sum(record["seconds"] for record in records.values()), 1),
        },
        "rules": [
            *(_row(rule, tool, _methods(rule, main, others)) for rule in RULES),
            *(_row(rule, removed, {}) for rule in REMOVED_RULES),
        ],
        "methods": {key: text for key, text in METHODS.items() if _tried(key, others)},
        "cells": [
            _cell_row(sensors, data, [judged(t, a) for t, a in whole.items() if _cell(t) == (sensors, data)])
            for data in DATA for sensors in SENSORS
        ],
        "confusion": score.confusion(tool),
        "removed": [_told(j) for j in removed],
        "reliability": {
            "bins": score.reliability(stated),
            "certain": Count.over(certain).as_dict(),
            "certain_from": CERTAIN,
        },
        "false_alarms": {
            "stated": STATED_FALSE_ALARMS,
            "found": Count.over([score.false_alarm(j) for j in tool]).as_dict(),
            "by_kind": _alarms_by_kind(tool),
        },
        "held_out_K": score.errors_by_group(tool, _network_errors(others)),
        "held_out_pairs": [
            {"case": j.case, "group": j.group, "calibrated": j.answer.holdout_K[1], "after": j.answer.holdout_K[2]}
            for j in tool if math.isfinite(j.answer.holdout_K[1])
        ],
        "cases": [{**_told(j), "outcome": score.outcome_of(j)} for j in tool],
    }  # fmt: skip


def _cell(task: Task) -> tuple[str, str]:
    return task.sensors, task.data


def _row(rule: Rule, cases: Sequence[Judged], methods: Mapping[str, Count]) -> dict[str, Any]:
    count = Count.over([rule.judge(j) for j in cases])
    return {
        "key": rule.key,
        "text": rule.text,
        "rule": " ".join((rule.judge.__doc__ or "").split()),
        "needed": rule.needed,
        "at_most": rule.at_most,
        "count": count.as_dict(),
        "met": rule.met(count),
        "methods": {name: found.as_dict() for name, found in methods.items() if found.of},
    }


def _methods(
    rule: Rule, main: Mapping[str, Judged], others: Mapping[str, Mapping[str, Any] | None]
) -> dict[str, Count]:
    """The same rule for other methods; strength and held-out errors are not theirs to tell."""
    if rule.key.startswith("strength") or rule.key.endswith("evident") or rule.key in ("heldout", "far"):
        return {}
    found = {}
    for method in NAMING:
        said = {case: given[method] for case, given in others.items() if given and given.get(method)}
        cases = [
            Judged(case=j.case, truth=j.truth, answer=Answer.of(said[case]), near=j.near, far=j.far)
            for case, j in main.items()
            if case in said
        ]
        found[method] = Count.over([rule.judge(j) for j in cases])
    return found


def _tried(method: str, others: Mapping[str, Mapping[str, Any] | None]) -> bool:
    return method == "calibration" or any(given and given.get(method) for given in others.values())


def _network_errors(others: Mapping[str, Mapping[str, Any] | None]) -> dict[str, float]:
    found = {case: (given or {}).get("black_box", {}).get("rmse_K") for case, given in others.items()}
    return {case: float(error) for case, error in found.items() if error is not None}


def _cell_row(sensors: str, data: str, cases: Sequence[Judged]) -> dict[str, Any]:
    counts = score.cell_counts(cases)
    return {
        "sensors": sensors,
        "data": data,
        "cases": len(cases),
        "outcomes": {name: count.as_dict() for name, count in counts.items()},
        "consistent": Count.over([score.control_consistent(j) for j in cases]).as_dict(),
        "single": Count.over([score.single_tied(j) for j in cases]).as_dict(),
        "cannot_tell": Count.over([j.answer.verdict in score.CANNOT_TELL for j in cases]).as_dict(),
    }


def _alarms_by_kind(cases: Sequence[Judged]) -> dict[str, dict[str, Any]]:
    kinds = Counter(j.truth["control"] for j in cases if j.group == "control" and j.truth["control"] != score.FAR)
    return {
        kind: Count.over([score.false_alarm(j) for j in cases if j.truth["control"] == kind]).as_dict()
        for kind in sorted(kinds)
    }


def _told(j: Judged) -> dict[str, Any]:
    """One line for one case."""
    control = str(j.truth["control"]).replace("_", " ") + (f": {j.far}" if j.truth["control"] == score.FAR else "")
    return {
        "case": j.case,
        "group": j.group,
        "truth": [f"{e['name']} at {e['nodes'][0]}, {e['strength']:.2f} x" for e in j.truth["effects"]] or [control],
        "evidence": [round(j.answer.evidence[name], 1) if name in j.answer.evidence else None for name in j.names],
        "practical": bool(j.truth["effects"]) and j.practical(),
        "verdict": j.answer.verdict,
        "named": [
            f"{c.mechanism} at {c.place} ({c.odds[c.mechanism]:.2f})" for c in j.answer.claims
        ],
        "tied": sorted(j.answer.tied - j.answer.named),
        "kin": sorted(j.kin),
    }  # fmt: skip
