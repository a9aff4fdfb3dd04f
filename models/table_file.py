"""Tables of users: CSV, CSV.gz and Parquet, read within limits, and refused with the reason where not sound."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import warnings
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, cast

import pandas as pd

from models.errors import InputError

KINDS = (".csv", ".csv.gz", ".parquet")
CHUNK_ROWS = 100_000
CHUNK_BYTES = 1 << 20
LONGEST_HEADER = 1 << 20  # bytes
MOST_HEAD_ROWS = 3  # rows of units or remarks below a header that are recognised as such
SHOWN = 3  # cells of such a row in a message
# Texts that head a column ("s", "1/min", "m3/h") have no two digits in a row; dates, times and misspelt numbers do.
_DIGITS = re.compile(r"\d{2}|\d[.,]\d")
_PANDAS_UNEVEN = re.compile(r"Expected \d+ fields in line|Length of header or names does not match length of data")


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What is read at most; beyond it a file is refused before it fills the memory.

    Attributes
    ----------
    size_bytes : int
        Of a file, unpacked
    rows, columns : int
        Of a table; rows that are not kept do not count
    """

    size_bytes: int = 2_000_000_000
    rows: int = 5_000_000
    columns: int = 2_000


@dataclass(frozen=True, kw_only=True)
class TextForm:
    """How a CSV file is written.

    Attributes
    ----------
    separator, decimal : str
        Between columns, and in numbers
    missing : tuple of str
        Further texts for a missing value
    by_mapping : bool
        Whether a mapping file can say all this, which messages then advise
    """

    separator: str = ","
    decimal: str = "."
    missing: tuple[str, ...] = ()
    by_mapping: bool = False


LIMITS = Limits()
PLAIN = TextForm()
# What gzip, pandas and pyarrow raise on damaged and on hostile files.
UNREADABLE = (
    ValueError, LookupError, ArithmeticError, OSError, EOFError, MemoryError, RuntimeError, zlib.error,
    pd.errors.ParserWarning,
)  # fmt: skip
Keep = Callable[[pd.DataFrame], pd.DataFrame]


def kind_of(path: Path, kinds: tuple[str, ...] = KINDS) -> str:
    """Ending of a file, one of `kinds`.

    Raises
    ------
    InputError
        If it is another one, or a folder.
    """
    if is_folder(path):
        raise InputError(f"{path}: is not a file but a folder; name a file in it ({', '.join(kinds)})")
    for kind in kinds:
        if path.name.lower().endswith(kind):
            return kind
    raise InputError(f"{path}: the ending says nothing; use one of {', '.join(kinds)}")


def is_folder(path: Path) -> bool:
    """Whether it is a folder; a name that cannot be is none, and who opens it says so."""
    try:
        return path.is_dir()
    except (OSError, ValueError):  # too long, or with NUL in it
        return False


def check_file(path: Path, limits: Limits = LIMITS) -> None:
    """Refuse what is not a file, is empty or is too large.

    Raises
    ------
    InputError
    """
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file")
        if not path.is_file():
            raise InputError(f"{path}: is not a file but {'a folder' if path.is_dir() else 'a device or pipe'}")
        size = path.stat().st_size
    except (OSError, ValueError) as error:  # a name that is too long, or holds NUL
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from error
    if size == 0:
        raise InputError(f"{path}: is empty; a header line with column names and rows are needed")
    if size > limits.size_bytes:
        raise InputError(f"{path}: {_too_large(size, limits)}")


def column_names(path: Path, separator: str = PLAIN.separator) -> tuple[str, ...]:
    """Names of the columns of a CSV, CSV.gz or Parquet file, of which no row is read.

    Empty where they cannot be told: who reads the table says why.
    """
    try:
        check_file(path)
        if kind_of(path) == ".parquet":
            from pyarrow import parquet

            return tuple(parquet.read_schema(path).names)
        with _opened(path) as file:
            head = file.read(LONGEST_HEADER)
        return tuple(_names_in(_header(path, head.removeprefix(codecs.BOM_UTF8))[1], separator))
    except (InputError, ImportError, csv.Error, StopIteration, *UNREADABLE):
        return ()


