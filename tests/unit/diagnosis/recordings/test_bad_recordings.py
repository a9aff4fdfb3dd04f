"""Bad recordings: one case per rule, each refused with file, column, rows and what to do; none breaks the reader."""

from __future__ import annotations

import gzip
import random
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builder.__main__ import main
from diagnosis.recordings.read import read_recordings
from models.base.errors import InputError
from models.simulation.thermal_network import ThermalNetwork

ROWS = 60


def sound() -> pd.DataFrame:
    time = 10.0 * np.arange(ROWS)
    warm = 30.0 * (1.0 - np.exp(-time / 600.0))
    wave = np.sin(time / 70.0)
    return pd.DataFrame({
        "time_s": time,
        "speed_rpm": 2000.0 + 100.0 * wave,
        "torque_Nm": 80.0 + 5.0 * wave,
        "T_ambient_degC": 22.0 + 0.2 * wave,
        "T_oil_degC": 22.0 + warm,
        "T_housing_lower_degC": 22.0 + 0.9 * warm,
        "T_bearing_1_degC": 23.0 + warm,
        "P_loss_W": 350.0 + 10.0 * wave,
    }).round(2)  # fmt: skip


def text(change: Callable[[pd.DataFrame], pd.DataFrame] = lambda table: table) -> str:
    return str(change(sound()).to_csv(index=False))


def cell(row: int, column: str, value: str) -> str:
    table = sound().astype(object)
    table.loc[row, column] = value
    return str(table.to_csv(index=False))


def with_column(name: str, values: object) -> str:
    return text(lambda t: t.assign(**{name: values}))


def below_header(*rows: str) -> str:
    header, *numbers = text().splitlines()
    return "\n".join([header, *rows, *numbers])


def dated(change: Callable[[list[str]], list[str]]) -> str:
    times = pd.Timestamp("2017-10-29") + pd.to_timedelta(sound()["time_s"], unit="s")
    stamps = [stamp.isoformat() + "Z" for stamp in times]
    return text(lambda t: t.rename(columns={"time_s": "time_utc"}).assign(time_utc=change(stamps)))


T, W, LONG = sound()["T_oil_degC"], np.arange(ROWS), text().splitlines()[20]

