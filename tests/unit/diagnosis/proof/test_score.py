"""Scoring: every rule on made-up answers and truths, counts, and the page; no diagnosis runs."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import pytest

from diagnosis.proof.cases.conceal import PHYSICS
from diagnosis.proof.scoring import score
from diagnosis.proof.scoring.answers import Answer
from diagnosis.proof.scoring.counts import Count, Median
from diagnosis.proof.scoring.outcome import outcome
from diagnosis.proof.scoring.proof_report import page
from diagnosis.proof.scoring.protocol import DATA, MIX, SENSORS, WHOLE, Settings, mix_of, plans_of, tasks_of
from diagnosis.proof.scoring.rules import BY_KEY, ScoredCase
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError

KIN = frozenset({"windage", "churning_swirl"})


def truth(group: str, *names: str, practical: bool = True, node: str = "oil", kind: str = "source") -> dict[str, Any]:
    effects = [{"name": n, "kind": kind, "nodes": [node], "strength": 1.0, "parameters": {"a": -2.0},
                "heat_magnitude_W": {"train": 50.0}} for n in names]  # fmt: skip
    control = {"clean": "clean", "far": "parameter_far"}.get(group)
    return {"group": "control" if control else group, "control": control, "effects": effects,
            "practical": [practical] * len(names)}  # fmt: skip


def finding(name: str, probability: float = 0.9, heat: float = 50.0, sd: float = math.nan, value: float = 1.0,
            place: str = "oil", **rivals: float) -> dict[str, Any]:  # fmt: skip
    return {"mechanism": name, "place": place, "node": "oil", "family": "open form" if name == "open_speed" else "x",
            "probability": probability, "heat_W": {"mean": heat, "stderr": sd}, "parameters": [{"value": value}],
            "confusable_with": [{"mechanism": m, "place": "seal", "probability": p} for m, p in rivals.items()],
            }  # fmt: skip


def said(verdict: str, *findings: dict[str, Any], node: str = "oil", unseen: str = "", after: float = 0.5,
         **evidence: float) -> dict[str, Any]:  # fmt: skip
    return {"verdict": verdict, "findings": list(findings), "location": [{"node": node}],
            "not_visible": [{"mechanism": unseen}],
            "fit": {"holdout": {"rmse_before_K": 3.0, "rmse_calibrated_K": 1.0, "rmse_after_K": after}},
            "ranking": [{"mechanism": m, "log_bayes": nats} for m, nats in evidence.items()]}  # fmt: skip


def scored(true: dict[str, Any], answer: dict[str, Any]) -> ScoredCase:
    near = {"oil": frozenset({"oil", "housing_lower"})}
    return ScoredCase(case="case_001", truth=true, answer=Answer.of(answer), near=near, far="h_air", kin=KIN)


CLEAN, OFF, ONE = truth("clean"), truth("far"), truth("single", "windage")
SMALL = truth("single", "windage", practical=False)
TWO, MESSY = truth("double", "windage", "pump_heat"), truth("messy", "oil_tank", "windage")
BIAS = truth("sensor", "sensor_bias", kind="sensor")
GAIN = truth("sensor", "torque_gain", node="torque", kind="signal")
ALIEN = truth("outside", "stick_slip")
TORQUE = truth("single", "torque_decay", node="torque", kind="signal")
SILENT, SHORT, FAILED, OPEN = said("consistent"), said("insufficient_data"), said("failed"), said("unexplained")
RIGHT, WRONG = said("missing_physics", finding("windage")), said("missing_physics", finding("pump_heat"))
TIED = said("missing_physics", finding("churning_swirl", 0.6, windage=0.3))
BARELY = said("missing_physics", finding("churning_swirl", 0.95, windage=0.02))
BOTH = said("missing_physics", finding("windage"), finding("pump_heat"))
PARTLY = said("unexplained", finding("windage"), finding("open_speed"))
UNNAMED = said("missing_physics", finding("open_speed"))


def parameter(place: str) -> dict[str, Any]:
    return said("parameter_error", finding("parameter", place=place))


def windage(**changed: float) -> dict[str, Any]:
    return said("missing_physics", finding("windage", **changed))


@pytest.mark.parametrize(
    ("key", "true", "answer", "expected"),
    [
        ("consistent", CLEAN, SILENT, True), ("consistent", CLEAN, RIGHT, False), ("consistent", CLEAN, SHORT, False),
        ("consistent", OFF, SILENT, None), ("consistent", ONE, SILENT, None),
        ("false_alarm", CLEAN, SILENT, False), ("false_alarm", CLEAN, RIGHT, True),
        ("false_alarm", CLEAN, SHORT, False),
        ("false_alarm", CLEAN, FAILED, None), ("false_alarm", OFF, RIGHT, None),
        ("far", OFF, parameter("h_air"), True), ("far", OFF, parameter("seal"), False), ("far", OFF, SILENT, False),
        ("far", CLEAN, SILENT, None),
        ("single_tied", ONE, RIGHT, True), ("single_tied", ONE, TIED, True), ("single_tied", ONE, BARELY, False),
        ("single_tied", ONE, SILENT, False), ("single_tied", SMALL, SILENT, None), ("single_tied", CLEAN, SILENT, None),
        ("single_exact", ONE, RIGHT, True), ("single_exact", ONE, TIED, False), ("single_exact", ONE, SILENT, False),
        ("single_answered", ONE, SILENT, False), ("single_answered", ONE, said("consistent", unseen="windage"), True),
        ("single_answered", ONE, said("sensor_fault", finding("sensor_bias"), unseen="windage"), False),
        ("single_answered", ONE, RIGHT, True),
        ("single_evident", ONE, said("consistent", windage=9.9), None), ("single_evident", ONE, FAILED, False),
        ("single_evident", ONE, said("consistent", windage=10.0), False), ("single_evident", ONE, RIGHT, True),
        ("single_small", SMALL, SILENT, True), ("single_small", SMALL, RIGHT, True),
        ("single_small", SMALL, TIED, True),
        ("single_small", SMALL, BOTH, False), ("single_small", SMALL, WRONG, False),
        ("single_small", SMALL, UNNAMED, True),
        ("single_small", SMALL, FAILED, None), ("single_small", ONE, RIGHT, None),
        ("place", ONE, said("unexplained", node="housing_lower"), True),
        ("place", ONE, said("unexplained", node="wheel"), False),
        ("place", ONE, SILENT, None), ("place", TORQUE, WRONG, None),
        ("place_exact", ONE, said("unexplained", node="housing_lower"), False), ("place_exact", ONE, WRONG, True),
        ("strength", ONE, windage(heat=57.4), True), ("strength", ONE, windage(heat=57.6), False),
        ("strength", ONE, windage(heat=42.4), False), ("strength", ONE, WRONG, None), ("strength", ONE, SILENT, None),
        ("strength", GAIN, said("sensor_fault", finding("torque_gain", value=1.9)), True),
        ("strength", GAIN, said("sensor_fault", finding("torque_gain", value=-1.5)), False),
        ("strength_as_stated", ONE, windage(heat=57.0, sd=3.6), True),
        ("strength_as_stated", ONE, windage(heat=57.0, sd=3.4), False), ("strength_as_stated", ONE, windage(), None),
        ("both", TWO, BOTH, True), ("both", TWO, RIGHT, False), ("both", ONE, BOTH, None),
        ("one", TWO, RIGHT, True), ("one", TWO, SILENT, False),
        ("messy", MESSY, said("missing_physics", finding("oil_tank"), finding("windage")), True),
        ("messy", MESSY, RIGHT, False),
        ("sensor", BIAS, said("sensor_fault", finding("sensor_bias")), True), ("sensor", BIAS, RIGHT, False),
        ("sensor_evident", BIAS, said("consistent", sensor_bias=2.0), None),
        ("sensor_evident", BIAS, said("consistent", sensor_bias=12.0), False),
        ("outside", ALIEN, OPEN, True), ("outside", ALIEN, UNNAMED, True), ("outside", ALIEN, PARTLY, False),
        ("outside", ALIEN, SILENT, False),
        ("outside_forced", ALIEN, PARTLY, True), ("outside_forced", ALIEN, parameter("seal"), True),
        ("outside_forced", ALIEN, SILENT, False), ("outside_forced", ALIEN, FAILED, None),
        ("outside_partly", ALIEN, PARTLY, True), ("outside_partly", ALIEN, RIGHT, False),
        ("outside_partly", ALIEN, SILENT, None),
        ("heldout", ONE, RIGHT, True), ("heldout", ONE, said("missing_physics", finding("windage"), after=1.1), False),
        ("heldout", ONE, SILENT, None), ("heldout", SMALL, RIGHT, None), ("heldout", CLEAN, RIGHT, None),
        ("removed", ONE, OPEN, True), ("removed", ONE, WRONG, False), ("removed", SMALL, OPEN, None),
        ("removed_kin", ONE, BARELY, True), ("removed_kin", ONE, WRONG, False), ("removed_kin", ONE, OPEN, False),
        ("removed_forced", ONE, WRONG, True), ("removed_forced", SMALL, BOTH, True),
        ("removed_forced", ONE, TIED, False),
        ("removed_forced", ONE, FAILED, None),
        ("removed_partly", ONE, WRONG, False), ("removed_partly", ONE, TIED, None),
        ("removed_partly", ONE, said("unexplained", finding("pump_heat")), True),
    ],
)  # fmt: skip
def test_rule(key: str, true: dict[str, Any], answer: dict[str, Any], expected: bool | None) -> None:
    assert BY_KEY[key].apply(scored(true, answer)) is expected


def test_limits_of_counts_and_medians() -> None:
    z, n, p = 1.959964, 10, 0.9  # Wilson 1927
    middle, half = p + z**2 / (2 * n), z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    limits = ((middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n))
    assert Count.over([True] * 9 + [False, None]).limits == pytest.approx(limits, abs=1e-6)
    median = Median.over([*range(1, 102), math.nan])
    assert (median.value, median.of) == (51.0, 101)
    assert (median.low, median.high) == pytest.approx((41.0, 61.0), abs=1.0)  # binomial order statistics
    consistent, alarms = BY_KEY["consistent"], BY_KEY["false_alarm"]
    assert consistent.met(Count(hits=19, of=20)) and not consistent.met(Count(hits=18, of=20))
    assert alarms.met(Count(hits=1, of=20)) and not alarms.met(Count(hits=2, of=20))


def test_outcomes_and_stated_probabilities() -> None:
    cases = [scored(ONE, answer) for answer in (RIGHT, WRONG, SHORT, said("refused"), SILENT, FAILED)]
    counts = score.cell_counts([*cases, scored(CLEAN, SILENT), scored(SMALL, SILENT)])
    assert [(name, count.hits) for name, count in counts.items()] == [
        ("right", 2), ("cannot tell", 2), ("missed", 1), ("wrong", 1), ("failed", 1)
    ]  # fmt: skip
    assert {count.of for count in counts.values()} == {7}
    rows = [(ONE, TIED), (ALIEN, UNNAMED), (ONE, UNNAMED), (OFF, parameter("h_air")), (OFF, parameter("seal"))]
    stated = score.stated_probabilities([scored(*row) for row in rows])
    assert stated == [(0.6, False), (0.3, True), (0.9, True), (0.9, False), (0.9, True), (0.9, False)]
    assert [(b["right"]["hits"], b["right"]["of"]) for b in score.reliability(stated)][-1] == (2, 4)
    assert score.seen_by(BIAS, ["oil"]) == BIAS and score.seen_by(BIAS, ["pinion"])["group"] == "control"


@pytest.mark.parametrize("cases", [6, 7, 60, WHOLE, 500])
def test_mix_keeps_every_group_and_the_number(cases: int) -> None:
    counts = mix_of(cases)
    assert sum(counts.values()) == cases and min(counts.values()) >= 1
    assert all(abs(counts[g] - cases * MIX[g] / WHOLE) <= 2.0 for g in MIX)
    with pytest.raises(InputError, match="5 cases are too few"):
        mix_of(5)


def test_tasks_cover_every_case_every_removed_mechanism_and_every_cell() -> None:
    settings = Settings(seed=5)
    plans = plans_of(settings)
    tasks = tasks_of(settings, plans)
    assert len({task.name for task in tasks}) == len(tasks) == WHOLE + len(PHYSICS) + 8 * 83
    assert sorted(t.removed for t in tasks if t.removed) == sorted(PHYSICS)
    assert all(plans[t.case].effects == (t.removed,) for t in tasks if t.removed)
    assert {(t.sensors, t.data) for t in tasks} == {(s, d) for s in SENSORS for d in DATA}


def test_numbers_and_page(fzg: Gearbox) -> None:
    settings = Settings(seed=5, cases=6)
    plans = plans_of(settings)
    shared = {"K_all": {"train": {name: {} for name in ("oil", "housing_lower", "pinion")}},
              "base_parameters": {name: value * 1.1 for name, value in fzg.factors.items()}}  # fmt: skip
    truths = {c: truth("clean" if p.group == "control" else p.group, *p.effects) | shared for c, p in plans.items()}
    answer = said("missing_physics", finding("windage", 0.97, place="<b>oil</b>", sd=1.0))
    records = {
        task: {"status": "refused" if task.data == "600 s" else "answered", "seconds": 1.0,
               "answer": None if task.data == "600 s" else answer}
        for task in tasks_of(settings, plans)
    }  # fmt: skip
    numbers = outcome(settings, fzg, truths, records, code="c0de", hashes="4a54")
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    cells = {(c["sensors"], c["data"]): c for c in numbers["cells"]}
    assert len(cells) == 9 and cells["rich", "full"]["cases"] == len(numbers["cases"]) == 6
    assert cells["poor", "600 s"]["cannot_tell"]["hits"] == 6 and numbers["protocol"]["refused"] == 3 * 6
    html = page(numbers)
    assert not re.findall(r"(?:src|href)=\"(?!#|data:)", html) and "<b>oil</b>" not in html
    assert all(rule["text"][1:] in html for rule in numbers["rules"]) and "c0de" in html and "4a54" in html
    tuned = {**numbers, "protocol": {**numbers["protocol"], "on_development_seed": True}}
    assert "they prove nothing" in page(tuned) and "they prove nothing" not in html
