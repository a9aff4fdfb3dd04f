"""What must hold for any network: heat is conserved, time steps do not matter, variants and laws are interchangeable.

The independent checks share the right-hand side (losses and conductances) with the product, not its integrator.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from models.assembly.gearbox import load_gearbox
from models.losses import friction
from models.network.laws import Parameter
from models.simulation.result import Result
from models.simulation.simulate import network_system
from models.simulation.thermal_network import ThermalNetwork

GEARBOX = load_gearbox("fzg")
NETWORK, LOSSES = GEARBOX.network(), GEARBOX.losses()
PARTS = [part.name for part in NETWORK.parts]
KNOTS = np.arange(0.0, 121.0, 60.0)
RAMPS = {"speed": [500.0, 3000.0, 1500.0], "torque": [20.0, 200.0, 60.0]}


def ramps(dt: float) -> dict[str, Any]:
    """Straight lines between knots at 60 s: every row distance that divides 60 s describes the very same inputs."""
    time = np.arange(round(KNOTS[-1] / dt) + 1) * dt
    return {
        "time_s": time,
        "speed_rpm": np.interp(time, KNOTS, RAMPS["speed"]),
        "torque_Nm": np.interp(time, KNOTS, RAMPS["torque"]),
        "T_ambient_degC": np.interp(time, KNOTS, [20.0, 26.0, 22.0]),
    }


def waves(dt: float, end: float = 120.0) -> dict[str, Any]:
    """A smooth cycle; between rows it is the polygon through its samples, so another `dt` is another cycle."""
    time = np.arange(round(end / dt) + 1) * dt
    return {
        "time_s": time,
        "speed_rpm": 2000.0 + 1500.0 * np.sin(2 * np.pi * time / 150.0),
        "torque_Nm": 140.0 + 100.0 * np.sin(2 * np.pi * time / 97.0),
    }


def stack(result: Result) -> np.ndarray:
    return np.stack([result.temperatures[name] for name in PARTS], axis=-1)


def closed(result: Result) -> float:
    """Defect of the heat balance, relative to the heat that went through."""
    through = np.maximum(np.abs(result.heat_in), np.abs(result.heat_out)).max()
    return float(np.abs(result.heat_in - result.heat_out - result.heat_stored).max() / through)


# ------------------------------------------------------------------------------------------------- heat is conserved


@settings(max_examples=6, deadline=None)
@given(
    speed=st.lists(st.floats(-6500.0, 6500.0), min_size=4, max_size=4),
    torque=st.lists(st.floats(-350.0, 350.0), min_size=4, max_size=4),
    gaps=st.lists(st.floats(0.05, 100.0), min_size=3, max_size=3),
    initial=st.floats(-30.0, 150.0),
)
def test_heat_balance_closes(speed: list[float], torque: list[float], gaps: list[float], initial: float) -> None:
    cycle = {"time_s": np.cumsum([0.0, *gaps]), "speed_rpm": speed, "torque_Nm": torque}
    assert closed(NETWORK.simulate(cycle, losses=LOSSES, initial=initial)) < 1e-6


def test_heat_balance_from_the_output_columns() -> None:
    """Losses and temperatures as printed, integrated again by trapezoids over fine rows.

    Stored heat is capacity times temperature; given off is conductance of the boundary links times difference.
    """
    result = NETWORK.simulate(waves(0.5), losses=LOSSES, initial=20.0)
    symbols = {parameter.name: parameter.start for parameter in NETWORK.parameters}
    ones = {sp.Symbol(name, real=True): value for name, value in symbols.items()}
    capacity = {part.name: float(part.capacity.subs(ones)) for part in NETWORK.parts}
    signals = {f"T_{name}": T for name, T in result.temperatures.items()} | dict(result.inputs) | symbols
    given_off = np.zeros(len(result.time))
    for link in NETWORK.links:
        inside = [n for n in link.nodes if n in PARTS]
        if len(inside) == 1:
            outside = next(n for n in link.nodes if n not in PARTS)
            names = sorted(s.name for s in link.conductance.free_symbols)
            law = sp.lambdify([sp.Symbol(n, real=True) for n in names], link.conductance, "numpy")
            given_off += law(*(signals[n] for n in names)) * (
                result.temperatures[inside[0]] - result.temperatures[outside]
            )
    stored = sum(capacity[name] * (result.temperatures[name] - result.temperatures[name][0]) for name in PARTS)
    brought_in = np.trapezoid(result.loss, result.time)
    left = np.trapezoid(given_off, result.time)
    assert brought_in - left == pytest.approx(float(stored[-1]), rel=2e-4)
    assert result.heat_in[-1] == pytest.approx(brought_in, rel=2e-4)
    assert result.heat_out[-1] == pytest.approx(left, rel=2e-3)


def test_steady_sources_flow_to_the_air() -> None:
    point: dict[str, Any] = {"speed": np.array([500.0, 2165.7]), "torque": 94.0}
    result = NETWORK.steady_state(losses=LOSSES, **point)
    system = network_system(NETWORK, LOSSES, vector=True)
    inputs = np.column_stack([point["speed"], [94.0] * 2, [27.0] * 2, [2.0] * 2])
    balance = system.balance(0.0, inputs, stack(result))
    assert balance.heat_out.sum(axis=-1) == pytest.approx(result.loss, rel=1e-6)
    assert np.abs(balance.derivative).max() < 1e-5


def test_steady_state_is_the_end_of_a_long_cycle() -> None:
    steady = NETWORK.steady_state(losses=LOSSES, speed=1500.0, torque=60.0)
    time = np.linspace(0.0, 80_000.0, 5)
    result = NETWORK.simulate(
        {"time_s": time, "speed_rpm": np.full(5, 1500.0), "torque_Nm": np.full(5, 60.0)}, losses=LOSSES
    )
    for name in PARTS:
        assert result.temperatures[name][-1] == pytest.approx(steady.temperatures[name], abs=0.01)


# --------------------------------------------------------------------------------------------- time steps do not matter


def test_communication_step_does_not_matter() -> None:
    ends = {}
    for dt in (0.1, 1.0, 10.0, 60.0):
        result = NETWORK.simulate(ramps(dt), losses=LOSSES, initial=20.0)
        rows = np.rint(KNOTS / dt).astype(int)
        ends[dt] = stack(result)[rows]
    for dt in (1.0, 10.0, 60.0):
        assert np.abs(ends[dt] - ends[0.1]).max() < 0.05


@pytest.fixture
def exact_film_temperature(monkeypatch: pytest.MonkeyPatch) -> None:
    """A right-hand side without the film temperature's tolerance, which a small error estimate would run into."""
    monkeypatch.setattr(friction, "FILM_TEMPERATURE_TOL", 1e-6)


