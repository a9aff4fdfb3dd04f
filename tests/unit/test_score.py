"""What counts as right, and how counts become a page: on made-up verdicts, no diagnosis runs."""

from __future__ import annotations

import gzip
import json
import math
import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from diagnosis.proof import baselines, protocol, score
from diagnosis.proof.conceal import FAULTS, PHYSICS
from diagnosis.proof.outcome import outcome
from diagnosis.proof.proof_report import page
from diagnosis.proof.protocol import DATA, MIX, SENSORS, WHOLE, Settings, Task, mix_of, plans_of, tasks_of
from diagnosis.proof.score import RULES, Answer, Claim, Count, Judged, Median
from models.errors import InputError
from models.gearbox import Gearbox

NEAR = {"oil": frozenset({"oil", "housing_lower"}), "housing_lower": frozenset({"oil", "housing_lower"})}


def effect(name: str, *, node: str = "oil", kind: str = "source", heat: float = 50.0, a: float = 1.0) -> dict[str, Any]:
    return {"name": name, "kind": kind, "nodes": [node], "strength": 1.0, "parameters": {"a": a},
            "heat_magnitude_W": {"train": heat}}  # fmt: skip


def truth(group: str, *effects: dict[str, Any], control: str | None = None, practical: bool = True) -> dict[str, Any]:
    return {"group": group, "control": control, "effects": list(effects), "practical": [practical] * len(effects)}


def claim(name: str, probability: float = 0.9, *, heat: float = 50.0, heat_sd: float = math.nan, strength: float = 1.0,
          family: str = "oil circuit", place: str = "oil", **rivals: float) -> Claim:  # fmt: skip
    off = {place: probability} if name == "parameter" else {}
    return Claim(mechanism=name, place=place, node="oil", family=family, odds={name: probability, **rivals},
                 parameters=off, heat_W=heat, heat_sd_W=heat_sd, strength=strength)  # fmt: skip


def judged(true: dict[str, Any], verdict: str, *claims: Claim, node: str = "oil", kin: frozenset[str] = frozenset(),
           holdout: tuple[float, float, float] = (3.0, 1.0, 0.5), **evidence: float) -> Judged:  # fmt: skip
    answer = Answer(verdict=verdict, claims=claims, node=node, holdout_K=holdout, evidence=evidence)
    return Judged(case="case_001", truth=true, answer=answer, near=NEAR, far="h_air", kin=kin)


def by(key: str, j: Judged) -> bool | None:
    return next(rule for rule in RULES if rule.key == key).judge(j)


# ---------------------------------------------------------------------- counts


def test_limits_are_wilsons() -> None:
    # (p + z²/2n ± z sqrt(p(1-p)/n + z²/4n²)) / (1 + z²/n), worked out by hand for 9 of 10
    z, n, p = 1.959964, 10, 0.9
    middle, half = p + z**2 / (2 * n), z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert Count(hits=9, of=10).limits == pytest.approx(
        ((middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n)), abs=1e-6
    )


def test_a_count_takes_only_what_applies() -> None:
    count = Count.over([True, None, False, None, True])
    assert (count.hits, count.of) == (2, 3)
    assert Count.over([None]).limits == (0.0, 1.0)
    assert math.isnan(Count.over([]).share)


def test_median_with_limits() -> None:
    values = np.arange(1.0, 102.0)
    median = Median.over([*values, math.nan])
    assert (median.value, median.of) == (51.0, 101)
    assert median.low == pytest.approx(41.0, abs=1.0)  # binomial order statistics: 51 ± 10 of 101
    assert median.high == pytest.approx(61.0, abs=1.0)
    assert Median.over([1.0]).as_dict() == {"of": 1, "median": 1.0, "low": None, "high": None}
    assert Median.over([]).as_dict()["median"] is None


# ---------------------------------------------------------------------- rules


def test_a_consistent_gearbox() -> None:
    clean = truth("control", control="clean")
    assert by("consistent", judged(clean, "consistent")) is True
    assert by("false_alarm", judged(clean, "consistent")) is False
    assert by("consistent", judged(clean, "missing_physics", claim("windage"))) is False
    assert by("false_alarm", judged(clean, "missing_physics", claim("windage"))) is True
    # To say that the data do not suffice is no false alarm, but not right either.
    assert by("consistent", judged(clean, "insufficient_data")) is False
    assert by("false_alarm", judged(clean, "insufficient_data")) is False
    assert by("single_tied", judged(clean, "consistent")) is None