def read_table(
    path: Path, *, form: TextForm = PLAIN, limits: Limits = LIMITS, keep: Keep | None = None
) -> pd.DataFrame:
    """Read a CSV, CSV.gz or Parquet file.

    Parameters
    ----------
    path : Path
    form : TextForm
        Of a CSV file
    limits : Limits
    keep : callable or None
        Gives the rows of a part of the table that are to be kept; by default all

    Returns
    -------
    DataFrame
        Its index counts the rows of the file from 0; a column with a cell that is no number holds texts

    Raises
    ------
    InputError
        If the file is missing, empty, too large, of another kind, or its content cannot be read.
    """
    kind = kind_of(path)
    check_file(path, limits)
    try:
        parts = _parquet_parts(path, limits) if kind == ".parquet" else _text_parts(path, form, limits)
        return _together(path, parts, limits, keep)
    except InputError:
        raise
    except ImportError as error:
        raise InputError(f"{path}: reading Parquet needs pyarrow; python -m pip install pyarrow") from error
    except pd.errors.EmptyDataError as error:
        raise InputError(f"{path}: is empty; a header line with column names and rows are needed") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: {_not_utf8(error.object[error.start], error.start)}") from error
    except UNREADABLE as error:
        first_line = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(f"{path}: cannot be read as {kind.removeprefix('.')}: {first_line}") from error


def _together(path: Path, parts: Iterator[pd.DataFrame], limits: Limits, keep: Keep | None) -> pd.DataFrame:
    kept: list[pd.DataFrame] = []
    rows = 0
    for number, part in enumerate(parts):
        if number == 0:
            _check_first_rows(path, part)
        wanted = part if keep is None else keep(part)
        rows += len(wanted)
        if rows > limits.rows:
            raise InputError(f"{path}: has more than {limits.rows} rows; take a part of it, or every n-th row")
        if len(wanted) or not kept:
            kept.append(wanted)
    # Parts of no rows have no types of their own.
    filled = [part for part in kept if len(part)] or kept[:1]
    return pd.concat(filled) if len(filled) > 1 else filled[0]


def _check_first_rows(path: Path, table: pd.DataFrame) -> None:
    """Refuse rows of units or remarks between header and numbers, as exports of test benches have them.

    Raises
    ------
    InputError
        If no cell of the first rows is a number, and those of the next one are.
    """
    heads: list[list[str]] = []
    for row in range(min(len(table), MOST_HEAD_ROWS + 1)):
        cells = [str(cell).strip() for cell in table.iloc[row] if not pd.isna(cell)]
        if any(_is_number(cell) for cell in cells):
            break
        if not any(cells) or any(_DIGITS.search(cell) for cell in cells):
            return
        heads.append(cells)
    else:
        return
    if heads:
        rows, them = ("row 1", "it") if len(heads) == 1 else (f"rows 1-{len(heads)}", "them")
        first = ", ".join(repr(cell[:20]) for cell in heads[0][:SHOWN]) + (", ..." if len(heads[0]) > SHOWN else "")
        verb = "holds" if len(heads) == 1 else "hold"
        raise InputError(
            f"{path}: {rows} (below the header) {verb} units or texts ({first}) and no number; remove {them}, or begin "
            f"{'its line' if len(heads) == 1 else 'their lines'} with '#'"
        )


def _too_large(size: int, limits: Limits) -> str:
    return (
        f"has {size / 1e9:.3g} GB, more than the {limits.size_bytes / 1e9:.3g} GB that are read; take a part of it, "
        "or every n-th row"
    )


# ---------------------------------------------------------------------- text


@dataclass(frozen=True, kw_only=True)
class _Scan:
    """What a first look at a text finds: the lines before the header, the header, and whether # only begins lines."""

    before: int
    header: str
    comments: bool


