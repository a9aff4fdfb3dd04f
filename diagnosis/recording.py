"""A recording: the inputs of a gearbox and what was measured in it over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

from diagnosis.mapping import mapping_of_definition
from diagnosis.recording_checks import check_each_once, check_holdout
from diagnosis.recording_columns import read_columns
from diagnosis.recording_file import RecordingFile, name_parts, read_recording_file
from models.errors import InputError
from models.network import ThermalNetwork
from models.table_file import LIMITS, Limits
from models.types import Array

__all__ = ["Channel", "Recording", "check_holdout", "read_recordings", "read_train_and_holdout"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """One measured quantity.

    Attributes
    ----------
    name : str
        The node, or ``P_loss`` for the total loss
    values : Array, shape (rows,)
        [degC] or [W]; NaN where missing
    noise : float or None
        White standard deviation of one row as its mapping file states it, [K] or [W]
    resolution : float
        Quantum of the values as stated, else as found in them, [K] or [W]; 0 where there is none
    lag_s : float or None
        Time constant of the sensor as stated, [s]
    lag_sd_s : float or None
        Its uncertainty as stated, [s]
    bias_sd : float or None
        Tolerance of the sensor as stated, [K] or [W]
    """

    name: str
    values: Array
    noise: float | None = None
    resolution: float = 0.0
    lag_s: float | None = None
    lag_sd_s: float | None = None
    bias_sd: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """Inputs and measurements of one gearbox over time.

    Attributes
    ----------
    name : str
        Of its file; different for recordings that are read together
    path : Path
    sha256 : str
        Of the file
    time : Array, shape (rows,)
        Since the recording's own first row, [s], strictly increasing
    start : datetime or None
        Of the first row, where the file tells
    from_s, to_s : float
        First and last row as the file's own time column tells them, [s]
    inputs : mapping of signal to Array, shape (rows,)
        Every input of the network; free of NaN
    channels : tuple of Channel
    auxiliary : mapping of column to Array, shape (rows,)
        Other numeric columns
    segments : tuple of slice
        Gap-free pieces
    assumed : tuple of str
        Inputs that were not recorded: the definition's value stands for them
    notes : tuple of str
        What was cleaned or assumed
    """

    name: str
    path: Path
    sha256: str
    time: Array
    start: datetime | None = None
    from_s: float = 0.0
    to_s: float = 0.0
    inputs: Mapping[str, Array]
    channels: tuple[Channel, ...]
    auxiliary: Mapping[str, Array] = field(default_factory=dict)
    segments: tuple[slice, ...]
    assumed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def read_recordings(
    paths: Sequence[str | Path],
    network: ThermalNetwork,
    *,
    mapping: Path | None = None,
    limits: Limits = LIMITS,
    max_gap_s: float | None = None,
) -> tuple[Recording, ...]:
    """Read recordings of one gearbox.

    Parameters
    ----------
    paths : sequence of str or Path
        Files (.csv, .csv.gz, .parquet, .mf4), or parts of them, ``FILE@start..end`` (see
        :func:`diagnosis.recording_time.part_of`)
    network : ThermalNetwork
        Tells which nodes and inputs there are
    mapping : Path or None
        Mapping file for all of them (see :mod:`diagnosis.mapping`); by default ``<stem>.toml`` or ``mapping.toml``
        beside each, else what the definition of the network says
    limits : Limits
        What is read at most
    max_gap_s : float or None
        Longest gap that is bridged, [s]; by default as the mapping says, else 60 s or three usual steps

    Returns
    -------
    tuple of Recording

    Raises
    ------
    InputError
        With all faults of all files, each with file, column and rows; or if recordings share rows.
    """
    recordings: list[Recording] = []
    faults: list[str] = []
    names, usual = _names(paths), mapping_of_definition(network.recording)
    for path, name in zip(paths, names, strict=True):
        try:
            file = read_recording_file(path, mapping=mapping, usual=usual, limits=limits)
            recordings.append(_recording(file, network, name=name, max_gap_s=max_gap_s))
        except InputError as error:
            faults.append(str(error))
    if faults:
        raise InputError("\n".join(dict.fromkeys(faults)))
    check_each_once(recordings)
    return tuple(recordings)


def read_train_and_holdout(
    train: Sequence[str | Path], holdout: Sequence[str | Path], network: ThermalNetwork, *, mapping: Path | None = None
) -> tuple[tuple[Recording, ...], tuple[Recording, ...]]:
    """Recordings to learn from and to judge by, no two of one name; see :func:`read_recordings`."""
    learnt, judged = (read_recordings(paths, network, mapping=mapping) for paths in (train, holdout))
    taken = {recording.name for recording in learnt}
    return learnt, tuple(replace(r, name=f"{r.name}_held_out") if r.name in taken else r for r in judged)


def _recording(file: RecordingFile, network: ThermalNetwork, *, name: str, max_gap_s: float | None) -> Recording:
    columns = read_columns(file, network, max_gap_s=max_gap_s)
    mapped = {column.quantity: column for column in file.mapping.columns.values()}
    channels = []
    for quantity, values in columns.measured.items():
        stated = mapped.get(quantity)
        channels.append(
            Channel(
                name=quantity.removeprefix("T_"),
                values=values,
                noise=stated.noise if stated else None,
                resolution=columns.resolutions[quantity],
                lag_s=stated.lag_s if stated else None,
                lag_sd_s=stated.lag_sd_s if stated else None,
                bias_sd=stated.bias_sd if stated else None,
            )
        )
    return Recording(
        name=name,
        path=file.path,
        sha256=file.sha256,
        time=columns.seconds - columns.seconds[0],
        start=columns.start,
        from_s=float(columns.seconds[0]),
        to_s=float(columns.seconds[-1]),
        inputs=columns.inputs,
        channels=tuple(channels),
        auxiliary=columns.auxiliary,
        segments=columns.segments,
        assumed=tuple(columns.assumed),
        notes=tuple(columns.notes),
    )


def _names(paths: Sequence[str | Path]) -> list[str]:
    """Short names of recordings, made different by their folder, their part, or a number where need be."""
    split = [name_parts(path) for path in paths]
    for form in ("{stem}", "{folder}_{stem}", "{stem}_{part}", "{folder}_{stem}_{part}"):
        names = [form.format(stem=stem, folder=folder, part=part).strip("_") for folder, stem, part in split]
        if len(set(names)) == len(names):
            return names
    return [f"{stem}_{number}" for number, (_, stem, _) in enumerate(split, start=1)]
