"""Building: errors over the reference cycle, and an FMU that cannot run here is built all the same."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from builder.drive import driver as fmu_drive
from builder.drive.driver import runs_here
from builder.native.compile import host_platform
from builder.surrogate.train import TrainingResult
from builder.workflows import build as builder_build
from builder.workflows.build import build, cycle_errors
from models.assembly.gearbox import Gearbox


def test_errors_over_a_cycle_are_those_of_the_fmu_against_the_model() -> None:
    model = {"time_s": [0.0, 1.0, 2.0], "T_ambient_degC": [20.0, 20.0, 20.0], "T_oil_degC": [20.0, 30.0, 40.0],
             "T_mesh_degC": [20.0, 50.0, 60.0], "P_loss_W": [100.0, 200.0, 400.0]}  # fmt: skip
    fmu = model | {"T_oil_degC": [20.0, 30.5, 40.25], "T_mesh_degC": [20.0, 47.0, 61.0],
                   "P_loss_W": [101.0, 196.0, 400.0]}  # fmt: skip
    errors = cycle_errors(*({name: np.array(values) for name, values in table.items()} for table in (fmu, model)))
    assert errors.temperature_K == {"oil": 0.5, "mesh": 3.0}
    assert errors.loss_mean == pytest.approx(0.01)
    assert errors.loss_worst == pytest.approx(0.02)


def test_an_fmu_that_cannot_run_here_is_built_and_that_is_told(
    fzg: Gearbox, fzg_training: TrainingResult, fzg_fmu: Path, fzg_native: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert runs_here(fzg_native)
    with ZipFile(fzg_fmu) as archive:
        there = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    assert runs_here(fzg_fmu) == (host_platform() in there)
    monkeypatch.setattr(fmu_drive, "host_platform", lambda: "darwin64")
    monkeypatch.setattr(builder_build, "train_surrogate", lambda *_, **__: fzg_training)
    report = build(fzg, tmp_path, name="fzg")
    report.show()
    shown = capsys.readouterr()
    assert (tmp_path / "fzg.fmu").is_file() and not (tmp_path / "drive_cycle.csv").exists()
    assert "reference cycle from 20" not in shown.out
    assert "note: the python FMU has no binary for this machine" in " ".join(shown.err.split())
    assert "earlier build" not in shown.err
    again = build(fzg, tmp_path, name="other")
    assert [note for note in again.notes if "earlier" in note] == [
        f"{tmp_path / 'fzg.fmu'} is of an earlier build: report.json and networks/ no longer describe it"
    ]
