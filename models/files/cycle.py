"""A cycle: the inputs of a gearbox over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError, Problems
from models.base.types import Array
from models.columns.columns import Columns
from models.files.numbers import is_number
from models.files.table_file import MOST_ROWS
from models.quantities.column_names import meant
from models.quantities.quantities import GEARBOX_INPUTS, Input, column_of_input, implausible

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SHORTEST_INTERVAL_S = 1e-5  # times in files have six decimals
# Likeness of names (T_cabinet_degC is no slip of T_ambient_degC), and of names without the unit.
NEAR, NEAR_STEM = 0.9, 0.8


@dataclass(frozen=True, repr=False)
class Cycle:
    """Inputs over time, taken as straight lines between the rows.

    Attributes
    ----------
    time : Array, shape (N,)
        [s], strictly increasing
    inputs : mapping of signal name to Array, shape (N,)
        As ``speed`` [1/min], ``torque`` [N m], ``T_ambient`` [degC]; named inputs in the unit of their definition
    """

    time: Array
    inputs: Mapping[str, Array]

    def __repr__(self) -> str:
        rows = f"{len(self)} rows from {self.time[0]:g} to {self.time[-1]:g} s"
        return f"<Cycle: {rows} of {', '.join(self.inputs)}>"

    def columns(self) -> Columns:
        """Return the columns of a file."""
        return Columns(time_s=self.time) | {column_of_input(name): values for name, values in self.inputs.items()}

    def to_dataframe(self) -> pd.DataFrame:
        """Return :meth:`columns` as a data frame.

        Examples
        --------
        >>> cycle = Cycle.from_columns({"time_s": [0, 5], "speed_rpm": [0, 100], "torque_Nm": [3, 3]})
        >>> cycle
        <Cycle: 2 rows from 0 to 5 s of speed, torque>
        >>> cycle.to_dataframe()
           time_s  speed_rpm  torque_Nm
        0     0.0        0.0        3.0
        1     5.0      100.0        3.0
        """
        return self.columns().to_dataframe()

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the first two inputs that are no temperature; the second has an axis at the right.

        Parameters
        ----------
        ax : Axes or None
            By default new ones

        Returns
        -------
        Axes
        """
        from models.columns.curves import axes_or_new, axis_label, draw_inputs, time_scale  # imports matplotlib

        scale, unit = time_scale(self.time)
        with axes_or_new(ax) as axes:
            names = [name for name in self.inputs if not name.startswith("T_")] or list(self.inputs)
            labels = {column_of_input(name): axis_label(column_of_input(name)) for name in names}
            draw_inputs(axes, self.time * scale, self.columns(), labels)
            axes.set_xlabel(f"Time in {unit}")
        return axes

    @classmethod
    def from_columns(
        cls, columns: Mapping[str, ArrayLike], *, name: str = "cycle", inputs: Mapping[str, Input] = GEARBOX_INPUTS
    ) -> Cycle:
        """Read a cycle from named columns (a dict, a pandas data frame).

        Parameters
        ----------
        columns : mapping of column name to ArrayLike, shape (N,)
            ``time_s``, those that the inputs require (``speed_rpm``, ``torque_Nm``) and, if known, the others
            (``T_ambient_degC``)
        name : str
            Its name in messages, e.g. the file
        inputs : mapping of str to Input
            Of the network; by default those of a gearbox with geometry

        Raises
        ------
        InputError
            All faults at once: missing columns, columns that seem to be an optional one under another name, no rows,
            columns of different lengths, values that are not finite or not plausible, time that does not increase;
            with the row numbers (the first row of data is 1).

        Examples
        --------
        >>> Cycle.from_columns({"time_s": [0, 1, 1], "speed_rpm": [0, 1, 2]}, name="run.csv")
        Traceback (most recent call last):
        models.base.errors.InputError: run.csv: column torque_Nm is missing; it has: speed_rpm, time_s
        run.csv: time_s goes from 1 to 1 at row 3; it must increase from row to row
        """
        problems = Problems(name)
        wanted = {"time": "time_s"} | {name: given.column for name, given in inputs.items()}
        needed = ["time_s", *(given.column for given in inputs.values() if given.required)]
        _check_names([str(key) for key in columns], list(wanted.values()), needed, problems)
        arrays: dict[str, Array] = {}
        for signal, column in wanted.items():
            values = _numbers(columns[column], column, problems) if column in columns else None
            if values is not None:
                arrays[signal] = values
        time = arrays.pop("time", None)
        if time is not None:
            _check_time(time, problems)
            for signal, values in arrays.items():
                if len(values) != len(time):
                    problems.add(f"{wanted[signal]} has {len(values)} rows, but time_s has {len(time)}")
        for signal, values in arrays.items():
            if fault := implausible(inputs[signal].quantity, values):
                problems.add(fault)
        problems.stop_if_any()
        return cls(cast(Array, time), arrays)

    def __len__(self) -> int:
        return len(self.time)

    def refined(self, interval: float) -> Cycle:
        """Return the same inputs with more rows: its own, and one every `interval` from the first row on.

        Parameters
        ----------
        interval : float
            [s]

        Raises
        ------
        InputError
            If the interval is shorter than 1e-5 s, not finite, or gives more than 5 million rows.

        Examples
        --------
        >>> cycle = Cycle.from_columns({"time_s": [0, 5, 8], "speed_rpm": [0, 100, 100], "torque_Nm": [3, 3, 0]})
        >>> cycle.refined(2.0).time.tolist()
        [0.0, 2.0, 4.0, 5.0, 6.0, 8.0]
        >>> cycle.refined(2.0).inputs["speed"].tolist()
        [0.0, 40.0, 80.0, 100.0, 100.0, 100.0]
        """
        if not SHORTEST_INTERVAL_S <= interval < np.inf:
            raise InputError(
                f"an output interval of {interval:g} s is not possible; {SHORTEST_INTERVAL_S:g} s or more is"
            )
        first, last = float(self.time[0]), float(self.time[-1])
        rows = len(self) + (last - first) / interval
        if rows > MOST_ROWS:
            longer = _rounded_up((last - first) / max(MOST_ROWS - len(self), 1))
            raise InputError(
                f"an output interval of {interval:g} s gives {rows:.3g} rows over {last - first:g} s; up to "
                f"{MOST_ROWS} are possible: choose {longer} s or more"
            )
        grid = first + interval * np.arange(1, int((last - first) / interval) + 1)
        # A grid point that differs from a row only by rounding, in the cycle or in a file, is that row.
        same = max(1e-6 * interval, 0.2 * SHORTEST_INTERVAL_S, 4.0 * float(np.spacing(np.abs(self.time).max())))
        after = np.searchsorted(self.time, grid).clip(1, len(self) - 1)
        distance = np.minimum(np.abs(grid - self.time[after - 1]), np.abs(self.time[after] - grid))
        time = np.union1d(self.time, grid[(distance > same) & (grid < last)])
        return Cycle(time, {name: np.interp(time, self.time, values) for name, values in self.inputs.items()})


