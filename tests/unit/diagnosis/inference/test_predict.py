"""Free runs from a start that the first readings give."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from diagnosis.inference.posterior import Problem
from diagnosis.inference.predict import START_S, predict
from diagnosis.inference.unknowns import unknowns_of

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.trajectory import complete_start, simulate
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import CHANNELS


@pytest.mark.parametrize("tank_degC", [27.0, 62.0])
def test_how_warm_a_tank_was_at_the_start_is_told_by_the_first_minutes(
    fzg: Gearbox, piece: Piece, problem: Problem, tank_degC: float
) -> None:
    """A recording that begins hot: oil in the tank may have been left cold, or have gone along."""
    network = fzg.network()
    (placed,) = CATALOGUE["oil_tank"].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    assert complete_start(model, np.zeros(model.n))[-1] == pytest.approx(27.0, abs=3.0)  # as declared: like the air
    unknowns = unknowns_of(model.network, CHANNELS)
    z, targets = np.zeros(len(unknowns)), [item.target for item in unknowns.items]
    for name, value in (("strength", 4.0), ("lag", 900.0)):
        index = targets.index(f"oil_tank_oil_{name}")
        z[index] = unknowns.items[index].z(value)
    start = np.append(np.full(model.n, 62.0), tank_degC)
    values = unknowns.network_values(model.network, z)
    truth = simulate(model, piece, values, start, rounds=20, settled_K=1e-4)
    sensors = unknowns.sensors(piece.channels, z)
    recorded = replace(piece, measured=readings(model, truth, sensors))
    hot = problem.changed(model=model, unknowns=unknowns, pieces=[recorded], starts=[np.full(model.n, 62.0)])
    found = predict(hot, 0, z)
    late = piece.time > found.counts_from
    assert np.abs(found.trajectory.T - truth.T)[late].max() < 0.3
    declared = simulate(model, piece, values, np.full(model.n, 62.0), rounds=20, settled_K=1e-4)
    assert (np.abs(declared.T - truth.T).max() > 3.0) == (tank_degC > 40.0)  # as it was taken before


@pytest.mark.parametrize("name", ["cooler_thermostat", "oil_tank"])
def test_prediction_does_not_see_what_was_measured_later(
    fzg: Gearbox, piece: Piece, problem: Problem, name: str
) -> None:
    """A switch follows readings in learning. A tank never does: it would draw the simulation to what was measured."""
    network = fzg.network()
    (placed,) = CATALOGUE[name].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    unknowns = unknowns_of(model.network, CHANNELS)
    index = {item.target: i for i, item in enumerate(unknowns.items)}
    z = np.zeros(len(unknowns))
    z[index[placed.strength.name]] = unknowns.items[index[placed.strength.name]].z(4.0)
    if name == "cooler_thermostat":
        set_point = next(p.name for p in placed.parameters if p.name.endswith("set_point"))
        z[index[set_point]] = unknowns.items[index[set_point]].z(43.0)  # switches within this ride
    late = piece.time > piece.time[0] + START_S
    lied = replace(piece, measured=np.where(late[:, None], piece.measured - 4.0, piece.measured))
    correct, deceived = (
        predict(problem.changed(model=model, unknowns=unknowns, pieces=[given]), 0, z) for given in (piece, lied)
    )
    np.testing.assert_array_equal(correct.read, deceived.read)
    again = predict(problem.changed(model=model, unknowns=unknowns), 0, z, guess=correct.trajectory.T + 5.0)
    temperatures = [i for i, channel in enumerate(piece.channels) if channel != "P_loss"]
    np.testing.assert_allclose(again.read[:, temperatures], correct.read[:, temperatures], atol=0.02)
    np.testing.assert_allclose(again.read, correct.read, rtol=1e-3)  # the loss, of which straight lines know 1e-4
    learnt = [
        problem.changed(model=model, unknowns=unknowns, pieces=[given]).linearise(0, z, None, rounds=6).trajectory.T
        for given in (piece, lied)
    ]
    moved = np.abs(learnt[0] - learnt[1]).max()
    assert moved == 0.0 if name == "oil_tank" else moved > 0.3


def test_a_start_that_leads_nowhere_is_not_taken(monkeypatch: pytest.MonkeyPatch, problem: Problem) -> None:
    guess, whole, tried = problem.starts[0], len(problem.pieces[0].steps), []

    def only_from_the_guess(model: NetworkOnGrid, piece: Piece, values: Array, start: Array, **given: Any) -> Any:
        if len(piece.steps) == whole:
            tried.append(float(np.abs(start - guess).max()))
            if tried[-1] > 0.0:
                raise ArithmeticError("run away")
        return simulate(model, piece, values, start, **given)

    measured = np.array(problem.pieces[0].measured)
    measured[:20] += 3.0  # so that another start is asked for
    moved = problem.changed(pieces=[replace(problem.pieces[0], measured=measured)])
    monkeypatch.setattr("diagnosis.inference.predict.simulate", only_from_the_guess)
    found = predict(moved, 0, np.zeros(len(problem.unknowns)))
    assert len(tried) == 2 and tried[0] > 0.5
    np.testing.assert_array_equal(found.trajectory.T[0], guess)
    monkeypatch.setattr(
        "diagnosis.inference.predict.simulate", lambda *_, **__: (_ for _ in ()).throw(ArithmeticError("away"))
    )
    with pytest.raises(ArithmeticError, match="away"):
        predict(moved, 0, np.zeros(len(problem.unknowns)))
