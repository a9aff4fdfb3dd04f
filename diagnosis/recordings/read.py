"""Reading of recordings: from files to :class:`diagnosis.recordings.recording.Recording`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from diagnosis.recordings.cleaning import (
    bridged,
    resolution_of,
    rows_text,
    spikes_of_loss,
    spikes_of_temperature,
    steady_rows,
    stuck_rows,
    time_pieces,
)
from diagnosis.recordings.columns import quantities_of
from diagnosis.recordings.doubts import doubts
from diagnosis.recordings.file import open_recording, set_to_one_clock, sha256_of
from diagnosis.recordings.machine import RecordedMachine
from diagnosis.recordings.mapping import mapping_of_definition
from diagnosis.recordings.names import names_of, split_path, stem_of
from diagnosis.recordings.recording import Channel, Recording
from diagnosis.recordings.rows import RecordedRows, joined, read_rows
from diagnosis.recordings.time_axis import moment_text
from models.base.errors import InputError, Problems
from models.quantities.quantities import is_total_loss, node_of_channel

if TYPE_CHECKING:
    from models.assembly.gearbox import Gearbox

FEWEST_ROWS = 3
SHORTEST_GAP_S, GAP_STEPS = 60.0, 3.0  # a gap is longer than both, unless stated
SLOW_GAPS = 10.0  # ambient temperature and air speed change slowly: holes so many times longer are bridged
LEAST_USABLE = 0.1  # share of the rows
ByRole: TypeAlias = tuple[tuple[Recording, ...], tuple[Recording, ...], tuple[Recording, ...]]


def read_recordings(
    paths: str | Path | Sequence[str | Path],
    machine: RecordedMachine | Gearbox,
    *,
    mapping: Path | None = None,
) -> tuple[Recording, ...]:
    r"""Read recordings of one gearbox.

    Parameters
    ----------
    paths : str, Path, or sequence of them
        One entry per recording: a file (.csv, .csv.gz, .parquet, .mf4); several files of one recording, joined in the
        order of time, ``FILE+FILE``; or a part of either, ``FILE@start..end`` (see
        :class:`diagnosis.recordings.names.Part`)
    machine : Gearbox, ThermalNetwork or DescribedMachine
        Defines which nodes and inputs there are
    mapping : Path or None
        Mapping file for all of them (see :mod:`diagnosis.recordings.mapping`); by default ``<stem>.toml`` or
        ``mapping.toml``
        next to each, else the table ``[recording]`` of the network's definition

    Returns
    -------
    tuple of Recording

    Raises
    ------
    InputError
        With all problems of all files, each with file, column and rows.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from models.assembly.gearbox import load_gearbox
    >>> table = "time_s,speed_rpm,torque_Nm,T_oil_degC\n0,1500,94,20.0\n60,1500,94,21.5\n120,1500,94,22.8\n"
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "run.csv").write_text(table)
    ...     (run,) = read_recordings(Path(folder, "run.csv"), load_gearbox("fzg"))
    >>> run
    <Recording 'run': 3 rows over 0.0 h; oil>
    >>> run.to_dataframe()[["time_s", "speed_rpm", "T_oil_degC"]]
       time_s  speed_rpm  T_oil_degC
    0     0.0     1500.0        20.0
    1    60.0     1500.0        21.5
    2   120.0     1500.0        22.8
    """
    network: RecordedMachine = machine.network() if hasattr(machine, "network") else machine
    paths = [paths] if isinstance(paths, str | Path) else paths
    recordings: list[Recording] = []
    problems: list[str] = []
    for path, name in zip(paths, names_of(paths), strict=True):
        try:
            recordings.append(read_recording(path, network, name=name, mapping=mapping))
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError("\n".join(dict.fromkeys(problems)))
    return tuple(recordings)


def read_by_role(
    train: Sequence[str | Path],
    holdout: Sequence[str | Path],
    baseline: Sequence[str | Path],
    network: RecordedMachine,
    *,
    mapping: Path | None = None,
) -> ByRole:
    """Read recordings to learn from, held-out ones and baselines, no two of one name; see :func:`read_recordings`."""
    return named_apart(
        read_recordings(train, network, mapping=mapping),
        read_recordings(holdout, network, mapping=mapping),
        read_recordings(baseline, network, mapping=mapping),
    )


def named_apart(train: Sequence[Recording], holdout: Sequence[Recording], baseline: Sequence[Recording]) -> ByRole:
    """Return the recordings by role; one whose name is taken gets its role, and a number if need be, added."""
    taken: set[str] = set()

    def apart(recording: Recording, ending: str) -> Recording:
        name, number = recording.name, 2
        if name in taken and ending:
            name = f"{name}_{ending}"
        first = name
        while name in taken:
            name, number = f"{first}_{number}", number + 1
        taken.add(name)
        return replace(recording, name=name)

    return (
        tuple(apart(recording, "") for recording in train),
        tuple(apart(recording, "held_out") for recording in holdout),
        tuple(apart(recording, "baseline") for recording in baseline),
    )


def read_recording(
    text: str | Path,
    network: RecordedMachine,
    *,
    name: str = "",
    mapping: Path | None = None,
    to_compare: bool = True,
) -> Recording:
    """Read one recording; see :func:`read_recordings`.

    Parameters
    ----------
    text : str or Path
        ``FILE``, ``FILE+FILE``, ``FILE@start..end``
    to_compare : bool
        True if a measured temperature is required

    Raises
    ------
    InputError
        With all problems of the file.
    """
    paths, parts = split_path(text)
    files = [open_recording(path, mapping, mapping_of_definition(network.recording)) for path in paths]
    set_to_one_clock(files)
    parts = parts or files[0].parts
    first_s = min((file.first_s for file in files if np.isfinite(file.first_s)), default=np.nan)
    tables = [read_rows(file, parts, first_s, network, to_compare=to_compare) for file in files]
    found = joined([table for table in tables if len(table.seconds)] or tables[:1])
    if len(found.seconds) < FEWEST_ROWS:
        where = " in the part that is named" if parts else ""
        rows = len(found.seconds) or "no"
        last_s = max(file.last_s for file in files)
        clock = files[0].clock
        span = (
            f"; it goes from {moment_text(first_s, clock)} to {moment_text(last_s, clock)}" if last_s >= first_s else ""
        )
        raise InputError(f"{found.path}: has {rows} rows{where}{span}; a recording has {FEWEST_ROWS} or more")
    _add_unrecorded(found)
    stated, usual = files[0].mapping.max_gap_s, GAP_STEPS * float(np.median(np.diff(found.seconds)))
    gap = max(SHORTEST_GAP_S, usual) if stated is None else stated
    resolutions = {quantity: resolution_of(found.values[quantity]) for quantity in found.measured}
    _remove_spikes(found, gap)
    _note_stuck(found)
    found.notes[:0] = doubts(found)  # the first notes are printed
    found = _with_known_inputs(found, gap)
    segments = _segments(found, gap)
    seconds, clock = found.seconds, files[0].clock
    since_1970 = 0.0 if clock is not None and clock.is_date else files[0].start
    epoch = datetime(1970, 1, 1, tzinfo=UTC)
    return Recording(
        name=name or stem_of(paths[0]),
        path=found.path,
        files=tuple(found.files),
        sha256=sha256_of(found.files),
        time=seconds - seconds[0],
        start=None if since_1970 is None else epoch + timedelta(seconds=since_1970 + float(seconds[0])),
        from_s=float(seconds[0]),
        clock=clock,
        rows=found.rows,
        inputs={name: found.values[name] for name in found.inputs},
        channels=tuple(
            Channel(
                name=quantity.removeprefix("T_"),
                values=found.values[quantity],
                noise=role.noise,
                resolution=resolutions[quantity] if role.resolution is None else role.resolution,
                lag_s=role.lag_s,
                lag_sd_s=role.lag_sd_s,
                bias_sd=role.bias_sd,
                gain_sd=role.gain_sd,
                column=found.names[quantity],
            )
            for quantity in found.measured
            for role in [found.roles[quantity]]
        ),
        segments=segments,
        tolerances={
            name: stated
            for name in found.inputs
            if name in found.roles
            for stated in [found.roles[name].bias_sd if name == "T_ambient" else found.roles[name].gain_sd]
            if stated is not None
        },
        assumed=tuple(found.assumed),
        notes=tuple(found.notes),
        session=files[0].mapping.session or "",
        parts=tuple(part.name for part in network.parts),
    )


# ---------------------------------------------------------------------- cleaning


def _add_unrecorded(found: RecordedRows) -> None:
    """Add the definition's values of inputs that were not recorded."""
    for name, given in found.machine.inputs.items():
        if name not in found.values:
            found.values[name] = np.full(len(found.seconds), given.default)
            found.assumed.append(name)
            found.notes.append(f"{given.column} was not recorded; {given.default:g} is assumed, as in the definition")


