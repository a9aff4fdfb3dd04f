"""Trajectories on the grid against the solver, tangents against differences, terms inside and outside a network."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.forward.grid import ErrorCourse, Piece, pieces
from diagnosis.forward.matrix_exponential import exponential
from diagnosis.forward.network_on_grid import HIGHEST_T, SLOW_NEAR_K, SLOW_REACH_K, NetworkOnGrid
from diagnosis.forward.recurrence import lagged
from diagnosis.forward.term_on_grid import TermOnGrid, input_slope
from diagnosis.forward.trajectory import parameter_heat, settled_balance, simulate
from diagnosis.setup.shapes import shape_terms
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.files.cycle import Cycle
from models.mechanisms import CATALOGUE, Scale
from models.network.laws import symbol
from tests.unit.diagnosis.inference_example import named_values, recording_of


@pytest.mark.parametrize("even", [True, False])
def test_trajectory_is_that_of_the_solver(
    model: NetworkOnGrid, ride: dict[str, Array], simulated: dict[str, Array], even: bool
) -> None:
    (piece,) = pieces([recording_of(ride, {})], model.laws.inputs, (), even=even)
    found = simulate(model, piece, named_values(model.network), np.full(model.n, 25.0), rounds=8, settled_K=1e-4)
    for index, part in enumerate(model.parts):
        solved = np.interp(piece.time, ride["time_s"], simulated[f"T_{part}_degC"])
        # The mesh has no mass: it follows the mean input of an interval, half an interval late.
        assert np.abs(found.T[:, index] - solved).max() < (0.4 if part == "mesh" else 0.08), part


def test_tangents_follow_the_losses_where_they_have_to(model: NetworkOnGrid, piece: Piece) -> None:
    """What is kept of an earlier tangent, interval by interval, is off by less than a ten-thousandth."""
    rng = np.random.default_rng(0)
    T = np.full((len(piece.steps), model.n), 60.0)
    tangent = model.loss_tangent(piece, T)
    assert model.loss_tangent(piece, T + 0.05, tangent).power is tangent.power
    for _ in range(4):
        T = T + rng.choice([0.0, 0.05, 3.0, 9.0], size=(len(T), 1)) * rng.uniform(-1.0, 1.0, size=T.shape)
        samples = np.array(piece.samples)
        samples[..., 1] *= 1.0 + rng.choice([0.0, 0.002, 0.2], size=(len(T), 1)) * rng.uniform(-1.0, 1.0)
        moved = replace(piece, samples=samples)
        tangent = model.loss_tangent(moved, T, tangent)
        losses = model.loss_at(samples, T)
        error = np.abs(tangent.at(T[:, model.loss_nodes]) - losses).sum(axis=1)
        assert (error <= 5e-5 * losses.sum(axis=1) + 1e-9).all()
        renewed = model.loss_tangent(moved, T)
        unlike = np.abs(tangent.slope - renewed.slope).sum(axis=(1, 2))
        assert (unlike <= 0.2 * np.abs(renewed.slope).sum(axis=(1, 2)) + 1e-9).all()


def test_tangents_of_slow_rows_are_anew_all_together_or_not_at_all(model: NetworkOnGrid, piece: Piece) -> None:
    slow = replace(piece, slow=True)
    T = np.full((len(slow.steps), model.n), 60.0)
    first = model.loss_tangent(slow, T)

    def moved(by: float) -> Array:
        found = T.copy()
        found[3] += by
        return found

    assert model.loss_tangent(slow, moved(0.9 * SLOW_NEAR_K), first) is first
    near = model.loss_tangent(slow, moved(2.0), first)
    np.testing.assert_array_equal(near.power, model.loss_at(slow.samples, moved(2.0)))
    assert near.slope is first.slope
    assert model.loss_tangent(slow, moved(2.0 + 0.9 * SLOW_NEAR_K), near) is near  # also of one that was renewed before
    far = model.loss_tangent(slow, moved(1.1 * SLOW_REACH_K), first)
    np.testing.assert_array_equal(far.slope, model.loss_tangent(slow, moved(1.1 * SLOW_REACH_K)).slope)
    other = replace(slow, samples=1.001 * slow.samples)
    np.testing.assert_array_equal(model.loss_tangent(other, T, first).power, model.loss_at(other.samples, T))


def test_exponential_solves_the_linear_equation_exactly() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 5, 5))
    matrix = -np.einsum("kij,klj->kil", root, root) - 0.01 * np.eye(5)
    steps = np.array([0.1, 10.0, 600.0])
    decay, gain = exponential(matrix, steps)
    for A, h, E, G in zip(matrix, steps, decay, gain, strict=True):
        values, vectors = np.linalg.eigh(A)
        np.testing.assert_allclose(E, vectors @ np.diag(np.exp(h * values)) @ vectors.T, atol=1e-12)
        np.testing.assert_allclose(G, vectors @ np.diag(np.expm1(h * values) / values) @ vectors.T, atol=1e-9)


def test_lag_is_exact_for_straight_lines_and_even_or_uneven_steps() -> None:
    time = np.concatenate([np.arange(0.0, 100.0, 10.0), np.arange(100.0, 400.0, 30.0)])
    for at in (time, np.linspace(0.0, 400.0, 41)):
        read = lagged(2.0 * at, np.diff(at), 25.0)
        np.testing.assert_allclose(read, 2.0 * (at - 25.0 * (1.0 - np.exp(-at / 25.0))), atol=1e-9)
    assert lagged(time, np.diff(time), 0.0) is time


def test_grid_means_keep_a_steady_drift(model: NetworkOnGrid) -> None:
    time = np.arange(0.0, 601.0, 1.0)
    columns = {"time_s": time, "speed_rpm": np.full(601, 1000.0), "torque_Nm": np.full(601, 50.0),
               "T_ambient_degC": np.full(601, 20.0)}  # fmt: skip
    (found,) = pieces([recording_of(columns, {"oil": 30.0 + 0.01 * time})], model.laws.inputs, ("oil",))
    np.testing.assert_allclose(found.measured[:, 0], 30.0 + 0.01 * found.time, atol=1e-9)
    assert found.counts[1:-1].min() == 20.0


def test_a_tank_is_solved_with_the_temperatures(fzg: Gearbox, piece: Piece, ride: dict[str, Array]) -> None:
    """Against the solver, which integrates it; and its derivatives against differences."""
    network = fzg.network()
    (placed,) = CATALOGUE["oil_tank"].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))
    given = dict(zip((p.name for p in placed.parameters), (6.0, 400.0, 0.2, 0.5), strict=True))
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    assert len(model.coupled) == 1
    values = named_values(model.network, given)
    found = simulate(model, piece, values, np.full(model.n, 25.0))
    cycle = Cycle.from_columns(ride | {"air_speed_m_s": np.full(len(ride["time_s"]), 2.0)})
    solved = model.network.simulate(cycle, losses=fzg.losses(), initial=25.0, parameters=given).columns()
    at = np.searchsorted(ride["time_s"], piece.time)
    T = np.stack([solved[f"T_{name}_degC"] for name in ("oil", "housing_lower", "bearing_1")], axis=1)[at]
    nodes = [model.parts.index(name) for name in ("oil", "housing_lower", "bearing_1")]
    np.testing.assert_allclose(found.T[:, nodes], T, atol=0.05)
    without = simulate(model, piece, named_values(model.network, given | {placed.strength.name: 0.0}), found.T[0])
    assert np.abs(without.T - found.T)[:, nodes].max() > 2.0
    names = [p.name for p in model.network.parameters]
    for name in (placed.parameters[1].name, placed.parameters[2].name):
        step = 0.02 * given[name]
        heat = parameter_heat(model, found, names.index(name), step).into
        column = found.response(heat[:, :, None])[:, nodes, 0]
        sides = [simulate(model, piece, named_values(model.network, given | {name: given[name] + sign * step}),
                          found.T[0], settled_K=1e-6, rounds=20).T[:, nodes] for sign in (1, -1)]  # fmt: skip
        numeric = (sides[0] - sides[1]) / (2.0 * step)
        assert np.abs(column - numeric).max() < 0.03 * np.abs(numeric).max()
    warm, at = np.array(piece.samples), model.laws.inputs.index("T_ambient")
    warm[..., at] += 0.5
    column = found.response(input_slope(model, found, "T_ambient").into[:, :, None])[:, nodes, 0]
    sides = [simulate(model, one, values, found.T[0], settled_K=1e-6, rounds=20).T[:, nodes]
             for one in (replace(piece, samples=warm), piece)]  # fmt: skip
    numeric = (sides[0] - sides[1]) / 0.5
    assert np.abs(column - numeric).max() < 0.02 * np.abs(numeric).max()  # the tank follows the air as well


def test_temperatures_that_run_away_are_no_trajectory(model: NetworkOnGrid, piece: Piece) -> None:
    network = model.network.with_source("oil", lambda s: 40.0 * s.T_oil, name="own_heat")  # W, more than it can shed
    hot = NetworkOnGrid(network, model.losses)
    with pytest.raises(ArithmeticError, match="run away"):
        simulate(hot, piece, hot.start, np.full(hot.n, 60.0))


def test_model_error_explains_nothing_beyond_where_laws_are_linearised(model: NetworkOnGrid, piece: Piece) -> None:
    """A machine may be as hot as it likes; heat that is assumed to carry it there is no explanation."""
    heat = np.zeros((len(piece.steps), model.n))
    heat[:, model.part_index("oil")] = 5000.0
    error = ErrorCourse(heat=heat, loss=np.zeros(len(heat)), reading=np.zeros((len(heat) + 1, len(piece.channels))))
    heated = NetworkOnGrid(model.network.with_source("oil", lambda _: 5000.0, name="heater"), model.losses)
    start = np.full(model.n, 60.0)
    assert HIGHEST_T < simulate(heated, piece, heated.start, start).T.max() < 1500.0
    with pytest.raises(ArithmeticError, match="run away"):
        simulate(model, replace(piece, error=error), model.start, start)


@pytest.mark.parametrize(
    ("name", "own"),
    [
        ("cooler_thermostat", {"strength": 3.0, "set_point": 35.0}),  # switches within this ride
        ("run_in_seals", {"strength": -0.6}),
        ("oil_housing_speed", {"strength": 0.8}),
        ("oil_ageing", {"strength": 0.5, "life": 600.0}),  # every loss with a weight of its own
    ],
)
def test_term_gives_the_same_heat_inside_its_network_and_beside_it(
    fzg: Gearbox, piece: Piece, name: str, own: dict[str, float]
) -> None:
    """Also a term that changes what is there: of a loss that it halves it has taken as much as is left."""
    network = fzg.network()
    placed = CATALOGUE[name].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))[0]
    given = {p.name: own.get(p.name.removeprefix(f"{placed.label}_"), p.start) for p in placed.parameters}
    values = np.array([list(given.values())])
    apart, inside = NetworkOnGrid(network, fzg.losses()), NetworkOnGrid(placed.apply(network), fzg.losses())
    T = np.full((len(piece.time), apart.n), 30.0) + np.linspace(0.0, 8.0, len(piece.time))[:, None]
    T[:, apart.parts.index("oil")] += 5.0
    found = []
    for model in (apart, inside):
        tangent = model.loss_tangent(piece, 0.5 * (T[1:] + T[:-1]))
        start = named_values(model.network, given)
        trajectory = simulate(model, piece, start, T[0], guess=T, rounds=1)
        memory = model.memory(piece, T, T, start, tangent.power)
        here = replace(trajectory, T=T, seen=T, tangent=tangent, memory=memory)
        here = replace(here, balance=settled_balance(model, here))
        found.append(TermOnGrid(model, placed).heat(here, values)[0])
    assert np.abs(found[0]).max() > 1.0
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)


def test_shifted_input_takes_a_guess_from_the_network_before_its_latest_term(fzg: Gearbox, piece: Piece) -> None:
    network, scale = fzg.network(), Scale.of(fzg, speed=2600.0, torque=150.0)
    (shift,) = CATALOGUE["ambient_swing"].placed(network, scale)
    (tank,) = CATALOGUE["oil_tank"].placed(network, scale)
    before, after = NetworkOnGrid(network, fzg.losses()), NetworkOnGrid(tank.apply(network), fzg.losses())
    guess = simulate(before, piece, before.start, np.full(before.n, 30.0), rounds=1)
    values = np.array([2.0, 3600.0, 0.0])
    moved = TermOnGrid(after, shift).adjusted(piece, values, guess)
    at = after.laws.inputs.index("T_ambient")
    expected = 2.0 * np.sin(2.0 * np.pi * piece.middle / 3600.0)
    np.testing.assert_allclose((moved.samples - piece.samples)[..., at], np.repeat(expected[:, None], 5, axis=1))


def test_tilts_never_turn_a_conductance_round(fzg: Gearbox) -> None:
    network, scale = fzg.network(), Scale.of(fzg)
    for term in shape_terms(network, scale):
        (name,) = (p.name for p in term.parameters)
        for tilt in (-1.0, 1.0):
            for speed, T_oil in ((0.0, 20.0), (40.0, 20.0), (6500.0, 120.0)):
                signals = {"speed": speed, "torque": 0.0, "T_ambient": 20.0, name: tilt}
                signals |= {f"T_{node}": T_oil for node in network.node_names}
                change = float(term.expression.subs({symbol(k): v for k, v in signals.items()}))
                assert change > -1.0


def test_switches_felt_what_a_late_clock_shows_later(piece: Piece) -> None:
    late = replace(piece, guided=True, late_s=600.0)
    parts_of = [name for name in piece.channels if name != "P_loss"]
    before, after = replace(late, late_s=0.0).guide(parts_of), late.guide(parts_of)
    inside = piece.time < piece.time[-1] - 600.0
    assert np.isnan(after[piece.time > piece.time[-1] - 600.0]).all()  # nobody knows: there the simulated course counts
    for column in range(len(parts_of)):
        expected = np.interp(piece.time[inside] + 600.0, piece.time, before[:, column])
        np.testing.assert_allclose(after[inside, column], expected)
