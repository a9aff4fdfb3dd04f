"""Physics that is known before: part of the machine, calibrated along, and in the next correction."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from builder.workflows.known_physics import known_finding
from diagnosis.candidates.controls import moved_set_points
from diagnosis.candidates.dated import Axis, changing, step
from diagnosis.diagnose_recordings import diagnose
from diagnosis.engine import known_switches
from diagnosis.engine.families import candidates_of
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.known_switches import start_with_switches
from diagnosis.engine.mean_loss import mean_loss
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.recording import Recording
from diagnosis.report.write import correction_of
from diagnosis.results.result import Diagnosis
from models.assembly.gearbox import Gearbox
from models.correction.corrected_gearbox import corrected_gearbox
from models.correction.correction import Correction, Estimate, Finding, read_correction, write_correction
from models.correction.instruments import SensorCorrection
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import NODES, at, recorded

TRUE = {"strength": 6.0, "set_point": 38.0, "band": 3.0}
ON = "fan_thermostat_housing"


def fan(fzg: Gearbox, true: Mapping[str, float] = TRUE, **error: float) -> Correction:
    """A fan some of whose numbers are off by `error`, and known to be; the others are exact."""
    given = {n: (value + error.get(n, 0.0), abs(error.get(n, 0.0))) for n, value in (TRUE | dict(true)).items()}
    return Correction.of(fzg, findings=[known_finding(fzg, fzg.network(), "fan_thermostat", given)])


@pytest.fixture(scope="module")
def rides(fzg: Gearbox) -> list[Recording]:
    return [recorded(fzg, name, hours=3.0, seed=seed, correction=fan(fzg), drift_K=drift)
            for name, seed, drift in (("learn", 1, 0.0), ("hold", 2, 0.0), ("drift", 1, 3.0))]  # fmt: skip


def values_of(fit: Fit) -> dict[str, float]:
    both = zip(fit.experiment.unknowns, fit.z.tolist(), strict=True)
    return {unknown.parameter.name.removeprefix(f"{ON}_"): unknown.value(z) for unknown, z in both}


def test_numbers_known_roughly_are_calibrated_and_exact_ones_stay(fzg: Gearbox) -> None:
    nodes = (*NODES, "housing_upper")  # all that the switch feels
    ride = recorded(fzg, "often", hours=4.0, seed=1, nodes=nodes, correction=fan(fzg, {"strength": 15.0}))
    known = fan(fzg, {"strength": 15.0}, strength=-3.0, set_point=2.7)
    pump = known_finding(fzg, fzg.network(), "pump_heat", {"strength": (0.1, 0.0)})
    rough = corrected_gearbox(fzg, known.model_copy(update={"findings": (*known.findings, pump)}))
    setup, experiment = prepare_experiment(rough, [ride], [ride])
    start = start_with_switches(setup, experiment)
    found, from_middles = values_of(calibrate(experiment, start)), values_of(calibrate(experiment))
    assert found["set_point"] == pytest.approx(TRUE["set_point"], abs=0.2)
    assert abs(from_middles["set_point"] - TRUE["set_point"]) > 0.5  # one of its many minima
    assert found["strength"] == pytest.approx(15.0, rel=0.3)
    assert "band" not in found


def test_without_uncertain_switches_a_calibration_begins_in_the_middle(fzg: Gearbox, rides: list[Recording]) -> None:
    known = corrected_gearbox(fzg, fan(fzg, strength=1.0))
    assert start_with_switches(*prepare_experiment(known, rides[:1], rides[1:2])) is None


def test_what_is_known_acts_in_baselines_too(
    fzg: Gearbox, rides: list[Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where its set-point is looked for no baseline is taken to be without it."""
    known = corrected_gearbox(fzg, fan(fzg, set_point=2.7))
    setup, experiment = prepare_experiment(known, rides[:1], rides[1:2], rides[2:])
    seen: list[frozenset[str]] = []

    def looked_at(there: Experiment) -> Fit:
        seen.append(there.healthy)
        raise ArithmeticError

    monkeypatch.setattr(known_switches, "calibrate", looked_at)
    start_with_switches(setup, experiment)
    assert experiment.healthy and seen == [frozenset()]


def looked_for(rides: list[Recording], fzg: Gearbox, known: Correction) -> Diagnosis:
    catalogue = {name: CATALOGUE[name] for name in ("fan_thermostat", "sensor_drift", "foundation_conduction")}
    return diagnose(rides[:1], fzg, holdout=rides[1:], correction=known, catalogue=catalogue)


