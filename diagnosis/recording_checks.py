"""Checks of a recording against what a gearbox can do: units by magnitude, and rows that are used twice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pandas.util import hash_array

from diagnosis.mapping import CERTAINLY_KELVIN, LOSS, dimension_of
from diagnosis.recording_cleaning import rows_text
from models.cycle import COLUMNS
from models.errors import InputError
from models.types import Array

if TYPE_CHECKING:
    from diagnosis.recording import Recording

LOWEST_T = COLUMNS["T_ambient"][1]
HOTTEST_T = 250.0  # degC; oil and steel of a gearbox are long destroyed
MOST_LOSS = 1e7  # W
FEW = 0.01  # share of rows that may be implausible
CODES, CODED = 3, 0.5  # so many different implausible values, in up to this share of rows, are codes of a logger
# Loss over power through the gearbox at high power: below, it is kW; above, the power is not what it seems.
LEAST_LOSS, MOST_LOSS_SHARE, LOADED_ROWS = 2e-4, 1.0, 10
SHARED_ROWS, SHARED_SHARE = 20, 0.2  # distinct rows that two recordings have in common
MIX = np.uint64(0x9E3779B97F4A7C15)  # odd and without a pattern: joins hashes


@dataclass(frozen=True, kw_only=True)
class Range:
    """What values of one quantity are possible, in the unit `unit`."""

    low: float
    high: float
    unit: str


def range_of(quantity: str) -> Range | None:
    """Possible values of a quantity, None where any number may stand."""
    if quantity in COLUMNS:
        _, low, high, unit = COLUMNS[quantity]
        return Range(low=low, high=high, unit=unit.partition(";")[0])
    dimension = dimension_of(quantity)
    if dimension == "temperature":
        return Range(low=LOWEST_T, high=HOTTEST_T, unit="degC")
    return Range(low=-MOST_LOSS, high=MOST_LOSS, unit="W") if dimension == "power" else None


def without_impossible(
    quantity: str, column: str, values: Array, rows: NDArray[np.int64], faults: list[str], notes: list[str]
) -> Array:
    """Values without those that are not possible, shape (rows,); too many of them are a fault.

    Parameters
    ----------
    quantity, column : str
    values : Array, shape (rows,)
        In the unit inside; NaN where missing
    rows : array of int, shape (rows,)
        Numbers of the rows, for messages
    faults, notes : list of str
        What is found is added here
    """
    infinite = np.flatnonzero(np.isinf(values))
    if len(infinite):
        faults.append(
            f"{column} is {values[infinite[0]]} in {rows_text(rows[infinite])}; leave a cell empty where the value is "
            "unknown"
        )
        return values
    good = values[np.isfinite(values)]
    if not len(good):
        faults.append(f"{column} has no value in any of its {len(values)} rows; remove the column, or mend it")
        return values
    dimension = dimension_of(quantity)
    if dimension == "temperature" and good.min() > CERTAINLY_KELVIN[0] and good.max() < CERTAINLY_KELVIN[1]:
        faults.append(
            f"{column} is {good.min():g} to {good.max():g} (rows {rows[0]}-{rows[-1]}), which no gearbox reaches in "
            'degC; was kelvin meant? Subtract 273.15, or give unit = "K" in a mapping file'
        )
        return values
    possible = range_of(quantity)
    if possible is None:
        return values
    wrong = np.isfinite(values) & ((values < possible.low) | (values > possible.high))
    count = int(wrong.sum())
    if not count:
        return values
    first = int(np.flatnonzero(wrong)[0])
    where = f"{count} of {len(values)} values ({rows_text(rows[wrong])})"
    is_code = len(np.unique(values[wrong])) <= CODES and count <= CODED * len(good)
    if count > max(FEW * len(good), 1) and not is_code:
        hint = (
            "; was kelvin meant?"
            if dimension == "temperature" and possible.low < values[first] - 273.15 < possible.high
            else ""
        )
        faults.append(
            f"{column} is {values[first]:g} at row {rows[first]}, and {where} lie outside {possible.low:g} ... "
            f"{possible.high:g} {possible.unit}, which is possible{hint}; give its unit, or the valid range, in a "
            "mapping file"
        )
        return values
    notes.append(f"{column}: {where} outside {possible.low:g} ... {possible.high:g} {possible.unit} taken as missing")
    return np.where(wrong, np.nan, values)


def power_faults(inputs: Mapping[str, Array], loss: Array, names: Mapping[str, str]) -> list[str]:
    """Whether the measured loss fits the power that goes through, at the highest powers.

    Parameters
    ----------
    inputs : mapping of signal to Array, shape (rows,)
        ``speed`` [1/min] and ``torque`` [N m]
    loss : Array, shape (rows,)
        [W]
    names : mapping of quantity to column
    """
    power = np.abs(inputs["speed"] * pi / 30.0 * inputs["torque"])
    good = np.isfinite(power) & np.isfinite(loss)
    if good.sum() < LOADED_ROWS:
        return []
    loaded = good & (power >= 0.5 * np.quantile(power[good], 0.99)) & (power > 0.0)
    if loaded.sum() < LOADED_ROWS:
        return []
    lost, through = float(np.median(np.abs(loss[loaded]))), float(np.median(power[loaded]))
    column = names[LOSS]
    where = f"median of {loaded.sum()} rows"
    if lost == 0.0:
        return [f"{column} is 0 while {through:.4g} W go through the gearbox; remove the column, or mend it"]
    if lost < LEAST_LOSS * through:
        share, torque = f"{100.0 * (1.0 - lost / through):.4f} %", names["torque"]
        fault = (
            f"{column} is {lost:.3g} ({where}) while {through:.4g} W go through the gearbox: an efficiency of "
            f"{share} is not possible; is {column} in kW, or {torque} in N mm? Give the unit in a mapping file"
        )
        return [fault]
    if lost > MOST_LOSS_SHARE * through:
        fault = (
            f"{column} is {lost:.4g} W ({where}), but only {through:.4g} W go through the gearbox; was "
            f"{names['speed']} in rad/s, {names['torque']} in kN m, or {column} in mW? Give the unit in a mapping file"
        )
        return [fault]
    return []


# ---------------------------------------------------------------------- rows that are used twice


def check_each_once(recordings: Sequence[Recording]) -> None:
    """Refuse recordings that share rows: they would count twice.

    Raises
    ------
    InputError
        With every pair that shares rows.
    """
    faults = []
    prints = [_distinct_rows(recording) for recording in recordings] if len(recordings) > 1 else []
    for index, one in enumerate(recordings):
        for before, other in enumerate(recordings[:index]):
            why = _shared(other, one, prints[before], prints[index])
            if why:
                faults.append(f"{one.path}: {why} {other.path}; name every row once")
    if faults:
        raise InputError("\n".join(faults))


def check_holdout(train: Sequence[Recording], holdout: Sequence[Recording]) -> None:
    """Refuse held-out recordings that share rows with those to learn from.

    Raises
    ------
    InputError
        With every pair that shares rows.
    """
    check_each_once(holdout)
    faults = []
    of_train, of_holdout = ([_distinct_rows(recording) for recording in group] for group in (train, holdout))
    for held, held_print in zip(holdout, of_holdout, strict=True):
        for learned, learned_print in zip(train, of_train, strict=True):
            why = _shared(learned, held, learned_print, held_print)
            if why:
                faults.append(
                    f"{held.path}: is held out, but {why} {learned.path}, which is learned from; hold out another "
                    "recording, or a part FILE@start..end that does not overlap"
                )
    if faults:
        raise InputError("\n".join(faults))


def _shared(one: Recording, other: Recording, mine: NDArray[np.uint64], theirs: NDArray[np.uint64]) -> str:
    """How two recordings share rows, as the start of a sentence that goes on with a file; empty if they do not."""
    if one.sha256 == other.sha256:
        first, last = max(one.from_s, other.from_s), min(one.to_s, other.to_s)
        return f"has the rows of {first:g} ... {last:g} s in common with" if last >= first else ""
    common = len(np.intersect1d(mine, theirs, assume_unique=True))
    least = min(len(mine), len(theirs))
    if common >= SHARED_ROWS and common > SHARED_SHARE * least:
        return f"has {common} of {least} distinct rows in common with"
    return ""


def _distinct_rows(recording: Recording) -> NDArray[np.uint64]:
    """Hashes of four rows each as they were measured, without the time: two of them are never the same by chance."""
    columns = [recording.inputs["speed"], recording.inputs["torque"]]
    columns += [channel.values for channel in sorted(recording.channels, key=lambda channel: channel.name)]
    row = np.zeros(len(columns[0]), dtype=np.uint64)
    for column in columns:
        row = row * MIX + hash_array(np.round(np.nan_to_num(column, nan=-1e9), 3) + 0.0)
    four = ((row[:-3] * MIX + row[1:-2]) * MIX + row[2:-1]) * MIX + row[3:]
    return np.unique(four[row[:-3] != row[3:]])
