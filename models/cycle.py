"""A cycle: the inputs of a gearbox over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.errors import InputError
from models.types import Array

# signal -> (column of a file, plausible range, what a value outside it usually is)
COLUMNS: dict[str, tuple[str, float, float, str]] = {
    "speed": ("speed_rpm", -2.0e5, 2.0e5, "1/min"),
    "torque": ("torque_Nm", -1.0e7, 1.0e7, "N m"),
    "T_ambient": ("T_ambient_degC", -90.0, 200.0, "degC; kelvin are not meant"),
    "air_speed": ("air_speed_m_s", 0.0, 200.0, "m/s"),
}
REQUIRED = ("speed", "torque")


@dataclass(frozen=True)
class Cycle:
    """Inputs over time, taken as straight lines between the rows.

    Attributes
    ----------
    time : Array, shape (N,)
        [s], strictly increasing
    inputs : mapping of signal name to Array, shape (N,)
        ``speed`` [1/min], ``torque`` [N m], ``T_ambient`` [degC], ``air_speed`` [m/s] and further named inputs
    """

    time: Array
    inputs: Mapping[str, Array]

    @classmethod
    def from_columns(
        cls, columns: Mapping[str, ArrayLike], *, name: str = "cycle", extra: tuple[str, ...] = ()
    ) -> Cycle:
        """Read a cycle from named columns (a dict, a pandas data frame).

        Parameters
        ----------
        columns : mapping of column name to ArrayLike, shape (N,)
            ``time_s``, ``speed_rpm``, ``torque_Nm`` and, where known, ``T_ambient_degC`` and ``air_speed_m_s``
        name : str
            What messages call it, e.g. the file
        extra : tuple of str
            Further columns that the network has as inputs, read under their own name

        Raises
        ------
        InputError
            All faults at once: missing columns, no rows, columns of different lengths, values that are not finite or
            not plausible, time that does not increase; with the row numbers (the first row of data is 1).

        Examples
        --------
        >>> Cycle.from_columns({"time_s": [0, 1, 1], "speed_rpm": [0, 1, 2]}, name="run.csv")
        Traceback (most recent call last):
        models.errors.InputError: run.csv: column torque_Nm is missing; it has: speed_rpm, time_s
        run.csv: time_s goes from 1 to 1 at row 3; it must increase from row to row
        """
        faults: list[str] = []
        have = {str(key) for key in columns}
        needed = ["time_s", *(COLUMNS[signal][0] for signal in REQUIRED)]
        faults += [f"column {c} is missing; it has: {', '.join(sorted(have))}" for c in needed if c not in have]
        arrays: dict[str, Array] = {}
        wanted = {"time": "time_s"} | {signal: spec[0] for signal, spec in COLUMNS.items()} | {c: c for c in extra}
        for signal, column in wanted.items():
            if column in have:
                values = _numbers(columns[column], column, faults)
                if values is not None:
                    arrays[signal] = values
        time = arrays.pop("time", None)
        if time is not None:
            faults += _time_faults(time)
            faults += [
                f"{wanted[signal]} has {len(values)} rows, but time_s has {len(time)}"
                for signal, values in arrays.items()
                if len(values) != len(time)
            ]
        for signal in [s for s in COLUMNS if s in arrays]:
            faults += _range_faults(signal, arrays[signal])
        if faults or time is None:
            raise InputError("\n".join(f"{name}: {fault}" for fault in faults))
        return cls(time, arrays)

    def __len__(self) -> int:
        return len(self.time)


def _time_faults(time: Array) -> list[str]:
    if len(time) == 0:
        return ["it has no rows"]
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if not len(back):
        return []
    row = int(back[0])
    return [f"time_s goes from {time[row]:g} to {time[row + 1]:g} at row {row + 2}; it must increase from row to row"]


def _range_faults(signal: str, values: Array) -> list[str]:
    column, low, high, unit = COLUMNS[signal]
    wrong = np.flatnonzero((values < low) | (values > high))
    if not len(wrong):
        return []
    row = int(wrong[0])
    return [f"{column} is {values[row]:g} at row {row + 1}; {low:g} ... {high:g} is possible ({unit})"]


def _numbers(values: ArrayLike, column: str, faults: list[str]) -> Array | None:
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        faults.append(f"{column} holds something that is not a number ({error})")
        return None
    if numbers.ndim != 1:
        faults.append(f"{column} has shape {numbers.shape}; one value per row is needed")
        return None
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if len(wrong):
        row = int(wrong[0])
        faults.append(f"{column} is {numbers[row]} at row {row + 1}; {len(wrong)} rows are not finite numbers")
        return None
    return numbers
