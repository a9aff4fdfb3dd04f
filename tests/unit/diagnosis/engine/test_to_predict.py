"""The nominal machine calibrated by noise alone does not stay where a first fit ended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.engine import to_predict
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.mean_loss import mean_loss, mean_loss_slopes
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.to_predict import FAR_OFF, MOST_LOSS, QUIET, calibrated_to_predict
from diagnosis.forward.whitening import AS_ASSUMED
from models.assembly.gearbox import Gearbox
from models.base.types import Array
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
def of_instruments(experiment: Experiment) -> Array:
    """Places of sensors and inputs."""
    names = [unknown.parameter.name for unknown in experiment.unknowns]
    prefixes = ("bias_", "lag_", "loss_gain", "delay_", "torque_gain", "ambient_offset")
    return np.flatnonzero([name.startswith(prefixes) for name in names])


@pytest.fixture(scope="module")
def stuck(experiment: Experiment, usual: Fit, of_instruments: Array) -> Fit:
    """A calibration of which all but the instruments ended two standard deviations from the middles of the priors."""
    return experiment.fit(_with(np.full(len(usual.z), 2.0), usual, of_instruments), iterations=0)


def test_instruments_stay_as_estimated_where_the_definition_fixes_sizes(
    experiment: Experiment, usual: Fit, of_instruments: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where other gains and offsets would be far more probable: the machine has none of them."""
    assert len(of_instruments) == 2 * (len(experiment.pieces[0].channels) - 1) + 5
    z = usual.z.copy()
    z[of_instruments] += 1.0
    estimated = experiment.fit(z, iterations=0)
    found = calibrated_to_predict(usual, estimated, usual.z)
    np.testing.assert_array_equal(found.z[of_instruments], z[of_instruments])
    assert found.log_evidence < usual.log_evidence - 10.0

    monkeypatch.setattr(to_predict, "all_sizes_are_unknown", lambda *_: True)  # nothing tells instruments from machine
    found = calibrated_to_predict(usual, estimated, usual.z)
    assert found.log_evidence > usual.log_evidence - 5.0
    assert np.all(found.z[of_instruments] != z[of_instruments])


def test_without_another_solution_the_first_calibration_predicts(
    usual: Fit, stuck: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> Fit:
        raise ArithmeticError("the temperatures leave all bounds")

    monkeypatch.setattr(to_predict, "calibrate", none)
    assert calibrated_to_predict(usual, stuck) is usual


def test_a_first_calibration_that_got_stuck_is_left(usual: Fit, stuck: Fit) -> None:
    assert stuck.log_evidence < usual.log_evidence - 100.0
    assert calibrated_to_predict(usual, stuck).log_evidence > usual.log_evidence - 5.0
    assert calibrated_to_predict(stuck, stuck).log_evidence > usual.log_evidence - 5.0


def test_less_random_heat_leads_out_and_errors_are_those_of_what_is_assumed(
    experiment: Experiment, usual: Fit, stuck: Fit, of_instruments: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[float] = []

    def only_if_quiet(one: Experiment, start: Array, guesses: object, held: list[int]) -> Fit:
        tried.append(one.random_heat.heat)
        return stuck if one.random_heat == AS_ASSUMED else calibrate(one, start, None, held)

    monkeypatch.setattr(to_predict, "calibrate", only_if_quiet)
    found = calibrated_to_predict(stuck, stuck)
    assert tried == [1.0, QUIET.heat]
    quiet = calibrate(experiment.with_random_heat(QUIET), _with(np.zeros(len(usual.z)), usual, of_instruments),
                      None, of_instruments.tolist())  # fmt: skip
    np.testing.assert_array_equal(found.z, quiet.z)
    assert found.experiment.random_heat == AS_ASSUMED
    assert np.all(np.diag(found.covariance) >= np.diag(quiet.covariance) - 1e-9)


def test_a_fit_that_misses_the_temperatures_by_far_is_not_chosen_however_probable(
    usual: Fit, stuck: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(to_predict, "calibrate", lambda *_: stuck)
    monkeypatch.setattr(to_predict, "all_sizes_are_unknown", lambda *_: True)
    for times, chosen in ((FAR_OFF - 0.1, usual), (FAR_OFF + 0.1, stuck)):
        off_K = {tuple(usual.z): times, tuple(stuck.z): 1.0}
        monkeypatch.setattr(to_predict, "_off_by", lambda one, off_K=off_K: off_K[tuple(one.z)])
        np.testing.assert_array_equal(calibrated_to_predict(usual, stuck).z, chosen.z)


def test_a_course_that_has_not_settled_does_not_count(usual: Fit, stuck: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    farther = np.full(len(stuck.z), 3.0)
    unsettled = Fit(experiment=usual.experiment, z=farther, linearised=usual.linearised)
    assert unsettled.log_evidence > stuck.log_evidence
    monkeypatch.setattr(to_predict, "calibrate", lambda *_: stuck)
    monkeypatch.setattr(to_predict, "all_sizes_are_unknown", lambda *_: True)
    np.testing.assert_array_equal(calibrated_to_predict(unsettled, stuck).z, stuck.z)


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

    held = tuple(estimated.z[of_losses])
    off_K = to_predict.LOSSES_K + 0.01
    monkeypatch.setattr(to_predict, "_off_by", lambda one: off_K if tuple(one.z[of_losses]) == held else 0.0)
    assert tuple(calibrated_to_predict(of_temperatures, estimated).z[of_losses]) != held
    for times, off_K, stays in ((1.2, 1.1, True), (1.2, 1.3, False), (1.0, 1.1, False)):
        losses = {True: 100.0, False: 2.0 * times * MOST_LOSS * 100.0}  # twice too far, and somewhat more
        monkeypatch.setattr(to_predict, "mean_loss", lambda one, of=losses: of[tuple(one.z[of_losses]) == held])
        errors = {True: 2.0 * off_K + to_predict.LOSSES_K, False: 1.0}
        monkeypatch.setattr(to_predict, "_off_by", lambda one, of=errors: of[tuple(one.z[of_losses]) == held])
        assert (tuple(calibrated_to_predict(of_temperatures, estimated).z[of_losses]) == held) is stays


def test_less_random_heat_counts_only_where_temperatures_come_clearly_nearer(
    experiment: Experiment, usual: Fit, of_instruments: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = _with(np.zeros(len(usual.z)), usual, of_instruments)
    quiet = calibrate(experiment.with_random_heat(QUIET), start, None, of_instruments.tolist())
    assert tuple(quiet.z) != tuple(usual.z)
    for nearer_K, chosen in ((to_predict.NEARER_K - 0.01, usual), (to_predict.NEARER_K + 0.01, quiet)):
        monkeypatch.setattr(to_predict, "_off_by", lambda one, d=nearer_K: d * (tuple(one.z) != tuple(quiet.z)))
        np.testing.assert_allclose(calibrated_to_predict(usual, usual).z, chosen.z, atol=0.05)


def _with(z: Array, fit: Fit, places: Array) -> Array:
    """Unknowns, some of them as in a fit."""
    found = z.copy()
    found[places] = fit.z[places]
    return found