@pytest.mark.usefixtures("exact_film_temperature")
@pytest.mark.parametrize("cycle", [ramps(60.0), waves(20.0)], ids=["ramps", "waves"])
def test_agrees_with_an_independent_integrator(cycle: dict[str, Any]) -> None:
    result = NETWORK.simulate(cycle, losses=LOSSES, initial=20.0)
    system = network_system(NETWORK, LOSSES)
    time = cycle["time_s"]
    table = np.column_stack(
        [
            cycle["speed_rpm"],
            cycle["torque_Nm"],
            cycle.get("T_ambient_degC", np.full(len(time), 27.0)),
            np.full(len(time), 2.0),
        ]
    )
    T, worst = np.full(len(PARTS), 20.0), np.zeros(len(PARTS))
    for row in range(len(time) - 1):  # stretch by stretch: the inputs bend at the rows
        t_0, t_1 = time[row], time[row + 1]

        def rate(t: float, T: np.ndarray, t_0: float = t_0, t_1: float = t_1, row: int = row) -> np.ndarray:
            share = (t - t_0) / (t_1 - t_0)
            return system.balance(t, (1.0 - share) * table[row] + share * table[row + 1], T).derivative

        def jacobian(t: float, T: np.ndarray, row: int = row) -> np.ndarray:
            return system.balance(t, table[row], T).matrix

        solution = solve_ivp(rate, (t_0, t_1), T, method="Radau", rtol=1e-7, atol=1e-5, jac=jacobian)
        assert solution.success
        T = solution.y[:, -1]
        worst = np.maximum(worst, np.abs(T - stack(result)[row + 1]))
    assert worst.max() < 0.05
    assert np.delete(worst, PARTS.index("mesh")).max() < 0.02


