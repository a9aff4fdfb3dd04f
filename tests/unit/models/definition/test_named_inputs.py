"""Inputs that a definition without geometry names: refused ones, and laws, losses and boundaries that use them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from diagnosis.recordings.read import read_recording
from models.assembly.gearbox import Gearbox, load_gearbox, read_gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle

RIG = """
schema = 1
name = "test body"
source = "made up"

[[input]]
name = "oil_flow"
quantity = "volume flow"
unit = "l/min"
range = [0.0, 60.0]
default = 10.0

[[input]]
name = "heater"
quantity = "power"
unit = "kW"
range = [0.0, 5.0]

[[input]]
name = "T_coolant"
quantity = "temperature"
unit = "degC"
range = [-20.0, 90.0]
default = 40.0

[[parameter]]
name = "leak"
start = { value = 2.0, sd = "50 %" }
unit = "W/K"

[[boundary]]
name = "room"
input = "T_ambient"
temperature_degC = 20.0

[[boundary]]
name = "coolant"
input = "T_coolant"

[[part]]
name = "body"
heat_capacity_J_K = 1000.0

[[link]]
between = ["body", "room"]
conductance_W_K = 1.0
factor = "leak"

[[link]]
between = ["body", "coolant"]
conductance_W_K = 30.0
factor = "oil_flow / 10.0"

