"""Files as loggers, Excel and historians write them: one recording is read from all of them, or the way is shown."""

from __future__ import annotations

import codecs
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.read import read_recordings
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.shared_rows import check_shared_rows
from models.base.errors import InputError
from models.simulation.thermal_network import ThermalNetwork

ROWS = 120
HEADER = "time_s,speed_rpm,torque_Nm,T_oil_degC,P_loss_W"
GERMAN = 'csv = { separator = ";", decimal = "," }\n'


def table() -> pd.DataFrame:
    time = 10.0 * np.arange(ROWS)
    return pd.DataFrame({
        "time_s": time,
        "speed_rpm": np.where(time < 600.0, 1500.0, 950.5),
        "torque_Nm": 94.25,
        "T_oil_degC": np.round(20.0 + 40.0 * (1.0 - np.exp(-time / 900.0)), 1),
        "P_loss_W": np.where(time < 600.0, 400.5, 260.5),
    })  # fmt: skip


def read(folder: Path, network: ThermalNetwork, content: str | bytes, mapping: str = "") -> Recording:
    (folder / "run.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    if mapping:
        (folder / "mapping.toml").write_text(f"schema = 1\n{mapping}", encoding="utf-8")
    return read_recordings(folder / "run.csv", network)[0]


def check(recording: Recording) -> None:
    """It holds the table of this module."""
    source = table()
    values = {channel.name: channel.values for channel in recording.channels}
    np.testing.assert_allclose(recording.time, source["time_s"], atol=1e-6)
    np.testing.assert_allclose(recording.inputs["speed"], source["speed_rpm"])
    np.testing.assert_allclose(recording.inputs["torque"], source["torque_Nm"])
    np.testing.assert_allclose(values["oil"], source["T_oil_degC"])
    np.testing.assert_allclose(values["P_loss"], source["P_loss_W"])


def plain(source: pd.DataFrame | None = None, **options: str) -> str:
    return str((table() if source is None else source).to_csv(index=False, **options))  # type: ignore[arg-type]


def quoted() -> str:
    rows = table().astype(str).map(lambda cell: f'"{cell.replace(".", ",")}"')
    return "\n".join([HEADER, *(",".join(row) for row in rows.to_numpy()), ""])


def in_units(units: str) -> str:
    """Table in min, rad/s, kN m, degF and kW, with a row below the header."""
    other = table().assign(
        time_s=lambda t: t["time_s"] / 60.0, speed_rpm=lambda t: t["speed_rpm"] * np.pi / 30.0,
        torque_Nm=lambda t: t["torque_Nm"] / 1e3, T_oil_degC=lambda t: t["T_oil_degC"] * 1.8 + 32.0,
        P_loss_W=lambda t: t["P_loss_W"] / 1e3,
    )  # fmt: skip
    header, *rows = plain(other.set_axis(list("tnMTP"), axis=1)).splitlines()
    return "\n".join([header, units, *rows, ""])


ROLES = """
    [columns]
    n.quantity = "speed"
    M.quantity = "torque"
    T.quantity = "T_oil"
    P.quantity = "P_loss"
"""
# Content, and mapping.
READ: dict[str, tuple[str | bytes, str]] = {
    "quoted decimal commas": (quoted(), 'csv = { decimal = "," }'),
    "separator in the first line": ("sep=;\r\n" + plain(sep=";", decimal=","), GERMAN),
    "mark of UTF-16": (plain().encode("utf-16"), ""),
    "mark of UTF-8 in a mapping of cp1252": (codecs.BOM_UTF8 + plain().encode(), 'csv = { encoding = "cp1252" }'),
    "UTF-16 without a mark": (plain().encode("utf-16-le"), 'csv = { encoding = "utf-16-le" }'),
    "separator behind every row": (plain().replace("\n", ",\n").replace("P_loss_W,\n", "P_loss_W\n"), ""),
    "line breaks in the header": (plain().replace("T_oil_degC", '"T_oil\n[degC]"', 1), ""),
    "thousands": (plain(sep=";", decimal=",").replace(";1500,0;", ";1.500,0;"),
                  'csv = { separator = ";", decimal = ",", thousands = "." }'),
    "thousands without decimals": (plain().replace(",1500.0,", ',"1,500",'), 'csv = { thousands = "," }'),
    "a row of units": (in_units("[min],[rad/s],[kNm],[°F],[kW]"), f'time = {{ column = "t" }}\n{ROLES}'),
    "a row of units, one stated in the mapping":
        (in_units("min,rad/s,kNm,Grad F,kW"), f'time = {{ column = "t" }}\n{ROLES}    T.unit = "degF"'),
    "a row of units below names without them":
        (plain().replace(HEADER, f"{HEADER.replace('time_s', 'time')}\ns,rpm,Nm,°C,W"), ""),
    "a row of units with another word for seconds": (plain().replace(HEADER, HEADER + "\nsec,rpm,Nm,°C,W"), ""),
    "names with units in brackets":
        (plain().replace(HEADER, "Time [s],speed [rpm],torque [Nm],T_oil [°C],P_loss (W)"), ""),
    "a text at the end": (plain() + "End of file\n", ""),
    "texts at the end, decimal commas": (plain(sep=";", decimal=",") + "Schluss;;;;\nDauer 20 min;;;;\n", GERMAN),
    "the newest row first": (plain(table()[::-1]), ""),
}  # fmt: skip


@pytest.mark.parametrize("case", READ)
def test_a_file_of_another_writer_is_read(tmp_path: Path, network: ThermalNetwork, case: str) -> None:
    check(read(tmp_path, network, *READ[case]))


@pytest.mark.parametrize(("names", "changes"), [
    ({"T_oil_degC": "T_oil_degF"}, {"T_oil_degC": lambda t: t["T_oil_degC"] * 1.8 + 32.0}),
    ({"T_oil_degC": "T_oil_K"}, {"T_oil_degC": lambda t: t["T_oil_degC"] + 273.15}),
    ({"torque_Nm": "torque_kNm"}, {"torque_Nm": lambda t: t["torque_Nm"] / 1e3}),
    ({"speed_rpm": "speed_rad_s"}, {"speed_rpm": lambda t: t["speed_rpm"] * np.pi / 30.0}),
    ({"P_loss_W": "P_loss_kW"}, {"P_loss_W": lambda t: t["P_loss_W"] / 1e3}),
])  # fmt: skip
def test_a_name_with_another_unit_is_converted_and_noted(
    tmp_path: Path, network: ThermalNetwork, names: dict[str, str], changes: dict[str, Callable[..., pd.Series]]
) -> None:
    recording = read(tmp_path, network, plain(table().assign(**changes).rename(columns=names)))
    check(recording)
    (note,) = [note for note in recording.notes if "taken from the names of columns" in note]
    assert all(name in note for name in names.values())


def test_two_names_for_one_quantity_are_not_chosen_from(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table().assign(T_oil_K=293.0).rename(columns={"T_oil_degC": "T_oil_C"})
    with pytest.raises(InputError, match="column T_oil_K is not known; did you mean 'T_oil_degC'"):
        read(tmp_path, network, plain(source))


def test_the_unit_in_a_name_counts_where_a_mapping_states_none(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table().assign(T_oil_degC=lambda t: t["T_oil_degC"] * 1.8 + 32.0).rename(columns={"T_oil_degC": "Öl [°F]"})
    mapping = '[columns."Öl [°F]"]\nquantity = "T_oil"\n'
    check(read(tmp_path, network, plain(source), mapping))
    with pytest.raises(InputError, match=r"column Öl \[Nm\] has the unit 'Nm', which is no unit of temperature"):
        read(tmp_path, network, plain(source).replace("°F", "Nm"), mapping.replace("°F", "Nm"))


@pytest.mark.parametrize(
    "above",
    ["Rig 3\nStart: 01.02.2024 10:00\n", "Rig,3\n\nDate,2024-02-01\n", "Rig,3,,,\nDate,x,,,\n", "Rig,3\nUnit\n"],
)
def test_lines_above_the_header_are_named_all_at_once(tmp_path: Path, network: ThermalNetwork, above: str) -> None:
    with pytest.raises(InputError, match=r"above the header \(line \d: 'time_s', .* skip_lines = \[") as caught:
        read(tmp_path, network, above + plain())
    advice = str(caught.value).partition("give ")[2].partition(" in a mapping")[0]
    check(read(tmp_path, network, above + plain(), advice))


def test_a_header_with_a_column_that_stays_empty_is_found(tmp_path: Path, network: ThermalNetwork) -> None:
    """As in files of LabVIEW, with remarks in the last column."""
    header, *rows = plain().splitlines()
    text = "\n".join(["Writer,2", f"{header},Comment", *(f"{row}," for row in rows)])
    with pytest.raises(InputError, match=r"line 1 above the header \(line 2: 'time_s'"):
        read(tmp_path, network, text)
    check(read(tmp_path, network, text, "csv = { skip_lines = [1] }"))


def test_names_that_come_twice(tmp_path: Path, network: ThermalNetwork) -> None:
    """They do no harm where nothing needs them; one that is needed is chosen in the mapping."""
    source = table().assign(a=1.0, b=2.0, c=30.0)
    text = plain(source).replace("a,b,c", "Status,Status,T_oil_degC", 1)
    with pytest.raises(InputError) as caught:
        read(tmp_path, network, text)
    named = "name the right one in a mapping file as 'T_oil_degC (column 4)' or 'T_oil_degC (column 8)'"
    assert f"column T_oil_degC is there twice; remove one, or {named}" in str(caught.value)
    check(read(tmp_path, network, text, '[columns."T_oil_degC (column 4)"]\nquantity = "T_oil"'))


def test_a_unit_that_the_name_or_the_mapping_contradicts_is_noted(tmp_path: Path, network: ThermalNetwork) -> None:
    text = in_units("min,rad/s,kNm,degF,kW").replace("t,n,M,T,P", "t,speed_rpm,M,T,P")
    mapping = f'time = {{ column = "t" }}\n{ROLES}    T.unit = "degC"'.replace('n.quantity = "speed"', "")
    notes = read(tmp_path, network, text, mapping).notes
    assert "speed_rpm: its unit is rad/s, as the file names it" in notes
    assert "T: its unit is degC, as in the mapping file; the file itself names degF" in notes
    with pytest.raises(InputError, match="column time_s has the unit 'min' in the file; give time = "):
        read(tmp_path, network, text.replace("t,", "time_s,", 1), mapping.replace('time = { column = "t" }', ""))


def test_a_letter_may_name_a_sensor(tmp_path: Path, network: ThermalNetwork) -> None:
    with pytest.raises(InputError, match="column T_oil_F is not known; did you mean 'T_oil_degC'"):
        read(tmp_path, network, plain().replace("T_oil_degC", "T_oil_F"))


def test_a_comma_within_a_number_does_not_shift_a_row(tmp_path: Path, network: ThermalNetwork) -> None:
    """Separators behind every row make room for one field more."""
    text = plain().replace("\n", ",\n").replace("P_loss_W,\n", "P_loss_W\n")
    row = text.splitlines()[110]
    with pytest.raises(InputError, match="row 110 has more fields than the header"):
        read(tmp_path, network, text.replace(row, row.replace("950.5", "950,5").removesuffix(",")))


def test_texts_for_a_missing_value(tmp_path: Path, network: ThermalNetwork) -> None:
    """Those of Excel and usual ones are known; others are listed as the mapping takes them."""
    source = table().astype(object)
    source.loc[[3, 4, 5], "T_oil_degC"] = ["---", "#NV", "n.a."]
    (channel, _) = read(tmp_path, network, plain(source)).channels
    assert np.flatnonzero(np.isnan(channel.values)).tolist() == [3, 4, 5]
    source.loc[[6, 7], "T_oil_degC"] = ["Bad", "I/O Timeout"]
    with pytest.raises(InputError, match=r'give missing = \["Bad", "I/O Timeout"\] in a mapping file') as caught:
        read(tmp_path, network, plain(source))
    read(tmp_path, network, plain(source), str(caught.value).partition("give ")[2].partition(" in a mapping")[0])


@pytest.mark.parametrize(("cell", "advice"), [
    ("1,500", 'give csv = { thousands = "," } in a mapping file, or decimal = "," if that is its decimal sign'),
    ("1,500.0", 'give csv = { thousands = "," }'),
    ("40,5", 'its decimal sign is a comma: give csv = { decimal = "," }'),
    ("1500,000", 'its decimal sign is a comma: give csv = { decimal = "," }'),
    ("21 °C", "write the unit in the header or in a mapping file, not in the cells"),
])  # fmt: skip
def test_advice_on_cells_that_are_no_numbers(tmp_path: Path, network: ThermalNetwork, cell: str, advice: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, network, plain(table().assign(T_oil_degC=cell)))
    assert f"T_oil_degC holds {cell!r} at row 1, which is no number" in str(caught.value)
    assert advice in str(caught.value)


def test_row_numbers_stay_those_of_a_file_that_is_turned_round(tmp_path: Path, network: ThermalNetwork) -> None:
    source = table()[::-1].reset_index(drop=True).astype({"T_oil_degC": object})
    source.loc[[4, 5], "T_oil_degC"] = 999.0
    recording = read(tmp_path, network, plain(source))
    assert recording.rows[[0, -1]].tolist() == [ROWS, 1]
    assert any("its newest row comes first" in note for note in recording.notes)
    assert any("2 of 120 values (rows 5-6)" in note for note in recording.notes)


def test_a_line_that_is_no_part_of_the_table_is_named(tmp_path: Path, network: ThermalNetwork) -> None:
    recording = read(tmp_path, network, plain() + "End of file\n")
    assert "row 121 at the end with a text only ('End of file') left out" in recording.notes
    with pytest.raises(InputError, match="time_s is 'Mean' at row 121; .*; remove lines that are no part of the table"):
        read(tmp_path, network, plain() + "Mean,1200,94,40,300\n")


@pytest.mark.parametrize(("name", "advice"), [
    ("run.txt", "rename a table of text to .csv"), ("run.xlsx", "save the sheet as CSV"),
])  # fmt: skip
def test_advice_on_other_endings(tmp_path: Path, network: ThermalNetwork, name: str, advice: str) -> None:
    (tmp_path / name).write_text(plain())
    with pytest.raises(InputError, match=f"unknown file ending; use one of .*; {advice}"):
        read_recordings(tmp_path / name, network)


@pytest.mark.parametrize("title", ["Rig 3, logger MX4, export", "Rig 3"])
def test_a_title_above_a_german_table(tmp_path: Path, network: ThermalNetwork, title: str) -> None:
    """First the separator is told, whatever is in the title, then the title; what is stated rightly is not doubted."""
    text = f"{title}\n" + table().to_csv(index=False, sep=";", decimal=",")
    with pytest.raises(InputError, match=r"separated by ';'; give csv = \{ separator = \";\", decimal = \",\" \}"):
        read(tmp_path, network, text)
    with pytest.raises(InputError, match=r"line 1 above the header .* skip_lines = \[1\]"):
        read(tmp_path, network, text, GERMAN)
    check(read(tmp_path, network, text, GERMAN.replace("}", ", skip_lines = [1] }")))


def test_the_tolerance_of_the_air_is_of_its_offset(tmp_path: Path, network: ThermalNetwork) -> None:
    text = plain(table().assign(T_ambient_degC=20.0))
    stated = 'columns.T_ambient_degC = { quantity = "T_ambient", bias_sd = 0.1 }\n'
    assert read(tmp_path, network, text, stated).tolerances == {"T_ambient": 0.1}
    with pytest.raises(InputError, match="gain_sd is the tolerance of the scale of torque or P_loss, not of T_ambient"):
        read(tmp_path, network, text, stated.replace("bias_sd", "gain_sd"))


def test_rows_that_are_shared_are_told_by_their_dates(tmp_path: Path, network: ThermalNetwork) -> None:
    dates = pd.Timestamp("2024-02-01") + pd.to_timedelta(table()["time_s"], unit="s")
    path = tmp_path / "run.csv"
    table().assign(time_s=dates).rename(columns={"time_s": "time"}).to_csv(path, index=False)
    whole, late = read_recordings([path, f"{path}@2024-02-01T00:05:00.."], network)
    with pytest.raises(InputError, match=r"rows of 2024-02-01T00:05:00Z \.\.\. 2024-02-01T00:19:50Z in common with"):
        check_shared_rows([whole], [late])
