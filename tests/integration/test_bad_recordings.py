"""Bad recordings, generated: every one is refused with file, column and rows, and none breaks the reader.

A case is a way to spoil a sound recording, and what the message must hold beside the name of the file.
"""

from __future__ import annotations

import gzip
import random
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builder.__main__ import main
from diagnosis.recording import check_holdout, read_recordings
from models.errors import InputError
from models.gearbox import Gearbox
from models.network import ThermalNetwork
from models.table_file import Limits

ROWS = 60
SMALL = Limits(size_bytes=2_000_000, rows=5_000, columns=300)
INPUTS = ("speed_rpm", "torque_Nm", "T_ambient_degC")
CHANNELS = ("T_oil_degC", "T_housing_lower_degC", "T_bearing_1_degC", "P_loss_W")
COLUMNS = ("time_s", *INPUTS, *CHANNELS)
NUMBERS = COLUMNS[1:]
TEMPERATURES = tuple(name for name in NUMBERS if name.startswith("T_"))


@pytest.fixture(scope="module")
def network(fzg: Gearbox) -> ThermalNetwork:
    return fzg.network()


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


@dataclass(frozen=True)
class Case:
    """`spoil` writes the recording to a folder and returns what is named on the command line."""

    name: str
    spoil: Callable[[Path], Path | str]
    says: tuple[str, ...]


def text_of(cells: dict[tuple[int, str], str]) -> str:
    table = sound().astype(object)
    for (row, column), cell in cells.items():
        table.loc[row, column] = cell
    return str(table.to_csv(index=False))


def csv(name: str, change: Callable[[pd.DataFrame], pd.DataFrame], *says: str) -> Case:
    def spoil(folder: Path) -> Path:
        path = folder / "run.csv"
        change(sound()).to_csv(path, index=False)
        return path

    return Case(name, spoil, says)


def content(name: str, make: Callable[[], bytes | str], *says: str, file: str = "run.csv") -> Case:
    def spoil(folder: Path) -> Path:
        made = make()
        (folder / file).write_bytes(made.encode() if isinstance(made, str) else made)
        return folder / file

    return Case(name, spoil, says)


# ---------------------------------------------------------------------- cells and columns


def cells() -> Iterator[Case]:
    texts = ("abc", "#REF!", "=A1+B2", "---", "1.2.3", "80 Nm", "@SUM(1)")
    for index, column in enumerate(NUMBERS):
        for number, text in enumerate(texts):
            row = (7 * index + 11 * number) % ROWS
            yield content(
                f"cell {text} in {column}", lambda r=row, c=column, t=text: text_of({(r, c): t}),
                column, f"row {row + 1}", "no number",
            )  # fmt: skip
        for text in ("inf", "-inf", "1e999"):
            yield content(
                f"cell {text} in {column}", lambda c=column, t=text: text_of({(9, c): t}), column, "inf in row 10"
            )
        yield content(
            f"decimal comma in {column}", lambda c=column: text_of({(4, c): "12,5"}), column, "row 5", "decimal commas"
        )
        yield csv(
            f"no value in {column}", lambda t, c=column: t.assign(**{c: np.nan}), column, "no value in any of its 60"
        )
        yield csv(
            f"only texts in {column}", lambda t, c=column: t.assign(**{c: "on"}), column, "60 such cells, rows 1-60"
        )
        yield csv(f"truth values in {column}", lambda t, c=column: t.assign(**{c: True}), column, "bool", "rows 1-60")
    for text in ("abc", "", "1e999", "12:30", "01.02.2017 08:00"):
        yield content(
            f"time is {text!r}", lambda t=text: text_of({(20, "time_s"): t}), "time_s", "row 21", "hold no time"
        )


