"""What remembers along a recording: on all intervals at once as interval by interval, and as the solver has it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from diagnosis.forward.extra_states import SWITCHED_PARTS, Memories, within
from diagnosis.forward.free_running import free_running
from diagnosis.forward.grid import Piece, pieces
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.recurrence import lagged, recurrence
from diagnosis.forward.trajectory import parameter_heat, simulate
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.types import Array
from models.files.cycle import Cycle
from models.mechanisms import CATALOGUE, Placed, Scale
from models.network.laws import symbol
from models.simulation.thermal_network import ExtraState
from tests.unit.diagnosis.inference_example import named_values, recording_with

INPUTS = ("speed", "torque", "T_ambient", "air_speed")
FZG = load_gearbox("fzg")
REMEMBERING = sorted(name for name, m in CATALOGUE.items() if m.states and m.placed(FZG.network(), Scale.of(FZG)))


def piece_of(time: Array, *, speed: Array | float = 2600.0, torque: float = 150.0) -> Piece:
    (found,) = pieces([recording_with(time, speed=speed, torque=torque)], INPUTS, (), even=True)
    return found


def placed_on(gearbox: Gearbox, name: str) -> Placed:
    return CATALOGUE[name].placed(gearbox.network(), Scale.of(gearbox, speed=2600.0, torque=150.0))[0]


def test_recurrence_is_a_loop() -> None:
    rng = np.random.default_rng(3)
    slope, driven = rng.uniform(-1.0, 1.0, (300, 4)), rng.normal(size=(300, 4))
    slope[rng.uniform(size=slope.shape) < 0.3] = 1.0
    expected = np.array(driven)
    for k in range(1, len(driven)):
        expected[k] += slope[k] * expected[k - 1]
    np.testing.assert_allclose(recurrence(slope, driven), expected, rtol=1e-12, atol=1e-12)
    one, shared = recurrence(slope[:, :1], driven), np.broadcast_to(slope[:, :1], slope.shape)
    np.testing.assert_array_equal(one, recurrence(shared, driven))


def test_no_columns_are_not_given_to_lapack(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scipy's `dtbtrs` writes beyond an array without columns; a class without model error has none."""
    monkeypatch.setattr("diagnosis.forward.recurrence.dtbtrs", None)
    assert recurrence(np.zeros((10, 1)), np.zeros((10, 0))).shape == (10, 0)
    assert lagged(np.zeros((11, 0)), np.ones(10), 5.0).shape == (11, 0)


