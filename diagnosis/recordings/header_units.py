"""Units that the header of a file names, as in ``T_oil_degF``, ``speed [rad/s]`` or ``Time (min)``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from diagnosis.recordings.mapping import Column
from models.quantities.quantities import Quantity
from models.quantities.units import TABLE, units_in_files

_BRACKETS = re.compile(r"(.*?)[\s_]*[\[(]([^\[\]()]*)[\])]\s*", re.DOTALL)
NO_UNITS = ("", "-", "1")
NO_WORDS = ("F", "°C", "°F", "°K", "℃", "℉", "%")  # a sensor may be called so, as the front one in T_oil_F
_KNOWN = {symbol for unit in TABLE if unit.dimension for symbol in (unit.symbol, *unit.aliases)}.difference(NO_UNITS)


def units_in_brackets(names: Iterable[str]) -> dict[str, str]:
    """Return the units that names hold in brackets at their end; texts in brackets that are no units are left out.

    Examples
    --------
    >>> units_in_brackets(["Oil [°F]", "M1 (kNm)", "T_oil (sump)"])
    {'Oil [°F]': '°F', 'M1 (kNm)': 'kNm'}
    """
    found = {name: match[2].strip() for name in names if (match := _BRACKETS.fullmatch(name))}
    return {name: unit for name, unit in found.items() if unit in _KNOWN}


def unit_of_name(name: str, stem: str, dimension: str, inside: str) -> str | None:
    """Return the unit in a name that is `stem` with a unit of a dimension; None for another name.

    Parameters
    ----------
    stem : str
        In small letters or capitals
    inside : str
        Unit inside of the dimension

    Examples
    --------
    >>> unit_of_name("T_oil_degF", "T_oil", "temperature", "degC"), unit_of_name("Time [h]", "time", "time", "s")
    ('degF', 'h')
    >>> unit_of_name("speed_rad_s", "speed", "speed", "1/min"), unit_of_name("T_oil", "T_oil", "temperature", "degC")
    ('rad/s', None)
    """
    units = [unit for unit in units_in_files(dimension, inside) if unit not in NO_UNITS]
    brackets = _BRACKETS.fullmatch(name)
    if brackets:
        return brackets[2].strip() if brackets[1].lower() == stem.lower() and brackets[2].strip() in units else None
    words: dict[str, str] = {}
    for unit in units:
        if unit not in NO_WORDS:
            words.setdefault(re.sub(r"\W+", "_", unit.replace(" ", "").replace(".", "")), unit)
    return next(
        (unit for word, unit in words.items() if name.lower() == f"{stem}_{word}".lower() and name.endswith(word)), None
    )


def named_with_unit(present: Sequence[str], quantities: Iterable[Quantity]) -> dict[str, Column]:
    """Return the columns whose names are that of a quantity with a unit, one for each quantity at most.

    Examples
    --------
    >>> from models.quantities.quantities import quantity_of
    >>> named_with_unit(["T_oil_K", "speed [Hz]"], [quantity_of("T_oil"), quantity_of("speed")])["T_oil_K"].unit
    'K'
    """
    found: dict[str, Column] = {}
    for quantity in quantities:
        units = {name: unit_of_name(name, quantity.name, quantity.dimension, quantity.unit) for name in present}
        fitting = {name: unit for name, unit in units.items() if unit is not None}
        if len(fitting) == 1:
            ((name, unit),) = fitting.items()
            found[name] = Column(quantity=quantity.name, unit=unit)
    return found
