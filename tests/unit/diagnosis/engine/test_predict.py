"""Free runs from a start that the first readings give."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.engine.fit import Experiment
from diagnosis.engine.predict import ROUNDS, START_S, log_score_gain, predict
from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.trajectory import complete_start, simulate
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import at, with_measured, with_term


@pytest.mark.parametrize("tank_degC", [27.0, 62.0])
def test_how_warm_a_tank_was_at_the_start_shows_in_the_first_minutes(
    fzg: Gearbox, piece: Piece, experiment: Experiment, tank_degC: float
) -> None:
    """A recording that begins hot: oil in the tank may have been left cold, or have gone along."""
    (placed,) = CATALOGUE["oil_tank"].placed(fzg.network(), Scale.of(fzg, speed=2600.0, torque=150.0))
    there = with_term(experiment, placed)
    model, z = there.machine.model, at(there, {"oil_tank_oil_strength": 4.0, "oil_tank_oil_lag": 900.0})
    assert complete_start(model, np.zeros(model.n))[-1] == 0.0  # as declared: like the air
    risen = tank_degC - piece.inputs[0, tuple(model.laws.inputs).index("T_ambient")]
    warm, setting = np.full(model.n, 62.0), there.setting(0, z)
    truth = simulate(model, piece, setting.values, np.append(warm, risen), rounds=20, settled_K=1e-4)
    hot = replace(with_measured(there, readings(model, truth, setting.sensors)), starts=(warm,))
    found = predict(hot, 0, z)
    late = piece.time > found.counts_from
    assert np.abs(found.trajectory.T - truth.T)[late].max() < 0.3
    declared = simulate(model, piece, setting.values, warm, rounds=20, settled_K=1e-4)
    assert (np.abs(declared.T - truth.T).max() > 3.0) == (tank_degC > 40.0)  # as it was taken before


@pytest.mark.parametrize("name", ["cooler_thermostat", "oil_tank"])
def test_prediction_does_not_see_later_readings(fzg: Gearbox, piece: Piece, experiment: Experiment, name: str) -> None:
    """A switch follows readings in learning. A tank never does: it would draw the simulation to the readings."""
    (placed,) = CATALOGUE[name].placed(fzg.network(), Scale.of(fzg, speed=2600.0, torque=150.0))
    there = with_term(experiment, placed)
    # The set point lies within this ride.
    z = at(there, {placed.strength.name: 4.0 * placed.strength.sd, f"{placed.label}_set_point": 43.0})
    late = piece.time > piece.time[0] + START_S
    lied = with_measured(there, np.where(late[:, None], piece.measured - 4.0, piece.measured))
    correct, deceived = (predict(given, 0, z) for given in (there, lied))
    np.testing.assert_array_equal(correct.read, deceived.read)
    again = predict(there, 0, z, guess=correct.trajectory.T + 5.0)
    temperatures = [i for i, channel in enumerate(piece.channels) if channel != "P_loss"]
    np.testing.assert_allclose(again.read[:, temperatures], correct.read[:, temperatures], atol=0.02)
    np.testing.assert_allclose(again.read, correct.read, rtol=1e-3)  # the loss, of which straight lines know 1e-4
    learnt = [given.point(0, z, rounds=6).trajectory.T for given in (there, lied)]
    moved = np.abs(learnt[0] - learnt[1]).max()
    assert moved == 0.0 if name == "oil_tank" else moved > 0.3


def test_a_cold_machine_is_warmer_as_a_whole(experiment: Experiment) -> None:
    """Parts that nothing measures begin with the others: at a guess 1.5 K too cold they follow what is measured."""
    cold = replace(experiment, starts=tuple(start - 1.5 for start in experiment.starts))
    found, right = (predict(one, 0, np.zeros(len(one.unknowns))).trajectory.T[0] for one in (cold, experiment))
    np.testing.assert_allclose(found, right, atol=0.3)


def test_a_start_that_leads_nowhere_is_not_taken(monkeypatch: pytest.MonkeyPatch, experiment: Experiment) -> None:
    guess, whole, tried = experiment.starts[0], len(experiment.pieces[0].steps), []

    def only_from_the_guess(model: NetworkOnGrid, piece: Piece, values: Array, start: Array, **given: Any) -> Any:
        if len(piece.steps) == whole:
            tried.append(float(np.abs(start - guess).max()))
            if tried[-1] > 0.0:
                raise ArithmeticError("run away")
        return simulate(model, piece, values, start, **given)

    measured = np.array(experiment.pieces[0].measured)
    measured[:20] += 3.0  # so that another start is asked for
    moved, z = with_measured(experiment, measured), np.zeros(len(experiment.unknowns))
    monkeypatch.setattr("diagnosis.engine.predict.simulate", only_from_the_guess)
    found = predict(moved, 0, z)
    assert len(tried) == 2 and tried[0] > 0.5
    np.testing.assert_array_equal(found.trajectory.T[0], guess)
    monkeypatch.setattr(
        "diagnosis.engine.predict.simulate", lambda *_, **__: (_ for _ in ()).throw(ArithmeticError("away"))
    )
    with pytest.raises(ArithmeticError, match="away"):
        predict(moved, 0, z)


@pytest.mark.parametrize(("shift_K", "own"), [(0.0, True), (-1.0, False)])
def test_a_fit_is_judged_by_its_nearer_course(
    fzg: Gearbox, piece: Piece, experiment: Experiment, shift_K: float, own: bool
) -> None:
    """With true readings noise makes a switch that follows them early or late; with biased ones its own course is."""
    (placed,) = CATALOGUE["cooler_thermostat"].placed(fzg.network(), Scale.of(fzg, speed=2600.0, torque=150.0))
    there = with_term(experiment, placed)
    found, nothing = (
        at(there, {placed.strength.name: strength * placed.strength.sd, f"{placed.label}_set_point": 43.0})
        for strength in (4.0, 0.0)
    )
    noise = 0.1 * np.random.default_rng(0).standard_normal(piece.measured.shape)
    temperatures = [channel != "P_loss" for channel in piece.channels]
    held_out = with_measured(there, predict(there, 0, found).read + shift_K * np.array(temperatures) + noise)
    fits = [held_out.fit(z, iterations=0) for z in (found, nothing)]
    runs = [[predict(held_out, 0, z)] for z in (found, nothing)]
    (run,) = runs[0]
    follows = held_out.linearise_piece(0, found, run.trajectory.T, rounds=ROUNDS)
    alone = follows.filter((held_out.pieces[0].measured - run.read)[:, :, None])[:, 0]
    norms = [float(innovations @ innovations) for innovations in (follows.residual, alone)]
    assert (norms[1] < 0.6 * norms[0]) if own else (norms[0] < 0.3 * norms[1])
    gain = log_score_gain(fits[0], fits[1], held_out, (runs[0], runs[1]))
    assert gain > 3000.0
    assert log_score_gain(fits[1], fits[0], held_out, (runs[1], runs[0])) == pytest.approx(-gain)
