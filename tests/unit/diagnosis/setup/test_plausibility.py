"""Recordings against the nominal model: mistakes are refused, low loads and missing physics are not."""

from __future__ import annotations

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
    (120.0, 40.0, ""),  # drag of an idling gearbox: no row exceeds the nominal loss
    (900.0, 16.0, "torque in kN m"),
])  # fmt: skip
def test_power_balance(loss: float, power: float, says: str) -> None:
    found = loss_problem(np.full(60, loss), np.full(60, power), np.full(60, 100.0))
    assert says in found and bool(found) == bool(says)


def read_train(folder: Path) -> pd.DataFrame:
    return pd.read_csv(folder / "fzg_open" / "rig_1" / "train_2.csv.gz")


@pytest.mark.parametrize(("column", "factor", "offset", "refused"), [
    ("speed_rpm", np.pi / 30.0, 0.0, True),
    ("torque_Nm", 1e3, 0.0, True),
    ("time_s", 1.0 / 3600.0, 0.0, True),
    ("T_", 1.8, 32.0, True),
    ("T_", 0.9, 0.0, False),  # a gearbox that stays cooler
])  # fmt: skip
def test_units_that_the_model_shows(
    tmp_path: Path, fzg: Gearbox, recordings_folder: Path, column: str, factor: float, offset: float, refused: bool
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


@pytest.mark.parametrize("torque", [0.05, 0.3, 1.0])
def test_a_recording_with_small_torque_is_accepted(tmp_path: Path, fzg: Gearbox, torque: float) -> None:
    """A real drag test: as the nominal model behaves."""
    time = np.arange(0.0, 7200.0, 10.0)
    cycle = {"time_s": time, "speed_rpm": np.full(len(time), 1500.0), "torque_Nm": np.full(len(time), torque)}
    result = fzg.network().simulate(cycle, losses=fzg.losses(), initial=20.0).columns()
    kept = ("time_s", "speed_rpm", "torque_Nm", "T_ambient_degC", "T_oil_degC", "T_pinion_degC", "P_loss_W")
    pd.DataFrame({name: result[name] for name in kept}).to_csv(tmp_path / "run.csv", index=False)
    recordings = read_recordings([tmp_path / "run.csv"], fzg.network())
    check_plausible(recordings, fzg.network(), fzg.losses())


def test_recordings_of_a_foreign_plant_are_plausible(fzg: Gearbox, recordings_folder: Path) -> None:
    files = sorted((recordings_folder / "fzg_open").glob("rig_*/*_1.csv.gz"))
    assert files
    check_plausible(read_recordings(files, fzg.network()), fzg.network(), fzg.losses())