def _remove_spikes(found: RecordedRows, gap: float) -> None:
    inputs = found.machine.inputs
    driving = [name for name, given in inputs.items() if given.required] or list(inputs)
    steady = steady_rows({"time": found.seconds * 0.0} | {name: found.values[name] for name in driving})
    known = quantities_of(found.machine)
    pieces = time_pieces(found.seconds, gap)
    for quantity, values in found.values.items():
        if is_total_loss(quantity):
            wrong = np.concatenate([spikes_of_loss(values[piece], steady[piece]) for piece in pieces])
        elif known[node_of_channel(quantity, known)].is_temperature:
            wrong = np.concatenate([spikes_of_temperature(values[piece]) for piece in pieces])
        else:
            continue
        if wrong.any():
            found.values[quantity] = np.where(wrong, np.nan, values)
            name, where = found.names.get(quantity, quantity), rows_text(found.rows[wrong])
            found.notes.append(f"{name}: outliers and dropouts in {where}, {int(wrong.sum())} in all, taken as missing")


def _note_stuck(found: RecordedRows) -> None:
    for quantity, (first, end, other, moved) in stuck_rows(found.seconds, found.temperatures).items():
        hours = (found.seconds[end - 1] - found.seconds[first]) / 3600.0
        found.notes.append(
            f"{found.names[quantity]} stays at {found.values[quantity][first]:g} degC for {hours:.1f} h (rows "
            f"{found.rows[first]}-{found.rows[end - 1]}) while {found.names[other]} moves by {moved:.1f} K; kept"
        )


