"""The table of units: symbols, aliases, conversion to SI, and what FMI needs to define them.

The network, the laws and all files work in the units inside (:data:`INSIDE`: 1/min, degC and otherwise SI); the FMI
interface is in SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import pi

from models.base.errors import InputError

KELVIN = 273.15
INSIDE: Mapping[str, str] = {
    "time": "s", "speed": "1/min", "torque": "N m", "temperature": "degC", "air speed": "m/s", "power": "W",
    "ratio": "1", "volume flow": "m3/s", "mass flow": "kg/s", "pressure": "Pa",
}  # fmt: skip


def behind_a_number(symbol: str) -> str:
    """A unit as it stands behind a number, with a space; nothing for the unit 1.

    Examples
    --------
    >>> f"0.6{behind_a_number('1')}, 5{behind_a_number('W/K')}"
    '0.6, 5 W/K'
    """
    return "" if symbol == "1" else f" {symbol}"


@dataclass(frozen=True, kw_only=True)
class Unit:
    """A unit.

    Attributes
    ----------
    symbol : str
        As FMI writes it
    aliases : tuple of str
        Other spellings in files and definitions
    dimension : str
        Key of :data:`INSIDE`; empty if no quantity of a file has it
    factor, offset : float
        Value in SI = factor * value + offset
    base : mapping of SI base unit to exponent, or None
        As in the attributes of an FMI ``BaseUnit``; None if no FMU uses the unit
    display : (str, float, float) or None
        Unit in which tools show it, and factor and offset to that
    """

    symbol: str
    aliases: tuple[str, ...] = ()
    dimension: str = ""
    factor: float = 1.0
    offset: float = 0.0
    base: Mapping[str, int] | None = None
    display: tuple[str, float, float] | None = None

    @cached_property
    def to_column(self) -> tuple[float, float]:
        """Factor and offset to the unit inside, which file columns have too."""
        if not self.dimension:
            return 1.0, 0.0
        return conversion(self, find_unit(INSIDE[self.dimension], self.dimension))


_POWER = {"kg": 1, "m": 2, "s": -3}
_ENERGY = {"kg": 1, "m": 2, "s": -2}
TABLE: tuple[Unit, ...] = (
    Unit(symbol="rad/s", dimension="speed", base={"rad": 1, "s": -1}, display=("rpm", 30.0 / pi, 0.0)),
    Unit(symbol="N.m", aliases=("N m", "Nm", "N·m", "N*m"), dimension="torque", base=_ENERGY),
    Unit(
        symbol="K",
        aliases=("degK", "°K", "Kelvin", "kelvin"),
        dimension="temperature",
        base={"K": 1},
        display=("degC", 1.0, -KELVIN),
    ),
    Unit(symbol="m/s", dimension="air speed", base={"m": 1, "s": -1}),
    Unit(symbol="W", dimension="power", base=_POWER, display=("kW", 1e-3, 0.0)),
    Unit(symbol="1", aliases=("-", ""), dimension="ratio", base={}),
    Unit(symbol="m3/s", dimension="volume flow", base={"m": 3, "s": -1}, display=("l/min", 6e4, 0.0)),
    Unit(symbol="kg/s", dimension="mass flow", base={"kg": 1, "s": -1}),
    Unit(symbol="Pa", dimension="pressure", base={"kg": 1, "m": -1, "s": -2}, display=("bar", 1e-5, 0.0)),
    # Of a vehicle.
    Unit(symbol="m", base={"m": 1}),
    Unit(symbol="m2", base={"m": 2}),
    Unit(symbol="kg", base={"kg": 1}),
    Unit(symbol="kg.m2", base={"kg": 1, "m": 2}),
    Unit(symbol="J", base=_ENERGY, display=("kJ", 1e-3, 0.0)),
    # Units of parameters, which stay as the law has them.
    Unit(symbol="s", dimension="time", base={"s": 1}),
    Unit(symbol="1/s", base={"s": -1}),
    Unit(symbol="W/K", aliases=("W K^-1",), base=_POWER | {"K": -1}),
    Unit(symbol="J/K", base=_ENERGY | {"K": -1}),
    Unit(symbol="1/K", base={"K": -1}),
    Unit(
        symbol="degC", aliases=("°C", "C", "℃", "deg C", "Deg C"), dimension="temperature", offset=KELVIN, base={"K": 1}
    ),
    Unit(
        symbol="1/min",
        aliases=("rpm", "min^-1", "min-1", "U/min", "RPM", "r/min", "rev/min"),
        dimension="speed",
        factor=pi / 30.0,
        base={"rad": 1, "s": -1},
    ),
    # Only of files.
    Unit(symbol="Hz", aliases=("1/s",), dimension="speed", factor=2.0 * pi),
    Unit(symbol="deg/s", dimension="speed", factor=pi / 180.0),
    Unit(symbol="kN.m", aliases=("kN m", "kNm"), dimension="torque", factor=1e3),
    Unit(symbol="N mm", dimension="torque", factor=1e-3),
    Unit(symbol="lbf ft", dimension="torque", factor=1.3558179483314),
    Unit(symbol="lbf in", dimension="torque", factor=0.1129848290276),
    Unit(
        symbol="degF",
        aliases=("°F", "F", "℉", "deg F", "Deg F"),
        dimension="temperature",
        factor=5.0 / 9.0,
        offset=KELVIN - 160.0 / 9.0,
    ),
    Unit(symbol="km/h", dimension="air speed", factor=1.0 / 3.6),
    Unit(symbol="mph", dimension="air speed", factor=0.44704),
    Unit(symbol="ft/s", dimension="air speed", factor=0.3048),
    Unit(symbol="kW", dimension="power", factor=1e3),
    Unit(symbol="MW", dimension="power", factor=1e6),
    Unit(symbol="mW", dimension="power", factor=1e-3),
    Unit(symbol="hp", dimension="power", factor=745.69987),
    Unit(symbol="%", dimension="ratio", factor=1e-2),
    Unit(symbol="l/min", dimension="volume flow", factor=1.0 / 6e4),
    Unit(symbol="l/h", dimension="volume flow", factor=1.0 / 3.6e6),
    Unit(symbol="l/s", dimension="volume flow", factor=1e-3),
    Unit(symbol="m3/h", dimension="volume flow", factor=1.0 / 3600.0),
    Unit(symbol="kg/h", dimension="mass flow", factor=1.0 / 3600.0),
    Unit(symbol="kg/min", dimension="mass flow", factor=1.0 / 60.0),
    Unit(symbol="kPa", dimension="pressure", factor=1e3),
    Unit(symbol="bar", dimension="pressure", factor=1e5),
    Unit(symbol="MPa", dimension="pressure", factor=1e6),
    Unit(symbol="psi", dimension="pressure", factor=6894.757293168),
    Unit(symbol="ms", dimension="time", factor=1e-3),
    Unit(symbol="us", aliases=("µs",), dimension="time", factor=1e-6),
    Unit(symbol="ns", dimension="time", factor=1e-9),
    Unit(symbol="min", dimension="time", factor=60.0),
    Unit(symbol="h", dimension="time", factor=3600.0),
    Unit(symbol="d", dimension="time", factor=86400.0),
)
# Units of the FMI interface by symbol, in the order of a model description.
UNITS: Mapping[str, Unit] = {unit.symbol: unit for unit in TABLE if unit.base is not None}


def fmi_symbol(text: str) -> str:
    """Return the FMI symbol of a unit, the text itself if FMUs do not use the unit.

    Examples
    --------
    >>> fmi_symbol("N m"), fmi_symbol("1/s"), fmi_symbol("W/m")
    ('N.m', '1/s', 'W/m')
    """
    return text if text in UNITS else next((unit.symbol for unit in UNITS.values() if text in unit.aliases), text)


def find_unit(text: str, dimension: str) -> Unit:
    """Return the unit that a text means in a dimension.

    Raises
    ------
    InputError
        If the dimension has no unit of that spelling.

    Examples
    --------
    >>> find_unit("rpm", "speed").symbol, find_unit("1/s", "speed").symbol
    ('1/min', 'Hz')
    """
    own = [unit for unit in TABLE if unit.dimension == dimension]
    for unit in own:
        if text in (unit.symbol, *unit.aliases):
            return unit
    raise InputError(f"{text!r} is no unit of {dimension}; known are {', '.join(unit.symbol for unit in own)}")


def conversion(unit: Unit, to: Unit) -> tuple[float, float]:
    """Return factor and offset from one unit to another of the same dimension.

    Examples
    --------
    >>> conversion(find_unit("kW", "power"), find_unit("W", "power"))
    (1000.0, 0.0)
    """
    if unit is to:
        return 1.0, 0.0
    return unit.factor / to.factor, (unit.offset - to.offset) / to.factor


def convert(value: float, unit: Unit, to: Unit) -> float:
    """Convert a value from one unit to another of the same dimension, to 12 digits.

    Examples
    --------
    >>> convert(-90.0, UNITS["degC"], UNITS["K"])
    183.15
    """
    factor, offset = conversion(to, unit)
    return float(f"{(value - offset) / factor:.12g}")


def units_in_files(dimension: str | None, unit: str) -> dict[str, tuple[float, float]]:
    """Return the units that a column may have, with factor and offset to `unit`; empty if any.

    Examples
    --------
    >>> units_in_files("air speed", "m/s")["m/s"], sorted(units_in_files("power", "W")), units_in_files(None, "")
    ((1.0, 0.0), ['MW', 'W', 'hp', 'kW', 'mW'], {})
    """
    if not dimension:
        return {}
    to = find_unit(unit, dimension)
    return {
        symbol: conversion(unit, to)
        for unit in TABLE
        if unit.dimension == dimension
        for symbol in (unit.symbol, *unit.aliases)
    }
