"""A machine in draughts, and a change of its cooling, which looks like a long one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from diagnosis.candidates.dated import changing, for_a_while, step
from diagnosis.candidates.factors import factors_of
from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.draughts import most_probable, worth_weighing
from diagnosis.decision.infer import infer
from diagnosis.decision.scanned import scan_at
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import Calibration, calibrate_in_draughts, calibrate_with_error
from diagnosis.engine.families import axis_of
from diagnosis.engine.fit import Experiment, calibrate
from diagnosis.engine.prepare import prepare_experiment
from models.assembly.gearbox import Gearbox
from models.mechanisms import Scale
from tests.unit.diagnosis.engine.test_calibration import shaken
from tests.unit.diagnosis.inference_example import acting, recorded, with_measured

CHANGE = {"strength": -0.3, "since": 7200.0, "within": 240.0, "start": 0.0}


def changes_of_cooling(fzg: Gearbox, experiment: Experiment) -> list[Hypothesis]:
    network, axis = experiment.machine.model.network, axis_of(experiment)
    (air,) = [one for one in factors_of(network, Scale.of(fzg), ()) if one.label == "air_cooling_housing_air"]
    return [changing(air, course, axis) for course in (step(axis), for_a_while(axis))]


def both(experiment: Experiment) -> tuple[Calibration, Calibration]:
    still = calibrate_with_error(experiment, calibrate(experiment))
    draughty = calibrate_in_draughts(still)
    assert draughty is not None
    return still, draughty


@pytest.fixture(scope="module")
def changed(fzg: Gearbox) -> tuple[Sequence[Hypothesis], Calibration, Calibration]:
    """In still air the housing gives less heat to it from 2 h on."""
    train = recorded(fzg, "train", hours=6.0)
    _, experiment = prepare_experiment(fzg, [train], [train])
    candidates = changes_of_cooling(fzg, experiment)
    rng = np.random.default_rng(3)
    made = acting(experiment, candidates[0].added, CHANGE)
    noisy = made.pieces[0].measured + 0.1 * rng.standard_normal(made.pieces[0].measured.shape)
    return candidates, *both(with_measured(made, noisy))


def test_draughts_are_no_change_of_the_cooling(fzg: Gearbox) -> None:
    experiment = shaken(fzg, times=0.0, draught=0.05)
    candidates, (still, draughty) = changes_of_cooling(fzg, experiment), both(experiment)
    scans = [(one, scan_at(one, candidates)) for one in (still, draughty)]
    assert worth_weighing(scans) == [scans[1]]
    rival = draughty.chosen.log_evidence
    weighed = [(one, infer(one, found, Settings(), rival=rival)) for one, found in scans]
    assert not any(posterior.detected for _, posterior in weighed)
    assert most_probable(weighed)[0] is draughty


def test_a_change_of_the_cooling_is_no_draught(
    changed: tuple[Sequence[Hypothesis], Calibration, Calibration],
) -> None:
    """Without it draughts are more probable than still air; the change in still air is more probable than both."""
    candidates, still, draughty = changed
    scans = [(one, scan_at(one, candidates)) for one in (still, draughty)]
    ahead = draughty.chosen.log_evidence - still.chosen.log_evidence
    assert ahead > 5.0 and worth_weighing(scans) == scans
    alone = infer(*scans[0], Settings())
    rival = draughty.chosen.log_evidence
    weighed = [(one, infer(one, found, Settings(), rival=rival)) for one, found in reversed(scans)]
    calibration, found = most_probable(weighed)
    assert calibration is still and found.detected and found.explanations[0].names == ("air_cooling",)
    assert found.assumed.draughts_ahead == pytest.approx(ahead, abs=0.5)
    # What counts is beyond the draughts.
    assert alone.log_e - found.log_e == pytest.approx(found.assumed.draughts_ahead, abs=0.5)