def test_a_parameter_far_off_must_be_the_right_one() -> None:
    far = truth("control", control="parameter_far")
    assert by("far", judged(far, "parameter_error", claim("parameter", place="h_air"))) is True
    assert by("far", judged(far, "parameter_error", claim("parameter", place="seal"))) is False
    assert by("far", judged(far, "consistent")) is False
    assert by("consistent", judged(far, "consistent")) is None


def test_a_single_effect_named_tied_or_mistaken() -> None:
    true = truth("single", effect("windage"))
    exact = judged(true, "missing_physics", claim("windage"))
    tied = judged(true, "missing_physics", claim("churning_swirl", 0.6, windage=0.3))
    barely = judged(true, "missing_physics", claim("churning_swirl", 0.95, windage=0.02))
    assert [by("single_exact", j) for j in (exact, tied, barely)] == [True, False, False]
    assert [by("single_tied", j) for j in (exact, tied, barely)] == [True, True, False]
    assert by("single_tied", judged(true, "consistent")) is False


def test_silence_is_an_answer_where_it_is_said_that_the_data_would_not_show_it() -> None:
    true = truth("single", effect("windage"))
    silent = judged(true, "consistent")
    open_about_it = replace(silent, answer=replace(silent.answer, unseen=frozenset({"windage"})))
    wrong = judged(true, "missing_physics", claim("pump_heat"))
    wrong = replace(wrong, answer=replace(wrong.answer, unseen=frozenset({"windage"})))
    named = judged(true, "missing_physics", claim("windage"))
    assert [by("single_answered", j) for j in (silent, open_about_it, wrong, named)] == [False, True, False, True]
    assert by("single_tied", open_about_it) is False  # which asks for more
    said = {"verdict": "consistent", "not_visible": [{"mechanism": "windage", "place": "oil", "needed": "speed"}]}
    assert Answer.of(said).unseen == {"windage"}


def test_of_a_small_effect_silence_is_right_and_a_wrong_name_is_not() -> None:
    small = truth("single", effect("windage"), practical=False)
    assert by("single_tied", judged(small, "consistent")) is None
    assert by("single_small", judged(small, "consistent")) is True
    assert by("single_small", judged(small, "missing_physics", claim("windage"))) is True
    assert by("single_small", judged(small, "missing_physics", claim("pump_heat"))) is False


def test_the_place_or_its_neighbour() -> None:
    true = truth("single", effect("windage", node="oil"))
    found = claim("pump_heat")
    assert by("place", judged(true, "missing_physics", found, node="housing_lower")) is True
    assert by("place", judged(true, "missing_physics", found, node="wheel")) is False
    assert by("place", judged(true, "consistent")) is None
    assert by("place_exact", judged(true, "missing_physics", found, node="housing_lower")) is False
    assert by("place_exact", judged(true, "missing_physics", found, node="oil")) is True
    no_node = truth("single", effect("torque_decay", node="torque", kind="signal"))
    assert by("place", judged(no_node, "missing_physics", found)) is None


@pytest.mark.parametrize(("heat", "right"), [(50.0, True), (57.4, True), (57.6, False), (42.4, False)])
def test_strength_is_heat_within_15_percent(heat: float, right: bool) -> None:
    true = truth("single", effect("windage", heat=50.0))
    assert by("strength", judged(true, "missing_physics", claim("windage", heat=heat))) is right
    assert by("strength", judged(true, "missing_physics", claim("pump_heat", heat=heat))) is None


@pytest.mark.parametrize(
    ("heat", "sd", "as_stated"),
    [(57.0, 3.6, True), (57.0, 3.4, False), (60.0, 4.0, False), (60.0, 6.0, True)],
)  # fmt: skip
def test_stated_errors_of_strengths_are_judged(heat: float, sd: float, as_stated: bool) -> None:
    true = truth("single", effect("windage", heat=50.0))
    j = judged(true, "missing_physics", claim("windage", heat=heat, heat_sd=sd))
    assert by("strength_as_stated", j) is as_stated
    silent = judged(true, "missing_physics", claim("windage", heat=heat))  # of an answer without errors
    assert by("strength_as_stated", silent) is None


