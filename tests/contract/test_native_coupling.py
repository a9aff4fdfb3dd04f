"""The gearbox in a vehicle: the example as users run it, in FMPy and in every other master that is installed."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pandas as pd
import pytest

from tests.contract.native_hosts import run

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_example_closes_its_energy_balance_and_masters_agree(fzg_native: Path, tmp_path: Path) -> None:
    """Inside the vehicle to rounding; between the FMUs, which exchange powers every 0.1 s, to 0.1 %."""
    shown = run([
        sys.executable, EXAMPLES / "coupled_vehicle.py", "--gearbox-fmu", fzg_native, "--output", tmp_path,
    ], cwd=EXAMPLES.parent, env=None)  # fmt: skip
    assert "20.40 km" in shown
    assert (tmp_path / "result.png").stat().st_size > 10_000
    result = pd.read_csv(tmp_path / "result.csv")
    assert len(result) == 1200
    engine, *parts = (result[f"vehicle.energy.{name}"] for name in ("engine", "loss", "road", "brake", "kinetic"))
    assert sum(parts).to_numpy() == pytest.approx(engine.to_numpy(), abs=1e-5)
    heat = re.search(r"heat in the gearbox ([0-9.]+) kJ", shown)
    assert heat is not None
    assert float(heat[1]) == pytest.approx(parts[0].iloc[-1] / 1e3, rel=2e-3)
    assert (result["vehicle.speed"] - result["cycle.speed"]).abs().max() < 3.5 / 3.6
    assert result["gearbox.oil.T"].max() > result["gearbox.oil.T"].iloc[0] + 10.0
    difference = re.search(r"differ by ([0-9.e+-]+)", shown)
    if difference is not None:
        assert float(difference[1]) < 2e-10
