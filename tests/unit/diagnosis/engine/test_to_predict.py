"""What predicts is calibrated by the level of temperatures, with estimates of model error held where they can be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import hypothesis_of
from diagnosis.engine import to_predict
from diagnosis.engine.fit import Experiment, Fit, Guess, calibrate
from diagnosis.engine.mean_loss import mean_loss, mean_loss_slopes
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit
from diagnosis.engine.scan import scan
from diagnosis.engine.to_predict import calibrated_to_predict, loss_by_level, refit_to_predict
from diagnosis.forward.whitening import AS_ASSUMED
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.engine.test_set_apart import DATA
from tests.unit.diagnosis.inference_example import recorded, windage_ride


@pytest.fixture(scope="module")
def experiment(fzg: Gearbox) -> Experiment:
    """With a measured loss."""
    ride = recorded(fzg, "made")
    made = windage_ride(fzg, ride.time, ride.inputs["speed"], ride.inputs["torque"], windage_W=0.0, seed=0)
    return prepare_experiment(fzg, [made], [made])[1]


@pytest.fixture(scope="module")
def of_temperatures(fzg: Gearbox) -> Fit:
    made = recorded(fzg, "made")
    return calibrate(prepare_experiment(fzg, [made], [made])[1])


@pytest.fixture(scope="module")
def usual(experiment: Experiment) -> Fit:
    return calibrate(experiment)


@pytest.fixture(scope="module")
def with_windage(fzg: Gearbox) -> Fit:
    """200 W of windage in the oil that the model lacks, and a measured loss."""
    ride = recorded(fzg, "made")
    made = windage_ride(fzg, ride.time, ride.inputs["speed"], ride.inputs["torque"], windage_W=200.0, seed=0)
    return calibrate(prepare_experiment(fzg, [made], [made])[1])


@pytest.fixture(scope="module")
def of_instruments(experiment: Experiment) -> Array:
    """Places of sensors and inputs."""
    names = [unknown.parameter.name for unknown in experiment.unknowns]
    prefixes = ("bias_", "lag_", "loss_gain", "delay_", "torque_gain", "ambient_offset")
    return np.flatnonzero([name.startswith(prefixes) for name in names])


@pytest.fixture(scope="module")
def stuck(experiment: Experiment, usual: Fit, of_instruments: Array) -> Fit:
    """A calibration of which all but the instruments ended two standard deviations from the middles of the priors."""
    z = np.full(len(usual.z), 2.0)
    z[of_instruments] = usual.z[of_instruments]
    return experiment.fit(z, iterations=0)


def off_K(fit: Fit) -> float:
    """Root mean square by which the course misses the thermometers, [K]."""
    thermometers = [name != "P_loss" for name in fit.experiment.pieces[0].channels]
    residual = np.concatenate([part.point.residual[:, thermometers] for part in fit.parts])
    return float(np.sqrt(np.nanmean(np.square(residual))))


def test_instruments_stay_as_estimated_where_the_definition_fixes_sizes(
    experiment: Experiment, usual: Fit, of_instruments: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where other gains and offsets would be nearer: the machine has none of them."""
    assert len(of_instruments) == 2 * (len(experiment.pieces[0].channels) - 1) + 5
    z = usual.z.copy()
    z[of_instruments] += 1.0
    estimated = experiment.fit(z, iterations=0)
    found = calibrated_to_predict(usual, estimated)
    np.testing.assert_array_equal(found.z[of_instruments], z[of_instruments])

    monkeypatch.setattr(to_predict, "all_sizes_are_unknown", lambda *_: True)  # nothing tells instruments from machine
    free = calibrated_to_predict(usual, estimated)
    assert np.all(free.z[of_instruments] != z[of_instruments])
    assert off_K(free) < off_K(found)


