"""What every FMU of this project must do, whatever kind it is."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from builder.drive.driver import drive_fmu
from builder.fmi.signals import signal_table
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.files.cycle import Cycle
from tests.contract.conftest import Illegal
from tests.contract.fmu_host import LOADED, Host, check_reference_run, hosted
from tests.contract.networks import extended, with_everything

WARNING, ERROR = 1, 3
NO_VALUE = {"python": ERROR, "native": WARNING}  # of the message; the native FMU can say what the call returns
T_OUT = ("oil.T", "pinion.T", "mesh.T", "housing_lower.T")


# ---------------------------------------------------------------------- what it says about itself


def test_fmpy_finds_no_problem(path: Path) -> None:
    assert validate_fmu(str(path)) == []


def test_variables_are_those_of_the_table(path: Path, fzg: Gearbox, fzg_training: TrainingResult) -> None:
    description = read_model_description(str(path))
    table = signal_table(fzg.network(), fzg_training.losses)
    assert [v.name for v in description.modelVariables] == [s.name for s in table]
    for variable, signal in zip(description.modelVariables, table, strict=True):
        assert variable.valueReference == signal.reference
        assert variable.unit == signal.unit
        assert variable.description


def test_start_values_of_the_description_are_those_of_the_binary(path: Path) -> None:
    description = read_model_description(str(path))
    started = {v.name: v.start for v in description.modelVariables if v.start is not None}
    with hosted(path, start=False) as host:
        values = host.get(*started)
    for (name, start), value in zip(started.items(), values, strict=True):
        expected = {"true": 1.0, "false": 0.0}[start] if start in ("true", "false") else float(start)
        assert value == expected, name


def test_flags_are_truthful(path: Path, kind: str) -> None:
    flags = read_model_description(str(path)).coSimulation
    assert flags.canGetAndSetFMUstate
    assert flags.canSerializeFMUstate
    assert flags.canHandleVariableCommunicationStepSize
    assert flags.needsExecutionTool == (kind == "python")
    assert flags.canInterpolateInputs == (kind == "native")
    assert flags.providesDirectionalDerivative == (kind == "native")
    assert not flags.canBeInstantiatedOnlyOncePerProcess


# ---------------------------------------------------------------------- initialization


def test_outputs_are_valid_in_initialization_mode(path: Path) -> None:
    with hosted(path, start=False) as host:
        host.slave.setupExperiment(startTime=0.0)
        host.slave.enterInitializationMode()
        host.set_all(LOADED | {"initial.T": 350.0})
        assert host.get("oil.T", "mesh.T", "air.T") == pytest.approx([350.0, 350.0, 293.15], abs=1e-9)
        outputs = host.outputs()
        losses = [value for name, value in outputs.items() if name.startswith("loss.") and name != "loss.total"]
        assert outputs["loss.total"] == pytest.approx(sum(losses), rel=1e-12)
        assert outputs["loss.total"] > 100.0
        assert outputs["torque_loss"] == pytest.approx(outputs["loss.total"] / 300.0, rel=1e-12)
        assert outputs["efficiency"] == pytest.approx(1.0 - outputs["loss.total"] / (300.0 * 150.0), rel=1e-12)
        assert outputs["in_domain"] == 1
        assert outputs["domain_distance"] == 0.0


def test_nodes_start_at_their_own_temperatures_where_not_uniform(path: Path) -> None:
    with hosted(path, {"initial.uniform": 0.0, "oil.T_start": 340.0, "initial.T": 400.0}) as host:
        assert host.get("oil.T", "pinion.T") == pytest.approx([340.0, 300.15], abs=1e-9)


def test_start_temperature_in_degC_is_refused_and_can_be_corrected(path: Path, kind: str, illegal: Illegal) -> None:
    with hosted(path, start=False) as host:
        host.enter({"initial.T": 20.0})
        with illegal():
            host.slave.exitInitializationMode()
        assert math.isnan(host.get("oil.T")[0])
        assert "initial.T is 20 K; 173.15 to 773.15 K is possible" in host.said[0][1]
        if kind == "python":  # initialized for pythonfmu, which cannot refuse it
            assert "initial.T" in host.refused()
        host.set_all({"initial.T": 293.15})
        if kind == "native":
            host.slave.exitInitializationMode()
        host.step(1.0)
        assert 293.15 < host.get("oil.T")[0] < 300.0


def test_simulation_may_start_at_any_time(path: Path, host: Host) -> None:
    host.step(10.0)
    with hosted(path, time=86400.0) as late:
        late.step(10.0)
        assert late.outputs() == host.outputs()


# ---------------------------------------------------------------------- stepping


@pytest.mark.parametrize("duration", [0.1, 1.0, 10.0])
def test_communication_step_does_not_matter(path: Path, duration: float) -> None:
    speeds = [100.0, 400.0, 50.0, 300.0]
    with hosted(path) as fine, hosted(path) as coarse:
        for speed in speeds:
            fine.set(speed=speed)
            coarse.set(speed=speed)
            fine.step(duration, count=round(60.0 / duration))
            coarse.step(60.0)
            fine.time = coarse.time
            assert fine.get(*T_OUT) == pytest.approx(coarse.get(*T_OUT), abs=0.05)


@pytest.mark.parametrize(
    ("name", "value", "hint"),
    [
        ("speed", math.nan, "is nan"),
        ("torque", math.inf, "is inf"),
        ("speed", 1e6, "rad/s"),
        ("air_speed", -1.0, "0 to 200 m/s"),
        ("T_ambient", 20.0, "is 20 K; 183.15 to 473.15 K is possible"),
        ("factor.bearing", math.nan, "is nan"),
        ("factor.bearing", -1.0, "0.05 to 20"),
        ("factor.C_oil", 0.0, "0.05 to 20"),
    ],
)
def test_impossible_value_is_discarded_with_a_message_and_nothing_changes(
    path: Path, kind: str, host: Host, name: str, value: float, hint: str
) -> None:
    host.step(5.0)
    good = host.get(name)[0]
    before = host.outputs()
    host.set_all({name: value})
    assert math.isnan(host.get("loss.total")[0])
    assert [status for status, _ in host.said] == [NO_VALUE[kind]]
    text = host.refused()
    assert name in text
    assert hint in text
    host.set_all({name: good})
    assert host.outputs() == before
    host.step(5.0)
    with hosted(path) as calm:
        calm.step(5.0, count=2)
        assert calm.outputs() == host.outputs()


def test_factors_can_be_tuned_at_any_time(path: Path, host: Host) -> None:
    with hosted(path) as other:
        host.step(60.0)
        other.step(60.0)
        mesh = host.get("loss.mesh_sliding")[0]
        host.set_all({"factor.mesh": 2.0})
        assert host.get("loss.mesh_sliding")[0] == pytest.approx(2.0 * mesh, rel=1e-9)
        host.step(60.0)
        other.step(60.0)
        assert host.get("oil.T")[0] > other.get("oil.T")[0] + 0.05


def test_outputs_follow_the_inputs_without_a_step(host: Host) -> None:
    host.step(10.0)
    driven = host.get("loss.total", "oil.T")
    host.set(speed=0.0, torque=0.0)
    rest = host.get("loss.total", "efficiency", "torque_loss", "oil.T")
    assert rest[:3] == [0.0, 0.0, 0.0]
    assert rest[3] == driven[1]
    host.set(speed=-LOADED["speed"], torque=LOADED["torque"])
    assert host.get("loss.total")[0] == driven[0]
    assert host.get("torque_loss")[0] < 0.0


# ---------------------------------------------------------------------- range of training


def test_one_warning_per_excursion(host: Host) -> None:
    def warnings() -> list[str]:
        return [text for status, text in host.said if status == WARNING]

    host.step(1.0, count=3)
    assert warnings() == []
    assert host.get("in_domain", "domain_distance") == [1, 0.0]
    for _ in range(2):
        host.set(speed=1000.0)
        host.step(1.0, count=3)
        (text,) = warnings()
        assert "speed" in text
        assert host.get("in_domain")[0] == 0
        assert host.get("domain_distance")[0] == pytest.approx((1000.0 * 30.0 / np.pi - 6500.0) / 6499.0, rel=1e-9)
        host.set(speed=LOADED["speed"])
        host.step(1.0, count=3)
        assert warnings() == []
        assert host.get("in_domain")[0] == 1


def test_a_step_that_is_refused_does_not_count_as_warned(host: Host) -> None:
    host.set(speed=1000.0, torque=math.nan)
    host.refused()
    host.set(torque=LOADED["torque"])
    host.step(1.0)
    assert [text for status, text in host.said if status == WARNING and "operating point is outside" in text]


# ---------------------------------------------------------------------- agreement with the network in Python


def test_a_network_with_every_kind_of_law_runs_as_in_python(
    kind: str, request: pytest.FixtureRequest, fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path
) -> None:
    """From a folder with blanks and other letters; its memories are part of a saved state."""
    network = (with_everything if kind == "native" else extended)(fzg.network())
    build = request.getfixturevalue({"python": "build_fmu", "native": "build_native"}[kind])
    (tmp_path / "Prüfstand Ω 齿轮 100%").mkdir()
    path = build(tmp_path / "Prüfstand Ω 齿轮 100%" / "extended box.fmu", network)
    assert validate_fmu(str(path)) == []
    time = np.arange(0.0, 121.0)
    columns = {"time_s": time, "speed_rpm": 0.0 * time + 2000.0, "torque_Nm": 0.0 * time + 200.0, "pump_flow": time}
    cycle = Cycle.from_columns(columns, inputs=network.inputs)
    expected = network.simulate(cycle, losses=fzg_training.losses, initial=25.0)
    driven = drive_fmu(path, cycle, initial=25.0)
    assert list(driven) == list(expected.columns())
    for name, values in expected.columns().items():
        kelvin = 273.15 if name.endswith("_degC") else 0.0
        scale = np.max(np.abs(values + kelvin))
        # pythonfmu takes no rates: inputs are held in pieces of 0.5 s, and a thermostat may switch a row later
        tolerance = {"native": 1e-9, "python": 2e-2}[kind]
        np.testing.assert_allclose(driven[name], values, rtol=0.0, atol=tolerance * scale, err_msg=name)
    heater = expected.extra_heat["heater (electric)"]
    assert 0.0 < np.mean(heater > 0.0) < 1.0
    with hosted(path) as host:
        assert host.get("state.heater_on") == [1.0]
        host.step(1.0, count=60)
        assert host.get("state.heater_on") == [0.0]
        state, begin = host.slave.getFMUstate(), host.time
        host.step(7.3, count=10)
        first = host.outputs()
        host.slave.setFMUstate(state)
        host.time = begin
        host.step(7.3, count=10)
        assert host.outputs() == first
        host.slave.freeFMUstate(state)


def test_the_reference_run_is_what_fmpy_finds(path: Path, tmp_path: Path) -> None:
    check_reference_run(path, tmp_path)


def test_native_and_python_fmu_agree(fzg_fmu: Path, fzg_native: Path) -> None:
    """At held inputs, inside and outside the range of training."""
    with hosted(fzg_fmu, {"factor.bearing": 1.7}) as python, hosted(fzg_native, {"factor.bearing": 1.7}) as native:
        for speed, torque, duration in ((300.0, 150.0, 1.0), (310.0, 150.0, 60.0), (-20.0, 150.0, 0.3),
                                        (0.0, 150.0, 30.0), (1000.0, 150.0, 200.0), (200.0, 700.0, 5.0)):  # fmt: skip
            for host in (python, native):
                host.set(speed=speed, torque=torque)
                host.step(duration)
            assert python.outputs() == pytest.approx(native.outputs(), rel=1e-9, abs=1e-9)