# Content of run.csv, and parts of the message.
FILES: list[tuple[str | bytes, tuple[str, ...]]] = [
    # cells
    (cell(3, "T_oil_degC", "#REF!"), ("T_oil_degC holds '#REF!' at row 4, which is no number", 'missing = ["#REF!"]')),
    (cell(4, "torque_Nm", "12,5"), ("torque_Nm", "row 5", "decimal commas")),
    (cell(4, "speed_rpm", "1,500.0"), ("'1,500.0' at row 5", "without thousands separators")),
    (cell(4, "speed_rpm", "1'500"), ("1'500", "without thousands separators")),
    (cell(9, "speed_rpm", "inf"), ("speed_rpm is inf in row 10",)),
    (with_column("T_oil_degC", np.nan), ("T_oil_degC has no value in any of its 60",)),
    (with_column("T_oil_degC", "on"), ("T_oil_degC", "60 such cells, rows 1-60")),
    (with_column("T_oil_degC", True), ("T_oil_degC holds bool", "rows 1-60")),
    (cell(20, "time_s", "12:30"), ("time_s is '12:30' at row 21", "hold no time")),
    # columns
    (text(lambda t: t.drop(columns="time_s")), ("column time_s is missing; it has:",)),
    (text(lambda t: t.drop(columns="torque_Nm")),
     ("column torque_Nm is missing; it has:", "constants = { torque = ... }")),
    (text(lambda t: t[["time_s", "speed_rpm", "torque_Nm"]]), ("no temperature was measured", "T_<node>_degC")),
    (text(lambda t: t.rename(columns={"T_oil_degC": "T_oill_degC"})), ("T_oill_degC", "did you mean 'T_oil_degC'")),
    (text(lambda t: t.rename(columns={"P_loss_W": "P_loss"})),
     ("P_loss", "did you mean 'P_loss_W'? Rename it if it is in W", 'quantity = "P_loss" and its unit')),
    (text(lambda t: t.assign(x=1.0).rename(columns={"x": "T_oil_degC"})), ("column T_oil_degC is there twice",)),
    # ranges
    (with_column("T_oil_degC", T + 273.15), ("T_oil_degC is 295", "rows 1-60", "looks like kelvin", 'unit = "K"')),
    (with_column("T_oil_degC", T + 273.15 * (W >= 40)), ("20 of 60 values", "rows 41-60", "looks like kelvin")),
    (with_column("T_ambient_degC", 0.5 * T + 215.0), ("T_ambient_degC", "looks like kelvin")),
    (with_column("T_oil_degC", T.where(W < 20, 999.0)), ("40 of 60 values", "rows 21-60", "-90 ... 250 degC")),
    (with_column("speed_rpm", 2e6 + W), ("speed_rpm", "60 of 60", "1/min")),
    (with_column("air_speed_m_s", -1.0 - W), ("air_speed_m_s", "rows 1-60")),
    # time
    (text(lambda t: t.assign(time_s=t["time_s"].where(W != 17, -5.0))), ("time_s goes back", "row 18", "1 times")),
    (dated(lambda s: ["0001-01-01T00:00:00Z", *s[1:]]), ("time_utc goes on over 2017 years",)),
    (dated(lambda s: [*s[:18], s[17], *s[19:]]), ("again at row 19", "set back in autumn")),
    (text(lambda t: pd.concat([t[:18], t[17:]])),
     ("time_s is 170.0 at row 18 and again at row 19", "remove the repeated rows")),
    (with_column("time_s", 60.0 * (W // 6)), ("again at row 2 (50 times", "coarser than the rows lie apart")),
    (with_column("time_s", 1e3 * sound()["time_s"] + 1.0), ("advances by 1e+04 s", "were milliseconds meant")),
    (with_column("time_s", 1.5e12 + sound()["time_s"]), ("time_s reaches 1.5e+12 s", "milliseconds")),
    (with_column("time_s", W / 3.6e5), ("hours or days meant",)),
    (text(lambda t: t.rename(columns={"time_s": "time"})), ("column time is no ISO 8601",)),
    (text(lambda t: t[:0]), ("has no rows",)),
    (text(lambda t: t[:0].rename(columns={"time_s": "time"})), ("has no rows",)),
    (text(lambda t: t[:2]), ("has 2 rows",)),
    (dated(lambda s: [*s[:30], "29.10.2017 00:05", *s[31:]]), ("time_utc", "row 31", "ISO 8601")),
    (dated(lambda s: [*s[:30], *(t.removesuffix("Z") for t in s[30:])]), ("time zone", "rows 1 and 31")),
    (dated(lambda s: [*s[:30], *s[20:50]]), ("time_utc goes back", "row 31", "needs its zone")),
    (with_column("torque_Nm", sound()["torque_Nm"].where(W < 2)), ("only 4 of rows 1-60 have torque_Nm",)),
    (text(lambda t: t.assign(speed_rpm=t["speed_rpm"].where(W < 25), torque_Nm=t["torque_Nm"].where(W > 45))),
     ("only 0 of rows 1-60 have speed_rpm and torque_Nm",)),
    # the text itself
    (b"", ("is empty",)),
    (b"# a\n\n", ("is empty",)),
    ("\n".join(text().splitlines()[1:]), ("first line holds numbers",)),
    (text().replace(",", ";"), ("separated by ';'", 'csv = { separator = ";", decimal = "." } in a mapping file')),
    (text().replace(",", ";").replace(".", ","), ('csv = { separator = ";", decimal = "," } in a mapping file',)),
    (text().replace(",", "|"), ("separated by '|'",)),
    (text().replace(",", " "), ("separated by spaces",)),
    (text().replace(",", "\t"), ("separated by tabs", r'separator = "\t"')),
    (text()[:300].encode() + b"\0", ("NUL byte in line",)),
    (text()[:300].encode() + b"\xb0C", ("0xb0 in line", "UTF-8", 'encoding = "cp1252"')),
    (text().encode("utf-16-le"), ("looks like UTF-16 without a mark", 'encoding = "utf-16-le"')),
    (b"PK\x03\x04\x14\0", ("is an Excel workbook or a zip archive, no text",)),
    ("# a remark\n" + text().replace(LONG, LONG + ",5"), ("line 22 has 9 fields, but the header names 8 columns",)),
    (text().replace("\n", ",1\n").replace("W,1", "W"), ("line 2 has 9 fields",)),
    (below_header("s,1/min,Nm,degC,degC,degC,degC,W", "float,float,float,float,float,float,float,float"),
     ("line 3 (below the header) holds units or texts", "'float'", "skip_lines = [3]")),
    (below_header("a,b,c", "d"), ("line 2 (below the header)", "remove them", "skip_lines = [2, 3]")),
    (below_header("s,1/min,bar,degC,degC,degC,degC,W"), ("torque_Nm has the unit 'bar', which is no unit of torque",)),
    (text().replace("\n20.0,", '\n"20.0,'), ("cannot be read as csv",)),
    ("<html><body>504 Gateway Timeout</body></html>", ("column time_s is missing",)),
]  # fmt: skip

COLUMN = "schema = 1\n[columns.T_oil_degC]\n"
# A mapping file next to a sound recording, and parts of the message.
MAPPINGS: list[tuple[str, tuple[str, ...]]] = [
    ("schema = = 1", ("mapping.toml: is not valid TOML", "line 1")),
    ("max_gap_s = 5", ("mapping.toml", "schema = 1")),
    ("schema = 1\nmax_gap = 5", ("'max_gap' is not a known key", "max_gap_s")),
    (COLUMN + 'quanity = "T_oil"', ("columns.T_oil_degC: 'quanity' is not a known key", "did you mean 'quantity'?")),
    (COLUMN + 'quantity = "T_oill"', ("T_oil_degC", "'T_oill'", "did you mean 'T_oil'")),
    (COLUMN + 'quantity = "T_oil"\nunit = "Celsius"', ("'Celsius' is no unit of temperature",)),
    (COLUMN + 'quantity = "T_oil"\nscale = 0.0', ("columns.T_oil_degC.scale", "0 would wipe")),
    (COLUMN + 'quantity = "T_oil"\nnoise = -0.1', ("columns.T_oil_degC.noise", "-0.1")),
    (COLUMN + 'quantity = "T_oil"\nvalid = [90, 10]', ("columns.T_oil_degC.valid", "90, 10")),
    (COLUMN + 'quantity = "T_oil"\nvalid = [200, 210]', ("60 values outside 200 ... 210", "none is left")),
    (COLUMN + 'quantity = "T_oil"\nrows = ["9000.."]', ("T_oil_degC has no value",)),
    (COLUMN + 'quantity = "T_oil"\nrows = ["morning"]', ("rows of column T_oil_degC", "'morning' names no part")),
    (
        'schema = 1\n[columns.T_sump]\nquantity = "T_oil"',
        ("column T_sump of its mapping file is missing", "state optional = true"),
    ),
    (
        'schema = 1\n[columns.n]\nquantity = "speed"\noptional = true\n[columns.speed_rpm]\nquantity = "ignore"',
        ("column speed_rpm is missing",),
    ),
    (COLUMN + 'quantity = "T_oil"\n[columns.P_loss_W]\nquantity = "T_oil"', ("both T_oil",)),
    ("schema = 1\n[constants]\nT_room = 5.0\n", ("constant 'T_room'",)),
    ("schema = 1\n[constants]\nT_ambient = 20.0\n", ("T_ambient is a constant", "column T_ambient_degC is there")),
    ("schema = 1\n[constants]\nT_ambient = 293.15\n", ("T_ambient", "looks like kelvin", "write 20")),
    ("schema = 1\n[constants]\nair_speed = -2.0\n", ("air_speed = -2 m/s is not possible; 0 to 200 m/s is",)),
    ('schema = 1\ntime = { column = "zeit" }', ("column zeit of [time]", "missing")),
    (
        'schema = 1\ntime = { column = "time_s", unit = "%H:%M" }',
        ("'%H:%M' is not one of s, ms, us, ns, min, h, d, iso8601, hh:mm:ss, nor",),
    ),
    ('schema = 1\ntime = { column = "time_s", unit = "%d.%m.%Y %Q" }', ("'%d.%m.%Y %Q' is not one of s, ms, us",)),
    ('schema = 1\ntime = { column = "time_s", unit = "%d.%d.%Y" }', ("'%d.%d.%Y' is not one of s, ms, us",)),
    ('schema = 1\ntime = { column = "time_s", unit = "minutes" }', ("'minutes' is not one of s, ms, us",)),
    ('schema = 1\ntime = { column = "time_s", unit = "%d.%m.%Y" }', ("each needs a date as %d.%m.%Y",)),
    ('schema = 1\ntime = { column = "time_s", unit = "iso8601" }', ("time_s is '0.0' at row 1",)),
    ('schema = 1\ncsv = { thousands = "e" }', ("mapping.toml: csv.thousands", "'e' cannot stand between")),
    ('schema = 1\ncsv = { thousands = "." }', ("mapping.toml: csv", "same sign")),
    ('schema = 1\ncsv = { decimal = "," }', ("T_oil_degC", "its decimal sign is a point")),
    ('schema = 1\ncsv = { separator = "x" }', ("csv.separator", "'x'")),
    ('schema = 1\ncsv = { encoding = "ansi-1" }', ("csv.encoding", "'ansi-1' is no encoding", "cp1252")),
    ("schema = 1\ncsv = { skip_lines = [0] }", ("csv.skip_lines", "1")),
    ('schema = 1\ncsv = { encoding = "utf-16" }', ("run.csv: cannot be read as csv: UTF-16 stream does not start",)),
    ("schema = 1\ncsv = { skip_lines = [1] }", ("first line holds numbers",)),
    ('schema = 1\ncsv = { separator = ";" }', ("run.csv", "separated by ','", 'separator = ","')),
    ('schema = 1\nrows = ["2017-01-01.."]', ("run.csv", "time_s holds seconds")),
    *(
        (
            f'schema = 1\ncolumns.T_oil_degC = {{ quantity = "T_oil", {key} = 0 }}',
            (f"columns.T_oil_degC.{key}", "not 0"),
        )
        for key in ("bias_sd", "lag_sd_s")
    ),
    ("schema = 1\nmax_gap_s = 1.0", ("no two rows are closer than 1 s",)),
    ("schema = 1\nmissing = " + "[" * 3000 + "]" * 3000, ("mapping.toml",)),
]

# What is written behind the name of a sound recording, and parts of the message.
NAMES: list[tuple[str, tuple[str, ...]]] = [
    ("@100..50", ("ends before it starts",)),
    ("@9000..9999", ("has no rows in the part",)),
    ("@0..15", ("has 2 rows in the part",)),
    ("@a..b", ("'a' is neither seconds nor a date",)),
    ("@0..2017-10-31", ("mixes seconds and dates",)),
    ("@2017-09-01..2017-10-31", ("time_s holds seconds",)),
    ("@2017-02-30..", ("is no date",)),
    ("@0-3600", ("run.csv@0-3600: '0-3600' names no part; write start..end",)),
    ("@", ("'' names no part",)),
    ("+missing.csv", ("missing.csv: no such file",)),
    (".zip", ("unknown file ending; use one of", ".mf4")),
]


def message_of(given: Path | str, network: ThermalNetwork) -> str:
    with pytest.raises(InputError) as caught:
        read_recordings([given], network)
    assert len(str(caught.value)) < 4000
    return str(caught.value)


@pytest.mark.parametrize(
    ("content", "says"), FILES, ids=lambda value: value[0][:40] if isinstance(value, tuple) else ""
)
def test_a_bad_file(tmp_path: Path, network: ThermalNetwork, content: str | bytes, says: tuple[str, ...]) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    message = message_of(path, network)
    assert all(line.startswith(str(path)) for line in message.splitlines()), message
    assert all(part in message for part in says), message


@pytest.mark.parametrize(
    ("mapping", "says"), MAPPINGS, ids=lambda value: value[0][:40] if isinstance(value, tuple) else ""
)
def test_a_bad_mapping_file(tmp_path: Path, network: ThermalNetwork, mapping: str, says: tuple[str, ...]) -> None:
    (tmp_path / "run.csv").write_text(text())
    (tmp_path / "mapping.toml").write_text(mapping)
    message = message_of(tmp_path / "run.csv", network)
    assert all(part in message for part in says), message


@pytest.mark.parametrize(("behind", "says"), NAMES)
def test_a_bad_name(tmp_path: Path, network: ThermalNetwork, behind: str, says: tuple[str, ...]) -> None:
    (tmp_path / "run.csv").write_text(text())
    message = message_of(f"{tmp_path / 'run.csv'}{behind}", network)
    assert all(part in message for part in says), message


@pytest.mark.parametrize(("file", "content", "says"), [
    ("run.csv.gz", text().encode(), "cannot be read as csv.gz"),
    ("run.csv.gz", gzip.compress(text().encode())[:-200], "cannot be read as csv.gz"),
    ("run.parquet", text().encode(), "cannot be read as parquet"),
    ("run.parquet", sound().assign(T_oil_degC=[[1.0]] * ROWS).to_parquet(), "column T_oil_degC holds list"),
    ("run.parquet", sound().assign(speed_rpm=pd.Timestamp(0)).to_parquet(), "speed_rpm holds datetime64"),
    ("run.parquet", sound()[:0].to_parquet(), "has no rows"),
    ("run.mf4", text().encode(), "cannot be read as mf4"),
    ("run.mf4", b"", "is empty"),
])  # fmt: skip
def test_a_bad_file_of_another_kind(
    tmp_path: Path, network: ThermalNetwork, file: str, content: bytes, says: str
) -> None:
    (tmp_path / file).write_bytes(content)
    assert says in message_of(tmp_path / file, network)


def test_a_folder_and_a_missing_file(tmp_path: Path, network: ThermalNetwork) -> None:
    assert "is not a file but a folder; name a file in it" in message_of(tmp_path, network)
    assert "no such file" in message_of(tmp_path / "run.csv", network)
    assert "cannot be read" in message_of(tmp_path / ("x" * 300 + ".csv"), network)


def test_more_rows_than_memory_holds(tmp_path: Path, network: ThermalNetwork, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("models.files.table_file.MOST_ROWS", 50)
    monkeypatch.setattr("models.files.table_file.CHUNK_ROWS", 20)
    (tmp_path / "run.csv").write_text(text())
    assert "has more than 50 rows; take a part of it" in message_of(tmp_path / "run.csv", network)
    assert len(read_recordings([f"{tmp_path / 'run.csv'}@0..300"], network)[0].time) == 30


def test_a_long_row_is_named_far_down_a_packed_file(tmp_path: Path, network: ThermalNetwork) -> None:
    rows = [f"{t},1000,20" for t in range(150_000)]
    rows[120_000] += ",5"
    (tmp_path / "run.csv.gz").write_bytes(gzip.compress("\n".join(["time_s,speed_rpm,T_oil", *rows]).encode()))
    assert "line 120002 has 4 fields, but the header names 3 columns" in message_of(tmp_path / "run.csv.gz", network)


@pytest.mark.parametrize("content", [text(lambda t: t.drop(columns="torque_Nm")), cell(20, "time_s", "abc"), "\0"])
def test_the_verb_ends_with_status_2_and_leaves_nothing(
    content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.csv"
    path.write_text(content)
    options = ["--gearbox", "fzg", "--jobs", "1", "--output", f"{tmp_path}/out"]
    monkeypatch.setattr(sys, "argv", ["builder", "diagnose", str(path), *options])
    with pytest.raises(SystemExit) as end:
        main()
    shown = capsys.readouterr()
    assert (end.value.code, shown.out) == (2, "")
    assert all(line.startswith(str(path)) for line in shown.err.splitlines()), shown.err
    assert sorted(tmp_path.rglob("*")) == [path]


def test_the_sound_recording_is_accepted(tmp_path: Path, network: ThermalNetwork) -> None:
    (tmp_path / "run.csv").write_text(text())
    recording = read_recordings([tmp_path / "run.csv"], network)[0]
    assert recording.segments == (slice(0, ROWS),)
    assert [note for note in recording.notes if "air_speed" not in note] == []


# ---------------------------------------------------------------------- damage at random


def damaged(source: bytes, seed: int) -> bytes:
    """Change, leave out or insert bytes at a few places."""
    rng = random.Random(seed)
    data = bytearray(source)
    for _ in range(rng.choice([1, 3, 20])):
        at = rng.randrange(len(data))
        kind = rng.randrange(3)
        if kind == 0:
            data[at] = rng.randrange(256)
        elif kind == 1:
            del data[at : at + rng.randrange(1, 40)]
        else:
            data[at:at] = rng.randbytes(rng.randrange(1, 40))
    return bytes(data)


@pytest.mark.parametrize(("file", "source"), [
    ("run.csv", text().encode()),
    ("run.csv.gz", gzip.compress(text().encode())),
    ("run.parquet", sound().to_parquet()),
])  # fmt: skip
def test_damage_at_random_never_breaks_the_reader(
    file: str, source: bytes, tmp_path: Path, network: ThermalNetwork
) -> None:
    refused = 0
    for seed in range(60):
        (tmp_path / file).write_bytes(damaged(source, seed))
        try:
            read_recordings([tmp_path / file], network)
        except InputError:
            refused += 1
    assert refused > 20


def test_mdf_files_that_lack_a_channel(tmp_path: Path, network: ThermalNetwork) -> None:
    asammdf = pytest.importorskip("asammdf")
    table, path = sound(), tmp_path / "run.mf4"

    def save(*left_out: str) -> None:
        names = [c for c in table.columns[1:] if c not in left_out]
        with asammdf.MDF(version="4.10") as mdf:
            mdf.append([asammdf.Signal(table[c].to_numpy(), table["time_s"].to_numpy(), name=c) for c in names])
            mdf.save(path, overwrite=True)

    save()
    read_recordings([path], network)
    for missing in ("speed_rpm", "torque_Nm"):
        save(missing)
        assert f"{missing} is missing" in message_of(path, network)


def test_air_that_is_hot_is_asked_about(tmp_path: Path, network: ThermalNetwork) -> None:
    (tmp_path / "f.csv").write_text(with_column("T_ambient_degC", 71.6))
    (tmp_path / "c.csv").write_text(text())
    hot, sound_one = read_recordings([tmp_path / "f.csv", tmp_path / "c.csv"], network)
    assert any(note.startswith("T_ambient_degC: 72 degC on average is hot") for note in hot.notes)
    assert not any("is hot" in note for note in sound_one.notes)
