"""Tables of users: CSV, CSV.gz and Parquet files as data frames."""

from __future__ import annotations

import csv
import gzip
import io
import re
import zlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO, Any, cast

import pandas as pd

from models.base.errors import InputError
from models.files.paths import EMPTY, check_file, kind_of

CHUNK_ROWS = 100_000
CHUNK_LINES = 1_000
MOST_ROWS = 5_000_000  # of a table in memory
UTF_8 = "utf-8-sig"  # with or without the mark of UTF-8 at its begin
SHOWN = 3  # cells of a row of units in a message
# Texts that head a column ("s", "1/min", "m3/h") have no two digits in a row; dates, times and misspelt numbers do.
_DIGITS = re.compile(r"\d{2}|\d[.,]\d")
_PANDAS_UNEVEN = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")


@dataclass(frozen=True, kw_only=True)
class TextForm:
    """How a CSV file is written.

    Attributes
    ----------
    separator, decimal : str
        Between columns, and in numbers
    missing : tuple of str
        Further texts or numbers for a missing value
    texts : tuple of str
        Columns that stay as they are written: dates without signs, whose zeros count
    encoding : str
        Of its text, by a name that Python knows
    skip_lines : tuple of int
        Lines that are no table, counted from 1, such as names of units below the header
    by_mapping : bool
        True if a mapping file can state all this, which messages then advise
    """

    separator: str = ","
    decimal: str = "."
    missing: tuple[str, ...] = ()
    texts: tuple[str, ...] = ()
    encoding: str = UTF_8
    skip_lines: tuple[int, ...] = ()
    by_mapping: bool = False


PLAIN = TextForm()
# What gzip, pandas and pyarrow raise on damaged files.
UNREADABLE = (ValueError, LookupError, ArithmeticError, OSError, EOFError, MemoryError, RuntimeError, zlib.error)


def column_names(path: Path, form: TextForm = PLAIN) -> tuple[str, ...]:
    """Return the names of the columns without reading rows; none if they cannot be read (reading reports why)."""
    try:
        check_file(path)
        if kind_of(path) == ".parquet":
            from pyarrow import parquet

            return tuple(parquet.read_schema(path).names)
        with _open_text(path, form) as text:
            return tuple(_fields(_Lines(path, text, form).next_filled(), form.separator))
    except (InputError, ImportError, csv.Error, *UNREADABLE):
        return ()


def read_table(path: Path) -> pd.DataFrame:
    """Read a CSV, CSV.gz or Parquet file.

    Returns
    -------
    DataFrame
        Its index counts the rows of the file from 0; a column with a cell that is no number holds texts

    Raises
    ------
    InputError
        If the file is missing, empty, too long, of another kind, or its content cannot be read.
    """
    return together(path, read_chunks(path, PLAIN))