# ------------------------------------------------------------------------------------------------- variants and laws


def test_variants_side_by_side_are_separate_runs() -> None:
    factors = {
        "h_air": np.array([0.7, 1.0, 1.6]),
        "mesh": np.array([1.3, 1.0, 0.8]),
        "C_oil": np.array([1.0, 0.5, 2.0]),
    }
    cycle = ramps(10.0)
    together = NETWORK.simulate(cycle, losses=LOSSES, initial=20.0, parameters=factors)
    assert closed(together) < 1e-6
    for i in range(3):
        one = NETWORK.simulate(
            cycle, losses=LOSSES, initial=20.0, parameters={name: float(values[i]) for name, values in factors.items()}
        )
        # One step size serves all variants, so the steps differ, and with them the error: 0.02 K, at the mesh 0.05 K.
        apart = np.abs(stack(together)[i] - stack(one)).max(axis=0)
        assert apart.max() < 0.05
        assert np.delete(apart, PARTS.index("mesh")).max() < 0.02
        assert together.loss[i] == pytest.approx(one.loss, rel=1e-3)


def test_a_batch_of_equal_variants_is_the_single_run() -> None:
    cycle = ramps(10.0)
    one = NETWORK.simulate(cycle, losses=LOSSES, initial=20.0)
    two = NETWORK.simulate(cycle, losses=LOSSES, initial=20.0, parameters={"mesh": np.ones(2)})
    assert np.abs(stack(two) - stack(one)).max() < 1e-9


def test_steady_variants_are_separate_runs() -> None:
    both = NETWORK.steady_state(losses=LOSSES, speed=2000.0, torque=50.0, parameters={"h_air": np.array([0.5, 2.0])})
    for i, factor in enumerate((0.5, 2.0)):
        one = NETWORK.steady_state(losses=LOSSES, speed=2000.0, torque=50.0, parameters={"h_air": factor})
        assert both.temperatures["oil"][i] == pytest.approx(one.temperatures["oil"], abs=1e-6)


SHORT = {name: values[:9] for name, values in ramps(10.0).items()}


def branching(s: Any) -> float:
    return 40.0 if s.T_oil > 22.0 else 10.0 * s.T_oil / 22.0


def test_numeric_law_equals_its_expression() -> None:
    """A smooth law, once traced and once through numpy: the same simulation, alone and as a batch."""
    traced = NETWORK.with_source("oil", lambda s: 30.0 * sp.exp(-s.T_oil / 50.0) + s.speed / 100.0, name="extra")
    numeric = NETWORK.with_source("oil", lambda s: 30.0 * np.exp(-s.T_oil / 50.0) + s.speed / 100.0, name="extra")
    assert not traced.numeric_laws
    assert numeric.numeric_laws
    for parameters in (None, {"h_air": np.array([1.0, 2.0])}):
        runs = [n.simulate(SHORT, losses=LOSSES, initial=20.0, parameters=parameters) for n in (traced, numeric)]
        assert np.abs(stack(runs[0]) - stack(runs[1])).max() < 1e-9
        assert runs[0].extra_heat["extra"] == pytest.approx(runs[1].extra_heat["extra"], rel=1e-12)


