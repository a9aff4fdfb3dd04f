"""Inputs that a definition names are inputs of the FMU: SI units inside, their own unit for people and in files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from builder.drive.driver import drive_fmu
from builder.drive.machine_of_fmu import fmu_machine
from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from builder.surrogate.train import TrainingResult
from models.files.cycle import Cycle
from tests.unit.models.around_fzg import around_fzg
from tests.unit.models.definition.test_named_inputs import rig


@pytest.mark.parametrize("kind", ["native", "python"])
def test_they_keep_their_unit_on_both_sides(kind: str, tmp_path: Path) -> None:
    machine = rig()
    network = machine.network()
    path = tmp_path / "rig.fmu"
    if kind == "native":
        build_native_fmu(machine, None, path, network=network)
    else:
        build_python_fmu(machine, None, (), path, network=network)
    assert validate_fmu(str(path)) == []
    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    flow, heater = variables["oil_flow"], variables["heater"]
    assert (flow.causality, flow.unit, flow.displayUnit) == ("input", "m3/s", "l/min")
    assert float(flow.start) == pytest.approx(10.0 / 6e4) and float(flow.max) == pytest.approx(60.0 / 6e4)
    assert (heater.unit, heater.displayUnit, float(heater.max)) == ("W", "kW", 5000.0)
    found = fmu_machine(path).inputs
    for name, given in network.inputs.items():
        own, quantity = found[name], given.quantity
        assert (own.quantity.unit, own.required) == (quantity.unit, given.required)
        numbers = (own.quantity.low, own.quantity.high, own.default)
        assert numbers == pytest.approx((quantity.low, quantity.high, given.default))
    assert not {"speed", "torque", "efficiency", "loss.total", "in_domain"} & variables.keys()
    time = np.arange(0.0, 601.0, 5.0)
    columns = {
        "time_s": time, "heater": 1.0 + 0.0 * time, "oil_flow": 10.0 + 0.05 * time, "T_coolant": 35.0 + 0.0 * time,
    }  # fmt: skip
    cycle = Cycle.from_columns(columns, inputs=network.inputs)
    expected = network.simulate(cycle, losses=machine.loss_laws(), initial=20.0).columns()
    driven = drive_fmu(path, cycle, initial=20.0)
    assert list(driven)[:5] == list(expected)[:5] == ["time_s", *(given.column for given in network.inputs.values())]
    assert driven["oil_flow"] == pytest.approx(columns["oil_flow"])
    assert Cycle.from_columns(driven, inputs=network.inputs).inputs["T_coolant"] == pytest.approx(columns["T_coolant"])
    tolerance = {"native": 1e-9, "python": 0.01}[kind]  # the Python FMU holds its inputs
    np.testing.assert_allclose(driven["T_body_degC"], expected["T_body_degC"], rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("kind", ["native", "python"])
def test_a_geometry_has_those_of_its_surroundings_too(
    kind: str, fzg_training: TrainingResult, fzg_networks: tuple[Path, ...], tmp_path: Path
) -> None:
    """Flow and temperatures of a water jacket and a flange come from the host; the bed has its own temperature."""
    machine, path = around_fzg(), tmp_path / "around.fmu"
    network = machine.network()
    if kind == "native":
        build_native_fmu(machine, fzg_training, path, network=network)
    else:
        build_python_fmu(machine, fzg_training, fzg_networks, path, network=network)
    assert validate_fmu(str(path)) == []
    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    inputs = [name for name, variable in variables.items() if variable.causality == "input"]
    assert inputs == ["speed", "torque", "T_ambient", "air_speed", "coolant_flow", "T_flange", "T_coolant"]
    assert float(variables["T_flange"].start) == pytest.approx(313.15) and variables["coolant_flow"].unit == "m3/s"
    assert {"bed.T", "coolant.heat_flow", "heat.motor", "factor.G_housing_upper_flange", "factor.share"} <= set(
        variables
    )
    time = np.arange(0.0, 1801.0, 5.0)
    columns = {
        "time_s": time, "speed_rpm": 1500.0 + 0.0 * time, "torque_Nm": 94.0 + 0.0 * time,
        "coolant_flow": np.interp(time, [0.0, 900.0, 905.0], [0.0, 0.0, 8.0]), "T_flange": 30.0 + 0.01 * time,
        "T_coolant": 20.0 + 0.0 * time,
    }  # fmt: skip
    cycle = Cycle.from_columns(columns, inputs=network.inputs)
    full = network.simulate(cycle, losses=machine.losses(), initial=25.0).columns()
    driven = drive_fmu(path, cycle, initial=25.0)
    for node in ("housing_upper", "oil", "bed", "coolant", "flange"):  # by quick networks
        np.testing.assert_allclose(driven[f"T_{node}_degC"], full[f"T_{node}_degC"], rtol=0.0, atol=0.3, err_msg=node)
    without = drive_fmu(path, {name: columns[name] for name in ("time_s", "speed_rpm", "torque_Nm")}, initial=25.0)
    assert driven["T_housing_upper_degC"][-1] < without["T_housing_upper_degC"][-1] - 5.0
