"""Columns of a file: which quantity each of them is, and its values in the unit inside."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.recordings.cleaning import rows_text
from diagnosis.recordings.header_units import named_with_unit
from diagnosis.recordings.machine import RecordedMachine
from diagnosis.recordings.mapping import AUXILIARY, IGNORE, Column, Csv, RecordingMapping, looks_like_kelvin
from models.base.errors import Problems, did_you_mean
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


def is_measurable(name: str, network: RecordedMachine) -> bool:
    """Return True for ``T_<node>`` (also of one of several sensors, ``T_<node>__<sensor>``) and ``P_loss``."""
    known = {*(f"T_{part.name}" for part in network.parts), TOTAL_LOSS}
    return node_of_channel(name, known) in known


def quantities_of(network: RecordedMachine) -> dict[str, Quantity]:
    """Return the inputs of a network and what can be measured, by name."""
    measured = (quantity_of(name) for name in (*(f"T_{part.name}" for part in network.parts), TOTAL_LOSS))
    known = {q.name: q for q in measured if q is not None}
    return known | {name: given.quantity for name, given in network.inputs.items()}


def match_columns(
    present: Sequence[str],
    time_column: str,
    mapping: RecordingMapping,
    network: RecordedMachine,
    problems: Problems,
    notes: list[str],
) -> dict[str, Column]:
    """Find the quantity of every column: from the mapping, then from the standard names.

    Parameters
    ----------
    present : sequence of str
        Columns of the file
    problems : Problems
        Receives columns that are missing, unknown, named twice or misspelt
    notes : list of str
        Receives the columns that are not used
    """
    roles = _mapped_columns(present, mapping, network, problems)
    taken = {column.channel for column in mapping.columns.values()}
    lacking = _standard_columns(present, mapping, network, roles, problems)
    free = [name for name in present if name not in roles and name not in mapping.columns and name != time_column]
    with_unit = named_with_unit(free, lacking)
    if with_unit:
        shown = ", ".join(f"{name} ({column.quantity} in {column.unit})" for name, column in with_unit.items())
        notes.append(f"taken from the names of columns: {shown}")
        roles |= with_unit
    found = (
        {column.quantity for column in mapping.columns.values()}
        | {column.quantity for column in roles.values()}
        | set(mapping.constants)
    )
    for signal, given in network.inputs.items():
        if given.required and signal not in found and not copies_of(given.column, present):
            shown = ", ".join(other[:40] for other in sorted(present)[:20])
            problems.add(
                f"column {given.column} is missing; it has: {shown}; name another column in a mapping file (quantity = "
                f'"{signal}"), or give constants = {{ {signal} = ... }} there if it was constant'
            )
    rest = [n for n in present if n not in roles and n not in mapping.columns and n != time_column]
    replaced = [known.column for quantity, known in quantities_of(network).items()
              if quantity in taken and known.column in rest]  # fmt: skip
    if replaced:
        notes.append(f"not used, because the mapping takes other columns for them: {', '.join(replaced)}")
    still_lacking = [known for known in lacking if known.name not in found]
    _report_unused([n for n in rest if n not in replaced], still_lacking, problems, notes)
    return roles


def _standard_columns(
    present: Sequence[str], mapping: RecordingMapping, network: RecordedMachine, roles: dict[str, Column],
    problems: Problems,
) -> list[Quantity]:  # fmt: skip
    """Add the columns of standard names that the mapping does not name to `roles`; return quantities without one."""
    taken = {column.channel for column in mapping.columns.values()}
    lacking: list[Quantity] = []
    for quantity, known in quantities_of(network).items():
        name = known.column
        if name in mapping.columns or quantity in taken:
            continue
        if quantity in mapping.constants:
            if name in present:
                problems.add(
                    f"{quantity} is a constant of its mapping file, and column {name} is there as well; leave the "
                    f'constant out, or name the column in the mapping file with quantity = "{IGNORE}"'
                )
        elif name in present:
            roles[name] = Column(quantity=quantity)
        else:
            lacking.append(known)
            copies = copies_of(name, present)
            if copies:
                problems.add(
                    f"column {name} is there twice; remove one, or name the right one in a mapping file as "
                    + " or ".join(repr(copy) for copy in copies)
                )
    return lacking


def _mapped_columns(
    present: Sequence[str], mapping: RecordingMapping, network: RecordedMachine, problems: Problems
) -> dict[str, Column]:
    known = {*quantities_of(network), AUXILIARY, IGNORE}
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
        else:
            roles[name] = column
    for name in mapping.constants:
        if name not in network.inputs:
            hint = did_you_mean(name, network.inputs)
            problems.add(f"constant {name!r} of its mapping file is no input of this gearbox{hint}")
    return roles


def _report_unused(rest: Sequence[str], lacking: Sequence[Quantity], problems: Problems, notes: list[str]) -> None:
    unused = []
    by_column = {known.column: known for known in lacking}
    for name in rest:
        slip = meant(name, by_column, near=NEAR, with_kind=True)
        if slip:
            known = by_column[slip]
            problems.add(
                f"column {name[:80]} is not known; did you mean {slip!r}? Rename it if it is in {known.unit}, or name "
                f'it in a mapping file: quantity = "{known.name}" and its unit, or "{AUXILIARY}" for something else'
            )
        else:
            unused.append(name[:80])
    if unused:
        more = f" and {len(unused) - MOST_NAMED} more" if len(unused) > MOST_NAMED else ""
        notes.append(f"not used, being no input and no node of this gearbox: {', '.join(unused[:MOST_NAMED])}{more}")


def _numbers(cells: pd.Series, name: str, csv: Csv, problems: Problems) -> Array | None:
    """Return a column as numbers, shape (rows,), in the unit of the file; None and a problem if a cell is no number."""
    rows = np.asarray(cells.index) + 1
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
    cells: pd.Series,
    name: str,
    column: Column,
    quantity: Quantity,
    unit_of_file: str | None,
    csv: Csv,
    outside: NDArray[np.bool_],
    problems: Problems,
    notes: list[str],
) -> Array | None:
    """Return the values of an input or a measurement in the unit inside, shape (rows,); NaN where missing.

    Parameters
    ----------
    cells : Series
        Its index counts the rows of the file from 0
    name : str
        Of the column
    column : Column
        What the mapping states of it
    unit_of_file : str or None
        Unit that the file itself names
    csv : Csv
        How texts are written
    outside : array of bool, shape (rows,)
        Rows that the mapping leaves out

    Returns
    -------
    Array or None
        None, and a problem, if the column cannot be used
    """
    values = _numbers(cells, name, csv, problems)
    rows = np.asarray(cells.index) + 1
    if values is None or not _keep_valid(values, name, column, rows, problems, notes):
        return None
    values[outside] = np.nan
    unit = unit_of_file if column.unit is None else column.unit
    units = units_in_files(quantity.dimension, quantity.unit)
    if unit and units and unit not in units:
        problems.add(
            f"column {name} has the unit {unit!r}, which is no unit of {quantity.dimension}{did_you_mean(unit, units)}"
        )
        return None
    factor, offset = units.get(unit, (1.0, 0.0)) if unit else (1.0, 0.0)
    named = units.get(unit_of_file or "", (factor, offset))
    if column.unit is not None and named != (factor, offset):
        notes.append(f"{name}: its unit is {unit}, as in the mapping file; the file itself names {unit_of_file}")
    elif column.unit is None and (factor, offset) != (1.0, 0.0):
        notes.append(f"{name}: its unit is {unit}, as the file names it")
    return _possible(values * (column.scale * factor) + offset, quantity, name, rows, problems, notes)


def _keep_valid(
    values: Array, name: str, column: Column, rows: NDArray[np.int64], problems: Problems, notes: list[str]
) -> bool:
    """Replace values outside ``valid`` of the mapping by NaN; return False, and report it, if none is left."""
    low, high = column.valid or (-np.inf, np.inf)
    outside = (values < low) | (values > high)
    if outside.any():
        where = f"in {rows_text(rows[outside])} left out"
        text = f"{name}: {int(outside.sum())} values outside {low:g} ... {high:g} {where}"
        if not np.isfinite(values[~outside]).any():
            problems.add(
                f"{text}, so that none is left: the limits 'valid' of its mapping file are in the column's own unit, "
                "as the numbers stand in the file; correct them"
            )
            return False
        notes.append(text)
        values[outside] = np.nan
    return True


def _possible(
    values: Array, quantity: Quantity, name: str, rows: NDArray[np.int64], problems: Problems, notes: list[str]
) -> Array:
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
    notes.append(f"{name}: {where} outside {limits} taken as missing")
    return np.where(wrong, np.nan, values)