def columns() -> Iterator[Case]:
    for column in ("time_s", "speed_rpm", "torque_Nm"):
        yield csv(f"no {column}", lambda t, c=column: t.drop(columns=c), f"column {column} is missing", "it has:")
    yield csv("nothing measured", lambda t: t.drop(columns=list(CHANNELS)),
              "no temperature was measured", "T_<node>_degC")  # fmt: skip
    slips = {
        "speed_rpm": ("Speed_rpm", "speed_RPM", "sped_rpm", "speed_rmp", "speedrpm"),
        "torque_Nm": ("torque_nm", "Torque_Nm", "torqe_Nm", "torque_NM", "torque_Nmm"),
        "T_oil_degC": ("T_oil_degc", "T_oill_degC", "t_oil_degC", "T_oil_deg", "T_oli_degC"),
        "T_bearing_1_degC": ("T_bearing1_degC", "T_bearing_1_degF", "T_bearings_1_degC"),
        "T_ambient_degC": ("T_ambiant_degC", "T_ambient_C", "Tambient_degC"),
        "P_loss_W": ("P_loss_kW", "p_loss_W", "Ploss_W", "P_los_W"),
    }
    for column, others in slips.items():
        for other in others:
            yield csv(
                f"{other} for {column}", lambda t, c=column, o=other: t.rename(columns={c: o}), other, "did you mean"
            )
    for column in COLUMNS:
        yield content(
            f"{column} twice", lambda c=column: str(sound().assign(x=1.0).rename(columns={"x": c}).to_csv(index=False)),
            f"column {column} is there twice",
        )  # fmt: skip


def units() -> Iterator[Case]:
    for column in TEMPERATURES:
        yield csv(
            f"{column} in kelvin", lambda t, c=column: t.assign(**{c: t[c] + 273.15}), column, "kelvin", "rows 1-60"
        )
        yield csv(
            f"{column} in tenths",
            lambda t, c=column: t.assign(**{c: t[c] * 100.0}),
            column,
            "60 of 60 values",
            "rows 1-60",
        )
        yield csv(
            f"{column} in kelvin from row 41 on", lambda t, c=column: t.assign(**{c: t[c] + 273.15 * (t.index >= 40)}),
            column, "20 of 60 values", "rows 41-60", "kelvin",
        )  # fmt: skip
        yield csv(f"{column} beyond the coldest", lambda t, c=column: t.assign(**{c: -t[c] * 10.0}), column, "60 of 60")
    for column in TEMPERATURES:
        yield csv(
            f"{column} in kelvin at -30 degC", lambda t, c=column: t.assign(**{c: 0.5 * t[c] + 225.0}), column, "kelvin"
        )
        yield csv(
            f"{column} mostly a code", lambda t, c=column: t.assign(**{c: t[c].where(t.index < 20, 999.0)}), column,
            "40 of 60 values", "rows 21-60",
        )  # fmt: skip
    yield csv(
        "P_loss in kW", lambda t: t.assign(P_loss_W=t["P_loss_W"] / 1e3), "P_loss_W", "in kW", "median of 60 rows"
    )
    yield csv(
        "P_loss in mW", lambda t: t.assign(P_loss_W=t["P_loss_W"] * 1e3), "P_loss_W", "in mW", "median of 60 rows"
    )
    yield csv("P_loss is 0", lambda t: t.assign(P_loss_W=0.0), "P_loss_W is 0")
    yield csv("torque in kN m", lambda t: t.assign(torque_Nm=t["torque_Nm"] / 1e3), "torque_Nm in kN m")
    yield csv("torque in N mm", lambda t: t.assign(torque_Nm=t["torque_Nm"] * 1e3), "torque_Nm in N mm")
    yield csv(
        "speed beyond belief", lambda t: t.assign(speed_rpm=t["speed_rpm"] * 1e3), "speed_rpm", "60 of 60", "row 1"
    )
    yield csv(
        "torque beyond belief", lambda t: t.assign(torque_Nm=t["torque_Nm"] * 1e6), "torque_Nm", "60 of 60", "row 1"
    )
    yield csv("P_loss beyond belief", lambda t: t.assign(P_loss_W=t["P_loss_W"] * 1e6), "P_loss_W", "60 of 60", "row 1")
    yield csv("wind beyond belief", lambda t: t.assign(air_speed_m_s=np.arange(ROWS) * 50.0), "air_speed_m_s", "row 6")
    yield csv("wind backwards", lambda t: t.assign(air_speed_m_s=-1.0 - np.arange(ROWS)), "air_speed_m_s", "rows 1-60")


# ---------------------------------------------------------------------- time


def iso(change: Callable[[list[str]], list[str]], name: str, *says: str) -> Case:
    stamps = [
        stamp.isoformat() + "Z" for stamp in pd.Timestamp("2017-10-29") + pd.to_timedelta(sound()["time_s"], unit="s")
    ]
    return csv(name, lambda t: t.rename(columns={"time_s": "time_utc"}).assign(time_utc=change(stamps)), *says)


