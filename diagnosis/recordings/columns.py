"""Columns of a file: which quantity each of them is, and its values in the unit inside."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.recordings.cleaning import rows_text
from diagnosis.recordings.file import RecordingFile
from diagnosis.recordings.header_units import named_with_unit
from diagnosis.recordings.machine import RecordedMachine
from diagnosis.recordings.mapping import AUXILIARY, IGNORE, Column, Csv, looks_like_kelvin
from models.base.errors import did_you_mean
from models.base.types import Array
from models.files.numbers import numbers_of
from models.files.table_file import copies_of
from models.quantities.column_names import meant
from models.quantities.quantities import TOTAL_LOSS, Quantity, node_of_channel, quantity_of
from models.quantities.units import units_in_files

NEAR = 0.85  # likeness of names that makes one a slip of the other
MOST_NAMED = 12  # unused columns in a note
FEW = 0.01  # share of rows that may be impossible
MOST_TEXTS = 10  # that may mean a missing value, in a message
# Groups of three digits, and decimals behind another sign: 1,500.0  1.500,0  1'500  1 500
THOUSANDS = re.compile(
    r"[+-]?\d{1,3}(?:(?P<comma>,)\d{3}(,\d{3})*(\.\d*)?|(?P<point>\.)\d{3}(\.\d{3})*(,\d*)?"
    r"|(?P<other>['\u2019\s])\d{3}((?P=other)\d{3})*([.,]\d*)?)"
)
CODES, CODED = 3, 0.5  # so many different impossible values, in up to this share of rows, are codes of a logger


def is_measurable(name: str, machine: RecordedMachine) -> bool:
    """Return True for ``T_<node>`` (also of one of several sensors, ``T_<node>__<sensor>``) and ``P_loss``."""
    known = {*(f"T_{part.name}" for part in machine.parts), TOTAL_LOSS}
    return node_of_channel(name, known) in known


def quantities_of(machine: RecordedMachine) -> dict[str, Quantity]:
    """Return the inputs of a machine and what can be measured, by name."""
    measured = (quantity_of(name) for name in (*(f"T_{part.name}" for part in machine.parts), TOTAL_LOSS))
    known = {q.name: q for q in measured if q is not None}
    return known | {name: given.quantity for name, given in machine.inputs.items()}


def match_columns(file: RecordingFile, present: Sequence[str], machine: RecordedMachine) -> dict[str, Column]:
    """Find the quantity of every column: from the mapping, then from the standard names, then from names with units.

    Columns that are missing, unknown, named twice or misspelt are problems of the file; those that are not used are
    notes.
    """
    mapping, problems, known = file.mapping, file.problems, quantities_of(machine)
    roles = _mapped_columns(file, present, machine)
    lacking = _standard_columns(file, present, known, roles)
    time = file.clock.column if file.clock is not None else ""
    rest = [name for name in present if name not in roles and name not in mapping.columns and name != time]
    with_unit = named_with_unit(rest, lacking)
    if with_unit:
        shown = ", ".join(f"{name} ({column.quantity} in {column.unit})" for name, column in with_unit.items())
        file.notes.append(f"taken from the names of columns: {shown}")
        roles |= with_unit
        rest = [name for name in rest if name not in with_unit]
    found = {column.quantity for column in (*mapping.columns.values(), *roles.values())} | set(mapping.constants)
    for signal, given in machine.inputs.items():
        if given.required and signal not in found and not copies_of(given.column, present):
            shown = ", ".join(other[:40] for other in sorted(present)[:20])
            problems.add(
                f"column {given.column} is missing; it has: {shown}; name another column in a mapping file (quantity = "
                f'"{signal}"), or give constants = {{ {signal} = ... }} there if it was constant'
            )
    taken = {column.channel for column in mapping.columns.values()}
    replaced = [quantity.column for name, quantity in known.items() if name in taken and quantity.column in rest]
    if replaced:
        file.notes.append(f"not used, because the mapping takes other columns for them: {', '.join(replaced)}")
    still_lacking = [quantity for quantity in lacking if quantity.name not in found]
    _report_unused(file, [name for name in rest if name not in replaced], still_lacking)
    return roles


def _standard_columns(
    file: RecordingFile, present: Sequence[str], known: Mapping[str, Quantity], roles: dict[str, Column]
) -> list[Quantity]:
    """Add the columns of standard names that the mapping does not name to `roles`; return quantities without one."""
    mapping, problems = file.mapping, file.problems
    taken = {column.channel for column in mapping.columns.values()}
    lacking: list[Quantity] = []
    for quantity in known.values():
        name = quantity.column
        if name in mapping.columns or quantity.name in taken:
            continue
        if quantity.name in mapping.constants:
            if name in present:
                problems.add(
                    f"{quantity.name} is a constant of its mapping file, and column {name} is there as well; leave the "
                    f'constant out, or name the column in the mapping file with quantity = "{IGNORE}"'
                )
        elif name in present:
            roles[name] = Column(quantity=quantity.name)
        else:
            lacking.append(quantity)
            copies = copies_of(name, present)
            if copies:
                problems.add(
                    f"column {name} is there twice; remove one, or name the right one in a mapping file as "
                    + " or ".join(repr(copy) for copy in copies)
                )
    return lacking


def _mapped_columns(file: RecordingFile, present: Sequence[str], machine: RecordedMachine) -> dict[str, Column]:
    mapping, problems = file.mapping, file.problems
    known = {*quantities_of(machine), AUXILIARY, IGNORE}
    roles: dict[str, Column] = {}
    for name, column in mapping.columns.items():
        if name not in present:
            problems.add(
                f"column {name} of its mapping file is missing{did_you_mean(name, present)}; if only some of the files "
                "have it, state optional = true for it"
            )
        elif column.quantity not in known:
            problems.add(
                f"column {name} is {column.quantity!r} in its mapping file, which this gearbox does not have"
                + did_you_mean(column.quantity, known)
            )
        elif column.sensor is not None and column.quantity in machine.inputs:
            problems.add(
                f"column {name} has sensor = {column.sensor!r} in its mapping file, but {column.quantity} is an input "
                f'and has one column; leave sensor out there, and name further ones with quantity = "{AUXILIARY}"'
            )
        else:
            roles[name] = column
    for name in mapping.constants:
        if name not in machine.inputs:
            hint = did_you_mean(name, machine.inputs)
            problems.add(f"constant {name!r} of its mapping file is no input of this gearbox{hint}")
    return roles


def _report_unused(file: RecordingFile, rest: Sequence[str], lacking: Sequence[Quantity]) -> None:
    unused = []
    by_column = {known.column: known for known in lacking}
    for name in rest:
        slip = meant(name, by_column, near=NEAR, with_kind=True)
        if slip:
            known = by_column[slip]
            file.problems.add(
                f"column {name[:80]} is not known; did you mean {slip!r}? Rename it if it is in {known.unit}, or name "
                f'it in a mapping file: quantity = "{known.name}" and its unit, or "{AUXILIARY}" for something else'
            )
        else:
            unused.append(name[:80])
    if unused:
        more = f" and {len(unused) - MOST_NAMED} more" if len(unused) > MOST_NAMED else ""
        file.notes.append(
            f"not used, being no input and no node of this gearbox: {', '.join(unused[:MOST_NAMED])}{more}"
        )


def _numbers(file: RecordingFile, cells: pd.Series, name: str) -> Array | None:
    """Return a column as numbers, shape (rows,), in the unit of the file; None and a problem if a cell is no number."""
    rows, csv, problems = np.asarray(cells.index) + 1, file.mapping.csv, file.problems
    if pd.api.types.is_bool_dtype(cells.dtype) or pd.api.types.is_datetime64_any_dtype(cells.dtype):
        problems.add(f"{name} holds {cells.dtype} values (rows {rows[0]}-{rows[-1]}), not numbers")
        return None
    values = numbers_of(cells, decimal=csv.decimal, thousands=csv.thousands)
    wrong = np.flatnonzero(np.isnan(values) & cells.notna().to_numpy(dtype=bool))
    if not len(wrong):
        return values
    texts = [str(cell).strip()[:40] for cell in cells.iloc[wrong].unique()[:MOST_TEXTS]]
    others = cells[np.isfinite(values)].astype(str)
    is_mixed = bool(others.str.contains(csv.decimal, regex=False).any())
    problems.add(
        f"{name} holds {str(cells.iloc[int(wrong[0])])[:40]!r} at row {rows[wrong[0]]}, which is no number "
        f"({len(wrong)} such cells, {rows_text(rows[wrong])}); {_advice(texts[0], csv, texts, is_mixed=is_mixed)}"
    )
    return None


def _advice(text: str, csv: Csv, texts: Sequence[str], *, is_mixed: bool) -> str:
    """Return what to do about cells that are no numbers, among others with the stated decimal sign or not."""
    grouped = THOUSANDS.fullmatch(text)
    if grouped:
        sign = next(filter(None, grouped.group("comma", "point", "other")))
        may_be = sign in ",." and csv.decimal not in text and not is_mixed
        either = f', or decimal = "{sign}" if that is its decimal sign' if may_be else ""
        stated = f'csv = {{ thousands = "{sign}" }} in a mapping file{either}'
        return f"write numbers without thousands separators, or give {stated}"
    if re.fullmatch(r"[+-]?\d+[.,]\d+", text) and csv.decimal not in text:
        if is_mixed:
            return "decimal commas and decimal points are mixed; write all numbers alike"
        if csv.decimal == ".":
            return 'its decimal sign is a comma: give csv = { decimal = "," } in a mapping file'
        return 'its decimal sign is a point: leave out decimal = ","'
    if re.match(r"[+-]?\d+([.,]\d+)?\s*[^\d\s.,:/-]{1,5}$", text):
        return "write the unit in the header or in a mapping file, not in the cells"
    named = ", ".join(f'"{text}"' for text in texts if not re.search(r"\d", text)) or f'"{text}"'
    return f"if it means a missing value, give missing = [{named}] in a mapping file"


def quantity_values(
    file: RecordingFile, cells: pd.Series, name: str, column: Column, quantity: Quantity, outside: NDArray[np.bool_]
) -> Array | None:
    """Return the values of an input or a measurement in the unit inside, shape (rows,); NaN where missing.

    Parameters
    ----------
    file : RecordingFile
        Receives problems and notes
    cells : Series
        Its index counts the rows of the file from 0
    name : str
        Of the column
    column : Column
        What the mapping states of it
    outside : array of bool, shape (rows,)
        Rows that the mapping leaves out

    Returns
    -------
    Array or None
        None, and a problem, if the column cannot be used
    """
    values, rows, notes = _numbers(file, cells, name), np.asarray(cells.index) + 1, file.notes
    if values is None or not _keep_valid(file, values, name, column, rows):
        return None
    values[outside] = np.nan
    unit_of_file = file.units.get(name)
    unit = unit_of_file if column.unit is None else column.unit
    units = units_in_files(quantity.dimension, quantity.unit)
    if unit and units and unit not in units:
        file.problems.add(
            f"column {name} has the unit {unit!r}, which is no unit of {quantity.dimension}{did_you_mean(unit, units)}"
        )
        return None
    factor, offset = units.get(unit, (1.0, 0.0)) if unit else (1.0, 0.0)
    named = units.get(unit_of_file or "", (factor, offset))
    if column.unit is not None and named != (factor, offset):
        notes.append(f"{name}: its unit is {unit}, as in the mapping file; the file itself names {unit_of_file}")
    elif column.unit is None and (factor, offset) != (1.0, 0.0):
        notes.append(f"{name}: its unit is {unit}, as the file names it")
    return _possible(file, values * (column.scale * factor) + offset, quantity, name, rows)


def _keep_valid(file: RecordingFile, values: Array, name: str, column: Column, rows: NDArray[np.int64]) -> bool:
    """Replace values outside ``valid`` of the mapping by NaN; return False, and report it, if none is left."""
    low, high = column.valid or (-np.inf, np.inf)
    outside = (values < low) | (values > high)
    if outside.any():
        where = f"in {rows_text(rows[outside])} left out"
        text = f"{name}: {int(outside.sum())} values outside {low:g} ... {high:g} {where}"
        if not np.isfinite(values[~outside]).any():
            file.problems.add(
                f"{text}, so that none is left: the limits 'valid' of its mapping file are in the column's own unit, "
                "as the numbers stand in the file; correct them"
            )
            return False
        file.notes.append(text)
        values[outside] = np.nan
    return True


def _possible(file: RecordingFile, values: Array, quantity: Quantity, name: str, rows: NDArray[np.int64]) -> Array:
    """Replace impossible values by NaN; many of them, or none possible, are a problem.

    Parameters
    ----------
    values : Array, shape (rows,)
        In the unit inside; NaN where missing
    name : str
        Its column
    rows : array of int, shape (rows,)
        Numbers of the rows, for messages
    """
    problems = file.problems
    infinite = np.flatnonzero(np.isinf(values))
    if len(infinite):
        problems.add(
            f"{name} is {values[infinite[0]]} in {rows_text(rows[infinite])}; leave a cell empty where the value is "
            f'unknown, or give missing = ["inf", "-inf"] in a mapping file'
        )
        return values
    good = values[np.isfinite(values)]
    if not len(good):
        problems.add(
            f"{name} has no value in any of its {len(values)} rows; mend it, remove it, or give it "
            f'quantity = "{IGNORE}" in a mapping file'
        )
        return values
    if looks_like_kelvin(quantity, good.min(), good.max()):
        problems.add(
            f"{name} is {good.min():g} to {good.max():g} (rows {rows[0]}-{rows[-1]}): looks like kelvin, not degC; "
            'subtract 273.15, or give unit = "K" in a mapping file'
        )
        return values
    wrong = np.isfinite(values) & ((values < quantity.low) | (values > quantity.high))
    count = int(wrong.sum())
    if not count:
        return values
    first = int(np.flatnonzero(wrong)[0])
    where = f"{count} of {len(values)} values ({rows_text(rows[wrong])})"
    limits = f"{quantity.low:g} ... {quantity.high:g} {quantity.unit}"
    is_code = len(np.unique(values[wrong])) <= CODES and count <= CODED * len(good)
    if count > max(FEW * len(good), 1) and not is_code:
        hint = "; looks like kelvin" if looks_like_kelvin(quantity, values[first], values[first]) else ""
        problems.add(
            f"{name} is {values[first]:g} at row {rows[first]}, and {where} lie outside {limits}, which is possible"
            f"{hint}; give its unit, or the valid range, in a mapping file"
        )
        return values
    file.notes.append(f"{name}: {where} outside {limits} taken as missing")
    return np.where(wrong, np.nan, values)
