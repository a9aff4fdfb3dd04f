"""Scoring: every rule on made-up truths and answers, what a truth says was changed, claims; no diagnosis runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from builder.commands.cli import commands
from builder.commands.prove import score as verb
from diagnosis.proof.cases.conceal import PROOF_MIX, WHOLE, mix_of
from diagnosis.proof.scoring.answers import read_answer
from diagnosis.proof.scoring.lines import ProofSettings, Task, compact, tasks_of
from diagnosis.proof.scoring.outcome import count, near_nodes, outcome, tables_of
from diagnosis.proof.scoring.rules import RULES, Item
from diagnosis.proof.scoring.truth import changed_of, read_truths, truth_of
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError

BY_NAME = {rule.name: rule for rule in RULES}
RIGHT, WRONG, NOT_COUNTED = True, False, None


SOME = "unexplained"  # verdict of an answer that is judged by something else


def effect(name: str, what: str, nodes: list[str], sign: int = 1, nats: float = 100.0, **more: Any) -> dict[str, Any]:
    changed = [{"what": what, "of": "-".join(nodes), "nodes": nodes, "sign": sign, "course": "always"}]
    return {"name": name, "catalogue": name, "family": "x", "kind": "source", "nodes": nodes, "parameters": {"a": 1.0},
            "changed": changed, "oracle": {"D_plant_nats": 2 * nats, "D_tool_nats": nats}, **more}  # fmt: skip


def truth(group: str, *effects: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"group": group, "family": "two_sumps", "effects": list(effects), **more}


def finding(name: str, kind: str = "source", node: str = "oil", value: float = 1.0, probability: float = 0.95,
            heat: float = 50.0, place: str = "", family: str = "x", **rivals: float) -> dict[str, Any]:  # fmt: skip
    rows = [{"mechanism": m, "place": "oil", "probability": p} for m, p in rivals.items()]
    return {"mechanism": name, "kind": kind, "place": place or node, "node": node, "family": family,
            "confusable_with": rows, "probability": probability, "heat_W": {"mean": heat},
            "parameters": [{"name": "a", "value": value}]}  # fmt: skip


def says(verdict: str, *findings: dict[str, Any], node: str = "oil", after: float = 0.5) -> dict[str, Any]:
    return {"verdict": verdict, "findings": list(findings), "location": [{"node": node, "probability": 0.9}],
            "fit": {"holdout": {"rmse_calibrated_K": 1.0, "rmse_after_K": after}}}  # fmt: skip


CLEAN = truth("control")
FAR = truth("control", far_parameter="mesh")
ONE = truth("single", effect("windage", "loss", ["oil"], heat_magnitude_W={"train": 50.0}))
FAINT = truth("single", effect("windage", "loss", ["oil"], nats=2.0))
LINK = truth("single", effect("air_cooling_change", "link", ["housing_upper"], -1))
INSIDE = truth("single", effect("oil_housing_speed", "link", ["oil", "housing_upper"]))
TORQUE = truth("sensor", effect("torque_gain", "input", ["torque"]) | {"family": "measurement"})
BIAS = truth("sensor", effect("sensor_bias", "sensor", ["pinion"]))
ALIEN = truth("outside", effect("hum", "loss", ["bearing_1"]) | {"catalogue": "none"})
WORN = truth("date", effect("loss_changes", "loss", ["mesh"]) | {"catalogue": None})
SILENT, FAILED = says("consistent"), None
NAMED, OTHER = says("missing_physics", finding("windage")), says("missing_physics", finding("pump_heat", node="oil"))
TIED = says("missing_physics", finding("churning_swirl", windage=0.3))
FOURTH = says("missing_physics", finding("churning_swirl", pump_heat=0.3, pocketing=0.2, windage=0.1))
COOLED = finding("air_cooling_change", "link_factor", "housing_upper", -0.2, place="housing_upper-air")
OPEN = finding("open_speed_loss", node="bearing_1", family="open form")
MIST = says(SOME, finding("oil_mist", "link_factor", "oil", 1.0, place="oil_housing_upper"))
LOWER_MIST = says(SOME, finding("oil_mist", "link_factor", "oil", 1.0, place="oil_housing_lower"))
PARAMETER = finding("parameter", "parameter", "mesh", place="mesh")


@pytest.mark.parametrize(
    ("rule", "true", "answer", "expected"),
    [
        ("false alarm", CLEAN, NAMED, True), ("false alarm", CLEAN, says("parameter_error", PARAMETER), False),
        ("false alarm", CLEAN, says("unexplained"), True), ("false alarm", ONE, NAMED, None),
        ("false alarm", FAR, NAMED, None),
        ("control answered right", CLEAN, SILENT, True), ("control answered right", CLEAN, NAMED, False),
        ("control answered right", CLEAN, FAILED, False),
        ("far parameter named", FAR, says("parameter_error", PARAMETER), True),
        ("far parameter named", FAR, says("parameter_error", finding("parameter", place="seal")), False),
        ("far parameter named", FAR, SILENT, False), ("far parameter named", CLEAN, SILENT, None),
        ("verdict right", ONE, NAMED, True), ("verdict right", ONE, says("sensor_fault"), False),
        ("verdict right", FAR, SILENT, False), ("verdict right", ALIEN, says("unexplained"), True),
        ("verdict right", ONE, FAILED, False), ("verdict right", ONE, says("unexplained"), False),
        ("verdict right", BIAS, says("sensor_fault"), True), ("verdict right", BIAS, NAMED, False),
        ("verdict right", TORQUE, NAMED, True), ("verdict right", TORQUE, says("unexplained"), False),
        ("named", ONE, NAMED, True), ("named", ONE, TIED, False), ("named", ONE, FAILED, False),
        ("named", ALIEN, NAMED, None),
        ("named", ONE, says("missing_physics", finding("windage") | {"acts_like": True}), False),
        ("named or tied", ONE, TIED, True), ("named or tied", ONE, OTHER, False), ("named or tied", ONE, FOURTH, False),
        ("named or tied", ONE, says("missing_physics", finding("churning_swirl", windage=0.04)), False),
        ("acts like", ONE, OTHER, True), ("acts like", ONE, says(SOME, finding("pump_heat", value=-1.0)), False),
        ("acts like", ONE, says(SOME, finding("pump_heat") | {"parameters": []}), False),
        ("acts like", ONE, says(SOME, finding("oil_tank")), False), ("acts like", ONE, FAILED, False),
        ("acts like", ONE, says(SOME, finding("windage", node="wheel", place="gears")), True),
        ("acts like", ONE, says(SOME, finding("churning_swirl", node="wheel")), False),
        ("acts like", LINK, says(SOME, COOLED | {"mechanism": "radiation_error"}), True),
        ("acts like", LINK, says(SOME, finding("radiation_error", "link_factor", "housing_upper", 0.2)), False),
        ("acts like", LINK, says(SOME, finding("aeration", "link_factor", "oil", -0.2)), False),
        ("acts like", INSIDE, MIST, True),
        ("acts like", INSIDE, LOWER_MIST, False),
        ("acts like", BIAS, says(SOME, finding("sensor_drift", "sensor", "pinion")), True),
        ("acts like", BIAS, says(SOME, finding("sensor_drift", "sensor", "oil")), False),
        ("acts like", TORQUE, says(SOME, finding("torque_offset", "sensor", "torque", -1.0)), True),
        ("acts like", TORQUE, says(SOME, finding("torque_offset", "sensor", "torque", 1.0)), False),
        ("acts like", WORN, says(SOME, PARAMETER | {"parameters": [{"value": 1.3}]}), True),
        ("acts like", WORN, says(SOME, PARAMETER | {"parameters": [{"value": 0.7}]}), False),
        ("acts like", LINK, says(SOME, finding("parameter", "parameter", "frame", 0.7, place="h_air")), True),
        ("acts like", LINK, says(SOME, finding("parameter", "parameter", "frame", 0.7, place="seal")), False),
        ("acts like", ALIEN, says(SOME, OPEN), True), ("acts like", CLEAN, SILENT, None),
        ("place right", ONE, says("unexplained", node="housing_lower"), True),
        ("place right", ONE, says("unexplained", node="bearing_1"), True),
        ("place right", ONE, says("unexplained", node="frame"), False), ("place right", TORQUE, SILENT, None),
        ("named or tied, visible", ONE, TIED, True), ("named or tied, visible", FAINT, TIED, None),
        ("named or tied, visible", ONE, SILENT, False),
        ("acts like, visible", ALIEN, says(SOME, OPEN), True), ("acts like, visible", ALIEN, SILENT, False),
        ("acts like, visible", FAINT, SILENT, None),
        ("silent where nothing can be seen", FAINT, SILENT, True),
        ("silent where nothing can be seen", ONE, SILENT, None),
        ("silent where nothing can be seen", FAINT, NAMED, False),
        ("silent where nothing can be seen", FAINT, FAILED, False),
        ("outside: no wrong name", ALIEN, says(SOME, OPEN), True),
        ("outside: no wrong name", ALIEN, NAMED, False), ("outside: no wrong name", ALIEN, SILENT, False),
        ("outside: no wrong name", ALIEN, says(SOME, finding("windage", probability=0.8)), True),
        ("heat within 20 %", ONE, says(SOME, finding("windage", heat=59.0)), True),
        ("heat within 20 %", ONE, says(SOME, finding("windage", heat=61.0)), False),
        ("heat within 20 %", ONE, OTHER, None),
        ("held-out error improves", ONE, NAMED, True), ("held-out error improves", ONE, SILENT, None),
        ("held-out error improves", ONE, says(SOME, finding("windage"), after=1.1), False),
    ],
)  # fmt: skip
def test_rule(
    rule: str, true: dict[str, Any], answer: dict[str, Any] | None, expected: bool | None, fzg: Gearbox
) -> None:
    known = truth_of(true, {})
    one = next(iter(known.effects), None)
    answered = read_answer(answer and compact(answer), fzg)
    item = Item(case="a", truth=known, effect=one, answer=answered, near=near_nodes(fzg))
    counted = BY_NAME[rule].when(item)
    assert (BY_NAME[rule].right(item) if counted else None) is expected


@pytest.mark.parametrize(
    ("name", "kind", "nodes", "what", "sign"),
    [
        ("windage", "source", ["oil"], "loss", 1),
        ("aeration", "link_factor", ["pinion"], "link", -1),
        ("oil_loss", "loss_factor", ["oil"], "loss", -1),
        ("torque_gain", "signal", ["torque"], "input", -1),
        ("clock_offset", "sensor", ["clock"], "clock", 1),
        ("solar_soak", "source", ["frame"], "heat", 1),
        ("phase_change", "source", ["frame"], "heat", 0),
        ("stick_slip", "source", ["oil"], "loss", 1),
        ("cooling_air_degradation", "link", ["air", "housing_upper"], "link", -1),
        ("torque_decay", "loss_factor", ["mesh"], "input", -1),
    ],
)
def test_what_was_changed_by_truths_that_do_not_name_it(
    name: str, kind: str, nodes: list[str], what: str, sign: int
) -> None:
    catalogue = None if name in ("phase_change", "stick_slip") else name
    raw = {"name": name, "catalogue": catalogue, "kind": kind, "nodes": nodes}
    changed = changed_of(raw | {"parameters": {"a": 0.5}})
    assert ({c.what for c in changed}, {c.sign for c in changed}) == ({what}, {sign})
    assert [node for c in changed for node in c.nodes] == nodes
    assert {c.sign for c in changed_of(raw | {"parameters": {"a": -0.5}})} == {-sign}


def test_a_mechanism_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    effect = ONE["effects"][0] | {"catalogue": "windag"}
    (tmp_path / "a.json").write_text(json.dumps(ONE | {"effects": [effect]}))
    with pytest.raises(InputError, match="'windag', which is no mechanism.*did you mean 'windage'"):
        read_truths(tmp_path)


def test_what_was_changed_by_truths_of_the_zoo() -> None:
    heat = {"what": "heat", "of": "oil+mist", "nodes": ["oil+mist", "pinion"], "sign": 1, "is_loss": True}
    (loss,) = changed_of({"changed": [heat], "family": "no-load loss"})
    assert (loss.what, loss.nodes, loss.sign) == ("loss", ("oil", "mist", "pinion"), 1)
    (sun,) = changed_of({"changed": [heat | {"is_loss": False}], "family": "surroundings"})
    assert sun.what == "heat"
    # A recorder that shows too much torque: the machine gets less than recorded.
    torque = {"what": "input", "of": "torque", "nodes": [], "sign": 1, "is_loss": False}
    assert changed_of({"changed": [torque], "family": "measurement"})[0].sign == -1
    assert changed_of({"changed": [torque], "family": "change at a date"})[0].sign == 1


def test_exact_limits() -> None:
    assert count([True] * 5 + [False]) == {"hits": 5, "of": 6, "low": 0.3588, "high": 0.9958}
    assert count([]) == {"hits": 0, "of": 0, "low": 0.0, "high": 1.0}
    assert count([True] * 30)["low"] == pytest.approx(0.025 ** (1 / 30), abs=1e-4)


def test_every_case_is_counted_by_kind_of_plant(fzg: Gearbox, tmp_path: Path) -> None:
    raw = {"a": ONE, "b": CLEAN, "c": truth("single", *ONE["effects"]) | {"family": "ring"}, "d": ALIEN}
    for case, one in raw.items():
        (tmp_path / f"{case}.json").write_text(json.dumps(one))
    answers = {"a": NAMED, "b": None, "c": says("missing_physics", finding("pump_heat", probability=0.97)), "d": NAMED}
    records = {
        Task(case=case): {"status": "answered" if answer else "failed", "seconds": 3.0, "answer": answer}
        for case, answer in answers.items()
    }
    result = outcome(read_truths(tmp_path), records, fzg)
    rules = {rule["name"]: {k: (c["hits"], c["of"]) for k, c in rule["counts"].items()} for rule in result["rules"]}
    assert rules["named"] == {"all": (1, 2), "zoo: two_sumps": (1, 1), "zoo: ring": (0, 1)}
    assert rules["verdict right"]["all"] == (3, 4) and rules["control answered right"]["all"] == (0, 1)
    assert result["failed"] == 1 and (result["claims"]["all"]["hits"], result["claims"]["all"]["of"]) == (1, 3)
    assert [(m["case"], m["D_plant_nats"], m["D_tool_nats"]) for m in result["misses"]] == [
        ("b", None, None), ("c", 200.0, 100.0), ("d", 200.0, 100.0),
    ]  # fmt: skip
    (last,) = [b for b in result["reliability"] if b["from"] == 0.9]
    assert (last["hits"], last["of"], last["stated"]) == (1, 3, pytest.approx((0.95 + 0.97 + 0.95) / 3))
    assert any("1/2 (1 to 99 %)" in row for row in tables_of(result, list(result["cases"]))[0][2])
    (places,) = [rule["counts"] for rule in result["rules"] if rule["name"] == "place right"]
    assert places["zoo: ring"]["chance"] == 0.75  # nine of twelve parts are the oil or joined to it
    assert any("1/1 (2 to 100 %; 75 % by chance)" in row for row in tables_of(result, list(result["cases"]))[0][2])
    assert not any("chance" in c for r in result["rules"] if r["name"] != "place right" for c in r["counts"].values())
    with pytest.raises(InputError, match="'e' has an answer but no truth"):
        outcome(read_truths(tmp_path), {**records, Task(case="e"): records[Task(case="a")]}, fzg)


def test_a_case_with_fewer_sensors_or_a_removed_entry(fzg: Gearbox) -> None:
    hidden = truth_of(BIAS | {"K_all": {"train": {"oil": 0, "pinion": 0}}}, {})
    alarm = {"status": "answered", "seconds": 1.0, "answer": says("sensor_fault", finding("sensor_bias", "sensor"))}
    records = {
        Task(case="a"): alarm,
        Task(case="a", sensors="poor"): alarm,
        Task(case="a", removed="sensor_bias"): alarm,
    }
    rules = {r["name"]: r["counts"] for r in outcome({"a": hidden}, records, fzg)["rules"]}
    assert rules["named"]["zoo: two_sumps"]["of"] == 1 and rules["named"]["all"]["of"] == 1
    assert rules["false alarm"]["zoo: two_sumps, poor, full"]["hits"] == 1
    assert rules["outside: no wrong name"]["zoo: two_sumps, entry removed"] == count([False])


def test_verb_scores_a_folder(tmp_path: Path) -> None:
    truths = tmp_path / "truth.json"
    truths.write_text(json.dumps({"a": ONE, "b": CLEAN}))
    (tmp_path / "results" / "a").mkdir(parents=True)
    arguments = [str(tmp_path / "results"), "--truth", str(truths), "--output", str(tmp_path / "out")]
    done = CliRunner().invoke(verb, arguments)
    assert "holds no <case>/diagnosis.json" in str(done.exception)
    (tmp_path / "results" / "a" / "diagnosis.json").write_text(json.dumps(NAMED))
    done = CliRunner().invoke(commands, ["score", *arguments], catch_exceptions=False)
    assert done.exit_code == 0 and "1 diagnoses ended without an answer" in done.output
    assert "| named | 1/1 (2 to 100 %) |" in (tmp_path / "out" / "proof.md").read_text()
    assert (tmp_path / "out" / "reliability.png").read_bytes().startswith(b"\x89PNG")
    (tmp_path / "results" / "b").mkdir()
    (tmp_path / "results" / "b" / "diagnosis.json").write_text('{"verdict": "missing_physics", "findings": [{}]}')
    done = CliRunner().invoke(commands, ["score", *arguments], catch_exceptions=False)
    assert done.exit_code == 0 and "1 diagnoses ended without an answer" in done.output
    for verdict in ("null", '"banana"', "5"):
        (tmp_path / "results" / "b" / "diagnosis.json").write_text('{"verdict": ' + verdict + "}")
        done = CliRunner().invoke(commands, ["score", *arguments], catch_exceptions=False)
        assert done.exit_code == 0 and "1 diagnoses ended without an answer" in done.output
    truths.write_text('{"a": 1}')
    assert "is no truth of a set of cases" in str(CliRunner().invoke(verb, arguments).exception)


def test_what_an_injection_changed_is_that_of_its_effect() -> None:
    changed = {"what": "heat", "of": "oil", "nodes": ["oil"], "sign": 1, "course": "step"}
    effect = {"name": "heat", "nodes": ["oil"], "size": 5.0, "heat_W": {"oil": {"mean": 3.0}}}
    (found,) = truth_of({"group": "injection", "changed": [changed], "effects": [effect]}, {}).effects
    assert [(one.what, one.of, one.sign) for one in found.changed] == [("heat", "oil", 1)]


@pytest.mark.parametrize("cases", [6, 7, 60, WHOLE])
def test_mix_keeps_every_group_and_the_number(cases: int) -> None:
    counts = mix_of(cases)
    assert set(counts) == set(PROOF_MIX) and sum(counts.values()) == cases and min(counts.values()) >= 1


def test_tasks() -> None:
    settings = ProofSettings(plant="own", cells_every=2, removed=True)
    tasks = tasks_of(settings, ["a", "b", "c"], {"a": "windage", "c": "windage"})
    assert tasks[:4] == [Task(case="a"), Task(case="b"), Task(case="c"), Task(case="a", removed="windage")]
    assert len(tasks) == 4 + 2 * 8 and len(set(tasks)) == len(tasks)