def times() -> Iterator[Case]:
    def at(row: int, value: float) -> Callable[[pd.DataFrame], pd.DataFrame]:
        return lambda t: t.assign(time_s=t["time_s"].where(t.index != row, value))

    for row in (1, 17, 58):
        yield csv(f"time goes back at row {row + 1}", at(row, -5.0), "time_s goes back", f"row {row + 1}", "1 times")
        yield csv(
            f"time repeated at row {row + 1}", at(row, 10.0 * (row - 1)), "time_s is", f"row {row}", f"row {row + 1}"
        )
        yield csv(
            f"row {row + 1} twice",
            lambda t, r=row: pd.concat([t[: r + 1], t[r:]]),
            "time_s",
            f"row {row + 1} and again",
        )
    yield csv("a block twice", lambda t: pd.concat([t, t]), "time_s goes back from 590.0 to 0.0 at row 61")
    yield csv("backwards throughout", lambda t: t[::-1], "time_s goes back", "row 2", "59 times")
    yield csv("not sorted", lambda t: t.sample(frac=1.0, random_state=3), "time_s goes back")
    yield csv(
        "time stands still", lambda t: t.assign(time_s=5.0), "time_s is 5.0 at row 1 and again at row 2", "59 times"
    )
    yield csv(
        "milliseconds since 1970", lambda t: t.assign(time_s=1.5e12 + 1e3 * t["time_s"]), "time_s", "milliseconds"
    )
    yield csv("days", lambda t: t.assign(time_s=43000.0 + t["time_s"] / 86400.0), "time_s", "days meant")
    yield csv("hours", lambda t: t.assign(time_s=t["time_s"] / 3.6e6), "time_s", "hours or days meant")
    yield csv("time without unit", lambda t: t.rename(columns={"time_s": "time"}), "column time is no ISO 8601")
    yield csv("no rows", lambda t: t[:0], "has no rows")
    yield csv("one row", lambda t: t[:1], "has 1 rows")
    yield csv("two rows", lambda t: t[:2], "has 2 rows")
    yield csv("torque in two rows only", lambda t: t.assign(torque_Nm=t["torque_Nm"].where(t.index < 2)),
              "torque_Nm", "rows 1-60")  # fmt: skip
    yield csv("inputs never known together", lambda t: t.assign(
        speed_rpm=t["speed_rpm"].where(t.index < 25), torque_Nm=t["torque_Nm"].where(t.index > 45)),
        "only 0 of rows 1-60 have speed_rpm and torque_Nm")  # fmt: skip
    yield iso(lambda s: [*s[:30], "29.10.2017 00:05", *s[31:]], "a German date", "time_utc", "row 31", "ISO 8601")
    yield iso(lambda s: [*s[:30], "2017-13-29T00:05:00Z", *s[31:]], "month 13", "time_utc", "row 31", "ISO 8601")
    yield iso(lambda s: [*s[:30], *(t.removesuffix("Z") for t in s[30:])], "zones end", "time zone", "rows 1 and 31")
    yield iso(
        lambda s: [*s[:30], *s[20:50]], "an hour twice, as in autumn", "time_utc goes back", "row 31", "needs a zone"
    )
    yield iso(lambda s: [t[:10] for t in s], "the day only", "time_utc is 2017-10-29 at row 1", "59 times")
    yield iso(lambda s: ["29/10/17"] * len(s), "no ISO time at all", "time_utc", "ISO 8601")


# ---------------------------------------------------------------------- whole files


def parquet(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[], bytes]:
    return lambda: change(sound()).to_parquet()


def plain() -> bytes:
    return text_of({}).encode()


def with_rows(*rows: bytes) -> bytes:
    """The sound recording with rows between its header and its numbers."""
    header, *numbers = plain().splitlines()
    return b"\n".join([header, *rows, *numbers])