def test_what_the_data_do_not_speak_for_is_counted_apart() -> None:
    single, fault = truth("single", effect("windage")), truth("sensor", effect("sensor_bias"))
    assert by("single_evident", judged(single, "consistent", windage=9.9)) is None
    assert by("single_evident", judged(single, "consistent", windage=10.1)) is False
    assert by("single_evident", judged(single, "missing_physics", claim("windage"), windage=10.1)) is True
    assert by("single_evident", judged(single, "failed")) is False  # an answer that says nothing is no excuse
    assert by("sensor_evident", judged(fault, "consistent", sensor_bias=12.0)) is False
    assert by("sensor_evident", judged(fault, "consistent", sensor_bias=2.0)) is None


def test_strength_of_a_fault_is_its_size_whatever_its_sign() -> None:
    true = truth("sensor", effect("torque_gain", node="torque", kind="signal", a=0.06))
    assert by("strength", judged(true, "sensor_fault", claim("torque_gain", strength=-0.057))) is True
    assert by("strength", judged(true, "sensor_fault", claim("torque_gain", strength=-0.03))) is False


def test_two_effects() -> None:
    true = truth("double", effect("windage"), effect("pump_heat"))
    both = judged(true, "missing_physics", claim("windage"), claim("pump_heat"))
    one = judged(true, "missing_physics", claim("windage"), claim("oil_mist"))
    assert [by("both", both), by("both", one), by("one", one)] == [True, False, True]
    assert by("one", judged(true, "consistent")) is False


def test_the_dominant_effect_comes_first() -> None:
    true = truth("messy", effect("oil_tank"), effect("windage"))
    assert by("messy", judged(true, "missing_physics", claim("oil_tank"), claim("windage"))) is True
    assert by("messy", judged(true, "missing_physics", claim("windage"), claim("oil_tank"))) is False


def test_outside_the_catalogue_is_said_or_forced() -> None:
    true = truth("outside", effect("stick_slip"))
    opened = claim("open_speed", family="open form")
    assert by("outside", judged(true, "unexplained")) is True
    assert by("outside", judged(true, "missing_physics", opened)) is True
    # A name is a name, also where it is said that more is missing.
    partly = judged(true, "unexplained", opened, claim("windage", 0.4))
    assert by("outside", partly) is False
    assert by("outside_forced", partly) is True and by("outside_partly", partly) is True
    forced = judged(true, "missing_physics", claim("windage"))
    assert by("outside_forced", forced) is True and by("outside_partly", forced) is False
    assert by("outside_forced", judged(true, "parameter_error", claim("parameter"))) is True
    silent = judged(true, "consistent")
    assert by("outside", silent) is False and by("outside_forced", silent) is False
    assert by("outside_partly", silent) is None
    assert by("outside_forced", judged(true, "failed")) is None  # no answer is none, and no merit


def test_a_removed_entry_its_kin_and_a_forced_name() -> None:
    true = truth("single", effect("windage"))
    kin = frozenset({"windage", "churning_swirl"})
    forced = judged(true, "missing_physics", claim("pump_heat"), kin=kin)
    near = judged(true, "missing_physics", claim("churning_swirl"), kin=kin)
    open_form = judged(true, "unexplained", kin=kin)
    partly = judged(true, "unexplained", claim("churning_swirl"), claim("pump_heat"), kin=kin)
    rules = {rule.key: rule.judge for rule in score.REMOVED_RULES}
    said = (forced, near, open_form, partly)
    assert [rules["removed"](j) for j in said] == [False, False, True, False]
    assert [rules["removed_kin"](j) for j in said] == [False, True, False, False]
    assert [rules["removed_forced"](j) for j in said] == [True, False, False, True]
    assert [rules["removed_partly"](j) for j in said] == [False, None, None, True]


