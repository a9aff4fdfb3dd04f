"""Mean total loss where recordings measure none, as estimated and of the model that predicts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.engine.fit import Fit
from diagnosis.engine.mean_loss import is_estimated, mean_loss, mean_loss_slopes
from diagnosis.engine.predict import Prediction
from models.correction.correction import MeanLoss


def mean_loss_of(
    believed: Fit, fit: Fit, run: Sequence[Prediction], delivered: Sequence[Prediction]
) -> MeanLoss | None:  # fmt: skip
    """Mean total loss as estimated, and of the model that predicts; None if one is measured or none can be known.

    Parameters
    ----------
    believed : Fit
        With model error in place
    fit : Fit
        Of the model that predicts
    run : sequence of Prediction
        Of the recordings that were learnt from, by that model
    delivered : sequence of Prediction
        Of the same recordings, by the machine as delivered
    """
    experiment = believed.experiment
    if not is_estimated(experiment):
        return None
    slopes = mean_loss_slopes(believed)
    is_loss = fit.experiment.machine.model.is_loss

    def mean_over(runs: Sequence[Prediction]) -> float:
        """Mean loss of a machine."""
        tested = [runs[index] for index in experiment.tested]
        heat = [one.trajectory.balance.sources for one in tested]
        # Further sources of the machine with findings come last.
        loss = np.concatenate([each[:, is_loss[: each.shape[1]]].sum(axis=-1) for each in heat])
        return float(np.average(loss, weights=np.concatenate([one.piece.steps for one in tested])))

    # Temperatures give heat over capacity, so that losses go with the sum of the capacities.
    model, values = believed.experiment.machine.model, believed.parts[0].point.setting.values
    weighs = float(model.capacities(values).sum() / model.capacities(model.start).sum())
    estimate = mean_loss(believed)
    by_weight = estimate / weighs
    # A prior that this machine violates draws all heats with it, by more than the curvature knows of.
    stderr = np.hypot(np.sqrt(slopes @ believed.covariance @ slopes), by_weight - estimate)
    return MeanLoss(
        estimate_W=estimate, stderr_W=float(stderr), predicting_W=mean_over(run), delivered_W=mean_over(delivered),
        by_weight_W=by_weight,
    )  # fmt: skip