def files() -> Iterator[Case]:
    yield Case("missing", lambda folder: folder / "run.csv", ("no such file",))
    yield Case("a folder", lambda folder: folder_named(folder / "run.csv"), ("is not a file but a folder",))
    yield Case("a folder of recordings", lambda folder: folder_named(folder / "runs"), ("is not a file but a folder",))
    yield Case("a name too long", lambda folder: folder / ("run.csv" + "x" * 300 + ".csv"), ("cannot be read",))
    for file in ("run.xlsx", "run.txt", "run", "run.csv.zip", "run.mat", "run.tdms"):
        yield content(f"ending of {file}", plain, "the ending says nothing", ".mf4", file=file)
    for file in ("run.csv", "run.csv.gz", "run.parquet", "run.mf4"):
        yield content(f"empty {file}", lambda: b"", "is empty", file=file)
    yield content("blank lines only", lambda: b"\n\n\n", "is empty")
    yield content("comments only", lambda: b"# a\n# b\n", "is empty")
    yield content("header only", lambda: plain().splitlines()[0], "has no rows")
    yield content("no header", lambda: b"\n".join(plain().splitlines()[1:]), "first line holds numbers")
    yield content(
        "semicolons", lambda: plain().replace(b",", b";"), "separated by ';'", "or write it with ','",
        'csv = { separator = ";", decimal = "," } in a mapping file',
    )  # fmt: skip
    yield content(
        "tabs", lambda: plain().replace(b",", b"\t"), "separated by tabs", r'csv = { separator = "\t", decimal = "," }'
    )
    for place in (0, 300, 2000):
        yield content(f"NUL at {place}", lambda p=place: plain()[:p] + b"\0" + plain()[p:], "NUL byte in line")
    yield content("zeros", lambda: bytes(5000), "NUL byte in line 1")
    for place in (10, 1500):
        yield content(
            f"latin-1 at {place}", lambda p=place: plain()[:p] + b"\xb0C" + plain()[p:], "0xb0 in line", "UTF-8"
        )
    yield content("UTF-16", lambda: text_of({}).encode("utf-16"), "is UTF-16")
    yield content("UTF-8 cut in a letter", lambda: plain() + b"# caf\xc3", "not UTF-8")
    yield content(
        "a long row", lambda: plain().replace(b"\n20.0,", b"\n20.0,1,2,3,"), "cannot be read as csv", "line 4"
    )
    header, *rows = plain().splitlines()
    yield content(
        "all rows too long", lambda: b"\n".join([header, *(row + b",1" for row in rows)]), "cannot be read as csv"
    )
    row = plain().splitlines()[20]
    for name, longer in (("one field too many", row + b","), ("a comma within a number", row.replace(b".", b",", 1))):
        yield content(
            name, lambda o=row, n=longer: b"# a remark\n" + plain().replace(o, n), "cannot be read as csv",
            "row 20 (line 22) has 9 fields, but the header names 8 columns",
        )  # fmt: skip
    units = b"s,1/min,Nm,degC,degC,degC,degC,W"
    yield content(
        "a row of units", lambda: with_rows(units),
        "row 1 (below the header) holds units or texts ('s', '1/min', 'Nm', ...) and no number; remove it",
    )  # fmt: skip
    yield content(
        "units and remarks", lambda: with_rows(units, b",rig,rig,,sump,,,"),
        "rows 1-2 (below the header) hold units or texts", "remove them, or begin their lines with '#'",
    )  # fmt: skip
    yield content("an open quote", lambda: plain().replace(b"\n20.0,", b'\n"20.0,'), "cannot be read as csv")
    yield content("an open quote in the header", lambda: b'"' + plain(), "run.csv")
    yield content("a million columns", lambda: b",".join(b"c%d" % i for i in range(100_000)) + b"\n", "100000 columns")
    yield content("an endless line", lambda: b"x" * 1_500_000, "its first line has more than")
    yield content("too large", lambda: plain() * 800, "GB, more than")
    yield content("too many rows", lambda: b"time_s\n" + b"1\n" * 6000, "more than 5000 rows")
    yield content(
        "a gzip bomb", lambda: gzip.compress(b"time_s\n" + b"1" * 5_000_000), "GB, more than", file="run.csv.gz"
    )
    yield content("not gzip", plain, "cannot be read as csv.gz", file="run.csv.gz")
    yield content("gzip cut off", lambda: gzip.compress(plain())[:-200], "cannot be read as csv.gz", file="run.csv.gz")
    yield content("gzip of gzip", lambda: gzip.compress(gzip.compress(plain())), "run.csv.gz", file="run.csv.gz")
    yield content("HTML", lambda: b"<html><body>504 Gateway Timeout</body></html>", "column time_s is missing")
    yield content("JSON", lambda: b'{"time_s": [1, 2], "speed_rpm": [3, 4]}', "run.csv")
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 9\n"
    yield content("a pointer to large data", lambda: pointer, "column time_s is missing")
    for file in ("run.parquet", "run.mf4"):
        yield content(f"text as {file}", plain, "cannot be read as " + file.split(".")[1], file=file)
        yield content(f"noise as {file}", lambda: random.Random(5).randbytes(4000), "cannot be read as", file=file)
    yield content(
        "parquet cut off", lambda: parquet(lambda t: t)()[:-300], "cannot be read as parquet", file="run.parquet"
    )
    yield content(
        "nested parquet",
        parquet(lambda t: t.assign(T_oil_degC=[[1.0, 2.0]] * ROWS)),
        "T_oil_degC",
        "list",
        file="run.parquet",
    )
    yield content(
        "structs in parquet",
        parquet(lambda t: t.assign(note=[{"a": {"b": 1}}] * ROWS)),
        "column note",
        "struct",
        file="run.parquet",
    )
    yield content(
        "bytes in parquet",
        parquet(lambda t: t.assign(speed_rpm=[b"\0"] * ROWS)),
        "speed_rpm",
        "binary",
        file="run.parquet",
    )
    yield content(
        "times in parquet as speed",
        parquet(lambda t: t.assign(speed_rpm=pd.Timestamp(0))),
        "speed_rpm holds datetime64",
        "rows 1-60",
        file="run.parquet",
    )
    yield content(
        "nulls in parquet", parquet(lambda t: t.assign(T_oil_degC=None)), "T_oil_degC", "no value", file="run.parquet"
    )
    yield content("no rows in parquet", parquet(lambda t: t[:0]), "has no rows", file="run.parquet")
    yield content(
        "wide parquet",
        parquet(lambda t: pd.DataFrame(np.zeros((1, 400)), columns=[f"c{i}" for i in range(400)])),
        "400 columns",
        file="run.parquet",
    )
    yield content(
        "long parquet",
        parquet(lambda t: pd.DataFrame({"time_s": np.zeros(9000)})),
        "more than 5000 rows",
        file="run.parquet",
    )


