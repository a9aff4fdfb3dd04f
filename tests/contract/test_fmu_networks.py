"""FMUs of thermal networks whose heat sources are all laws: no gearbox, no loss networks."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from builder.drive.driver import drive_fmu
from builder.fmi.signals import signal_table
from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle
from models.portable.evaluation import NoLosses
from models.quantities.quantities import usual_inputs
from models.simulation.thermal_network import ThermalNetwork
from tests.contract.fmu_host import check_reference_run
from tests.contract.networks import thermostat

ANY = load_gearbox("la_haute_borne")  # gives a name and a hash


def lone_block() -> ThermalNetwork:
    """One node and a fixed surrounding; no input, parameter, memory or loss."""
    return (
        ThermalNetwork(nodes=())
        .with_node("block", 200.0)
        .with_source("block", 40.0, name="heater")
        .with_link("block", "room", 1.5, temperature=20.0)
    )


def rod() -> ThermalNetwork:
    """Cells in a row, heated at one end, cooled along the length; inputs with units, no speed or torque."""
    network = ThermalNetwork(nodes=(), inputs=usual_inputs(T_ambient=20.0))
    network = network.with_input("heater_power", 0.0, quantity="power", low=0.0, high=60.0)
    network = network.with_input("fan_flow", 30.0, quantity="volume flow", unit="l/min", low=0.0, high=90.0)
    for cell in range(4):
        network = network.with_node(f"cell_{cell}", 35.0)
        network = network.with_link(f"cell_{cell}", "air", lambda s: 0.02 + 0.001 * s.fan_flow, temperature=(
            (lambda s: s.T_ambient) if cell == 0 else None))  # fmt: skip
        if cell:
            network = network.with_link(f"cell_{cell - 1}", f"cell_{cell}", 0.4)
    return network.with_source("cell_0", lambda s: s.heater_power, name="heater")


def machine() -> ThermalNetwork:
    """A shaft with a loss that is a law of a shifted speed, a thermostat, and heat that depends on time."""
    return (
        ThermalNetwork(nodes=(), inputs=usual_inputs(torque=0.0, speed=0.0, T_ambient=20.0))
        .with_node("oil", 4000.0)
        .with_node("case", 20000.0)
        .with_source("oil", lambda s: 0.02 * sp.Abs(s.speed * s.torque) + 1e-4 * s.speed**2, name="gears", is_loss=True)
        .with_state("heater_on", start=1.0, update=thermostat)
        .with_source("oil", lambda s: 900.0 * s.heater_on, name="heater")
        .with_source("case", lambda s: 20.0 * sp.sin(s.time / 40.0), name="sun")
        .with_link("oil", "case", 60.0)
        .with_link("case", "air", lambda s: 5.0 + 0.1 * sp.Abs(s.T_case - s.T_air), temperature=lambda s: s.T_ambient)
        .with_signal_shift("speed", lambda s: 10.0 + 0.01 * s.T_oil)
    )


def coupled_rod() -> ThermalNetwork:
    """The rod with the temperature of a room as a heat port."""
    room = rod().with_link("cell_1", "room", 0.1, temperature=lambda s: s.T_ambient + 1.0)
    return room.with_coupled_boundary("room")


def cycle_of(network: ThermalNetwork) -> Cycle:
    """Every input between two values, one phase per input."""
    time = np.linspace(0.0, 900.0, 91)
    far = {
        "speed": 1500.0,
        "torque": 80.0,
        "T_ambient": 10.0,
        "room_T_in": 60.0,
        "heater_power": 50.0,
        "fan_flow": 60.0,
    }
    return Cycle(time, {
        name: given.default + (far[name] - given.default) * (1.0 + np.sin(time / (70.0 + 30.0 * phase))) / 2.0
        for phase, (name, given) in enumerate(network.inputs.items())
    })  # fmt: skip


@pytest.fixture(scope="module", params=[lone_block, rod, coupled_rod, machine])
def network(request: pytest.FixtureRequest) -> ThermalNetwork:
    make: Callable[[], ThermalNetwork] = request.param
    return make()


@pytest.fixture(scope="module")
def path(network: ThermalNetwork, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("networks") / "thermal.fmu"
    return build_native_fmu(ANY, None, target, network=network, platforms="host")


def test_the_fmu_is_the_network(path: Path, network: ThermalNetwork) -> None:
    assert validate_fmu(str(path)) == []
    cycle = cycle_of(network)
    expected = network.simulate(cycle, losses=NoLosses(), initial=25.0).columns()
    driven = drive_fmu(path, cycle, initial=25.0)
    for name, values in expected.items():
        if name != "in_domain":
            np.testing.assert_allclose(driven[name], values, rtol=1e-9, atol=1e-9, err_msg=name)


def test_outputs_are_those_that_the_network_has(path: Path, network: ThermalNetwork) -> None:
    names = {variable.name for variable in read_model_description(str(path)).modelVariables}
    assert not {"in_domain", "domain_distance"} & names
    assert ("loss.total" in names) == any(source.is_loss for source in network.sources)
    assert ({"torque_loss", "efficiency"} <= names) == ("speed" in network.inputs)


def test_the_reference_run_is_what_fmpy_finds(path: Path, tmp_path: Path) -> None:
    check_reference_run(path, tmp_path)
    page = (tmp_path / "documentation/index.html").read_text(encoding="utf-8")
    assert "networks" not in page


def simulated(path: Path, network: ThermalNetwork) -> np.ndarray:
    """All outputs with FMPy, inputs held in steps of 10 s."""
    cycle = cycle_of(network)
    columns = [cycle.time]
    for signal in signal_table(network).of_role("input"):
        scale, offset = signal.to_inner
        columns.append((cycle.inputs[signal.of] - offset) / scale)
    names = ["time", *(signal.name for signal in signal_table(network).of_role("input"))]
    given = np.rec.fromarrays(columns, names=names)
    outputs = [signal.name for signal in signal_table(network) if signal.causality == "output"]
    return simulate_fmu(str(path), stop_time=900.0, output_interval=10.0, input=given, output=outputs)


def test_the_python_fmu_agrees_with_the_native_one(path: Path, network: ThermalNetwork, tmp_path: Path) -> None:
    python = build_python_fmu(ANY, None, (), tmp_path / "thermal.fmu", network=network)
    assert validate_fmu(str(python)) == []
    with zipfile.ZipFile(python) as archive:
        assert b"onnxruntime" not in archive.read("resources/requirements.txt")
    expected, found = simulated(path, network), simulated(python, network)
    assert expected["time"][-1] == 900.0
    for name in expected.dtype.names:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_run_is_continued_with_its_memories(tmp_path: Path) -> None:
    """The heater is on at 450 s although a new run would begin with it off; the wear of the first half is kept."""

    def two_point(s: Any) -> sp.Expr:
        return sp.Piecewise((1.0, s.T_oil < 40.0), (0.0, s.T_oil > 60.0), (s.on, True))

    network = (
        ThermalNetwork(nodes=(), inputs=usual_inputs(T_ambient=20.0))
        .with_node("oil", 4000.0)
        .with_state("on", start=0.0, update=two_point)
        .with_state("wear", start=0.0, rate=lambda s: (1.0 - s.wear) / 600.0)
        .with_source("oil", lambda s: 300.0 * s.on + 100.0 * s.wear, name="heat")
        .with_link("oil", "air", 5.0, temperature=lambda s: s.T_ambient)
    )  # fmt: skip
    cycle = Cycle(np.linspace(0.0, 900.0, 91), {"T_ambient": np.full(91, 20.0)})
    later = Cycle(cycle.time[45:], {"T_ambient": np.full(46, 20.0)})
    targets = [tmp_path / "native.fmu", tmp_path / "python.fmu"]
    build_native_fmu(ANY, None, targets[0], network=network, platforms="host")
    build_python_fmu(ANY, None, (), targets[1], network=network)

    def full(cycle: Cycle, initial: float | dict[str, float]) -> dict[str, np.ndarray]:
        return network.simulate(cycle, losses=NoLosses(), initial=initial).columns()

    runs = [full, *(lambda c, initial, fmu=fmu: drive_fmu(fmu, c, initial=initial) for fmu in targets)]
    for run in runs:
        whole = run(cycle, 20.0)
        assert whole["state_on"][45] == 1.0
        assert whole["state_wear"][45] == pytest.approx(1.0 - np.exp(-0.75), abs=1e-3)
        start = {"oil": float(whole["T_oil_degC"][45])}
        memories = {name: float(whole[name][45]) for name in ("state_on", "state_wear")}
        rest = run(later, start | memories)
        assert rest["T_oil_degC"] == pytest.approx(whole["T_oil_degC"][45:], abs=0.05)
        assert np.abs(run(later, start)["T_oil_degC"] - whole["T_oil_degC"][45:]).max() > 1.0
        with pytest.raises(InputError, match="unknown memory 'ware'; did you mean 'wear'"):
            run(later, start | {"state_ware": 0.5})
        with pytest.raises(InputError, match="memory wear is nan; a finite number is needed"):
            run(later, start | {"state_wear": np.nan})
