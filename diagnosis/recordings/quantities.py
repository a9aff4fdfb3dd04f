"""Quantities of a recording: their units in files, and the values that are possible."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

from models.files.cycle import COLUMNS

LOSS = "P_loss"  # the measured total loss, next to the temperatures ``T_<node>``
AUXILIARY, IGNORE = "auxiliary", "ignore"
ISO = "iso8601"

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


@dataclass(frozen=True)
class Range:
    """Possible values of a quantity, in the unit inside."""

    low: float
    high: float
    unit: str


_LOWEST_T = COLUMNS["T_ambient"][1]  # degC
_HOTTEST = 250.0  # degC; oil and steel of a gearbox are long destroyed
RANGES: Mapping[str, Range] = {
    signal: Range(low, high, unit.partition(";")[0]) for signal, (_, low, high, unit) in COLUMNS.items()
} | {LOSS: Range(-1e7, 1e7, "W")}
_KELVIN = (200.0, 600.0)  # no gearbox has such temperatures in degC all the time


def dimension_of(quantity: str) -> str | None:
    """Return the dimension of a quantity, None if it may have any unit.

    Examples
    --------
    >>> dimension_of("T_oil"), dimension_of("P_loss"), dimension_of("oil_flow")
    ('temperature', 'power', None)
    """
    if quantity in ("speed", "torque"):
        return quantity
    named = {"air_speed": "air speed", LOSS: "power"}
    return "temperature" if quantity.startswith("T_") else named.get(quantity)


def range_of(quantity: str) -> Range | None:
    """Return the possible values of a quantity, None if it may have any."""
    if quantity not in RANGES and dimension_of(quantity) == "temperature":
        return Range(_LOWEST_T, _HOTTEST, "degC")
    return RANGES.get(quantity)


def looks_like_kelvin(quantity: str, lowest: float, highest: float) -> bool:
    """Return True if values from `lowest` to `highest` in degC are a temperature in kelvin.

    Examples
    --------
    >>> looks_like_kelvin("T_oil", 293.0, 361.0), looks_like_kelvin("T_oil", 20.0, 90.0)
    (True, False)
    """
    return dimension_of(quantity) == "temperature" and _KELVIN[0] < lowest <= highest < _KELVIN[1]
