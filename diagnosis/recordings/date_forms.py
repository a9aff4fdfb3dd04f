"""Advice on time columns: the form in which dates are written, as a mapping file states it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from itertools import product

import pandas as pd

from diagnosis.recordings.mapping import CLOCK_TIME

DATES = (
    "%d.%m.%Y", "%d.%m.%y", "%m/%d/%Y", "%d/%m/%Y", "%m/%d/%y", "%d/%m/%y", "%Y/%m/%d", "%d-%m-%Y", "%m-%d-%Y",
    "%d-%b-%Y", "%d-%b-%y", "%d %b %Y",
)  # fmt: skip
DAYS = (*DATES, "%Y-%m-%d", "%Y%m%d")
TIMES = ("%H:%M:%S", "%H:%M", "%H:%M:%S.%f", "%H:%M:%S,%f", "%I:%M:%S %p", "%I:%M %p")
COMPACT = ("%Y%m%d%H%M%S", "%Y%m%dT%H%M%S", "%Y%m%d %H%M%S", "%Y%m%d_%H%M%S")
FORMS = (*(f"{date} {time}" for date, time in product(DATES, TIMES)), *COMPACT)
_ISO_FORMS = tuple(f"%Y-%m-%d{sign}{time}" for sign, time in product(" T", TIMES[:4]))
CELLS = 50  # that are tried, over all rows
TIME_WORDS = re.compile(r"time|zeit|date|datum|stamp|clock|elapsed|second|sekunde|^x.?val", re.IGNORECASE)
_CLOCK = re.compile(r"\d{1,4}:\d{2}:\d{2}(?:[.,]\d+)?")


def forms_of(cells: pd.Series, forms: Sequence[str] = FORMS) -> list[str]:
    """Return the units or forms of a time that fit some cells from all over a column; none for numbers.

    Examples
    --------
    >>> forms_of(pd.Series(["31.12.2024 13:05:00"])), forms_of(pd.Series(["1/2/2024 1:05 PM"]))
    (['%d.%m.%Y %H:%M:%S'], ['%m/%d/%Y %I:%M %p', '%d/%m/%Y %I:%M %p'])
    >>> forms_of(pd.Series(["13:05:00"])), forms_of(pd.Series([1.5]))
    (['hh:mm:ss'], [])
    """
    texts = [cell.strip() for cell in cells.iloc[:: max(len(cells) // CELLS, 1)] if isinstance(cell, str)]
    if not texts:
        return []
    if all(_CLOCK.fullmatch(text) for text in texts):
        return [CLOCK_TIME]
    if any(all(_fits(text, form) for text in texts) for form in _ISO_FORMS):
        return ["iso8601"]
    return [form for form in forms if all(_fits(text, form) for text in texts)]


def _fits(text: str, form: str) -> bool:
    try:
        return bool(datetime.strptime(text, form))  # noqa: DTZ007  only tried
    except ValueError:
        return False


def form_advice(columns: Sequence[str], cells: pd.Series) -> str:
    """Return what to give for a time column, or for two with date and time of day; empty if its form is not known.

    Examples
    --------
    >>> form_advice(["Zeit"], pd.Series(["31.12.2024 13:05"]))
    'give time = { column = "Zeit", unit = "%d.%m.%Y %H:%M" } in a mapping file'
    """
    forms = forms_of(cells)
    if not forms:
        return ""
    shown = f'"{columns[0]}"' if len(columns) == 1 else "[" + ", ".join(f'"{name}"' for name in columns) + "]"
    units = " or ".join(f'"{form}"' for form in forms)
    return f"give time = {{ column = {shown}, unit = {units} }} in a mapping file"


def time_advice(table: pd.DataFrame) -> str:
    """Return which column of a table may be the time, and how to state it; empty if none looks like one."""
    texts = {str(name): table[name] for name in table.columns if not pd.api.types.is_numeric_dtype(table[name].dtype)}
    for name, cells in texts.items():
        days = next((day for day, other in texts.items() if day != name and forms_of(other, DAYS)), None)
        if forms_of(cells) == [CLOCK_TIME] and days is not None:
            return form_advice([days, name], texts[days].str.cat(cells, sep=" "))
        if advice := form_advice([name], cells):
            return advice
    named = [str(name) for name in table.columns if TIME_WORDS.search(str(name))]
    if not named or len(table.columns) == 1:
        return ""
    return f'if {named[0][:40]} is the time, give time = {{ column = "{named[0][:40]}", unit = ... }} in a mapping file'
