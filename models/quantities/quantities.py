"""The table of quantities: names, units, columns, ranges and labels of what is an input, measured or computed.

The units inside are 1/min for speeds and degC for temperatures, otherwise SI: laws, corrections and files of users are
written in them. A family (``T_{}``) has one quantity per node or component.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from models.quantities.units import INSIDE, find_unit

Observed = Literal["input", "temperature", "total loss", "computed"]


@dataclass(frozen=True, kw_only=True)
class Type:
    """A declared type of FMI: quantity, unit, the unit to show, and what is common to all its signals."""

    quantity: str
    unit: str
    display: str | None = None
    nominal: float = 1.0
    description: str


TYPES: Mapping[str, Type] = {
    "Speed": Type(
        quantity="AngularVelocity", unit="rad/s", display="rpm", nominal=100.0, description="Speed of a shaft"
    ),
    "Torque": Type(quantity="Torque", unit="N.m", nominal=100.0, description="Torque in a shaft"),
    "Temperature": Type(
        quantity="ThermodynamicTemperature", unit="K", display="degC", nominal=300.0, description="Temperature"
    ),
    "AirSpeed": Type(quantity="Velocity", unit="m/s", description="Speed of air"),
    "VehicleSpeed": Type(quantity="Velocity", unit="m/s", nominal=10.0, description="Speed of a vehicle"),
    "Power": Type(quantity="Power", unit="W", nominal=100.0, description="Power or heat flow"),
    "VolumeFlow": Type(quantity="VolumeFlowRate", unit="m3/s", nominal=1e-4, description="Volume flow of a fluid"),
    "MassFlow": Type(quantity="MassFlowRate", unit="kg/s", nominal=0.1, description="Mass flow of a fluid"),
    "Pressure": Type(quantity="Pressure", unit="Pa", nominal=1e5, description="Pressure of a fluid"),
    "Energy": Type(quantity="Energy", unit="J", display="kJ", nominal=1e5, description="Heat or work"),
    "Ratio": Type(quantity="Ratio", unit="1", description="Number without unit"),
}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A quantity of a gearbox.

    Attributes
    ----------
    name : str
        Inside; with ``{}`` for a family
    dimension : str
        Key of :data:`models.quantities.units.INSIDE`, empty for a flag
    column : str
        Column of files
    low, high : float
        Plausible range, in the unit inside
    note : str
        What a value outside the range usually is
    label : str
        Of an axis
    observed : str
        Input, temperature of a node, total loss, or computed result
    own_unit : str
        Unit inside and in files if it is not that of the dimension; of inputs that a definition names
    type : str or None
        Key of :data:`TYPES`
    fmi : str
        Name of the FMI signal; empty if no FMU has it
    """

    name: str
    dimension: str
    column: str
    low: float = -inf
    high: float = inf
    note: str = ""
    label: str
    observed: Observed
    own_unit: str = ""
    type: str | None = None
    fmi: str = ""

    @property
    def unit(self) -> str:
        """Unit inside and in files."""
        return self.own_unit or INSIDE.get(self.dimension, "")

    @property
    def is_temperature(self) -> bool:
        """True for the temperature of a node, of the surroundings or of a fluid."""
        return self.dimension == "temperature"


