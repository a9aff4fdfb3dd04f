"""One recording as measured and as the models predict it, free-running."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from diagnosis.forward.sensor_fault import channel_column
from diagnosis.results.result_parts import MODELS
from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.files.cycle import Cycle
from models.quantities.part_colours import CALIBRATED, DELIVERED, MEASURED, part_colours
from models.quantities.quantities import is_total_loss

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PredictedRun:
    """One recording as measured and as simulated, free-running.

    Attributes
    ----------
    recording : str
    held_out : bool
    time : Array, shape (rows,)
        [s]
    inputs : mapping of str to Array, shape (rows,)
        By name in the network: speed [1/min], torque [N m], temperatures of the surroundings [degC] and others
    measured, before, calibrated, after : mapping of channel to Array, shape (rows,)
        [degC], or [W] for ``P_loss``; before: the model as delivered; calibrated: its parameters tuned inside their
        priors; after: corrected, with findings and what was learnt of model error
    counts_from_s : float
        Rows before it served to find the start temperatures and do not count
    start : mapping of node to float
        Temperatures of all nodes at the first row, corrected, [degC]
    """

    recording: str
    held_out: bool
    time: Array
    inputs: Mapping[str, Array]
    measured: Mapping[str, Array]
    before: Mapping[str, Array]
    calibrated: Mapping[str, Array]
    after: Mapping[str, Array]
    counts_from_s: float
    start: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        role = "held out" if self.held_out else "learnt from"
        return f"<PredictedRun {self.recording!r}, {role}: {len(self.time)} rows; {', '.join(self.measured)}>"

    def to_dataframe(self) -> pd.DataFrame:
        """Return time, inputs, and of every channel the measured and the predicted values.

        Columns are ``T_oil_degC`` for what was measured, ``T_oil_degC_before``, ``_calibrated`` and ``_after``.
        """
        columns = Cycle(self.time, self.inputs).columns()
        for channel, measured in self.measured.items():
            column = channel_column(channel)
            columns |= {column: measured, **{f"{column}_{model}": getattr(self, model)[channel] for model in MODELS}}
        return columns.to_dataframe()

    def plot(self, channel: str | None = None, *, ax: Axes | None = None) -> Axes:
        """Draw one channel as measured and as predicted.

        Parameters
        ----------
        channel : str or None
            By default the temperature that the model as delivered predicts worst
        ax : Axes or None
            By default new ones

        Raises
        ------
        InputError
            If it was not measured.
        """
        from models.columns.curves import LABELS, axes_or_new, time_scale  # imports matplotlib

        channel = channel or self._worst()
        if channel not in self.measured:
            raise InputError(f"{channel!r} was not measured in {self.recording}{did_you_mean(channel, self.measured)}")
        scale, unit = time_scale(self.time)
        colours = (DELIVERED, CALIBRATED, part_colours([channel])[channel])
        with axes_or_new(ax) as axes:
            axes.plot(self.time * scale, self.measured[channel], ".", markersize=2.0, color=MEASURED, label="measured")
            for (model, label), colour in zip(MODELS.items(), colours, strict=True):
                axes.plot(self.time * scale, getattr(self, model)[channel], color=colour, label=label)
            axes.set(title=f"{channel.replace('__', ', ').replace('_', ' ')}; {self.recording}",
                     xlabel=f"Time in {unit}",
                     ylabel=LABELS["losses" if is_total_loss(channel) else "temperatures"])  # fmt: skip
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return axes

    def _worst(self) -> str:
        """Return the temperature that the model as delivered predicts worst; the loss if there is no temperature."""
        temperatures = [c for c, seen in self.measured.items() if not is_total_loss(c) and np.isfinite(seen).any()]
        errors = {c: float(np.sqrt(np.nanmean((self.before[c] - self.measured[c]) ** 2))) for c in temperatures}
        return max(errors, key=lambda c: errors[c]) if errors else next(iter(self.measured))