def test_branching_law_equals_its_piecewise() -> None:
    written = NETWORK.with_source(
        "oil", lambda s: sp.Piecewise((40.0, s.T_oil > 22.0), (10.0 * s.T_oil / 22.0, True)), name="extra"
    )
    branched = NETWORK.with_source("oil", branching, name="extra")
    for parameters in (None, {"h_air": np.array([1.0, 2.0])}):
        runs = [n.simulate(SHORT, losses=LOSSES, initial=20.0, parameters=parameters) for n in (written, branched)]
        assert np.abs(stack(runs[0]) - stack(runs[1])).max() < 1e-9
    steady = [n.steady_state(losses=LOSSES, speed=1500.0, torque=50.0) for n in (written, branched)]
    assert stack(steady[0]) == pytest.approx(stack(steady[1]), abs=1e-6)


def test_numeric_conductance() -> None:
    written = NETWORK.with_link("oil", "frame", lambda s: sp.Max(s.speed, 0.0) / 1000.0, name="x")
    numeric = NETWORK.with_link("oil", "frame", lambda s: max(s.speed, 0.0) / 1000.0, name="x")
    runs = [n.simulate(SHORT, losses=LOSSES, initial=20.0) for n in (written, numeric)]
    assert np.abs(stack(runs[0]) - stack(runs[1])).max() < 1e-9
    assert closed(runs[1]) < 1e-6


# ------------------------------------------------------------------------------------------------- extension


def long_run(network: ThermalNetwork, *, end: float, dt: float = 60.0, initial: float = 27.0) -> Result:
    """The rig at 3000 rpm, 200 N m."""
    time = np.arange(0.0, end + 1.0, dt)
    cycle = {"time_s": time, "speed_rpm": np.full(len(time), 3000.0), "torque_Nm": np.full(len(time), 200.0)}
    return network.simulate(cycle, losses=LOSSES, initial=initial)


def test_example_of_the_design() -> None:
    """Users extend the model without editing the package."""
    gearbox, cycle = GEARBOX, ramps(10.0) | {"T_ambient_degC": np.full(13, 20.0)}
    network = gearbox.network()
    network = network.with_source("oil", lambda s: 8.0 * (s.speed / 3000.0) ** 3, name="extra")
    network = network.with_link("housing", "frame", lambda s: 3.0)
    result = network.simulate(cycle, losses=gearbox.losses(), initial=20.0)
    assert result.extra_heat["extra"] == pytest.approx(8.0 * (cycle["speed_rpm"] / 3000.0) ** 3)
    assert closed(result) < 1e-6
    plain = gearbox.network().with_source("oil", lambda s: 8.0 * (s.speed / 3000.0) ** 3, name="extra")
    without = plain.simulate(cycle, losses=gearbox.losses(), initial=20.0)
    assert result.temperatures["housing_lower"][-1] < without.temperatures["housing_lower"][-1]
    assert result.heat_out[-1] > without.heat_out[-1]


def test_node_boundary_input_and_parameter() -> None:
    network = (
        NETWORK.with_node("cooler", 500.0)
        .with_boundary("water", lambda s: 15.0 + 0.001 * s.time)
        .with_input("flow", 2.0)
        .with_parameter(Parameter(name="effect", start=1.0))
        .with_link("oil", "cooler", lambda s: 8.0 * s.flow * s.effect)
        .with_link("cooler", "water", lambda s: 20.0)
    )
    time = np.arange(0.0, 3601.0, 60.0)
    cycle = {"time_s": time, "speed_rpm": 0 * time + 2000.0, "torque_Nm": 0 * time + 100.0}
    result = network.simulate(cycle, losses=LOSSES, initial=20.0)
    assert closed(result) < 1e-6
    assert result.temperatures["water"] == pytest.approx(15.0 + 0.001 * time)
    assert result.temperatures["oil"][-1] > result.temperatures["cooler"][-1] > result.temperatures["water"][-1]
    assert result.inputs["flow"].tolist() == [2.0] * len(time)
    stopped = network.simulate({**cycle, "flow": 0 * time}, losses=LOSSES, initial=20.0)
    assert stopped.temperatures["oil"][-1] > result.temperatures["oil"][-1] + 5.0
    weak = network.simulate(cycle, losses=LOSSES, initial=20.0, parameters={"effect": 0.5})
    assert weak.temperatures["oil"][-1] > result.temperatures["oil"][-1] + 1.0
    # Quasi-steady at the end: what the oil gives the cooler, the cooler gives the water.
    T = {name: float(values[-1]) for name, values in result.temperatures.items()}
    assert 16.0 * (T["oil"] - T["cooler"]) == pytest.approx(20.0 * (T["cooler"] - T["water"]), rel=0.02)


