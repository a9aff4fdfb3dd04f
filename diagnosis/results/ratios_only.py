"""A note where recordings identify ratios only, so that every watt in the result rests on the priors.

Whether it is so is asked of the fit: the information that the recordings have along the common factor of all sizes is
compared with what they have on the sizes one by one.
"""

from __future__ import annotations

import numpy as np

from diagnosis.engine.fit import Fit
from diagnosis.engine.scale import scale_direction

LITTLE = 0.01  # of what the recordings know about the sizes one by one: a small part of fixed capacity pretends so much


def ratio_notes(fit: Fit) -> tuple[str, ...]:
    """One sentence if the recordings identify ratios only; nothing if they identify sizes."""
    direction = scale_direction(fit.experiment.machine.model.network, fit.experiment.unknowns)
    each = np.concatenate([part.columns for part in fit.parts]) * direction
    together, alone = each.sum(axis=1), np.square(each).sum(axis=0)[direction != 0.0]
    if not len(alone) or float(together @ together) > LITTLE * float(alone.sum()):
        return ()
    sd = 1.0 / np.sqrt(float(direction @ direction))
    text = (
        "only ratios are identified: all heats, conductances and heat capacities together may be larger or smaller by "
        f"one factor without any change of a temperature. That factor rests on the definition's priors (a factor of "
        f"{np.exp(sd):.2f} either way, one standard deviation), and so does every number in W, W/K or J/K; measure the "
        "loss, or one heat flow, to fix it"
    )
    return (text,)