def folder_named(path: Path) -> Path:
    path.mkdir()
    return path


# ---------------------------------------------------------------------- mapping files and parts


def mapped(name: str, mapping: str, *says: str) -> Case:
    def spoil(folder: Path) -> Path:
        (folder / "mapping.toml").write_text(mapping)
        return csv("", lambda t: t).spoil(folder)  # type: ignore[return-value]

    return Case(f"mapping: {name}", spoil, says)


def mappings() -> Iterator[Case]:
    def column(text: str, name: str = "T_oil_degC") -> str:
        return f"schema = 1\n[columns.{name}]\n{text}\n"

    yield mapped("no TOML", "schema = = 1", "mapping.toml: is not valid TOML", "line 1")
    yield mapped("no schema", "max_gap_s = 5", "mapping.toml", "schema = 1")
    yield mapped("another schema", "schema = 7", "mapping.toml: schema", "7")
    yield mapped("unknown key", "schema = 1\nmax_gap = 5", "max_gap is not a known key", "max_gap_s")
    yield mapped(
        "unknown key of a column", column('quantity = "T_oil"\nlag = 5'), "columns.T_oil_degC.lag is not a known key"
    )
    yield mapped(
        "misspelt quantity", column('quanity = "T_oil"'), "columns.T_oil_degC.quanity is not a known key",
        "did you mean 'quantity'?",
    )  # fmt: skip
    yield mapped(
        "key like none of a column", column('quantity = "T_oil"\nzz = 5'), "columns.T_oil_degC.zz is not a known key",
        "known are: bias_sd, lag_s, lag_sd_s, noise, quantity, resolution, rows, scale, unit, valid",
    )  # fmt: skip
    yield mapped(
        "a key and a unit of one column", column('quantity = "T_oil"\nunit = "Celsius"\nlag = 5'),
        "columns.T_oil_degC.lag is not a known key", "columns.T_oil_degC: unit 'Celsius' is no unit of temperature",
    )  # fmt: skip
    yield mapped("no quantity", column('unit = "K"'), "columns.T_oil_degC.quantity is missing")
    yield mapped("unknown quantity", column('quantity = "T_oill"'), "T_oil_degC", "'T_oill'", "did you mean 'T_oil'")
    yield mapped("unknown unit", column('quantity = "T_oil"\nunit = "Celsius"'), "'Celsius' is no unit of temperature")
    yield mapped("unit of another quantity", column('quantity = "speed"\nunit = "kW"'), "'kW' is no unit of speed")
    yield mapped("scale 0", column('quantity = "T_oil"\nscale = 0.0'), "columns.T_oil_degC.scale", "0 would wipe")
    yield mapped("noise below 0", column('quantity = "T_oil"\nnoise = -0.1'), "columns.T_oil_degC.noise", "-0.1")
    yield mapped(
        "valid the wrong way", column('quantity = "T_oil"\nvalid = [90, 10]'), "columns.T_oil_degC.valid", "90, 10"
    )
    yield mapped(
        "valid for nothing",
        column('quantity = "T_oil"\nvalid = [200, 210]'),
        "T_oil_degC: 60 values outside 200 ... 210",
        "none is left",
        "'valid' of its mapping file are in the column's own unit",
    )
    yield mapped("rows of nothing", column('quantity = "T_oil"\nrows = ["9000.."]'), "T_oil_degC has no value")
    yield mapped(
        "rows that are none", column('quantity = "T_oil"\nrows = ["morning"]'), "rows of column T_oil_degC", "'morning'"
    )
    yield mapped(
        "missing column", column('quantity = "T_oil"', "T_sump"), "column T_sump of its mapping file is missing"
    )
    yield mapped(
        "one quantity twice",
        column('quantity = "T_oil"') + '[columns.T_bearing_1_degC]\nquantity = "T_oil"\n',
        "both T_oil",
    )
    yield mapped(
        "constant and column", column('quantity = "T_oil"') + "[constants]\nT_oil = 5.0\n", "constant and the column"
    )
    yield mapped("unknown constant", "schema = 1\n[constants]\nT_room = 5.0\n", "constant 'T_room'")
    yield mapped(
        "constant in kelvin", "schema = 1\n[constants]\nair_speed = 2.0\nT_ambient = 293.15\n", "T_ambient", "kelvin",
        "constants are in degC; write 20",
    )  # fmt: skip
    yield mapped(
        "constant beyond belief", "schema = 1\n[constants]\nair_speed = -2.0\n",
        "constants: air_speed = -2 m/s is not possible; 0 to 200 m/s is, and constants have that unit",
    )  # fmt: skip
    yield mapped("time column missing", 'schema = 1\ntime = { column = "zeit" }', "column zeit of [time]", "missing")
    yield mapped(
        "time of unknown unit", 'schema = 1\ntime = { column = "time_s", unit = "weeks" }', "time.unit", "'weeks'"
    )
    yield mapped(
        "seconds as dates", 'schema = 1\ntime = { column = "time_s", unit = "iso8601" }', "time_s is '0.0' at row 1"
    )
    yield mapped("one sign for both", 'schema = 1\ncsv = { decimal = "," }', "mapping.toml: csv", "same sign")
    yield mapped("separator a letter", 'schema = 1\ncsv = { separator = "x" }', "csv.separator", "'x'")
    yield mapped("another separator", 'schema = 1\ncsv = { separator = ";" }', "run.csv", "separated by ','")
    yield mapped("rows by date", 'schema = 1\nrows = ["2017-01-01.."]', "run.csv", "time_s tells seconds")
    yield mapped("gap of 0", "schema = 1\nmax_gap_s = 0.0", "max_gap_s", "0.0")
    yield mapped("gap shorter than a step", "schema = 1\nmax_gap_s = 1.0", "no two rows are closer than 1 s")
    yield mapped("deep", "schema = 1\nmissing = " + "[" * 3000 + "]" * 3000, "mapping.toml")


