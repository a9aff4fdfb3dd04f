"""The heated rod from its recording to the corrected FMU."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import RunCli


@pytest.mark.slow  # a notebook of the documentation does it with every 30th row
def test_the_broken_thermistor_is_found_and_the_fmu_predicts(run_cli: RunCli, tmp_path: Path) -> None:
    assert run_cli("prove", "--real", "rod", "--jobs", "1", "--output", tmp_path) == 0
    result = json.loads((tmp_path / "real.json").read_text())
    assert result["verdict"] == "sensor_fault"
    assert all("cell_6__NTC7" in finding["title"] for finding in result["findings"])
    assert {name: kept for name, kept in result["kept"].items() if name != "seconds"} == {
        "broken_found": True, "ratio": False, "fmu_less_report_K": True,  # the sound channels leave nothing to find
    }  # fmt: skip
    assert result["rmse_K"]["without_broken"]["after"] < 0.2
    parameters = json.loads((tmp_path / "diagnosis.json").read_text())["calibration"]
    assert all(abs(one["shift_in_sd"]) < 2.0 for one in parameters)  # the broken one has no say: with it 52
