"""A correction without what is only likely."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from builder.commands.cli import commands
from models.assembly.gearbox import Gearbox
from models.correction.correction import Correction, Finding, write_correction
from models.mechanisms import CATALOGUE, Scale


@pytest.mark.parametrize("grade", ["claim", "likely"])
def test_claims_only_leaves_out_what_is_likely(fzg: Gearbox, tmp_path: Path, grade: str) -> None:
    network, scale = fzg.network(), Scale.of(fzg, speed=3000.0, torque=94.0)
    pump = CATALOGUE["pump_heat"].placed(network, scale)[0]
    estimates = {p.name: (p.start, 0.0) for p in pump.parameters} | {pump.strength.name: (200.0, 5.0)}
    finding = Finding.of(pump, estimates, mechanism="pump_heat", grade=grade)  # type: ignore[arg-type]
    write_correction(Correction.of(fzg, findings=[finding]), tmp_path / "correction.toml")
    cycle = tmp_path / "cycle.csv"
    pd.DataFrame({"time_s": [0.0, 600.0], "speed_rpm": 2000.0, "torque_Nm": 50.0, "T_ambient_degC": 20.0}).to_csv(
        cycle, index=False
    )

    def oil(*options: str) -> float:
        out = tmp_path / f"{len(options)}.csv"
        result = CliRunner().invoke(commands, [
            "simulate", "--gearbox", "fzg", str(cycle), "--output", str(out), "--correction",
            str(tmp_path / "correction.toml"), *options,
        ])  # fmt: skip
        assert result.exit_code == 0, result.output
        return float(pd.read_csv(out)["T_oil_degC"].iloc[-1])

    heated, claimed = oil(), oil("--claims-only")
    assert (heated == claimed) == (grade == "claim")
    assert heated >= claimed
