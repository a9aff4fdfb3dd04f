"""Mean total loss where recordings measure none, as estimated and of the model that predicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.engine.fit import Fit
from diagnosis.engine.mean_loss import mean_loss, mean_loss_slopes
from diagnosis.engine.predict import Prediction
from diagnosis.engine.scale import all_sizes_are_unknown, is_of_temperatures
from models.correction.correction import FAR_SD


@dataclass(frozen=True, kw_only=True)
class MeanLoss:
    """Mean total loss over the tested recordings, which measure none: temperatures identify ratios of heats alone.

    Attributes
    ----------
    estimate_W, stderr_W : float
        With model error in place, so that the priors of heats, conductances and capacities have their say
    predicting_W : float
        Of the model that predicts: parameters may stand in for model error there
    delivered_W : float
        Of the machine as its definition has it
    """

    estimate_W: float
    stderr_W: float
    predicting_W: float
    delivered_W: float

    @property
    def is_far(self) -> bool:
        """True if the model that predicts is not to be asked for losses."""
        return self._is_far(self.predicting_W)

    @property
    def moved(self) -> bool:
        """True if the definition has another loss: one of both is wrong, or a heat capacity."""
        return self._is_far(self.delivered_W)

    def _is_far(self, other_W: float) -> bool:
        return abs(other_W - self.estimate_W) > FAR_SD * self.stderr_W


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
    experiment, network = believed.experiment, believed.experiment.machine.model.network
    if not is_of_temperatures(experiment) or all_sizes_are_unknown(network, experiment.unknowns):
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

    return MeanLoss(
        estimate_W=mean_loss(believed), stderr_W=float(np.sqrt(slopes @ believed.covariance @ slopes)),
        predicting_W=mean_over(run), delivered_W=mean_over(delivered),
    )  # fmt: skip
