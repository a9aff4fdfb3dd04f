"""What stands in the file of a recording, before it is known what its columns mean."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd

from diagnosis.mapping import ISO, RecordingMapping, as_far_as_present, mapping_beside, read_mapping
from diagnosis.mdf import read_mdf
from diagnosis.recording_time import Clock, Part, clock_of, inside, part_of, split_path, time_faults
from models.cycle import COLUMNS
from models.errors import InputError, did_you_mean
from models.table_file import KINDS, LIMITS, Limits, check_file, kind_of, read_table
from models.types import Array

MDF_KINDS = (".mf4", ".mdf")
RECORDING_KINDS = (*KINDS, *MDF_KINDS)
FEWEST_ROWS = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordingFile:
    """The rows of a file that are used.

    Attributes
    ----------
    path : Path
    stem : str
        Name of the file without its ending
    sha256 : str
    mapping : RecordingMapping
    table : DataFrame
        Its index counts the rows of the file from 0
    clock : Clock or None
        None where the file has none
    first_s : float
        Time of the file's first row, used or not, [s]
    seconds : Array, shape (rows,)
        Time of the rows as the clock tells it, [s]
    start : datetime or None
        Of the first row that is used
    units : mapping of column to str
        Units that the file itself names
    faults : tuple of str
        What is wrong with its time
    """

    path: Path
    stem: str
    sha256: str
    mapping: RecordingMapping
    table: pd.DataFrame
    clock: Clock | None
    first_s: float
    seconds: Array
    start: datetime | None
    units: Mapping[str, str] = field(default_factory=dict)
    faults: tuple[str, ...] = ()


def read_recording_file(
    text: str | Path, *, mapping: Path | None = None, usual: RecordingMapping | None = None, limits: Limits = LIMITS
) -> RecordingFile:
    """Read ``FILE`` or ``FILE@start..end``.

    Parameters
    ----------
    text : str or Path
    mapping : Path or None
        Mapping file; by default the one beside the recording
    usual : RecordingMapping or None
        What holds where there is no mapping file, as far as the file has these columns
    limits : Limits

    Raises
    ------
    InputError
        If the file or its mapping cannot be read, or it has no rows.
    """
    path, named = split_path(text)
    _check_part_syntax(path)
    kind = kind_of(path, RECORDING_KINDS)
    stem = path.name[: -len(kind)]
    if named:  # only the rows of the part are kept, so that the file itself may be larger
        limits = replace(limits, size_bytes=max(limits.size_bytes, 100 * LIMITS.size_bytes))
    check_file(path, limits)
    own = mapping_beside(path, stem) if mapping is None else read_mapping(mapping)
    found = own if own is not None else usual if usual is not None else RecordingMapping()
    parts = named or _parts_of(found, path)
    reader = _Reader(path, found, parts, strict=own is not None)
    units: Mapping[str, str] = {}
    start_of_file = None
    if kind in MDF_KINDS:
        base = next((name for name, column in found.columns.items() if column.quantity == "speed"), COLUMNS["speed"][0])
        mdf = read_mdf(path, base=base, limits=limits)
        table, units = reader.kept(mdf.table), mdf.units
        start_of_file = mdf.start
    else:
        table = read_table(path, form=found.text_form, limits=limits, keep=reader.kept)
    if own is None:
        found = as_far_as_present(found, [str(column) for column in table.columns])
    clock = reader.clock_for(table)
    if len(table) < FEWEST_ROWS:
        raise InputError("\n".join(f"{path}: {fault}" for fault in [*reader.faults, _row_fault(len(table), parts)]))
    seconds, faults, since_1970 = np.arange(len(table), dtype=np.float64), reader.faults, None
    if clock is not None:
        seconds = clock.seconds(table[clock.column])
        faults = time_faults(table[clock.column], seconds, clock)
        if not faults:
            since_1970 = seconds[0] if clock.is_date else None if start_of_file is None else start_of_file + seconds[0]
    return RecordingFile(
        path=path,
        stem=stem,
        sha256=_sha256(path),
        mapping=found,
        table=table,
        clock=clock,
        first_s=reader.first_s,
        seconds=seconds,
        start=None if since_1970 is None else datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=float(since_1970)),
        units=units,
        faults=tuple(faults),
    )


def _check_part_syntax(path: Path) -> None:
    """Refuse what was meant as a part of a recording, but is not written so and would be taken for a name.

    Raises
    ------
    InputError
    """
    file, at, part = str(path).rpartition("@")
    if at and file.lower().endswith(RECORDING_KINDS) and not path.name.lower().endswith(RECORDING_KINDS):
        raise InputError(
            f"{path}: {part!r} after the @ names no part; write FILE@start..end, e.g. {Path(file).name}@0..3600 "
            "(seconds) or @2017-09-01..2017-10-31"
        )


def name_parts(text: str | Path) -> tuple[str, str, str]:
    """Folder, stem, and part as words for the name of a recording.

    Examples
    --------
    >>> name_parts("rig_1/train_1.csv.gz"), name_parts("a.csv@0..3600")
    (('rig_1', 'train_1', ''), ('', 'a', '0_3600'))
    """
    path, parts = split_path(text)
    kind = next(
        (kind for kind in sorted(RECORDING_KINDS, key=len, reverse=True) if path.name.lower().endswith(kind)), ""
    )
    part = str(text).rpartition("@")[2].replace("..", "_") if parts else ""
    return path.parent.name, path.name[: len(path.name) - len(kind)], part.replace(":", "").replace("/", "")


class _Reader:
    """Keeps the rows of the parts while a file is read piece by piece; knows the clock once it saw the first piece."""

    def __init__(self, path: Path, mapping: RecordingMapping, parts: tuple[Part, ...], *, strict: bool) -> None:
        self.path, self.mapping, self.parts, self.strict = path, mapping, parts, strict
        self.clock: Clock | None = None
        self.faults: list[str] = []
        self.first_s = float("nan")

    def clock_for(self, table: pd.DataFrame) -> Clock | None:
        if self.clock is None and not self.faults:
            try:
                self.clock = self._clock(table)
            except InputError as error:
                self.faults.append(str(error))
        return self.clock

    def _clock(self, table: pd.DataFrame) -> Clock:
        time = self.mapping.time
        if time is None or (time.column not in table.columns and not self.strict):
            return clock_of(table)
        if time.column not in table.columns:
            known = did_you_mean(time.column, [str(column) for column in table.columns])
            raise InputError(f"column {time.column} of [time] in its mapping file is missing{known}")
        is_stamp = pd.api.types.is_datetime64_any_dtype(table[time.column].dtype)
        return Clock(column=time.column, unit=ISO if is_stamp else time.unit)

    def kept(self, table: pd.DataFrame) -> pd.DataFrame:
        clock = self.clock_for(table)
        if clock is None:
            return table
        if np.isnan(self.first_s) and len(table):
            self.first_s = float(clock.seconds(table[clock.column].iloc[:1])[0])
        if not self.parts:
            return table
        seconds = clock.seconds(table[clock.column])
        try:
            chosen = inside(seconds, self.parts, clock, self.first_s)
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from error
        return table[chosen | np.isnan(seconds)]  # a cell that is no time is a fault of the file, not to be skipped


def _parts_of(mapping: RecordingMapping, path: Path) -> tuple[Part, ...]:
    try:
        return tuple(part_of(text) for text in mapping.rows or ())
    except InputError as error:
        raise InputError(f"{path}: rows of its mapping file: {error}") from error


def _row_fault(rows: int, parts: tuple[Part, ...]) -> str:
    where = " in the part that is named" if parts else ""
    return f"has {rows or 'no'} rows{where}; a recording has {FEWEST_ROWS} or more"


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
