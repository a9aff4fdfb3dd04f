"""Tables that a definition with geometry and one without have in common: what is around a machine, or added to it.

``[[input]]``, ``[[parameter]]``, ``[[boundary]]``, ``[[part]]``, ``[[link]]``, ``[[heat]]`` and ``[recording]``.
Without geometry they are the whole thermal network, next to the losses. With geometry they come on top of the network
that follows from teeth, bearings and housing, and links and heats may name its nodes. What must agree between them is
in :mod:`models.definition.machine_faults`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Container
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from models.definition.sections import Name, OneOrMore, Section, Text
from models.quantities.definition_units import between
from models.quantities.quantities import GEARBOX_INPUTS, INPUT_KINDS, Input, named_input, usual_inputs
from models.quantities.units import INSIDE, find_unit, units_in_files

PART, STAGE = "part", "stage"  # a file with the first of these tables and without the second has no geometry


def has_geometry(tables: Container[str]) -> bool:
    """Return True if a file with these tables defines a machine with geometry.

    Parameters
    ----------
    tables : container of str
        Keys at the top of the file

    Examples
    --------
    >>> has_geometry({"stage", "part"}), has_geometry({"part", "boundary"}), has_geometry({"name"})
    (True, False, True)
    """
    return STAGE in tables or PART not in tables


class NamedInput(Section):
    """``[[input]]``: a signal that recordings, cycles and hosts of the FMU give; laws use it by its name.

    `unit` is that of laws, of `range` and `default`, and of the column `name` in files. Without `default` a cycle must
    give it. ``speed``, ``torque``, ``T_ambient`` and ``air_speed`` have their unit and range already.
    """

    name: Name
    quantity: str | None = None
    unit: str | None = None
    range: tuple[float, float] | None = None
    default: float | None = None
    description: Text | None = None

    @model_validator(mode="after")
    def _is_known(self) -> Self:
        fixed = GEARBOX_INPUTS.get(self.name)
        if fixed is not None:
            given = [key for key in ("quantity", "unit", "range") if getattr(self, key) is not None]
            if given:
                quantity = fixed.quantity
                raise ValueError(
                    f"{self.name} is always a {quantity.dimension} in {quantity.unit} from {quantity.low:g} to "
                    f"{quantity.high:g}; leave out {' and '.join(given)}, or choose another name"
                )
        elif self.quantity is None or self.quantity not in INPUT_KINDS:
            known = ", ".join(INPUT_KINDS)
            raise ValueError(f"quantity is {self.quantity!r}; one of {known} is needed")
        elif self.unit is None and self.quantity != "switch":
            units = ", ".join(u for u in units_in_files(*_own_unit(self.quantity)))
            raise ValueError(f"unit is missing; a {self.quantity} is given in one of {units}")
        elif self.unit is not None:
            find_unit(self.unit, INPUT_KINDS[self.quantity][0])
        low, high = self.bounds
        if not low < high:
            raise ValueError(f"range: the first number must be below the second, not {low:g}, {high:g}")
        if fixed is None and self.range is None and self.quantity != "switch":
            raise ValueError("range is missing; give the lowest and the highest plausible value")
        if self.default is not None and not low <= self.default <= high:
            raise ValueError(f"default is {self.default:g}, outside the range {low:g} ... {high:g}")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Plausible range, in `unit`."""
        if self.name in GEARBOX_INPUTS:
            quantity = GEARBOX_INPUTS[self.name].quantity
            return quantity.low, quantity.high
        return self.range or (0.0, 1.0)

    def as_input(self) -> Input:
        """Return the input of a network."""
        low, high = self.bounds
        default = min(max(0.0, low), high) if self.default is None else self.default
        text = self.description or ""
        if self.name in GEARBOX_INPUTS:
            known = GEARBOX_INPUTS[self.name]
            return replace(known, default=default, required=self.default is None, description=text)
        return named_input(
            self.name, str(self.quantity), unit=self.unit or "", low=low, high=high, default=default,
            required=self.default is None, description=text,
        )  # fmt: skip