def test_of_an_effect_too_small_to_matter_nothing_else_is_named() -> None:
    true = truth("single", effect("windage"), practical=False)
    fine = [
        judged(true, "consistent"),
        judged(true, "unexplained"),
        judged(true, "missing_physics", claim("windage")),
        judged(true, "missing_physics", claim("pump_heat", 0.6, windage=0.3)),
    ]
    assert [by("single_small", j) for j in fine] == [True] * 4
    extra = judged(true, "missing_physics", claim("windage"), claim("pump_heat"))
    partly = judged(true, "unexplained", claim("pump_heat"))
    assert [by("single_small", j) for j in (extra, partly, judged(true, "failed"))] == [False, False, None]


def test_held_out_error_counts_where_something_is_claimed() -> None:
    true = truth("single", effect("windage"))
    assert by("heldout", judged(true, "missing_physics", claim("windage"))) is True
    assert by("heldout", judged(true, "missing_physics", claim("windage"), holdout=(3.0, 1.0, 1.1))) is False
    assert by("heldout", judged(true, "consistent")) is None


def test_every_rule_says_what_it_asks() -> None:
    for rule in (*RULES, *score.REMOVED_RULES):
        assert rule.judge.__doc__
    keys = [rule.key for rule in (*RULES, *score.REMOVED_RULES)]
    assert len(set(keys)) == len(keys)


def test_a_rule_is_met_from_below_or_from_above() -> None:
    rules = {rule.key: rule for rule in RULES}
    assert rules["consistent"].met(Count(hits=19, of=20)) is True
    assert rules["consistent"].met(Count(hits=18, of=20)) is False
    assert rules["false_alarm"].met(Count(hits=1, of=20)) is True
    assert rules["false_alarm"].met(Count(hits=2, of=20)) is False
    assert rules["consistent"].met(Count(hits=0, of=0)) is None
    assert rules["far"].met(Count(hits=0, of=9)) is None


def test_a_fault_of_a_sensor_that_is_not_there_is_none() -> None:
    true = truth("sensor", effect("sensor_bias", node="pinion", kind="sensor"))
    assert score.seen_by(true, ["oil", "pinion"]) == true
    assert score.seen_by(true, ["oil"])["group"] == "control"
    clock = truth("sensor", effect("clock_offset", node="clock", kind="sensor"))
    assert score.seen_by(clock, ["oil"]) == clock


def test_outcomes_of_a_cell_add_up() -> None:
    true, clean = truth("single", effect("windage")), truth("control", control="clean")
    cases = [
        judged(true, "missing_physics", claim("windage")),
        judged(true, "missing_physics", claim("pump_heat")),
        judged(true, "insufficient_data"),
        judged(true, "refused"),
        judged(true, "consistent"),
        judged(true, "failed"),
        judged(clean, "consistent"),
        judged(truth("single", effect("windage"), practical=False), "consistent"),
    ]
    counts = score.cell_counts(cases)
    assert {name: count.hits for name, count in counts.items()} == {
        "right": 2, "cannot tell": 2, "missed": 1, "wrong": 1, "failed": 1,
    }  # fmt: skip
    assert {count.of for count in counts.values()} == {7}


def test_stated_probabilities_are_counted_in_bins() -> None:
    true = truth("single", effect("windage"))
    j = judged(true, "missing_physics", claim("windage", 0.95, pump_heat=0.05))
    stated = score.stated_probabilities([j])
    assert sorted(stated) == [(0.05, False), (0.95, True)]
    opened = claim("open_speed", 0.9, family="open form")
    assert score.stated_probabilities([judged(truth("outside", effect("drying")), "unexplained", opened)]) == [
        (0.9, True)
    ]
    assert score.stated_probabilities([judged(true, "unexplained", opened)]) == [(0.9, False)]
    far = truth("control", control="parameter_far")
    off = [claim("parameter", place=place) for place in ("h_air", "seal")]
    assert score.stated_probabilities([judged(far, "parameter_error", *off)]) == [(0.9, True), (0.9, False)]
    # Another parameter is another claim, wherever it stands.
    said = {"mechanism": "parameter", "place": "seal", "node": "oil", "family": "parameter", "probability": 0.5,
            "confusable_with": [{"mechanism": "parameter", "place": "h_air", "probability": 0.4}]}  # fmt: skip
    rival = Answer.of({"verdict": "parameter_error", "findings": [said]}).claims[0]
    assert sorted(score.stated_probabilities([judged(far, "parameter_error", rival)])) == [(0.4, True), (0.5, False)]
    bins = score.reliability([*stated, (1.0, False)])
    last = bins[-1]
    assert (last["right"]["hits"], last["right"]["of"]) == (1, 2)
    assert last["mean_stated"] == pytest.approx(0.975)
    assert sum(b["right"]["of"] for b in bins) == 3


