"""Running networks: start, inputs, columns, errors; the physics of it is in ``tests/property``."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle
from models.network.laws import symbol
from models.portable.evaluation import efficiency, torque_loss
from models.portable.surrogate import range_distance
from models.simulation.simulate import initial_states, input_table, network_system
from models.simulation.thermal_network import Node, ThermalNetwork

GEARBOX = load_gearbox("fzg")
NETWORK, LOSSES = GEARBOX.network(), GEARBOX.losses()
CYCLE: dict[str, Any] = {
    "time_s": [0.0, 30.0, 60.0],
    "speed_rpm": [500.0, 2000.0, -500.0],
    "torque_Nm": [0.0, 100.0, 50.0],
}


def test_starts_at_ambient_unless_told() -> None:
    result = NETWORK.simulate({**CYCLE, "T_ambient_degC": [14.0, 15.0, 16.0]}, losses=LOSSES)
    assert {float(T[0]) for T in result.temperatures.values()} == {14.0}
    assert result.temperatures["air"].tolist() == [14.0, 15.0, 16.0]
    by_name = {part.name: 30.0 + i for i, part in enumerate(NETWORK.parts)}
    started = NETWORK.simulate(CYCLE, losses=LOSSES, initial=by_name)
    assert {name: float(started.temperatures[name][0]) for name in by_name} == by_name
    assert float(started.temperatures["air"][0]) == 27.0  # the definition's ambient


def test_columns_follow_the_file_contract() -> None:
    result = NETWORK.simulate(CYCLE, losses=LOSSES, initial=20.0)
    columns = list(result.columns())
    assert columns[:5] == ["time_s", "speed_rpm", "torque_Nm", "T_ambient_degC", "air_speed_m_s"]
    assert columns[5:19] == [f"T_{name}_degC" for name in NETWORK.node_names]
    assert columns[19] == "P_loss_W"
    assert columns[20:29] == [f"P_loss_{name}_W" for name in LOSSES.components]
    assert columns[29:] == ["torque_loss_Nm", "efficiency", "in_domain"]
    table = result.columns()
    assert all(np.shape(values) == (3,) for values in table.values())
    assert table["P_loss_W"] == pytest.approx(sum(table[f"P_loss_{name}_W"] for name in LOSSES.components))
    assert table["in_domain"].all()


def test_losses_in_the_result_are_those_of_the_model_times_their_factors() -> None:
    result = NETWORK.simulate(CYCLE, losses=LOSSES, initial=20.0, parameters={"churning": 3.0})
    T = {name: result.temperatures[name] for name in LOSSES.temperature_nodes}
    nominal = LOSSES.breakdown(speed=CYCLE["speed_rpm"], torque=CYCLE["torque_Nm"], temperatures=T)
    for name in LOSSES.components:
        assert result.losses[name] == pytest.approx(nominal[name] * (3.0 if name == "churning" else 1.0), rel=1e-12)


def test_heat_that_is_no_loss_stands_apart() -> None:
    network = NETWORK.with_source("oil", 25.0, name="heater").with_source("oil", 5.0, name="pump", is_loss=True)
    result = network.simulate(CYCLE, losses=LOSSES, initial=20.0)
    assert result.extra_heat["heater"].tolist() == [25.0] * 3
    assert result.losses["pump"].tolist() == [5.0] * 3
    assert result.loss == pytest.approx(sum(result.losses.values()))


def test_one_row() -> None:
    result = NETWORK.simulate({name: values[:1] for name, values in CYCLE.items()}, losses=LOSSES, initial=33.0)
    assert result.temperatures["oil"].tolist() == [33.0]
    assert result.heat_in.tolist() == [0.0]


def test_progress_ends_with_all_rows() -> None:
    seen: list[tuple[int, int]] = []
    time = np.arange(0.0, 60.5, 0.5)
    NETWORK.simulate(
        {"time_s": time, "speed_rpm": 0 * time + 100, "torque_Nm": 0 * time},
        losses=LOSSES,
        progress=lambda done, of: seen.append((done, of)),
    )
    assert seen == [(50, 120), (100, 120), (120, 120)]


def test_input_table_fills_defaults() -> None:
    cycle = Cycle.from_columns(CYCLE)
    table = input_table(NETWORK, cycle)
    assert table[:, 2:].tolist() == [[27.0, 2.0]] * 3


def test_torque_loss_and_efficiency() -> None:
    speed, torque = np.array([1500.0, -1500.0, 1500.0, 0.0]), np.array([100.0, -100.0, -100.0, 100.0])
    loss = np.full(4, 500.0)
    P = 1500.0 * np.pi / 30.0 * 100.0
    assert torque_loss(loss, speed) == pytest.approx([500 * 100 / P, -500 * 100 / P, 500 * 100 / P, 0.0])
    assert efficiency(loss, speed, torque) == pytest.approx([1 - 500 / P, 1 - 500 / P, P / (P + 500), 0.0])
    assert efficiency(1e9, 1500.0, 1.0) == 0.0
    assert efficiency(1e-14, 1e-13, 90.0) == 0.0  # a speed that is rounding


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"parameters": {"h_aire": 1.0}}, "'h_aire' is not a parameter of this network; did you mean 'h_air'"),
        ({"parameters": {"C_oil": 0.0}}, "parameter 'C_oil' is 0.0; 0.05 to 20 is possible"),
        ({"parameters": {"bearing": np.array([1.0, -5.0])}}, r"parameter 'bearing' is \[ 1. -5.\]; 0.05 to 20 is"),
        ({"parameters": {"bearing": np.nan}}, "parameter 'bearing' is nan"),
        ({"initial": {"oil": 20.0}}, "start temperatures are missing for: housing_lower"),
        ({"initial": {"oill": 20.0}}, "unknown node 'oill'; did you mean 'oil'"),
        ({"initial": np.nan}, "a finite number above -273.15 degC"),
        ({"initial": -300.0}, "a finite number above -273.15 degC"),
        ({"initial": 293.15}, "is 293.15; up to 250 degC is possible; if kelvin are meant, give 20$"),
        ({"initial": 999.0}, "is 999; up to 250 degC is possible$"),
        ({"initial": "recorded"}, "the start temperature is 'recorded'; give a number in degC, or one per node"),
        ({"initial": 5000.0}, "is 5000; up to 250 degC is possible$"),
        ({"initial": {part.name: np.inf for part in NETWORK.parts}}, "a finite number above -273.15 degC"),
        ({"losses": load_gearbox("conveyor").losses()}, "the losses belong to another gearbox"),
    ],
)
def test_refusals(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        NETWORK.simulate(CYCLE, **{"losses": LOSSES, "initial": 20.0, **arguments})


def test_single_nodes_may_be_hot_as_those_of_a_result_that_is_continued() -> None:
    hot = {part.name: 20.0 for part in NETWORK.parts} | {"mesh": 350.0}
    result = NETWORK.simulate(CYCLE, losses=LOSSES, initial=hot)
    assert result.temperatures["mesh"][0] == 350.0


def test_losses_need_their_nodes() -> None:
    small = ThermalNetwork(
        nodes=(NETWORK.nodes[0], Node(name="oil", capacity=NETWORK.nodes[-1].capacity)),
        components=LOSSES.components,
        inputs=NETWORK.inputs,
    )
    with pytest.raises(InputError, match="the losses need the temperature of 'pinion'"):
        network_system(small, LOSSES)


def test_a_steady_state_outside_the_range_of_the_definition_is_not_in_its_domain() -> None:
    usual, hot = (GEARBOX.steady_state(speed=1500.0, torque=torque) for torque in (94.0, 2000.0))
    assert usual.columns()["in_domain"] and not hot.columns()["in_domain"]
    along = GEARBOX.steady_state(speed=[1500.0, 20000.0], torque=94.0)
    assert along.columns()["in_domain"].tolist() == [True, False]


def test_steady_state_refusals() -> None:
    with pytest.raises(InputError, match="'T_ambiente' is not an input of this network; did you mean 'T_ambient'"):
        NETWORK.steady_state(losses=LOSSES, speed=1.0, torque=1.0, inputs={"T_ambiente": 3.0})
    with pytest.raises(InputError, match="one axis of at least one is possible"):
        NETWORK.steady_state(losses=LOSSES, speed=np.ones((2, 2)), torque=1.0)
    with pytest.raises(InputError, match="one axis of at least one is possible"):
        NETWORK.steady_state(losses=LOSSES, speed=[], torque=1.0)
    with pytest.raises(InputError, match="numbers of values differ: speed 2, torque 3; give single numbers"):
        NETWORK.steady_state(losses=LOSSES, speed=[1.0, 2.0], torque=[1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="bearing' is .*; 0.05 to 20 is possible"):
        NETWORK.steady_state(losses=LOSSES, speed=1.0, torque=1.0, parameters={"bearing": -5.0})
    with pytest.raises(InputError, match="have a memory has no steady state"):
        NETWORK.with_state("age", start=0.0, rate=1.0).steady_state(losses=LOSSES, speed=1.0, torque=1.0)
    lonely = NETWORK.with_node("tank", 100.0).with_source("tank", 5.0, name="heater")
    with pytest.raises((ArithmeticError, np.linalg.LinAlgError)):
        lonely.steady_state(losses=LOSSES, speed=1000.0, torque=1.0)


def test_memories_start_where_they_are_told() -> None:
    network = NETWORK.with_state("age", start=4.0, rate=1.0)
    assert initial_states(network, 20.0)[-1] == 4.0


# ---------------------------------------------------------------------- the range that the definition names


def test_range_of_the_full_model_is_that_of_its_surrogate(fzg_training: TrainingResult) -> None:
    rng = np.random.default_rng(3)
    speed, torque = rng.uniform(-9000.0, 9000.0, 200), rng.uniform(-500.0, 500.0, 200)
    T = rng.uniform(-60.0, 260.0, (200, len(LOSSES.temperature_nodes)))
    T[:150] = rng.uniform(0.0, 150.0, (150, 1))
    named = GEARBOX.training
    found = range_distance(speed, torque, T, named.speed_rpm, named.torque_Nm, named.temperature_degC)
    assert found == pytest.approx(fzg_training.losses.domain_distance(speed, torque, T), rel=1e-12)
    assert 20 < np.count_nonzero(found == 0.0) < 180


def test_a_full_model_outside_the_named_range_says_so() -> None:
    cycle = {**CYCLE, "speed_rpm": [0.0, 500.0, 500.0], "torque_Nm": [0.0, 100.0, 9000.0]}
    started = NETWORK.simulate(cycle, losses=LOSSES, initial=20.0, trained=GEARBOX.training)
    assert started.columns()["in_domain"].tolist() == [True, True, False]
    assert started.domain_distance[2] == pytest.approx((9000.0 - 350.0) / 349.0)
    cold = NETWORK.simulate(CYCLE, losses=LOSSES, initial=-30.0, trained=GEARBOX.training)
    assert not cold.columns()["in_domain"][0]
    assert NETWORK.simulate(cycle, losses=LOSSES, initial=20.0).columns()["in_domain"].all()


def test_more_rows_do_not_change_the_results_at_the_old_ones() -> None:
    cycle = Cycle.from_columns(CYCLE)
    fine = cycle.refined(2.5)
    own = np.isin(fine.time, cycle.time)
    coarse, dense = (NETWORK.simulate(c, losses=LOSSES, initial=20.0).columns() for c in (cycle, fine))
    assert len(dense["time_s"]) == 25
    for name, values in coarse.items():
        if name.startswith("T_"):  # the solver's error is 0.03 K per step at most
            assert dense[name][own] == pytest.approx(values, abs=0.1), name
        elif name.startswith("P_"):
            assert dense[name][own] == pytest.approx(values, rel=5e-4), name


def test_output_torque_balances_the_loss_whoever_drives() -> None:
    cycle = CYCLE | {"speed_rpm": [1500.0, 1500.0, -1500.0], "torque_Nm": [200.0, -200.0, -200.0]}
    result = NETWORK.simulate(cycle, losses=LOSSES, initial=20.0)
    omega = np.pi / 30.0 * result.inputs["speed"]
    power_in, power_out = omega * result.inputs["torque"], omega / 1.5 * result.columns(ratio=1.5)["torque_out_Nm"]
    np.testing.assert_allclose(power_out, power_in - result.loss, rtol=1e-12)
    useful = np.where(power_in > 0.0, power_out / power_in, power_in / power_out)
    np.testing.assert_allclose(useful, result.efficiency, rtol=1e-12)


@pytest.mark.parametrize("law", [
    (symbol("T_oil") - 100) ** sp.Float(0.25), sp.sqrt(symbol("T_oil") - 100), 1 / symbol("torque"),
])  # fmt: skip
def test_a_law_without_a_real_number_is_a_fault_of_the_definition(law: sp.Expr) -> None:
    idle = CYCLE | {"torque_Nm": [0.0, 0.0, 0.0]}
    with pytest.raises(InputError, match="from 0 s on cannot be calculated .* check the definition's laws"):
        NETWORK.with_source("oil", law, name="broken").simulate(idle, losses=LOSSES, initial=20.0)
