"""Tables of users: CSV, CSV.gz and Parquet files as data frames."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import zlib
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice, takewhile
from pathlib import Path
from typing import IO, Any, cast

import pandas as pd

from models.base.errors import InputError
from models.files.numbers import is_number
from models.files.paths import EMPTY, check_file, kind_of
from models.quantities.units import TABLE

CHUNK_ROWS = 100_000
CHUNK_LINES = 1_000
MOST_ROWS = 5_000_000  # of a table in memory
UTF_8 = "utf-8-sig"  # with or without the mark of UTF-8 at its begin
SHOWN = 3  # cells of a row in a message
HEAD_LINES = 100  # in which a header is looked for
MOST_BREAKS = 20  # of lines within the quoted names of a header
# Marks at the begin of a text that state its encoding, and signatures of files that are none.
MARKS = {codecs.BOM_UTF8: UTF_8, codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
NO_TEXTS = {b"PK\x03\x04": "an Excel workbook or a zip archive", b"\xd0\xcf\x11\xe0": "an Excel workbook (.xls)"}
# Texts for a missing value of Excel and of loggers, in addition to those that pandas knows (NaN, #N/A, NULL).
MISSING = ("-", "--", "---", "#NV", "N.A.", "n.a.")
SEPARATORS = {";": "';'", "\t": "tabs", ",": "','", "|": "'|'"}
UNITS = frozenset(symbol for unit in TABLE for symbol in (unit.symbol, *unit.aliases)) - {"1", "-", ""}
_EXCEL_SEPARATOR = re.compile(r'"?sep=.?"?\s*', re.IGNORECASE)  # Excel takes it from the first line
# Texts that head a column ("s", "1/min", "m3/h") have no two digits in a row; dates, times and misspelt numbers do.
_DIGITS = re.compile(r"\d{2}|\d[.,]\d")
_BEGINS_AS_NUMBER = re.compile(r"[+-]?[.,]?\d")
_PANDAS_UNEVEN = re.compile(r"Expected (\d+) fields in line (\d+), saw (\d+)")


@dataclass(frozen=True, kw_only=True)
class TextForm:
    """How a CSV file is written.

    Attributes
    ----------
    separator, decimal : str
        Between columns, and in numbers; numbers with a comma are quoted if both are commas
    thousands : str
        Between groups of three digits
    missing : tuple of str
        Further texts or numbers for a missing value
    texts : tuple of str
        Columns that stay as they are written: dates without signs, whose zeros count
    encoding : str
        Of its text, by a name that Python knows
    skip_lines : tuple of int
        Lines that are no table, counted from 1, such as names of units below the header
    units_below : bool
        True if a row of units may follow the header
    """

    separator: str = ","
    decimal: str = "."
    thousands: str = ""
    missing: tuple[str, ...] = ()
    texts: tuple[str, ...] = ()
    encoding: str = UTF_8
    skip_lines: tuple[int, ...] = ()
    units_below: bool = False


PLAIN = TextForm()
# What gzip, pandas and pyarrow raise on damaged files.
UNREADABLE = (ValueError, LookupError, ArithmeticError, OSError, EOFError, MemoryError, RuntimeError, zlib.error)


def column_names(path: Path, form: TextForm = PLAIN) -> tuple[str, ...]:
    """Return the names of the columns without reading rows; none if they cannot be read (reading reports why)."""
    try:
        check_file(path)
        if kind_of(path) == ".parquet":
            from pyarrow import parquet

            return tuple(distinct(parquet.read_schema(path).names))
        with _open_text(path, form) as text:
            header = next(filter(str.strip, _first_lines(_lines(path, text, form), 1).values()))
            return tuple(distinct(_fields(header, form.separator)))
    except (InputError, ImportError, StopIteration, csv.Error, *UNREADABLE):
        return ()


def column_units(path: Path, form: TextForm) -> dict[str, str]:
    """Return units by column from the row of units below the header of a CSV file; none if it has no such row."""
    if kind_of(path) == ".parquet":
        return {}
    try:
        with _open_text(path, form) as text:
            head = _read_head(path, _lines(path, text, form), form)
    except (csv.Error, *UNREADABLE):  # reading reports why
        return {}
    return {name: unit for name, unit in zip(head.names, head.units, strict=False) if unit}


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
    numbers = [float(text) for text in missing if is_number(text)]

    def marked(cells: pd.Series) -> pd.Series:
        if pd.api.types.is_numeric_dtype(cells.dtype):
            return cells.isin(numbers)
        return cells.map(lambda cell: isinstance(cell, str) and cell.strip() in missing).astype(bool)

    return table.mask(table.apply(marked)) if len(table) else table


def distinct(names: Sequence[str]) -> list[str]:
    """Return names of columns with the place of those that come twice; those that are empty as pandas names them.

    Examples
    --------
    >>> distinct(["n", "Status", "Status", ""])
    ['n', 'Status (column 2)', 'Status (column 3)', 'Unnamed: 3']
    """
    count = Counter(names)
    placed = enumerate(names, start=1)
    return [
        f"Unnamed: {place - 1}" if not name else name if count[name] == 1 else f"{name} (column {place})"
        for place, name in placed
    ]


def copies_of(name: str, names: Iterable[str]) -> list[str]:
    """Return what :func:`distinct` makes of a name that comes twice, among `names`; also for groups of an MDF file."""
    copy = re.compile(re.escape(name) + r" \((?:column|group) \d+\)")
    return [other for other in names if copy.fullmatch(other)]


# ---------------------------------------------------------------------- text


@contextmanager
def _open_text(path: Path, form: TextForm) -> Iterator[io.TextIOWrapper]:
    """Open a text in the encoding that a mark at its begin states, else in that of the form."""
    with gzip.open(path, "rb") if kind_of(path) == ".csv.gz" else path.open("rb") as file:
        start = cast(io.BufferedReader, file).peek(4)
        for signature, kind in NO_TEXTS.items():
            if start.startswith(signature):
                raise InputError(f"{path}: is {kind}, no text; save its table as CSV (UTF-8)")
        encoding = next((name for mark, name in MARKS.items() if start.startswith(mark)), form.encoding)
        with io.TextIOWrapper(cast(IO[bytes], file), encoding=encoding, errors="surrogateescape") as text:
            yield text


class _Text:
    """Lines as the file that pandas asks for."""

    def __init__(self, lines: Iterator[str]) -> None:
        self._lines = lines

    def __iter__(self) -> Iterator[str]:
        return self._lines

    def read(self, _size: int = -1) -> str:
        """Return some lines, as pandas asks for text."""
        return "".join(islice(self._lines, CHUNK_LINES))


def _lines(path: Path, text: Iterable[str], form: TextForm) -> Iterator[str]:
    """Yield lines; those that are no table are blank, and one of foreign bytes is refused with its number."""
    for number, line in enumerate(text, start=1):
        if "\0" in line:
            advice = "it is no text, or damaged"
            if number == 1 and set(line[1:10:2]) == {"\0"}:
                advice = f"it looks like UTF-16 without a mark: {_to_decode('utf-16-le')}"
            raise InputError(f"{path}: a NUL byte in line {number}; {advice}")
        try:
            line.encode()
        except UnicodeEncodeError as error:
            byte, encoding = ord(line[error.start]) - 0xDC00, form.encoding.removesuffix("-sig").upper()
            raise InputError(
                f"{path}: byte 0x{byte:02x} in line {number} is not {encoding}; {_to_decode('cp1252')}"
            ) from error
        is_stated = number == 1 and _EXCEL_SEPARATOR.fullmatch(line)
        # A '#' within a row is a cell such as '#REF!', so that pandas' own option for remarks cannot be used.
        yield "\n" if is_stated or line.startswith("#") or number in form.skip_lines else line


def _to_decode(encoding: str) -> str:
    """Return what to do with a text of another encoding."""
    return f'give csv = {{ encoding = "{encoding}" }} in a mapping file (--mapping), or save the file as UTF-8'


def _first_lines(lines: Iterator[str], count: int) -> dict[int, str]:
    """Take the first lines by number, up to `count` that are not blank; names may have line breaks within quotes."""
    head: dict[int, str] = {}
    numbered = enumerate(lines, start=1)
    while count > 0 and (first := next(numbered, None)):
        number, line = first
        for _ in range(MOST_BREAKS):
            if line.count('"') % 2:
                line += next(numbered, (0, ""))[1]
        head[number] = line
        count -= bool(line.strip())
    return head


def _fields(line: str, separator: str) -> list[str]:
    rows = csv.reader(io.StringIO(line), delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in next(rows, [])]


def _text_chunks(path: Path, form: TextForm) -> Iterator[pd.DataFrame]:
    with _open_text(path, form) as text:
        lines = _lines(path, text, form)
        head = _read_head(path, lines, form)
        names, width, whole = head.names, head.width, _Text(chain(head.lines, lines))
        try:
            for chunk in pd.read_csv(
                cast(Any, whole), names=names, header=0, sep=form.separator, decimal=form.decimal,
                na_values=[*MISSING, *form.missing], dtype={name: str for name in names if name in form.texts},
                skipinitialspace=True, index_col=False, chunksize=CHUNK_ROWS, low_memory=False,
            ):  # fmt: skip
                beyond = chunk.index[chunk.iloc[:, width:].notna().any(axis=1)]
                if len(beyond):
                    raise InputError(
                        f"{path}: row {beyond[0] + 1} has more fields than the header; remove what is too much"
                    )
                yield chunk.iloc[:, :width]
        except pd.errors.ParserError as error:
            uneven = _PANDAS_UNEVEN.search(str(error))
            if uneven is None:
                raise
            expected, line, count = map(int, uneven.groups())
            raise InputError(f"{path}: {_too_many_fields(line, count, expected, form)}") from error


@dataclass(frozen=True)
class _Head:
    """Names of all columns, none twice, the number of those that the header has, units, and lines for pandas."""

    names: list[str]
    width: int
    units: list[str]
    lines: list[str]


def _read_head(path: Path, lines: Iterator[str], form: TextForm) -> _Head:
    """Read the first lines.

    Refused are another separator, no header, lines above it, and rows of texts or too many fields below it. A row of
    units below it (where the form has one), and separators at the ends of the rows, are taken as such.
    """
    head = _first_lines(lines, HEAD_LINES)
    rows = [(number, _fields(line, form.separator)) for number, line in head.items() if line.strip()]
    if not rows:
        raise InputError(f"{path}: {EMPTY}")
    at, names = rows[0]
    above = _header_among([cells for _, cells in rows])
    if above is None:
        _check_separator(path, [head[number] for number, _ in rows], form)
    if above:
        first, last = at, rows[above - 1][0]
        where = f"lines {first}-{last}" if last > first else f"line {first}"
        texts = f"{where} above the header (line {rows[above][0]}: {_shown(rows[above][1])})"
        raise InputError(f"{path}: {texts}: no part of the table; {_to_skip([n for n, _ in rows[:above]], form)}")
    if all(is_number(name) for name in names):
        raise InputError(f"{path}: its first line holds numbers; a header line with column names is needed")
    below, units = rows[1:], list[str]()
    texts_below = list(takewhile(lambda row: _holds_texts(row[1]) or _are_units(row[1]), below))
    if form.units_below and texts_below and _are_units(texts_below[0][1]):
        number, cells = texts_below.pop(0)
        units = [cell.strip("[]()") for cell in cells]
        head[number] = "\n"
    if texts_below:
        number, cells = texts_below[0]
        raise InputError(
            f"{path}: line {number} (below the header) holds units or texts ({_shown(cells)}) and no number; "
            + _to_skip([number for number, _ in texts_below], form)
        )
    width = len(names)
    longest = max((len(cells) for _, cells in below), default=width)
    for number, cells in below:
        if any(cells[width:]):
            raise InputError(f"{path}: {_too_many_fields(number, len(cells), width, form)}")
    return _Head(distinct([*names, *[""] * (longest - width)]), width, units, list(head.values()))


def _check_separator(path: Path, lines: Sequence[str], form: TextForm) -> None:
    """Refuse lines that have a header with another separator, or a first line of one field that has several then."""
    others = [other for other in SEPARATORS if other != form.separator]
    likely = [other for other in others if _header_among([_fields(line, other) for line in lines]) is not None]
    if len(_fields(lines[0], form.separator)) == 1:
        likely += [other for other in others if other in lines[0]]
    if likely:
        decimal = "," if any(re.search(r"\d,\d", line) for line in lines) else "."
        advice = _advice(likely[0], decimal)
        raise InputError(f"{path}: its columns are separated by {SEPARATORS[likely[0]]}; {advice}")
    if len(_fields(lines[0], form.separator)) > 1:
        return
    words = {len(line.split()) for line in lines}
    if len(lines) > 1 and len(words) == 1 and words.pop() > 1:
        raise InputError(f"{path}: its columns are separated by spaces; write it with ',' between columns")


def _header_among(rows: Sequence[Sequence[str]]) -> int | None:
    """Return the place of the first row that heads as many columns as the table has; None if there is none."""
    table = rows[len(rows) // 2 :]
    fewest, most = max(len(_filled(cells)) for cells in table), max(map(len, table))
    for number, cells in enumerate(rows[:-1]):
        names = _filled(cells)
        differ = len(names) == len(set(names)) > 1
        if (
            differ
            and fewest <= len(names) <= most
            and not any(not name or _BEGINS_AS_NUMBER.match(name) for name in names)
            and not _are_units(names)
        ):
            return number
    return None


def _are_units(cells: Sequence[str]) -> bool:
    """Return True if most cells are units, also in brackets, and the others are texts; ``-`` and empty ones aside."""
    others = [cell for cell in (cell.strip("[]()") for cell in cells) if cell not in ("", "-", *UNITS)]
    units = sum(cell.strip("[]()") in UNITS for cell in cells)
    return units > len(others) and not any(_BEGINS_AS_NUMBER.match(cell) for cell in others)


def _filled(cells: Sequence[str]) -> Sequence[str]:
    """Leave out empty cells at the end."""
    count = next((i for i in range(len(cells), 0, -1) if cells[i - 1]), 0)
    return cells[:count]


def _holds_texts(cells: Sequence[str]) -> bool:
    """Return True for a row of texts, no number or date among them; False for an empty one."""
    filled = [cell for cell in cells if cell]
    return bool(filled) and not any(is_number(cell) or _DIGITS.search(cell) for cell in filled)


def _shown(cells: Sequence[str]) -> str:
    filled = [cell for cell in cells if cell]
    return ", ".join(repr(cell[:20]) for cell in filled[:SHOWN]) + (", ..." if len(filled) > SHOWN else "")


def _to_skip(numbers: Sequence[int], form: TextForm) -> str:
    """Return what to do with lines that are no table."""
    skipped, it = sorted({*form.skip_lines, *numbers}), "it" if len(numbers) == 1 else "them"
    return f"remove {it}, give csv = {{ skip_lines = {skipped} }} in a mapping file (--mapping), or begin {it} with '#'"


def _too_many_fields(line: int, count: int, names: int, form: TextForm) -> str:
    if names == 1:
        title = f"if that is a title, {_to_skip([1], form)}"
        return f"line {line} has {count} fields, but the first line names one column; {title}"
    return (
        f"line {line} has {count} fields, but the header names {names} columns; remove what is too much, e.g. a "
        f"{form.separator!r} within a number"
    )


def _advice(separator: str, decimal: str) -> str:
    """Return what to do with a file of another separator."""
    if separator == ",":
        return 'the mapping file in use states others: give csv = { separator = "," } there, or name another --mapping'
    shown = "\\t" if separator == "\t" else separator
    return (
        f'give csv = {{ separator = "{shown}", decimal = "{decimal}" }} in a mapping file (--mapping), or write it '
        "with ',' and decimal points"
    )


# ---------------------------------------------------------------------- Parquet


def _parquet_chunks(path: Path) -> Iterator[pd.DataFrame]:
    import pyarrow as pa
    from pyarrow import parquet

    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
        names = distinct(schema.names)
        nested = [f for f in schema if pa.types.is_nested(f.type) or pa.types.is_binary(f.type)]
        if nested:
            raise InputError("\n".join(
                f"{path}: column {f.name} holds {str(f.type)[:60]}; a number, time or text per row is needed: remove it"
                for f in nested[:10]
            ))  # fmt: skip
        row = 0
        for batch in file.iter_batches(batch_size=CHUNK_ROWS):
            chunk = batch.to_pandas(ignore_metadata=True)
            chunk = chunk.set_axis(names, axis=1).set_axis(pd.RangeIndex(row, row + len(chunk)))
            row += len(chunk)
            yield chunk
        if row == 0:
            yield schema.empty_table().to_pandas(ignore_metadata=True).set_axis(names, axis=1)