def test_an_answer_is_read_from_the_numbers_of_a_diagnosis() -> None:
    said = {
        "verdict": "missing_physics",
        "findings": [{
            "mechanism": "windage", "place": "wheel", "node": "wheel", "family": "no-load loss", "probability": 0.6,
            "heat_W": {"mean": 12.0, "max": 30.0}, "parameters": [{"name": "strength", "value": 5.0}],
            "confusable_with": [
                {"mechanism": "windage", "place": "pinion", "probability": 0.3},
                {"mechanism": "pump_heat", "place": "oil", "probability": 0.06},
            ],
        }],
        "location": [{"node": "wheel"}],
        "fit": {"holdout": {"rmse_before_K": 3.0, "rmse_calibrated_K": None, "rmse_after_K": 0.4}},
        "ranking": [{"mechanism": "windage", "log_bayes": 3.0}, {"mechanism": "windage", "log_bayes": 7.0}],
    }  # fmt: skip
    answer = Answer.of(said)
    assert answer.claims[0].odds == pytest.approx({"windage": 0.9, "pump_heat": 0.06})
    assert answer.tied == {"windage", "pump_heat"}
    assert answer.evidence == {"windage": 7.0}
    assert answer.node == "wheel"
    assert math.isnan(answer.holdout_K[1])
    assert Answer.of(None, otherwise="refused").silent


# ---------------------------------------------------------------------- protocol


def test_the_whole_mix_has_every_mechanism_twice() -> None:
    counts: dict[str, int] = {}
    for plan in plans_of(Settings(seed=5)).values():
        if plan.group == "single":
            counts[plan.effects[0]] = counts.get(plan.effects[0], 0) + 1
    assert set(counts) == set(PHYSICS)
    assert set(counts.values()) == {2}
    assert MIX["control"] >= 60 and MIX["single"] >= 60
    assert [MIX[group] for group in ("double", "messy", "outside", "sensor")] == [30, 30, 30, 15]


@pytest.mark.parametrize("cases", [6, 7, 12, 60, 100, WHOLE, 500])
def test_a_smaller_mix_keeps_every_group_and_the_number(cases: int) -> None:
    counts = mix_of(cases)
    assert sum(counts.values()) == cases
    assert min(counts.values()) >= 1
    assert all(abs(counts[g] - cases * MIX[g] / WHOLE) <= 2.0 for g in MIX)


def test_too_few_cases_are_an_input_error() -> None:
    with pytest.raises(InputError, match="5 cases are too few: 6 groups"):
        mix_of(5)


def test_every_mechanism_among_the_singles_is_removed_once() -> None:
    plans = plans_of(Settings(seed=5))
    tasks = tasks_of(Settings(seed=5), plans)
    removed = [task for task in tasks if task.removed]
    assert sorted(str(task.removed) for task in removed) == sorted(PHYSICS)
    assert all(plans[task.case].effects == (task.removed,) for task in removed)
    assert not set(FAULTS) & {task.removed for task in removed}


def test_cells_take_every_third_case_of_each_group() -> None:
    settings = Settings(seed=5, cases=60)
    plans = plans_of(settings)
    tasks = [task for task in tasks_of(settings, plans) if task.kind == "diagnose" and not task.removed]
    per_cell = {(s, d): [t.case for t in tasks if (t.sensors, t.data) == (s, d)] for s in SENSORS for d in DATA}
    assert len(per_cell["rich", "full"]) == 60
    other = per_cell["poor", "600 s"]
    assert {tuple(cases) for cell, cases in per_cell.items() if cell != ("rich", "full")} == {tuple(other)}
    groups = [plans[case].group for case in other]
    assert {g: groups.count(g) for g in MIX} == {g: math.ceil(n / 3) for g, n in mix_of(60).items()}
    assert len({task.name for task in tasks_of(settings, plans)}) == len(tasks_of(settings, plans))