@pytest.fixture(scope="module")
def known_before(fzg: Gearbox, rides: list[Recording]) -> Diagnosis:
    return looked_for(rides[:2], fzg, fan(fzg, strength=1.0))


def test_what_is_known_is_not_missing(known_before: Diagnosis) -> None:
    assert known_before.verdict == "consistent"
    assert known_before.holdout.calibrated < 0.15
    assert "fan_thermostat" not in known_before.not_tried
    assert "Known before, and part of the model as delivered: fan_thermostat at housing." in str(known_before)


def test_the_next_correction_holds_what_was_known_with_new_numbers(
    fzg: Gearbox, known_before: Diagnosis, tmp_path: Path
) -> None:
    write_correction(correction_of(known_before, fzg), tmp_path / "next.toml")
    again = read_correction(tmp_path / "next.toml", fzg)
    (finding,) = (f for f in again.findings if f.mechanism == "fan_thermostat")
    strength, set_point, _ = finding.parameter
    assert abs(strength.value - TRUE["strength"]) < 2.0 * strength.stderr < 2.0  # was 7 +- 1
    assert (set_point.value, set_point.stderr) == (TRUE["set_point"], 0.0)
    assert not any(e.name.startswith(ON) for e in again.calibration) and again.calibration
    assert known_before.inputs["correction"] == fan(fzg, strength=1.0).of_machine().summary()["sha256"]


def test_what_comes_on_top_is_found_and_both_are_in_the_correction(fzg: Gearbox, rides: list[Recording]) -> None:
    found = looked_for(rides[2:], fzg, fan(fzg, strength=1.0))
    assert found.verdict == "sensor_fault" and found.findings[0].mechanism == "sensor_drift"
    assert {f.mechanism for f in correction_of(found, fzg).findings} >= {"fan_thermostat", "sensor_drift"}


def test_what_is_known_is_no_candidate_a_second_time(fzg: Gearbox, rides: list[Recording]) -> None:
    catalogue = {name: CATALOGUE[name] for name in ("fan_thermostat", "foundation_conduction")}
    names = []
    for known in (Correction(), fan(fzg)):
        gearbox = corrected_gearbox(fzg, known)
        found = candidates_of(*prepare_experiment(gearbox, rides[:1], rides[1:2], catalogue=catalogue))
        names.append({one.name for one in found if one.how == "always"})
        changes = {one.place for one in found if one.name.startswith("air_cooling") and one.how == "from_date"}
    assert names[0] - names[1] == {"fan_thermostat"} and "foundation_conduction" in names[1]
    assert any("fan_thermostat" in place for place in changes)  # but it may change


def test_other_values_of_a_definition_leave_what_is_known(fzg: Gearbox) -> None:
    other = corrected_gearbox(fzg, fan(fzg)).with_values({"factors.h_air": 1.1})
    assert other.factors["h_air"] == 1.1 and any(ON in link.name for link in other.network().links)


def test_instruments_and_model_error_are_asked_anew(fzg: Gearbox) -> None:
    (of_fan,) = fan(fzg).findings
    learnt = [of_fan.model_copy(update={"mechanism": name, "grade": "learnt"}) for name in ("shape", "model error")]
    fault = of_fan.model_copy(update={"of_measurement": True})
    every = Correction.of(fzg, findings=[of_fan, *learnt, fault], sensors=[SensorCorrection(channel="oil", bias=1.0)],
                          calibration=[Estimate(name="h_air", value=1.1, stderr=0.1)])  # fmt: skip
    machine = every.of_machine()
    assert machine.findings == (of_fan,) and machine.sensors == () and machine.calibration == every.calibration


def test_means_over_minutes_have_a_law_of_their_own(fzg: Gearbox, tmp_path: Path) -> None:
    write_correction(fan(fzg), tmp_path / "fan.toml")
    (state,) = read_correction(tmp_path / "fan.toml", fzg).findings[0].term.states
    (declared,) = CATALOGUE["fan_thermostat"].placed(fzg.network(), Scale.of(fzg))[0].states
    at = {"T_housing_lower": 39.0, "T_housing_upper": 40.0, f"{ON}_set_point": 38.0, f"{ON}_band": 3.0,
          f"{ON}_blowing": 0.0}  # fmt: skip
    assert state.averaged_update is not None and declared.averaged_update is not None
    assert state.averaged_update != state.update
    there, here = (float(law.subs({s: at[s.name] for s in law.free_symbols}))
                   for law in (state.averaged_update, declared.averaged_update))  # fmt: skip
    assert there == pytest.approx(here, rel=1e-12)


