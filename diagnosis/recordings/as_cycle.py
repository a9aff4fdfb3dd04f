"""A recording as the cycle of a simulation, read by the rules of ``diagnose``."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Set
from pathlib import Path

from diagnosis.recordings.columns import quantities_of
from diagnosis.recordings.header_units import named_with_unit, unit_of_name
from diagnosis.recordings.machine import RecordedMachine
from diagnosis.recordings.mapping import RecordingMapping, mapping_beside, mapping_of_definition
from diagnosis.recordings.names import split_path
from diagnosis.recordings.read import read_recording
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.time_axis import ISO_NAMES, STANDARD, moment_text
from models.base.errors import InputError
from models.base.types import Array
from models.files.cycle import Cycle
from models.files.cycle_file import RecordedStart, read_cycle_and_start
from models.files.paths import KINDS
from models.files.table_file import column_names
from models.quantities.quantities import TOTAL_LOSS, column_of, is_total_loss, node_of_channel

MOST_SHOWN = 3  # pieces of a recording with gaps
GIVEN = "given as one"  # a mapping, or the form of the name
RESULT = "in_domain"  # column that results of a simulation have


def read_cycle_or_recording(
    text: Path, network: RecordedMachine, *, mapping: Path | None = None
) -> tuple[Cycle, RecordedStart, tuple[str, ...]]:
    """Read the inputs of a machine over time from a plain cycle or from a recording.

    Parameters
    ----------
    text : Path
        File (.csv, .csv.gz, .parquet, .mf4), files ``FILE+FILE``, or a part, ``FILE@start..end``
    network : RecordedMachine
        Defines nodes and inputs, and the usual mapping of its recordings
    mapping : Path or None
        Mapping file of a recording; by default the one next to it, else that of the definition

    Returns
    -------
    cycle : Cycle
        The time of a recording counts from its first row, as in a diagnosis
    start : RecordedStart
    notes : tuple of str
        What was cleaned, assumed or not used of a recording

    Raises
    ------
    InputError
        With all problems of the file; or if a recording has gaps, with the pieces between them.
    """
    needed = {STANDARD, *(given.column for given in network.inputs.values() if given.required)}
    names = column_names(text)
    because = GIVEN if mapping is not None else _what_makes_a_recording(text, set(names), needed, network)
    if not because:
        return *read_cycle_and_start(text, network.inputs), tuple(_unused(names, network))
    try:
        recording = read_recording(text, network, mapping=mapping, to_compare=False)
    except InputError as error:
        if because == GIVEN:
            raise
        raise InputError(f"{error}\n{text}: is read as a recording, because it has {because}") from error
    if len(recording.segments) > 1:
        raise InputError(f"{text}: {_gaps(recording)}")
    piece = recording.segments[0]
    cycle = Cycle(recording.time[piece], {name: values[piece] for name, values in recording.inputs.items()})
    nodes = [part.name for part in network.parts]
    first: dict[str, tuple[str, str, Array]] = {}  # the first of several sensors at a node
    for channel in recording.channels:
        if not is_total_loss(channel.name):
            node = node_of_channel(channel.name, nodes)
            first.setdefault(node, (node, channel.column, channel.values[piece]))
    start = RecordedStart.first_of(recording.path, first.values(), recording.rows[piece])
    return cycle, start, (*recording.notes, *_clock_notes(recording))


def _what_makes_a_recording(text: Path, names: Set[str], needed: Set[str], network: RecordedMachine) -> str:
    """Why a file must be read as a recording; empty for a plain cycle.

    So are parts, joined files and formats other than tables; files with a column that a mapping names; and files that
    lack columns of a plain cycle, but have a mapping next to them, dates, or names with other units.
    """
    if not text.name.lower().endswith(KINDS) or len(split_path(text)[0]) > 1:
        return GIVEN
    own = mapping_beside(text)
    if own is not None:
        # The mapping may be there for other files of the folder.
        as_it_reads = column_names(text, own.text_form)
        is_meant = not (_named(own) or needed).isdisjoint(as_it_reads)
        return "a mapping next to it" if is_meant or not names >= needed else ""
    if not names:  # the reader of plain cycles reports why
        return ""
    lacking = [quantity for quantity in quantities_of(network).values() if quantity.column not in names]
    with_unit = [*named_with_unit(list(names), lacking)]
    with_unit += sorted(name for name in names - needed if unit_of_name(name, "time", "time", "s"))
    if with_unit:
        return f"{', '.join(with_unit)}; columns of a plain cycle are {', '.join(sorted(needed))} ..."
    if STANDARD not in names and not names.isdisjoint(ISO_NAMES):
        return "dates"
    meant = names & _named(mapping_of_definition(network.recording))
    return f"{', '.join(sorted(meant))}, which the definition maps" if meant else ""


def _unused(names: Collection[str], network: RecordedMachine) -> Iterator[str]:
    """A note on columns of a plain cycle that nothing reads; a result of a simulation has many."""
    inputs = [given.column for given in network.inputs.values()]
    own = {STANDARD, *inputs, *(column_of(f"T_{part.name}") for part in network.parts), column_of(TOTAL_LOSS)}
    others = [name for name in names if name not in own]
    if others and RESULT not in names:
        yield f"not used: {', '.join(others)}; the model's inputs are {', '.join(inputs)}"


def _named(mapping: RecordingMapping) -> set[str]:
    return {*mapping.columns, *(mapping.time.columns if mapping.time is not None else ())}


def _clock_notes(recording: Recording) -> list[str]:
    clock, first = recording.clock, recording.from_s
    if clock is None or (first == 0.0 and not clock.is_date):
        return []
    unit = "" if clock.is_date else " s"
    return [f"time_s counts from its first row, {clock.column} = {moment_text(first, clock)}{unit}"]


def _gaps(recording: Recording) -> str:
    """Say that a recording with gaps is no cycle, and name the longest pieces as parts."""
    time = recording.time + recording.from_s
    spans = [(float(time[piece][0]), float(time[piece][-1])) for piece in recording.segments]
    longest = sorted(sorted(spans, key=lambda span: span[0] - span[1])[:MOST_SHOWN])
    name, clock = "+".join(path.name for path in recording.files), recording.clock
    parts = [
        f"{name}@{moment_text(first, clock)}..{moment_text(last + 1.0, clock)} ({(last - first) / 3600.0:.3g} h)"
        for first, last in longest
    ]
    which = "" if len(spans) <= MOST_SHOWN else "; the longest are"
    return (
        f"gaps split it into {len(spans)} pieces, and nothing is known of the gearbox between them; simulate one of "
        f"them{which}: {', '.join(parts)}; or raise max_gap_s in a mapping file, to take straight lines across"
    )
