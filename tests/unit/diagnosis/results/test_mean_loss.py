"""The mean loss of recordings that measure none, with its error."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.engine.fit import calibrate
from diagnosis.engine.mean_loss import mean_loss, mean_loss_slopes
from diagnosis.engine.predict import predict
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.results.mean_loss import mean_loss_of
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded
from tests.unit.diagnosis.results.assembled_example import Prepared


def test_mean_loss_of_temperatures_alone(fzg: Gearbox) -> None:
    """Its error is that of the loss factors; the true loss of a ride of the model itself lies within."""
    made = recorded(fzg, "made")
    fit = calibrate(prepare_experiment(fzg, [made], [made])[1])
    run = [predict(fit.experiment, index, fit.z) for index in range(len(fit.parts))]
    delivered = [predict(fit.experiment, index, None) for index in range(len(fit.parts))]
    found = mean_loss_of(fit, fit, run, delivered)
    assert found is not None and found.predicting_W == pytest.approx(found.estimate_W, rel=0.01)
    driven = fzg.network().simulate(made.cycle, losses=fzg.losses(), initial=22.0)
    true_W = float(np.mean(driven.columns()["P_loss_W"]))
    assert abs(found.estimate_W - true_W) < 2.0 * found.stderr_W < 0.3 * true_W
    assert found.delivered_W == pytest.approx(true_W, rel=0.02) and not found.moved
    assert found.by_weight_W == pytest.approx(true_W, rel=0.1)
    slopes = mean_loss_slopes(fit)
    of_fit = float(np.sqrt(slopes @ fit.covariance @ slopes))
    assert found.stderr_W > of_fit
    assert found.stderr_W == pytest.approx(np.hypot(of_fit, found.by_weight_W - found.estimate_W))
    names = [unknown.parameter.name for unknown in fit.experiment.unknowns]
    mesh, loss = names.index("mesh"), mean_loss(fit)
    moved = fit.z.copy()
    moved[mesh] += 1e-3
    there = fit.experiment.fit(moved, fit.trajectories, iterations=0)
    assert mean_loss(there) - loss == pytest.approx(1e-3 * mean_loss_slopes(fit)[mesh], rel=0.1)


def test_a_measured_loss_needs_no_estimate(prepared: Prepared) -> None:
    assert mean_loss_of(prepared[2], prepared[2], [], []) is None
