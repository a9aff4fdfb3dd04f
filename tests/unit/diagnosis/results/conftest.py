"""A machine with windage in its oil, calibrated without it, from which results are assembled."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from diagnosis.decision.answer import Answer
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.calibration import Calibration, NearReadings
from diagnosis.engine.fit import calibrate
from diagnosis.engine.learnt import error_classes
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit
from diagnosis.engine.to_predict import calibrated_to_predict
from diagnosis.recordings.recording import Recording
from diagnosis.results.assemble import assemble
from diagnosis.results.result import Diagnosis
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import windage_ride
from tests.unit.diagnosis.results.assembled_example import WINDAGE_W, Assemble, Prepared, effect_of


@pytest.fixture(scope="session")
def recordings(fzg: Gearbox) -> tuple[Recording, Recording]:
    """Two rides of 2 h of the model with windage in the oil: to learn from, and held out."""

    def ride(levels: tuple[float, float], seed: int) -> Recording:
        time = np.arange(0.0, 7200.0, 10.0)
        speed = np.interp(time, [600, 660, 3600, 3660], [900, levels[0], levels[0], levels[1]])
        torque = np.interp(time, [2400, 2410, 5400, 5410], [60.0, 150.0, 150.0, 90.0])
        return windage_ride(fzg, time, speed, torque, windage_W=WINDAGE_W, seed=seed)

    learnt = replace(ride((2600.0, 3300.0), 0), start=datetime(2020, 1, 1, 8, tzinfo=UTC))
    return learnt, replace(ride((3300.0, 1500.0), 1), name="judged")


@pytest.fixture(scope="session")
def prepared(fzg: Gearbox, recordings: tuple[Recording, Recording]) -> Prepared:
    setup, experiment = prepare_experiment(fzg, [recordings[0]], [recordings[1]])
    return setup, experiment, calibrate(experiment)


@pytest.fixture(scope="session")
def windage(prepared: Prepared) -> Judged:
    setup, _, plain = prepared
    effect = effect_of(setup, plain, "windage", "oil")
    fit = refit(plain, effect, 0, 50.0)
    return Judged(effects=(effect,), log_bayes=90.0, fit=fit, error_class=error_classes()[0])


@pytest.fixture(scope="session")
def calibration(prepared: Prepared) -> Calibration:
    _, experiment, plain = prepared
    near = NearReadings.of(experiment, ModelError.of(experiment), plain)
    evidence = {one.name: near.log_evidence(one, plain.z) for one in error_classes()}
    return Calibration(chosen=near.fitted(error_classes()[0], plain, iterations=0), evidence=evidence, near=near)


@pytest.fixture(scope="session")
def assembled(prepared: Prepared, calibration: Calibration) -> Assemble:
    setup, experiment, plain = prepared
    predicting = calibrated_to_predict(plain, plain)

    def result(posterior: Posterior, answers: list[Answer], **given: Any) -> Diagnosis:
        return assemble(
            setup, given.pop("experiment", experiment), posterior, answers,
            plain=given.pop("plain", predicting),
            calibration=calibration, **given,
        )  # fmt: skip

    return result
