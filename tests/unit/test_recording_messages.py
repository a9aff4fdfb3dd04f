"""What is said of a recording or a cycle that cannot be read: the object that is at fault, and what helps."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recording import read_recordings
from diagnosis.recording_file import read_recording_file
from models.errors import InputError
from models.gearbox import load_gearbox
from models.network import ThermalNetwork
from models.table_file import TextForm, read_table

SOUND = "time_s,speed_rpm,T_oil\n0,1000,20\n10,1001,21\n20,1002,22\n"


@pytest.fixture(scope="module")
def network() -> ThermalNetwork:
    return load_gearbox("fzg").network()


def refused(path: Path, content: str, form: TextForm | None = None) -> str:
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_table(path) if form is None else read_table(path, form=form)
    return str(caught.value).removeprefix(f"{path}: ")


# ---------------------------------------------------------------------- separators


def test_where_no_mapping_file_applies_none_is_advised(tmp_path: Path) -> None:
    said = refused(tmp_path / "cycle.csv", SOUND.replace(",", ";"))
    assert said == "its columns are separated by ';'; write it with ',' and decimal points"


def test_a_mapping_file_that_names_another_separator_is_what_to_correct(tmp_path: Path) -> None:
    said = refused(tmp_path / "run.csv", SOUND, TextForm(separator=";", by_mapping=True))
    assert said == "its columns are separated by ','; give csv = { separator = \",\" } in a mapping file"


def test_what_is_advised_for_semicolons_works(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(SOUND.replace(",", ";").replace("21", "21,5"), encoding="utf-8")
    with pytest.raises(InputError, match="its columns are separated by ';'") as caught:
        read_recording_file(path)
    advice = 'csv = { separator = ";", decimal = "," }'
    assert advice in str(caught.value)
    (tmp_path / "mapping.toml").write_text(f"schema = 1\n{advice}\n", encoding="utf-8")
    assert read_recording_file(path).table["T_oil"].tolist() == [20.0, 21.5, 22.0]


# ---------------------------------------------------------------------- rows of units


def with_rows(*rows: str) -> str:
    header, *numbers = SOUND.splitlines()
    return "\n".join([header, *rows, *numbers]) + "\n"


@pytest.mark.parametrize("rows", [("s,1/min,degC",), ("[s],[min^-1],",), (",,m3/h",)])
def test_a_row_of_units_is_recognised(tmp_path: Path, rows: tuple[str, ...]) -> None:
    said = refused(tmp_path / "run.csv", with_rows(*rows))
    assert said.startswith("row 1 (below the header) holds units or texts ('")
    assert said.endswith("and no number; remove it, or begin its line with '#'")


def test_begun_with_a_mark_it_is_a_remark(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(with_rows("#s,1/min,degC"), encoding="utf-8")
    assert len(read_table(tmp_path / "run.csv")) == 3


@pytest.mark.parametrize(
    "row",
    ["2017-09-01T08:00:00Z,,", ",,", "01.09.2017,,", "0,on,off", '"1,5","2,5","3,5"'],
    ids=["a date alone", "nothing", "a German date", "a number", "decimal commas"],
)
def test_other_first_rows_are_none(tmp_path: Path, row: str) -> None:
    (tmp_path / "run.csv").write_text(with_rows(row), encoding="utf-8")
    assert len(read_table(tmp_path / "run.csv")) in (3, 4)  # pandas leaves out a row of nothing but separators or not


def test_a_table_of_texts_alone_is_not_taken_for_units(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("a,b\nx,y\nu,v\n", encoding="utf-8")
    assert len(read_table(tmp_path / "run.csv")) == 2


def test_units_in_parquet(tmp_path: Path) -> None:
    table = pd.DataFrame({"time_s": ["s", "0", "1"], "T_oil_degC": ["degC", "20", "21"]})
    table.to_parquet(tmp_path / "run.parquet")
    with pytest.raises(InputError, match=r"row 1 \(below the header\) holds units or texts \('s', 'degC'\)"):
        read_table(tmp_path / "run.parquet")


# ---------------------------------------------------------------------- rows of another length


def test_the_row_with_too_many_fields_is_named(tmp_path: Path) -> None:
    said = refused(tmp_path / "run.csv", "# rig 3\n" + SOUND.replace("10,1001,21", "10,1001,21,5"))
    assert said == (
        "cannot be read as csv: row 2 (line 4) has 4 fields, but the header names 3 columns; remove what is too much, "
        "e.g. a ',' at its end or within a number"
    )


def test_it_is_named_in_a_packed_file_and_far_down(tmp_path: Path) -> None:
    rows = [f"{t},1000,20" for t in range(150_000)]
    rows[120_000] += ",5"
    (tmp_path / "run.csv.gz").write_bytes(gzip.compress("\n".join(["time_s,speed_rpm,T_oil", *rows]).encode()))
    with pytest.raises(InputError, match=r"row 120001 \(line 120002\) has 4 fields, but the header names 3 columns"):
        read_table(tmp_path / "run.csv.gz")


def test_no_words_of_the_library(tmp_path: Path) -> None:
    for row in (1, 2, 3):
        lines = SOUND.splitlines()
        lines[row] += ",7,8"
        said = refused(tmp_path / "run.csv", "\n".join(lines))
        assert f"row {row} (line {row + 1}) has 5 fields" in said
        assert "index_col" not in said
        assert "tokenizing" not in said


# ---------------------------------------------------------------------- what is named on the command line


def test_a_folder_is_called_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is not a file but a folder; name a file in it \(\.csv, "):
        read_recording_file(tmp_path)


def test_a_part_that_is_not_written_as_one(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(SOUND, encoding="utf-8")
    with pytest.raises(
        InputError, match=r"'0-3600' after the @ names no part; write FILE@start\.\.end, e\.g\. run\.csv@0\.\.3600"
    ):
        read_recording_file(f"{tmp_path / 'run.csv'}@0-3600")
    assert len(read_recording_file(f"{tmp_path / 'run.csv'}@0..3600").table) == 3


def test_a_name_with_an_at_sign_is_a_name(tmp_path: Path) -> None:
    for name in ("run@rig.csv", "a.csv@b.csv"):
        (tmp_path / name).write_text(SOUND, encoding="utf-8")
        assert read_recording_file(tmp_path / name).path.name == name
    with pytest.raises(InputError, match="no such file"):
        read_recording_file(tmp_path / "run@rig_2.csv")


# ---------------------------------------------------------------------- limits of a mapping file


def test_limits_in_another_unit_than_the_column_are_what_is_at_fault(tmp_path: Path, network: ThermalNetwork) -> None:
    rows = np.arange(200)
    table = pd.DataFrame({
        "time_s": 10.0 * rows, "speed_rpm": 1000.0, "torque_Nm": 50.0, "oil": 293.15 + 0.1 * rows,
        "T_bearing_1_degC": 20.0 + 0.1 * rows,
    })  # fmt: skip
    table.to_csv(tmp_path / "run.csv", index=False)
    mapping = 'schema = 1\n[columns.oil]\nquantity = "T_oil"\nunit = "K"\nvalid = [{}]\n'
    (tmp_path / "mapping.toml").write_text(mapping.format("-40, 150"), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_recordings([tmp_path / "run.csv"], network)
    assert str(caught.value) == (
        f"{tmp_path / 'run.csv'}: oil: 200 values outside -40 ... 150 in rows 1-200 left out, so that none is left: "
        "the limits 'valid' of its mapping file are in the column's own unit, as the numbers stand in the file; "
        "correct them"
    )
    (tmp_path / "mapping.toml").write_text(mapping.format("233, 423"), encoding="utf-8")
    assert len(read_recordings([tmp_path / "run.csv"], network)[0].time) == 200
