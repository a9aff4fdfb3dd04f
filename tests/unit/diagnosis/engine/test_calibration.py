"""Calibration with model error: it stays near the readings, settles, and has every class at hand."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.engine.calibration import WIDEST_CLASS, Calibration, Near, calibrate_with_error
from diagnosis.engine.fit import calibrate
from diagnosis.engine.learnt import error_classes
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.sessions import fit_over_sessions
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded

WIDEST = next(one for one in error_classes() if one.name == WIDEST_CLASS)


@pytest.fixture(scope="module")
def found(fzg: Gearbox) -> Calibration:
    """A machine whose losses have another law than the model's."""
    train = recorded(fzg, "train", windage_W=150.0, hours=3.0, factors={"h_air": 1.6, "mesh": 0.8})
    _, experiment = prepare_experiment(fzg, [train], [train])
    return calibrate_with_error(experiment, calibrate(experiment))


def test_model_error_brings_the_simulation_to_the_readings(found: Calibration) -> None:
    """Alone, a linear model error leaves the simulation kelvins beside them."""
    there = found.near.fitted(WIDEST, found.fit)
    for part in there.fit.parts:
        assert part.point.trajectory.piece.error is not None
        with_error, without = (np.nanstd(r[5:]) for r in (part.point.residual, part.point.residual_without_error))
        assert without > 1.0 and with_error < 0.2 * without


def test_it_has_settled(found: Calibration) -> None:
    chosen = found.chosen
    near = Near.of(chosen.fit.experiment, found.near.error, chosen.fit)
    again = near.fitted(chosen.error_class, chosen.fit, chosen.deviation)
    assert np.abs(again.fit.z - chosen.fit.z).max() < 0.1
    assert again.log_evidence == pytest.approx(chosen.log_evidence, abs=0.5)


def test_the_most_probable_class_is_chosen(found: Calibration) -> None:
    assert found.evidence[found.chosen.error_class.name] == 0.0 == max(found.evidence.values())
    assert set(found.evidence) == {one.name for one in error_classes()}
    at = {one.name: found.near.log_evidence(one, found.fit.z) for one in error_classes()}
    assert max(at, key=lambda name: at[name]) == found.chosen.error_class.name


def test_another_class_starts_at_the_same_point(found: Calibration) -> None:
    there = found.in_class(WIDEST)
    assert there is found.in_class(WIDEST) and there.error_class == WIDEST
    np.testing.assert_array_equal(there.fit.z, found.fit.z)
    expected = found.near.log_evidence(WIDEST, found.fit.z)
    assert there.log_evidence == pytest.approx(expected, abs=0.5)
    assert fit_over_sessions(there.fit, len(there.fit.z)).log_evidence == pytest.approx(
        there.log_evidence - np.log(WIDEST.prior)
    )
