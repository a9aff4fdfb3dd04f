"""The loop ends in the FMU: built with a correction and driven over a recording, it errs as the corrected model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.read import read_recording
from models.assembly.gearbox import load_gearbox
from models.quantities.quantities import node_of_channel
from tests.conftest import RunCli

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(("gearbox", "recording", "improves"), [
    ("heated_rod", "heated_rod.csv.gz@28800..36000", True),  # the correction was fitted to the rows before
    ("la_haute_borne", "la_haute_borne_R80736.csv.gz@2017-10-02..2017-10-03", False),  # it only shows a named input
])  # fmt: skip
def test_fmu_errs_as_the_corrected_model(
    gearbox: str, recording: str, improves: bool, run_cli: RunCli, tmp_path: Path
) -> None:
    file, fix = EXAMPLES / "data" / recording, EXAMPLES / f"{gearbox}_correction.toml"
    network = load_gearbox(gearbox).network()
    channels, nodes = read_recording(file, network).channels, network.node_names
    assert run_cli("build-fmu", "--gearbox", gearbox, "--correction", fix, "--output", tmp_path / "fmu") == 0

    def errors(*model: object) -> dict[str, float]:
        """Root mean square of measured minus simulated, by channel, [K]."""
        output = tmp_path / "result.csv"
        assert run_cli("simulate", *model, file, "--initial", "recorded", "--output", output) == 0
        result = pd.read_csv(output)
        off = {c.name: c.values - result[f"T_{node_of_channel(c.name, nodes)}_degC"] for c in channels}
        return {name: float(np.sqrt(np.nanmean(values**2))) for name, values in off.items()}

    nominal, corrected = errors("--gearbox", gearbox), errors("--gearbox", gearbox, "--correction", fix)
    assert max(abs(nominal[name] - corrected[name]) for name in nominal) > 1.0  # the correction matters
    if improves:
        assert all(corrected[name] < 0.5 * nominal[name] for name in nominal if not name.endswith("NTC7"))
    for kind in ("", "_native"):
        driven = errors(tmp_path / "fmu" / f"{gearbox}{kind}.fmu")
        assert driven == pytest.approx(corrected, abs=0.02), kind