def parts() -> Iterator[Case]:
    def no_time(folder: Path) -> str:
        (folder / "run.csv").write_text(text_of({(20, "time_s"): "abc"}))
        return f"{folder / 'run.csv'}@0..100"

    yield Case("part of a file with a row without time", no_time, ("time_s is 'abc' at row 21",))

    def part(text: str, *says: str) -> Case:
        return Case(f"part {text}", lambda folder: f"{csv('', lambda t: t).spoil(folder)}@{text}", ("run.csv", *says))

    yield part("100..50", "ends before it starts")
    yield part("9000..9999", "has no rows in the part")
    yield part("0..15", "has 2 rows in the part")
    yield part("..", "names no part")
    yield part("a..b", "'a' is neither seconds nor a date")
    yield part("0..2017-10-31", "mixes seconds and dates")
    yield part("2017-09-01..2017-10-31", "time_s tells seconds")
    yield part("2017-02-30..", "is no date")
    yield part("nan..5", "neither seconds nor a date")
    yield part("100", "'100' after the @ names no part; write FILE@start..end, e.g. run.csv@0..3600")
    yield part("0-3600", "'0-3600' after the @ names no part", "run.csv@0..3600")
    yield part("", "'' after the @ names no part")


CASES = [*cells(), *columns(), *units(), *times(), *files(), *mappings(), *parts()]


