"""The fit: what it leaves, bounds, bad starts, and derivatives through faults of sensors and inputs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import hypothesis_of
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.refit import with_candidate
from diagnosis.engine.unknown import NetworkParameter
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import CHANNELS, at, with_measured


@pytest.fixture(scope="module")
def fit(experiment: Experiment) -> Fit:
    return experiment.fit()


def test_readings_of_the_model_itself_leave_nothing(fit: Fit) -> None:
    assert np.abs(fit.z).max() < 1.6  # the sensors' lag of 15 s is not in the data
    assert np.nanmax(np.abs(fit.parts[0].point.residual[5:, :3])) < 0.15


def test_without_derivatives_there_is_no_fit(monkeypatch: pytest.MonkeyPatch, experiment: Experiment) -> None:
    monkeypatch.setattr(Experiment, "columns", lambda self, *_: np.full((2, 2, len(self.unknowns)), np.nan))
    with pytest.raises(ArithmeticError, match="no derivative"):
        experiment.linearise_piece(0, np.zeros(len(experiment.unknowns)), None)
    with pytest.raises(ArithmeticError, match="no solution where the fit should start"):
        experiment.fit()


def test_a_number_at_its_bound_leaves_it_when_the_data_want_it(experiment: Experiment, fit: Fit) -> None:
    """Held at a bound it must neither wander beyond, where its value no longer changes, nor stay there for ever."""
    index = [u.parameter.name for u in experiment.unknowns].index("mesh")
    mesh = experiment.unknowns[index]
    narrow = NetworkParameter(parameter=replace(mesh.parameter, upper=mesh.value(2.0)))
    bounded = replace(experiment, unknowns=(*experiment.unknowns[:index], narrow, *experiment.unknowns[index + 1 :]))
    z = 12.0 * np.eye(len(fit.z))[index]
    held, free = bounded.fit(z), experiment.fit(fit.z)
    for _ in range(5):  # a fit ends where a step gains less than 0.02; again from there, until nothing moves
        held, free = bounded.fit(held.z), experiment.fit(free.z)
    np.testing.assert_allclose(held.z, free.z, atol=0.05)  # to which a fit is settled
    assert held.log_evidence == pytest.approx(free.log_evidence, abs=0.1)
    # Readings that want still more of it: it ends at the bound, and everything else settles.
    hot = experiment.point(0, 6.0 * np.eye(len(fit.z))[index]).read
    wanting = with_measured(bounded, hot)
    pushed = wanting.fit(iterations=20)
    for _ in range(2):  # the noise filters follow
        pushed = wanting.with_filters(pushed.parts).fit(pushed.z, iterations=20)
    assert pushed.z[index] == pytest.approx(2.0)
    again = pushed.experiment.fit(pushed.z, at=pushed.linearised)
    assert pushed.objective - again.objective < 0.2  # everything else has settled with it


def test_a_fit_leaves_a_start_that_only_looks_good(
    monkeypatch: pytest.MonkeyPatch, experiment: Experiment, fit: Fit
) -> None:
    """A trajectory that had not settled made the first objective too small; measured by that, no step is any better."""
    judged = experiment.with_filters(fit.parts)
    expected = judged.fit()
    honest, calls = Experiment._attempt, 0

    def attempt(self: Experiment, z: Array, *given: Any) -> Any:
        nonlocal calls
        calls += 1
        found = honest(self, z, *given)
        if calls > 1 or found is None:
            return found
        products = np.array(found.products)
        products[0, 0] *= 1e-4
        return replace(found, products=products)

    monkeypatch.setattr(Experiment, "_attempt", attempt)
    found = judged.fit()
    assert np.abs(expected.z).max() > 0.5
    np.testing.assert_allclose(found.z, expected.z, atol=0.1)


def test_an_input_that_follows_a_temperature_is_seen_alike_from_temperatures_alone(
    fzg: Gearbox, experiment: Experiment, fit: Fit
) -> None:
    (warmed, *_) = CATALOGUE["ambient_probe_heated"].placed(fzg.network(), Scale.of(fzg), CHANNELS)
    shifted, _ = with_candidate(fit, hypothesis_of(warmed), 0)
    z = at(shifted, {warmed.strength.name: -0.1})
    once = shifted.point(0, z, rounds=8).trajectory
    for _ in range(4):
        once = shifted.point(0, z, once, rounds=8).trajectory
    known, guided = (shifted.point(0, z, guess, rounds=8) for guess in (once, once.T))
    ambient = experiment.machine.inputs.index("T_ambient")
    moved = [point.trajectory.piece.samples[..., ambient] - experiment.pieces[0].samples[..., ambient]
             for point in (known, guided)]  # fmt: skip
    assert np.abs(moved[0]).max() > 1.0
    np.testing.assert_allclose(moved[1], moved[0], atol=0.02)
    np.testing.assert_allclose(guided.residual, known.residual, atol=0.02)


@pytest.mark.parametrize("name", ["clock_offset", "sensor_lag", "swapped_channels", "sensor_stuck"])
def test_faulty_sensors_show_every_change_as_they_show_the_truth(
    fzg: Gearbox, experiment: Experiment, fit: Fit, name: str
) -> None:
    """Derivatives go through the fault as well: by a clock an hour late everything comes an hour late."""
    term = CATALOGUE[name].placed(experiment.machine.model.network, Scale.of(fzg), CHANNELS)[0]
    size = {"clock_offset": 700.0, "sensor_lag": 300.0, "swapped_channels": 0.6, "sensor_stuck": 0.7}[name]
    faulty, _ = with_candidate(fit, hypothesis_of(term), 0)
    own = {p.name: p.grid[0] if p.grid else p.start for p in term.parameters} | {term.strength.name: size}
    z = at(faulty, own)
    index = [u.parameter.name for u in faulty.unknowns].index("mesh")
    point = faulty.point(0, z)
    step = 0.05 * np.eye(len(z))[index]
    reads = [faulty.point(0, z + way * step, point.trajectory).read for way in (-1.0, 1.0)]
    difference = (reads[1] - reads[0]) / 0.1
    largest = np.abs(difference).max(axis=0)
    column = faulty.columns(point, z)[:, :, index]
    np.testing.assert_allclose(column / largest, difference / largest, atol=0.03)
