"""A real plant to its FMU: on a short slice without a search, the format of ``real.json``, and messages."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from builder.workflows import prove_real as workflow
from builder.workflows.held_out_fmu import overall
from builder.workflows.prove_real import BY_SOUND, PLANTS, data_file, prove_real, rows_of
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.calibration import Calibration, NearReadings
from diagnosis.engine.fit import calibrate
from diagnosis.engine.learnt import error_classes, rule
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.set_apart import calibrate_apart
from diagnosis.results.assemble import Others, assemble
from diagnosis.results.result import Diagnosis
from models.base.errors import InputError

SHORT = replace(PLANTS["rod"], train="0..10800", hold="10800..14400")


def calibrated(train: Any, gearbox: Any, *, holdout: Any, **_: object) -> Diagnosis:
    """A diagnosis that looks for nothing."""
    setup, experiment = prepare_experiment(gearbox, train, holdout)
    plain = calibrate(experiment)
    fit, apart = calibrate_apart(experiment, plain)
    nothing = Judged(effects=(), log_bayes=0.0, fit=fit, error_class=error_classes()[0])
    posterior = Posterior(nothing=nothing, judged=(), log_e=-1.0, threshold=5.0, class_threshold=5.0, rule=rule())
    near = NearReadings.of(experiment, ModelError.of(experiment), plain)
    calibration = Calibration(chosen=near.fitted(nothing.error_class, plain, iterations=0), evidence={}, near=near)
    return assemble(
        setup, experiment, posterior, (), plain=fit, calibration=calibration,
        others=Others(posterior=posterior, channels=apart, apart=apart),
    )  # fmt: skip


def test_the_fmu_errs_as_the_report_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workflow, "diagnose", calibrated)
    result = prove_real(SHORT, tmp_path)
    assert json.loads((tmp_path / "real.json").read_text()) == result
    assert {path.name for path in tmp_path.iterdir()} >= {
        "report.html", "diagnosis.json", "correction.toml", "heated_rod_native.fmu"
    }  # fmt: skip
    assert result["broken"] == {"known": ["cell_6__NTC7"], "found": ["cell_6__NTC7"]}
    sound = result["rmse_K"]["without_broken"]
    assert sound["fmu"] == pytest.approx(sound["after"], abs=0.02)
    assert sound["after"] == sound["calibrated"]  # both by the sound thermistors
    assert sound["after"] < sound["before"]
    assert abs(result["rmse_K"]["all"]["fmu"] - sound["fmu"]) > 1.0  # the broken one is listed apart
    # Who looks for nothing is no better than the machine calibrated by the sound channels.
    assert result["ratio"] == pytest.approx(1.0, abs=0.02) and sound["after"] == pytest.approx(
        sound[BY_SOUND], rel=0.02
    )
    assert result["kept"] == {"broken_found": True, "ratio": False, "fmu_less_report_K": True, "seconds": True}
    table = {row[0]: row[1:] for row in rows_of(result)}
    assert table["broken channels"] == ["cell_6__NTC7", "cell_6__NTC7", "kept"]
    assert table["held-out rmse without them, fmu"][0] == f"{sound['fmu']:.3f} K"


def test_overall_leaves_losses_and_given_channels_out() -> None:
    errors = {"oil": 3.0, "case": 4.0, "broken": 100.0, "P_loss": 50.0}
    assert overall(errors, ["broken"]) == pytest.approx((12.5) ** 0.5)


def test_a_recording_that_is_not_there_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workflow, "DATA", Path("examples") / "nowhere")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="get the source of the project"):
        data_file("heated_rod.csv.gz")