def _opened(path: Path) -> IO[bytes]:
    return cast(IO[bytes], gzip.open(path, "rb")) if kind_of(path) == ".csv.gz" else path.open("rb")


def _scan(path: Path, limits: Limits) -> _Scan:
    """Look through the whole text once, without keeping it: size, encoding, NUL, comments, header."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    size = lines = marks = starting = 0
    last, head = b"\n", b""
    with _opened(path) as file:
        while chunk := file.read(CHUNK_BYTES):
            if not size and chunk[:2] in (b"\xff\xfe", b"\xfe\xff"):
                raise InputError(f"{path}: is UTF-16 text; save it as UTF-8")
            where = chunk.find(b"\0")
            if where >= 0:
                line = lines + chunk.count(b"\n", 0, where) + 1
                raise InputError(f"{path}: cannot be read as csv: a NUL byte in line {line}; it is no text, or damaged")
            try:
                decoder.decode(chunk)
            except UnicodeDecodeError as error:
                line = lines + chunk.count(b"\n", 0, max(error.start, 0)) + 1
                raise InputError(f"{path}: {_not_utf8(error.object[error.start], line)}") from error
            size += len(chunk)
            lines += chunk.count(b"\n")
            marks += chunk.count(b"#")
            starting += (last + chunk).count(b"\n#")
            last = chunk[-1:]
            if len(head) < LONGEST_HEADER:
                head += chunk
            if size > limits.size_bytes:
                raise InputError(f"{path}: {_too_large(size, limits)}")
    before, header = _header(path, head.removeprefix(codecs.BOM_UTF8))
    return _Scan(before=before, header=header, comments=marks == starting)


def _not_utf8(byte: int, line: int) -> str:
    return f"cannot be read as csv: byte 0x{byte:02x} in line {line} is not UTF-8; save the file as UTF-8"


def _header(path: Path, head: bytes) -> tuple[int, str]:
    lines = head.decode("utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines):
        if line.strip() and not line.startswith("#"):
            if number == len(lines) - 1 and len(head) >= LONGEST_HEADER:
                raise InputError(f"{path}: its first line has more than {LONGEST_HEADER} characters; it is no table")
            return number, line
    raise InputError(f"{path}: is empty; a header line with column names and rows are needed")


def _names_in(header: str, separator: str) -> list[str]:
    return [name.strip() for name in next(csv.reader([header], delimiter=separator, skipinitialspace=True))]


def _check_header(path: Path, header: str, form: TextForm, limits: Limits) -> None:
    try:
        names = _names_in(header, form.separator)
    except (csv.Error, StopIteration) as error:
        raise InputError(f"{path}: its header line cannot be read: {error}") from error
    for other, word in ((";", "';'"), ("\t", "tabs"), (",", "','")):
        if len(names) == 1 and other in names[0]:
            raise InputError(f"{path}: its columns are separated by {word}; {_advice(other, form)}")
    if len(names) > limits.columns:
        raise InputError(f"{path}: has {len(names)} columns, more than the {limits.columns} that are read; drop some")
    if all(_is_number(name) for name in names):
        raise InputError(f"{path}: its first line holds numbers; a header line with column names is needed")
    repeated = sorted({name for name in names if name and names.count(name) > 1})
    if repeated:
        raise InputError("\n".join(f"{path}: column {name[:80]} is there twice; remove one" for name in repeated[:10]))


def _advice(separator: str, form: TextForm) -> str:
    """What to do with a file of another separator."""
    plain = "write it with ',' and decimal points"
    if not form.by_mapping:
        return plain
    if separator == ",":
        return 'give csv = { separator = "," } in a mapping file'
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


def _text_parts(path: Path, form: TextForm, limits: Limits) -> Iterator[pd.DataFrame]:
    scan = _scan(path, limits)
    _check_header(path, scan.header, form, limits)
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)  # rows with more cells than the header
        reader: Any = pd.read_csv(
            path,
            sep=form.separator,
            decimal=form.decimal,
            na_values=list(form.missing),
            # A '#' within a row is a cell such as '#REF!': it must not hide the rest of its row.
            comment="#" if scan.comments else None,
            skiprows=0 if scan.comments else scan.before,
            skipinitialspace=True,
            index_col=False,
            encoding="utf-8-sig",
            compression="gzip" if kind_of(path) == ".csv.gz" else None,
            chunksize=CHUNK_ROWS,
            low_memory=False,
        )
        with closing(reader):
            try:
                for part in reader:
                    yield part.rename(columns=lambda name: str(name).strip())
            except (pd.errors.ParserError, pd.errors.ParserWarning) as error:
                uneven = _uneven_row(path, form, scan) if _PANDAS_UNEVEN.search(str(error)) else None
                if uneven is None:
                    raise
                raise InputError(f"{path}: cannot be read as csv: {uneven}") from error


def _uneven_row(path: Path, form: TextForm, scan: _Scan) -> str | None:
    """The first row with more fields than the header, which pandas names by halves; None if there is none."""
    with _opened(path) as file, io.TextIOWrapper(file, encoding="utf-8-sig", newline="") as text:
        at = 0

        def lines() -> Iterator[str]:
            nonlocal at
            for at, line in enumerate(text, start=1):
                if at > scan.before and not (scan.comments and line.startswith("#")):
                    yield line

        try:
            rows = csv.reader(lines(), delimiter=form.separator, skipinitialspace=True)
            filled = (fields for fields in rows if len(fields) > 1 or any(field.strip() for field in fields))
            names = len(next(filled))
            for row, fields in enumerate(filled, start=1):
                if len(fields) > names:
                    return (
                        f"row {row} (line {at}) has {len(fields)} fields, but the header names {names} columns; remove "
                        f"what is too much, e.g. a {form.separator!r} at its end or within a number"
                    )
        except (csv.Error, StopIteration):
            return None
    return None


# ---------------------------------------------------------------------- Parquet


def _parquet_parts(path: Path, limits: Limits) -> Iterator[pd.DataFrame]:
    import pyarrow as pa
    from pyarrow import parquet

    with parquet.ParquetFile(path) as plain:
        metadata, schema = plain.metadata, plain.schema_arrow
        if len(schema.names) > limits.columns:
            raise InputError(
                f"{path}: has {len(schema.names)} columns, more than the {limits.columns} that are read; drop some"
            )
        size = sum(metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups))
        if size > limits.size_bytes:
            raise InputError(f"{path}: {_too_large(size, limits)}")
        repeated = sorted({name for name in schema.names if schema.names.count(name) > 1})
        faults = [f"column {name} is there twice; remove one" for name in repeated]
        faults += [
            f"column {field.name} holds {str(field.type)[:60]}; one number, time or text per row is needed: remove it"
            for field in schema
            if not _is_plain(pa.types, field.type)
        ]
        if faults:
            raise InputError("\n".join(f"{path}: {fault}" for fault in faults[:20]))
        texts = [f.name for f in schema if pa.types.is_string(f.type) or pa.types.is_large_string(f.type)]
    # Texts stay encoded, so that one long text that is repeated in every row does not fill the memory.
    row = 0
    with parquet.ParquetFile(path, read_dictionary=texts) as file:
        for batch in file.iter_batches(batch_size=CHUNK_ROWS):
            part = batch.to_pandas(ignore_metadata=True)
            part.index = pd.RangeIndex(row, row + len(part))
            row += len(part)
            yield part
    if row == 0:
        yield schema.empty_table().to_pandas(ignore_metadata=True)


def _is_plain(types: Any, kind: Any) -> bool:
    if types.is_dictionary(kind):
        kind = kind.value_type
    checks = ("boolean", "integer", "floating", "decimal", "timestamp", "date", "string", "large_string", "null")
    return any(getattr(types, f"is_{check}")(kind) for check in checks)