def test_without_another_solution_the_first_calibration_predicts(
    usual: Fit, stuck: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> Experiment:
        raise ArithmeticError("the temperatures leave all bounds")

    monkeypatch.setattr(to_predict, "_by_level", none)
    assert calibrated_to_predict(usual, stuck) is usual
    with pytest.raises(ArithmeticError, match="no solution without model error"):
        refit_to_predict(stuck, usual)


def test_a_first_calibration_that_got_stuck_is_left(usual: Fit, stuck: Fit) -> None:
    assert off_K(stuck) > 1.0
    for first in (usual, stuck):
        found = calibrated_to_predict(first, stuck)
        assert off_K(found) < 0.15  # noise of the readings: 0.1 K
        assert found.experiment.random_heat == AS_ASSUMED
        assert found.experiment.noise == usual.experiment.noise


def test_the_level_is_met_where_random_heat_lets_it_go() -> None:
    """A turbine whose cooler and nacelle the definition lacks."""
    gearbox = load_gearbox("la_haute_borne")
    recordings = read_recordings([DATA / "la_haute_borne_R80721.csv.gz"], gearbox.network())
    plain = calibrate(prepare_experiment(gearbox, recordings, ())[1])
    assert off_K(calibrated_to_predict(plain, plain)) < 0.8 * off_K(plain)


def test_the_error_of_an_hour_is_estimated_wherever_it_begins(usual: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    found = calibrated_to_predict(usual, usual)
    for times in (0.5, 4.0):
        monkeypatch.setattr(to_predict, "FIRST_K", 0.1 * times)
        assert off_K(calibrated_to_predict(usual, usual)) == pytest.approx(off_K(found), rel=0.05)


def test_losses_stay_as_estimated_where_temperatures_allow_it(
    of_temperatures: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Temperatures alone hardly tell 10 % more of all losses from less cooling and less capacity."""
    names = [unknown.parameter.name for unknown in of_temperatures.experiment.unknowns]
    of_losses = [names.index(name) for name in ("mesh", "rolling", "churning", "seal", "bearing")]
    estimated = replace(of_temperatures, z=of_temperatures.z.copy())
    for index in of_losses:
        unknown = estimated.experiment.unknowns[index]
        estimated.z[index] = unknown.z_of(1.1 * unknown.value(float(of_temperatures.z[index])))
    estimated = estimated.experiment.fit(estimated.z, iterations=0)
    found = calibrated_to_predict(of_temperatures, estimated)
    np.testing.assert_array_equal(found.z[of_losses], estimated.z[of_losses])
    slopes = mean_loss_slopes(found)
    assert mean_loss(found) == pytest.approx(1.1 * mean_loss(of_temperatures), rel=0.02)
    assert set(np.flatnonzero(slopes).tolist()) >= set(of_losses) and slopes[names.index("h_air")] == 0.0
    assert found.z[names.index("h_air")] > of_temperatures.z[names.index("h_air")] + 0.1  # the rest follows

    by_level, held = to_predict._levelled, set(of_losses)
    for farther_K, stays in ((0.9, True), (1.1, False)):

        def levelled(
            free: Experiment, start: Array, guesses: Sequence[Guess], estimate: Array, places: list[int],
            more: float = farther_K * to_predict.NEARER_K,
        ) -> list[to_predict.Levelled]:  # fmt: skip
            return [
                replace(one, off_K=more if held <= set(places) else 0.0)
                for one in by_level(free, start, guesses, estimate, places)
            ]

        monkeypatch.setattr(to_predict, "_levelled", levelled)
        z = calibrated_to_predict(of_temperatures, estimated).z
        assert (tuple(z[of_losses]) == tuple(estimated.z[of_losses])) is stays


def test_numbers_of_a_finding_stay_unless_temperatures_need_others(fzg: Gearbox, with_windage: Fit) -> None:
    placed = CATALOGUE["windage"].placed(fzg.network(), Scale.of(fzg, speed=3300.0, torque=150.0))
    scanned = scan(with_windage, [hypothesis_of(next(one for one in placed if one.place == "oil"))])
    found = refit(with_windage, scanned.candidates[0], scanned.best[0], 180.0)
    numbers = slice(len(with_windage.z), None)
    assert found.experiment.unknowns[-1].value(float(found.z[-1])) > 0.0
    predicting = refit_to_predict(found, with_windage)
    np.testing.assert_array_equal(predicting.z[numbers], found.z[numbers])
    assert off_K(predicting) < 0.15

    wrong = found.z.copy()
    wrong[len(with_windage.z)] *= 10.0
    needed = refit_to_predict(found.experiment.fit(wrong, iterations=0), with_windage)
    assert needed.z[len(with_windage.z)] < 0.5 * wrong[len(with_windage.z)]


def test_a_held_out_loss_is_judged_no_finer_than_it_is_followed(with_windage: Fit) -> None:
    """An hour of it is one reading, 5 % off; thermometers stay as they are."""
    experiment = with_windage.experiment
    known, coarse = experiment.noise[0], loss_by_level(experiment).noise[0]
    (piece,) = experiment.pieces
    of_loss = piece.channels.index("P_loss")
    rows, hours = piece.counts[:, of_loss].sum(), piece.steps.sum() / 3600.0
    level = np.nanmean(piece.measured[:, of_loss])
    assert coarse.channel_sd[of_loss] == pytest.approx(0.05 * level * np.sqrt(rows / hours), rel=1e-6)
    assert coarse.channel_sd[of_loss] > 2.0 * known.channel_sd[of_loss]
    np.testing.assert_array_equal(np.delete(coarse.channel_sd, of_loss), np.delete(known.channel_sd, of_loss))
    np.testing.assert_array_equal(coarse.heat_sd, known.heat_sd)
