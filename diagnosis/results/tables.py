"""Tables and figures of a diagnosis, for a notebook."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from diagnosis.results.result_parts import Calibrated, Fits, PredictedRun, named
from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.columns.columns import Columns
from models.quantities.quantities import TOTAL_LOSS, column_of, column_of_input, is_total_loss

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from diagnosis.results.result import Diagnosis

Table = Literal["findings", "explanations", "calibration", "errors"]
MOST_BARS, LEAST_DRAWN = 10, 0.005
MODELS = ("before", "calibrated", "after")
LEGEND = {"before": "as delivered", "calibrated": "calibrated", "after": "corrected"}


def table_of(diagnosis: Diagnosis, what: Table) -> pd.DataFrame:
    """Return one table of a diagnosis; see :meth:`diagnosis.results.result.Diagnosis.to_dataframe`."""
    import pandas as pd

    if what not in get_args(Table):
        raise InputError(f"{what!r} is not a table of a diagnosis{did_you_mean(what, get_args(Table))}")
    if what == "findings":
        columns = ["mechanism", "place", "grade", "probability", "heat_mean_W", "parameter", "value", "stderr", "unit"]
        return pd.DataFrame(_finding_rows(diagnosis), columns=columns)
    if what == "explanations":
        rows = [(r.mechanism, r.place, r.family, r.log_bayes, r.probability) for r in diagnosis.ranking]
        return pd.DataFrame(rows, columns=["mechanism", "place", "family", "log_bayes_nat", "probability"])
    if what == "calibration":
        return pd.DataFrame(
            [asdict(one) for one in diagnosis.calibration], columns=[one.name for one in fields(Calibrated)]
        )
    errors = [*_error_rows("train", diagnosis.train), *_error_rows("holdout", diagnosis.holdout)]
    return pd.DataFrame(errors, columns=["recordings", "channel", "unit", *(f"rmse_{model}" for model in MODELS)])


def _finding_rows(diagnosis: Diagnosis) -> Iterator[tuple[Any, ...]]:
    for f in diagnosis.findings:
        for p in f.parameters:
            yield f.mechanism, f.place, f.grade, f.sureness, f.heat_mean_W, p.name, p.value, p.stderr, p.unit


def _error_rows(recordings: str, fits: Fits) -> Iterator[tuple[Any, ...]]:
    for channel, errors in fits.sensors.items():
        yield recordings, channel, "W" if is_total_loss(channel) else "K", *errors


def draw_explanations(diagnosis: Diagnosis, ax: Axes | None) -> Axes:
    """Draw the most probable explanations as bars; see :meth:`diagnosis.results.result.Diagnosis.plot`."""
    from models.columns.curves import PALETTE, axes_or_new  # imports matplotlib

    likely = [r for r in diagnosis.ranking if r.probability >= LEAST_DRAWN]
    shown = likely[:MOST_BARS][::-1]
    with axes_or_new(ax) as axes:
        names = [named(r.mechanism, r.place).replace("__", " ").replace("_", " ") for r in shown]
        axes.barh(names, [r.probability for r in shown], color=PALETTE[0])
        axes.set(xlabel="Probability", xlim=(0.0, 1.0))
    return axes


def run_columns(run: PredictedRun) -> Columns:
    """Return a predicted run as columns; see :meth:`diagnosis.results.result_parts.PredictedRun.to_dataframe`."""
    columns: dict[str, Array] = {"time_s": run.time}
    columns |= {column_of_input(name): values for name, values in run.inputs.items()}
    for channel in run.measured:
        column = column_of(TOTAL_LOSS if is_total_loss(channel) else f"T_{channel}")
        columns |= {column: run.measured[channel]}
        columns |= {f"{column}_{model}": getattr(run, model)[channel] for model in MODELS}
    return Columns(columns)


def draw_channel(run: PredictedRun, channel: str | None, ax: Axes | None) -> Axes:
    """Draw one channel; see :meth:`diagnosis.results.result_parts.PredictedRun.plot`."""
    from models.columns.curves import LABELS, axes_or_new, time_scale  # imports matplotlib
    from models.quantities.part_colours import CALIBRATED, DELIVERED, MEASURED, part_colours

    channel = channel or _worst(run)
    if channel not in run.measured:
        raise InputError(f"{channel!r} was not measured in {run.recording}{did_you_mean(channel, run.measured)}")
    scale, unit = time_scale(run.time)
    colours = {"before": DELIVERED, "calibrated": CALIBRATED, "after": part_colours([channel])[channel]}
    with axes_or_new(ax) as axes:
        axes.plot(run.time * scale, run.measured[channel], ".", markersize=2.0, color=MEASURED, label="measured")
        for model, colour in colours.items():
            axes.plot(run.time * scale, getattr(run, model)[channel], color=colour, label=LEGEND[model])
        axes.set(title=f"{channel.replace('__', ', ').replace('_', ' ')}; {run.recording}", xlabel=f"Time in {unit}",
                 ylabel=LABELS["losses" if is_total_loss(channel) else "temperatures"])  # fmt: skip
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return axes


def _worst(run: PredictedRun) -> str:
    """Return the temperature that the model as delivered predicts worst; the loss if there is no temperature."""
    temperatures = [c for c, seen in run.measured.items() if not is_total_loss(c) and np.isfinite(seen).any()]
    errors = {c: float(np.sqrt(np.nanmean((run.before[c] - run.measured[c]) ** 2))) for c in temperatures}
    return max(errors, key=lambda c: errors[c]) if errors else next(iter(run.measured))
