"""Mapping file of a recording: the quantity, unit and sensor data of every column.

```toml
schema = 1
max_gap_s = 1800
session = "before the overhaul"        # of its test; between sessions the machine may differ a little
rows = ["2017-08-01..2018-01-12"]     # seconds or ISO 8601; by default all
missing = ["---", "Bad"]              # further texts for a missing value
time = { column = "time_utc", unit = "iso8601" }   # column = ["Date", "Time"]: joined by a space
csv = { separator = ";", decimal = ",", thousands = ".", encoding = "cp1252", skip_lines = [1] }
constants = { T_ambient = 20.0 }      # inputs that were not recorded, in the unit of their standard column

[columns.Gost_avg]
quantity = "T_oil"                    # an input by its name, T_<node>, P_loss, auxiliary or ignore
sensor = "sump_probe"                 # only if several sensors measure one node
unit = "degC"
noise = 0.3                           # white standard deviation of one row, [K] or [W]
resolution = 0.1                      # [K] or [W]
lag_s = 20
lag_sd_s = 10
bias_sd = 1.0                         # tolerance of a temperature or of P_loss, [K] or [W]
valid = [-40, 150]                    # in the unit of the column; values outside are missing

[columns.M1]
quantity = "torque"
gain_sd = 0.002                       # relative tolerance of the scale of torque or P_loss
```

A gearbox definition may contain one (table ``[recording]``), for recordings that have none next to them.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal, Self
from zoneinfo import ZoneInfo

import pandas as pd
from pydantic import Field, field_validator, model_validator

from diagnosis.recordings.names import stem_of
from models.base.errors import InputError, did_you_mean
from models.definition.messages import validate_section
from models.definition.sections import Name, NotNegative, Positive, Section, Text
from models.files import toml_file
from models.files.table_file import UTF_8, TextForm
from models.quantities.quantities import SENSOR, TOTAL_LOSS, Quantity, quantity_of
from models.quantities.units import units_in_files

SCHEMA = 1
FOLDER_FILE = "mapping.toml"
DEFINITION_KEYS = ("stage", "part")  # of a gearbox definition, which is TOML as well
SOME_DATE = datetime(2017, 9, 21, 8, 30, 15, tzinfo=UTC)  # a form of dates gives it back
CLOCK_TIME = "hh:mm:ss"  # unit of times since the start, or of day, as 13:05:00
TIME_UNITS = ("s", "ms", "us", "ns", "min", "h", "d", "iso8601", CLOCK_TIME)
AUXILIARY, IGNORE = "auxiliary", "ignore"  # roles of columns that are no quantity
SCALED = ("torque", TOTAL_LOSS)  # quantities whose scale is calibrated
KELVIN_RANGE = (200.0, 600.0)  # no gearbox has such temperatures in degC all the time


class Column(Section):
    """Table ``[columns.NAME]``: one column of the file."""

    quantity: Name
    sensor: Name | None = None
    unit: str | None = None
    scale: Annotated[float, Field(ge=-1e9, le=1e9)] = 1.0
    noise: Positive | None = None
    resolution: NotNegative | None = None
    lag_s: NotNegative | None = None
    lag_sd_s: Positive | None = None
    bias_sd: Positive | None = None
    gain_sd: Positive | None = None
    valid: tuple[float, float] | None = None
    rows: tuple[str, ...] | None = None
    optional: bool = False

    @property
    def channel(self) -> str:
        """The quantity, with the name of the sensor if it has one: ``T_oil__sump_probe``."""
        return self.quantity if self.sensor is None else f"{self.quantity}{SENSOR}{self.sensor}"

    @model_validator(mode="after")
    def _sensor_measures_a_node(self) -> Self:
        if self.sensor is not None and not (self.quantity.startswith("T_") and len(self.quantity) > 2):
            raise ValueError(f"sensor = {self.sensor!r} names one of several at a node; quantity must be T_<node>")
        return self

    @model_validator(mode="after")
    def _scale_is_calibrated(self) -> Self:
        if self.gain_sd is not None and self.quantity not in SCALED:
            raise ValueError(f"gain_sd is the tolerance of the scale of {' or '.join(SCALED)}, not of {self.quantity}")
        return self

    @field_validator("scale")
    @classmethod
    def _not_zero(cls, value: float) -> float:
        if value == 0.0:
            raise ValueError("0 would wipe the column out; leave it away, or give the factor to its unit")
        return value

    @field_validator("valid")
    @classmethod
    def _ordered(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and not value[0] < value[1]:
            raise ValueError(f"the first number must be below the second, not {value[0]:g}, {value[1]:g}")
        return value

    @model_validator(mode="after")
    def _unit_is_known(self) -> Self:
        known = quantity_of(self.quantity)  # units of inputs that a definition names are checked with the columns
        if known is None or not known.dimension or self.unit is None:
            return self
        units = units_in_files(known.dimension, known.unit)
        if self.unit not in units:
            raise ValueError(f"unit {self.unit!r} is no unit of {known.dimension}{did_you_mean(self.unit, units)}")
        return self


class Time(Section):
    """``[time]``: the column with the time, and its unit, or the form of its dates as ``%d.%m.%Y %H:%M:%S``.

    Without ``unit`` it is that of the header, else s. Two columns with date and time of day are joined by a space.
    ``zone`` is the time zone of dates that state none, as ``Europe/Berlin``; without it they are taken as UTC.
    """

    column: str | tuple[str, ...]
    unit: str | None = None
    zone: str | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the file that hold it."""
        return (self.column,) if isinstance(self.column, str) else self.column

    @property
    def name(self) -> str:
        """Name of the column, of several in one."""
        return " ".join(self.columns)

    @field_validator("zone")
    @classmethod
    def _is_zone(cls, value: str) -> str:
        try:
            ZoneInfo(value)
        except (KeyError, ValueError, OSError):
            raise ValueError(f"{value!r} is no time zone; write it as 'Europe/Berlin' or 'UTC'") from None
        return value

    @field_validator("unit")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is None or value in TIME_UNITS:
            return value
        try:
            read = pd.to_datetime(SOME_DATE.strftime(value), format=value)
        except (ValueError, re.error):
            read = None
        if read is None or read.date() != SOME_DATE.date():
            units = ", ".join(TIME_UNITS)
            raise ValueError(f"{value!r} is not one of {units}, nor a form of dates, as '%d.%m.%Y %H:%M:%S'")
        return value


