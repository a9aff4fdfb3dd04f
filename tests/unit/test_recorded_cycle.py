"""Recordings as cycles: which files are read as recordings, what comes out, and that plain cycles stay as they were."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.as_cycle import read_cycle_or_recording
from diagnosis.recordings.names import split_path
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError
from models.files.cycle_file import read_cycle_and_start
from models.simulation.thermal_network import ThermalNetwork

EXAMPLES = Path(__file__).parents[2] / "examples"
GERMAN = """schema = 1
csv = { separator = ";", decimal = "," }
time = { column = "Zeit", unit = "min" }
columns."n Antrieb" = { quantity = "speed", unit = "rad/s" }
columns.Moment = { quantity = "torque", unit = "kN m" }
columns.Raum = { quantity = "T_ambient", unit = "K" }
columns.Sumpf = { quantity = "T_oil" }
"""
ROWS = 40


@pytest.fixture(scope="module")
def network(fzg: Gearbox) -> ThermalNetwork:
    return fzg.network()


@pytest.fixture(scope="module")
def turbine() -> ThermalNetwork:
    return load_gearbox("la_haute_borne").network()


def table() -> pd.DataFrame:
    time = 30.0 * np.arange(ROWS)
    return pd.DataFrame({
        "time_s": time, "speed_rpm": 1500.0 + time / 10.0, "torque_Nm": 80.0 + 10.0 * np.sin(time / 100.0),
        "T_ambient_degC": 21.5, "T_oil_degC": 40.0 + time / 100.0, "T_pinion_degC": [np.nan] * 2 + [45.0] * (ROWS - 2),
    })  # fmt: skip


def plain(path: Path, content: pd.DataFrame | None = None) -> Path:
    (table() if content is None else content).to_csv(path, index=False)
    return path


def german(path: Path) -> Path:
    plainly = table()
    pd.DataFrame({
        "Zeit": plainly["time_s"] / 60.0, "n Antrieb": plainly["speed_rpm"] * np.pi / 30.0,
        "Moment": plainly["torque_Nm"] / 1e3, "Raum": plainly["T_ambient_degC"] + 273.15,
        "Sumpf": plainly["T_oil_degC"], "T_pinion_degC": plainly["T_pinion_degC"], "Pumpe": 1.0,
    }).to_csv(path, sep=";", decimal=",", index=False)  # fmt: skip
    return path


def test_a_recording_of_another_encoding_below_remarks(tmp_path: Path, network: ThermalNetwork) -> None:
    plainly = table()
    text = "Prüfstand 3\n" + plainly.rename(columns={"T_oil_degC": "Öl"}).to_csv(index=False)
    (tmp_path / "run.csv").write_bytes(text.encode("cp1252"))
    mapping = 'schema = 1\ncsv = { encoding = "cp1252", skip_lines = [1] }\n[columns."Öl"]\nquantity = "T_oil"\n'
    (tmp_path / "mapping.toml").write_text(mapping, encoding="utf-8")
    cycle, start, _ = read_cycle_or_recording(tmp_path / "run.csv", network)
    assert len(cycle) == ROWS and start.columns["oil"] == "Öl"


# ---------------------------------------------------------------------- plain cycles


@pytest.mark.parametrize(
    "beside",
    [
        None,
        GERMAN,  # of other files of the folder
        'schema = 1\ncsv = { separator = ";", decimal = "," }\nmax_gap_s = 99\n',  # of others as well
        'schema = 1\ntime = { column = "Zeit" }\n',
    ],
)
@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz"])
def test_a_plain_cycle_is_read_as_ever(tmp_path: Path, network: ThermalNetwork, beside: str | None, name: str) -> None:
    content = table().assign(time_s=lambda rows: 100.0 + rows["time_s"])
    path = plain(tmp_path / name, content)
    if beside is not None:
        (tmp_path / "mapping.toml").write_text(beside)
    cycle, start, notes = read_cycle_or_recording(path, network)
    as_ever, start_as_ever = read_cycle_and_start(path)
    assert notes == ()
    assert cycle.time.tolist() == as_ever.time.tolist() == content["time_s"].tolist()
    assert {n: v.tolist() for n, v in cycle.inputs.items()} == {n: v.tolist() for n, v in as_ever.inputs.items()}
    assert start == start_as_ever
    assert start.columns == {"oil": "T_oil_degC", "pinion": "T_pinion_degC"}


def test_the_example_beside_the_example_of_a_mapping_is_a_plain_cycle(network: ThermalNetwork) -> None:
    path = EXAMPLES / "drive_cycle_600s.csv"
    assert (EXAMPLES / "mapping.toml").is_file()
    cycle, _, notes = read_cycle_or_recording(path, network)
    assert len(cycle) == 8 and notes == ()


def test_a_parquet_file_beside_a_mapping_of_others_is_a_plain_cycle(tmp_path: Path, network: ThermalNetwork) -> None:
    (tmp_path / "mapping.toml").write_text(GERMAN)
    table().to_parquet(tmp_path / "run.parquet")
    cycle, _, notes = read_cycle_or_recording(tmp_path / "run.parquet", network)
    assert len(cycle) == ROWS and notes == ()
    table().rename(columns={"T_oil_degC": "Sumpf"}).to_parquet(tmp_path / "run.parquet")
    with pytest.raises(InputError, match="column Zeit of \\[time\\] in its mapping file is missing"):
        read_cycle_or_recording(tmp_path / "run.parquet", network)


def test_a_plain_cycle_of_a_gearbox_whose_definition_maps_columns(tmp_path: Path, turbine: ThermalNetwork) -> None:
    path = plain(tmp_path / "run.csv", table().assign(T_outdoor=5.0))
    cycle, start, notes = read_cycle_or_recording(path, turbine)
    assert notes == ("not used: T_pinion_degC; the model's inputs are speed_rpm, torque_Nm, T_ambient_degC, T_outdoor",)
    assert set(cycle.inputs) == {"speed", "torque", "T_ambient", "T_outdoor"}
    assert start.temperatures == {"oil": 40.0, "pinion": 45.0}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "time_s;speed_rpm;torque_Nm\n0;1;2\n",
            "run.csv: its columns are separated by ';'; "
            'give csv = { separator = ";", decimal = "." } in a mapping file '
            "(--mapping), or write it with ','",
        ),
        ("time_s,speed_rpm\n0,1\n", "run.csv: column torque_Nm is missing; it has: speed_rpm, time_s"),
        ("", "run.csv: is empty"),
    ],
)
def test_faults_of_a_cycle_without_a_mapping_are_told(
    tmp_path: Path, network: ThermalNetwork, content: str, message: str
) -> None:
    path = tmp_path / "run.csv"
    path.write_text(content)
    with pytest.raises(InputError) as raised:
        read_cycle_or_recording(path, network)
    assert message in str(raised.value)


# ---------------------------------------------------------------------- recordings


@pytest.mark.parametrize("where", ["mapping.toml", "run.toml", "elsewhere"])
def test_a_recording_with_a_mapping(tmp_path: Path, network: ThermalNetwork, where: str) -> None:
    path, mapping = german(tmp_path / "run.csv"), tmp_path / "further" / "mine.toml"
    mapping.parent.mkdir()
    (mapping if where == "elsewhere" else tmp_path / where).write_text(GERMAN)
    cycle, start, notes = read_cycle_or_recording(path, network, mapping=mapping if where == "elsewhere" else None)
    meant = table()
    np.testing.assert_allclose(cycle.time, meant["time_s"])
    for signal, column in (("speed", "speed_rpm"), ("torque", "torque_Nm"), ("T_ambient", "T_ambient_degC")):
        np.testing.assert_allclose(cycle.inputs[signal], meant[column], err_msg=signal)
    assert start.temperatures == {"oil": pytest.approx(40.0), "pinion": 45.0}
    assert start.rows == {"oil": 1, "pinion": 3}
    assert start.columns == {"oil": "Sumpf", "pinion": "T_pinion_degC"}
    assert set(cycle.inputs) == {*network.inputs}
    assert len(notes) == 2
    assert "not used, being no input and no node of this gearbox: Pumpe" in notes[0]
    assert "air_speed_m_s was not recorded; 2 is assumed" in notes[1]


@pytest.mark.parametrize(
    ("mapping", "signal", "values"),
    [
        ('columns.speed_rpm = { quantity = "speed", unit = "1/s" }', "speed", 60.0 * table()["speed_rpm"]),
        ("constants = { air_speed = 9.0 }", "air_speed", np.full(ROWS, 9.0)),
        ('time = { column = "time_s", unit = "ms" }', "T_ambient", np.full(ROWS, 21.5)),
    ],
)
def test_a_mapping_that_is_about_a_plain_cycle_counts(
    tmp_path: Path, network: ThermalNetwork, mapping: str, signal: str, values: np.ndarray
) -> None:
    (tmp_path / "mapping.toml").write_text(f"schema = 1\n{mapping}\n")
    cycle, _, notes = read_cycle_or_recording(plain(tmp_path / "run.csv"), network)
    np.testing.assert_allclose(cycle.inputs[signal], values)
    assert cycle.time[-1] == pytest.approx(1.17 if "ms" in mapping else 1170.0)
    assert notes or signal == "air_speed"


def test_the_columns_that_a_definition_names(tmp_path: Path, turbine: ThermalNetwork) -> None:
    stamps = pd.date_range("2017-09-16", periods=ROWS, freq="10min", tz="UTC").strftime("%Y-%m-%dT%H:%M:%SZ")
    path = tmp_path / "farm.csv.gz"
    pd.DataFrame({
        "time_utc": stamps, "Cm_avg": 5000.0, "Ds_avg": 1700.0, "Yt_avg": 25.0, "Ot_avg": 12.0,
        "Gost_avg": 55.0 + np.arange(ROWS) / 9.0, "Git_avg": 40.0 + np.arange(ROWS) / 8.0,
    }).to_csv(path, index=False)  # fmt: skip
    cycle, start, notes = read_cycle_or_recording(path, turbine)
    assert cycle.time.tolist() == [600.0 * i for i in range(ROWS)]
    assert {name: values[0] for name, values in cycle.inputs.items()} == {
        "speed": 1700.0, "torque": 5000.0, "T_ambient": 25.0, "T_outdoor": 12.0,
    }  # fmt: skip
    assert start.temperatures == {"oil": 55.0, "oil_inlet": 40.0}
    assert notes == ("time_s counts from its first row, time_utc = 2017-09-16T00:00:00Z",)
    part, start, _ = read_cycle_or_recording(Path(f"{path}@2017-09-16T01:00:00Z.."), turbine)
    assert len(part) == ROWS - 6
    assert start.rows["oil"] == 7


def test_columns_that_a_definition_names_count_with_any_clock(tmp_path: Path, turbine: ThermalNetwork) -> None:
    given = {"speed_rpm": "Ds_avg", "torque_Nm": "Cm_avg", "T_oil_degC": "Gost_avg"}
    path = plain(tmp_path / "farm.csv", table().rename(columns=given))
    cycle, start, _ = read_cycle_or_recording(path, turbine)
    assert cycle.inputs["speed"].tolist() == table()["speed_rpm"].tolist()
    assert start.columns == {"oil": "Gost_avg"}


def test_dates_need_no_mapping(tmp_path: Path, network: ThermalNetwork) -> None:
    stamps = [f"2024-05-01T08:{i:02d}:00Z" for i in range(ROWS)]
    path = plain(tmp_path / "run.csv", table().drop(columns="time_s").assign(timestamp=stamps))
    cycle, _, notes = read_cycle_or_recording(path, network)
    assert cycle.time.tolist() == [60.0 * i for i in range(ROWS)]
    assert "time_s counts from its first row, timestamp = 2024-05-01T08:00:00Z" in notes


def test_a_part_counts_from_its_first_row_and_needs_no_temperature(tmp_path: Path, network: ThermalNetwork) -> None:
    path = plain(tmp_path / "run.csv", table()[["time_s", "speed_rpm", "torque_Nm"]])
    named = Path(f"{path}@300..600")
    assert split_path(named)[0] == (path,)
    cycle, start, notes = read_cycle_or_recording(named, network)
    assert cycle.time.tolist() == [30.0 * i for i in range(10)]
    assert cycle.inputs["speed"].tolist() == table()["speed_rpm"].iloc[10:20].tolist()
    assert "time_s counts from its first row, time_s = 300 s" in notes
    with pytest.raises(InputError, match="--initial recorded needs a column"):
        start.of(["oil"])


def test_channels_of_an_mdf_file(tmp_path: Path, network: ThermalNetwork) -> None:
    asammdf = pytest.importorskip("asammdf")
    content, path = table(), tmp_path / "run.mf4"
    time = content["time_s"].to_numpy()
    mdf = asammdf.MDF(version="4.10")
    mdf.append([asammdf.Signal(content[name].to_numpy(), time, name=name)
                for name in ("speed_rpm", "torque_Nm", "T_oil_degC")])  # fmt: skip
    mdf.save(path, overwrite=True)
    mdf.close()
    cycle, start, _ = read_cycle_or_recording(path, network)
    assert cycle.inputs["speed"].tolist() == content["speed_rpm"].tolist()
    assert start.temperatures == {"oil": 40.0}


@pytest.mark.parametrize("dated", [False, True])
def test_a_recording_with_gaps_is_refused_and_its_pieces_can_be_named(
    tmp_path: Path, network: ThermalNetwork, dated: bool
) -> None:
    content = table().drop(index=[*range(5, 12), *range(20, 26), *range(30, 36)])
    seconds = content["time_s"].tolist()
    if dated:
        stamps = pd.Timestamp("2024-05-01T23:50:00.25Z") + pd.to_timedelta(content["time_s"], unit="s")
        content = content.drop(columns="time_s").assign(time_utc=[stamp.isoformat() for stamp in stamps])
    path = plain(tmp_path / "run.csv", content)
    (tmp_path / "mapping.toml").write_text('schema = 1\ncolumns.T_oil_degC = { quantity = "T_oil" }\n')
    with pytest.raises(InputError) as raised:
        read_cycle_or_recording(path, network)
    refusal = str(raised.value)
    assert f"{path}: gaps split it into 4 pieces" in refusal and "raise max_gap_s" in refusal
    named = re.findall(r"run\.csv@\S+", refusal)
    if not dated:
        assert named == ["run.csv@0..121", "run.csv@360..571", "run.csv@780..871"]
    pieces = [read_cycle_or_recording(tmp_path / name, network)[0] for name in named]
    assert [len(piece) for piece in pieces] == [5, 8, 4]  # the first three of the longest, in order of time
    assert [piece.time[-1] for piece in pieces] == [seconds[4], seconds[12] - seconds[5], seconds[16] - seconds[13]]


@pytest.mark.parametrize(
    ("name", "mapping", "message"),
    [
        ("run.csv", GERMAN.replace("Zeit", "Zeiten"), "column Zeiten of [time] in its mapping file is missing"),
        ("run.csv", GERMAN.replace("T_oil", "T_oel"), "'T_oel' in its mapping file, which this gearbox does not have"),
        ("run.csv", GERMAN.replace('";"', '","', 1).replace('decimal = ","', 'decimal = "."'), "separated by ';'"),
        ("run.csv", "schema = = 1", "mapping.toml: is not valid TOML"),
        ("run.csv@5..3", GERMAN, "'5..3' ends before it starts"),
        ("run.csv@now", GERMAN, "run.csv@now: 'now' names no part; write start..end"),
        ("run.csv@1e6..2e6", GERMAN, "run.csv: has no rows in the part that is named"),
        ("missing.csv@0..9", GERMAN, "missing.csv: no such file"),
        ("missing.mf4", GERMAN, "missing.mf4: no such file"),
        ("run.xls", GERMAN, "run.xls: unknown file ending; use one of .csv, .csv.gz, .parquet, .mf4, .mdf"),
    ],
)
def test_faults_of_a_recording_are_those_of_a_diagnosis(
    tmp_path: Path, network: ThermalNetwork, name: str, mapping: str, message: str
) -> None:
    german(tmp_path / "run.csv")
    (tmp_path / "mapping.toml").write_text(mapping)
    with pytest.raises(InputError) as raised:
        read_cycle_or_recording(tmp_path / name, network)
    assert message in str(raised.value)


@pytest.mark.parametrize(("cell", "message"), [("Bad", "holds 'Bad' at row 4, which is no number (1 such cells"),
                                               ("1.480", "holds '1.480' at row 4")])  # fmt: skip
def test_a_cell_that_is_no_number_does_not_blame_those_with_decimal_commas(
    tmp_path: Path, network: ThermalNetwork, cell: str, message: str
) -> None:
    rows = [f"{0.5 * i};{100.5 + i};0,5;295,15;40,5".replace(".", ",") for i in range(ROWS)]
    rows[3] = rows[3].replace("0,5;295,15", f"{cell};295,15")
    (tmp_path / "run.csv").write_text("\n".join(["Zeit;n Antrieb;Moment;Raum;Sumpf", *rows]))
    (tmp_path / "mapping.toml").write_text(GERMAN)
    with pytest.raises(InputError) as raised:
        read_cycle_or_recording(tmp_path / "run.csv", network)
    assert message in str(raised.value) and "decimal commas" not in str(raised.value)


@pytest.mark.parametrize("names", [
    {"torque_Nm": "torque_kNm"}, {"T_oil_degC": "T_oil_degF"}, {"time_s": "Time [s]", "speed_rpm": "speed [rpm]"},
])  # fmt: skip
def test_names_with_other_units_are_read_as_in_a_diagnosis(
    tmp_path: Path, network: ThermalNetwork, names: dict[str, str]
) -> None:
    given = table().assign(torque_Nm=table()["torque_Nm"] / (1e3 if "torque_Nm" in names else 1.0))
    if "T_oil_degC" in names:
        given["T_oil_degC"] = given["T_oil_degC"] * 1.8 + 32.0
    cycle, start, _ = read_cycle_or_recording(plain(tmp_path / "run.csv", given.rename(columns=names)), network)
    np.testing.assert_allclose(cycle.inputs["torque"], table()["torque_Nm"])
    assert start.temperatures["oil"] == pytest.approx(40.0)


def test_columns_that_nothing_reads_are_named(tmp_path: Path, network: ThermalNetwork) -> None:
    path = plain(tmp_path / "run.csv", table().assign(frame_T_in=65.0, note="x"))
    assert read_cycle_or_recording(path, network)[2] == (
        "not used: frame_T_in, note; the model's inputs are speed_rpm, torque_Nm, T_ambient_degC, air_speed_m_s",
    )
    result = plain(tmp_path / "result.csv", table().assign(P_loss_W=1.0, torque_loss_Nm=0.1, in_domain=True))
    assert read_cycle_or_recording(result, network)[2] == ()


def test_what_makes_a_file_a_recording_is_named_where_it_cannot_be_read(
    tmp_path: Path, network: ThermalNetwork
) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,speed_rpm,torque_Nm,T_ambient_K\n0,1000,50,293\n60,1000,50,293\n", encoding="utf-8")
    with pytest.raises(InputError, match="a recording has 3 or more\n.*as a recording, because it has T_ambient_K;"):
        read_cycle_or_recording(path, network)
