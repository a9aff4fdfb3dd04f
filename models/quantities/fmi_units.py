"""Units and quantities of the FMI interface, and their conversion to the units of files and of the network.

At the FMI interface everything is in SI units; the network and all files work in the units of the file columns (1/min,
degC).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi

KELVIN = 273.15


@dataclass(frozen=True, kw_only=True)
class Unit:
    """A unit of the FMI interface.

    Attributes
    ----------
    base : mapping of SI base unit to exponent
        As in the attributes of an FMI ``BaseUnit``
    factor, offset : float
        Value in base units = factor * value + offset
    display : (str, float, float) or None
        Unit to show, and factor and offset to it
    column : (str, float, float)
        Unit of file columns and of the network, and factor and offset to it
    """

    base: Mapping[str, int] = field(default_factory=dict)
    factor: float = 1.0
    offset: float = 0.0
    display: tuple[str, float, float] | None = None
    column: tuple[str, float, float] = ("", 1.0, 0.0)

    def to_column(self, value: float) -> float:
        """A value of the FMI interface in the unit of file columns.

        Examples
        --------
        >>> UNITS["K"].to_column(293.15)
        20.0
        """
        return value * self.column[1] + self.column[2]

    def from_column(self, value: float) -> float:
        """A value of a file column in the unit of the FMI interface, to 12 digits.

        Examples
        --------
        >>> UNITS["K"].from_column(-90.0)
        183.15
        """
        return float(f"{(value - self.column[2]) / self.column[1]:.12g}")


UNITS: Mapping[str, Unit] = {
    "rad/s": Unit(base={"rad": 1, "s": -1}, display=("rpm", 30.0 / pi, 0.0), column=("1/min", 30.0 / pi, 0.0)),
    "N.m": Unit(base={"kg": 1, "m": 2, "s": -2}, column=("N m", 1.0, 0.0)),
    "K": Unit(base={"K": 1}, display=("degC", 1.0, -KELVIN), column=("degC", 1.0, -KELVIN)),
    "m/s": Unit(base={"m": 1, "s": -1}, column=("m/s", 1.0, 0.0)),
    "W": Unit(base={"kg": 1, "m": 2, "s": -3}, display=("kW", 1e-3, 0.0), column=("W", 1.0, 0.0)),
    "1": Unit(column=("1", 1.0, 0.0)),
    # Of a vehicle.
    "m": Unit(base={"m": 1}),
    "m2": Unit(base={"m": 2}),
    "kg": Unit(base={"kg": 1}),
    "kg.m2": Unit(base={"kg": 1, "m": 2}),
    "J": Unit(base={"kg": 1, "m": 2, "s": -2}, display=("kJ", 1e-3, 0.0)),
    # Units of parameters, which stay as the law has them.
    "s": Unit(base={"s": 1}),
    "1/s": Unit(base={"s": -1}),
    "W/K": Unit(base={"kg": 1, "m": 2, "s": -3, "K": -1}),
    "J/K": Unit(base={"kg": 1, "m": 2, "s": -2, "K": -1}),
    "1/K": Unit(base={"K": -1}),
    "degC": Unit(base={"K": 1}, offset=KELVIN),
    "1/min": Unit(base={"rad": 1, "s": -1}, factor=pi / 30.0),
}
SAME_UNIT = {"N m": "N.m", "Nm": "N.m", "rpm": "1/min", "-": "1", "": "1", "W K^-1": "W/K"}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A declared type: quantity, unit, the unit to show, and what is common to all its signals."""

    quantity: str
    unit: str
    display: str | None = None
    nominal: float = 1.0
    description: str


TYPES: Mapping[str, Quantity] = {
    "Speed": Quantity(
        quantity="AngularVelocity", unit="rad/s", display="rpm", nominal=100.0, description="Speed of a shaft"
    ),
    "Torque": Quantity(quantity="Torque", unit="N.m", nominal=100.0, description="Torque in a shaft"),
    "Temperature": Quantity(
        quantity="ThermodynamicTemperature", unit="K", display="degC", nominal=300.0, description="Temperature"
    ),
    "AirSpeed": Quantity(quantity="Velocity", unit="m/s", description="Speed of air"),
    "VehicleSpeed": Quantity(quantity="Velocity", unit="m/s", nominal=10.0, description="Speed of a vehicle"),
    "Power": Quantity(quantity="Power", unit="W", nominal=100.0, description="Power or heat flow"),
    "Ratio": Quantity(quantity="Ratio", unit="1", description="Number without unit"),
}