def _own_unit(quantity: str) -> tuple[str, str]:
    dimension = INPUT_KINDS[quantity][0]
    return dimension, INSIDE[dimension]


class Boundary(Section):
    """``[[boundary]]``: surroundings of a recorded temperature; `input` is the name of that signal.

    The signal is an ``[[input]]``, or else a temperature in degC, `temperature_degC` by default.
    """

    name: Name
    input: Name
    temperature_degC: Annotated[float, between(-60.0, 150.0)] | None = None

    def as_input(self) -> Input:
        """Return its temperature as an input of a network, where no ``[[input]]`` is it."""
        default = 0.0 if self.temperature_degC is None else self.temperature_degC
        if self.input in GEARBOX_INPUTS:
            return usual_inputs(**{self.input: default})[self.input]
        return named_input(
            self.input, "temperature", low=-90.0, high=250.0, default=default,
            description=f"Temperature of {self.name.replace('_', ' ')}",
        )  # fmt: skip


class Part(Section):
    """``[[part]]``: an isothermal part; `group` makes it one of what mechanisms look for."""

    name: Name
    heat_capacity_J_K: Annotated[float, between(1.0, 1e9)]
    group: Literal["housing", "bearings", "gears", "shafts", "returns"] | None = None


class Path(Section):
    """``[[link]]``: a heat path; `standstill_share` of its conductance is left when the gearbox stands.

    `factor` is a law without unit on the conductance, of inputs and temperatures: ``"oil_flow / 20"``.
    """

    between: tuple[Name, Name]
    conductance_W_K: Annotated[float, between(1e-4, 1e6)]
    standstill_share: Annotated[float, between(1e-4, 1.0)] = 1.0
    factor: Text | None = None


class Heat(Section):
    """``[[heat]]``: heat by a law in W, of inputs and temperatures, times `gain`; several parts share it evenly."""

    name: Name
    part: Name | OneOrMore[Name]
    heat_W: Text
    gain: Annotated[float, between(1e-3, 1e3)] = 1.0

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts that it warms."""
        return (self.part,) if isinstance(self.part, str) else self.part


class NamedParameter(Section):
    """``[[parameter]]``: a positive number that several laws share; with an sd it is calibrated."""

    name: Name
    start: Annotated[float, Field(gt=0.0, le=1e12)]
    unit: str = "1"
    description: Text | None = None


class MachineDefinition(Section):
    """The whole file of a machine, with geometry or without: its name, and the tables that both kinds have."""

    schema_number: Literal[1] = Field(alias="schema")
    name: Text
    input: tuple[NamedInput, ...] = ()
    parameter: tuple[NamedParameter, ...] = ()
    boundary: tuple[Boundary, ...] = ()
    part: tuple[Part, ...] = ()
    link: tuple[Path, ...] = ()
    heat: tuple[Heat, ...] = ()
    recording: dict[str, Any] = Field(default_factory=dict)

    @property
    @abstractmethod
    def ambient_degC(self) -> float:
        """Temperature of the surroundings where a recording names none."""

    @property
    @abstractmethod
    def full_operation(self) -> tuple[float, float, float]:
        """Speed [1/min] and torque [N m] of full operation, and the temperature of warm parts, [degC]."""

    @property
    @abstractmethod
    def own_inputs(self) -> dict[str, Input]:
        """Inputs by name that it has without any of these tables."""

    @property
    def own_parts(self) -> tuple[str, ...]:
        """Parts that it has without any of these tables."""
        return ()

    @property
    def own_boundaries(self) -> tuple[str, ...]:
        """Boundaries that it has without any of these tables."""
        return ()

    @property
    def own_signals(self) -> tuple[str, ...]:
        """Names in laws that it has without these tables, but for inputs and temperatures."""
        return ()

    @property
    def derived(self) -> tuple[str, ...]:
        """Signals that follow from inputs."""
        return ()

    @property
    def inputs(self) -> dict[str, Input]:
        """Inputs of the network by name: its own, ``[[input]]``, then temperatures of boundaries."""
        known = self.own_inputs | {given.name: given.as_input() for given in self.input}
        return known | {b.input: b.as_input() for b in self.boundary if b.input not in known}
