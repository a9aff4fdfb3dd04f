"""An FMU that holds a correction, over the held-out recordings of the diagnosis that made the correction."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from builder.drive.driver import drive_fmu
from diagnosis.engine.predict import rmse
from diagnosis.forward.grid import stands_for
from diagnosis.forward.recorder import AS_RECORDED, simulated_as_recorded
from diagnosis.forward.sensor_fault import channel_column
from diagnosis.recordings.recording import Recording
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import MODELS
from models.base.types import Array
from models.correction.correction import Correction
from models.files.cycle import Cycle
from models.quantities.quantities import is_total_loss, node_of_channel

CLOCK = "_start"  # ending, after its label, of a dated term's parameter: start of a recording on the common time axis


def fmu_errors(
    fmu: Path, correction: Correction, diagnosis: Diagnosis, recordings: Sequence[Recording]
) -> dict[str, float]:
    """Root mean square of what was measured less what the FMU gives, by channel, [K] or [W].

    The FMU gets the inputs of the recordings as they probably were, starts with the temperatures of the diagnosis, and
    is read through the sensors of the recorder; the same rows count as in the report.

    Parameters
    ----------
    fmu : Path
        Built with the correction
    correction : Correction
    diagnosis : Diagnosis
    recordings : sequence of Recording
        Held out
    """
    runs = [run for run in diagnosis.courses if run.held_out]
    by_name = {recording.name: recording for recording in recordings}
    residuals, weights = [], []
    for run in runs:
        read = _read(fmu, correction, run, by_name[run.recording], diagnosis.starts_at.get(run.recording, 0.0))
        counts = run.time >= run.counts_from_s
        off = np.stack([run.measured[name] - values for name, values in read.items()], axis=-1)
        residuals.append(np.where(counts[:, None], off, np.nan))
        weights.append(stands_for(run.time))
    found = rmse(np.concatenate(residuals), np.concatenate(weights))
    return dict(zip(runs[0].measured, found.tolist(), strict=True))


def errors_of(diagnosis: Diagnosis, state: str) -> dict[str, float]:
    """Root mean square over the held-out recordings of ``before``, ``calibrated`` or ``after``, by channel."""
    which = tuple(MODELS).index(state)
    return {name: errors[which] for name, errors in diagnosis.holdout.sensors.items()}


def overall(errors: dict[str, float], without: Collection[str] = ()) -> float:
    """Root mean square over all temperatures but some, [K]."""
    counting = [value for name, value in errors.items() if not is_total_loss(name) and name not in without]
    return float(np.sqrt(np.nanmean(np.square(counting))))


def _read(
    fmu: Path, correction: Correction, run: PredictedRun, recording: Recording, starts_at: float
) -> dict[str, Array]:
    """Readings of the FMU by the sensors at the rows of a run, by channel."""
    begin = float(run.time[0])
    rows = (recording.time >= begin - 1e-6) & (recording.time <= run.time[-1] + 1e-6)
    cycle = Cycle(recording.time[rows] - begin, {name: values[rows] for name, values in recording.inputs.items()})
    own = _by_clock(correction, starts_at + begin)
    clocks = {p.name: p.value for f in own.findings if not f.of_measurement and f.kind != "sensor"
              for p in f.parameter if p.name == f.label + CLOCK}  # fmt: skip
    columns = simulated_as_recorded(
        cycle, own, lambda driven: drive_fmu(fmu, driven, initial=run.start, parameters=clocks)
    )
    nodes = list(run.start)
    result = {}
    for name in run.measured:
        true = channel_column(node_of_channel(name, nodes))
        values = columns.get(f"{channel_column(name)}{AS_RECORDED}", columns.get(true))
        assert values is not None  # noqa: S101 - a channel is at a node of the network
        result[name] = np.interp(run.time - begin, columns["time_s"], values)
    return result


def _by_clock(correction: Correction, starts_at: float) -> Correction:
    """The correction with the clocks of its dated findings at the start of a recording."""
    findings = tuple(
        finding.model_copy(update={"parameter": tuple(
            p.model_copy(update={"value": starts_at}) if p.name == finding.label + CLOCK else p
            for p in finding.parameter
        )})
        for finding in correction.findings
    )  # fmt: skip
    return correction.model_copy(update={"findings": findings})
