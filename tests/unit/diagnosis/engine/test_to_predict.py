"""The nominal machine calibrated by noise alone does not stay where a first fit ended."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.engine import to_predict
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.to_predict import FAR_OFF, QUIET, calibrated_to_predict
from diagnosis.forward.whitening import AS_ASSUMED
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from tests.unit.diagnosis.inference_example import recorded


@pytest.fixture(scope="module")
def experiment(fzg: Gearbox) -> Experiment:
    made = recorded(fzg, "made")
    return prepare_experiment(fzg, [made], [made])[1]


@pytest.fixture(scope="module")
def stuck(experiment: Experiment) -> Fit:
    """A calibration that ended two standard deviations from the middles of the priors."""
    return experiment.fit(np.full(len(experiment.unknowns), 2.0), iterations=0)


def test_a_first_calibration_that_got_stuck_is_left(experiment: Experiment, stuck: Fit) -> None:
    usual = calibrate(experiment)
    assert stuck.log_evidence < usual.log_evidence - 100.0
    assert calibrated_to_predict(usual, stuck).log_evidence > usual.log_evidence - 5.0
    assert calibrated_to_predict(stuck, stuck).log_evidence > usual.log_evidence - 5.0


def test_less_random_heat_leads_out_and_errors_are_those_of_what_is_assumed(
    experiment: Experiment, stuck: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[float] = []

    def only_if_quiet(one: Experiment, start: Array | None, guesses: object) -> Fit:
        tried.append(one.random_heat.heat)
        return stuck if one.random_heat == AS_ASSUMED else calibrate(one, start)

    monkeypatch.setattr(to_predict, "calibrate", only_if_quiet)
    found = calibrated_to_predict(stuck, stuck)
    assert tried == [1.0, QUIET.heat]
    quiet = calibrate(experiment.with_random_heat(QUIET))
    np.testing.assert_array_equal(found.z, quiet.z)
    assert found.experiment.random_heat == AS_ASSUMED
    assert np.all(np.diag(found.covariance) >= np.diag(quiet.covariance) - 1e-9)


def test_a_fit_that_misses_the_temperatures_by_far_is_not_chosen_however_probable(
    experiment: Experiment, stuck: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = calibrate(experiment)
    monkeypatch.setattr(to_predict, "calibrate", lambda *_: stuck)
    for times, chosen in ((FAR_OFF - 0.1, usual), (FAR_OFF + 0.1, stuck)):
        off_K = {tuple(usual.z): times, tuple(stuck.z): 1.0}
        monkeypatch.setattr(to_predict, "_off_by", lambda one, off_K=off_K: off_K[tuple(one.z)])
        np.testing.assert_array_equal(calibrated_to_predict(usual, stuck).z, chosen.z)


def test_a_course_that_has_not_settled_does_not_count(
    experiment: Experiment, stuck: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = calibrate(experiment)
    farther = np.full(len(stuck.z), 3.0)
    unsettled = Fit(experiment=usual.experiment, z=farther, linearised=usual.linearised)
    assert unsettled.log_evidence > stuck.log_evidence
    monkeypatch.setattr(to_predict, "calibrate", lambda *_: stuck)
    np.testing.assert_array_equal(calibrated_to_predict(unsettled, stuck).z, stuck.z)