def test_there_are_many_cases() -> None:
    assert len({case.name for case in CASES}) == len(CASES) >= 200


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_bad_recording_is_refused(case: Case, tmp_path: Path, network: ThermalNetwork) -> None:
    given = case.spoil(tmp_path)
    with pytest.raises(InputError) as caught:
        read_recordings([given], network, limits=SMALL)
    message = str(caught.value)
    assert "run" in message or "mapping.toml" in message
    assert all(line.startswith(str(tmp_path)) for line in message.splitlines()), message
    for part in case.says:
        assert part in message, message
    assert len(message) < 4000


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_verb_ends_with_status_2_and_leaves_nothing(
    case: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "in"
    home.mkdir()
    given, before = case.spoil(home), sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(sys, "argv", ["builder", "diagnose", str(given), "--jobs", "1", "--output", f"{tmp_path}/out"])
    with pytest.raises(SystemExit) as end:
        main()
    shown = capsys.readouterr()
    assert end.value.code == 2
    assert shown.out == ""
    assert all(line.startswith(str(home)) for line in shown.err.splitlines()), shown.err
    assert 0 < len(shown.err) < 4000
    assert sorted(tmp_path.rglob("*")) == before


def test_the_sound_recording_is_accepted(tmp_path: Path, network: ThermalNetwork) -> None:
    path = csv("", lambda t: t).spoil(tmp_path)
    recording = read_recordings([path], network, limits=SMALL)[0]
    assert recording.segments == (slice(0, ROWS),)
    assert [note for note in recording.notes if "air_speed" not in note] == []


# ---------------------------------------------------------------------- damage at random


def damaged(source: bytes, seed: int) -> bytes:
    """Bytes changed, left out or put in at a few places."""
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


def read_or_refuse(path: Path, network: ThermalNetwork) -> str:
    try:
        read_recordings([path], network, limits=SMALL)
    except InputError as error:
        message = str(error)
    else:
        return "read"
    assert path.name in message
    return "refused"


@pytest.mark.parametrize("file", ["run.csv", "run.csv.gz", "run.parquet"])
def test_damage_at_random_never_breaks_the_reader(file: str, tmp_path: Path, network: ThermalNetwork) -> None:
    source = {"run.csv": plain, "run.csv.gz": lambda: gzip.compress(plain()), "run.parquet": parquet(lambda t: t)}[
        file
    ]()
    outcomes = []
    for seed in range(60):
        (tmp_path / file).write_bytes(damaged(source, seed))
        outcomes.append(read_or_refuse(tmp_path / file, network))
    assert outcomes.count("refused") > 20


def test_damaged_mdf_never_breaks_the_reader(tmp_path: Path, network: ThermalNetwork) -> None:
    asammdf = pytest.importorskip("asammdf")
    table = sound()
    mdf = asammdf.MDF(version="4.10")
    mdf.append([asammdf.Signal(table[c].to_numpy(), table["time_s"].to_numpy(), name=c) for c in NUMBERS])
    path = tmp_path / "run.mf4"
    mdf.save(path, overwrite=True)
    mdf.close()
    assert read_or_refuse(path, network) == "read"
    source = path.read_bytes()
    for seed in range(8):
        path.write_bytes(damaged(source, seed))
        read_or_refuse(path, network)
    for missing in ("speed_rpm", "torque_Nm"):
        mdf = asammdf.MDF(version="4.10")
        mdf.append(
            [asammdf.Signal(table[c].to_numpy(), table["time_s"].to_numpy(), name=c) for c in NUMBERS if c != missing]
        )
        mdf.save(path, overwrite=True)
        mdf.close()
        with pytest.raises(InputError, match=f"run.mf4: .*{missing} is missing"):
            read_recordings([path], network)


# ---------------------------------------------------------------------- several files


def test_a_held_out_file_that_is_learned_from_is_refused(tmp_path: Path, network: ThermalNetwork) -> None:
    path = csv("", lambda t: t).spoil(tmp_path)
    train = read_recordings([path], network)
    for held in (path, f"{path}@100..300"):
        with pytest.raises(InputError, match="run.csv: is held out, but has the rows"):
            check_holdout(train, read_recordings([held], network))
