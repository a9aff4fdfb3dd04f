"""A recording as the cycle of a simulation, read by the rules by which ``diagnose`` reads it."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from builder.files import RecordedStart, read_cycle_and_start
from diagnosis.mapping import LOSS, RecordingMapping, mapping_beside, mapping_of_definition
from diagnosis.recording_columns import RecordedColumns, read_columns
from diagnosis.recording_file import RecordingFile, name_parts, read_recording_file
from diagnosis.recording_time import ISO_NAMES, STANDARD, Clock, split_path
from models.cycle import COLUMNS, REQUIRED, Cycle
from models.errors import InputError
from models.network import ThermalNetwork
from models.table_file import KINDS, column_names

NEEDED = (STANDARD, *(COLUMNS[signal][0] for signal in REQUIRED))  # columns of a plain cycle
MOST_SHOWN = 3  # pieces of a recording with gaps


def file_of(text: Path) -> Path:
    """The file of ``FILE@start..end``.

    Raises
    ------
    InputError
        If what follows the ``@`` names no part.
    """
    return split_path(text)[0]


def read_cycle_or_recording(
    text: Path, network: ThermalNetwork, *, mapping: Path | None = None
) -> tuple[Cycle, RecordedStart, tuple[str, ...]]:
    """The inputs of a network over time, from a plain cycle or from a recording.

    Parameters
    ----------
    text : Path
        File (.csv, .csv.gz, .parquet, .mf4), or a part of one, ``FILE@start..end``
    network : ThermalNetwork
        Tells which nodes and inputs there are, and what its definition says of recordings
    mapping : Path or None
        Mapping file of a recording; by default the one beside it, else what the definition says

    Returns
    -------
    cycle : Cycle
        Of a recording its time counts from the first row that is used, as in a diagnosis
    start : RecordedStart
    notes : tuple of str
        What was cleaned, assumed or not used of a recording

    Raises
    ------
    InputError
        With all faults of the file; or if a recording has gaps, with the pieces between them.
    """
    usual = mapping_of_definition(network.recording)
    if mapping is None and not _is_recording(text, usual):
        return *read_cycle_and_start(text, tuple(name for name in network.inputs if name not in COLUMNS)), ()
    file = read_recording_file(text, mapping=mapping, usual=usual)
    columns = read_columns(file, network, to_compare=False)
    if len(columns.segments) > 1:
        raise InputError(f"{text}: {_gaps(file, columns)}")
    piece = columns.segments[0]
    seconds = columns.seconds - columns.seconds[0]
    cycle = Cycle(seconds[piece], {name: values[piece] for name, values in columns.inputs.items()})
    return cycle, _start(file.path, columns), (*columns.notes, *_clock_notes(file, columns))


def _is_recording(text: Path, usual: RecordingMapping) -> bool:
    """Whether only the reader of recordings takes a file as it is meant.

    So it is with a part, or another format than tables; where a mapping names a column of the file; and where the file
    lacks columns of a plain cycle, but has a mapping beside it or tells dates.
    """
    if not text.name.lower().endswith(KINDS):
        return True
    names = set(column_names(text))
    if not names:  # the table itself is at fault, as the reader of plain cycles tells
        return False
    beside = mapping_beside(text, name_parts(text)[1])
    if beside is not None:
        return not names.issuperset(NEEDED) or _is_meant_for(beside, text)
    tells_dates = STANDARD not in names and not names.isdisjoint(ISO_NAMES)
    return tells_dates or not names.isdisjoint(_named(usual))


def _is_meant_for(mapping: RecordingMapping, path: Path) -> bool:
    """Whether a mapping beside a plain cycle is about it; other files of the folder may be what it is there for."""
    as_it_splits = column_names(path, mapping.csv.separator)
    return not (_named(mapping) or set(NEEDED)).isdisjoint(as_it_splits)


def _named(mapping: RecordingMapping) -> set[str]:
    return {*mapping.columns, *([mapping.time.column] if mapping.time is not None else [])}


def _start(path: Path, columns: RecordedColumns) -> RecordedStart:
    piece = columns.segments[0]
    temperatures, rows, names = {}, {}, {}
    for quantity, values in columns.measured.items():
        known = np.flatnonzero(np.isfinite(values[piece]))
        if quantity != LOSS and len(known):
            node = quantity.removeprefix("T_")
            temperatures[node] = float(values[piece][known[0]])
            rows[node] = int(columns.rows[piece][known[0]])
            names[node] = columns.names[quantity]
    return RecordedStart(path, temperatures, rows, names)


def _clock_notes(file: RecordingFile, columns: RecordedColumns) -> list[str]:
    clock, first = file.clock, float(columns.seconds[0])
    if clock is None or (first == 0.0 and not clock.is_date):
        return []
    unit = "" if clock.is_date else " s"
    return [f"time_s counts from its first row, {clock.column} = {_moment(first, clock)}{unit}"]


def _gaps(file: RecordingFile, columns: RecordedColumns) -> str:
    """That a recording with gaps is no cycle, and the longest pieces as parts that can be named."""
    spans = [(float(columns.seconds[piece][0]), float(columns.seconds[piece][-1])) for piece in columns.segments]
    longest = sorted(sorted(spans, key=lambda span: span[0] - span[1])[:MOST_SHOWN])
    parts = [
        f"{file.path.name}@{_moment(first, file.clock)}..{_moment(math.floor(last) + 1.0, file.clock)} "
        f"({(last - first) / 3600.0:.3g} h)"
        for first, last in longest
    ]
    which = "" if len(spans) <= MOST_SHOWN else "; the longest are"
    return (
        f"gaps split it into {len(spans)} pieces, and nothing is known of the gearbox between them; simulate one of "
        f"them{which}: {', '.join(parts)}; or raise max_gap_s in a mapping file, to take straight lines across"
    )


def _moment(seconds: float, clock: Clock | None) -> str:
    """Whole seconds, rounded down, as a part names them."""
    whole = math.floor(seconds)
    if clock is None or not clock.is_date:
        return str(whole)
    return datetime.fromtimestamp(whole, tz=UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
