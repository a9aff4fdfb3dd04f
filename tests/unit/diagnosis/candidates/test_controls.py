"""Known controls with other set-points."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from builder.workflows.known_physics import known_finding
from diagnosis.candidates.controls import moved_set_points
from diagnosis.candidates.dated import Axis, changing, for_a_while, step
from models.assembly.gearbox import Gearbox
from models.correction.correction import Correction, Finding
from models.mechanisms import Placed, Scale
from models.network.laws import symbol
from models.simulation.thermal_network import ThermalNetwork

GIVEN = {"strength": (60.0, 0.0), "set_point": (50.0, 2.0), "band": (4.0, 0.0)}
AXIS = Axis(dates=np.array([2000.0, 6000.0]), end=10_000.0, until=12_000.0)


def known(fzg: Gearbox, name: str, **given: tuple[float, float]) -> Finding:
    return known_finding(fzg, fzg.network(), name, GIVEN | given)


def moved(fzg: Gearbox, finding: Finding) -> Placed:
    (placed,) = moved_set_points([finding], Scale.of(fzg))
    return placed


def hottest(network: ThermalNetwork, fzg: Gearbox) -> float:
    """The mean of the oil in the second of two hours at full load, [degC]."""
    time = np.arange(0.0, 7200.0, 20.0)
    held = {"speed_rpm": 3000.0, "torque_Nm": 150.0, "T_ambient_degC": 22.0, "air_speed_m_s": 2.0}
    cycle = {"time_s": time} | {name: np.full(len(time), value) for name, value in held.items()}
    made = network.simulate(cycle, losses=fzg.losses(), initial=45.0).columns()
    return float(np.mean(made["T_oil_degC"][time > 3600.0]))


@pytest.mark.parametrize("name", ["cooler_proportional", "cooler_thermostat", "fan_thermostat"])
def test_a_moved_control_has_the_law_and_the_memories_of_the_known_one(fzg: Gearbox, name: str) -> None:
    term, placed = known(fzg, name).term, moved(fzg, known(fzg, name))
    ends = ["set_point", "band", *(state.name.removeprefix(f"{term.label}_") for state in term.states)]
    back = {symbol(f"{placed.label}_{end}"): symbol(f"{term.label}_{end}") for end in ends}
    there = term.expression.xreplace({new: old for old, new in back.items()})
    wholly = placed.expression.xreplace({symbol(placed.strength.name): sp.Integer(1)})
    assert sp.simplify(term.expression + wholly - there) == 0
    assert [state.update and state.update.xreplace(back) for state in placed.states] == [s.update for s in term.states]
    assert placed.expression.xreplace(back) == 0  # with the known set-point it is the known control
    assert (placed.kind, placed.target, placed.is_loss) == (term.kind, term.target, term.is_loss)


def test_wholly_moved_it_cools_as_the_control_with_that_set_point(fzg: Gearbox) -> None:
    as_known, lower = known(fzg, "cooler_proportional"), known(fzg, "cooler_proportional", set_point=(42.0, 0.0))
    placed = moved(fzg, as_known)
    network, there = (Correction.of(fzg, findings=[one]).apply(fzg.network()) for one in (as_known, lower))
    own = {f"{placed.label}_strength": 1.0, f"{placed.label}_set_point": 42.0}
    assert hottest(placed.apply(network, own), fzg) == pytest.approx(hottest(there, fzg), abs=0.01)
    assert hottest(there, fzg) < hottest(network, fzg) - 2.0


def test_set_points_about_the_known_one_are_tried_at_every_date(fzg: Gearbox) -> None:
    placed = moved(fzg, known(fzg, "cooler_proportional"))
    changed = changing(placed, step(AXIS, slow=False), AXIS, every_shape=True)
    tried = {tuple(row) for row in changed.variants[:, [1, 3]].tolist()}
    assert {(30.0, 2000.0), (70.0, 2000.0), (47.5, 6000.0)} <= tried and len(tried) == 2 * 8
    assert not np.any(changed.variants[:, 1] == 50.0)  # that is the known one
    assert len(changing(placed, for_a_while(AXIS), AXIS).variants) == len(for_a_while(AXIS).variants)


def test_set_points_beyond_the_limits_of_the_known_one_are_not_tried(fzg: Gearbox) -> None:
    set_point = moved(fzg, known(fzg, "cooler_proportional", set_point=(-55.0, 0.0))).parameters[1]
    assert min(set_point.grid) == -60.0 and set_point.lower == -60.0


def test_what_is_known_without_a_set_point_is_no_control(fzg: Gearbox) -> None:
    pump = known_finding(fzg, fzg.network(), "pump_heat", {"strength": (5.0, 0.0)})
    assert list(moved_set_points([pump], Scale.of(fzg))) == []


def test_its_equation_tells_the_known_control_from_the_moved_one(fzg: Gearbox) -> None:
    text = moved(fzg, known(fzg, "cooler_proportional")).equation()
    assert r"\mathrm{set\_point}" in text and r"cooler\_proportional\_oil\_set\_point" in text
