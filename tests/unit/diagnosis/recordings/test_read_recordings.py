"""Recordings: what is read, converted, cleaned, bridged and noted, and which rows count."""

from __future__ import annotations

import hashlib
import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.names import part_of
from diagnosis.recordings.read import named_apart, read_by_role, read_recordings
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.shared_rows import check_shared_rows
from models.base.errors import InputError
from models.quantities.units import INSIDE, units_in_files
from models.simulation.thermal_network import ThermalNetwork


def table(rows: int = 200, step: float = 10.0, seed: int = 0) -> pd.DataFrame:
    """A believable recording: warming up at a speed that changes now and then."""
    rng = np.random.default_rng(seed)
    time = step * np.arange(rows)
    speed = 1500.0 + 500.0 * (np.arange(rows) // 40 % 3)
    warm = 40.0 * (1.0 - np.exp(-time / 3000.0))
    return pd.DataFrame({
        "time_s": time,
        "speed_rpm": speed,
        "torque_Nm": np.full(rows, 80.0),
        "T_ambient_degC": np.round(22.0 + rng.normal(0.0, 0.1, rows), 1),
        "T_oil_degC": np.round(22.0 + warm + rng.normal(0.0, 0.2, rows), 1),
        "T_pinion_degC": np.round(22.0 + 1.1 * warm + rng.normal(0.0, 0.2, rows), 1),
        "P_loss_W": np.round(0.02 * speed * np.pi / 30.0 * 80.0 + rng.normal(0.0, 3.0, rows), 1),
    })  # fmt: skip


def write(path: Path, content: pd.DataFrame) -> Path:
    if path.suffix == ".parquet":
        content.to_parquet(path)
    else:
        content.to_csv(path, index=False)
    return path


def read(path: Path | str, network: ThermalNetwork, mapping: str = "", **options: object) -> Recording:
    if mapping:
        (Path(str(path).partition("@")[0]).parent / "mapping.toml").write_text("schema = 1\n" + mapping)
    return read_recordings([path], network, **options)[0]  # type: ignore[arg-type]


def channel(recording: Recording, name: str) -> np.ndarray:
    return next(c.values for c in recording.channels if c.name == name)


# ---------------------------------------------------------------------- reading


@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz", "run.parquet"])
def test_the_same_recording_from_every_kind_of_file(tmp_path: Path, network: ThermalNetwork, name: str) -> None:
    source = table()
    recording = read(write(tmp_path / name, source), network)
    assert recording.name == "run"
    np.testing.assert_array_equal(recording.time, source["time_s"])
    np.testing.assert_array_equal(recording.inputs["speed"], source["speed_rpm"])
    assert [c.name for c in recording.channels] == ["oil", "pinion", "P_loss"]
    np.testing.assert_array_equal(channel(recording, "oil"), source["T_oil_degC"])
    assert {c.name: c.resolution for c in recording.channels} == {"oil": 0.1, "pinion": 0.1, "P_loss": 0.1}
    assert recording.segments == (slice(0, 200),)
    assert set(recording.inputs) == {*network.inputs}
    assert any("air_speed_m_s was not recorded" in note for note in recording.notes)


def test_an_mdf_file_with_slow_channels(tmp_path: Path, network: ThermalNetwork) -> None:
    asammdf = pytest.importorskip("asammdf")
    source = table()
    time = source["time_s"].to_numpy()
    slow = slice(3, None, 6)
    mdf = asammdf.MDF(version="4.10")
    signal = asammdf.Signal
    mdf.append([signal(source["speed_rpm"].to_numpy(), time, name="speed_rpm", unit="rpm"),
                signal(source["torque_Nm"].to_numpy(), time, name="torque_Nm", unit="Nm")])  # fmt: skip
    mdf.append([signal(source["T_oil_degC"].to_numpy()[slow] + 273.15, time[slow] + 1.0, name="T_oil_degC", unit="K")])
    mdf.append([signal(source["T_pinion_degC"].to_numpy()[slow], time[slow] - 1.0, name="T_pinion_degC")])
    mdf.save(tmp_path / "run.mf4", overwrite=True)
    mdf.close()
    recording = read(tmp_path / "run.mf4", network)
    oil = channel(recording, "oil")
    assert np.isfinite(oil).sum() == len(time[slow])
    np.testing.assert_allclose(oil[slow], source["T_oil_degC"].to_numpy()[slow], atol=1e-9)
    np.testing.assert_array_equal(channel(recording, "pinion")[slow], source["T_pinion_degC"].to_numpy()[slow])
    np.testing.assert_array_equal(recording.inputs["speed"], source["speed_rpm"])
    assert recording.start is not None


@pytest.mark.parametrize("unit", ["iso8601", "%d.%m.%Y %H:%M:%S"])
def test_local_time_with_its_zone(tmp_path: Path, network: ThermalNetwork, unit: str) -> None:
    """Through the night in which clocks are set back: the rows tell the first of the two hours from the second."""
    source = table(rows=60).drop(columns="time_s")
    utc = pd.date_range("2017-10-28T22:00Z", periods=len(source), freq="10min")
    form = "%Y-%m-%dT%H:%M:%S" if unit == "iso8601" else unit
    how = f'{{ column = "local", unit = "{unit}", zone = "Europe/Berlin" }}'
    (tmp_path / "run.toml").write_text(f"schema = 1\ntime = {how}\n")
    local = source.assign(local=utc.tz_convert("Europe/Berlin").strftime(form))
    recording = read(write(tmp_path / "run.csv", local), network)
    assert recording.start == datetime(2017, 10, 28, 22, tzinfo=UTC) and "time zone" not in str(recording.notes)
    np.testing.assert_allclose(recording.time, 600.0 * np.arange(len(source)))
    for time, says in (('"local", zone = "Berlin"', "'Berlin' is no time zone; write it as 'Europe/Berlin'"),
                       ('"speed_rpm", zone = "UTC"', "speed_rpm counts s, which have no time zone: give")):  # fmt: skip
        (tmp_path / "run.toml").write_text(f"schema = 1\ntime = {{ column = {time} }}\n")
        with pytest.raises(InputError, match=says):
            read(tmp_path / "run.csv", network)


def test_iso_times_and_their_start(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    stamps = pd.Timestamp("2017-09-01T08:00:00", tz="+02:00") + pd.to_timedelta(source["time_s"], unit="s")
    source = source.rename(columns={"time_s": "time_utc"}).assign(time_utc=[s.isoformat() for s in stamps])
    recording = read(write(tmp_path / "run.csv", source), network)
    assert recording.start == datetime(2017, 9, 1, 6, tzinfo=UTC)
    assert recording.time[-1] == 1990.0
    part = read(f"{tmp_path / 'run.csv'}@100..200", network)  # seconds since the first row
    assert (part.start, len(part.time)) == (datetime(2017, 9, 1, 6, 1, 40, tzinfo=UTC), 10)
    parquet = source.assign(time_utc=pd.to_datetime(source["time_utc"]))
    assert read(write(tmp_path / "run.parquet", parquet), network).start == recording.start
    assert not any("time zone" in note for note in recording.notes)
    local = read(write(tmp_path / "local.csv", source.assign(time_utc=source["time_utc"].str[:-6])), network)
    assert local.start == datetime(2017, 9, 1, 8, tzinfo=UTC) and any("time zone" in note for note in local.notes)
    (tmp_path / "de.toml").write_text('schema = 1\ntime = { column = "time_utc", unit = "%d.%m.%Y %H:%M:%S" }\n')
    german = read(
        write(tmp_path / "de.csv", source.assign(time_utc=[f"{s:%d.%m.%Y %H:%M:%S}" for s in stamps])), network
    )
    assert german.start == local.start and german.time[-1] == 1990.0


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("T_oil", "T_oil_degC"),
        ("oil_temp", "T_oil_degC"),
        ("Temperature oil [K]", "T_oil_degC"),
        ("upper_housing_temp", "T_housing_upper_degC"),
        ("P_loss", "P_loss_W"),
        ("T_ambient", "T_ambient_degC"),
    ],
)
def test_a_column_under_another_name_is_not_lost(
    tmp_path: Path, network: ThermalNetwork, given: str, meant: str
) -> None:
    source = table().assign(T_housing_upper_degC=30.0)
    with pytest.raises(InputError, match=rf"column {re.escape(given)} is not known; did you mean '{meant}'"):
        read(write(tmp_path / "run.csv", source.rename(columns={meant: given})), network)


