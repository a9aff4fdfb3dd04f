"""Channels of an MDF file on the rows of one of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.mdf import _on_rows_of, read_mdf
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError

ROD = Path(__file__).parents[4] / "examples/data/heated_rod.csv.gz"


def test_samples_far_from_a_row_are_in_none() -> None:
    """The speed channel of an MDF file pauses, the temperature goes on."""
    time = np.concatenate([np.arange(0.0, 100.0), np.arange(700.0, 800.0)])
    speed = pd.DataFrame({"speed_rpm": np.full(len(time), 1000.0)}, index=time)
    every = np.arange(0.0, 1000.0, 0.5)
    oil = pd.DataFrame({"T_oil_degC": 20.0 + 0.1 * every}, index=every)
    table = _on_rows_of(["speed_rpm"], [speed, oil], Path("run.mf4"))
    np.testing.assert_allclose(table["T_oil_degC"], 20.0 + 0.1 * time, atol=0.1)


def test_rows_at_changes_of_speed_take_what_was_measured_between_them() -> None:
    """Speed is logged when it changes: often at first, then every 50 s."""
    time = np.concatenate([np.arange(0.0, 60.0, 0.1), np.arange(100.0, 1000.0, 50.0)])
    speed = pd.DataFrame({"speed_rpm": np.full(len(time), 1000.0)}, index=time)
    oil = pd.DataFrame({"T_oil_degC": 20.0 + 0.01 * np.arange(0.0, 1000.0, 10.0)}, index=np.arange(0.0, 1000.0, 10.0))
    table = _on_rows_of(["speed_rpm"], [speed, oil], Path("run.mf4"))
    late = table[table["time_s"] > 100.0]
    np.testing.assert_allclose(late["T_oil_degC"], 20.0 + 0.01 * late["time_s"], atol=0.11)


def test_rows_are_those_of_the_first_channel_that_is_there() -> None:
    """A machine without a shaft has no speed."""
    power = pd.DataFrame({"heater_power": [10.0, 10.0, 0.0]}, index=[0.0, 10.0, 20.0])
    cell = pd.DataFrame({"T_cell": [20.0, 21.0, 22.0, 23.0, 24.0]}, index=[0.0, 5.0, 10.0, 15.0, 20.0])
    table = _on_rows_of(["speed_rpm", "heater_power", "T_cell"], [cell, power], Path("rod.mf4"))
    np.testing.assert_array_equal(table["time_s"], [0.0, 10.0, 20.0])
    with pytest.raises(InputError, match="channel speed_rpm is missing; it has: T_cell, heater_power"):
        _on_rows_of(["speed_rpm"], [cell, power], Path("rod.mf4"))


def test_a_machine_without_a_shaft_is_read_as_its_table_is(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    table, rod = pd.read_csv(ROD, nrows=100), load_gearbox("heated_rod")
    table.to_csv(tmp_path / "rod.csv", index=False)
    with asammdf.MDF(version="4.10") as mdf:
        for name in table.columns[1:]:
            mdf.append([asammdf.Signal(table[name].to_numpy(float), table["time_s"].to_numpy(float), name=name)])
        mdf.save(tmp_path / "rod.mf4")
    ours, theirs = (read_recordings(tmp_path / f"rod.{ending}", rod)[0] for ending in ("mf4", "csv"))
    np.testing.assert_array_equal(ours.time, theirs.time)
    for mine, other in zip(ours.channels, theirs.channels, strict=True):
        assert mine.name == other.name
        np.testing.assert_array_equal(mine.values, other.values)


def test_a_channel_that_several_groups_have_is_named_with_its_group(tmp_path: Path) -> None:
    asammdf, time = pytest.importorskip("asammdf"), np.arange(0.0, 50.0, 10.0)
    groups = {"n": "rpm", "status": "-"}, {"T": "K", "status": ""}
    with asammdf.MDF(version="4.10") as mdf:
        for units in groups:
            mdf.append([asammdf.Signal(np.full(5, 20.0), time, name=name, unit=unit) for name, unit in units.items()])
        mdf.save(tmp_path / "run.mf4")
    table, units, _ = read_mdf(tmp_path / "run.mf4", bases=["n"])
    assert list(table.columns) == ["time_s", "n", "status (group 1)", "T", "status (group 2)"]
    assert units == {"n": "rpm", "status (group 1)": "-", "T": "K"}
    np.testing.assert_array_equal(table["T"], 20.0)
