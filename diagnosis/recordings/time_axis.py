"""Time column of a recording."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import floor
from typing import cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.recordings.date_forms import forms_of, time_advice
from diagnosis.recordings.header_units import unit_of_name
from diagnosis.recordings.mapping import CLOCK_TIME, TIME_UNITS, RecordingMapping
from diagnosis.recordings.names import DATE, ISO_TIME, Part, seconds_of
from models.base.errors import InputError, Problems, did_you_mean
from models.base.types import Array
from models.files.numbers import numbers_of
from models.quantities.units import units_in_files

STANDARD = "time_s"
ISO = "iso8601"
ISO_NAMES = ("time", "time_utc", "timestamp", "datetime")
SECONDS = ("s", "sec", "sek", "seconds")  # as rows of units write them
SHORTEST_STEP = 1e-3  # s; no temperature is recorded faster, so smaller steps are another unit
COARSE = 0.2  # of the steps: equal times are no slips any more
LONGEST_STEP = 1800.0  # s; a gearbox warms within an hour or two
LONGEST_TIME = 1e11  # s since 1970 or since the start: 3000 years
FEW = 0.01  # share of rows without time that may be lines outside the table
EXCEL_DAYS = (20000.0, 80000.0)  # numbers of the days from 1954 to 2119 in Excel
LAST_YEAR = 2200  # later is the date of a clock that was not set
LONGEST_DATES = 3e9  # s from the first to the last: a century


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Time column of a file.

    Attributes
    ----------
    unit : str
        Of numbers; ``iso8601`` for texts and for the time stamps of a Parquet file, or the form of other dates
    zone : str or None
        Time zone of dates that state none; None: UTC
    decimal, thousands : str
        Signs in numbers that are texts
    """

    column: str
    unit: str
    zone: str | None = None
    decimal: str = "."
    thousands: str = ""

    @property
    def is_date(self) -> bool:
        """True for dates."""
        return self.unit == ISO or "%" in self.unit

    def lacks_zone(self, values: pd.Series) -> bool:
        """True for dates without a time zone, which are taken as UTC."""
        if self.zone is not None or not self.is_date or values.empty:
            return False
        if pd.api.types.is_datetime64_any_dtype(values.dtype):
            return values.dt.tz is None
        if self.unit != ISO:
            return "%z" not in self.unit
        return bool(_zones(values.iloc[:1])[1][0])

    def seconds(self, values: pd.Series) -> Array:
        """Convert a time column, shape (rows,), to [s], dates since 1970; NaN for a cell that is no time."""
        if self.unit == CLOCK_TIME:
            texts = values.astype(str).str.strip().str.replace(",", ".")
            spans = pd.to_timedelta(texts.where(texts.str.fullmatch(r"\d+:\d{2}:\d{2}(\.\d+)?")), errors="coerce")
            return np.asarray(spans.dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan))
        if not self.is_date:
            return (
                numbers_of(values, decimal=self.decimal, thousands=self.thousands)
                * units_in_files("time", "s")[self.unit][0]
            )
        if pd.api.types.is_datetime64_any_dtype(values.dtype):
            stamps = self._zoned(values)
        elif self.unit != ISO:
            texts, has_zone = values.astype(str).str.strip(), "%z" in self.unit
            stamps = self._zoned(pd.to_datetime(texts, format=self.unit, utc=has_zone, errors="coerce"))
        else:
            aware, naive = _zones(values)
            texts = values.astype(str).str.strip().str.replace(",", ".")
            stamps = pd.to_datetime(texts.where(aware), format="ISO8601", utc=True, errors="coerce")
            if naive.any():
                local = pd.to_datetime(texts.where(naive), format="ISO8601", errors="coerce")
                stamps = stamps.where(aware, self._zoned(local))
        seconds = (stamps - pd.Timestamp(0, tz="UTC").as_unit("s")) / pd.Timedelta(seconds=1)
        return np.asarray(seconds.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)

    def _zoned(self, stamps: pd.Series) -> pd.Series:
        """UTC; NaT where a local time does not exist, or comes twice and the rows do not show which it is."""
        if stamps.dt.tz is not None:
            return cast("pd.Series", stamps.dt.tz_convert("UTC"))
        stamps = stamps.where(stamps.dt.year < LAST_YEAR)
        zone = self.zone or "UTC"
        once = stamps.dt.tz_localize(zone, ambiguous="NaT", nonexistent="NaT")
        summer = stamps.dt.tz_localize(zone, ambiguous=np.ones(len(stamps), dtype=bool), nonexistent="NaT")
        twice = once.isna() & summer.notna()
        if twice.any():
            set_back = (stamps.ffill().diff() < pd.Timedelta(0)) & twice
            before = set_back[::-1].groupby(stamps.dt.date).cumsum()[::-1] - set_back.astype(int) > 0
            resolved = set_back.groupby(stamps.dt.date).transform("any")
            winter = stamps.dt.tz_localize(zone, ambiguous=np.zeros(len(stamps), dtype=bool), nonexistent="NaT")
            once = once.where(~(twice & resolved), summer.where(before, winter))
        return cast("pd.Series", once.dt.tz_convert("UTC"))