def test_columns_that_nothing_asks_for_are_noted(tmp_path: Path, network: ThermalNetwork) -> None:
    extra = table().assign(T_cover_degC=20.0, oil=1.0, flow=3.0)
    recording = read(write(tmp_path / "run.csv", extra), network)
    assert "not used, being no input and no node of this gearbox: T_cover_degC, oil, flow" in recording.notes
    many = table().assign(**{f"x{i}": 1.0 for i in range(15)})
    (note,) = (n for n in read(write(tmp_path / "many.csv", many), network).notes if "not used" in n)
    assert note.endswith("x11 and 3 more")


def test_parts_of_a_file(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    path = write(tmp_path / "run.csv", source.assign(time_s=source["time_s"] + 100.0))
    first, second = read_recordings([f"{path}@100..600", f"{path}@600.."], network)
    assert (len(first.time), len(second.time)) == (50, 150)  # the end does not belong to a part
    assert first.name != second.name
    check_shared_rows([first], [second])
    with pytest.raises(InputError, match="is held out, but has the rows of 500 ... 590 s in common with"):
        check_shared_rows([first], read_recordings([f"{path}@500..700"], network))


def test_a_date_as_the_end_of_a_part_includes_its_day() -> None:
    assert part_of("2017-09-01..2017-09-02") == part_of("2017-09-01T00:00..2017-09-03T00:00")


@pytest.mark.parametrize("name", ["run.csv", "run.parquet"])
def test_rows_are_counted_through_all_parts_of_a_file(
    tmp_path: Path, network: ThermalNetwork, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr("models.files.table_file.CHUNK_ROWS", 30)
    source = table()
    source.loc[130, "torque_Nm"] = np.inf
    with pytest.raises(InputError, match="torque_Nm is inf in row 131"):
        read(write(tmp_path / name, source), network)


def test_names_stay_different(tmp_path: Path, network: ThermalNetwork) -> None:
    paths = []
    for folder in ("rig_1", "rig_2"):
        (tmp_path / folder).mkdir()
        paths.append(write(tmp_path / folder / "train.csv", table(seed=len(paths))))
    assert [r.name for r in read_recordings(paths, network)] == ["rig_1_train", "rig_2_train"]


# ---------------------------------------------------------------------- mapping


def test_a_mapping_names_converts_and_describes(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    logged = pd.DataFrame({
        "t": source["time_s"] / 60.0,
        "n": source["speed_rpm"] * np.pi / 30.0,
        "M": source["torque_Nm"] / 2.0e3,
        "sump": source["T_oil_degC"] * 1.8 + 32.0,
        "loss": source["P_loss_W"] / 1e3,
        "valve": source["T_oil_degC"],
    })  # fmt: skip
    recording = read(write(tmp_path / "run.csv", logged), network, """
        time = { column = "t", unit = "min" }
        constants = { T_ambient = 22.0 }
        [columns]
        n = { quantity = "speed", unit = "rad/s" }
        M = { quantity = "torque", unit = "kN m", scale = 2.0, gain_sd = 0.002 }
        loss = { quantity = "P_loss", unit = "kW", gain_sd = 0.01, bias_sd = 3.0 }
        [columns.sump]
        quantity = "T_oil"
        unit = "degF"
        noise = 0.2
        resolution = 0.1
        lag_s = 15
        lag_sd_s = 5
        bias_sd = 0.5
        """)  # fmt: skip
    np.testing.assert_allclose(recording.time, source["time_s"], atol=1e-9)
    np.testing.assert_allclose(recording.inputs["speed"], source["speed_rpm"])
    np.testing.assert_allclose(recording.inputs["torque"], 80.0)
    assert set(recording.inputs["T_ambient"]) == {22.0}
    oil, loss = ({c.name: c for c in recording.channels}[name] for name in ("oil", "P_loss"))
    np.testing.assert_allclose(oil.values, source["T_oil_degC"])
    assert (oil.noise, oil.resolution, oil.lag_s, oil.lag_sd_s, oil.bias_sd) == (0.2, 0.1, 15.0, 5.0, 0.5)
    np.testing.assert_allclose(channel(recording, "P_loss"), source["P_loss_W"])
    assert (loss.gain_sd, loss.bias_sd, recording.tolerances) == (0.01, 3.0, {"torque": 0.002})


def test_a_text_of_another_logger(tmp_path: Path, network: ThermalNetwork) -> None:
    """Semicolons, decimal commas, texts for missing values, another encoding, a remark, a line of units."""
    source = table().rename(columns={"T_oil_degC": "Öl"})
    source.loc[5, "Öl"] = np.nan
    header, *rows = source.to_csv(index=False, sep=";", decimal=",", na_rep="Bad", lineterminator="\n").splitlines()
    text = "\n".join(["Prüfstand 3, 20 °C", "", header, ";".join("x" for _ in source.columns), *rows, ""])
    (tmp_path / "run.csv").write_bytes(text.encode("cp1252"))
    form = 'csv = { separator = ";", decimal = ",", encoding = "cp1252", skip_lines = [1, 4] }\nmissing = ["Bad"]\n'
    recording = read(tmp_path / "run.csv", network, f'{form}columns."\\u00d6l".quantity = "T_oil"\n')
    np.testing.assert_array_equal(channel(recording, "oil"), source["Öl"])
    assert list(recording.rows[:2]) == [1, 2]
    with pytest.raises(InputError, match=r"line 4 \(below the header\) .* skip_lines = \[1, 4\]"):
        read(tmp_path / "run.csv", network, form.replace("[1, 4]", "[1]"))


def test_rows_and_valid_range_of_a_mapping(tmp_path: Path, network: ThermalNetwork) -> None:
    mapping = """rows = ["0..500", "1000.."]
        [columns.T_oil_degC]
        quantity = "T_oil"
        rows = ["1000.."]
        valid = [0, 45]
        """
    source = table()
    recording = read(write(tmp_path / "run.csv", source), network, mapping)
    assert (len(recording.time), len(recording.segments)) == (150, 2)
    oil = channel(recording, "oil")
    kept = source["T_oil_degC"].to_numpy()[100:]
    assert np.isnan(oil[:50]).all()
    np.testing.assert_array_equal(oil[50:], np.where(kept > 45.0, np.nan, kept))


def test_the_own_mapping_comes_before_that_of_the_folder_and_a_definition_is_none(
    tmp_path: Path, network: ThermalNetwork
) -> None:
    path = write(tmp_path / "run.csv", table().rename(columns={"T_oil_degC": "sump"}))
    (tmp_path / "mapping.toml").write_text('schema = 1\n[columns.sump]\nquantity = "auxiliary"\n')
    (tmp_path / "run.toml").write_text("schema = 1\n[[stage]]\n")
    assert "oil" not in {c.name for c in read(path, network).channels}
    (tmp_path / "run.toml").write_text('schema = 1\n[columns.sump]\nquantity = "T_oil"\n')
    assert "oil" in {c.name for c in read(path, network).channels}


# What a number of 10 in each unit is inside: s, 1/min, N m, degC, m/s, W.
TEN = {
    "time": {"s": 10.0, "ms": 0.01, "us": 1e-5, "µs": 1e-5, "ns": 1e-8, "min": 600.0, "h": 36_000.0, "d": 864_000.0},
    "speed": {"1/min": 10.0, "rpm": 10.0, "RPM": 10.0, "r/min": 10.0, "U/min": 10.0, "min^-1": 10.0,
              "min-1": 10.0, "rev/min": 10.0, "rad/s": 95.492965855, "1/s": 600.0, "Hz": 600.0, "deg/s": 1.6666666667},
    "torque": {"N m": 10.0, "N.m": 10.0, "Nm": 10.0, "N·m": 10.0, "N*m": 10.0, "kN m": 1e4, "kN.m": 1e4,
               "kNm": 1e4, "N mm": 0.01, "lbf ft": 13.558179483, "lbf in": 1.1298482903},
    "temperature": {"degC": 10.0, "°C": 10.0, "C": 10.0, "K": -263.15, "degK": -263.15, "°K": -263.15,
                    "Kelvin": -263.15, "kelvin": -263.15, "℃": 10.0, "deg C": 10.0, "Deg C": 10.0,
                    **dict.fromkeys(("degF", "°F", "F", "℉", "deg F", "Deg F"), -12.222222222)},
    "air speed": {"m/s": 10.0, "km/h": 2.7777777778, "mph": 4.4704, "ft/s": 3.048},
    "power": {"W": 10.0, "kW": 1e4, "MW": 1e7, "mW": 0.01, "hp": 7456.9987},
}  # fmt: skip


def test_every_unit_is_what_it_says() -> None:
    found = {
        d: {u: 10.0 * factor + offset for u, (factor, offset) in units.items()}
        for d, units in ((d, units_in_files(d, INSIDE[d])) for d in TEN)
    }
    for dimension, values in TEN.items():
        assert found[dimension] == pytest.approx(values, rel=1e-9), dimension


# ---------------------------------------------------------------------- cleaning


def test_gaps_split_and_short_holes_are_bridged(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    source.loc[10:12, "speed_rpm"] = np.nan  # 40 s
    source.loc[50:70, "torque_Nm"] = np.nan  # 220 s
    source = source.drop(index=range(120, 140))
    recording = read(write(tmp_path / "run.csv", source), network)
    assert recording.inputs["speed"][11] == 1500.0
    assert len(recording.time) == 200 - 20 - 21
    assert [(rows.start, rows.stop) for rows in recording.segments] == [(0, 50), (50, 99), (99, 159)]
    assert all(np.isfinite(values).all() for values in recording.inputs.values())
    assert any("torque_Nm is missing in 21 of 180 rows" in n and "rows 51-71" in n for n in recording.notes)
    assert any("bridged where shorter than 60 s (max_gap_s)" in n for n in recording.notes)
    longer = read(tmp_path / "run.csv", network, "max_gap_s = 600\n")
    assert longer.segments == (slice(0, 180),)


def test_cleaning_is_reported_with_rows(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    source.loc[30, "T_oil_degC"] = -999.0
    source.loc[60, "T_pinion_degC"] = 180.0
    recording = read(write(tmp_path / "run.csv", source), network)
    assert np.isnan(channel(recording, "oil")[30])
    assert np.isnan(channel(recording, "pinion")[60])
    notes = "\n".join(recording.notes)
    assert "T_oil_degC: 1 of 200 values (row 31) outside" in notes
    assert "T_pinion_degC: outliers and dropouts in row 61, 1 in all, taken as missing" in notes


def test_a_comment_between_rows_is_skipped_and_a_hash_in_a_cell_is_not(tmp_path: Path, network: ThermalNetwork) -> None:
    lines = table().to_csv(index=False).splitlines()
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["# rig 7", *lines[:50], "# coffee", *lines[50:]]))
    assert len(read(path, network).time) == 200
    path.write_text("\n".join(["# rig 7", *lines[:50], lines[50].replace(",80.0,", ",#REF!,"), *lines[51:]]))
    with pytest.raises(InputError, match=r"torque_Nm holds '#REF!' at row 50"):
        read(path, network)


# ---------------------------------------------------------------------- what counts once


def test_a_copy_in_another_form_is_still_the_same_rows(tmp_path: Path, network: ThermalNetwork) -> None:
    train = read_recordings([write(tmp_path / "a.csv", table())], network)
    copy = table().iloc[60:].reset_index(drop=True)
    copy["time_s"] = copy["time_s"] - copy["time_s"].iloc[0]
    held = read_recordings([write(tmp_path / "b.parquet", copy)], network)
    with pytest.raises(
        InputError, match=r"b.parquet: is held out, but has \d+ of \d+ distinct rows in common with .*a"
    ):
        check_shared_rows(train, held)
    check_shared_rows(train, read_recordings([write(tmp_path / "c.csv", table(seed=1))], network))


def test_a_baseline_is_not_a_recording_that_is_learnt_from_or_held_out(tmp_path: Path, network: ThermalNetwork) -> None:
    path = write(tmp_path / "a.csv", table())
    before, after = (read_recordings([f"{path}@{part}"], network) for part in ("0..900", "901..1990"))
    check_shared_rows(after, (), before)
    train, held, healthy = read_by_role([path], [], [path], network)
    assert [r.name for r in (*train, *held, *healthy)] == ["a", "a_baseline"]
    for roles in ((train, ()), ((), train)):
        with pytest.raises(InputError, match=r"a.csv: is a baseline, but has the rows of 0 ... 1990 s in common"):
            check_shared_rows(*roles, healthy)


def test_names_of_recordings_differ_whatever_their_role(tmp_path: Path, network: ThermalNetwork) -> None:
    one = read_recordings([write(tmp_path / "a.csv", table())], network)
    named = named_apart((*one, *one), one, (*one, *one))
    assert [[r.name for r in role] for role in named] == [["a", "a_2"], ["a_held_out"], ["a_baseline", "a_baseline_2"]]


def test_a_mapping_states_the_session(tmp_path: Path, network: ThermalNetwork) -> None:
    path = write(tmp_path / "a.csv", table())
    assert read(path, network).session == ""
    assert read(path, network, 'session = "before the overhaul"\n').session == "before the overhaul"


def test_a_recording_named_twice_is_refused(tmp_path: Path, network: ThermalNetwork) -> None:
    path = write(tmp_path / "a.csv", table())
    with pytest.raises(InputError, match="a.csv: has the rows of 0 ... 1990 s in common with .*; name every row once"):
        check_shared_rows(read_recordings([path, path], network))


def test_faults_of_all_files_come_at_once(tmp_path: Path, network: ThermalNetwork) -> None:
    one = write(tmp_path / "one.csv", table().drop(columns="torque_Nm").assign(T_oil_degC=np.nan))
    two = write(tmp_path / "two.csv", table().assign(time_s=1.0))
    with pytest.raises(InputError) as caught:
        read_recordings([one, two], network)
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    for part in ("one.csv: column torque_Nm is missing", "one.csv: T_oil_degC has no value", "two.csv: time_s is 1"):
        assert any(part in line for line in lines), part


# ---------------------------------------------------------------------- real and foreign recordings


MAPPING_OF_THE_WIND_TURBINES = """
time = { column = "time_utc", unit = "iso8601" }
[columns]
Ds_avg = { quantity = "speed", unit = "rpm" }
Cm_avg = { quantity = "torque", unit = "N.m" }
Yt_avg = { quantity = "T_ambient", unit = "degC" }
Gost_avg = { quantity = "T_oil", unit = "degC", noise = 0.3 }
Gb1t_avg = { quantity = "T_bearing_1", unit = "degC" }
Gb2t_avg = { quantity = "T_bearing_3", unit = "degC" }
"""


def test_two_real_wind_turbine_gearboxes(tmp_path: Path, network: ThermalNetwork, recordings_folder: Path) -> None:
    mapping = tmp_path / "mapping.toml"
    mapping.write_text("schema = 1\n" + MAPPING_OF_THE_WIND_TURBINES)
    folder = recordings_folder / "la_haute_borne"
    for turbine, rows in (("R80721", 40_675), ("R80736", 41_602)):
        whole = read_recordings([folder / f"{turbine}.csv.gz"], network, mapping=mapping)[0]
        assert 0.98 * rows < len(whole.time) <= rows
        assert len(whole.segments) > 10
        removed = sum(int(np.isnan(c.values).sum()) for c in whole.channels)
        assert removed < 40  # glitches of the logger; a wave of ten-minute means is none
        autumn = read_recordings([f"{folder / turbine}.csv.gz@2017-09-01..2017-10-31"], network, mapping=mapping)[0]
        assert autumn.start == datetime(2017, 9, 1, tzinfo=UTC)
        assert 60.0 < autumn.time[-1] / 86400.0 < 61.0
        assert autumn.inputs["speed"].max() < 2000.0


# ---------------------------------------------------------------------- several files of one recording


def test_files_of_one_recording_are_joined_in_the_order_of_time(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    first, second = write(tmp_path / "a.csv", source[:120]), write(tmp_path / "b.parquet", source[120:])
    whole = read(write(tmp_path / "whole.csv", source), network)
    joined = read(f"{second}+{first}", network)
    assert (joined.name, joined.files, joined.path.name) == ("b", (first, second), "a.csv+b.parquet")
    assert "joined from a.csv (rows 1-120), b.parquet (rows 121-200)" in joined.notes
    np.testing.assert_array_equal(joined.time, whole.time)
    np.testing.assert_array_equal(channel(joined, "oil"), channel(whole, "oil"))
    assert joined.segments == (slice(0, 200),)
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in (first, second)]
    assert read(first, network).sha256 == digests[0]
    assert joined.sha256 == hashlib.sha256("".join(digests).encode()).hexdigest()
    part = read(f"{first}+{second}@1000..1500", network)
    assert (part.from_s, part.to_s, len(part.time)) == (1000.0, 1490.0, 50)


def test_a_column_that_one_of_the_files_lacks_is_missing_there(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    first = write(tmp_path / "a.csv", source[:120].drop(columns="T_pinion_degC"))
    joined = read(f"{first}+{write(tmp_path / 'b.csv', source[120:])}", network)
    assert np.isnan(channel(joined, "pinion")[:120]).all()
    assert np.isfinite(channel(joined, "pinion")[120:]).all()


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")])
def test_a_constant_holds_for_the_file_whose_mapping_states_it(
    tmp_path: Path, network: ThermalNetwork, order: tuple[str, str]
) -> None:
    source = table().assign(T_ambient_degC=35.0)
    first = write(tmp_path / "a.csv", source[:120].drop(columns="T_ambient_degC"))
    first.with_suffix(".toml").write_text("schema = 1\nconstants = { T_ambient = 20.0 }\n")
    write(tmp_path / "b.csv", source[120:])
    ambient = read("+".join(str(tmp_path / f"{name}.csv") for name in order), network).inputs["T_ambient"]
    assert set(ambient[:120]) == {20.0} and set(ambient[120:]) == {35.0}


def test_files_that_overlap_are_refused(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    first, second = write(tmp_path / "a.csv", source[:120]), write(tmp_path / "b.csv", source[110:])
    with pytest.raises(InputError, match=r"b.csv: begins at 1100, before .*a.csv ends at 1190 .* follow each other"):
        read(f"{first}+{second}", network)


def test_files_of_two_clocks_are_refused(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()
    dated = source[120:].assign(time=pd.to_datetime(source["time_s"], unit="s", utc=True).map(lambda t: t.isoformat()))
    first = write(tmp_path / "a.csv", source[:120])
    second = write(tmp_path / "b.csv", dated.drop(columns="time_s"))
    with pytest.raises(InputError, match=r"b.csv: its time \(time\) and .*a.csv \(time_s\) are not of one kind"):
        read(f"{first}+{second}", network)
    without = write(tmp_path / "c.csv", source[120:].drop(columns="time_s"))
    with pytest.raises(InputError, match=r"c.csv: .*time"):
        read(f"{first}+{without}", network)


def test_a_file_whose_name_has_a_plus_or_an_at_is_a_file(tmp_path: Path, network: ThermalNetwork) -> None:
    for name in ("a.csv+b.csv", "run@rig.csv"):
        assert read(write(tmp_path / name, table()), network).files == (tmp_path / name,)