def _with_known_inputs(found: RecordedRows, gap: float) -> RecordedRows:
    """Bridge short holes of the inputs, and drop the rows without inputs.

    Raises
    ------
    InputError
        If too few rows are left.
    """
    problems = Problems(found.path)
    time, rows = found.seconds, found.rows
    usable = np.ones(len(time), dtype=bool)
    partial = []
    for name in found.inputs:
        values, column = found.values[name], found.names.get(name, name)
        is_slow = found.machine.inputs[name].quantity.is_temperature or name == "air_speed"
        longest = SLOW_GAPS * gap if is_slow else gap
        filled, known = bridged(time, values, longest)
        found.values[name] = filled
        missing, lost = int(np.isnan(values).sum()), rows[~known]
        if missing:
            left = f"; {len(lost)} rows without are left out ({rows_text(lost)})" if len(lost) else ""
            found.notes.append(
                f"{column} is missing in {missing} of {len(rows)} rows, bridged where shorter than {longest:g} s "
                f"({'ten times ' if is_slow else ''}max_gap_s){left}"
            )
        if known.sum() < FEWEST_ROWS:
            problems.add(
                f"{column} has only {int(known.sum())} of {len(time)} values that can be used (rows {rows[0]}-"
                f"{rows[-1]})"
            )
        usable &= known
        if len(lost):
            partial.append(column)
    if not problems and usable.sum() < max(FEWEST_ROWS, LEAST_USABLE * len(usable)):
        problems.add(
            f"only {int(usable.sum())} of rows {rows[0]}-{rows[-1]} have {' and '.join(partial)}; mend the columns, or "
            "name the part that has them"
        )
    problems.stop_if_any()
    return replace(
        found,
        seconds=time[usable],
        rows=rows[usable],
        values={name: values[usable] for name, values in found.values.items()},
    )


def _segments(found: RecordedRows, gap: float) -> tuple[slice, ...]:
    """Return the gap-free pieces of more than one row.

    Raises
    ------
    InputError
        If there is none.
    """
    pieces = time_pieces(found.seconds, gap)
    segments = tuple(piece for piece in pieces if piece.stop - piece.start > 1)
    if not segments:
        raise InputError(f"{found.path}: no two rows are closer than {gap:g} s (max_gap_s); raise it in a mapping file")
    alone = len(pieces) - len(segments)
    if len(pieces) > 1:
        cuts = found.rows[[piece.start for piece in pieces[1:]]]
        gaps = "1 gap" if len(cuts) == 1 else f"{len(cuts)} gaps"
        found.notes.append(
            f"{gaps} longer than {gap:g} s split it into {len(pieces)} pieces (before {rows_text(cuts)})"
            + (f"; {alone} of a single row are not used" if alone else "")
        )
    return segments