class Csv(Section):
    """``[csv]``: how a text file is written."""

    separator: Annotated[str, Field(min_length=1, max_length=1)] = ","
    decimal: Literal[".", ","] = "."
    thousands: Annotated[str, Field(max_length=1)] = ""
    encoding: str = UTF_8
    skip_lines: tuple[Annotated[int, Field(ge=1)], ...] = ()

    @field_validator("encoding")
    @classmethod
    def _known(cls, value: str) -> str:
        try:
            "".encode(value)
        except LookupError:
            raise ValueError(f"{value!r} is no encoding of text; utf-8, cp1252, latin-1 and utf-16 are usual") from None
        return UTF_8 if codecs.lookup(value).name == "utf-8" else value

    @field_validator("separator")
    @classmethod
    def _usable(cls, value: str) -> str:
        if value.isalnum() or value in "\"'\r\n.-+#\0" or not value.isascii():
            raise ValueError(f"{value!r} cannot separate columns; use ',', ';', a tab or '|'")
        return value

    @field_validator("thousands")
    @classmethod
    def _groups(cls, value: str) -> str:
        if value.isalnum() or value in ("+", "-", '"'):
            raise ValueError(f"{value!r} cannot stand between groups of digits; '.', ',', an apostrophe or a space can")
        return value

    @model_validator(mode="after")
    def _signs_differ(self) -> Self:
        if self.thousands == self.decimal:
            raise ValueError("thousands and decimal are the same sign; state both, as decimal = ',', thousands = '.'")
        return self


