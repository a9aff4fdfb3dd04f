"""From the columns of a file to the inputs and measurements of a gearbox: assigned, converted, checked and cleaned."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timedelta

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.mapping import AUXILIARY, IGNORE, LOSS, UNITS, Column, dimension_of
from diagnosis.recording_checks import power_faults, without_impossible
from diagnosis.recording_cleaning import (
    OUTLIER_K,
    OUTLIER_OF_LOSS,
    bridged,
    dropouts,
    outliers,
    resolution_of,
    rows_text,
    steady_rows,
    stuck_rows,
    time_pieces,
)
from diagnosis.recording_file import FEWEST_ROWS, RecordingFile
from diagnosis.recording_time import inside, part_of
from models.column_names import meant
from models.cycle import COLUMNS, REQUIRED
from models.errors import InputError, did_you_mean
from models.network import ThermalNetwork
from models.types import Array

SHORTEST_GAP_S, GAP_STEPS = 60.0, 3.0  # a gap is what is longer than both, unless stated
SLOW_GAPS = 10.0  # ambient temperature and air speed change slowly: holes so many times longer are bridged
LEAST_USABLE = 0.1  # share of the rows
NEAR = 0.85  # likeness of names that makes one a slip of the other
MOST_NAMED = 12  # unused columns in a note


@dataclass(kw_only=True, eq=False)
class RecordedColumns:
    """What a file says in the words and units of the network; `notes` says what was cleaned or assumed.

    Attributes
    ----------
    seconds : Array, shape (rows,)
        As the file's clock tells them, [s]
    rows : array of int, shape (rows,)
        Numbers of the rows in the file, the first row of data is 1
    inputs, measured, auxiliary : dict of Array, shape (rows,)
        By signal, by quantity (``T_<node>``, ``P_loss``), by column
    names : dict of str
        Column of every quantity
    resolutions : dict of float
        Quantum of every measured quantity
    segments : tuple of slice
    assumed : list of str
        Inputs that were not recorded: the definition's value stands for them
    """

    seconds: Array
    rows: NDArray[np.int64]
    start: datetime | None
    inputs: dict[str, Array] = field(default_factory=dict)
    measured: dict[str, Array] = field(default_factory=dict)
    auxiliary: dict[str, Array] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    resolutions: dict[str, float] = field(default_factory=dict)
    segments: tuple[slice, ...] = ()
    assumed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_columns(
    file: RecordingFile, network: ThermalNetwork, *, max_gap_s: float | None = None, to_compare: bool = True
) -> RecordedColumns:
    """The columns of a file, ready to be simulated and compared; only `to_compare` needs a temperature.

    Raises
    ------
    InputError
        With all faults of the file.
    """
    columns = RecordedColumns(seconds=file.seconds, rows=np.asarray(file.table.index) + 1, start=file.start)
    faults = list(file.faults)
    roles = _roles(file, network, faults, columns.notes)
    for name, column in roles.items():
        _take(file, name, column, network, columns, faults)
    _add_constants(file, network, columns, faults)
    are_temperatures = [
        column.quantity.startswith("T_") for column in roles.values() if column.quantity in _measurable(network)
    ]
    if to_compare and not columns.measured and not any(are_temperatures):
        faults.append(
            "no temperature was measured: a column T_<node>_degC is needed, of the nodes "
            + ", ".join(part.name for part in network.parts)
        )
    if not faults and LOSS in columns.measured:
        faults += power_faults(columns.inputs, columns.measured[LOSS], columns.names)
    if not faults:
        stated = max_gap_s if max_gap_s is not None else file.mapping.max_gap_s
        usual = GAP_STEPS * float(np.median(np.diff(columns.seconds)))
        gap = stated if stated is not None else max(SHORTEST_GAP_S, usual)
        _clean(columns, gap)
        faults += _split(columns, gap)
    if faults:
        raise InputError("\n".join(f"{file.path}: {fault}" for fault in dict.fromkeys(faults)))
    return columns


# ---------------------------------------------------------------------- which column is what


def _measurable(network: ThermalNetwork) -> tuple[str, ...]:
    return (*(f"T_{part.name}" for part in network.parts), LOSS)


def _inputs(network: ThermalNetwork) -> tuple[str, ...]:
    return (*REQUIRED, *(name for name in network.inputs if name not in REQUIRED))


def _standard_names(network: ThermalNetwork) -> dict[str, str]:
    """Column of every quantity, where no mapping file says otherwise."""
    names = {signal: COLUMNS[signal][0] if signal in COLUMNS else signal for signal in _inputs(network)}
    return names | {q: f"{q}_degC" if q.startswith("T_") else f"{q}_W" for q in _measurable(network)}


def _roles(file: RecordingFile, network: ThermalNetwork, faults: list[str], notes: list[str]) -> dict[str, Column]:
    """What every column of the file is; faults where a column is missing or its name is a slip."""
    present = [str(column) for column in file.table.columns]
    roles = _mapped(file, network, present, faults)
    constants = set(file.mapping.constants)
    for signal, name in _standard_names(network).items():
        if signal in constants and name in present and name not in file.mapping.columns:
            faults.append(
                f"{signal} is a constant of its mapping file, and column {name} is there as well; leave the constant "
                f'out, or name the column in the mapping file with quantity = "{IGNORE}"'
            )
    taken = {column.quantity for column in file.mapping.columns.values()} | constants
    standard = {quantity: name for quantity, name in _standard_names(network).items() if quantity not in taken}
    for quantity, name in standard.items():
        if name in present and name not in file.mapping.columns:
            roles[name] = Column(quantity=quantity)
    clock = file.clock.column if file.clock is not None else None
    rest = [name for name in present if name not in roles and name not in file.mapping.columns and name != clock]
    _set_aside(rest, [name for name in standard.values() if name not in present], faults, notes)
    roles |= {name: Column(quantity=AUXILIARY) for name in rest}
    for signal in REQUIRED:
        if signal not in taken and standard[signal] not in present:
            faults.append(f"column {standard[signal]} is missing; it has: {', '.join(sorted(present)[:20])}")
    return roles


def _mapped(file: RecordingFile, network: ThermalNetwork, present: list[str], faults: list[str]) -> dict[str, Column]:
    """Columns that a mapping file names."""
    known = {*_inputs(network), *_measurable(network), AUXILIARY, IGNORE}
    roles: dict[str, Column] = {}
    for name, column in file.mapping.columns.items():
        if name not in present:
            faults.append(f"column {name} of its mapping file is missing{did_you_mean(name, present)}")
        elif column.quantity not in known:
            hint = did_you_mean(column.quantity, known)
            faults.append(
                f"column {name} is {column.quantity!r} in its mapping file, which this gearbox does not have{hint}"
            )
        else:
            roles[name] = column
    return roles


def _set_aside(rest: list[str], lacking: list[str], faults: list[str], notes: list[str]) -> None:
    """Columns that nothing asks for: told, so that none is lost by its name alone."""
    slips = {name: slip for name in rest if (slip := meant(name, lacking, near=NEAR, told=True))}
    for name, slip in slips.items():
        faults.append(
            f"column {name[:80]} is not known; did you mean {slip!r}? Rename it, or name it in a mapping file "
            f'(quantity = "{AUXILIARY}" if it is something else)'
        )
    unused = [name[:80] for name in rest if name not in slips]
    if unused:
        more = f" and {len(unused) - MOST_NAMED} more" if len(unused) > MOST_NAMED else ""
        notes.append(f"not used, being no input and no node of this gearbox: {', '.join(unused[:MOST_NAMED])}{more}")


# ---------------------------------------------------------------------- numbers


def _take(
    file: RecordingFile, name: str, column: Column, network: ThermalNetwork, columns: RecordedColumns, faults: list[str]
) -> None:
    if column.quantity == IGNORE:
        return
    if column.quantity == AUXILIARY:
        _take_auxiliary(file.table[name], name, column, columns)
        return
    values = _numbers(file.table[name], name, columns.rows, faults)
    if values is None:
        return
    used = _used(file, name, column, values, columns, faults)
    if used is None:
        return
    values = used
    dimension = dimension_of(column.quantity)
    unit = file.units.get(name) if column.unit is None else column.unit
    if unit and dimension is not None and unit not in UNITS[dimension]:
        hint = did_you_mean(unit, UNITS[dimension])
        faults.append(f"column {name} has the unit {unit!r}, which is no unit of {dimension}{hint}")
        return
    factor, offset = column.conversion(unit)
    values = without_impossible(column.quantity, name, values * factor + offset, columns.rows, faults, columns.notes)
    columns.names[column.quantity] = name
    if column.quantity in _inputs(network):
        columns.inputs[column.quantity] = values
    else:
        columns.measured[column.quantity] = values
        stated = column.resolution
        columns.resolutions[column.quantity] = resolution_of(values) if stated is None else stated


def _take_auxiliary(cells: pd.Series, name: str, column: Column, columns: RecordedColumns) -> None:
    if pd.api.types.is_numeric_dtype(cells.dtype):
        columns.auxiliary[name] = cells.to_numpy(dtype=np.float64, na_value=np.nan) * column.scale
    elif cells.notna().any():
        columns.notes.append(f"{name[:80]} holds something else than numbers and is not used")


def _used(
    file: RecordingFile, name: str, column: Column, values: Array, columns: RecordedColumns, faults: list[str]
) -> Array | None:
    """Values in the valid range and in the rows that the mapping file names for the column; others are NaN.

    None, and a fault, where the range leaves nothing.
    """
    if column.valid is not None:
        low, high = column.valid
        outside = (values < low) | (values > high)
        if outside.any():
            where = rows_text(columns.rows[outside])
            told = f"{name}: {int(outside.sum())} values outside {low:g} ... {high:g} in {where} left out"
            if not np.isfinite(values[~outside]).any():
                faults.append(
                    f"{told}, so that none is left: the limits 'valid' of its mapping file are in the column's own "
                    "unit, as the numbers stand in the file; correct them"
                )
                return None
            columns.notes.append(told)
        values = np.where(outside, np.nan, values)
    if column.rows is not None and file.clock is not None:
        try:
            parts = [part_of(text) for text in column.rows]
            values = np.where(inside(file.seconds, parts, file.clock, file.first_s), values, np.nan)
        except InputError as error:
            faults.append(f"rows of column {name} in its mapping file: {error}")
    return values


def _numbers(cells: pd.Series, name: str, rows: NDArray[np.int64], faults: list[str]) -> Array | None:
    if pd.api.types.is_bool_dtype(cells.dtype) or pd.api.types.is_datetime64_any_dtype(cells.dtype):
        faults.append(f"{name} holds {cells.dtype} values (rows {rows[0]}-{rows[-1]}), not numbers")
        return None
    if pd.api.types.is_numeric_dtype(cells.dtype):
        return np.asarray(cells.to_numpy(dtype=np.float64, na_value=np.nan))
    numbers = pd.to_numeric(cells.astype(object), errors="coerce")
    wrong = np.flatnonzero((numbers.isna() & cells.notna()).to_numpy(dtype=bool))
    if not len(wrong):
        return np.asarray(numbers.to_numpy(dtype=np.float64, na_value=np.nan))
    cell = str(cells.iloc[int(wrong[0])])[:40]
    advice = "if it stands for a missing value, name it under 'missing' in a mapping file"
    if _comma(cell):
        advice = 'with decimal commas, give csv = { separator = ";", decimal = "," } in a mapping file'
    faults.append(
        f"{name} holds {cell!r} at row {rows[wrong[0]]}, which is no number ({len(wrong)} such cells, "
        f"{rows_text(rows[wrong])}); {advice}"
    )
    return None


def _comma(cell: str) -> bool:
    whole, comma, rest = cell.strip().partition(",")
    return bool(comma) and whole.lstrip("+-").isdigit() and rest.isdigit()


def _add_constants(file: RecordingFile, network: ThermalNetwork, columns: RecordedColumns, faults: list[str]) -> None:
    size = len(columns.seconds)
    for name, value in file.mapping.constants.items():
        if name not in _inputs(network):
            hint = did_you_mean(name, _inputs(network))
            faults.append(f"constant {name!r} of its mapping file is no input of this gearbox{hint}")
        else:
            columns.inputs[name] = without_impossible(
                name, f"constant {name}", np.full(size, value), columns.rows, faults, columns.notes
            )
            columns.names[name] = name
    for name, default in network.inputs.items():
        if name not in columns.inputs:
            columns.inputs[name] = np.full(size, default)
            columns.assumed.append(name)
            columns.notes.append(
                f"{_standard_names(network)[name]} was not recorded; {default:g} is assumed, as the definition says"
            )


# ---------------------------------------------------------------------- cleaning


def _clean(columns: RecordedColumns, gap: float) -> None:
    steady = steady_rows({name: columns.inputs[name] for name in REQUIRED})
    pieces = time_pieces(columns.seconds, gap)
    for values_by_name in (columns.inputs, columns.measured):
        for quantity, values in values_by_name.items():
            if dimension_of(quantity) != "temperature" and quantity != LOSS:
                continue
            wrong = np.concatenate([_impossible_rows(quantity, values[piece], steady[piece]) for piece in pieces])
            if wrong.any():
                values_by_name[quantity] = np.where(wrong, np.nan, values)
                name, where = columns.names.get(quantity, quantity), rows_text(columns.rows[wrong])
                columns.notes.append(f"{name}: {int(wrong.sum())} outliers and dropouts in {where} taken as missing")
    temperatures = {q: values for q, values in columns.measured.items() if q != LOSS}
    for quantity, (first, end, other, moved) in stuck_rows(columns.seconds, temperatures).items():
        hours = (columns.seconds[end - 1] - columns.seconds[first]) / 3600.0
        columns.notes.append(
            f"{columns.names[quantity]} stays at {columns.measured[quantity][first]:g} degC for {hours:.1f} h (rows "
            f"{columns.rows[first]}-{columns.rows[end - 1]}) while {columns.names[other]} moves by {moved:.1f} K; kept"
        )


def _impossible_rows(quantity: str, values: Array, steady: NDArray[np.bool_]) -> NDArray[np.bool_]:
    if quantity != LOSS:
        wrong = dropouts(values)
        return wrong | outliers(np.where(wrong, np.nan, values), least=OUTLIER_K)
    known = np.abs(values[np.isfinite(values)])
    usual = float(np.quantile(known, 0.95)) if len(known) else 0.0
    return outliers(values, least=OUTLIER_OF_LOSS * usual, steady=steady)


def _split(columns: RecordedColumns, gap: float) -> list[str]:
    """Bridge short holes of the inputs, drop rows without inputs, and find the gap-free pieces."""
    time = columns.seconds
    usable = np.ones(len(time), dtype=bool)
    faults: list[str] = []
    partial = []
    for name, values in columns.inputs.items():
        missing = int(np.isnan(values).sum())
        columns.inputs[name], known = bridged(time, values, gap if name in REQUIRED else SLOW_GAPS * gap)
        if missing:
            _note_holes(columns, name, missing, known, gap)
        if known.sum() < FEWEST_ROWS:
            faults.append(
                f"{columns.names.get(name, name)} has only {int(known.sum())} of {len(time)} values that can be used "
                f"(rows {columns.rows[0]}-{columns.rows[-1]})"
            )
        usable &= known
        if not known.all():
            partial.append(columns.names.get(name, name))
    if faults:
        return faults
    if usable.sum() < max(FEWEST_ROWS, LEAST_USABLE * len(usable)):
        rows, names = f"rows {columns.rows[0]}-{columns.rows[-1]}", " and ".join(partial)
        count = int(usable.sum())
        return [f"only {count} of {rows} have {names}; mend the columns, or name the part that has them"]
    _keep(columns, usable)
    time = columns.seconds
    pieces = time_pieces(time, gap)
    columns.segments = tuple(piece for piece in pieces if piece.stop - piece.start > 1)
    if not columns.segments:
        return [f"no two rows are closer than {gap:g} s (max_gap_s); raise it in a mapping file"]
    if len(pieces) > 1:
        cuts = columns.rows[[piece.start for piece in pieces[1:]]]
        columns.notes.append(
            f"{len(cuts)} gaps longer than {gap:g} s split it into {len(pieces)} pieces (before {rows_text(cuts)})"
        )
    return []


def _note_holes(columns: RecordedColumns, name: str, missing: int, known: NDArray[np.bool_], gap: float) -> None:
    lost = columns.rows[~known]
    left = f"; {len(lost)} rows without are left out ({rows_text(lost)})" if len(lost) else ""
    columns.notes.append(
        f"{columns.names.get(name, name)} is missing in {missing} of {len(columns.rows)} rows, bridged where shorter "
        f"than max_gap_s = {gap:g}{left}"
    )


def _keep(columns: RecordedColumns, usable: NDArray[np.bool_]) -> None:
    if usable.all():
        return
    before = columns.seconds[0]
    columns.seconds, columns.rows = columns.seconds[usable], columns.rows[usable]
    if columns.start is not None:
        columns.start += timedelta(seconds=float(columns.seconds[0] - before))
    for arrays in (columns.inputs, columns.measured, columns.auxiliary):
        for name, values in arrays.items():
            arrays[name] = values[usable]
