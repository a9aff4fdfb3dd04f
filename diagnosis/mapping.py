"""The mapping file of a recording: which column is which quantity, in which unit, and what its sensor is like.

```toml
schema = 1
max_gap_s = 1800
rows = ["2017-08-01..2018-01-12"]     # seconds or ISO 8601; by default all
missing = ["---", "Bad"]              # further texts for a missing value
time = { column = "time_utc", unit = "iso8601" }
csv = { separator = ";", decimal = "," }
constants = { T_ambient = 20.0 }      # inputs that were not recorded, in their unit inside: 1/min, N m, degC, m/s

[columns.Gost_avg]
quantity = "T_oil"                    # speed, torque, T_ambient, air_speed, T_<node>, P_loss, auxiliary or ignore
unit = "degC"
noise = 0.3                           # white standard deviation of one row, [K] or [W]
resolution = 0.1                      # [K] or [W]
lag_s = 20
lag_sd_s = 10
bias_sd = 1.0                         # tolerance of the sensor, [K] or [W]
valid = [-40, 150]                    # in the unit of the column; what lies outside is missing
```

A gearbox definition may bring one along (table ``[recording]``), for recordings that have none beside them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from models import toml_file
from models.cycle import COLUMNS
from models.definition import Name, Section
from models.errors import InputError, did_you_mean
from models.faults import validated
from models.table_file import TextForm

SCHEMA = 1
FOLDER_FILE = "mapping.toml"
DEFINITION_KEYS = ("stage", "part")  # of a gearbox definition, which is TOML as well
LOSS = "P_loss"  # the measured total loss, beside the temperatures ``T_<node>``
AUXILIARY, IGNORE = "auxiliary", "ignore"
CERTAINLY_KELVIN = (200.0, 600.0)  # temperatures that no gearbox has in degC

# dimension -> unit as files write it -> (factor, offset) to the unit inside. The first unit is that inside.
UNITS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "time": {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "min": (60.0, 0.0), "h": (3600.0, 0.0), "d": (86400.0, 0.0)},
    "speed": {
        "1/min": (1.0, 0.0), "rpm": (1.0, 0.0), "min^-1": (1.0, 0.0), "rad/s": (30.0 / pi, 0.0), "1/s": (60.0, 0.0),
        "Hz": (60.0, 0.0), "deg/s": (1.0 / 6.0, 0.0),
    },
    "torque": {
        "N m": (1.0, 0.0), "N.m": (1.0, 0.0), "Nm": (1.0, 0.0), "kN m": (1e3, 0.0), "kN.m": (1e3, 0.0),
        "kNm": (1e3, 0.0), "N mm": (1e-3, 0.0), "lbf ft": (1.3558179483314, 0.0), "lbf in": (0.1129848290276, 0.0),
    },
    "temperature": {
        "degC": (1.0, 0.0), "°C": (1.0, 0.0), "C": (1.0, 0.0), "K": (1.0, -273.15),
        "degF": (5.0 / 9.0, -160.0 / 9.0), "°F": (5.0 / 9.0, -160.0 / 9.0), "F": (5.0 / 9.0, -160.0 / 9.0),
    },
    "air speed": {"m/s": (1.0, 0.0), "km/h": (1.0 / 3.6, 0.0), "mph": (0.44704, 0.0), "ft/s": (0.3048, 0.0)},
    "power": {"W": (1.0, 0.0), "kW": (1e3, 0.0), "MW": (1e6, 0.0), "mW": (1e-3, 0.0), "hp": (745.69987, 0.0)},
}  # fmt: skip
ISO = "iso8601"

Positive = Annotated[float, Field(gt=0.0, le=1e9)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]


def dimension_of(quantity: str) -> str | None:
    """Dimension of a quantity, None where any unit may stand.

    Examples
    --------
    >>> dimension_of("T_oil"), dimension_of("P_loss"), dimension_of("oil_flow")
    ('temperature', 'power', None)
    """
    if quantity in ("speed", "torque"):
        return quantity
    named = {"air_speed": "air speed", LOSS: "power"}
    return "temperature" if quantity.startswith("T_") else named.get(quantity)


class Column(Section):
    """One column of the file."""

    quantity: Name
    unit: str | None = None
    scale: Annotated[float, Field(ge=-1e9, le=1e9)] = 1.0
    noise: Positive | None = None
    resolution: NotNegative | None = None
    lag_s: NotNegative | None = None
    lag_sd_s: NotNegative | None = None
    bias_sd: NotNegative | None = None
    valid: tuple[float, float] | None = None
    rows: tuple[str, ...] | None = None

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
        dimension = dimension_of(self.quantity)
        if dimension is None or self.quantity in (AUXILIARY, IGNORE):
            return self
        units = UNITS[dimension]
        if self.unit is not None and self.unit not in units:
            raise ValueError(f"unit {self.unit!r} is no unit of {dimension}{did_you_mean(self.unit, units)}")
        return self

    def conversion(self, unit_of_file: str | None) -> tuple[float, float]:
        """Factor and offset from the numbers of the file to the unit inside; `scale` comes first."""
        units = UNITS.get(dimension_of(self.quantity) or "", {})
        unit = self.unit if self.unit is not None else unit_of_file
        factor, offset = units.get(unit or "", (1.0, 0.0))
        return self.scale * factor, offset


class Time(Section):
    """``[time]``: the column with the time, and its unit."""

    column: str
    unit: Literal["s", "ms", "min", "h", "d", "iso8601"] = "s"


class Csv(Section):
    """``[csv]``: how a text file is written."""

    separator: Annotated[str, Field(min_length=1, max_length=1)] = ","
    decimal: Literal[".", ","] = "."

    @field_validator("separator")
    @classmethod
    def _usable(cls, value: str) -> str:
        if value.isalnum() or value in "\"'\r\n.-+#\0" or not value.isascii():
            raise ValueError(f"{value!r} cannot separate columns; use ',', ';', a tab or '|'")
        return value

    @model_validator(mode="after")
    def _signs_differ(self) -> Self:
        if self.separator == self.decimal:
            raise ValueError("separator and decimal are the same sign; with decimal ',' columns are separated by ';'")
        return self


class RecordingMapping(Section):
    """A mapping file; without one every column has its standard name and unit."""

    schema_: Annotated[Literal[1], Field(alias="schema")] = 1
    time: Time | None = None
    csv: Csv = Csv()
    missing: tuple[str, ...] = ()
    max_gap_s: Positive | None = None
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
            if quantity in by_quantity:
                faults.append(f"columns {by_quantity[quantity]!r} and {name!r} are both {quantity}; keep one")
            elif quantity not in (AUXILIARY, IGNORE):
                by_quantity[quantity] = name
        if faults:
            raise ValueError("; ".join(faults))
        return self

    @property
    def text_form(self) -> TextForm:
        """How its CSV files are written."""
        return TextForm(separator=self.csv.separator, decimal=self.csv.decimal, missing=self.missing, by_mapping=True)


def _constant_faults(name: str, value: float) -> Iterator[str]:
    if dimension_of(name) == "temperature" and CERTAINLY_KELVIN[0] < value < CERTAINLY_KELVIN[1]:
        yield f"{name} = {value:g} is kelvin by its size, but constants are in degC; write {value - 273.15:g}"
    elif name in COLUMNS:
        _, low, high, text = COLUMNS[name]
        unit = text.partition(";")[0]
        if not low <= value <= high:
            yield (
                f"{name} = {value:g} {unit} is not possible; {low:g} to {high:g} {unit} is, and constants have that "
                "unit"
            )


def read_mapping(path: Path) -> RecordingMapping:
    """Read a mapping file.

    Raises
    ------
    InputError
        With all its faults: not TOML, unknown keys, wrong types and units, quantities named twice.
    """
    values = toml_file.parse(toml_file.read_text(path), file=str(path))
    if "schema" not in values:
        raise InputError(f"{path}: has no 'schema = {SCHEMA}', so it is not known to be a mapping file of this version")
    return validated(RecordingMapping, _with_tuples(values), file=str(path))


def _with_tuples(node: Any) -> Any:
    if isinstance(node, list):
        return tuple(_with_tuples(item) for item in node)
    return {key: _with_tuples(item) for key, item in node.items()} if isinstance(node, dict) else node


def mapping_beside(recording: Path, stem: str) -> RecordingMapping | None:
    """The mapping of a recording: ``<stem>.toml`` beside it, else ``mapping.toml`` there, else None.

    A gearbox definition that happens to have the stem of the recording is none.
    """
    own, shared = recording.with_name(f"{stem}.toml"), recording.with_name(FOLDER_FILE)
    if own.is_file():
        values = toml_file.parse(toml_file.read_text(own), file=str(own))
        if not any(key in values for key in DEFINITION_KEYS):
            return read_mapping(own)
    return read_mapping(shared) if shared.is_file() else None


def mapping_of_definition(values: Mapping[str, Any]) -> RecordingMapping:
    """The mapping that a gearbox definition brings along in its table ``[recording]``; standard names without one.

    Raises
    ------
    InputError
        With all its faults.
    """
    if not values:
        return RecordingMapping()
    return validated(RecordingMapping, _with_tuples(dict(values)), file="[recording] of the gearbox definition")


def as_far_as_present(mapping: RecordingMapping, columns: Iterable[str]) -> RecordingMapping:
    """The same without the columns that a file does not have: a definition names what such files may hold."""
    present = set(columns)
    kept = {name: column for name, column in mapping.columns.items() if name in present}
    time = mapping.time if mapping.time is not None and mapping.time.column in present else None
    return mapping.model_copy(update={"columns": kept, "time": time})