# ---------------------------------------------------------------------- the numbers and the page


@pytest.fixture(scope="module")
def numbers(fzg: Gearbox) -> dict[str, Any]:
    """The numbers of six cases with made-up verdicts."""
    settings = Settings(seed=5, cases=6)
    plans = plans_of(settings)
    K = {"train": {name: {"rms": 1.0} for name in ("oil", "housing_lower", "pinion")}}
    shared = {"K_all": K, "base_parameters": {name: value * 1.1 for name, value in fzg.factors.items()}}
    truths = {
        case: truth(plan.group, *(effect(name) for name in plan.effects),
                    control=plan.kind if plan.group == "control" else None) | shared
        for case, plan in plans.items()
    }  # fmt: skip
    said = {
        "verdict": "missing_physics",
        "findings": [{
            "mechanism": "windage", "place": "<b>oil</b>", "node": "oil", "family": "no-load loss", "probability": 0.97,
            "heat_W": {"mean": 12.0}, "parameters": [], "confusable_with": [],
        }],
        "location": [{"node": "oil"}],
        "fit": {"holdout": {"rmse_before_K": 3.0, "rmse_calibrated_K": 1.0, "rmse_after_K": 0.4}},
    }  # fmt: skip
    other = {"naive": {**said, "location": []}, "sparse": None, "black_box": {"rmse_K": 0.8}}
    records = {
        task: {"status": "answered", "seconds": 1.0, "said": other if task.kind == "baselines" else said, "message": ""}
        if task.data != "600 s" else {"status": "refused", "seconds": 1.0, "said": None, "message": "too short"}
        for task in tasks_of(settings, plans)
    }  # fmt: skip
    return outcome(settings, fzg, truths, records, code="c0de", hashes="4a54", scored_as_begun=True)


def test_numbers_are_json_and_say_how_many(numbers: dict[str, Any]) -> None:
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    cells = {(c["sensors"], c["data"]): c for c in numbers["cells"]}
    assert len(cells) == 9
    assert cells["rich", "full"]["cases"] == 6
    short = cells["poor", "600 s"]
    assert short["cannot_tell"] == {"hits": 6, "of": 6, "low": pytest.approx(0.6097, abs=1e-3), "high": 1.0}
    assert numbers["protocol"]["refused"] == 3 * 6
    assert numbers["held_out_K"]["single"]["black_box"]["median"] == 0.8
    assert set(numbers["methods"]) == {"calibration", "naive", "black_box"}
    assert sum(sum(row.values()) for row in numbers["confusion"].values()) == 4  # no doubles, no messy ones


def test_other_methods_are_judged_by_the_same_rules(numbers: dict[str, Any]) -> None:
    rules = {rule["key"]: rule for rule in numbers["rules"]}
    assert rules["single_tied"]["methods"]["naive"] == rules["single_tied"]["count"]
    assert rules["strength"]["methods"] == {}


def test_the_page_needs_nothing_else_and_says_everything(numbers: dict[str, Any]) -> None:
    html = page(numbers)
    assert not re.findall(r"(?:src|href)=\"(?!#|data:)", html)
    assert "pysindy was not installed" in html
    assert "<b>oil</b>" not in html
    for rule in numbers["rules"]:
        assert rule["text"][1:] in html
    for words in ("c0de", "4a54", "too small to matter", "seed"):
        assert words in html
    assert "they prove nothing" not in html


def test_a_development_seed_is_no_proof(numbers: dict[str, Any]) -> None:
    told = {**numbers, "protocol": {**numbers["protocol"], "on_development_seed": True}}
    assert "they prove nothing" in page(told)


def test_rules_that_were_changed_on_the_way_are_told(numbers: dict[str, Any]) -> None:
    words = "rules of judging were changed"
    assert words not in page(numbers)
    assert words in page({**numbers, "protocol": {**numbers["protocol"], "scored_as_begun": False}})