def _rounded_up(seconds: float) -> str:
    """Two digits, not below the number."""
    unit = 10.0 ** (np.floor(np.log10(seconds)) - 1.0)
    return f"{np.ceil(seconds / unit) * unit:g}"


def _check_names(have: list[str], wanted: list[str], needed: list[str], problems: Problems) -> None:
    for column in needed:
        if column not in have:
            problems.add(f"column {column} is missing; it has: {', '.join(sorted(have))}")
    absent = [column for column in wanted if column not in have]
    for given in have:
        # An optional column under another name would otherwise silently have its default.
        if given not in wanted and (column := meant(given, absent, near=NEAR, near_stem=NEAR_STEM)):
            problems.add(f"column {given[:80]} is not known; is {column} meant? rename it, or remove it")


def _check_time(time: Array, problems: Problems) -> None:
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(time) == 0:
        problems.add("it has no rows")
    elif len(back):
        row = int(back[0])
        problems.add(
            f"time_s goes from {time[row]:g} to {time[row + 1]:g} at row {row + 2}; it must increase from row to row"
        )


def _numbers(values: ArrayLike, column: str, problems: Problems) -> Array | None:
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        row, value = next((row, value) for row, value in enumerate(np.ravel(values), start=1) if not is_number(value))
        problems.add(f"{column} is {str(value)[:40]!r} at row {row}; numbers are needed")
        return None
    if numbers.ndim != 1:
        problems.add(f"{column} has shape {numbers.shape}; one value per row is needed")
        return None
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if len(wrong):
        row = int(wrong[0])
        problems.add(f"{column} is {numbers[row]} at row {row + 1}; {len(wrong)} rows are not finite numbers")
        return None
    return numbers
