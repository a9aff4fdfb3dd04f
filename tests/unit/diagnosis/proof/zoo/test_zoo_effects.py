"""Effects of the zoo: they act as their truth says, from their date on, and the same seed gives the same bytes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.proof.cases.case_files import write_case, write_cases
from diagnosis.proof.cases.time_course import TimeCourse
from diagnosis.proof.plant import cycles
from diagnosis.proof.zoo import draw
from diagnosis.proof.zoo.case import ZooCase, ZooPlan, run_case
from diagnosis.proof.zoo.conceal_zoo import conceal_zoo, files_of_case, record_case, zoo_plans
from diagnosis.proof.zoo.distance import Drawn
from diagnosis.proof.zoo.effects import ZooEffect
from diagnosis.proof.zoo.families import FAMILIES
from diagnosis.proof.zoo.faults import Measured, spoiled
from diagnosis.proof.zoo.oracle import OracleNats
from diagnosis.proof.zoo.programmes import programmes
from diagnosis.proof.zoo.setting import EffectSetting, UnfitError
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Variant, ZooOutcome, ZooPlant
from diagnosis.proof.zoo.truth import truth_of
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array

ALL = {**draw.CATALOGUE_MAKERS, **draw.OUTSIDE_MAKERS, **draw.DATED_MAKERS}
COLUMNS = {"speed": "speed_rpm", "torque": "torque_Nm", "T_ambient": "T_ambient_degC", "air_speed": "air_speed_m_s"}
NO_SUCH_NODE = {"pump_fast_stage"}  # the rig has no oil return


@pytest.fixture(scope="module", autouse=True)
def quick_cases() -> Iterator[None]:
    """A twentieth of the usual hours, and an oracle of independent rows of 0.5 K and 20 W."""

    def nats_of(x: Sequence[Mapping[str, Array]]) -> OracleNats:
        size = {"P_loss": 20.0}
        D = sum(float(np.sum((v / size.get(n, 0.5)) ** 2)) for one in x for n, v in one.items())
        return OracleNats(plant=0.5 * D, tool=0.25 * D)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(draw, "design_of", lambda *_: SimpleNamespace(nats_of=nats_of))
        for name in ("STAIR_S", "STANDSTILL_S", "RANDOM_S", "HOLD_STAIRCASE_S", "WARM_UP_S"):
            patch.setattr(cycles, name, 0.05 * getattr(cycles, name))
        yield


@pytest.fixture(scope="module")
def drawn(fzg: Gearbox) -> Drawn:
    rng = np.random.default_rng(1)
    plant = FAMILIES["walls"].draw(fzg, rng)
    return Drawn(plant=plant, programmes=programmes(plant, rng, baselines=1), distance_K=0.5, rejected=0)


@pytest.fixture(scope="module")
def setting(fzg: Gearbox, drawn: Drawn) -> EffectSetting:
    warm = drawn.programmes[2]
    return EffectSetting(drawn.plant, drawn.programmes, simulate(drawn.plant, warm, [Variant()]), fzg.network().groups)


def case_of(drawn: Drawn, group: str, *effects: ZooEffect) -> ZooCase:
    """A case with given effects, or with drawn ones."""
    plan = ZooPlan(family="walls", machine="fzg", seed=4, group=group)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(draw, "draw_plant", lambda *_, **__: drawn)
        if not effects:
            return draw.draw_case(plan, session_deviation=0.03)
        healthy = draw.draw_case(replace(plan, group="control", kind="clean"), session_deviation=0.03)
    case = draw.with_effects(replace(healthy, plan=plan), effects)
    case = replace(case, runs=run_case(case, "train", "hold", "baseline"))
    return replace(case, nats_of_effects=(OracleNats(plant=1.0, tool=1.0),) * len(effects))


def moved(effect: ZooEffect, plant: ZooPlant, outcome: ZooOutcome, run: int) -> float:
    """By how much a run differs from the first one in the direction of what the effect changed first."""
    change, changed = effect.changes[0], effect.changed[0]
    if change.kind in ("path", "bridge"):
        paths = {path.name: path.ends for path in plant.paths}
        a, b = paths[change.target] if change.kind == "path" else (change.target, change.other)
        difference = np.abs(outcome.T[a] - outcome.T[b]).mean(axis=1)
        return float(changed.sign * (difference[0] - difference[run]))
    bodies = [body.name for body in plant.bodies if body.part_of in changed.nodes or not changed.nodes]
    if change.kind == "capacity":
        rates = np.stack([np.abs(np.diff(outcome.T[body], axis=1)).mean(axis=1) for body in bodies])
        return float(changed.sign * (rates[:, 0] - rates[:, run]).mean())
    rise = np.mean([outcome.T[body][run] - outcome.T[body][0] for body in bodies])
    return float(abs(rise) if changed.sign == 0 else changed.sign * rise)


def test_effects_keep_their_order_by_which_seeds_draw_them() -> None:
    order = """
    windage pocketing churning_swirl churning_load oil_level_thermal splash_starvation misalignment bearing_preload
    bearing_additive brake_drag pump_heat run_in_flanks run_in_seals oil_ageing oil_loss gear_wear bearing_damage
    torque_decay aeration oil_housing_speed oil_mist bearing_seat_contact radiation_error air_cooling_change
    fan_thermostat foundation_conduction hot_neighbour motor_flange shaft_ends_to_air water_jacket cooler_thermostat
    cooler_proportional cooler_air_thermostat cooler_air_proportional cooler_constant cooler_shaft_driven oil_jet
    oil_tank heater_thermostat pump_fast_stage solar_soak rain_on_housing ambient_swing ambient_drift
    bearing_torque_square resonance stick_slip eddy_brake stiff_grease sludge water_evaporation growing_insulation
    opening_gap timed_neighbour timed_heat door_draught melting_wax heat_pipe wet_floor loss_changes heat_changes
    link_changes capacity_changes heat_appears link_appears set_point_changes
    """
    assert list(ALL) == order.split()


def test_every_effect_acts_in_the_direction_of_its_truth(setting: EffectSetting, drawn: Drawn) -> None:
    rng, effects = np.random.default_rng(2), []
    for maker in ALL.values():
        try:
            effect = maker(setting, rng)
        except UnfitError:
            continue
        effects.append(effect.with_strength(0.3 * effect.cap))
    assert set(ALL) - {effect.name for effect in effects} <= NO_SUCH_NODE | {"heat_changes"}
    plant, programme = drawn.plant, drawn.programmes[0]
    start = dict(programme.start)
    for parts in (effect.act.parts for effect in effects):
        known = {body.name for body in plant.bodies} | {boundary.name for boundary in plant.boundaries}
        if not parts.names & known:
            plant = replace(plant, bodies=plant.bodies + parts.bodies, boundaries=plant.boundaries + parts.boundaries,
                            paths=plant.paths + parts.paths)  # fmt: skip
            start |= dict.fromkeys(parts.like, start["oil.sump"])
    variants = [Variant(), *(Variant(changes=effect.changes) for effect in effects)]
    outcome = simulate(plant, replace(programme, start=start), variants)
    wrong = {e.name: moved(e, plant, outcome, b) for b, e in enumerate(effects, start=1)}
    assert {name: value for name, value in wrong.items() if not value > 0.0} == {}


@pytest.mark.parametrize("kind", ["step", "ramp", "from_to"])
def test_a_date_counts_from_the_first_row_and_lasts(
    setting: EffectSetting, drawn: Drawn, fzg: Gearbox, kind: str
) -> None:
    at_h = 0.5 * setting.programmes[0].begins_h + 0.25  # in train_1
    last = drawn.programmes[4]
    to_h = {"step": np.inf, "ramp": at_h + 0.1, "from_to": last.begins_h - 0.5}[kind]
    course = TimeCourse(kind=kind, begins=at_h, ends=to_h)  # type: ignore[arg-type]
    effect = replace(ALL["windage"](setting, np.random.default_rng(1)), course=course)
    case = case_of(drawn, "date", effect.with_strength(0.2 * effect.cap))
    shift = {p.name: case.runs.outcomes[p.name].readings["oil"] for p in case.recordings("train", "hold")}
    before = int(at_h * 360.0)
    first = shift["train_1"][0] - shift["train_1"][1]
    assert np.all(first[:before] == 0.0) and first[before + 30 :].max() > 0.05
    assert (np.abs(shift["hold_2"][0] - shift["hold_2"][1]).max() > 0.05) == (kind != "from_to")
    (changed,) = truth_of(case, fzg.hash, COLUMNS)["changed"]
    assert (changed["what"], changed["of"], changed["sign"], changed["course"]) == ("heat", "oil", 1, kind)
    assert (changed["recording"], changed["from_s"]) == ("train_1", pytest.approx(3600.0 * at_h))


def test_faults_spoil_what_they_name_from_their_date_on(setting: EffectSetting) -> None:
    hours = np.arange(400) / 360.0
    channels = [probe.channel for probe in setting.plant.probes]
    wave = {name: 40.0 + k + 10.0 * np.sin(hours * 6.0) for k, name in enumerate(channels)}
    inputs = {name: np.full(400, 20.0) for name in setting.plant.inputs}
    m = Measured(hours=hours, row_s=10.0, inputs=inputs, readings=wave, P_loss=np.zeros(400))
    course = TimeCourse(kind="step", begins=0.5)
    before = hours < 0.5
    for name in draw.FAULT_MAKERS:
        if name == "heater_power_gain":
            continue
        fault = draw.draw_fault(name, setting, np.random.default_rng(3), course).fault
        assert fault is not None
        if fault.what == "input":
            (one,) = fault.channels
            error = spoiled(m, fault).inputs[one] - inputs[one]
            assert np.all(error[before] == 0.0) and np.all(error[~before] * fault.sign > 0.0), name
            continue
        if fault.kind == "stuck":
            (one,) = fault.channels
            held = spoiled(m, fault).readings[one]
            rows = (hours >= fault.course.begins) & (hours < fault.course.begins + fault.strength)
            assert np.ptp(held[rows]) == 0.0 and np.all(held[~rows] == wave[one][~rows])
            continue
        found = spoiled(m, fault).readings
        changed = {n for n in channels if np.any(found[n] != wave[n])}
        assert changed == set(channels if fault.kind == "clock" else fault.channels), name
        assert all(np.allclose(found[n][before], wave[n][before]) for n in changed), name


@pytest.mark.parametrize("group", ["single", "sensor", "pair", "messy", "outside"])
def test_strengths_follow_the_evidence_within_their_range(drawn: Drawn, fzg: Gearbox, group: str) -> None:
    case = case_of(drawn, group)
    assert all(0.0 < effect.strength <= effect.cap for effect in case.effects)
    dominant = case.effects[0]
    if dominant.least < dominant.strength < dominant.cap and dominant.fault is None:
        assert 1.0 < case.nats_of_effects[0].tool < 3000.0
    assert case.visible == (case.nats_of_effects[0].tool >= 3.0)
    truth = truth_of(case, fzg.hash, COLUMNS)
    json.dumps(truth, allow_nan=False)
    assert [effect["name"] for effect in truth["effects"]] == [effect.name for effect in case.effects]
    for effect, facts in zip(case.effects, truth["effects"], strict=True):
        targets = {one["of"] for one in facts["changed"]}
        assert targets == {changed.of for changed in effect.changed} and targets


def test_same_seed_same_bytes_and_healthy_baselines(
    drawn: Drawn, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(draw, "draw_plant", lambda *_, **__: drawn)
    plans = zoo_plans(5, {"sensor": 1}, families=["walls"], machine="fzg")
    for copy in ("a", "b"):
        write_cases(conceal_zoo(plans, baselines=1), tmp_path / copy / "r", tmp_path / copy / "t")
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*"))
    assert "baseline_1.csv.gz" in {path.name for path in files}
    assert all((tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes() for path in files)


def test_baselines_share_the_plant_up_to_the_deviation(drawn: Drawn, setting: EffectSetting) -> None:
    effect = ALL["windage"](setting, np.random.default_rng(1))
    case = case_of(drawn, "single", effect)
    off = [np.log(v / drawn.plant.parameters[n]) for n, v in case.sessions["baseline_1"].items()]
    assert len(off) == len(drawn.plant.spread) and 0.02 < np.std(off) < 0.04
    baseline = next(p for p in case.programmes if p.name == "baseline_1")
    healthy = simulate(drawn.plant, baseline, [Variant(parameters=case.sessions["baseline_1"])])
    recorded = record_case(case, COLUMNS)["baseline_1"]["T_oil_degC"]
    assert np.nanstd(recorded - healthy.readings["oil"][0]) < 0.25  # noise of 0.2 K


def test_a_folder_that_cannot_be_written_is_named(drawn: Drawn, tmp_path: Path) -> None:
    (tmp_path / "case").write_text("a file, no folder")
    with pytest.raises(InputError, match="case: cannot be written"):
        write_case(files_of_case(case_of(drawn, "control")), tmp_path / "case", None)
