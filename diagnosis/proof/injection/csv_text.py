"""Text of a CSV file whose cells can be changed one by one; everything else stays as it was written."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from models.base.errors import InputError
from models.base.types import Array
from models.files.table_file import TextForm

EXPONENT_DECIMALS = 6  # of a column that is written with exponents


@dataclass(frozen=True, kw_only=True)
class CsvText:
    """Lines of a CSV file.

    Attributes
    ----------
    head : tuple of str
        Lines up to the first row
    names : tuple of str
        Columns
    lines : tuple of str
        Lines with rows, as they are
    """

    head: tuple[str, ...]
    names: tuple[str, ...]
    lines: tuple[str, ...]
    form: TextForm

    def with_rows(self, rows: NDArray[np.int64]) -> CsvText:
        """Return the text of some rows, counted from 1."""
        return replace(self, lines=tuple(self.lines[row - 1] for row in rows))

    def with_shifts(self, shifts: Mapping[str, Array]) -> CsvText:
        """Return the text with numbers added to cells; the other cells keep their characters.

        Parameters
        ----------
        shifts : mapping of column to Array, shape (rows,)
            In the unit of the file; NaN empties a cell. Empty cells stay empty. Sums get the decimals of their column
        """
        if not shifts:
            return self
        rows = [_cells(line, self.form.separator) for line in self.lines]
        for name, shift in shifts.items():
            at = self.names.index(name)
            texts = [cells[at].strip() if at < len(cells) else "" for cells in rows]
            least, most = _decimals(texts, self.form.decimal)
            for k in np.flatnonzero(shift != 0.0):
                if texts[k]:
                    rows[k][at] = _sum(texts[k], float(shift[k]), least, most, self.form.decimal)
        changed = [
            _line(cells, self.form.separator) + line[len(line.rstrip("\r\n")) :]
            for line, cells in zip(self.lines, rows, strict=True)
        ]
        return replace(self, lines=tuple(changed))

    def decimals(self, name: str) -> int:
        """Return the most decimals in a column."""
        at = self.names.index(name)
        rows = (_cells(line, self.form.separator) for line in self.lines)
        return _decimals([cells[at].strip() for cells in rows if at < len(cells)], self.form.decimal)[1]

    @property
    def compressed(self) -> bytes:
        """The file as gzip; neither name nor time go into the archive, so that the same text gives the same bytes."""
        text, encoding = "".join((*self.head, *self.lines)), self.form.encoding.removesuffix("-sig")
        return gzip.compress(text.encode(encoding), compresslevel=6, mtime=0)


def read_csv_text(path: Path, form: TextForm) -> CsvText:
    """Read a CSV or CSV.gz file as text; blank lines and remarks between the rows are left out.

    Raises
    ------
    InputError
        If it cannot be read, or has a line break within quotes.
    """
    try:
        raw = path.read_bytes()
        text = (gzip.decompress(raw) if path.name.lower().endswith(".gz") else raw).decode(form.encoding)
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a text ({error})") from error
    head: list[str] = []
    rows: list[str] = []
    names: tuple[str, ...] = ()
    for number, line in enumerate(io.StringIO(text, newline=""), start=1):
        if number in form.skip_lines:
            if rows:
                raise InputError(
                    f"{path}: line {number} of skip_lines is among the rows; remove it from file and mapping"
                )
            head.append(line)
        elif not line.strip() or line.startswith("#"):
            if not names:
                head.append(line)
        elif not names:
            head.append(line)
            names = tuple(cell.strip() for cell in _cells(line, form.separator))
        else:
            rows.append(line)
        if line.count('"') % 2:
            raise InputError(f"{path}: a line ends within quotes ({line[:40]!r}); write every row in one line")
    return CsvText(head=tuple(head), names=names, lines=tuple(rows), form=form)


def _cells(line: str, separator: str) -> list[str]:
    line = line.rstrip("\r\n")
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True))


def _line(cells: Sequence[str], separator: str) -> str:
    quoted = [
        '"{}"'.format(cell.replace('"', '""')) if separator in cell or '"' in cell else cell  # as CSV quotes
        for cell in cells
    ]
    return separator.join(quoted)


def _decimals(texts: Sequence[str], sign: str) -> tuple[int, int]:
    """Return the fewest and most decimals of the numbers in a column."""
    counts = [len(text.partition(sign)[2]) for text in texts if text and text.strip("+-0123456789" + sign) == ""]
    has_exponents = any("e" in text.lower() and text.strip("+-0123456789eE" + sign) == "" for text in texts)
    most = max(counts, default=0)
    return min(counts, default=0), max(most, EXPONENT_DECIMALS) if has_exponents else most


def _sum(text: str, shift: float, least: int, most: int, sign: str) -> str:
    """Return the text of a number plus another; a text that is no number stays."""
    if np.isnan(shift):
        return ""
    try:
        value = float(text.replace(sign, ".")) + shift
    except ValueError:
        return text
    written = f"{value:.{most}f}"
    while len(written.partition(".")[2]) > max(least, 1) and written.endswith("0"):
        written = written[:-1]
    zero = written.strip("-0.") == ""
    return (written.lstrip("-") if zero else written).replace(".", sign)
