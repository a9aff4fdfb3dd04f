"""Time columns of loggers: units, dates of all forms, two columns, times of day; and the advice where they fail."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.date_forms import forms_of
from diagnosis.recordings.read import read_recordings
from diagnosis.recordings.recording import Recording
from models.base.errors import InputError
from models.simulation.thermal_network import ThermalNetwork

TIME = 10.0 * np.arange(400)
STAMPS = pd.Timestamp("2024-12-31 13:05:00") + pd.to_timedelta(TIME, unit="s")


def read(folder: Path, network: ThermalNetwork, time: dict[str, object], mapping: str = "") -> Recording:
    oil = 20.0 + 40.0 * (1.0 - np.exp(-TIME / 900.0))
    table = pd.DataFrame({**time, "speed_rpm": 1500.0, "torque_Nm": 94.0, "T_oil_degC": oil})
    table.to_csv(folder / "run.csv", index=False)
    if mapping:
        (folder / "mapping.toml").write_text(f"schema = 1\n{mapping}")
    return read_recordings(folder / "run.csv", network)[0]


@pytest.mark.parametrize(("name", "values"), [
    ("time_min", TIME / 60.0), ("time_h", TIME / 3600.0), ("time_ms", TIME * 1e3), ("Time (s)", TIME),
    ("TIME [min]", TIME / 60.0), ("time [ns]", 1.7e18 + 1e9 * TIME),
])  # fmt: skip
def test_the_unit_in_the_name_of_the_time(
    tmp_path: Path, network: ThermalNetwork, name: str, values: np.ndarray
) -> None:
    recording = read(tmp_path, network, {name: values})
    np.testing.assert_allclose(recording.time, TIME, atol=1e-6)
    assert any(note.startswith(f"{name} is taken as the time in ") for note in recording.notes)


@pytest.mark.parametrize("form", [
    "%d.%m.%Y %H:%M:%S", "%d.%m.%y %H:%M:%S", "%m/%d/%Y %I:%M:%S %p", "%d/%m/%Y %H:%M:%S", "%Y/%m/%d %H:%M:%S",
    "%d-%b-%Y %H:%M:%S", "%Y%m%dT%H%M%S", "%d.%m.%Y %H:%M:%S,%f",
])  # fmt: skip
@pytest.mark.parametrize("name", ["Zeit", "time"])
def test_the_form_of_dates_is_advised_and_works(tmp_path: Path, network: ThermalNetwork, form: str, name: str) -> None:
    texts = STAMPS.strftime(form)
    with pytest.raises(InputError) as caught:
        read(tmp_path, network, {name: texts})
    advice = f'time = {{ column = "{name}", unit = "{form}" }}'
    assert f"give {advice} in a mapping file" in str(caught.value)
    assert (read(tmp_path, network, {name: texts}, advice).time == TIME).all()


def test_the_only_column_of_dates_is_the_time(tmp_path: Path, network: ThermalNetwork) -> None:
    """The nameless one of a pandas index too, in CSV and Parquet."""
    dates = STAMPS.strftime("%Y-%m-%d %H:%M:%S")
    for name, shown in (("Zeit", "Zeit"), ("", "Unnamed: 0")):
        recording = read(tmp_path, network, {name: dates, "calibrated": "2024-01-01"})
        assert (recording.time == TIME).all() and f"{shown} is taken as the time" in recording.notes
    with pytest.raises(InputError, match=r'give time = \{ column = "begin", unit = "iso8601" \}'):
        read(tmp_path, network, {"begin": dates, "end": dates[::-1]})
    pd.read_csv(tmp_path / "run.csv").iloc[:, 2:].set_index(STAMPS).to_parquet(tmp_path / "run.parquet")
    assert (read_recordings(tmp_path / "run.parquet", network)[0].time == TIME).all()


def test_a_day_that_may_be_a_month_is_left_to_the_reader() -> None:
    both = pd.Series(["01/02/2024 10:00", "01/02/2024 11:00"])
    assert forms_of(both) == ["%m/%d/%Y %H:%M", "%d/%m/%Y %H:%M"]
    assert forms_of(pd.Series([*both, "13/02/2024 10:00"])) == ["%d/%m/%Y %H:%M"]


def test_a_form_that_does_not_fit_is_corrected(tmp_path: Path, network: ThermalNetwork) -> None:
    with pytest.raises(InputError, match=r'each needs a number; in a mapping file .* time.unit = "%d.%m.%Y %H:%M:%S"'):
        read(tmp_path, network, {"time_s": STAMPS.strftime("%d.%m.%Y %H:%M:%S")})
    with pytest.raises(InputError, match=r'each needs a date as %m/%d/%Y .* time.unit = "%d/%m/%Y %H:%M:%S"'):
        read(tmp_path, network, {"t": STAMPS.strftime("%d/%m/%Y %H:%M:%S")},
             'time = { column = "t", unit = "%m/%d/%Y %H:%M:%S" }')  # fmt: skip


@pytest.mark.parametrize("day", ["%d.%m.%Y", "%Y-%m-%d"])
def test_date_and_time_of_day_in_two_columns(tmp_path: Path, network: ThermalNetwork, day: str) -> None:
    time: dict[str, object] = {"Date": STAMPS.strftime(day), "Time": STAMPS.strftime("%H:%M:%S")}
    with pytest.raises(InputError, match=r'give time = \{ column = \["Date", "Time"\], unit = ".*" \}') as caught:
        read(tmp_path, network, time)
    recording = read(tmp_path, network, time, str(caught.value).partition("give ")[2].partition(" in a mapping")[0])
    assert recording.start == STAMPS[0].tz_localize("UTC")
    assert (recording.time == TIME).all()
    over_days = STAMPS + pd.to_timedelta(99.0 * TIME, unit="s")
    time = {"Date": over_days.strftime(day), "Time": over_days.strftime("%H:%M:%S")}
    (tmp_path / "mapping.toml").unlink()
    with pytest.raises(InputError, match=r'give time = \{ column = \["Date", "Time"\], unit = ".*" \}'):
        read(tmp_path, network, time)
    with pytest.raises(InputError, match=r"column Day of \[time\] in its mapping file is missing; known are"):
        read(tmp_path, network, time, 'time = { column = ["Day", "Time"] }')


def test_times_as_on_a_clock(tmp_path: Path, network: ThermalNetwork) -> None:
    since = pd.to_datetime(TIME, unit="s").strftime("%H:%M:%S")
    mapping = 'time = { column = "t", unit = "hh:mm:ss" }'
    with pytest.raises(InputError, match="give " + mapping.replace("{", r"\{")):
        read(tmp_path, network, {"t": since})
    assert (read(tmp_path, network, {"t": since}, mapping).time == TIME).all()
    over_midnight = (STAMPS + pd.Timedelta(hours=10, minutes=30)).strftime("%H:%M:%S")
    with pytest.raises(InputError, match="goes back from 23:59:50 to 00:00:00 .*; at midnight a time of day begins"):
        read(tmp_path, network, {"t": over_midnight}, mapping)


def test_dates_of_excel_are_days(tmp_path: Path, network: ThermalNetwork) -> None:
    with pytest.raises(InputError, match=r'were dates of Excel meant \(unit = "d"\)'):
        read(tmp_path, network, {"time_s": 45657.5 + TIME / 86400.0})


@pytest.mark.parametrize("start", ["2024-03-31 01:30:00", "2024-10-27 02:05:00"])
def test_a_local_time_that_a_zone_does_not_have_once(tmp_path: Path, network: ThermalNetwork, start: str) -> None:
    texts = (pd.Timestamp(start) + pd.to_timedelta(0.8 * TIME, unit="s")).strftime("%Y-%m-%d %H:%M:%S")
    time = 'time = { column = "t", unit = "iso8601", zone = "Europe/Berlin" }'
    with pytest.raises(InputError, match=r"time does not exist in Europe/Berlin, .*, or comes twice, .*Etc/GMT-1"):
        read(tmp_path, network, {"t": texts}, time)
    assert len(read(tmp_path, network, {"t": texts}, time.replace("Europe/Berlin", "Etc/GMT-1")).time) == 400


def test_decimal_commas_of_the_time_beside_a_text(tmp_path: Path, network: ThermalNetwork) -> None:
    """A line at the end leaves the numbers above it as texts, also without a mapping of the time."""
    read(tmp_path, network, {"time_s": TIME})
    text = (tmp_path / "run.csv").read_text().replace(",", ";").replace(".", ",") + "Schluss\n"
    (tmp_path / "run.csv").write_text(text)
    (tmp_path / "mapping.toml").write_text('schema = 1\ncsv = { separator = ";", decimal = "," }')
    assert (read_recordings(tmp_path / "run.csv", network)[0].time == TIME).all()