class RecordingMapping(Section):
    """A mapping file; without one every column has its standard name and unit."""

    schema_: Annotated[Literal[1], Field(alias="schema")] = 1
    time: Time | None = None
    csv: Csv = Csv()
    missing: tuple[str, ...] = ()
    max_gap_s: Positive | None = None
    session: Text | None = None
    rows: tuple[str, ...] | None = None
    constants: dict[Name, float] = Field(default_factory=dict)
    columns: dict[str, Column] = Field(default_factory=dict)

    @field_validator("constants")
    @classmethod
    def _in_their_unit(cls, values: dict[str, float]) -> dict[str, float]:
        faults = [fault for name, value in values.items() for fault in _constant_faults(name, value)]
        if faults:
            raise ValueError("; ".join(faults))
        return values

    @model_validator(mode="after")
    def _quantities_are_unique(self) -> Self:
        by_quantity: dict[str, str] = {}
        faults = []
        for name, column in self.columns.items():
            quantity = column.quantity
            if quantity in self.constants:
                faults.append(f"{quantity} is a constant and the column {name!r}; keep one")
            if column.channel in by_quantity:
                faults.append(
                    f"columns {by_quantity[column.channel]!r} and {name!r} are both {quantity}; keep one, or give each "
                    "sensor at the node a name (sensor = ...)"
                )
            elif quantity not in (AUXILIARY, IGNORE):
                by_quantity[column.channel] = name
        if faults:
            raise ValueError("; ".join(faults))
        return self

    @property
    def text_form(self) -> TextForm:
        """Form of its CSV files."""
        texts = self.time.columns if self.time is not None and "%" in (self.time.unit or "") else ()
        return TextForm(**dict(self.csv), missing=self.missing, texts=texts, units_below=True)


def looks_like_kelvin(quantity: Quantity, lowest: float, highest: float) -> bool:
    """Return True if values from `lowest` to `highest` in degC are a temperature in kelvin.

    Examples
    --------
    >>> from models.quantities.quantities import quantity_of
    >>> looks_like_kelvin(quantity_of("T_oil"), 293.0, 361.0), looks_like_kelvin(quantity_of("T_oil"), 20.0, 90.0)
    (True, False)
    """
    return quantity.is_temperature and quantity.unit == "degC" and KELVIN_RANGE[0] < lowest <= highest < KELVIN_RANGE[1]


def _constant_faults(name: str, value: float) -> Iterator[str]:
    possible = quantity_of(name)
    if possible is None:
        return
    if looks_like_kelvin(possible, value, value):
        yield f"{name} = {value:g} looks like kelvin, but constants are in degC; write {value - 273.15:g}"
    elif not possible.low <= value <= possible.high:
        limits = f"{possible.low:g} to {possible.high:g} {possible.unit}"
        yield f"{name} = {value:g} {possible.unit} is not possible; {limits} is, and constants have that unit"


def read_mapping(path: Path) -> RecordingMapping:
    """Read a mapping file.

    Raises
    ------
    InputError
        With all its faults: not TOML, unknown keys, wrong types and units, quantities named twice.
    """
    values = toml_file.parse(toml_file.read_text(path), file=str(path))
    if "schema" not in values:
        raise InputError(f"{path}: has no 'schema = {SCHEMA}'; begin a mapping file with that line")
    return validate_section(RecordingMapping, values, file=str(path))


def mapping_beside(recording: Path) -> RecordingMapping | None:
    """Read the mapping file next to a recording; None without one. See :func:`mapping_file`."""
    found = mapping_file(recording)
    return None if found is None else read_mapping(found)


def mapping_file(recording: Path) -> Path | None:
    """Return the mapping file next to a recording: ``<stem>.toml``, else ``mapping.toml``; None without one.

    A gearbox definition that has the stem of the recording is not a mapping file.
    """
    own, shared = recording.with_name(f"{stem_of(recording)}.toml"), recording.with_name(FOLDER_FILE)
    if own.is_file():
        values = toml_file.parse(toml_file.read_text(own), file=str(own))
        if not any(key in values for key in DEFINITION_KEYS):
            return own
    return shared if shared.is_file() else None


def mapping_of_definition(values: Mapping[str, Any]) -> RecordingMapping:
    """Return the mapping in the table ``[recording]`` of a gearbox definition; an empty one if that is empty.

    Raises
    ------
    InputError
        With all its faults.
    """
    table = toml_file.with_tuples(dict(values))
    return validate_section(RecordingMapping, table, file="[recording] of the gearbox definition")


def reduced_to(mapping: RecordingMapping, columns: Iterable[str], *, of_definition: bool) -> RecordingMapping:
    """Leave out columns that a file does not have and need not have.

    Parameters
    ----------
    columns : iterable of str
        Of the file
    of_definition : bool
        True for the mapping of a gearbox definition, which names what such files may hold; else each column states
        whether it is optional
    """
    present = set(columns)
    kept = {name: column for name, column in mapping.columns.items()
            if name in present or not (of_definition or column.optional)}  # fmt: skip
    lacks_time = of_definition and mapping.time is not None and not present.issuperset(mapping.time.columns)
    return mapping.model_copy(update={"columns": kept, "time": None if lacks_time else mapping.time})
