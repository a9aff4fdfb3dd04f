"""Rows of a recording in the units inside: read from one file, and joined from several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.recordings.cleaning import rows_text
from diagnosis.recordings.columns import is_measurable, match_columns, quantities_of, quantity_values
from diagnosis.recordings.file import RecordingFile
from diagnosis.recordings.machine import RecordedMachine
from diagnosis.recordings.mapping import AUXILIARY, IGNORE, Column
from diagnosis.recordings.names import Part
from diagnosis.recordings.time_axis import ISO, ISO_NAMES, STANDARD, Clock, check_time, moment_text
from models.base.errors import InputError
from models.base.types import Array
from models.quantities.quantities import is_total_loss

MOST_FOOTERS = 20  # rows


@dataclass(kw_only=True, eq=False)
class RecordedRows:
    """Rows of a recording in the units inside, while they are cleaned.

    Attributes
    ----------
    seconds : Array, shape (rows,)
        Time in the file, [s]
    rows : array of int, shape (rows,)
        Numbers of the rows in the file, counted from 1
    values : dict of quantity to Array, shape (rows,)
        Inputs and measurements; NaN where missing
    names, roles : dict of quantity to str, Column
        Its column, and what the mapping states of it
    """

    machine: RecordedMachine
    path: Path
    files: list[Path]
    clock: Clock | None
    seconds: Array
    rows: NDArray[np.int64]
    values: dict[str, Array] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    roles: dict[str, Column] = field(default_factory=dict)
    assumed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def inputs(self) -> list[str]:
        """The inputs in it."""
        return [name for name in self.values if name in self.machine.inputs]

    @property
    def measured(self) -> list[str]:
        """The measured quantities in it."""
        inputs = self.machine.inputs
        return [name for name in self.values if is_measurable(name, self.machine) and name not in inputs]

    @property
    def temperatures(self) -> dict[str, Array]:
        """Measured temperatures that have a value, shape (rows,) each, [degC]."""
        measured = {name: self.values[name] for name in self.measured if not is_total_loss(name)}
        return {name: values for name, values in measured.items() if np.isfinite(values).any()}


def read_rows(
    file: RecordingFile, parts: Sequence[Part], first_s: float, machine: RecordedMachine, *, to_compare: bool
) -> RecordedRows:
    """Read the rows of the parts: numbers in the units inside, without impossible values.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    clock, problems, notes = file.clock, file.problems, file.notes
    table = _without_footer(file.table(parts, first_s), file)
    seconds = file.seconds(table)
    if len(table) > 1 and (np.diff(seconds) < 0.0).all():
        notes.append("its newest row comes first: the rows are turned round, and keep their numbers of the file")
        table = table[::-1]
        seconds = file.seconds(table)
    found = RecordedRows(machine=machine, path=file.path, files=[file.path], clock=clock, seconds=seconds,
                         rows=np.asarray(table.index) + 1, notes=notes)  # fmt: skip
    if len(table) == 0:
        problems.stop_if_any()
        return found
    if clock is not None:
        check_time(table[clock.column], seconds, clock, problems)
        if file.mapping.time is None and (clock.column not in (STANDARD, *ISO_NAMES) or clock.unit not in ("s", ISO)):
            notes.append(f"{clock.column} is taken as the time{'' if clock.is_date else f' in {clock.unit}'}")
        if clock.lacks_zone(table[clock.column]):
            notes.append(
                f"{clock.column} has no time zone: it is taken as UTC, and dates marked UTC are the file's own"
            )
    known = quantities_of(machine)
    for name, role in match_columns(file, [str(column) for column in table.columns], machine).items():
        if role.quantity not in (AUXILIARY, IGNORE):
            found.names[role.channel], found.roles[role.channel] = name, role
            outside = ~file.in_rows_of(name, role, seconds, first_s)
            values = quantity_values(file, table[name], name, role, known[role.quantity], outside)
            if values is not None:
                found.values[role.channel] = values
    found.values |= {name: np.full(len(table), value) for name, value in file.mapping.constants.items()}
    if to_compare and not any(q.startswith("T_") and is_measurable(q, machine) for q in found.names):
        problems.add(
            "no temperature was measured: a column T_<node>_degC is needed, of the nodes "
            + ", ".join(part.name for part in machine.parts)
        )
    problems.stop_if_any()
    return found


def _without_footer(table: pd.DataFrame, file: RecordingFile) -> pd.DataFrame:
    """Leave out rows at the end that hold a text in place of the time, and nothing else."""
    end = table.iloc[1:][-MOST_FOOTERS:]
    if file.clock is None or not len(end):
        return table
    times = end[file.clock.column]
    is_text = np.isnan(file.seconds(end)) & times.map(lambda cell: isinstance(cell, str)).to_numpy(dtype=bool)
    is_text &= end.drop(columns=file.clock.column).isna().all(axis=1).to_numpy(dtype=bool)
    footers = int(np.logical_and.accumulate(is_text[::-1]).sum())
    if footers:
        first = str(times.iloc[len(end) - footers])[:40]
        file.notes.append(
            f"{rows_text(np.asarray(end.index[-footers:]) + 1)} at the end with a text only ({first!r}) left out"
        )
    return table.iloc[: len(table) - footers]


def joined(tables: Sequence[RecordedRows]) -> RecordedRows:
    """Join the files of one recording in the order of time.

    Raises
    ------
    InputError
        If they overlap.
    """
    if len(tables) == 1:
        return tables[0]
    tables = sorted(tables, key=lambda table: table.seconds[0])
    for before, after in pairwise(tables):
        if after.seconds[0] <= before.seconds[-1]:
            raise InputError(
                f"{after.path}: begins at {moment_text(after.seconds[0], after.clock)}, before {before.path} ends at "
                f"{moment_text(before.seconds[-1], before.clock)} (time in the file); files that are joined by + must "
                "follow each other in time: remove the rows that are there twice, or name separate recordings"
            )

    before_rows = np.cumsum([0, *(int(table.rows.max()) for table in tables[:-1])])
    numbered = [table.rows + start for table, start in zip(tables, before_rows, strict=True)]
    ranges = ", ".join(
        f"{table.path.name} (rows {rows.min()}-{rows.max()})" for table, rows in zip(tables, numbered, strict=True)
    )
    notes = [f"{table.path.name}: {note}" for table in tables for note in table.notes]
    return replace(
        tables[0],
        path=tables[0].path.with_name("+".join(table.path.name for table in tables)),
        files=[table.path for table in tables],
        seconds=np.concatenate([table.seconds for table in tables]),
        rows=np.concatenate(numbered),
        values={
            name: np.concatenate([t.values.get(name, np.full(len(t.seconds), np.nan)) for t in tables])
            for name in dict.fromkeys(name for table in tables for name in table.values)
        },
        names={quantity: name for table in reversed(tables) for quantity, name in table.names.items()},
        roles={quantity: role for table in reversed(tables) for quantity, role in table.roles.items()},
        notes=[f"joined from {ranges}", *notes],
    )
