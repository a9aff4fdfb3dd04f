"""Dates in a time zone: the hour that comes twice, zones in some cells, dates without signs, parts by local date."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.names import part_of
from diagnosis.recordings.read import read_recordings
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.time_axis import Clock, inside
from models.base.errors import InputError
from models.simulation.thermal_network import ThermalNetwork

BERLIN = Clock(column="t", unit="iso8601", zone="Europe/Berlin")


def utc(*moment: int) -> float:
    return datetime(*moment, tzinfo=UTC).timestamp()  # type: ignore[arg-type, misc]


@pytest.mark.parametrize("step", [60.0, 97.0, 600.0])
def test_the_hour_that_comes_twice_is_found_where_the_clock_steps_back(step: float) -> None:
    seconds = utc(2025, 10, 25, 22) + step * np.arange(6 * 3600 // step)
    stamps = pd.Series(pd.to_datetime(seconds, unit="s", utc=True))
    texts = stamps.dt.tz_convert("Europe/Berlin").dt.strftime("%Y-%m-%dT%H:%M:%S")
    assert texts.duplicated().any() == (step != 97.0)
    np.testing.assert_array_equal(BERLIN.seconds(texts), seconds)


def test_an_hour_that_may_be_either_is_none() -> None:
    texts = pd.Series(["2025-10-26T01:59:00", "2025-10-26T02:30:00", "2025-10-26T03:10:00"])
    np.testing.assert_array_equal(BERLIN.seconds(texts), [utc(2025, 10, 25, 23, 59), np.nan, utc(2025, 10, 26, 2, 10)])
    spring = BERLIN.seconds(pd.Series(["2025-03-30T01:59:00", "2025-03-30T02:30:00"]))
    np.testing.assert_array_equal(spring, [utc(2025, 3, 30, 0, 59), np.nan])


def test_a_zone_in_a_cell_counts_more_than_that_of_the_mapping() -> None:
    texts = pd.Series(["2025-07-01T12:00:00", "2025-07-01T12:00:10+02:00", "2025-07-01T10:00:20Z", "xx"])
    np.testing.assert_array_equal(BERLIN.seconds(texts), [*(utc(2025, 7, 1, 10, 0, s) for s in (0, 10, 20)), np.nan])


def test_the_date_of_a_clock_that_was_not_set_is_none() -> None:
    there = Clock(column="t", unit="iso8601", zone="America/New_York")
    assert np.isnan(there.seconds(pd.Series(["9999-12-31T23:59:59"]))).all()


def test_a_part_without_a_zone_has_that_of_the_clock() -> None:
    seconds = utc(2025, 7, 1) + 3600.0 * np.arange(-4, 4)
    for text, clock, first in (
        ("2025-07-01T00:00..2025-07-01T02:00", BERLIN, -2),
        ("2025-07-01T00:00Z..2025-07-01T02:00Z", BERLIN, 0),
        ("2025-07-01T00:00..2025-07-01T02:00", Clock(column="t", unit="iso8601"), 0),
    ):
        chosen = seconds[inside(seconds, [part_of(text)], clock, seconds[0])]
        np.testing.assert_array_equal(chosen, utc(2025, 7, 1) + 3600.0 * np.arange(first, first + 2))


# ---------------------------------------------------------------------- from files


def table(rows: int = 200) -> pd.DataFrame:
    time = 10.0 * np.arange(rows)
    return pd.DataFrame({
        "time_s": time, "speed_rpm": np.full(rows, 1500.0), "torque_Nm": np.full(rows, 80.0),
        "T_oil_degC": np.round(22.0 + 40.0 * (1.0 - np.exp(-time / 3000.0)), 1),
    })  # fmt: skip


def read(path: Path, network: ThermalNetwork, mapping: str) -> Recording:
    Path(path.parent, "mapping.toml").write_text(f"schema = 1\n{mapping}")
    return read_recordings([path], network)[0]


def test_dates_without_signs_keep_their_zeros(tmp_path: Path, network: ThermalNetwork) -> None:
    stamps = pd.Timestamp("2025-11-01 12:00") + pd.to_timedelta(table()["time_s"], unit="s")
    rows = table().drop(columns="time_s").assign(stamp=stamps.dt.strftime("%d%m%Y%H%M%S"))
    rows.to_csv(tmp_path / "run.csv", index=False)
    recording = read(tmp_path / "run.csv", network, 'time = { column = "stamp", unit = "%d%m%Y%H%M%S" }')
    assert recording.start == datetime(2025, 11, 1, 12, tzinfo=UTC)
    assert recording.time[-1] == 1990.0


@pytest.mark.parametrize("name", ["run.csv", "run.parquet"])
def test_codes_of_a_logger_are_missing_in_every_kind_of_file(
    tmp_path: Path, network: ThermalNetwork, name: str
) -> None:
    rows = table()
    rows.loc[[20, 90], "torque_Nm"] = -9999.0
    _ = rows.to_csv(tmp_path / name, index=False) if name == "run.csv" else rows.to_parquet(tmp_path / name)
    kept = read(tmp_path / name, network, "")
    (note,) = [note for note in kept.notes if "code of the logger" in note]
    assert "torque_Nm: -9999 N m and the like in rows 21, 91" in note and "within 80" in note
    known = read(tmp_path / name, network, 'missing = ["-9999"]')
    assert not [note for note in known.notes if "code of the logger" in note]
    assert known.inputs["torque"].min() == 80.0


def test_cells_without_time_outside_a_part_do_no_harm(tmp_path: Path, network: ThermalNetwork) -> None:
    rows = table().astype({"time_s": object})
    rows.loc[5, "time_s"] = "?"
    rows.to_csv(tmp_path / "run.csv", index=False)
    (recording,) = read_recordings([f"{tmp_path / 'run.csv'}@500..1000"], network)
    assert len(recording.time) == 50
    with pytest.raises(InputError, match=r"time_s is '\?' at row 6"):
        read_recordings([f"{tmp_path / 'run.csv'}@0..1000"], network)
    with pytest.raises(InputError, match=r"no rows in the part that is named; it goes from 0 to 1990; a recording has"):
        read_recordings([f"{tmp_path / 'run.csv'}@5000..6000"], network)


def test_a_title_above_the_header_is_named(tmp_path: Path, network: ThermalNetwork) -> None:
    (tmp_path / "run.csv").write_text("Run 12 of April\n" + table().to_csv(index=False))
    with pytest.raises(InputError, match=r"line 1 above the header \(line 2: 'time_s', .* skip_lines = \[1\]"):
        read(tmp_path / "run.csv", network, "")
    assert len(read(tmp_path / "run.csv", network, "csv = { skip_lines = [1] }").time) == 200


def test_the_cell_that_is_no_time_is_named_also_with_decimal_commas(tmp_path: Path, network: ThermalNetwork) -> None:
    rows = table().astype({"time_s": str}).assign(time_s=lambda t: t["time_s"].str.replace(".", ","))
    rows.loc[5, "time_s"] = "xx"
    rows.to_csv(tmp_path / "run.csv", index=False, sep=";", decimal=",")
    with pytest.raises(InputError, match="time_s is 'xx' at row 6; 1 of 200 rows hold no time"):
        read(tmp_path / "run.csv", network,
             'time = { column = "time_s", unit = "s" }\ncsv = { separator = ";", decimal = "," }')  # fmt: skip


def test_thousands_are_no_decimals(tmp_path: Path, network: ThermalNetwork) -> None:
    rows = table().assign(time_s=lambda t: (t["time_s"] + 1000.0).map("{:,.0f}".format))
    rows.to_csv(tmp_path / "run.csv", index=False)
    with pytest.raises(InputError, match="time_s is '1,000' at row 1; 200 of 200 rows hold no time"):
        read(tmp_path / "run.csv", network, "")


def test_a_code_is_noted_where_it_is_beyond_what_is_usual(tmp_path: Path, network: ThermalNetwork) -> None:
    for code, noted in ((-9999.0, True), (-9000.0, False)):  # of 4670 1/min both are possible
        rows = table().assign(speed_rpm=4670.0)
        rows.loc[20, "speed_rpm"] = code
        rows.to_csv(tmp_path / "run.csv", index=False)
        found = read(tmp_path / "run.csv", network, "")
        assert any("speed_rpm: -9999 1/min" in note and "code of the logger" in note for note in found.notes) is noted


def test_columns_next_to_mapped_ones(tmp_path: Path, network: ThermalNetwork) -> None:
    """A second sensor stands next to the standard column; a column that replaces it is named."""
    rows = table().assign(second=table()["T_oil_degC"] + 1.0, n=table()["speed_rpm"])
    rows.to_csv(tmp_path / "run.csv", index=False)
    found = read(tmp_path / "run.csv", network, """
        [columns]
        second = { quantity = "T_oil", sensor = "B" }
        n = { quantity = "speed" }
        """)  # fmt: skip
    assert {"oil", "oil__B"} <= {channel.name for channel in found.channels}
    assert "not used, because the mapping takes other columns for them: speed_rpm" in found.notes


def test_an_input_has_one_column(tmp_path: Path, network: ThermalNetwork) -> None:
    """Else the default of the definition would take its place without a word."""
    table().to_csv(tmp_path / "run.csv", index=False)
    with pytest.raises(InputError, match="sensor = 'hall' .* T_ambient is an input and has one column"):
        read(tmp_path / "run.csv", network, 'columns = { T_oil_degC = { quantity = "T_ambient", sensor = "hall" } }')


def test_a_decimal_point_where_a_comma_is_stated(tmp_path: Path, network: ThermalNetwork) -> None:
    table().to_csv(tmp_path / "run.csv", index=False, sep=";")
    with pytest.raises(InputError, match="its decimal sign is a point"):
        read(tmp_path / "run.csv", network, 'csv = { separator = ";", decimal = "," }')