def together(path: Path, chunks: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Join chunks of one file.

    Raises
    ------
    InputError
        If they have more than 5 million rows.
    """
    kept: list[pd.DataFrame] = []
    rows = 0
    for chunk in chunks:
        rows += len(chunk)
        if rows > MOST_ROWS:
            raise InputError(f"{path}: has more than {MOST_ROWS} rows; take a part of it, or every n-th row")
        kept.append(chunk)
    filled = [chunk for chunk in kept if len(chunk)] or kept[:1]  # chunks of no rows have untyped columns
    return pd.concat(filled) if len(filled) > 1 else filled[0]


def read_chunks(path: Path, form: TextForm) -> Iterator[pd.DataFrame]:
    """Read a file, of a CSV file in the given form, in chunks of rows, at least one; see :func:`read_table`."""
    kind = kind_of(path)
    check_file(path)
    try:
        for chunk in _parquet_chunks(path) if kind == ".parquet" else _text_chunks(path, form):
            yield without(form.missing, chunk)
    except InputError:
        raise
    except ImportError as error:
        raise InputError(f"{path}: reading Parquet needs pyarrow; python -m pip install pyarrow") from error
    except UNREADABLE as error:
        text = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(f"{path}: cannot be read as {kind.removeprefix('.')}: {text}") from error


def without(missing: Collection[str], table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose cells of certain texts or numbers are missing."""
    if not missing:
        return table
    numbers = [float(text) for text in missing if _is_number(text)]

    def marked(cells: pd.Series) -> pd.Series:
        if pd.api.types.is_numeric_dtype(cells.dtype):
            return cells.isin(numbers)
        return cells.map(lambda cell: isinstance(cell, str) and cell.strip() in missing).astype(bool)

    return table.mask(table.apply(marked)) if len(table) else table


def _check_names(path: Path, names: list[str]) -> None:
    repeated = sorted({name for name in names if name and names.count(name) > 1})
    if repeated:
        raise InputError("\n".join(f"{path}: column {name[:80]} is there twice; remove one" for name in repeated[:10]))


# ---------------------------------------------------------------------- text

_STATED = "or state in a mapping file (--mapping) how it is written"


def _open_text(path: Path, form: TextForm) -> io.TextIOWrapper:
    file = gzip.open(path, "rb") if kind_of(path) == ".csv.gz" else path.open("rb")  # noqa: SIM115  closed with the text
    return io.TextIOWrapper(cast(IO[bytes], file), encoding=form.encoding, errors="surrogateescape")


class _Lines:
    """Lines of a text for pandas: what is no table is blank, and foreign bytes are refused with their line number."""

    def __init__(self, path: Path, text: io.TextIOWrapper, form: TextForm) -> None:
        self.path, self.number, self.form = path, 0, form
        self._text = text
        self._waiting: list[str] = []

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        line = self._waiting.pop(0) if self._waiting else self._read_line()
        if not line:
            raise StopIteration
        return line

    def _read_line(self) -> str:
        line = next(self._text, "")
        self.number += 1
        if self.number == 1 and line.startswith(("\udcff\udcfe", "\udcfe\udcff")):
            raise InputError(f"{self.path}: is UTF-16 text; {self._advice('utf-16')}")
        if "\0" in line:
            raise InputError(f"{self.path}: a NUL byte in line {self.number}; it is no text, or damaged")
        if not line.isascii():
            try:
                line.encode()
            except UnicodeEncodeError as error:
                byte, encoding = ord(line[error.start]) - 0xDC00, self.form.encoding.removesuffix("-sig").upper()
                raise InputError(
                    f"{self.path}: byte 0x{byte:02x} in line {self.number} is not {encoding}; {self._advice('cp1252')}"
                ) from error
        # A '#' within a row is a cell such as '#REF!', so that pandas' own option for remarks cannot be used.
        return "\n" if line.startswith("#") or self.number in self.form.skip_lines else line

    def _advice(self, encoding: str) -> str:
        plain = "save the file as UTF-8"
        if not self.form.by_mapping:
            return f"{plain}, {_STATED}"
        return f'give csv = {{ encoding = "{encoding}" }} in a mapping file, or {plain}'

    def next_filled(self) -> str:
        """Return the next line that is not blank; pandas will read it again. Empty at the end."""
        while line := self._read_line():
            self._waiting.append(line)
            if line.strip():
                return line
        return ""

    def read(self, _size: int = -1) -> str:
        """Return some lines, as pandas asks for text."""
        return "".join(islice(self, CHUNK_LINES))


def _fields(line: str, separator: str) -> list[str]:
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def _text_chunks(path: Path, form: TextForm) -> Iterator[pd.DataFrame]:
    with _open_text(path, form) as text:
        lines = _Lines(path, text, form)
        names = _check_head(path, lines, form)
        try:
            for chunk in pd.read_csv(
                cast(Any, lines), sep=form.separator, decimal=form.decimal, na_values=list(form.missing),
                dtype={name: str for name in names if name.strip() in form.texts}, skipinitialspace=True,
                index_col=False, chunksize=CHUNK_ROWS, low_memory=False,
            ):  # fmt: skip
                yield chunk.rename(columns=lambda name: str(name).strip())
        except pd.errors.ParserError as error:
            uneven = _PANDAS_UNEVEN.search(str(error))
            if uneven is None:
                raise
            expected, line, count = map(int, uneven.groups())
            raise InputError(f"{path}: {_too_many_fields(line, count, expected, form)}") from error


def _check_head(path: Path, lines: _Lines, form: TextForm) -> list[str]:
    """Return the names of the columns as they stand there.

    Refused are another separator, no header, repeated names, and rows of units or too many fields below the header.
    """
    header = lines.next_filled()
    if not header:
        raise InputError(f"{path}: {EMPTY}")
    names = _fields(header, form.separator)
    for other, word in ((";", "';'"), ("\t", "tabs"), (",", "','")):
        if len(names) == 1 and other in names[0]:
            raise InputError(f"{path}: its columns are separated by {word}; {_advice(other, form)}")
    if all(_is_number(name) for name in names):
        raise InputError(f"{path}: its first line holds numbers; a header line with column names is needed")
    _check_names(path, names)
    first = _fields(lines.next_filled(), form.separator)
    if len(first) > len(names):
        raise InputError(f"{path}: {_too_many_fields(lines.number, len(first), len(names), form)}")
    cells = [cell for cell in first if cell]
    if cells and not any(_is_number(cell) or _DIGITS.search(cell) for cell in cells):
        skipped = [*form.skip_lines, lines.number]
        shown = ", ".join(repr(cell[:20]) for cell in cells[:SHOWN]) + (", ..." if len(cells) > SHOWN else "")
        raise InputError(
            f"{path}: line {lines.number} (below the header) holds units or texts ({shown}) and no number; remove it, "
            + (f"give csv = {{ skip_lines = {skipped} }} in a mapping file, " if form.by_mapping else "")
            + "or begin it with '#'"
        )
    return next(csv.reader([header], delimiter=form.separator, skipinitialspace=True))


def _too_many_fields(line: int, count: int, names: int, form: TextForm) -> str:
    if names == 1:
        return (
            f"line {line} has {count} fields, but the first line names one column; if that is a title, remove it or "
            + (f"give csv = {{ skip_lines = {[*form.skip_lines, 1]} }} in a mapping file, " if form.by_mapping else "")
            + "or begin it with '#'"
        )
    return (
        f"line {line} has {count} fields, but the header names {names} columns; remove what is too much, e.g. a "
        f"{form.separator!r} at its end or within a number"
    )


def _advice(separator: str, form: TextForm) -> str:
    """Return what to do with a file of another separator."""
    plain = "write it with ',' and decimal points"
    if not form.by_mapping:
        return f"{plain}, {_STATED}"
    if separator == ",":
        return 'the mapping file in use states others: give csv = { separator = "," } there, or name another --mapping'
    shown = "\\t" if separator == "\t" else separator
    return (
        f'give csv = {{ separator = "{shown}", decimal = "," }} in a mapping file (decimal = "." where its numbers '
        f"have points), or {plain}"
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


# ---------------------------------------------------------------------- Parquet


def _parquet_chunks(path: Path) -> Iterator[pd.DataFrame]:
    import pyarrow as pa
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
        _check_names(path, list(schema.names))
        nested = [f for f in schema if pa.types.is_nested(f.type) or pa.types.is_binary(f.type)]
        if nested:
            raise InputError("\n".join(
                f"{path}: column {f.name} holds {str(f.type)[:60]}; a number, time or text per row is needed: remove it"
                for f in nested[:10]
            ))  # fmt: skip
        row = 0
        for batch in file.iter_batches(batch_size=CHUNK_ROWS):
            chunk = batch.to_pandas(ignore_metadata=True)
            chunk.index = pd.RangeIndex(row, row + len(chunk))
            row += len(chunk)
            yield chunk
        if row == 0:
            yield schema.empty_table().to_pandas(ignore_metadata=True)