[[heat]]
name = "heater"
part = "body"
heat_W = "1000.0 * heater"
"""


def rig(text: str = RIG) -> Gearbox:
    return read_gearbox(text, file="rig.toml")


@pytest.mark.parametrize(("old", "new", "message"), [
    ('unit = "l/min"\n', "", "input 'oil_flow': unit is missing; a volume flow is given in one of m3/s, l/min"),
    ('unit = "l/min"', 'unit = "kW"', "input 'oil_flow': 'kW' is no unit of volume flow; known are m3/s, l/min"),
    ('"volume flow"', '"flow"', "input 'oil_flow': quantity is 'flow'; one of speed, torque, temperature, power"),
    ("range = [0.0, 60.0]\n", "", "input 'oil_flow': range is missing"),
    ("range = [0.0, 60.0]", "range = [60.0, 0.0]", "the first number must be below the second, not 60, 0"),
    ("default = 10.0", "default = 70.0", "input 'oil_flow': default is 70, outside the range 0 ... 60"),
    ('"oil_flow / 10.0"', '"oil_flw / 10.0"', "link #2.factor: 'oil_flw' is no input and no temperature of this "
     "definition; did you mean 'oil_flow'"),
    ('"oil_flow / 10.0"', '"oil_flow / 10.0 - 1.0"', "link #2.factor: is -1 at oil_flow = 0; a conductance is"),
    ('"oil_flow / 10.0"', '"-1.0"', "link #2.factor: is -1; a conductance is never negative"),
    ('"oil_flow / 10.0"', '"10.0 / oil_flow"', "link #2.factor: is inf at oil_flow = 0; keep what it divides by"),
    ('"1000.0 * heater"', '"heater / oil_flow"', "heat 'heater'.heat_W: is inf at"),
    ('heat_W = "1000.0 * heater"', 'heat_W = "1000.0 * "', "heat 'heater'.heat_W: '1000.0 * ' is not an expression"),
    ('part = "body"', 'part = "bdy"', "heat 'heater'.part: there is no part 'bdy'; did you mean 'body'"),
    ('name = "heater"\nquantity', 'name = "T_body"\nquantity', "'T_body' names several inputs, parameters, factors or"),
    ('name = "heater"\nquantity', 'name = "C_body"\nquantity', "'C_body' names several inputs, parameters, factors or"),
    ('name = "heater"\nquantity', 'name = "heater_gain"\nquantity', "'heater_gain' names several inputs"),
    ('input = "T_coolant"', 'input = "T_coolant"\n\n[[boundary]]\nname = "ambient"\ninput = "T_coolant"',
     "'T_ambient' names several inputs, parameters, factors or nodes"),
    ('name = "heater"\nquantity', 'name = "lambda"\nquantity', "'lambda' has a meaning in formulas; give the input"),
    ('input = "T_coolant"', 'input = "T_cool"', "'T_cool' is no [[input]]; declare it, or give"),
    ('input = "T_coolant"', 'input = "heater"', "boundary 'coolant'.input: 'heater' is a power, not a temperature"),
    ('name = "heater"\nquantity = "power"', 'name = "speed"\nquantity = "power"', "speed is always a speed in 1/min"),
])  # fmt: skip
def test_faults_of_inputs_are_named(old: str, new: str, message: str) -> None:
    assert old in RIG
    with pytest.raises(InputError, match=re.escape(message)):
        rig(RIG.replace(old, new, 1))


def test_a_factor_may_have_no_value_where_it_is_tried() -> None:
    """Roots of negative numbers are no fault of the sign."""
    for law in ("(oil_flow - 30.0)**0.7", "Max(0, oil_flow / 10.0 - 1.0)"):
        assert rig(RIG.replace('"oil_flow / 10.0"', f'"{law}"', 1)).is_parametric


def test_laws_boundaries_and_parameters_use_them() -> None:
    """At rest: 2 kW = leak (T - 20) + 3 flow (T - coolant), by hand."""
    machine = rig()
    network = machine.network()
    assert {name: given.required for name, given in network.inputs.items()} == {
        "oil_flow": False, "heater": True, "T_coolant": False, "T_ambient": False,
    }  # fmt: skip
    for flow, coolant, leak in ((10.0, 40.0, 2.0), (50.0, 30.0, 8.0)):
        inputs = {"heater": 2.0, "oil_flow": flow, "T_coolant": coolant}
        result = network.steady_state(losses=machine.loss_laws(), inputs=inputs, parameters={"leak": leak})
        expected = (2000.0 + leak * 20.0 + 3.0 * flow * coolant) / (leak + 3.0 * flow)
        assert result.temperatures["body"] == pytest.approx(expected, rel=1e-9)
    assert "P_loss_W" not in result.columns() and "efficiency" not in result.columns()


def test_cycles_and_recordings_need_what_has_no_default(tmp_path: Path) -> None:
    network = rig().network()
    with pytest.raises(InputError, match="column heater is missing"):
        Cycle.from_columns({"time_s": [0.0, 1.0]}, inputs=network.inputs)
    with pytest.raises(InputError, match=r"oil_flow is 80 at row 2; 0 \.\.\. 60 is possible \(l/min\)"):
        Cycle.from_columns({"time_s": [0.0, 1.0], "heater": [0.0, 1.0], "oil_flow": [5.0, 80.0]}, inputs=network.inputs)
    time = np.arange(0.0, 600.0, 10.0)
    rows = "\n".join(f"{t},{0.5 + 0.2 * (t > 300)},12,{20 + 0.01 * t}" for t in time)
    (tmp_path / "run.csv").write_text(f"time_s,heater_kW,flow,T_body_degC\n{rows}\n")
    (tmp_path / "run.toml").write_text(
        'schema = 1\n[columns.heater_kW]\nquantity = "heater"\nunit = "W"\nscale = 1000\n'
        '[columns.flow]\nquantity = "oil_flow"\nunit = "l/h"\nscale = 60\n'
    )
    recording = read_recording(tmp_path / "run.csv", network)
    assert recording.inputs["heater"][[0, -1]] == pytest.approx([0.5, 0.7])
    assert recording.inputs["oil_flow"][0] == pytest.approx(12.0)
    assert recording.assumed == ("T_coolant", "T_ambient")
    (tmp_path / "run.toml").write_text('schema = 1\n[columns.flow]\nquantity = "oil_flow"\nunit = "bar"\n')
    with pytest.raises(InputError, match="flow has the unit 'bar', which is no unit of volume flow"):
        read_recording(tmp_path / "run.csv", network)


def test_several_sensors_measure_one_node(tmp_path: Path) -> None:
    network = load_gearbox("heated_rod").network()
    path = Path(__file__).parents[4] / "examples" / "data" / "heated_rod.csv.gz"
    recording = read_recording(Path(f"{path}@0..600"), network)
    assert [c.name for c in recording.channels][4:8] == ["cell_5", "cell_6__NTC6", "cell_6__NTC7", "cell_7"]
    assert len(recording.channels) == 13 and set(recording.inputs) == {"heater_power", "T_ambient"}
    (tmp_path / "twice.toml").write_text(
        'schema = 1\n[columns.A]\nquantity = "T_cell_1"\n[columns.B]\nquantity = "T_cell_1"\n'
    )
    (tmp_path / "twice.csv").write_text("time_s,A,B\n0,1,2\n")
    with pytest.raises(InputError, match="columns 'A' and 'B' are both T_cell_1; keep one, or give each sensor"):
        read_recording(tmp_path / "twice.csv", network)


def test_torque_from_an_electrical_power_is_that_torque() -> None:
    """The wind turbine driven by its electrical power: efficiency times power over speed, also through a shift."""
    plain = load_gearbox("la_haute_borne")
    text = (Path(__file__).parents[4] / "models" / "gearboxes" / "la_haute_borne.toml").read_text(encoding="utf-8")
    table = (
        '[torque]\npower = "P_electrical"\nefficiency = { value = 0.95, sd = 0.02 }\n\n[[input]]\n'
        'name = "P_electrical"\nquantity = "power"\nunit = "kW"\nrange = [-100.0, 2500.0]\n\n[[boundary]]'
    )
    by_power = read_gearbox(text.replace("[[boundary]]", table, 1), file="power.toml")
    time = np.linspace(0.0, 36000.0, 61)
    speed, power = 1500.0 + 200.0 * np.sin(time / 5000.0), 900.0 + 700.0 * np.cos(time / 7000.0)
    given = {"time_s": time, "speed_rpm": speed, "T_ambient_degC": 12.0 + 0.0 * time, "T_outdoor": 5.0 + 0.0 * time}
    for eta in (1.0, 1.02):
        torque = eta * 0.95 * 1000.0 * power / (speed * np.pi / 30.0)
        expected = plain.network().simulate(given | {"torque_Nm": torque}, losses=plain.loss_laws(), initial=40.0)
        network = by_power.network()
        assert "torque" not in network.inputs and "efficiency" in {p.name for p in network.parameters}
        found = network.simulate(
            given | {"P_electrical": power}, losses=by_power.loss_laws(), initial=40.0, parameters={"efficiency": eta}
        )
        with pytest.raises(InputError, match="'torque' follows from P_electrical, speed here; give inputs"):
            network.steady_state(losses=by_power.loss_laws(), speed=1500.0, torque=290.0)
        # Power over speed is not straight between the rows where the torque is.
        assert found.temperatures["oil"] == pytest.approx(expected.temperatures["oil"], abs=0.01)


def test_losses_as_laws_are_the_losses() -> None:
    machine = load_gearbox("la_haute_borne")
    network = machine.network().with_signal_shift("torque", 200.0)
    time = np.linspace(0.0, 7200.0, 73)
    cycle = {"time_s": time, "speed_rpm": np.linspace(0.0, 1800.0, 73), "torque_Nm": np.linspace(-500.0, 9000.0, 73)}
    expected = network.simulate(cycle, losses=machine.loss_laws(), initial=10.0).columns()
    laws = machine.network_of_laws(network)
    assert laws.components == ()
    found = laws.simulate(cycle, losses=rig().loss_laws(), initial=10.0).columns()
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-9, atol=1e-9, err_msg=name)


def test_definitions_of_before_keep_their_hash() -> None:
    """Corrections that were written for them stay valid."""
    assert load_gearbox("la_haute_borne").hash.startswith("a090e063e5b7")
    assert load_gearbox("fzg").hash.startswith("32b12da82089")
