"""Units of the keys of a definition file: plausible ranges at the border, SI inside.

A key names its unit (``face_width_mm``). This module knows what such an ending means, checks that a number is of a
plausible magnitude in that unit (:func:`between`), and offers the value in SI under the bare name
(``stage.face_width`` [m], :func:`in_si`). It is the only place where units of a definition are converted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import degrees, inf, pi, radians
from typing import Any, Generic, TypeVar, cast, overload

from pydantic import AfterValidator, GetJsonSchemaHandler, ValidationInfo

T = TypeVar("T")


@dataclass(frozen=True)
class Unit:
    """One unit of a key: how it is written, its factor to SI, and what it is mistaken for.

    ``slips`` maps the name of a mistaken unit to the function that brings a number in it to this unit.
    """

    symbol: str
    si: float = 1.0
    slips: Mapping[str, Callable[[float], float]] = field(default_factory=dict)


def _times(factor: float) -> Callable[[float], float]:
    return lambda value: value * factor


UNITS: Mapping[str, Unit] = {
    "_mm": Unit("mm", 1e-3, {"metres": _times(1e3), "micrometres": _times(1e-3)}),
    "_um": Unit("um", 1e-6, {"millimetres": _times(1e3), "metres": _times(1e6), "nanometres": _times(1e-3)}),
    "_m": Unit("m", 1.0, {"millimetres": _times(1e-3)}),
    "_m2": Unit("m2", 1.0, {"cm2": _times(1e-4), "mm2": _times(1e-6)}),
    "_l": Unit("l", 1e-3, {"cubic metres": _times(1e3), "millilitres": _times(1e-3)}),
    "_deg": Unit("deg", pi / 180.0, {"radians": degrees}),
    "_degC": Unit("degC", 1.0, {"kelvin": lambda value: value - 273.15}),
    "_kg": Unit("kg", 1.0, {"grams": _times(1e-3)}),
    "_kg_m3": Unit("kg/m3", 1.0, {"g/cm3": _times(1e3)}),
    "_J_kgK": Unit("J/(kg K)", 1.0, {"kJ/(kg K)": _times(1e3)}),
    "_J_K": Unit("J/K", 1.0, {"kJ/K": _times(1e3)}),
    "_GPa": Unit("GPa", 1e9, {"MPa": _times(1e-3), "Pa": _times(1e-9)}),
    "_Pa": Unit("Pa"),
    "_Pa_per_K": Unit("Pa/K"),
    "_N_m2": Unit("N/m2"),
    "_per_K": Unit("1/K"),
    "_1_K": Unit("1/K", 1.0, {"the opposite sign": _times(-1.0)}),
    "_mm2_s": Unit("mm2/s", 1e-6, {"m2/s": _times(1e6)}),
    "_m_s": Unit("m/s", 1.0, {"mm/s": _times(1e-3)}),
    "_W_mK": Unit("W/(m K)"),
    "_W_m2K": Unit("W/(m2 K)"),
    "_W_K": Unit("W/K"),
    "_W": Unit("W", 1.0, {"kW": _times(1e3)}),
    "_rpm": Unit("rpm", radians(360.0) / 60.0),
    "_Nm": Unit("N m", 1.0, {"N mm": _times(1e-3)}),
    "": Unit("", 1.0, {"percent": _times(1e-2)}),
}


SINGULAR = ("percent", "kelvin", "the opposite sign")


def unit_of(key: str) -> Unit:
    """Return the unit that the ending of a key names; the longest known ending wins.

    Examples
    --------
    >>> unit_of("face_width_mm").symbol, unit_of("nu_40_mm2_s").symbol, unit_of("emissivity").symbol
    ('mm', 'mm2/s', '')
    """
    return UNITS[max((ending for ending in UNITS if key.endswith(ending)), key=len)]


@dataclass(frozen=True, slots=True)
class Between(AfterValidator):
    """The validator that :func:`between` returns; it also puts its limits into a JSON schema."""

    limits: tuple[float, float] = (-inf, inf)

    def __get_pydantic_json_schema__(self, core: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema of the number with its limits."""
        low, high = self.limits
        return {**handler(core), "minimum": low, "maximum": high}


def between(low: float, high: float, *, unit: str | None = None) -> Between:
    """Return a pydantic validator that refuses numbers outside ``[low, high]`` as unphysical or a slip of the unit.

    Parameters
    ----------
    low, high : float
        The plausible range, in the unit of the key, inclusive
    unit : str, optional
        Ending that names the unit (``"_degC"``) where the key itself does not

    Raises
    ------
    ValueError
        (from the validator) with the value, the limit, the range, and the unit that was probably meant
    """

    def check(value: float, info: ValidationInfo) -> float:
        if low <= value <= high:
            return value
        measure = unit_of(info.field_name or "" if unit is None else unit)
        symbol = f" {measure.symbol}" if measure.symbol else ""
        side, limit = ("below", low) if value < low else ("above", high)
        meant = next((name for name, convert in measure.slips.items() if low <= convert(value) <= high), None)
        verb = "was" if meant in SINGULAR else "were"
        hint = f": {verb} {meant} meant?" if meant else ""
        raise ValueError(
            f"{value:g}{symbol} is {side} {limit:g}{symbol} (plausible: {low:g} to {high:g}{symbol}){hint}"
        )

    return Between(check, (low, high))


class InSI(Generic[T]):
    """Read-only attribute: the value of a key of the same object, in SI."""

    def __init__(self, key: str) -> None:
        self.key = key
        self.factor = unit_of(key).si

    @overload
    def __get__(self, instance: None, owner: type) -> InSI[T]: ...

    @overload
    def __get__(self, instance: object, owner: type) -> T: ...

    def __get__(self, instance: object | None, owner: type) -> InSI[T] | T:
        if instance is None:
            return self
        return cast(T, self._convert(getattr(instance, self.key)))

    def _convert(self, value: Any) -> Any:
        if value is None:
            return None
        return tuple(self._convert(item) for item in value) if isinstance(value, tuple) else value * self.factor


def in_si(key: str) -> InSI[float]:
    """Return the SI attribute of a key that holds one number."""
    return InSI[float](key)