def test_a_lag_follows_its_equation() -> None:
    """dy/dt = (u - y)/tau for a ramp: y = u - c tau (1 - exp(-t/tau)), whatever the steps."""
    steps = np.array([1.0, 40.0, 3.0, 100.0, 20.0])
    time = np.concatenate([[0.0], np.cumsum(steps)])
    expected = 0.5 * time - 0.5 * 30.0 * (1.0 - np.exp(-time / 30.0))
    np.testing.assert_allclose(lagged(0.5 * time, steps, 30.0), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("spacing", [10.0, 600.0])
@pytest.mark.parametrize("name", REMEMBERING)
def test_at_once_as_interval_by_interval(fzg: Gearbox, name: str, spacing: float) -> None:
    placed = placed_on(fzg, name)
    model = NetworkOnGrid(placed.apply(fzg.network()), fzg.losses())
    time = np.arange(0.0, 200.0 * spacing, spacing)
    piece = replace(piece_of(time, speed=np.where(np.sin(time / spacing / 15.0) > -0.6, 2600.0, 0.0)), guided=True)
    assert piece.slow == (spacing > 60.0)
    swing = 0.5 + 0.5 * np.sin(piece.time / spacing / 9.0)
    T = 25.0 + 100.0 * swing[:, None] * np.linspace(0.8, 1.0, model.n)
    power = np.full((len(piece.steps), len(model.laws.components)), 30.0)
    values = np.stack([model.start, model.start * 1.1])
    memories = model._memories
    assert memories._in_turn  # all of the catalogue: else its diagnosis would be slow
    found = np.stack([model.memory(piece, T, T, each, power) for each in values])
    memories._in_turn = False
    expected = np.stack([model.memory(piece, T, T, each, power) for each in values])
    for index, state in enumerate(model.network.states):
        range_of = np.ptp(expected[..., index], axis=1)
        assert (range_of > 0.0).all()
        # The loop takes steps of its own where a rate drives the state.
        tolerance = 1e-12 if state.update is not None else 0.02 * range_of.min()
        np.testing.assert_allclose(found[..., index], expected[..., index], atol=tolerance)
    memories._in_turn = True
    np.testing.assert_array_equal(model.memory(piece, T, T, values[1], power), found[1])  # each as it is alone


HOTTEST, OIL = symbol("hottest"), symbol("T_oil")


@pytest.mark.parametrize(
    ("update", "follows"),
    [
        (sp.Max(HOTTEST, OIL), max),
        (sp.Piecewise((OIL, HOTTEST < 35.0), (HOTTEST, True)), lambda was, oil: oil if was < 35.0 else was),
    ],
)
def test_what_is_no_straight_line_of_itself_is_followed_one_by_one(
    update: sp.Expr, follows: Callable[[float, float], float]
) -> None:
    memories = Memories(
        [ExtraState(name="hottest", start=0.0, rate=sp.Integer(0), update=update)], ["time", "T_oil"], ["oil"], {}
    )
    assert not memories._in_turn
    piece = piece_of(np.arange(0.0, 81.0, 20.0))
    seen = np.array([30.0, 32.0, 46.0, 20.0, 20.0])[:, None]
    (found,) = memories.follow(piece, [piece.middle, 0.5 * (seen[1:, 0] + seen[:-1, 0])], seen)
    state, expected = 0.0, []
    for oil in within(seen, SWITCHED_PARTS).ravel():
        state = follows(state, oil)
        expected.append(state)
    np.testing.assert_allclose(found[0], np.reshape(expected, (-1, SWITCHED_PARTS)).mean(axis=1))


def test_states_that_are_given_are_not_followed() -> None:
    valve = ExtraState(name="valve", start=0.0, rate=sp.Integer(0), update=sp.Float(1.0))
    opening = ExtraState(name="opening", start=0.0, rate=(symbol("valve") - symbol("opening")) / 50.0, update=None)
    memories = Memories([valve, opening], ["time", "T_oil"], ["oil"], {})
    piece = piece_of(np.arange(0.0, 201.0, 20.0))
    seen = np.full((len(piece.time), 1), 40.0)
    rows = [piece.middle, np.full(len(piece.steps), 40.0)]
    expected = 1.0 - np.exp(-piece.middle / 50.0)  # of what comes before it in the list
    np.testing.assert_allclose(memories.follow(piece, rows, seen)[1][0], expected, rtol=1e-12)
    closed = memories.follow(piece, rows, seen, {0: np.zeros(len(piece.steps))})
    assert not closed[0].any()
    assert not closed[1].any()


def thermostat(gearbox: Gearbox) -> tuple[NetworkOnGrid, Placed, dict[str, float]]:
    placed = placed_on(gearbox, "cooler_thermostat")
    given = dict(zip([p.name for p in placed.parameters], (7.0, 45.0, 4.0, 20.0, 40.0), strict=True))
    return NetworkOnGrid(placed.apply(gearbox.network()), gearbox.losses()), placed, given


def test_a_slow_valve_runs_free_as_the_solver_has_it(fzg: Gearbox) -> None:
    model, _, given = thermostat(fzg)
    time = np.arange(0.0, 5401.0, 5.0)
    piece = piece_of(time)
    found = free_running(model, piece, named_values(model.network, given), np.full(model.n, 25.0))
    columns = {"time_s": time, "speed_rpm": np.full(len(time), 2600.0), "torque_Nm": np.full(len(time), 150.0),
               "T_ambient_degC": np.full(len(time), 22.0), "air_speed_m_s": np.full(len(time), 2.0)}  # fmt: skip
    cycle = Cycle.from_columns(columns)
    solved = model.network.simulate(cycle, losses=fzg.losses(), initial=25.0, parameters=given).columns()["T_oil_degC"]
    oil = model.parts.index("oil")
    late = piece.time > 1800.0
    expected = np.interp(piece.time, time, solved)[late]
    assert np.ptp(expected) > 4.0  # it saws, beyond its band since the valve is slow
    assert np.mean(found.T[late, oil]) == pytest.approx(np.mean(expected), abs=0.01)
    assert np.std(found.T[late, oil]) == pytest.approx(np.std(expected), rel=0.01)
    np.testing.assert_allclose(found.T[~late, oil], np.interp(piece.time, time, solved)[~late], atol=0.05)


def test_derivatives_of_a_slow_valve(fzg: Gearbox) -> None:
    """Against differences, where switches follow what was measured."""
    model, placed, given = thermostat(fzg)
    time = np.arange(0.0, 5401.0, 20.0)
    oil = 45.0 + 4.0 * np.sin(time / 200.0)
    piece = replace(
        piece_of(time), guided=True, channels=("oil",), measured=oil[:, None], counts=np.ones((len(oil), 1))
    )
    start = np.full(model.n, 45.0)
    found = simulate(model, piece, named_values(model.network, given), start, rounds=20, settled_K=1e-7)
    names = [p.name for p in model.network.parameters]
    for parameter, least in zip((placed.parameters[0], placed.parameters[4]), (1.0, 0.01), strict=True):
        step = 0.02 * given[parameter.name]
        heat = parameter_heat(model, found, names.index(parameter.name), step).into
        column = found.response(heat[:, :, None])[..., 0]
        sides = []
        for moved in (given[parameter.name] + step, given[parameter.name] - step):
            values = named_values(model.network, given | {parameter.name: moved})
            sides.append(simulate(model, piece, values, start, rounds=20, settled_K=1e-7).T)
        numeric = (sides[0] - sides[1]) / (2.0 * step)
        assert np.abs(numeric).max() > least
        np.testing.assert_allclose(column, numeric, atol=0.02 * np.abs(numeric).max())


@pytest.mark.parametrize(
    ("speed_rpm", "running", "least", "most"),
    [(0.0, 0.0, 1.0, 1.0), (10.0, 0.0, 0.98, 1.0), (260.0, 0.0, 0.0, 0.01), (260.0, 1.0, 1.0, 1.0)],
)
def test_a_heater_with_an_interlock_is_off_as_soon_as_the_gearbox_turns(
    fzg: Gearbox, speed_rpm: float, running: float, least: float, most: float
) -> None:
    """The interlock is sharp: at a tenth of the reference speed of 2600 1/min next to nothing of the power is left."""
    placed = placed_on(fzg, "heater_thermostat")
    (state,) = placed.states
    given = {placed.strength.name: 80.0, state.name: 1.0, "speed": speed_rpm, f"{placed.label}_running": running}
    power = placed.expression.subs({s: given[s.name] for s in placed.expression.free_symbols})
    assert least <= float(power) / 80.0 <= most
