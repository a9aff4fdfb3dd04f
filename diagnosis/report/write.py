"""The files of a diagnosis: report, numbers, corrections, posterior, and one prediction per recording."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from diagnosis.candidates.factors import SHAPE as SHAPE_PREFIX
from diagnosis.forward.sensor_fault import channel_column
from diagnosis.recordings.recording import Recording
from diagnosis.results.result import Diagnosis
from models.assembly.gearbox import Gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.correction.correction import MODEL_ERROR, SHAPE, Correction, Estimate, Finding, write_correction
from models.files.output_files import refuse_to_replace
from models.terms.term import Term

UNNAMED, IMPROVES = "without a name", "It improves the prediction; what it is, the data do not say."
REPORT, NUMBERS, CORRECTION, ALONE, POSTERIOR = (
    "report.html", "diagnosis.json", "correction.toml", "calibrated.toml", "posterior.npz"
)  # fmt: skip


def names_of_files(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Names of the files of a diagnosis, the report first."""
    return REPORT, NUMBERS, CORRECTION, ALONE, POSTERIOR, *(f"{recording.name}.csv" for recording in recordings)


def files_left_over(folder: Path, recordings: Sequence[Recording], given: Iterable[Path]) -> list[Path]:
    """Files of an earlier diagnosis in a folder that a diagnosis of these recordings will not replace.

    Parameters
    ----------
    given : iterable of Path
        Files that are read

    Raises
    ------
    InputError
        If the diagnosis would replace a file that is read, or one that no diagnosis wrote.
    """
    given, names, earlier = list(given), names_of_files(recordings), _written_earlier(folder)
    refuse_to_replace(given, [folder / name for name in names])
    others = [folder / name for name in sorted({*names} - earlier) if (folder / name).exists()]
    if others:
        raise InputError(
            "\n".join(f"{file}: exists, and no diagnosis wrote it; choose another --output" for file in others)
        )
    return [folder / name for name in sorted(earlier.difference(names)) if folder / name not in given]


def _written_earlier(folder: Path) -> frozenset[str]:
    """Names of the files that an earlier diagnosis wrote into a folder."""
    try:
        inputs = json.loads((folder / NUMBERS).read_text(encoding="utf-8"))["inputs"]
        names = [f"{name}.csv" for name in (*inputs["recordings"], *inputs["held_out"])]
    except (OSError, ValueError, LookupError, TypeError):
        return frozenset()  # no diagnosis, or not one of ours
    return frozenset({*names_of_files(()), *names})


def correction_of(diagnosis: Diagnosis, gearbox: Gearbox) -> Correction:
    """A diagnosis as a correction of the definition: the model that predicts, and how it was recorded.

    Parameters
    ----------
    gearbox : Gearbox
        As its definition has it
    """
    nominal = {p.name: p for p in gearbox.network().parameters}
    calibrated = {c.parameter: c for c in diagnosis.calibration}
    estimates = {name: (c.value, c.stderr) for name, c in calibrated.items()}
    findings = [finding.with_estimates(estimates) for finding in diagnosis.known.findings]
    findings += [_finding_of(term, diagnosis) for term in diagnosis.terms]
    for term in diagnosis.shapes:
        name = term.strength.name
        if name in calibrated:
            findings.append(Finding.of(
                term, {name: estimates[name]}, mechanism=SHAPE, family="calibration",
                place=name.removeprefix(SHAPE_PREFIX), says=term.strength.description, grade="learnt",
            ))  # fmt: skip
    findings += [
        Finding.of(term, {term.strength.name: (term.strength.start, term.strength.sd)}, mechanism=MODEL_ERROR,
                   grade="learnt")
        for term in diagnosis.learnt
    ]  # fmt: skip
    return Correction.of(
        gearbox,
        findings=findings,
        calibration=(
            Estimate(name=c.parameter, value=c.value, stderr=c.stderr, unit=nominal[c.parameter].unit, prior=c.prior)
            for c in diagnosis.calibration
            if c.parameter in nominal
        ),
        sensors=diagnosis.model.sensors,
        inputs=diagnosis.model.true_inputs,
        recordings=dict(diagnosis.inputs["recordings"]),
        version=str(diagnosis.inputs["version"]),
        mean_loss=diagnosis.model.mean_loss,
    )


def _finding_of(term: Term, diagnosis: Diagnosis) -> Finding:
    """A term of the predicting model: its finding, or a note that its name is not certain enough for one."""
    estimates = {p.name: (p.start, p.sd) for p in term.parameters}
    found = next((f for f in diagnosis.findings if f.term is not None and f.term.label == term.label), None)
    if found is None:
        return Finding.of(term, estimates, mechanism=UNNAMED, place=" ".join(term.target), says=IMPROVES,
                          grade="learnt")  # fmt: skip
    return Finding.of(
        term, estimates, mechanism=found.mechanism, family=found.family, place=found.place, says=found.says,
        probability=found.probability, grade=found.grade,
    )  # fmt: skip


def prediction_table(diagnosis: Diagnosis, recording: Recording) -> pd.DataFrame:
    """Free-running prediction at the rows of a recording: what each sensor would read, and every other node."""
    courses = [c for c in diagnosis.courses if c.recording == recording.name]
    columns = {"time_s": recording.time}
    for name in courses[0].after if courses else ():
        values = np.full(len(recording.time), np.nan)
        for course in courses:
            inside = (recording.time >= course.time[0]) & (recording.time <= course.time[-1] + 1e-6)
            values[inside] = np.interp(recording.time[inside], course.time, course.after[name])
        columns[channel_column(name)] = values
    return pd.DataFrame(columns)


def write_report(diagnosis: Diagnosis, path: str | Path) -> None:
    """Write a diagnosis as one HTML file.

    Parameters
    ----------
    path : str or Path
        The file appears whole or not at all

    Raises
    ------
    InputError
        If it cannot be written.
    """
    from diagnosis.report.page import page  # loads plotly

    text = page(diagnosis)
    with atomic_file(Path(path)) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")


def write_files(
    diagnosis: Diagnosis, gearbox: Gearbox, recordings: Sequence[Recording], folder: str | Path
) -> tuple[Path, ...]:
    """Write report, numbers, corrections, posterior, and the prediction of every recording into a folder.

    Returns
    -------
    tuple of Path
        What was written, the report first
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    report, numbers, correction, alone, posterior, *predictions = (folder / name for name in names_of_files(recordings))
    write_report(diagnosis, report)
    numbers.write_text(json.dumps(diagnosis.to_dict(), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    write_correction(correction_of(diagnosis, gearbox), correction)
    write_correction(correction_of(diagnosis.calibrated_alone, gearbox), alone)
    diagnosis.joint.write(posterior)
    for recording, path in zip(recordings, predictions, strict=True):
        prediction_table(diagnosis, recording).to_csv(path, index=False, float_format="%.3f", lineterminator="\n")
    return report, numbers, correction, alone, posterior, *predictions
