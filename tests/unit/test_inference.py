"""The inference against brute force: trajectories against the solver, derivatives against differences, filters and
evidence against plain linear algebra."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.case import Case
from diagnosis.evidence import strength
from diagnosis.explain import calibrated
from diagnosis.grid import Piece, pieces
from diagnosis.holdout import Judge
from diagnosis.noise import loss_noise, noise_of, start_guess
from diagnosis.observation import lagged, readings
from diagnosis.posterior import Problem
from diagnosis.predict import START_S, predict
from diagnosis.recording import Channel, Recording
from diagnosis.term_on_grid import TermOnGrid
from diagnosis.trajectory import NetworkOnGrid, exponential, named_values, simulate
from diagnosis.unknowns import unknowns_of
from diagnosis.whitening import Noise, Whitening, reading_variance
from models.cycle import Cycle
from models.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale
from models.types import Array

CHANNELS = ("housing_lower", "oil", "bearing_1", "P_loss")


def recording_of(columns: dict[str, Array], channels: dict[str, Array]) -> Recording:
    time = columns["time_s"]
    return Recording(
        name="made", path=Path("made.csv"), sha256="0" * 64, time=time,
        inputs={"speed": columns["speed_rpm"], "torque": columns["torque_Nm"], "T_ambient": columns["T_ambient_degC"],
                "air_speed": np.full(len(time), 2.0)},
        channels=tuple(Channel(name=n, values=v) for n, v in channels.items()), segments=(slice(0, len(time)),),
    )  # fmt: skip


@pytest.fixture(scope="module")
def ride() -> dict[str, Array]:
    """Forty minutes of smooth operation, every 10 s."""
    time = np.arange(0.0, 2401.0, 10.0)
    return {
        "time_s": time,
        "speed_rpm": 1800.0 + 900.0 * np.sin(time / 300.0),
        "torque_Nm": 120.0 + 60.0 * np.cos(time / 400.0),
        "T_ambient_degC": np.full(len(time), 22.0),
    }


@pytest.fixture(scope="module")
def simulated(fzg: Gearbox, ride: dict[str, Array]) -> dict[str, Array]:
    cycle = Cycle.from_columns(ride | {"air_speed_m_s": np.full(len(ride["time_s"]), 2.0)})
    return dict(fzg.network().simulate(cycle, losses=fzg.losses(), initial=25.0).columns())


@pytest.fixture(scope="module")
def model(fzg: Gearbox) -> NetworkOnGrid:
    return NetworkOnGrid(fzg.network(), fzg.losses())


@pytest.fixture(scope="module")
def piece(model: NetworkOnGrid, ride: dict[str, Array], simulated: dict[str, Array]) -> Piece:
    channels = {n: simulated["P_loss_W" if n == "P_loss" else f"T_{n}_degC"] for n in CHANNELS}
    (found,) = pieces([recording_of(ride, channels)], model.laws.inputs, CHANNELS)
    return found


@pytest.fixture(scope="module")
def problem(fzg: Gearbox, model: NetworkOnGrid, piece: Piece) -> Problem:
    white = dict.fromkeys(CHANNELS, 0.2) | {"P_loss": 5.0}
    noise = noise_of(model, piece, white, 250.0)
    return Problem(model, [piece], unknowns_of(fzg.network(), CHANNELS), [noise], [start_guess(model, piece)])


def test_trajectory_is_that_of_the_solver(
    model: NetworkOnGrid, piece: Piece, ride: dict[str, Array], simulated: dict[str, Array]
) -> None:
    found = simulate(model, piece, named_values(model.network), np.full(model.n, 25.0), rounds=8, settled_K=1e-4)
    for index, part in enumerate(model.parts):
        solved = np.interp(piece.time, ride["time_s"], simulated[f"T_{part}_degC"])
        # The mesh has no mass: it follows the mean input of an interval, half an interval late.
        assert np.abs(found.T[:, index] - solved).max() < (0.4 if part == "mesh" else 0.08), part


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


def test_derivatives_are_those_of_repeated_simulation(problem: Problem) -> None:
    nothing = np.zeros(len(problem.unknowns))
    here = problem.linearise(0, nothing, None, rounds=8)
    for index, item in enumerate(problem.unknowns.items):
        ahead, behind = np.array(nothing), np.array(nothing)
        ahead[index], behind[index] = 0.1, -0.1
        there, back = (problem.linearise(0, z, here.trajectory, rounds=6) for z in (ahead, behind))
        # In the first minute the cold gears jump within an interval, and the derivative is that of its middle.
        differences = ((back.residual - there.residual) / 0.2)[4:]
        # Where the operating point hardly changes, the loss along the trajectory is a straight line to a few percent.
        size = np.abs(differences).max(axis=0)
        error = np.abs(differences - here.columns[4:, :, index]).max(axis=0)
        assert (error <= 0.04 * size + 0.015 * np.array([1.0, 1.0, 1.0, 10.0])).all(), item.target


def test_readings_of_the_model_itself_leave_nothing(problem: Problem) -> None:
    fitted = problem.fit()
    assert np.abs(fitted.z).max() < 1.6  # the sensors' lag of 15 s is not in the data
    assert np.nanmax(np.abs(fitted.parts[0].residual[5:, :3])) < 0.15


def test_innovations_of_the_noise_are_white(model: NetworkOnGrid, piece: Piece, problem: Problem) -> None:
    """Noise drawn from the noise model itself comes out as independent standard normal numbers."""
    rng = np.random.default_rng(1)
    part = problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    noise = replace(
        problem.noise[0], heat_sd=np.where(model.capacities(model.start) > 100.0, 3.0, 0.0), heat_time=400.0
    )
    whitening = Whitening(model, part.trajectory, part.sensors, noise)
    steps, draws = piece.steps, 40
    heat = np.empty((len(steps), model.n, draws))
    now = noise.heat_sd[:, None] * rng.normal(size=(model.n, draws))
    for k, h in enumerate(steps):
        heat[k] = now
        rho = np.exp(-h / noise.heat_time)
        now = rho * now + noise.heat_sd[:, None] * np.sqrt(1.0 - rho**2) * rng.normal(size=now.shape)
    T = part.trajectory.response(heat, noise.start_sd[:, None] * rng.normal(size=(model.n, draws)))
    names = list(model.parts)
    rows = [T[:, names.index(n)] for n in CHANNELS[:3]]
    middle = 0.5 * (T[1:] + T[:-1])
    loss = np.einsum("kn,knc->kc", part.trajectory.loss_slope, middle)
    rows.append(np.concatenate([loss[:1], 0.5 * (loss[1:] + loss[:-1]), loss[-1:]]))
    read = np.stack(rows, axis=1)
    sd = np.sqrt(reading_variance(model, part.trajectory, part.sensors, noise))
    innovations = whitening(read + sd[:, :, None] * rng.normal(size=read.shape))
    temperatures = innovations.reshape(len(piece.time), 4, draws)[:, :3]
    assert temperatures.std() == pytest.approx(1.0, abs=0.02)
    lagged_product = np.mean(temperatures[1:] * temperatures[:-1])
    assert abs(lagged_product) < 0.03


def test_missing_readings_say_nothing(model: NetworkOnGrid, piece: Piece, problem: Problem) -> None:
    measured = np.array(piece.measured)
    measured[20:60, 1] = np.nan
    holed = problem.changed(pieces=[replace(piece, measured=measured)])
    part = holed.linearise(0, np.zeros(len(problem.unknowns)), None)
    white = part.white_residual.reshape(len(piece.time), -1)
    assert (white[20:60, 1] == 0.0).all()
    assert np.isfinite(part.white_columns).all()


@pytest.mark.parametrize("sign", [-1, 0, 1])
def test_log_bayes_factor_is_the_integral_over_the_strength(sign: int) -> None:
    rng = np.random.default_rng(2)
    x, residual, sd = rng.normal(size=30), rng.normal(size=30) + 0.4, 0.7
    found = strength(np.array([x @ residual]), np.array([x @ x]), sd, sign)
    s = np.linspace(-8.0 * sd, 8.0 * sd, 400_001)
    prior = np.exp(-0.5 * (s / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    if sign:
        prior = np.where(sign * s > 0.0, 2.0 * prior, 0.0)
    ratio = np.exp(s * (x @ residual) - 0.5 * s**2 * (x @ x))
    assert found.log_bayes[0] == pytest.approx(np.log(np.trapezoid(prior * ratio, s)), abs=1e-3)


def test_lag_is_exact_for_straight_lines_and_even_or_uneven_steps() -> None:
    time = np.concatenate([np.arange(0.0, 100.0, 10.0), np.arange(100.0, 400.0, 30.0)])
    for at in (time, np.linspace(0.0, 400.0, 41)):
        read = lagged(2.0 * at, np.diff(at), 25.0)
        np.testing.assert_allclose(read, 2.0 * (at - 25.0 * (1.0 - np.exp(-at / 25.0))), atol=1e-9)
    assert lagged(time, np.diff(time), 0.0) is time


def test_loss_noise_has_a_constant_and_a_relative_part(ride: dict[str, Array]) -> None:
    rng = np.random.default_rng(3)
    truth = np.repeat(np.linspace(20.0, 600.0, 100), 60)
    values = truth * (1.0 + 0.02 * rng.normal(size=len(truth))) + 2.0 * rng.normal(size=len(truth))
    rows = {k: np.resize(v, len(truth)) for k, v in ride.items()} | {"time_s": 10.0 * np.arange(len(truth))}
    constant, relative = loss_noise([recording_of(rows, {"P_loss": values})])
    assert constant == pytest.approx(2.0, abs=0.6)
    assert relative == pytest.approx(0.02, abs=0.002)


def test_grid_means_keep_a_steady_drift(model: NetworkOnGrid) -> None:
    time = np.arange(0.0, 601.0, 1.0)
    columns = {"time_s": time, "speed_rpm": np.full(601, 1000.0), "torque_Nm": np.full(601, 50.0),
               "T_ambient_degC": np.full(601, 20.0)}  # fmt: skip
    (found,) = pieces([recording_of(columns, {"oil": 30.0 + 0.01 * time})], model.laws.inputs, ("oil",))
    np.testing.assert_allclose(found.measured[:, 0], 30.0 + 0.01 * found.time, atol=1e-9)
    assert found.counts[1:-1].min() == 20.0


def test_sensors_read_nodes_and_the_total_loss(problem: Problem, model: NetworkOnGrid) -> None:
    part = problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    read = readings(model, part.trajectory, part.sensors.ideal())
    oil = part.trajectory.T[:, list(model.parts).index("oil")]
    np.testing.assert_array_equal(read[:, 1], oil)
    assert read[:, 3].mean() == pytest.approx(part.trajectory.balance.sources.sum(axis=-1).mean(), rel=0.01)


def test_noise_needs_no_floor(model: NetworkOnGrid, piece: Piece, problem: Problem) -> None:
    quiet = Noise(
        channel_sd=np.full(4, 0.1), floor_sd=np.zeros(4), loss_relative_sd=0.01, heat_sd=np.zeros(model.n),
        heat_time=100.0, start_sd=np.ones(model.n),
    )  # fmt: skip
    part = problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    white = Whitening(model, part.trajectory, part.sensors, quiet)(part.residual[:, :, None])
    assert np.isfinite(white).all()


def test_term_with_a_memory_gives_the_same_heat_inside_its_network_and_beside_it(fzg: Gearbox, piece: Piece) -> None:
    network = fzg.network()
    (placed,) = CATALOGUE["cooler_thermostat"].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))
    values = np.array([[p.start or 3.0 for p in placed.parameters]])
    values[0, 1] = 35.0  # switches within this ride
    found = []
    for carrier in (network, placed.apply(network)):
        model = NetworkOnGrid(carrier, fzg.losses())
        given = dict(zip((p.name for p in placed.parameters), values[0], strict=True))
        trajectory = simulate(model, piece, named_values(carrier, given), np.full(model.n, 30.0), rounds=1)
        apart = NetworkOnGrid(network, fzg.losses())
        same = simulate(apart, piece, named_values(network), np.full(model.n, 30.0), rounds=1)
        source = same if carrier is network else replace(same, values=trajectory.values, memory=trajectory.memory)
        found.append(TermOnGrid(model, placed).heat(source, values)[0])
    assert np.abs(found[0]).max() > 10.0
    np.testing.assert_allclose(found[1], found[0])


@pytest.mark.parametrize("name", ["cooler_thermostat", "oil_tank"])
def test_prediction_does_not_see_what_was_measured_later(
    fzg: Gearbox, piece: Piece, problem: Problem, name: str
) -> None:
    """A switch, and a memory that goes with temperatures: both follow readings in learning, neither in predicting."""
    network = fzg.network()
    (placed,) = CATALOGUE[name].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    unknowns = unknowns_of(model.network, CHANNELS)
    index = {item.target: i for i, item in enumerate(unknowns.items)}
    z = np.zeros(len(unknowns))
    z[index[placed.strength.name]] = unknowns.items[index[placed.strength.name]].z(4.0)
    if name == "cooler_thermostat":
        set_point = next(p.name for p in placed.parameters if p.name.endswith("set_point"))
        z[index[set_point]] = unknowns.items[index[set_point]].z(35.0)  # switches within this ride
    late = piece.time > piece.time[0] + START_S
    lied = replace(piece, measured=np.where(late[:, None], piece.measured - 30.0, piece.measured))
    told, deceived = (
        predict(problem.changed(model=model, unknowns=unknowns, pieces=[given]), 0, z) for given in (piece, lied)
    )
    np.testing.assert_array_equal(told.read, deceived.read)
    # While learning they do follow: the lie is felt there, else the comparison above would prove nothing.
    learnt = [
        problem.changed(model=model, unknowns=unknowns, pieces=[given]).linearise(0, z, None, rounds=6).trajectory.T
        for given in (piece, lied)
    ]
    assert np.abs(learnt[0] - learnt[1]).max() > 0.5


def test_temperatures_that_run_away_are_no_trajectory(model: NetworkOnGrid, piece: Piece) -> None:
    network = model.network.with_source("oil", lambda s: 40.0 * s.T_oil, name="own_heat")  # W, more than it can shed
    hot = NetworkOnGrid(network, model.losses)
    with pytest.raises(ArithmeticError, match="run away"):
        simulate(hot, piece, hot.start, np.full(hot.n, 60.0))


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


def test_judge_prefers_the_truth_and_survives_what_has_no_prediction(fzg: Gearbox, problem: Problem) -> None:
    right = calibrated(problem)
    case = Case(
        gearbox=fzg, nominal=fzg.network(), losses=fzg.losses(), scale=Scale.of(fzg), channels=CHANNELS, train=problem,
        holdout=problem, loss_W=250.0, noise_K=0.2,
    )  # fmt: skip
    judge = Judge(case, right, 1.0)
    assert judge.gain(right) == pytest.approx(0.0, abs=1e-6)
    shifted = np.array(right.fit.z)
    shifted[next(i for i, item in enumerate(right.fit.unknowns.items) if item.target == "mesh")] += 2.0
    wrong = replace(right, fit=replace(right.fit, z=shifted))
    assert judge.gain(wrong) < -10.0
    assert judge.rmse(wrong) > 2.0 * judge.rmse(right)
    network = problem.model.network.with_source("oil", lambda s: 40.0 * s.T_oil, name="own_heat")
    none = replace(right, problem=problem.changed(model=NetworkOnGrid(network, problem.model.losses)))
    assert judge.gain(none) == -np.inf
    assert judge.rmse(none) == np.inf
