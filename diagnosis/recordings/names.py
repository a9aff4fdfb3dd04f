"""Names of recordings as people give them, ``FILE+FILE@start..end``, and short names made of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np

from models.base.errors import InputError
from models.files.paths import KINDS, is_file

RECORDING_KINDS = (*KINDS, ".mf4", ".mdf")
DATE = r"\d{4}-\d{2}-\d{2}"
ISO_TIME = re.compile(
    rf"{DATE}(?:[T ]\d{{2}}:\d{{2}}(?::\d{{2}}(?:[.,]\d{{1,9}})?)?)?(?P<zone>Z|[+-]\d{{2}}(?::?\d{{2}})?)?"
)


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a file's time, from `start` up to but without `end`; None is the first or the last row.

    Numbers are seconds: of a time column in seconds as it stands there, else since the first row. A date without a time
    of day includes that day. Dates without a zone are those of the clock of the file, UTC unless it states another one.

    Examples
    --------
    >>> part_of("0..36000"), part_of("2017-09-01..").start
    (Part(start=0.0, end=36000.0), datetime.datetime(2017, 9, 1, 0, 0))
    """

    start: float | datetime | None
    end: float | datetime | None


def part_of(text: str) -> Part:
    """Read ``start..end``.

    Raises
    ------
    InputError
        If it is written otherwise, mixes seconds and dates, or ends before it starts.
    """
    first, dots, last = text.partition("..")
    if not dots or not (first.strip() or last.strip()):
        raise InputError(f"{text!r} names no part; write start..end, e.g. 0..3600 (seconds) or 2017-09-01..2017-10-31")
    start, end = _moment(first.strip(), end=False), _moment(last.strip(), end=True)
    if start is not None and end is not None:
        if isinstance(start, datetime) != isinstance(end, datetime):
            raise InputError(f"{text!r} mixes seconds and dates; use one of them for both ends")
        if not seconds_of(start) < seconds_of(end):
            raise InputError(f"{text!r} ends before it starts")
    return Part(start=start, end=end)


def split_path(text: str | Path) -> tuple[tuple[Path, ...], tuple[Part, ...]]:
    """Split ``FILE+FILE@start..end`` into its files and the part; a file whose own name has a + or @ stays as it is.

    Raises
    ------
    InputError
        If the text after the ``@`` is not a part.

    Examples
    --------
    >>> [path.name for path in split_path("day_1.csv+day_2.csv@0..3600")[0]]
    ['day_1.csv', 'day_2.csv']
    """
    if is_file(Path(text)):
        return (Path(text),), ()
    files, at, part = str(text).rpartition("@")
    if not at or not files.lower().endswith(RECORDING_KINDS) or part.lower().endswith(RECORDING_KINDS):
        return _split_files(str(text)), ()
    try:
        return _split_files(files), (part_of(part),)
    except InputError as error:
        raise InputError(f"{text}: {error}") from error


def _split_files(text: str) -> tuple[Path, ...]:
    files: list[str] = []
    begun = ""
    for piece in text.split("+"):
        begun = f"{begun}+{piece}" if begun else piece
        if begun.lower().endswith(RECORDING_KINDS):
            files.append(begun)
            begun = ""
    return tuple(map(Path, [*files, begun] if begun or not files else files))


def _moment(text: str, *, end: bool) -> float | datetime | None:
    if not text:
        return None
    if ISO_TIME.fullmatch(text):
        try:
            moment = datetime.fromisoformat(text)
        except ValueError as error:
            raise InputError(f"{text!r} is no date: {error}") from error
        return moment + timedelta(days=1) if end and re.fullmatch(DATE, text) else moment
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not np.isfinite(number):
        raise InputError(f"{text!r} is neither seconds nor a date as 2017-09-01T08:00:00Z")
    return number


def seconds_of(moment: float | datetime, zone: str | None = None) -> float:
    """Seconds, of a date since 1970; `zone` is that of a date that states none, UTC for None."""
    if not isinstance(moment, datetime):
        return moment
    return (moment if moment.tzinfo else moment.replace(tzinfo=ZoneInfo(zone or "UTC"))).timestamp()


def stem_of(path: Path) -> str:
    """Return the name of a file without its ending."""
    kinds = sorted(RECORDING_KINDS, key=len, reverse=True)
    kind = next((kind for kind in kinds if path.name.lower().endswith(kind)), "")
    return path.name[: len(path.name) - len(kind)]


def name_parts(text: str | Path) -> tuple[str, str, str]:
    """Return folder, stem, and part as words for the name of a recording.

    Examples
    --------
    >>> name_parts("rig_1/train_1.csv.gz"), name_parts("a.csv+b.csv@0..3600")
    (('rig_1', 'train_1', ''), ('', 'a', '0_3600'))
    """
    paths, parts = split_path(text)
    part = str(text).rpartition("@")[2].replace("..", "_") if parts else ""
    return paths[0].parent.name, stem_of(paths[0]), part.replace(":", "").replace("/", "")


def names_of(paths: Sequence[str | Path]) -> list[str]:
    """Return short names of recordings, made different by their folder, their part, or a number if need be."""
    split = [name_parts(path) for path in paths]
    for form in ("{stem}", "{folder}_{stem}", "{stem}_{part}", "{folder}_{stem}_{part}"):
        names = [form.format(stem=stem, folder=folder, part=part).strip("_") for folder, stem, part in split]
        if len(set(names)) == len(names):
            return names
    return [f"{stem}_{number}" for number, (_, stem, _) in enumerate(split, start=1)]
