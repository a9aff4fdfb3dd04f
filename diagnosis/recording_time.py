"""The time column of a recording, and the part of it that ``FILE@start..end`` names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.mapping import ISO, UNITS
from models.errors import InputError
from models.types import Array

STANDARD = "time_s"
ISO_NAMES = ("time", "time_utc", "timestamp", "datetime")
_DATE = r"\d{4}-\d{2}-\d{2}"
_ISO = re.compile(
    rf"{_DATE}(?:[T ]\d{{2}}:\d{{2}}(?::\d{{2}}(?:[.,]\d{{1,9}})?)?)?(?P<zone>Z|[+-]\d{{2}}(?::?\d{{2}})?)?"
)
SHORTEST_STEP = 1e-3  # s; no temperature is recorded faster, so smaller steps are another unit
LONGEST_STEP = 1800.0  # s; a gearbox warms within an hour or two, of which rows so far apart tell nothing
LONGEST_TIME = 1e11  # s since 1970 or since the start: 3000 years


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a file's time, from `start` up to but without `end`; None is the first or the last row.

    Numbers are seconds: of a time column in seconds as it stands there, else since the first row. A date without a time
    of day includes that day.

    Examples
    --------
    >>> part_of("0..36000"), part_of("2017-09-01..").start
    (Part(start=0.0, end=36000.0), datetime.datetime(2017, 9, 1, 0, 0, tzinfo=datetime.timezone.utc))
    """

    start: float | datetime | None
    end: float | datetime | None


def part_of(text: str) -> Part:
    """The part that ``start..end`` names.

    Raises
    ------
    InputError
        If it is not written so, mixes seconds and dates, or ends before it starts.
    """
    first, dots, last = text.partition("..")
    if not dots or not (first.strip() or last.strip()):
        raise InputError(f"{text!r} names no part; write start..end, e.g. 0..36000 or 2017-09-01..2017-10-31")
    start, end = _moment(first.strip(), end=False), _moment(last.strip(), end=True)
    if start is not None and end is not None:
        if isinstance(start, datetime) != isinstance(end, datetime):
            raise InputError(f"{text!r} mixes seconds and dates; use one of them for both ends")
        if not _seconds(start) < _seconds(end):
            raise InputError(f"{text!r} ends before it starts")
    return Part(start=start, end=end)


def split_path(text: str | Path) -> tuple[Path, tuple[Part, ...]]:
    """File and part of ``FILE@start..end``; a file whose own name has an ``@`` stays as it is.

    Raises
    ------
    InputError
        If what follows the ``@`` names no part.
    """
    file, at, part = str(text).rpartition("@")
    if not at or ".." not in part or Path(text).is_file():
        return Path(text), ()
    try:
        return Path(file), (part_of(part),)
    except InputError as error:
        raise InputError(f"{text}: {error}") from error


def _moment(text: str, *, end: bool) -> float | datetime | None:
    if not text:
        return None
    if _ISO.fullmatch(text):
        try:
            moment = datetime.fromisoformat(text)
        except ValueError as error:
            raise InputError(f"{text!r} is no date: {error}") from error
        moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment
        return moment + timedelta(days=1) if end and re.fullmatch(_DATE, text) else moment
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not np.isfinite(number):
        raise InputError(f"{text!r} is neither seconds nor a date as 2017-09-01T08:00:00Z")
    return number


def _seconds(moment: float | datetime) -> float:
    return moment.timestamp() if isinstance(moment, datetime) else moment


