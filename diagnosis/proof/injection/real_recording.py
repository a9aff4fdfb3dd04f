"""A recording of a real machine: its text, its rows in the units inside, and the recording as a diagnosis reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from diagnosis.proof.injection.csv_text import CsvText, read_csv_text
from diagnosis.recordings.cleaning import resolution_of
from diagnosis.recordings.columns import quantities_of
from diagnosis.recordings.file import open_recording
from diagnosis.recordings.mapping import mapping_file, mapping_of_definition
from diagnosis.recordings.names import part_of, split_path, stem_of
from diagnosis.recordings.read import read_recording
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.rows import RecordedRows, read_rows
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.files.paths import KINDS
from models.quantities.quantities import is_total_loss
from models.quantities.units import units_in_files

TEXT_KINDS = tuple(kind for kind in KINDS if kind.startswith(".csv"))


@dataclass(frozen=True, kw_only=True, eq=False)
class RealRecording:
    """One file, or a part of it.

    Attributes
    ----------
    stem : str
        Its name without ending
    part : str
        As it was named, ``start..end``; empty for the whole file
    first_s : float
        Time of the first row of the whole file in its own time, [s]
    text : CsvText
        Rows of the part
    found : RecordedRows
        All of them in the units inside; NaN where missing
    recording : Recording
        As a diagnosis reads it
    mapping : Path or None
        Mapping file next to it
    factors : mapping of quantity to float
        Unit inside per unit of the column
    nodes : tuple of str
        Parts of the machine
    """

    path: Path
    stem: str
    part: str
    first_s: float
    text: CsvText
    found: RecordedRows
    recording: Recording
    mapping: Path | None
    factors: Mapping[str, float]
    nodes: tuple[str, ...]

    @cached_property
    def time(self) -> Array:
        """Time since the first row, shape (rows,), [s]."""
        return np.asarray(self.found.seconds - self.found.seconds[0])

    @property
    def offset_s(self) -> float:
        """Time of the first row that a diagnosis uses, [s]."""
        return self.recording.from_s - float(self.found.seconds[0])

    @property
    def step_s(self) -> float:
        """Usual interval of the rows, [s]."""
        return float(np.median(np.diff(self.time)))

    @cached_property
    def channels(self) -> dict[str, Array]:
        """Readings of the temperature sensors by channel, shape (rows,), [degC]; NaN where missing."""
        names = [c.name for c in self.recording.channels if not is_total_loss(c.name)]
        return {name: self.found.values[f"T_{name}"] for name in names}

    def reading_at(self, channel: str, time: Array) -> Array:
        """Reading of a sensor at times since the first row, straight across what is missing, [degC]."""
        values = self.channels[channel]
        known = np.isfinite(values)
        return np.interp(time, self.time[known], values[known])

    @cached_property
    def inputs(self) -> dict[str, Array]:
        """Inputs that have a column, shape (rows,); NaN where missing."""
        return {name: self.found.values[name] for name in self.recording.inputs if name in self.found.names}

    def moment(self, text: str) -> float:
        """Return a date, or seconds as in the name of a part, as time since the first row, [s].

        Raises
        ------
        InputError
            If it is neither, or lies outside the recording.
        """
        start = part_of(f"{text}..").start
        assert start is not None  # noqa: S101 - a part without a start is refused
        clock = self.found.clock
        is_date = clock is not None and clock.is_date
        if isinstance(start, float | int):
            at = float(start) + (self.first_s if is_date else 0.0)
        elif is_date:
            at = start.timestamp()
        else:
            raise InputError(f"{self.path}: its time is in seconds, but {text!r} is a date; name seconds")
        since = at - float(self.found.seconds[0])
        if not 0.0 < since < self.time[-1]:
            raise InputError(
                f"{self.path}: {text} lies outside the recording, which is {self.time[-1] / 3600.0:.4g} h long from "
                f"its first row ({since:g} s were named); name a moment inside it"
            )
        return since

    def with_shifts(self, shifts: Mapping[str, Array]) -> CsvText:
        """Return the text with changed readings.

        Parameters
        ----------
        shifts : mapping of quantity to Array, shape (rows,)
            In the unit inside. They are rounded to the resolution of their column, so that its readings stay on their
            steps; NaN empties a cell. Missing and impossible values stay as they are
        """
        in_file = {}
        for quantity, shift in shifts.items():
            name = self.found.names[quantity]
            values = self.found.values[quantity] / self.factors[quantity]
            quantum = resolution_of(values) or 10.0 ** -self.text.decimals(name)
            rounded = np.round(shift / self.factors[quantity] / quantum) * quantum
            in_file[name] = np.where(np.isnan(values), 0.0, rounded)
        return self.text.with_shifts(in_file)


def read_real_recording(text: str, gearbox: Gearbox) -> RealRecording:
    """Read a recording that something is to be injected into.

    Parameters
    ----------
    text : str
        ``FILE`` or ``FILE@start..end``; CSV or CSV.gz

    Raises
    ------
    InputError
        With all problems of the file; if it is no CSV file, or several; or if a part of it is named although its
        mapping file names rows as well.
    """
    network = gearbox.network()
    paths, parts = split_path(text)
    if len(paths) > 1:
        raise InputError(f"{text}: an injection goes into one file; join them before, or name one")
    (path,) = paths
    if not path.name.lower().endswith(TEXT_KINDS):
        raise InputError(f"{path}: an injection goes into a text file ({', '.join(TEXT_KINDS)}); write it as one")
    recording = read_recording(text, network)
    file = open_recording(path, None, mapping_of_definition(network.recording))
    named = [name for name, column in file.mapping.columns.items() if column.rows is not None]
    if parts and (file.mapping.rows is not None or named):
        which = "rows" if file.mapping.rows is not None else f"rows of column {named[0]}"
        raise InputError(f"{text}: its mapping file names {which} already; leave out '@...', or the rows there")
    first_s = file.first_s
    found = read_rows(file, parts, first_s, network, to_compare=True)
    known = quantities_of(network)
    factors = {}
    for quantity, role in found.roles.items():
        units = units_in_files(known[role.quantity].dimension, known[role.quantity].unit)
        factors[quantity] = role.scale * (units.get(role.unit, (1.0, 0.0))[0] if role.unit else 1.0)
    return RealRecording(
        path=path, stem=stem_of(path), part=text.rpartition("@")[2] if parts else "", first_s=first_s,
        text=read_csv_text(path, file.mapping.text_form).with_rows(found.rows), found=found, recording=recording,
        mapping=mapping_file(path), factors=factors,
        nodes=tuple(part.name for part in network.parts),
    )  # fmt: skip
