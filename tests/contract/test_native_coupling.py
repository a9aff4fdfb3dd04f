"""The gearbox in a vehicle and in a room: the examples as users run them, in FMPy and in other masters."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pandas as pd
import pytest

from builder.native.native_fmu import build_native_fmu
from builder.surrogate.train import TrainingResult
from models.base.errors import InputError
from tests.contract.native_hosts import run

sys.path.append(str(Path(__file__).parents[2] / "examples"))
import coupled_room
from vehicle_fmus import write_system

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


def test_an_fmu_without_a_variable_of_the_system_is_refused(fzg_native: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"fzg\S*.fmu: has no frame.T_in, which room.ssd has; take another FMU"):
        write_system(tmp_path / "room.ssp", EXAMPLES / "room.ssd", {"gearbox": fzg_native})
    assert not list(tmp_path.iterdir())


def test_heat_goes_from_the_gearbox_into_the_room(fzg_training: TrainingResult, tmp_path: Path) -> None:
    """Each FMU's balance closes, and what one gives off the other receives one step later, to rounding."""
    gearbox = coupled_room.gearbox_on_feet()
    network = gearbox.network().with_coupled_boundary("frame")
    fmus = {
        "gearbox": build_native_fmu(gearbox, fzg_training, tmp_path / "gearbox.fmu", network=network, platforms="host"),
        "room": coupled_room.build_room(tmp_path / "room"),
    }
    rows = coupled_room.run(write_system(tmp_path / "room.ssp", EXAMPLES / "room.ssd", fmus), stop=3600.0)
    given = [rows[f"gearbox.{boundary}.heat"] for boundary in ("air", "frame")]
    lost, received = rows["gearbox.heat_in"], rows["room.heat_in"]
    assert len(rows) == 360
    assert min(heat[-1] for heat in given) > 1e4
    assert rows["room.room.T"][-1] > rows["room.floor.T"][-1] > coupled_room.START_K
    assert lost - sum(given) - rows["gearbox.heat_stored"] == pytest.approx(0.0, abs=1e-9 * lost[-1])
    assert received - rows["room.outside.heat"] - rows["room.heat_stored"] == pytest.approx(0.0, abs=1e-9 * lost[-1])
    assert received[1:] == pytest.approx(sum(given)[:-1] + received[0], rel=1e-9)
