"""Tables in and out: cycles and results as CSV, CSV.gz or Parquet. Files appear whole or not at all."""

from __future__ import annotations

import contextlib
import gzip
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd
from numpy.typing import ArrayLike

from models.cycle import Cycle
from models.errors import InputError
from models.table_file import kind_of, read_table

HOTTEST_START = 250.0  # degC
DECIMALS = 6  # of results: a millionth of a kelvin or a watt


def read_cycle(path: Path, extra: tuple[str, ...] = ()) -> Cycle:
    """Read a cycle; see :meth:`models.cycle.Cycle.from_columns`."""
    table = read_table(path)
    return Cycle.from_columns({str(c): table[c].to_numpy() for c in table.columns}, name=str(path), extra=extra)


def read_initial(value: str) -> float | dict[str, float]:
    """Initial temperatures: a number in degC, or a file whose ``T_<node>_degC`` columns end with them.

    The last row counts, so that a result can be continued.

    Raises
    ------
    InputError
        If it is neither.

    Examples
    --------
    >>> read_initial("20")
    20.0
    """
    try:
        T = float(value)
    except ValueError:
        return _last_row(Path(value))
    if not -273.15 < T <= HOTTEST_START:
        raise InputError(
            f"--initial {value}: must be a finite number above -273.15 degC and up to {HOTTEST_START:g} degC"
            + (f"; if kelvin are meant, give {T - 273.15:g}" if HOTTEST_START < T < 1000.0 else "")
        )
    return T


def _last_row(path: Path) -> dict[str, float]:
    table = read_table(path)
    columns = [str(c) for c in table.columns if str(c).startswith("T_") and str(c).endswith("_degC")]
    last = {c: table[c].iloc[-1] for c in columns if c != "T_ambient_degC" and len(table)}
    if not last:
        raise InputError(f"{path}: has no T_<node>_degC columns with values to start from")
    numbers = pd.to_numeric(pd.Series(last), errors="coerce")
    for name, T in numbers.items():
        if not -273.15 < T <= HOTTEST_START:
            raise InputError(
                f"{path}: {name} is {last[str(name)]} in the last row, row {len(table)}; to start from, a number above "
                f"-273.15 and up to {HOTTEST_START:g} degC is needed"
            )
    return {str(name)[2:-5]: float(T) for name, T in numbers.items()}


def write_table(path: Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns as CSV, CSV.gz or Parquet by the file's ending.

    Raises
    ------
    InputError
        If the ending is another one or the folder cannot be written to.
    """
    kind = kind_of(path)
    table = pd.DataFrame(dict(columns))
    with appearing_whole(path) as partial:
        if kind == ".parquet":
            try:
                table.to_parquet(partial)
            except ImportError as error:
                raise InputError(
                    f"{path}: writing Parquet needs pyarrow; install gearbox-thermal-twin[parquet]"
                ) from error
        else:
            text = table.round(DECIMALS).to_csv(index=False, lineterminator="\n").encode()
            # Neither name nor time go into the archive, so that the same table gives the same bytes.
            partial.write_bytes(gzip.compress(text, mtime=0) if kind == ".csv.gz" else text)


@contextlib.contextmanager
def appearing_whole(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that becomes `path` when the block ends well, and vanishes otherwise.

    It has the ending of `path`, so that who writes by the ending may write to it.

    Raises
    ------
    InputError
        If the folder cannot be made or written to.
    """
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=folder)
        os.close(handle)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another output") from error
    partial = Path(name)
    try:
        yield partial
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file")
        partial.chmod(0o644)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
