"""Tables in and out: what round-trips, what is refused, and that nothing half-written is left."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from models.base.errors import InputError
from models.files.cycle_file import read_cycle, read_cycle_and_start, read_initial
from models.files.output_files import refuse_to_replace, write_table
from models.files.table_file import read_table

COLUMNS = {
    "time_s": np.array([0.0, 1.0, 2.5]),
    "T_oil_degC": np.array([20.0, 20.125, 21.0]),
    "in_domain": np.array([True, True, False]),
}


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.parquet", "späte Läufe/a b.csv"])
def test_tables_round_trip(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    write_table(path, COLUMNS)
    table = read_table(path)
    assert list(table.columns) == list(COLUMNS)
    for column, values in COLUMNS.items():
        assert (table[column].to_numpy() == values).all()
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_the_same_table_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.csv", "a.csv.gz"):
        write_table(tmp_path / name, COLUMNS)
        first = (tmp_path / name).read_bytes()
        write_table(tmp_path / name, COLUMNS)
        assert (tmp_path / name).read_bytes() == first


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file"),
        (b"", "is empty"),
        (b"\x00\xff\xfe\x9c", "a NUL byte in line 1"),
        (b"time_s,speed_rpm\n1,2\n3,4,5\n", "line 3 has 3 fields"),
        (b"time_s,speed_rpm,torque_Nm\n", "has no rows"),
        (b"time_s,speed_rpm,torque_Nm\ns,rad/s,Nm\n0,1,1\n", "line 2 (below the header) holds units or texts"),
        (b"time_s;speed_rpm;torque_Nm\n0;1;2\n", "separated by ';'"),
        (b"time_s,speed_rpm\n0,1\n", "column torque_Nm is missing"),
        (b"time_s,speed_rpm,torque_Nm\n0,1,2\n1,,2\n", "speed_rpm is nan at row 2"),
        (b"time_s,speed_rpm,torque_Nm\n0,1,inf\n", "torque_Nm is inf at row 1"),
        (b"time_s,speed_rpm,torque_Nm\n0,1,x\n", "numbers are needed"),
        (b"time_s,speed_rpm,torque_Nm\n5,1,1\n4,1,1\n", "time_s goes from 5 to 4 at row 2"),
        (b"time_s,speed_rpm,torque_Nm,T_ambient_degC\n0,1,1,293\n", "T_ambient_degC is 293 at row 1"),
        (
            b"time_s,speed_rpm,torque_Nm,speed_rpm\n0,1,1,2\n",
            "column speed_rpm is missing; it has: speed_rpm (column 2), speed_rpm (column 4)",
        ),
    ],
)
def test_a_faulty_cycle_is_refused(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "run.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match="run.csv") as caught:
        read_cycle(path)
    assert message in str(caught.value)


def test_all_faults_of_a_cycle_come_at_once(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,speed_rpm\n3,nan\n2,1\n")
    with pytest.raises(InputError) as caught:
        read_cycle(path)
    assert len(str(caught.value).splitlines()) == 3


@pytest.mark.parametrize("name", ["a.csv.gz", "a.parquet"])
def test_a_truncated_file_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    write_table(path, {"time_s": np.arange(1000.0)})
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(InputError, match="cannot be read"):
        read_table(path)


def test_other_endings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown file ending"):
        write_table(tmp_path / "a.xls", COLUMNS)


def test_initial_temperatures_from_the_last_row_of_a_result(tmp_path: Path) -> None:
    path = tmp_path / "result.csv"
    write_table(path, {"time_s": [0.0, 1.0], "T_oil_degC": [20.0, 30.5], "T_ambient_degC": [1.0, 1.0]})
    assert read_initial(str(path)) == {"oil": 30.5}
    write_table(path, {"time_s": [0.0]})
    with pytest.raises(InputError, match="has no T_<node>_degC columns"):
        read_initial(str(path))


def test_a_folder_is_no_table(tmp_path: Path) -> None:
    for read in (read_cycle, lambda path: read_initial(str(path))):
        with pytest.raises(InputError, match="is not a file but a folder; name a file in it"):
            read(tmp_path)


# ---------------------------------------------------------------------- what is read is never replaced


def test_an_output_that_is_read_as_well_is_refused(tmp_path: Path) -> None:
    read, other, linked = (tmp_path / name for name in ("run.csv", "other.csv", "linked.csv"))
    read.write_text("a")
    other.write_text("b")
    linked.symlink_to(read)
    around = tmp_path / "folder" / ".." / "run.csv"
    (tmp_path / "folder").mkdir()
    refuse_to_replace([read], [other, tmp_path / "new.csv"])
    with pytest.raises(InputError, match="folder: is a folder; name a file"):
        refuse_to_replace([read], [tmp_path / "folder"])
    for out in (read, linked, around):
        with pytest.raises(InputError, match=f"{out.name}: is read as well and would be replaced; choose another"):
            refuse_to_replace([other, read], [tmp_path / "new.csv", out])
    with pytest.raises(InputError) as raised:
        refuse_to_replace(iter([read, other]), iter([other, read]))
    assert len(str(raised.value).splitlines()) == 2


def test_names_that_cannot_be_files_are_left_to_who_opens_them(tmp_path: Path) -> None:
    impossible = [tmp_path / "missing.csv", tmp_path / ("x" * 300), Path("a\0b")]
    refuse_to_replace(impossible, impossible)


# ---------------------------------------------------------------------- starts as recorded


def recorded(path: Path, **columns: list[object]) -> Path:
    given = {"time_s": [0.0, 1.0, 2.0], "speed_rpm": [0.0] * 3, "torque_Nm": [0.0] * 3}
    pd.DataFrame(given | columns).to_csv(path, index=False)
    return path


def test_a_recorded_start_is_the_first_temperature_of_every_node(tmp_path: Path) -> None:
    path = recorded(
        tmp_path / "run.csv", T_oil_degC=[None, 60.0, 61.0], T_mesh_degC=[None, None, 80.0],
        T_air_degC=["off", 20.0, 20.0], T_pinion_degC=[None, 70.0, 71.0], T_ambient_degC=[10.0] * 3,
    )  # fmt: skip
    cycle, start = read_cycle_and_start(path)
    assert len(cycle) == 3
    assert start.temperatures == {"oil": 60.0, "mesh": 80.0, "air": 20.0, "pinion": 70.0}
    assert start.rows == {"oil": 2, "mesh": 3, "air": 2, "pinion": 2}
    assert start.of(["pinion", "wheel", "oil"]) == {"pinion": 70.0, "wheel": 65.0, "oil": 60.0}


def test_a_recorded_start_that_cannot_be_is_refused_with_its_cell(tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.csv", T_oil_degC=["80,0", 60.0, 61.0], T_mesh_degC=[None, -99.0, 80.0])
    with pytest.raises(InputError) as raised:
        read_cycle_and_start(path)[1].of(["oil", "mesh"])
    assert "T_oil_degC is no number at row 1; --initial recorded needs -90 to 250 degC" in str(raised.value)
    assert "T_mesh_degC is -99 degC at row 2" in str(raised.value)


def test_a_recorded_start_that_is_missing(tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.csv", T_ambient_degC=[10.0] * 3, T_air_degC=[10.0] * 3)
    with pytest.raises(InputError, match="run.csv: --initial recorded needs a column T_<node>_degC .* oil, mesh; give"):
        read_cycle_and_start(path)[1].of(["oil", "mesh"])
    empty = recorded(tmp_path / "empty.csv", T_oil_degC=[None] * 3)
    with pytest.raises(InputError, match="needs a column"):
        read_cycle_and_start(empty)[1].of(["oil"])


def test_small_numbers_keep_their_digits(tmp_path: Path) -> None:
    """A flow in m3/s, or what a law remembers: the file is read again as a cycle and as a start."""
    given = {
        "time_s": [0.0, 1.0],
        "oil_flow": [2.345678e-7, np.nan],
        "state_x": [0.0, 0.0],
        "P_loss_W": [512.12345678, 1.0],
    }
    write_table(tmp_path / "a.csv", given)
    read = pd.read_csv(tmp_path / "a.csv")
    assert read["oil_flow"][0] == pytest.approx(2.345678e-7, rel=1e-6)
    assert np.isnan(read["oil_flow"][1])
    assert read["P_loss_W"].tolist() == [512.123457, 1.0]