def moment_text(seconds: float, clock: Clock | None) -> str:
    """Format a time of a clock as a part names it, in whole seconds, rounded down.

    Examples
    --------
    >>> moment_text(0.5, None), moment_text(1504224000.0, Clock(column="time", unit="iso8601"))
    ('0', '2017-09-01T00:00:00Z')
    """
    whole = floor(seconds)
    if clock is None or not clock.is_date:
        return str(whole)
    return datetime.fromtimestamp(whole, tz=UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def clock_of(table: pd.DataFrame, mapping: RecordingMapping, units: Mapping[str, str]) -> Clock:
    """Find the time column: that of the mapping, else see :func:`_usual_clock`.

    Parameters
    ----------
    units : mapping of column to str
        Units that the file itself names

    Raises
    ------
    InputError
        If there is no such column, or the unit of its numbers is unknown.
    """
    time, csv = mapping.time, mapping.csv
    if time is None:
        return replace(_usual_clock(table, units), decimal=csv.decimal, thousands=csv.thousands)
    if time.name not in table.columns:
        columns = [str(column) for column in table.columns]
        missing = next(name for name in time.columns if name not in columns)
        raise InputError(f"column {missing} of [time] in its mapping file is missing{did_you_mean(missing, columns)}")
    named = units.get(time.name, "s")
    usual = ISO if holds_dates(table[time.name]) else named if named in TIME_UNITS else "s"
    unit = ISO if pd.api.types.is_datetime64_any_dtype(table[time.name].dtype) else time.unit or usual
    if time.zone is not None and unit in TIME_UNITS and unit != ISO:
        raise InputError(
            f"column {time.name} counts {unit}, which have no time zone: give the form of its dates as unit, or "
            "leave zone out of its mapping file"
        )
    return Clock(column=time.name, unit=unit, zone=time.zone, decimal=csv.decimal, thousands=csv.thousands)


def _usual_clock(table: pd.DataFrame, units: Mapping[str, str]) -> Clock:
    """Find the time column without a mapping.

    It is ``time_s``, else ISO 8601 times under a usual name, times with their unit, or the only column of ISO 8601
    times.
    """
    columns = [str(column) for column in table.columns]
    if STANDARD in columns:
        if holds_dates(table[STANDARD]):
            return Clock(column=STANDARD, unit=ISO)
        if units.get(STANDARD, "s").lower() not in SECONDS:
            raise InputError(
                f"column {STANDARD} has the unit {units[STANDARD]!r} in the file; give time = {{ column = "
                f'"{STANDARD}", unit = ... }} in a mapping file'
            )
        return Clock(column=STANDARD, unit="s")
    known = units_in_files("time", "s")
    with_unit = {name: unit_of_name(name, "time", "time", "s") or units.get(name, "") for name in columns}
    for name in columns:
        if name.lower() in ISO_NAMES and (table.empty or holds_dates(table[name])):  # without rows that is the fault
            return Clock(column=name, unit=ISO)
        is_time = name.lower() in ISO_NAMES or unit_of_name(name, "time", "time", "s") is not None
        if is_time and with_unit[name] in known:
            return Clock(column=name, unit=with_unit[name])
    dated = [name for name in columns if holds_dates(table[name]) and _may_be_time(table[name])]
    if len(dated) == 1:
        return Clock(column=dated[0], unit=ISO)
    advice = time_advice(table)
    for name in columns:
        if name.lower() in ISO_NAMES:
            is_text = not pd.api.types.is_numeric_dtype(table[name].dtype)
            numbers = (
                ", and the unit of its numbers is not known; name it time_s if they are seconds, or give [time] column "
                "and unit in a mapping file"
            )
            todo = f"; {advice}" if advice and is_text else numbers
            raise InputError(f"column {name} is no ISO 8601 time (as 2017-09-01T08:00:00Z){todo}")
    shown = ", ".join(name[:40] for name in sorted(columns)[:20])
    raise InputError(f"column {STANDARD} is missing; it has: {shown}{'; ' if advice else ''}{advice}")


def holds_dates(values: pd.Series) -> bool:
    """Return True for time stamps and for texts of which one of the first is an ISO 8601 time."""
    if pd.api.types.is_datetime64_any_dtype(values.dtype):
        return True
    if pd.api.types.is_numeric_dtype(values.dtype):
        return False
    first = values.dropna().head(20).astype(str).str.strip()
    return bool(first.map(lambda text: bool(ISO_TIME.fullmatch(text))).any())


def _may_be_time(dates: pd.Series) -> bool:
    """Return False for one date in all rows, and for days, whose time is in another column."""
    first, last = str(dates.iloc[0]).strip(), str(dates.iloc[-1]).strip()
    return first != last and not re.fullmatch(DATE, first)


def inside(seconds: Array, parts: Sequence[Part], clock: Clock, first: float) -> NDArray[np.bool_]:
    """Return True for rows in one of the parts, shape (rows,); `first` is the time of the first row of all, [s].

    Raises
    ------
    InputError
        If a part is named by date, but the file has seconds.
    """
    chosen = np.zeros(len(seconds), dtype=bool)
    for part in parts:
        within = np.ones(len(seconds), dtype=bool)
        for moment, is_end in ((part.start, False), (part.end, True)):
            if moment is None:
                continue
            if isinstance(moment, datetime) and not clock.is_date:
                raise InputError(f"a part is named by date, but column {clock.column} holds seconds; name seconds")
            at = seconds_of(moment, clock.zone) + (first if clock.is_date and not isinstance(moment, datetime) else 0.0)
            with np.errstate(invalid="ignore"):
                within &= (seconds < at) if is_end else (seconds >= at)
        chosen |= within
    return chosen


def check_time(values: pd.Series, seconds: Array, clock: Clock, problems: Problems) -> None:
    """Report rows without time, mixed zones, time that does not increase, and steps that are another unit.

    Parameters
    ----------
    values : Series
        Cells of the time column; the index counts the rows of the file from 0
    seconds : Array, shape (rows,)
        The same in [s]
    """
    name, rows = clock.column, np.asarray(values.index) + 1
    wrong = np.flatnonzero(~np.isfinite(seconds))
    if len(wrong):
        cell = values.iloc[int(wrong[0])]
        shown = "empty" if pd.isna(cell) else repr(str(cell)[:40])
        needed = f"{len(wrong)} of {len(rows)} rows hold no time, each needs {_needed(clock)}"
        needed += _advice_on_time(values.iloc[wrong], len(wrong) / len(rows), clock)
        problems.add(f"{name} is {shown} at row {rows[wrong[0]]}; {_local_time(values.iloc[wrong], clock) or needed}")
        return
    if clock.unit == ISO:
        _check_zones(values, name, rows, problems)
    steps = np.diff(seconds)
    back, same = np.flatnonzero(steps < 0.0), np.flatnonzero(steps == 0.0)
    hint = "; local time that is set back in autumn needs its zone in a mapping (time.zone)" if clock.is_date else ""
    if clock.unit == CLOCK_TIME:
        hint = (
            "; at midnight a time of day begins again: split the file there, or name the column with the date as well"
        )
    if len(back):
        row = int(back[0])
        problems.add(
            f"{name} goes back from {values.iloc[row]} to {values.iloc[row + 1]} at row {rows[row + 1]} "
            f"({len(back)} times in all); it must increase from row to row: sort the rows, or split the file where a "
            f"new run starts{hint}"
        )
    if len(same):
        row = int(same[0])
        problems.add(
            f"{name} is {values.iloc[row]} at row {rows[row]} and again at row {rows[row + 1]} ({len(same)} times in "
            f"all); it must increase from row to row: {_repeated(len(same), len(steps), hint)}"
        )
    if not len(back) and not len(same) and len(steps):
        _check_time_unit(name, seconds, float(np.median(steps)), clock, problems)


def _needed(clock: Clock) -> str:
    if clock.unit == CLOCK_TIME:
        return f"a time as {CLOCK_TIME}"
    of_date = "an ISO 8601 time as 2017-09-01T08:00:00Z" if clock.unit == ISO else f"a date as {clock.unit}"
    return of_date if clock.is_date else "a number"


def _advice_on_time(cells: pd.Series, share: float, clock: Clock) -> str:
    """Return what to do about cells that are no time of a clock; empty if nothing is known of them."""
    texts = cells.dropna().astype(str).str.strip()
    forms = forms_of(texts)
    if forms:
        return "; in a mapping file its form is time.unit = " + " or ".join(f'"{form}"' for form in forms)
    if clock.decimal == "." and len(texts) and texts.str.fullmatch(r"\d+,(\d{1,2}|\d{4,})").all():
        return '; decimal commas are stated as csv = { decimal = "," } in a mapping file'
    if share < FEW and len(texts) and not texts.str.contains(r"\d").any():
        return "; remove lines that are no part of the table, or begin them with '#'"
    return ""


def _local_time(cells: pd.Series, clock: Clock) -> str:
    """Return what to do about a local time that its zone does not have once; empty for other cells."""
    if clock.zone is None or not np.isfinite(replace(clock, zone=None).seconds(cells)[0]):
        return ""
    return (
        f"that time does not exist in {clock.zone}, where clocks are set forward, or comes twice, and no row shows "
        "when they are set back; if the clock of the logger is never set, give zone as its distance to UTC "
        '("Etc/GMT-1" is UTC+1)'
    )


def _repeated(times: int, of: int, hint: str) -> str:
    """Return what to do about equal times."""
    if times > COARSE * of:
        return (
            "the times are coarser than the rows lie apart: write them with more digits; or if every row holds another "
            "channel, write a column for each"
        )
    return f"remove the repeated rows{hint}"


def _check_time_unit(name: str, seconds: Array, step: float, clock: Clock, problems: Problems) -> None:
    latest = float(np.abs(seconds).max())
    fix = "Give [time] unit in a mapping file"
    if step > LONGEST_STEP:
        hint = "" if clock.is_date else f"; were milliseconds meant? {fix}"
        problems.add(
            f"{name} advances by {step:.4g} s from row to row (median), at most {LONGEST_STEP:g} s is useful{hint}"
        )
    elif clock.is_date:
        if seconds[-1] - seconds[0] > LONGEST_DATES:
            years = (seconds[-1] - seconds[0]) / 31557600.0
            problems.add(f"{name} goes on over {years:.0f} years; leave out the rows whose clock was not set")
    elif latest > LONGEST_TIME:
        problems.add(f"{name} reaches {latest:.4g} s; were milliseconds meant? {fix}")
    elif step < SHORTEST_STEP:
        is_excel = EXCEL_DAYS[0] < seconds[0] <= seconds[-1] < EXCEL_DAYS[1]
        meant = 'were dates of Excel meant (unit = "d")?' if is_excel else "were hours or days meant?"
        problems.add(f"{name} advances by {step:.3g} s from row to row (median); {meant} {fix}, or average to seconds")


def _zones(values: pd.Series) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Cells that are a date with a time zone, and those that are one without, shape (rows,) each."""
    found = [ISO_TIME.fullmatch(text.strip()) for text in values.astype(str).tolist()]  # quicker than a Series
    aware = np.array([match is not None and match["zone"] is not None for match in found], dtype=bool)
    return aware, np.array([match is not None for match in found], dtype=bool) & ~aware


def _check_zones(values: pd.Series, name: str, rows: NDArray[np.int64], problems: Problems) -> None:
    if pd.api.types.is_datetime64_any_dtype(values.dtype):
        return
    zoned, without = _zones(values)
    if zoned.any() and without.any():
        row = int(np.flatnonzero(zoned != zoned[0])[0])
        problems.add(
            f"{name} has times with and without a time zone (rows {rows[0]} and {rows[row]}); give all of them one"
        )