# ---------------------------------------------------------------------- what a process gets to see


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    folder = tmp_path / "case_001"
    folder.mkdir()
    head = "time_s,speed_rpm,T_ambient_degC,T_oil_degC,T_housing_lower_degC,T_housing_upper_degC,T_pinion_degC,P_loss_W"
    rows = [",".join(str(float(i * 10 + k)) for k in range(8)) for i in range(5)]
    for name in ("train_1", "train_2", "train_3", "hold_1", "hold_2"):
        (folder / f"{name}.csv.gz").write_bytes(gzip.compress(("\n".join([head, *rows]) + "\n").encode()))
    (folder / "seal.json").write_text("{}")
    blocks = [f'[columns.{c}]\nquantity = "x"\nnoise = 0.2' for c in ("T_oil_degC", "T_pinion_degC")]
    (folder / "mapping.toml").write_text("\n\n".join(["# sheet\nschema = 1", *blocks]) + "\n")
    return tmp_path


@pytest.mark.parametrize(
    ("sensors", "kept"),
    [("rich", 5), ("lean", 3), ("poor", 1)],
)
def test_sensors_are_dropped_from_recordings_and_data_sheet(recordings: Path, sensors: Any, kept: int) -> None:
    files, arguments = protocol.files_of(recordings, Task(case="case_001", sensors=sensors))
    assert set(files) == {"train_1.csv.gz", "train_2.csv.gz", "train_3.csv.gz", "hold_1.csv.gz", "hold_2.csv.gz",
                          "mapping.toml"}  # fmt: skip
    head, first, *_ = gzip.decompress(files["train_1.csv.gz"]).decode().splitlines()
    assert len(head.split(",")) == len(first.split(",")) == 3 + kept
    assert dict(zip(head.split(","), first.split(","), strict=True))["T_oil_degC"] == "3.0"
    sheet = tomllib.loads(files["mapping.toml"].decode())
    assert set(sheet["columns"]) == {"T_oil_degC"} | ({"T_pinion_degC"} if sensors == "rich" else set())
    assert arguments[3:] == ["--holdout", "hold_1.csv.gz", "--holdout", "hold_2.csv.gz"]


def test_short_data_come_without_held_out_recordings(recordings: Path) -> None:
    files, arguments = protocol.files_of(recordings, Task(case="case_001", data="600 s", removed="windage"))
    assert set(files) == {"train_2.csv.gz", "mapping.toml"}
    assert arguments == ["train_2.csv.gz@0..600", "--without-mechanism", "windage"]
    assert protocol.files_of(recordings, Task(case="case_001", data="2 h"))[1] == ["train_2.csv.gz"]


def test_settings_that_differ_are_another_proof(fzg: Gearbox, tmp_path: Path) -> None:
    (tmp_path / protocol.RECORDINGS).mkdir()
    settings = Settings(seed=9, cases=6)
    with pytest.raises(InputError, match="not empty and holds no proof"):
        protocol.begin(settings, fzg, tmp_path)
    folder = tmp_path / "proof"
    about = folder / protocol.SETTINGS
    (folder / protocol.RECORDINGS).mkdir(parents=True)
    about.write_text("{}")
    with pytest.raises(InputError, match="holds a proof with other options"):
        protocol.begin(settings, fzg, folder)
    with pytest.raises(InputError, match="must be hashed before the truth is opened"):
        protocol.open_truth(settings, fzg, folder)


def test_the_hash_of_the_code_follows_its_thresholds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for package in protocol.JUDGED:
        (tmp_path / package / "proof").mkdir(parents=True)
        (tmp_path / package / "code.py").write_text("THRESHOLD = 8.0\n")
    monkeypatch.setattr(protocol.resources, "files", lambda package: tmp_path / package)
    before = protocol.code_hash()
    (tmp_path / "diagnosis" / "proof" / "score.py").write_text("TIE = 0.05\n")
    assert protocol.code_hash() == before  # not a part of what is tried
    (tmp_path / "diagnosis" / "code.py").write_text("THRESHOLD = 7.0\n")
    assert protocol.code_hash() != before


def test_sparse_regression_is_left_out_without_pysindy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pysindy", None)
    assert baselines._sparse(None, None, ()) is None  # type: ignore[arg-type]
