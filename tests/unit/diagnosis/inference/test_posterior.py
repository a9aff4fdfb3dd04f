"""The fit: derivatives against repeated simulation, bounds, starts and the structural floor."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis.candidates.explain import calibrated
from diagnosis.decision.holdout import Judge, at_holdout
from diagnosis.inference.posterior import Problem, _gauss_newton
from diagnosis.inference.unknowns import Unknowns, unknowns_of

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.trajectory import simulate
from diagnosis.forward.whitening import Whitening
from diagnosis.setup.inference_setup import InferenceSetup, floored
from diagnosis.setup.noise import noise_of
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import CHANNELS


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


def test_sensors_read_nodes_and_the_total_loss(problem: Problem, model: NetworkOnGrid) -> None:
    part = problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    read = readings(model, part.trajectory, part.sensors.ideal())
    oil = part.trajectory.T[:, list(model.parts).index("oil")]
    np.testing.assert_array_equal(read[:, 1], oil)
    assert read[:, 3].mean() == pytest.approx(part.trajectory.balance.sources.sum(axis=-1).mean(), rel=0.01)


def test_watts_are_no_start_temperature(model: NetworkOnGrid, piece: Piece) -> None:
    """How uncertain an unmeasured start is goes with how hot the gearbox is, whatever it loses."""
    white = dict.fromkeys(CHANNELS, 0.2) | {"P_loss": 5.0}
    watts, hot = np.array(piece.measured), np.array(piece.measured)
    watts[0, CHANNELS.index("P_loss")] = 700.0
    hot[0, CHANNELS.index("oil")] = 92.0
    sd = [noise_of(model, replace(piece, measured=m), white, 250.0).start_sd for m in (piece.measured, watts, hot)]
    np.testing.assert_array_equal(sd[1], sd[0])
    unknown = [index for index, name in enumerate(model.parts) if name not in CHANNELS]
    assert (sd[0][unknown] < 4.0).all()  # everything is near the air of 22 degC
    assert (sd[2][unknown] > 10.0).all() and (sd[2][unknown] < 15.0).all()


def test_without_derivatives_there_is_no_fit(monkeypatch: pytest.MonkeyPatch, problem: Problem) -> None:
    monkeypatch.setattr(Problem, "_columns", lambda self, *_: np.full((2, 2, len(self.unknowns)), np.nan))
    with pytest.raises(ArithmeticError, match="no derivative"):
        problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    with pytest.raises(ArithmeticError, match="no solution where the fit should start"):
        problem.fit()


def test_a_number_at_its_bound_leaves_it_when_the_data_want_it(problem: Problem) -> None:
    """Held at a bound it must neither wander beyond, where its value no longer changes, nor stay there for ever."""
    index = next(i for i, item in enumerate(problem.unknowns.items) if item.target == "mesh")
    item = problem.unknowns.items[index]
    upper = item.value(2.0)
    narrow = replace(item, parameter=replace(item.parameter, upper=upper))
    items = (*problem.unknowns.items[:index], narrow, *problem.unknowns.items[index + 1 :])
    bounded = problem.changed(unknowns=Unknowns(items))
    z = np.zeros(len(items))
    z[index] = 12.0
    fit, free = bounded.fit(z, iterations=10), problem.fit(iterations=10)
    for _ in range(5):  # a fit ends where a step gains less than 0.02; again from there, until nothing moves
        fit, free = bounded.fit(fit.z, iterations=10), problem.fit(free.z, iterations=10)
    np.testing.assert_allclose(fit.z, free.z, atol=0.05)  # what a fit is settled to
    assert fit.log_evidence == pytest.approx(free.log_evidence, abs=0.1)
    # Readings that want still more of it: it ends at the bound, and everything else settles.
    values = problem.unknowns.network_values(problem.model.network, 6.0 * np.eye(len(items))[index])
    hot = simulate(problem.model, problem.pieces[0], values, problem.starts[0])
    sensors = problem.unknowns.sensors(CHANNELS, np.zeros(len(items)))
    piece = replace(problem.pieces[0], measured=readings(problem.model, hot, sensors))
    pushed = bounded.changed(pieces=[piece]).fit(iterations=20)
    assert pushed.z[index] == pytest.approx(2.0)
    step = _gauss_newton(pushed.parts, pushed.z, 0.0, *bounded.unknowns.bounds)
    assert float(np.abs(step).max()) < 0.2  # everything else has settled beside it


def test_a_fit_leaves_a_start_that_only_looks_good(monkeypatch: pytest.MonkeyPatch, problem: Problem) -> None:
    """A trajectory that had not settled made the first objective too small; measured by that, no step is any better."""
    honest, calls = Problem._attempt, 0

    def attempt(self: Problem, z: Array, guesses: Any) -> Any:
        nonlocal calls
        calls += 1
        parts = honest(self, z, guesses)
        if calls > 1 or parts is None:
            return parts
        return [replace(part, white_residual=0.01 * part.white_residual) for part in parts]

    expected = problem.fit(iterations=10)
    monkeypatch.setattr(Problem, "_attempt", attempt)
    found = problem.fit(iterations=10)
    assert np.abs(expected.z).max() > 1.0
    np.testing.assert_allclose(found.z, expected.z, atol=0.1)


def test_the_structural_floor_rises_and_falls_with_what_is_left(
    monkeypatch: pytest.MonkeyPatch, problem: Problem, piece: Piece
) -> None:
    """It is estimated from the smallest there is, however often; and a held-out recording is judged by the same."""
    clean = calibrated(problem)
    assert clean.problem.floor == 1.0 and floored(clean) is clean
    wander = 1.5 * np.sin(piece.time / 400.0)[:, None] * np.array([0.6, 1.0, 0.8, 0.0])
    disturbed = calibrated(problem.changed(pieces=[replace(piece, measured=piece.measured + wander)]))
    raised = floored(disturbed)
    assert raised.problem.floor == 4.0
    assert floored(raised) is raised
    z = np.zeros(len(problem.unknowns))
    part = problem.changed(floor=4.0).linearise(0, z, None)
    noise = replace(problem.noise[0], heat_sd=4.0 * problem.noise[0].heat_sd)
    white = Whitening(problem.model, part.trajectory, part.sensors, noise)(part.residual[:, :, None])[:, 0]
    np.testing.assert_allclose(part.white_residual, white, atol=1e-9)
    case: Any = SimpleNamespace(holdout=problem)
    assert at_holdout(case, raised).floor == 4.0
    explained = raised.problem.changed(pieces=problem.pieces)
    fallen = floored(replace(raised, problem=explained, fit=explained.fit(raised.fit.z)))
    assert fallen.problem.floor == 1.0
    assert fallen.log_evidence == pytest.approx(clean.log_evidence, abs=0.5)
    monkeypatch.setattr(Problem, "slow", True)  # means over minutes
    assert floored(replace(raised, problem=explained, fit=explained.fit(raised.fit.z))).problem.floor == 4.0


def test_an_input_that_follows_a_temperature_is_seen_alike_from_temperatures_alone(
    fzg: Gearbox, problem: Problem
) -> None:
    (warmed, *_) = CATALOGUE["ambient_probe_heated"].placed(fzg.network(), Scale.of(fzg), CHANNELS)
    shifted = problem.changed(unknowns=problem.unknowns.with_parameters("term", warmed.parameters), terms=(warmed,))
    z = np.zeros(len(shifted.unknowns))
    z[-len(warmed.parameters)] = shifted.unknowns.items[-len(warmed.parameters)].z(-0.1)
    once = shifted.linearise(0, z, None, rounds=8).trajectory
    for _ in range(4):
        once = shifted.linearise(0, z, once, rounds=8).trajectory
    known, guided = (shifted.linearise(0, z, guess, rounds=8) for guess in (once, once.T))
    ambient = problem.model.laws.inputs.index("T_ambient")
    moved = [part.trajectory.piece.samples[..., ambient] - problem.pieces[0].samples[..., ambient]
             for part in (known, guided)]  # fmt: skip
    assert np.abs(moved[0]).max() > 1.0
    np.testing.assert_allclose(moved[1], moved[0], atol=0.02)
    np.testing.assert_allclose(guided.residual, known.residual, atol=0.02)
    filters = shifted.with_whitenings([known.whitening])
    assert filters.objective(z, [once.T]) == pytest.approx(filters.objective(z, [once]), rel=0.01)


def test_air_that_nobody_recorded_is_less_certain(problem: Problem) -> None:
    network = problem.model.network
    sd = [next(i.parameter.sd for i in unknowns_of(network, CHANNELS, ambient_assumed=assumed).items
               if i.role == "ambient_offset") for assumed in (False, True)]  # fmt: skip
    assert sd[0] < 1.0 < 3.0 < sd[1]


def test_judge_prefers_the_truth_and_survives_what_has_no_prediction(fzg: Gearbox, problem: Problem) -> None:
    right = calibrated(problem)
    case = InferenceSetup(
        gearbox=fzg, nominal=fzg.network(), losses=fzg.losses(), scale=Scale.of(fzg), channels=CHANNELS, train=problem,
        holdout=problem, loss_W=250.0, noise_K=0.2,
    )  # fmt: skip
    judge = Judge(case, right)
    assert judge.gain(right) == pytest.approx(0.0, abs=1e-6)
    shifted = np.array(right.fit.z)
    shifted[next(i for i, item in enumerate(right.fit.unknowns.items) if item.target == "mesh")] += 2.0
    wrong = replace(right, fit=replace(right.fit, z=shifted))
    assert judge.gain(wrong) < -10.0
    assert judge.rmse(wrong) > 2.0 * judge.rmse(right)
    # Explained recordings have less than noise and structural floor allow; what is wrong has more.
    assert judge.misfit < 1.0 < 5.0 < Judge(case, wrong).misfit
    assert Judge(replace(case, holdout=problem.changed(pieces=[])), right).misfit == 0.0
    network = problem.model.network.with_source("oil", lambda s: 40.0 * s.T_oil, name="own_heat")
    none = replace(right, problem=problem.changed(model=NetworkOnGrid(network, problem.model.losses)))
    assert judge.gain(none) == -np.inf
    assert judge.rmse(none) == np.inf and Judge(case, none).misfit == np.inf
