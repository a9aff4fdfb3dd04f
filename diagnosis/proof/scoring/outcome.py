"""Numbers of a proof from answers and truths: ``proof.json``, and everything that its page shows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.proof.scoring import score
from diagnosis.proof.scoring.answers import CANNOT_TELL, Answer
from diagnosis.proof.scoring.counts import Count
from diagnosis.proof.scoring.protocol import (
    DATA,
    DEVELOPMENT_SEEDS,
    FIRST,
    SENSORS,
    Settings,
    Task,
    kept_columns,
    mix_of,
)
from diagnosis.proof.scoring.rules import BY_KEY, FAR, REMOVED_RULES, RULES, Rule, ScoredCase
from models.assembly.gearbox import Gearbox
from models.base.version import project_version

SCHEMA = 2
STATED_FALSE_ALARMS = 0.05  # default of diagnose
CERTAIN = 0.9  # a claim of at least this probability


def outcome(
    settings: Settings,
    gearbox: Gearbox,
    truths: Mapping[str, Mapping[str, Any]],
    records: Mapping[Task, Mapping[str, Any]],
    *,
    code: str,
    hashes: str,
) -> dict[str, Any]:
    """Score all answers of a proof.

    Parameters
    ----------
    settings : Settings
    gearbox : Gearbox
    truths : mapping of case to truth
    records : mapping of Task to the record of its process, see :func:`builder.workflows.prove.run_task`
    code : str
        SHA-256 of the code
    hashes : str
        SHA-256 of the list of hashes of the answers

    Returns
    -------
    dict
        Ready for JSON; every share as hits, number of cases and 95 % limits
    """
    near = score.near_nodes(gearbox)
    far = {case: score.far_of(truth, gearbox) for case, truth in truths.items()}
    measured = [f"T_{name}_degC" for name in next(iter(truths.values()))["K_all"]["train"]]
    channels = {s: [c[2:-5] for c in kept_columns(measured, s)] for s in SENSORS}

    def scored(task: Task, answer: Answer, kin: frozenset[str] = frozenset()) -> ScoredCase:
        truth = score.seen_by(truths[task.case], channels[task.sensors])
        return ScoredCase(case=task.case, truth=truth, answer=answer, near=near, far=far[task.case], kin=kin)

    answers = {task: Answer.of(record["answer"], otherwise=record["status"]) for task, record in records.items()}
    whole = {task: answer for task, answer in answers.items() if task.removed is None}
    main = {task.case: scored(task, answer) for task, answer in whole.items() if _cell(task) == FIRST}
    removed = [
        scored(task, answer, main[task.case].answer.tied) for task, answer in answers.items() if task not in whole
    ]
    tool = list(main.values())
    stated = score.stated_probabilities(tool)
    false_alarm = BY_KEY["false_alarm"]
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
            "gearbox_sha256": gearbox.hash,
            "answers_sha256": hashes,
            "version": project_version(),
            "failed": sum(record["status"] == "failed" for record in records.values()),
            "refused": sum(record["status"] == "refused" for record in records.values()),
            "processor_s": round(sum(record["seconds"] for record in records.values()), 1),
        },
        "rules": [
            *(_row(rule, tool) for rule in RULES),
            *(_row(rule, removed) for rule in REMOVED_RULES),
        ],
        "cells": [
            _cell_row(sensors, data, [scored(t, a) for t, a in whole.items() if _cell(t) == (sensors, data)])
            for data in DATA for sensors in SENSORS
        ],
        "confusion": score.confusion(tool),
        "removed": [_case_row(c) for c in removed],
        "reliability": {
            "bins": score.reliability(stated),
            "certain": Count.over(certain).as_dict(),
            "certain_from": CERTAIN,
        },
        "false_alarms": {
            "stated": STATED_FALSE_ALARMS,
            "found": Count.over([false_alarm.apply(c) for c in tool]).as_dict(),
            "by_kind": _alarms_by_kind(tool),
        },
        "held_out_K": score.errors_by_group(tool),
        "held_out_pairs": [
            {"case": c.case, "group": c.group, "calibrated": c.answer.holdout_K[1], "after": c.answer.holdout_K[2]}
            for c in tool if math.isfinite(c.answer.holdout_K[1])
        ],
        "cases": [{**_case_row(c), "outcome": score.outcome_of(c)} for c in tool],
    }  # fmt: skip


def _cell(task: Task) -> tuple[str, str]:
    return task.sensors, task.data


def _row(rule: Rule, cases: Sequence[ScoredCase]) -> dict[str, Any]:
    count = Count.over([rule.apply(c) for c in cases])
    return {
        "key": rule.key,
        "text": rule.text,
        "rule": rule.meaning,
        "needed": rule.needed,
        "at_most": rule.at_most,
        "count": count.as_dict(),
        "met": rule.met(count),
    }


def _cell_row(sensors: str, data: str, cases: Sequence[ScoredCase]) -> dict[str, Any]:
    return {
        "sensors": sensors,
        "data": data,
        "cases": len(cases),
        "outcomes": {name: count.as_dict() for name, count in score.cell_counts(cases).items()},
        "consistent": Count.over([BY_KEY["consistent"].apply(c) for c in cases]).as_dict(),
        "single": Count.over([BY_KEY["single_tied"].apply(c) for c in cases]).as_dict(),
        "cannot_tell": Count.over([c.answer.verdict in CANNOT_TELL for c in cases]).as_dict(),
    }


def _alarms_by_kind(cases: Sequence[ScoredCase]) -> dict[str, dict[str, Any]]:
    kinds = {c.truth["control"] for c in cases if c.group == "control"} - {FAR}
    return {
        kind: Count.over([BY_KEY["false_alarm"].apply(c) for c in cases if c.truth["control"] == kind]).as_dict()
        for kind in sorted(kinds)
    }


def _case_row(c: ScoredCase) -> dict[str, Any]:
    """One line of the page for one case."""
    control = str(c.truth["control"]).replace("_", " ") + (f": {c.far}" if c.truth["control"] == FAR else "")
    return {
        "case": c.case,
        "group": c.group,
        "truth": [f"{e['name']} at {e['nodes'][0]}, {e['strength']:.2f} x" for e in c.truth["effects"]] or [control],
        "evidence": [round(c.answer.evidence[name], 1) if name in c.answer.evidence else None for name in c.names],
        "practical": bool(c.truth["effects"]) and c.practical(),
        "verdict": c.answer.verdict,
        "named": [
            f"{claim.mechanism} at {claim.place} ({claim.odds[claim.mechanism]:.2f})" for claim in c.answer.claims
        ],
        "tied": sorted(c.answer.tied - c.answer.named),
        "kin": sorted(c.kin),
    }