@pytest.fixture(scope="module")
def moved(fzg: Gearbox) -> tuple[Correction, list[Recording], Diagnosis]:
    """A known cooler whose set-point is turned from 50 down to 40 degC in the first recording, and stays there."""
    given = {"strength": (8.0, 0.0), "set_point": (50.0, 0.0), "band": (10.0, 0.0), "coolant": (27.0, 0.0)}
    known = Correction.of(fzg, findings=[known_finding(fzg, fzg.network(), "cooler_proportional", given)])
    axis = Axis(dates=np.array([5760.0]), end=10_800.0, until=18_000.0)
    (control,) = moved_set_points(known.findings, Scale.of(fzg, speed=3300.0, torque=150.0))
    lower = changing(control, step(axis, slow=False), axis)
    rides = []
    for name, seed, start, hours in (("before and after", 1, 0.0, 3.0), ("later", 2, 10_800.0, 1.5)):
        true = {"strength": 1.0, "set_point": 40.0, "band": 10.0, "since": 5760.0, "within": 240.0, "start": start}
        values = {f"{lower.added.label}_{key}": (value, 0.0) for key, value in true.items()}
        turned = Finding.of(lower.added, values, mechanism=lower.name)
        machine = known.model_copy(update={"findings": (*known.findings, turned)})
        rides.append(recorded(fzg, name, hours=hours, seed=seed, correction=machine))
    return known, rides, looked_for(rides, fzg, known)


def test_a_set_point_that_is_turned_at_a_date_is_found(moved: tuple[Correction, list[Recording], Diagnosis]) -> None:
    *_, found = moved
    (finding,) = found.findings
    assert (finding.mechanism, finding.place) == ("cooler_proportional_moved_set_point_step", "oil")
    assert finding.grade == "claim" and finding.says.endswith(
        "the known cooler proportional has another set-point (oil)."
    )
    (set_point,) = (p for p in finding.parameters if p.name == "set_point")
    assert set_point.value == pytest.approx(40.0, abs=2.0 * set_point.stderr) and set_point.stderr < 2.0
    assert finding.date is not None and finding.date.from_s == pytest.approx(5760.0, abs=120.0)
    assert found.holdout.after < 0.1 < 5.0 * found.holdout.after < found.holdout.calibrated


def test_its_correction_holds_the_control_as_it_was_last(
    fzg: Gearbox, moved: tuple[Correction, list[Recording], Diagnosis], tmp_path: Path
) -> None:
    """Read back, with its clock at the end of what was recorded: the machine with the lower set-point."""
    known, _, found = moved
    write_correction(correction_of(found, fzg), tmp_path / "next.toml")
    machine = corrected_gearbox(fzg, read_correction(tmp_path / "next.toml", fzg))
    as_known = corrected_gearbox(fzg, known)
    turned, before = (m.steady_state(speed=2500.0, torque=100.0) for m in (machine, as_known))
    assert turned.temperatures["oil"] < before.temperatures["oil"] - 2.0


BED = {"strength": 1.4, "feet": 10.0, "lag": 2700.0}  # 15 W/K to 45 kJ/K; the gearbox itself has 22 kJ/K


def bed(fzg: Gearbox, numbers: Mapping[str, float], share: float = 0.0) -> Correction:
    """A bed under the lower housing, its numbers known by some share of them."""
    given = {name: (value, share * value) for name, value in numbers.items()}
    return Correction.of(fzg, findings=[
        known_finding(fzg, fzg.network(), "foundation_conduction", given, place="housing_lower")])  # fmt: skip


def test_a_known_bed_gives_the_losses_back(fzg: Gearbox) -> None:
    """None is measured, so watts rest on heat capacities; sliding friction is 30 % above the definition's."""
    factors, known = {"mesh": 1.3, "h_air": 1.15}, bed(fzg, {"strength": 2.0, "feet": 5.0, "lag": 4000.0}, share=0.8)
    ride = recorded(fzg, "learn", hours=6.0, seed=3, factors=factors, correction=bed(fzg, BED))
    true, without, rough = (
        prepare_experiment(gearbox, [ride], [ride])[1]
        for gearbox in (corrected_gearbox(fzg, bed(fzg, BED)), fzg, corrected_gearbox(fzg, known))
    )
    loss = mean_loss(true.fit(at(true, factors), iterations=0))
    nominal, found = calibrate(without), calibrate(rough)
    assert abs(mean_loss(nominal) - loss) > 0.1 * loss
    assert abs(mean_loss(found) - loss) < 0.05 * loss
    lag = next(value for name, value in values_of(found).items() if name.endswith("lower_lag"))
    assert lag == pytest.approx(BED["lag"], rel=0.05)