@dataclass(frozen=True, kw_only=True)
class Clock:
    """How the time of a file is read.

    Attributes
    ----------
    column : str
    unit : str
        Of numbers; ``iso8601`` for texts and for the time stamps of a Parquet file
    """

    column: str
    unit: str

    @property
    def is_date(self) -> bool:
        """Whether it tells dates."""
        return self.unit == ISO

    def seconds(self, values: pd.Series) -> Array:
        """The time column, shape (rows,), [s]; since 1970 where it tells dates; NaN where a cell is no time."""
        if not self.is_date:
            return _numbers(values) * UNITS["time"][self.unit][0]
        if pd.api.types.is_datetime64_any_dtype(values.dtype):
            stamps = pd.to_datetime(values, utc=True)
        else:
            texts = values.astype(str).str.strip()
            stamps = pd.to_datetime(
                texts.where(texts.map(lambda text: bool(_ISO.fullmatch(text)))),
                format="ISO8601",
                utc=True,
                errors="coerce",
            )
        seconds = (stamps - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)
        return np.asarray(seconds.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


def _numbers(values: pd.Series) -> Array:
    if not (pd.api.types.is_numeric_dtype(values.dtype) or pd.api.types.is_string_dtype(values.dtype)):
        values = values.astype(str)
    return np.asarray(pd.to_numeric(values, errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan))


def clock_of(table: pd.DataFrame) -> Clock:
    """The clock of a file without a mapping: ``time_s``, or a column of ISO 8601 times under a usual name.

    Raises
    ------
    InputError
        If there is no such column, or it is not known what its numbers mean.
    """
    columns = [str(column) for column in table.columns]
    if STANDARD in columns:
        return Clock(column=STANDARD, unit=ISO if _tells_dates(table[STANDARD]) else "s")
    for name in ISO_NAMES:
        if name in columns:
            if _tells_dates(table[name]):
                return Clock(column=name, unit=ISO)
            raise InputError(
                f"column {name} is no ISO 8601 time (as 2017-09-01T08:00:00Z), and the unit of its numbers is not "
                "known; name it time_s if they are seconds, or give [time] column and unit in a mapping file"
            )
    shown = ", ".join(sorted(columns)[:20])
    raise InputError(f"column {STANDARD} is missing; it has: {shown}")


def _tells_dates(values: pd.Series) -> bool:
    if pd.api.types.is_datetime64_any_dtype(values.dtype):
        return True
    if pd.api.types.is_numeric_dtype(values.dtype):
        return False
    first = values.dropna().astype(str).str.strip().head(20)
    return bool(first.map(lambda text: bool(_ISO.fullmatch(text))).any())


def inside(seconds: Array, parts: Sequence[Part], clock: Clock, first: float) -> NDArray[np.bool_]:
    """Which rows lie in one of the parts, shape (rows,); `first` is the time of the file's first row, [s].

    Raises
    ------
    InputError
        If dates are asked of a file that tells seconds.
    """
    chosen = np.zeros(len(seconds), dtype=bool)
    for part in parts:
        within = np.ones(len(seconds), dtype=bool)
        for moment, is_end in ((part.start, False), (part.end, True)):
            if moment is None:
                continue
            if isinstance(moment, datetime) and not clock.is_date:
                raise InputError(f"a part is named by date, but column {clock.column} tells seconds; name seconds")
            at = _seconds(moment) + (first if clock.is_date and not isinstance(moment, datetime) else 0.0)
            with np.errstate(invalid="ignore"):
                within &= (seconds < at) if is_end else (seconds >= at)
        chosen |= within
    return chosen


def time_faults(values: pd.Series, seconds: Array, clock: Clock) -> list[str]:
    """What is wrong with the time of the rows that are used: no times, mixed zones, not increasing, another unit."""
    name, rows = clock.column, np.asarray(values.index) + 1
    wrong = np.flatnonzero(~np.isfinite(seconds))
    if len(wrong):
        cell = values.iloc[int(wrong[0])]
        kind = "a number" if not clock.is_date else "an ISO 8601 time as 2017-09-01T08:00:00Z"
        shown = "empty" if pd.isna(cell) else repr(str(cell)[:40])
        return [
            f"{name} is {shown} at row {rows[wrong[0]]}; {len(wrong)} of {len(rows)} rows hold no time, each needs "
            + kind
        ]
    faults = _zone_faults(values, name, rows) if clock.is_date else []
    steps = np.diff(seconds)
    back, same = np.flatnonzero(steps < 0.0), np.flatnonzero(steps == 0.0)
    if len(back):
        row = int(back[0])
        hint = "; local time that is set back in autumn needs a zone, e.g. +02:00" if clock.is_date else ""
        faults.append(
            f"{name} goes back from {values.iloc[row]} to {values.iloc[row + 1]} at row {rows[row + 1]} "
            f"({len(back)} times in all); it must increase from row to row: sort the rows, or split the file where a "
            f"new run starts{hint}"
        )
    if len(same):
        row = int(same[0])
        faults.append(
            f"{name} is {values.iloc[row]} at row {rows[row]} and again at row {rows[row + 1]} ({len(same)} times in "
            "all); it must increase from row to row: remove the repeated rows"
        )
    if not faults and len(steps):
        faults += _unit_faults(name, seconds, steps, clock)
    return faults


def _unit_faults(name: str, seconds: Array, steps: Array, clock: Clock) -> list[str]:
    step = float(np.median(steps))
    if step > LONGEST_STEP:
        told = f"{name} advances by {step:.4g} s from row to row (median); at most {LONGEST_STEP:g} s tell how it warms"
        return [told if clock.is_date else f"{told}; were milliseconds meant? Give [time] unit in a mapping file"]
    if clock.is_date:
        return []
    if np.abs(seconds).max() > LONGEST_TIME:
        return [
            f"{name} reaches {np.abs(seconds).max():.4g} s; were milliseconds meant? Give [time] unit in a mapping file"
        ]
    if step < SHORTEST_STEP:
        meant = "were hours or days meant? Give [time] unit in a mapping file, or average to seconds"
        return [f"{name} advances by {step:.3g} s from row to row (median); {meant}"]
    return []


def _zone_faults(values: pd.Series, name: str, rows: NDArray[np.int64]) -> list[str]:
    if pd.api.types.is_datetime64_any_dtype(values.dtype):
        return []
    zoned = (
        values.astype(str).str.strip().str.contains(r"(?:Z|[+-]\d{2}(?::?\d{2})?)$", regex=True).to_numpy(dtype=bool)
    )
    dated = values.astype(str).str.strip().str.fullmatch(_DATE).to_numpy(dtype=bool)
    zoned = zoned & ~dated  # the day of a date looks like a zone
    if zoned.all() or not zoned.any():
        return []
    row = int(np.flatnonzero(zoned != zoned[0])[0])
    return [f"{name} has times with and without a time zone (rows {rows[0]} and {rows[row]}); give all of them one"]
