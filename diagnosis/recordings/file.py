"""Files of recordings, opened: mapping, time column, and rows in chunks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial, reduce
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.recordings.header_units import units_in_brackets
from diagnosis.recordings.mapping import (
    Column,
    RecordingMapping,
    Time,
    mapping_beside,
    read_mapping,
    reduced_to,
)
from diagnosis.recordings.mdf import read_mdf
from diagnosis.recordings.names import RECORDING_KINDS, Part, part_of
from diagnosis.recordings.time_axis import Clock, clock_of, inside
from models.base.errors import InputError, Problems
from models.base.types import Array
from models.files.paths import check_file, kind_of
from models.files.table_file import column_units, read_chunks, together, without


@dataclass(kw_only=True, eq=False)
class RecordingFile:
    """An opened file: its mapping, its time column, and its rows in chunks.

    Attributes
    ----------
    chunks : iterator of DataFrame
    clock : Clock or None
        None, and a problem, if there is none
    first_s, last_s, shift_s : float
        Time of its first row, and the latest among those read; seconds to add to its time column
    start : float or None
        Start of an MDF file since 1970, [s]
    units : mapping of column to str
        Units that the file itself names: as in MDF, in brackets in the header of a text, or in a row below it
    problems : Problems
    notes : list of str
        What was assumed or not used
    """

    path: Path
    mapping: RecordingMapping
    chunks: Iterator[pd.DataFrame]
    clock: Clock | None
    first_s: float
    last_s: float = -np.inf
    shift_s: float = 0.0
    start: float | None
    units: Mapping[str, str]
    problems: Problems
    notes: list[str] = field(default_factory=list)

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts that the mapping names."""
        try:
            return tuple(part_of(text) for text in self.mapping.rows or ())
        except InputError as error:
            raise InputError(f"{self.path}: rows of its mapping file: {error}") from error

    def seconds(self, table: pd.DataFrame) -> Array:
        """Return the time of a table, shape (rows,), [s]."""
        if self.clock is None:
            return np.arange(len(table), dtype=np.float64)
        return self.clock.seconds(table[self.clock.column]) + self.shift_s

    def table(self, parts: Sequence[Part], first_s: float) -> pd.DataFrame:
        """Read the rows of the parts, of all if there are none; seconds of dates count from `first_s`."""

        def chosen(chunk: pd.DataFrame) -> pd.DataFrame:
            if self.clock is None or not parts:
                return chunk
            seconds = self.seconds(chunk)
            self.last_s = float(np.nanmax(seconds, initial=self.last_s))
            try:
                # A cell that is no time is a problem of the part that it lies in, not a row to skip.
                around = pd.Series(seconds).ffill(), pd.Series(seconds).bfill()
                earlier, later = (
                    inside(np.asarray(side, dtype=np.float64), parts, self.clock, first_s) for side in around
                )
                return chunk[earlier | later if np.isnan(seconds).any() else earlier]
            except InputError as error:
                raise InputError(f"{self.path}: {error}") from error

        return together(self.path, map(chosen, self.chunks))

    def in_rows_of(self, name: str, column: Column, seconds: Array, first_s: float) -> NDArray[np.bool_]:
        """Return True for the rows that the mapping names for a column, shape (rows,)."""
        if column.rows is not None and self.clock is not None:
            try:
                return inside(seconds, [part_of(text) for text in column.rows], self.clock, first_s)
            except InputError as error:
                self.problems.add(f"rows of column {name} in its mapping file: {error}")
        return np.ones(len(seconds), dtype=bool)


def open_recording(path: Path, mapping: Path | None, usual: RecordingMapping) -> RecordingFile:
    """Open a file and read its first rows.

    Parameters
    ----------
    mapping : Path or None
        Mapping file; by default the one next to the file
    usual : RecordingMapping
        Mapping without a file, reduced to the columns that are there

    Raises
    ------
    InputError
        If the file or its mapping cannot be read.
    """
    kind = kind_of(path, RECORDING_KINDS)
    check_file(path)
    own = mapping_beside(path) if mapping is None else read_mapping(mapping)
    found = usual if own is None else own
    problems = Problems(path)
    start: float | None = None
    units: Mapping[str, str] = {}
    if kind in (".mf4", ".mdf"):
        speed = [name for name, column in found.columns.items() if column.quantity == "speed"]
        table, units, start = read_mdf(path, bases=list(dict.fromkeys([*speed, "speed_rpm", *found.columns])))
        chunks = iter([without(found.missing, table)])
    else:
        units = {} if kind == ".parquet" else column_units(path, found.text_form)
        chunks = read_chunks(path, found.text_form)
    head = next(chunks)
    units = units_in_brackets(map(str, head.columns)) | units
    found = reduced_to(found, map(str, head.columns), of_definition=own is None)
    clock = None
    if found.time is not None:
        chunks, head = map(partial(_with_one_time, time=found.time), chunks), _with_one_time(head, found.time)
    try:
        clock = clock_of(head, found, units)
    except InputError as error:
        problems.add(str(error))
    file = RecordingFile(
        path=path, mapping=found, chunks=chain([head], chunks), clock=clock, first_s=np.nan,
        start=start, units=units, problems=problems,
    )  # fmt: skip
    file.first_s = float(file.seconds(head[:1])[0]) if len(head) else np.nan
    return file


def _with_one_time(table: pd.DataFrame, time: Time) -> pd.DataFrame:
    """Join columns with date and time of day into one, in the place of the first."""
    if len(time.columns) < 2 or not set(time.columns) <= {*table.columns}:
        return table
    texts = [table[name].astype(str).str.strip() for name in time.columns]
    joined = reduce(lambda first, then: first + " " + then, texts).where(table[list(time.columns)].notna().all(axis=1))
    return table.drop(columns=list(time.columns)).assign(**{time.name: joined})


def set_to_one_clock(files: Sequence[RecordingFile]) -> None:
    """Let the times of several MDF files count from the start of the first; refuse dates joined with seconds."""
    first = files[0]
    for file in files[1:]:
        if file.clock is None or first.clock is None:
            continue
        if file.clock.is_date != first.clock.is_date or (file.start is None) != (first.start is None):
            raise InputError(
                f"{file.path}: its time ({file.clock.column}) and that of {first.path} ({first.clock.column}) are not "
                "of one kind (seconds, dates, MDF), so that the files cannot be joined"
            )
        if file.start is not None and first.start is not None and not file.clock.is_date:
            file.shift_s = file.start - first.start
            file.first_s += file.shift_s


def sha256_of(files: Sequence[Path]) -> str:
    """Return the SHA-256 of a file, of the hashes of several."""
    hashes = []
    for path in files:
        with path.open("rb") as file:
            hashes.append(hashlib.file_digest(file, "sha256").hexdigest())
    return hashes[0] if len(hashes) == 1 else hashlib.sha256("".join(hashes).encode()).hexdigest()