def test_thermostat_with_hysteresis() -> None:
    """Opens above 80 degC, closes below 70 degC, remembers in between; heat stays conserved."""
    network = NETWORK.with_state(
        "valve",
        start=0.0,
        update=lambda s: sp.Piecewise((1.0, s.T_oil > 80.0), (0.0, s.T_oil < 70.0), (s.valve, True)),
    ).with_link("oil", "cooler", lambda s: 25.0 * s.valve, temperature=20.0)
    result = long_run(network, end=4800.0, dt=20.0, initial=60.0)
    oil = result.temperatures["oil"]
    assert closed(result) < 1e-6
    assert oil.max() < 80.05
    assert oil[np.argmax(oil) :].min() > 69.95
    turns = np.flatnonzero(np.diff(np.sign(np.diff(oil))) != 0)
    assert len(turns) >= 4  # a limit cycle between both thresholds
    assert set(np.round(oil[turns + 1][:4] / 10.0)) == {7.0, 8.0}
    # A switch acts at its moment, however long the communication steps are: late by one of 600 s it would be by 10 K.
    coarse = long_run(network, end=4800.0, dt=600.0, initial=60.0).temperatures["oil"]
    assert coarse == pytest.approx(oil[::30], abs=2.0)
    assert long_run(NETWORK, end=4800.0, initial=60.0).temperatures["oil"][-1] > 100.0


def test_state_that_decays() -> None:
    """Running-in: an extra loss of 60 W that fades with 1800 s; in 2 h it gives all of 60 W times 1800 s but e^-4."""
    network = NETWORK.with_state("wear", start=1.0, rate=lambda s: -s.wear / 1800.0).with_source(
        "oil", lambda s: 60.0 * s.wear, name="run_in", is_loss=True
    )
    result = long_run(network, end=7200.0)
    wear = result.losses["run_in"] / 60.0
    assert wear == pytest.approx(np.exp(-result.time / 1800.0), abs=3e-5)
    given = np.trapezoid(result.losses["run_in"], result.time)
    assert given == pytest.approx(60.0 * 1800.0 * (1.0 - np.exp(-4.0)), rel=3e-4)
    assert closed(result) < 1e-6
    without = long_run(NETWORK, end=7200.0)
    assert np.max(result.temperatures["oil"] - without.temperatures["oil"]) > 2.0
    assert result.loss == pytest.approx(sum(result.losses.values()))


@pytest.mark.parametrize("initial", [-60.0, -20.0, 200.0, 300.0])
def test_extreme_temperatures_stay_finite(initial: float) -> None:
    result = NETWORK.simulate(ramps(60.0), losses=LOSSES, initial=dict.fromkeys(PARTS, initial))
    assert np.all(np.isfinite(stack(result)))
    assert closed(result) < 1e-6


def test_no_radiation_and_no_difference_is_no_division_by_zero() -> None:
    still = GEARBOX.with_values({"housing.emissivity": 0.0, "housing.convection": "iso_14179_free"}).network()
    result = still.simulate({"time_s": [0.0, 60.0], "speed_rpm": [0.0, 0.0], "torque_Nm": [0.0, 0.0]}, losses=LOSSES)
    assert stack(result)[-1] == pytest.approx(np.full(len(PARTS), 27.0), abs=1e-12)
