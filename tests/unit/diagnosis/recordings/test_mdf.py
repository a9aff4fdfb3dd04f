"""Channels of an MDF file on the rows of one of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.mdf import _named_apart, _on_rows_of
from models.base.errors import InputError


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


def test_a_channel_that_several_groups_have_is_named_with_its_group() -> None:
    frames = [pd.DataFrame({"n": [1.0], "status": [0.0]}), pd.DataFrame({"T": [20.0], "status": [1.0]})]
    groups, units = _named_apart(frames, [{"n": "rpm", "status": "-"}, {"T": "K", "status": ""}])
    assert [list(frame.columns) for frame in groups] == [["n", "status (group 1)"], ["T", "status (group 2)"]]
    assert units == [{"n": "rpm", "status (group 1)": "-"}, {"T": "K", "status (group 2)": ""}]