QUANTITIES: tuple[Quantity, ...] = (
    Quantity(name="speed", dimension="speed", column="speed_rpm", low=-2.0e5, high=2.0e5, label="Input speed in 1/min",
             observed="input", type="Speed", fmi="speed"),
    Quantity(name="torque", dimension="torque", column="torque_Nm", low=-1.0e7, high=1.0e7,
             label="Input torque in N m", observed="input", type="Torque", fmi="torque"),
    Quantity(name="T_ambient", dimension="temperature", column="T_ambient_degC", low=-90.0, high=200.0,
             note="kelvin are not meant", label="Ambient temperature in °C", observed="input", type="Temperature",
             fmi="T_ambient"),
    Quantity(name="air_speed", dimension="air speed", column="air_speed_m_s", low=0.0, high=200.0,
             label="Air speed in m/s", observed="input", type="AirSpeed", fmi="air_speed"),
    # Above 250 degC oil and steel of a gearbox are destroyed.
    Quantity(name="T_{}", dimension="temperature", column="T_{}_degC", low=-90.0, high=250.0,
             label="Temperature in °C", observed="temperature", type="Temperature", fmi="{}.T"),
    Quantity(name="P_loss", dimension="power", column="P_loss_W", low=-1e7, high=1e7, label="Power loss in W",
             observed="total loss", type="Power", fmi="loss.total"),
    Quantity(name="P_loss_{}", dimension="power", column="P_loss_{}_W", label="Power loss in W", observed="computed",
             type="Power", fmi="loss.{}"),
    Quantity(name="torque_loss", dimension="torque", column="torque_loss_Nm", label="Loss torque in N m",
             observed="computed", type="Torque", fmi="torque_loss"),
    Quantity(name="torque_out", dimension="torque", column="torque_out_Nm", low=-1.0e8, high=1.0e8,
             label="Output torque in N m", observed="computed", type="Torque"),
    Quantity(name="efficiency", dimension="ratio", column="efficiency", label="Efficiency", observed="computed",
             type="Ratio", fmi="efficiency"),
    Quantity(name="in_domain", dimension="", column="in_domain", label="Inside the trained range",
             observed="computed", fmi="in_domain"),
)  # fmt: skip
_BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}
_FAMILIES = [quantity for quantity in QUANTITIES if "{}" in quantity.name]
NODE_TEMPERATURE = _BY_NAME["T_{}"]
TOTAL_LOSS = next(quantity.name for quantity in QUANTITIES if quantity.observed == "total loss")
# What an input of a definition may be: dimension and FMI type by the word for it.
INPUT_KINDS: Mapping[str, tuple[str, str]] = {
    "speed": ("speed", "Speed"), "torque": ("torque", "Torque"), "temperature": ("temperature", "Temperature"),
    "power": ("power", "Power"), "air speed": ("air speed", "AirSpeed"), "volume flow": ("volume flow", "VolumeFlow"),
    "mass flow": ("mass flow", "MassFlow"), "pressure": ("pressure", "Pressure"), "ratio": ("ratio", "Ratio"),
    "switch": ("ratio", "Ratio"),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Input:
    """An input of a machine.

    Attributes
    ----------
    quantity : Quantity
        Its name, unit, column and plausible range
    default : float
        Value where a cycle or a recording does not give it, in the unit inside
    required : bool
        True if a cycle must give it
    """

    quantity: Quantity
    default: float
    required: bool = False
    description: str = ""

    @property
    def name(self) -> str:
        """Name in laws."""
        return self.quantity.name

    @property
    def column(self) -> str:
        """Column of files."""
        return self.quantity.column


def named_input(
    name: str, kind: str, *, unit: str = "", low: float = -inf, high: float = inf, default: float = 0.0,
    required: bool = False, description: str = "",
) -> Input:  # fmt: skip
    """Return an input that is not in the table of quantities.

    Parameters
    ----------
    name : str
        In laws, in files and at the FMI
    kind : str
        Key of :data:`INPUT_KINDS`
    unit : str
        Of laws, files, range and default; by default the unit inside of its dimension
    low, high, default : float
        In that unit
    required : bool
        True if a cycle must give it

    Examples
    --------
    >>> named_input("oil_flow", "volume flow", unit="l/min", low=0.0, high=60.0).quantity.unit
    'l/min'
    """
    dimension, kind_at_fmi = INPUT_KINDS[kind]
    symbol = find_unit(unit or INSIDE[dimension], dimension).symbol
    quantity = Quantity(
        name=name, dimension=dimension, column=name, low=low, high=high, observed="input", type=kind_at_fmi, fmi=name,
        own_unit=symbol, label=f"{name.replace('_', ' ')} in {symbol}",
    )  # fmt: skip
    return Input(quantity=quantity, default=default, required=required, description=description)


def usual_inputs(**defaults: float) -> dict[str, Input]:
    """Return inputs of the table of quantities by name, with their defaults; speed and torque are required.

    Examples
    --------
    >>> inputs = usual_inputs(speed=0.0, T_ambient=20.0)
    >>> inputs["T_ambient"].column, inputs["speed"].required
    ('T_ambient_degC', True)
    """
    return {
        name: Input(quantity=_BY_NAME[name], default=default, required=name in REQUIRED)
        for name, default in defaults.items()
    }


REQUIRED = ("speed", "torque")  # of a machine that has them
# Of a gearbox with geometry; the air's are those of its definition.
GEARBOX_INPUTS: Mapping[str, Input] = usual_inputs(speed=0.0, torque=0.0, T_ambient=20.0, air_speed=0.0)


def implausible(quantity: Quantity, values: ArrayLike) -> str | None:
    """Return a sentence on the first value outside the plausible range of a quantity; None if there is none.

    Parameters
    ----------
    values : ArrayLike, shape () or (N,)
        In the unit inside

    Examples
    --------
    >>> implausible(QUANTITIES[2], [20.0, 293.15])
    'T_ambient_degC is 293.15 at row 2; -90 ... 200 is possible (degC; kelvin are not meant)'
    >>> implausible(QUANTITIES[2], 20.0)
    """
    numbers = np.asarray(values, dtype=float)
    wrong = np.flatnonzero(~((numbers >= quantity.low) & (numbers <= quantity.high)))
    if not len(wrong):
        return None
    first, row = numbers.ravel()[wrong[0]], f" at row {wrong[0] + 1}" if numbers.ndim else ""
    unit = f"{quantity.unit}; {quantity.note}" if quantity.note else quantity.unit
    return f"{quantity.column} is {first:g}{row}; {quantity.low:g} ... {quantity.high:g} is possible ({unit})"


def quantity_of(name: str) -> Quantity | None:
    """Return a quantity by its name inside; None for an input of a user.

    Examples
    --------
    >>> quantity_of("T_oil").column, quantity_of("P_loss").observed, quantity_of("oil_flow")
    ('T_oil_degC', 'total loss', None)
    """
    return _BY_NAME.get(name) or _member(name, "name")


def quantity_of_signal(fmi: str) -> Quantity | None:
    """Return a quantity by its FMI signal; None if files have no column for it.

    Examples
    --------
    >>> quantity_of_signal("oil.T").column, quantity_of_signal("loss.total").column, quantity_of_signal("heat.extra")
    ('T_oil_degC', 'P_loss_W', None)
    """
    return next((q for q in QUANTITIES if q.fmi == fmi), None) or _member(fmi, "fmi")


def _member(text: str, of: Literal["name", "fmi"]) -> Quantity | None:
    for family in _FAMILIES:
        before, _, after = getattr(family, of).partition("{}")
        if text.startswith(before) and text.endswith(after):
            member = text[len(before) : len(text) - len(after)].strip("'")
            return replace(family, name=family.name.replace("{}", member), column=family.column.replace("{}", member),
                           fmi=family.fmi.replace("{}", member))  # fmt: skip
    return None


def quantity_of_column(column: str) -> Quantity | None:
    """Return a quantity, no family, by its column.

    Examples
    --------
    >>> quantity_of_column("torque_out_Nm").name, quantity_of_column("pump_A")
    ('torque_out', None)
    """
    return next((quantity for quantity in QUANTITIES if quantity.column == column), None)


def column_of_input(name: str) -> str:
    """Return the column of an input; one that the table of quantities does not have keeps its name.

    Examples
    --------
    >>> column_of_input("T_ambient"), column_of_input("T_outdoor")
    ('T_ambient_degC', 'T_outdoor')
    """
    return GEARBOX_INPUTS[name].column if name in GEARBOX_INPUTS else name


def column_of(name: str) -> str:
    """Return the column of a quantity; an input of a user has its own name."""
    quantity = quantity_of(name)
    return name if quantity is None else quantity.column


def node_columns(columns: Iterable[str]) -> dict[str, str]:
    """Return the columns of the temperatures of nodes, by node; that of the surroundings is an input.

    Examples
    --------
    >>> node_columns(["time_s", "T_ambient_degC", "T_oil_degC"])
    {'oil': 'T_oil_degC'}
    """
    before, after = NODE_TEMPERATURE.column.split("{}")
    return {
        column[len(before) : -len(after)]: column
        for column in columns
        if column.startswith(before) and column.endswith(after) and column != GEARBOX_INPUTS["T_ambient"].column
    }


MEMORY = "state_"  # before the name of a memory of the laws, in results and start values
SENSOR = "__"  # between the node and the name of one of several sensors at it


def node_of_channel(name: str, nodes: Container[str]) -> str:
    """Return the node that a channel measures, by its name or ``<node>__<sensor>``.

    Examples
    --------
    >>> node_of_channel("oil", ["oil"]), node_of_channel("oil__sump_probe", ["oil"])
    ('oil', 'oil')
    """
    return name if name in nodes else name.rpartition(SENSOR)[0] or name


def is_total_loss(name: str) -> bool:
    """Return True for the measured total loss; other channels of a diagnosis are named after their node."""
    return name == TOTAL_LOSS
