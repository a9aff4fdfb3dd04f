"""Tables in and out: cycles and results as CSV, CSV.gz or Parquet. Files appear whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from models.base.errors import InputError, Problems
from models.base.types import Array
from models.files.cycle import Cycle
from models.files.numbers import numbers_of
from models.files.paths import KINDS
from models.files.table_file import read_table
from models.quantities.quantities import GEARBOX_INPUTS, MEMORY, NODE_TEMPERATURE, Input, node_columns


@dataclass(frozen=True)
class RecordedStart:
    """First temperature of every node in the file of a cycle.

    Attributes
    ----------
    path : Path
    temperatures : mapping of node name to float
        [degC]
    rows : mapping of node name to int
        Their row numbers, counted from 1
    columns : mapping of node name to str
        Their columns in the file
    """

    path: Path
    temperatures: Mapping[str, float]
    rows: Mapping[str, int]
    columns: Mapping[str, str]

    @classmethod
    def first_of(cls, path: Path, measured: Iterable[tuple[str, str, Array]], rows: NDArray[np.int64]) -> RecordedStart:
        """Take the first value that is not missing.

        Parameters
        ----------
        path : Path
        measured : iterable of (node, column, Array of shape (rows,))
            [degC]; NaN where missing, infinite where a cell is a misspelt number
        rows : array of int, shape (rows,)
            Row numbers
        """
        known = [(node, name, v, i[0]) for node, name, v in measured if len(i := np.flatnonzero(~np.isnan(v)))]
        return cls(
            path,
            temperatures={node: float(values[row]) for node, _, values, row in known},
            rows={node: int(rows[row]) for node, _, _, row in known},
            columns={node: name for node, name, _, _ in known},
        )

    def of(self, nodes: Iterable[str]) -> dict[str, float]:
        """Return start temperatures [degC] of all `nodes`: as recorded, else the mean of those recorded.

        Raises
        ------
        InputError
            If no node of these was recorded, or a first value is no possible temperature.
        """
        nodes = tuple(nodes)
        known = {name: T for name, T in self.temperatures.items() if name in nodes}
        if not known:
            raise InputError(
                f"{self.path}: --initial recorded needs a column T_<node>_degC with a temperature, of the nodes "
                f"{', '.join(nodes)}; give a temperature (--initial 20) or another file instead"
            )
        low, high = NODE_TEMPERATURE.low, NODE_TEMPERATURE.high
        problems = Problems(self.path)
        for name, T in known.items():
            if not low <= T <= high:
                said = f"{T:g} degC" if isfinite(T) else "no number"
                problems.add(
                    f"{self.columns[name]} is {said} at row {self.rows[name]}; --initial recorded needs {low:g} to "
                    f"{high:g} degC there"
                )
        problems.stop_if_any()
        mean = sum(known.values()) / len(known)
        return {name: known.get(name, mean) for name in nodes}


def read_cycle(path: str | Path, inputs: Mapping[str, Input] = GEARBOX_INPUTS) -> Cycle:
    """Read a cycle; see :meth:`models.files.cycle.Cycle.from_columns`."""
    return read_cycle_and_start(Path(path), inputs)[0]


def read_cycle_and_start(path: Path, inputs: Mapping[str, Input] = GEARBOX_INPUTS) -> tuple[Cycle, RecordedStart]:
    """Read a cycle, and the first node temperatures (columns ``T_<node>_degC``) in its file.

    Raises
    ------
    InputError
        See :meth:`models.files.cycle.Cycle.from_columns` and :func:`models.files.table_file.read_table`.
    """
    table = read_table(path)
    cycle = Cycle.from_columns({str(c): table[c].to_numpy() for c in table.columns}, name=str(path), inputs=inputs)
    given = {one.column for one in inputs.values()}
    measured = (
        (node, name, _temperatures(table[name]))
        for node, name in node_columns(map(str, table.columns)).items()
        if name not in given
    )
    return cycle, RecordedStart.first_of(path, measured, np.asarray(table.index) + 1)


def _temperatures(cells: pd.Series) -> Array:
    """A column, shape (rows,), [degC]; NaN where a cell is empty or a word, infinite where it is a misspelt number."""
    values = numbers_of(cells)
    return np.where(np.isnan(values) & cells.astype(str).str.contains(r"\d").to_numpy(dtype=bool), np.inf, values)


def read_initial(value: str) -> float | dict[str, float]:
    """Read start values: a number in degC, or a file with ``T_<node>_degC`` (and ``state_<memory>``) columns.

    The last row counts, so that a result can be continued.
    :mod:`models.simulation.start_temperatures` checks the values.

    Raises
    ------
    InputError
        If it is neither a number nor such a file.

    Examples
    --------
    >>> read_initial("20")
    20.0
    """
    try:
        return float(value)
    except ValueError:
        if not value.lower().endswith(KINDS) and not Path(value).exists():
            raise InputError(
                f"{value}: is no start; a temperature in degC, 'recorded', or a table ({', '.join(KINDS)}) is"
            ) from None
        table = read_table(Path(value))
    names = list(map(str, table.columns))
    nodes = node_columns(names)
    if not nodes or not len(table):
        raise InputError(f"{value}: has no T_<node>_degC columns with values to start from")
    columns = nodes | {name: name for name in names if name.startswith(MEMORY)}
    last = {name: table[column].iloc[-1] for name, column in columns.items()}
    try:
        return {name: float(x) for name, x in last.items() if pd.notna(x)}
    except ValueError as error:
        texts = [f"{columns[name]} is {T!r}" for name, T in last.items() if isinstance(T, str)]
        raise InputError(f"{value}: {', '.join(texts)} in the last row; numbers are needed to start from") from error
