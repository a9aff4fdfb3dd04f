"""Roles of columns that are no quantity, and temperatures in the wrong unit."""

from __future__ import annotations

from models.quantities.quantities import Quantity

AUXILIARY, IGNORE = "auxiliary", "ignore"
ISO = "iso8601"
_KELVIN = (200.0, 600.0)  # no gearbox has such temperatures in degC all the time


def looks_like_kelvin(quantity: Quantity, lowest: float, highest: float) -> bool:
    """Return True if values from `lowest` to `highest` in degC are a temperature in kelvin.

    Examples
    --------
    >>> from models.quantities.quantities import quantity_of
    >>> looks_like_kelvin(quantity_of("T_oil"), 293.0, 361.0), looks_like_kelvin(quantity_of("T_oil"), 20.0, 90.0)
    (True, False)
    """
    return quantity.is_temperature and quantity.unit == "degC" and _KELVIN[0] < lowest <= highest < _KELVIN[1]
