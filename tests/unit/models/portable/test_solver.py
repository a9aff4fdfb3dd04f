"""The time integrator on systems whose solution is known: order, stiffness, conservation, updates, failure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from models.base.types import Array
from models.portable import solver
from models.portable.solver import Balance, State


@dataclass
class Linear:
    """``dT/dt = input - rate * T`` per state of unit capacity; each gives its heat ``rate * T`` to its own boundary."""

    rates: Array
    update: Callable[[Array], Array] | None = None
    jacobian: float = 1.0
    weights: float = 1.0
    calls: int = 0

    @property
    def error_weights(self) -> Array:
        return np.full(len(self.rates), self.weights)

    def balance(self, time: float, inputs: Array, states: Array) -> Balance:
        self.calls += 1
        n = states.shape[-1]
        return Balance(
            derivative=inputs[0] - self.rates * states,
            matrix=np.broadcast_to(-self.jacobian * np.diag(self.rates), (*states.shape, n)),
            heat_in=np.full(states.shape[:-1], n * inputs[0]),
            heat_out=self.rates * states,
            heat_out_slope=np.broadcast_to(self.jacobian * np.diag(self.rates), (*states.shape, n)),
        )

    def updated(self, time: float, inputs: Array, states: Array) -> Array:
        return states if self.update is None else self.update(states)


def run(system: Linear, duration: float, start: Array, first: float = 0.0, last: float = 0.0) -> State:
    return solver.advance(
        system, solver.start(start, start.shape[-1]), 0.0, duration, np.array([first]), np.array([last])
    )


def with_steps(system: Linear, h: float, count: int, monkeypatch: pytest.MonkeyPatch) -> Array:
    """Steps of one size: the tolerance is put out of reach, and every step asked for by itself."""
    monkeypatch.setattr(solver, "TOLERANCE_K", 1e12)
    state = solver.start(np.array([1.0]), 1)
    for i in range(count):
        state = State(state.states, 1e9, state.heat_in, state.heat_out)
        state = solver.advance(system, state, i * h, h, np.array([i * h]), np.array([(i + 1) * h]))
    return state.states


@pytest.mark.parametrize("jacobian", [1.0, 0.25, 0.0])
def test_second_order_whatever_the_jacobian(jacobian: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """``dT/dt = t - T`` from 1: ``T = t - 1 + 2 exp(-t)``; half the step, a quarter of the error."""
    exact = 1.0 - 1.0 + 2.0 * np.exp(-1.0)
    errors = [
        abs(float(with_steps(Linear(np.ones(1), jacobian=jacobian), 1.0 / n, n, monkeypatch)[0]) - exact)
        for n in (20, 40, 80)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_stiff_and_slow_states_together() -> None:
    rates = np.array([1e3, 1.0, 1e-3])
    system = Linear(rates)
    state = run(system, 100.0, np.full(3, 50.0), 2.0, 2.0)
    exact = 2.0 / rates + (50.0 - 2.0 / rates) * np.exp(-rates * 100.0)
    assert state.states == pytest.approx(exact, abs=0.05)
    assert system.calls < 300  # an explicit scheme would need 50 000


def test_heat_is_conserved_to_rounding() -> None:
    start = np.array([50.0, -10.0])
    state = run(Linear(np.array([5.0, 0.01]), jacobian=0.7), 40.0, start, 1.0, 9.0)
    stored = (state.states - start).sum()
    assert stored == pytest.approx(float(state.heat_in - state.heat_out.sum()), abs=1e-9)
    assert state.heat_in == pytest.approx(2 * 40.0 * 5.0, rel=1e-12)  # a ramp is integrated exactly


def test_variants_side_by_side() -> None:
    start = np.array([[50.0], [20.0], [0.0]])
    state = run(Linear(np.array([0.1])), 10.0, start, 1.0, 1.0)
    assert state.heat_in.shape == (3,)
    assert state.states[:, 0] == pytest.approx(10.0 + (start[:, 0] - 10.0) * np.exp(-1.0), abs=0.01)


def test_updates_follow_accepted_steps_only() -> None:
    seen: list[float] = []

    def update(states: Array) -> Array:
        seen.append(float(states[0]))
        return states

    run(Linear(np.array([1.0]), update=update), 5.0, np.array([100.0]))
    assert seen == sorted(seen, reverse=True)
    assert len(seen) > 5


def test_no_duration_changes_nothing() -> None:
    state = run(Linear(np.ones(1)), 0.0, np.array([7.0]))
    assert state.states.tolist() == [7.0]
    assert state.heat_in == 0.0


def test_step_size_outlives_a_short_communication_step() -> None:
    system, state = Linear(np.array([1e-3])), solver.start(np.array([10.0]), 1)
    u = np.zeros(1)
    state = solver.advance(system, state, 0.0, 600.0, u, u)
    grown = state.step
    for i in range(20):
        state = solver.advance(system, state, 600.0 + 0.1 * i, 0.1, u, u)
    assert state.step >= grown


def test_not_finite_is_an_error() -> None:
    with pytest.raises(ArithmeticError, match="not finite at 0 s"):
        run(Linear(np.ones(1)), 1.0, np.array([np.nan]))


def test_an_impossible_tolerance_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver, "TOLERANCE_K", 1e-30)
    with pytest.raises(ArithmeticError, match="step size fell below 1e-06 s"):
        run(Linear(np.ones(1)), 1.0, np.array([1.0]), 1.0, 5.0)


def test_a_stiff_state_follows_a_ramp_without_error() -> None:
    """``dT/dt = rate (s t - T)``: behind the ramp by ``s / rate``, however long the steps are."""
    rate, slope = 50.0, 3.0
    system, state = Linear(np.array([rate])), State(np.array([-slope / rate]), 1e9, np.zeros(()), np.zeros(()))
    state = solver.advance(system, state, 0.0, 10.0, np.zeros(1), np.array([rate * slope * 10.0]))
    assert state.states == pytest.approx([slope * 10.0 - slope / rate], rel=1e-12)
    assert system.calls == 2


def test_a_light_state_does_not_ask_for_small_steps() -> None:
    """A jump of its input by 0.5 K: with full weight steps are rejected, with a tenth the step is taken at once."""
    jump, calls = 0.5, []
    for weight in (1.0, 0.1):
        system, state = Linear(np.array([10.0]), weights=weight), State(np.zeros(1), 1.0, np.zeros(()), np.zeros(()))
        state = solver.advance(system, state, 0.0, 1.0, np.full(1, 10.0 * jump), np.full(1, 10.0 * jump))
        assert state.states == pytest.approx([jump], abs=0.25 * jump)
        calls.append(system.calls)
    assert calls[0] > 10
    assert calls[1] == 2


def test_weights_are_those_of_the_heat_a_node_can_store() -> None:
    weights = solver.error_weights(np.array([2.0, solver.FULL_WEIGHT_J_K, 1e4]))
    assert weights == pytest.approx([2.0 / solver.FULL_WEIGHT_J_K, 1.0, 1.0])


def test_too_many_steps_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A state that is thrown back after every step never settles: the step size cannot grow."""
    monkeypatch.setattr(solver, "MOST_STEPS", 50)
    system = Linear(np.array([1.0]), update=lambda states: np.full_like(states, 100.0))
    with pytest.raises(ArithmeticError, match=r"needs more than 50 steps; make it shorter. They end at \d\.\d+ s"):
        run(system, 1000.0, np.array([100.0]))
