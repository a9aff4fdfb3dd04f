"""Building: errors over the reference cycle, and an FMU that cannot run here is built all the same."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

from builder.base.cache import CACHE_VARIABLE
from builder.drive import driver as fmu_drive
from builder.drive.driver import runs_here
from builder.native import compile as native_compile
from builder.native.compile import NoCompilerError, host_platform
from builder.surrogate.train import TrainingResult
from builder.workflows import build as builder_build
from builder.workflows.build import BuildReport, CycleErrors, build, cycle_errors
from builder.workflows.known_physics import known_finding
from models.assembly.gearbox import Gearbox, load_gearbox
from models.correction.correction import Correction, Estimate, MeanLoss


def test_errors_over_a_cycle_are_those_of_the_fmu_against_the_model() -> None:
    model = {"time_s": [0.0, 1.0, 2.0], "T_ambient_degC": [20.0, 20.0, 20.0], "T_oil_degC": [20.0, 30.0, 40.0],
             "T_mesh_degC": [20.0, 50.0, 60.0], "P_loss_W": [100.0, 200.0, 400.0]}  # fmt: skip
    fmu = model | {"T_oil_degC": [20.0, 30.5, 40.25], "T_mesh_degC": [20.0, 47.0, 61.0],
                   "P_loss_W": [101.0, 196.0, 400.0]}  # fmt: skip
    errors = cycle_errors(*({name: np.array(values) for name, values in table.items()} for table in (fmu, model)))
    assert errors.temperature_K == {"oil": 0.5, "mesh": 3.0}
    assert errors.loss_mean == pytest.approx(0.01)
    assert errors.loss_worst == pytest.approx(0.02)
    assert builder_build._poor("own.fmu", errors) == []
    (note,) = builder_build._poor("own.fmu", replace(errors, loss_mean=0.093))
    assert note.startswith("own.fmu: the total loss is 9.3% off the full model on average; train larger networks")


def test_the_worst_network_of_a_trial_is_named(fzg_training: TrainingResult) -> None:
    fine = [replace(one, percentile_95=0.01) for one in fzg_training.report]
    assert builder_build._rough(fine) == []
    (note,) = builder_build._rough([fine[0], replace(fine[1], percentile_95=0.16), *fine[2:]])
    assert note.startswith(f"{fine[1].component} is 16% off and more at one of twenty points: good for a trial")


def test_an_fmu_that_cannot_run_here_is_built_and_that_is_told(
    fzg: Gearbox, fzg_training: TrainingResult, fzg_fmu: Path, fzg_native: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert runs_here(fzg_native)
    with ZipFile(fzg_fmu) as archive:
        there = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    assert runs_here(fzg_fmu) == (host_platform() in there)
    monkeypatch.setattr(fmu_drive, "host_platform", lambda: "darwin64")
    monkeypatch.setattr(builder_build, "kept_or_trained", lambda *_, **__: fzg_training)
    report = build(fzg, tmp_path, name="fzg", target="python")
    report.show()
    shown = capsys.readouterr()
    assert (tmp_path / "fzg.fmu").is_file() and not (tmp_path / "drive_cycle.csv").exists()
    assert "reference cycle from 20" not in shown.out
    assert "note: the python FMU has no binary for this machine" in " ".join(shown.err.split())
    assert "earlier build" not in shown.err
    again = build(fzg, tmp_path, name="other", target="python")
    assert [note for note in again.notes if "earlier" in note] == [
        f"{tmp_path / 'fzg.fmu'} is of an earlier build: report.json and networks/ no longer describe it"
    ]


def test_what_the_cycle_reaches_of_the_range_of_training_is_shown(
    fzg_training: TrainingResult, capsys: pytest.CaptureFixture[str]
) -> None:
    cycle = CycleErrors(temperature_K={"oil": 0.1}, loss_mean=0.01, loss_worst=0.02)
    BuildReport(
        gearbox="FZG", training=fzg_training, cycles={"fzg.fmu": cycle}, seconds={}, files=(), purpose=""
    ).show()
    assert "(up to 2275 1/min of 6500, 280 N m of 350;" in capsys.readouterr().out


@pytest.mark.slow
def test_a_corrected_fmu_of_kept_networks_has_the_bytes_of_a_trained_one(
    fzg: Gearbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    correction = Correction.of(fzg, calibration=[Estimate(name="mesh", value=1.07, stderr=0.02)])
    quick: dict[str, Any] = {"name": "fzg", "preset": "paper", "samples": 60, "target": "native"}
    build(fzg, tmp_path / "nominal", **quick).show()
    assert "networks: trained now, kept in " in capsys.readouterr().out
    taken = build(fzg, tmp_path / "corrected", correction=correction, **quick)
    taken.show()
    assert "networks: taken from " in capsys.readouterr().out
    assert taken.seconds["networks"] < 0.5
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    trained = build(fzg, tmp_path / "trained", correction=correction, **quick)
    assert trained.training and trained.training.origin == "trained now"
    assert [path.name for path in trained.files] == [path.name for path in taken.files]
    assert {path.suffix for path in trained.files} == {".fmu", ".onnx", ".json", ".csv", ".png"}
    for here, there in zip(taken.files, trained.files, strict=True):
        assert here.read_bytes() == there.read_bytes(), here.name


@pytest.mark.skipif(sys.platform == "win32", reason="a script as compiler")
@pytest.mark.parametrize("has_broken_compiler", [pytest.param(False, marks=pytest.mark.slow), True])
def test_without_a_compiler_the_python_fmu_is_built_and_one_line_says_how_to_get_the_native_one(
    fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    has_broken_compiler: bool,
) -> None:  # fmt: skip
    tools = tmp_path / "tools"
    tools.mkdir()
    if has_broken_compiler:  # as gcc without the headers of C
        (tools / "cc").write_text("#!/bin/sh\nexit 1\n")
        (tools / "cc").chmod(0o755)
    monkeypatch.setenv("PATH", str(tools))
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(native_compile, "_zig", lambda: None)
    monkeypatch.setattr(builder_build, "kept_or_trained", lambda *_, **__: fzg_training)
    report = build(fzg, tmp_path / "out", name="fzg")
    assert [path.name for path in report.files if path.suffix == ".fmu"] == ["fzg.fmu"]
    assert report.purpose == "fzg.fmu runs on Python with numpy and onnxruntime"
    assert [note for note in report.notes if "python -m pip install ziglang" in note] == [report.notes[0]]
    with pytest.raises(NoCompilerError, match="no cc, gcc or clang works here; install ziglang"):
        build(fzg, tmp_path / "native", name="fzg", target="native")
    assert not (tmp_path / "native").exists()


@pytest.mark.skipif(native_compile._own_compiler() is None, reason="no C compiler")
def test_both_versions_of_fmi_are_written_next_to_each_other(tmp_path: Path) -> None:
    report = build(load_gearbox("heated_rod"), tmp_path, name="rod", target="native", fmi="both")
    files = [path for path in report.files if path.suffix == ".fmu"]
    assert [path.name for path in files] == ["rod_native.fmu", "rod_native_fmi3.fmu"]
    assert [read_model_description(str(path)).fmiVersion for path in files] == ["2.0", "3.0"]
    assert list(report.cycles) == ["rod_native.fmu", "rod_native_fmi3.fmu"]
    worst = [max(cycle.temperature_K.values()) for cycle in report.cycles.values()]
    assert (
        worst[0] < 1e-9 and worst[1] < 0.01
    )  # inputs follow their ramps in FMI 2.0, and are held in pieces in FMI 3.0
    assert "rod_native_fmi3.fmu (FMI 3.0) needs no other software" in report.purpose
    names = [f"cell_{i}.T" for i in range(1, 13)]
    results = [simulate_fmu(str(path), stop_time=600.0, output_interval=60.0, start_values={"heater_power": 20.0},
                            output=names) for path in files]  # fmt: skip
    np.testing.assert_array_equal(*results)
    assert results[0]["cell_1.T"][-1] > results[0]["cell_12.T"][-1] + 1.0


@pytest.mark.skipif(native_compile._own_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize(("set_point", "rests"), [(90.0, True), (20.0, False)])
def test_a_control_that_rests_in_the_reference_cycle_is_not_compared(
    tmp_path: Path, set_point: float, rests: bool
) -> None:
    reducer = load_gearbox("reducer")
    given = {"strength": (10.0, 1.0), "set_point": (set_point, 1.0), "band": (0.2, 0.1)}
    cooler = known_finding(reducer, reducer.network(), "cooler_thermostat", given)
    report = build(reducer, tmp_path, target="native", correction=Correction.of(reducer, findings=[cooler]))
    told = [note for note in report.notes if "not compared (state_cooler_thermostat_oil_valve)" in note]
    assert len(told) == rests


@pytest.mark.skipif(native_compile._own_compiler() is None, reason="no C compiler")
def test_a_model_that_is_not_to_be_asked_for_losses_says_so_wherever_it_goes(tmp_path: Path) -> None:
    reducer = load_gearbox("reducer")
    loss = MeanLoss(estimate_W=220.0, stderr_W=18.0, predicting_W=705.0, delivered_W=216.0)
    known = Correction.of(reducer, calibration=[Estimate(name="C_oil", value=1.1, stderr=0.1)], mean_loss=loss)
    report = build(reducer, tmp_path, target="native", correction=known)
    warning = "take no losses from it: 705 W on average, where 220 ± 18 W were estimated"
    assert [note for note in report.notes if warning in note] == [
        f"the corrected model predicts temperatures; {warning}"
    ]
    (fmu,) = (path for path in report.files if path.suffix == ".fmu")
    assert warning in read_model_description(fmu).description
