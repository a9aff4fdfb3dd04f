"""Recordings against the nominal model: mistakes are refused, low loads and missing physics are not."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.read import read_recordings
from diagnosis.setup.plausibility import check_plausible, loss_problem
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError


@pytest.mark.parametrize(("loss", "power", "says"), [
    (350.0, 16_000.0, ""),
    (0.35, 16_000.0, "is P_loss in kW, or torque in N mm"),
    (350.0, 16e6, "is P_loss in kW, or torque in N mm"),
    (350e3, 16_000.0, "P_loss in mW"),
    (0.0, 16_000.0, "P_loss is 0"),
    (12_000.0, 16_000.0, ""),  # at the limits: all of the power, and 0.02 % of it
    (20_000.0, 16_000.0, "P_loss in mW"),
    (5.0, 16_000.0, ""),
    (2.0, 16_000.0, "99.9875 % is not possible"),
    (120.0, 40.0, ""),  # drag of an idling gearbox: no row exceeds the nominal loss
    (900.0, 16.0, "torque in kN m"),
])  # fmt: skip
def test_power_balance(loss: float, power: float, says: str) -> None:
    found = loss_problem(np.full(60, loss), np.full(60, power), np.full(60, 100.0))
    assert says in found and bool(found) == bool(says)


PARTS = ("T_oil", "T_housing", "T_bearing", "T_pinion")


def read_train(folder: Path) -> pd.DataFrame:
    return pd.read_csv(folder / "fzg_open" / "rig_1" / "train_2.csv.gz")


@pytest.mark.parametrize(("column", "factor", "offset", "refused"), [
    ("speed_rpm", np.pi / 30.0, 0.0, True),
    ("torque_Nm", 1e3, 0.0, True),
    ("time_s", 1.0 / 3600.0, 0.0, True),
    ("T_", 1.8, 32.0, True),
    ("T_", 0.9, 0.0, False),  # a gearbox that stays cooler
    (PARTS, 1.6, 0.0, False),  # or gets hotter: 32 K off, but 0.32 of the rise
])  # fmt: skip
def test_units_that_the_model_shows(
    tmp_path: Path,
    fzg: Gearbox,
    recordings_folder: Path,
    column: str | tuple[str, ...],
    factor: float,
    offset: float,
    refused: bool,
) -> None:
    source = read_train(recordings_folder).drop(columns="P_loss_W")
    for name in source.columns:
        if name.startswith(column):
            source[name] = source[name] * factor + offset
    source.to_csv(tmp_path / "run.csv", index=False)
    recordings = read_recordings([tmp_path / "run.csv"], fzg.network())
    if refused:
        with pytest.raises(InputError, match="run.csv: temperatures are .* K off the nominal model"):
            check_plausible(recordings, fzg.network(), fzg.losses())
    else:
        check_plausible(recordings, fzg.network(), fzg.losses())


@pytest.mark.parametrize(("torque", "unit", "says"), [
    (0.05, 1.0, ""), (0.3, 1.0, ""), (1.0, 1.0, ""), (80.0, 1.0, ""),
    (80.0, 1e-3, "run.csv: P_loss is .* is P_loss in kW"),
])  # fmt: skip
def test_a_measured_loss(tmp_path: Path, fzg: Gearbox, torque: float, unit: float, says: str) -> None:
    """From a drag test to load, as the nominal model behaves; refused if it is in kW."""
    time = np.arange(0.0, 7200.0, 60.0)
    cycle = {"time_s": time, "speed_rpm": np.full(len(time), 1500.0), "torque_Nm": np.full(len(time), torque)}
    result = fzg.network().simulate(cycle, losses=fzg.losses(), initial=20.0).columns()
    kept = ("time_s", "speed_rpm", "torque_Nm", "T_ambient_degC", "T_oil_degC", "T_pinion_degC", "P_loss_W")
    run = pd.DataFrame({name: result[name] for name in kept})
    run["P_loss_W"] *= unit
    run.to_csv(tmp_path / "run.csv", index=False)
    recordings = read_recordings([tmp_path / "run.csv"], fzg.network())
    with pytest.raises(InputError, match=says) if says else nullcontext():
        check_plausible(recordings, fzg.network(), fzg.losses())


def test_recordings_of_a_foreign_plant_are_plausible(fzg: Gearbox, recordings_folder: Path) -> None:
    files = sorted((recordings_folder / "fzg_open").glob("rig_*/*_1.csv.gz"))
    assert files
    check_plausible(read_recordings(files, fzg.network()), fzg.network(), fzg.losses())
