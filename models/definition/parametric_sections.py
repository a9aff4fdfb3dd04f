"""A definition without geometry: its tables, and what must agree between them.

A user who has a recording of a gearbox mostly has no drawings of it. The forms of losses and heat paths are known
nevertheless: a loss has a part that depends on the load and one that does not, heat flows from part to part and out,
oil returns from a circuit. The sizes are guesses with wide priors, which a recording narrows. Temperatures alone
determine only ratios of heats, conductances and capacities; see :func:`diagnosis.results.notes.ratio_notes`.

The tables are ``[[input]]``, ``[[boundary]]``, ``[[part]]``, ``[[link]]``, ``[[heat]]``, ``[[loss]]`` with
``[reference]`` and ``[oil]``, ``[torque]``, ``[[parameter]]``, ``[ambient]`` and ``[recording]``. A machine without
losses, such as a heated test body, needs neither speed nor torque.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from keyword import iskeyword
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from models.base.errors import did_you_mean
from models.definition.sections import (
    FluidTemperature,
    Name,
    OneOrMore,
    Section,
    Text,
    Viscosity,
    check_viscosity_points,
)
from models.formulas.oil import TYPICAL_OIL, d341_constants
from models.quantities.definition_units import between
from models.quantities.quantities import GEARBOX_INPUTS, INPUT_KINDS, Input, named_input, usual_inputs
from models.quantities.units import INSIDE, find_unit, units_in_files

KEY = "part"  # a definition with this table has no geometry


class Reference(Section):
    """``[reference]``: where the losses are stated, and the speed between standing and running."""

    speed_rpm: Annotated[float, between(1e-3, 1e5)]
    torque_Nm: Annotated[float, between(1e-6, 1e7)]
    temperature_degC: FluidTemperature
    running_rpm: Annotated[float, between(1e-3, 1e5)]


class Surroundings(Section):
    """``[ambient]``: the air where a recording names none."""

    temperature_degC: Annotated[float, between(-60.0, 80.0)]


class Lubricant(Section):
    """``[oil]``: two points of its viscosity, known or assumed."""

    viscosity_points: Annotated[
        tuple[tuple[FluidTemperature, Viscosity], tuple[FluidTemperature, Viscosity]],
        AfterValidator(check_viscosity_points),
    ]


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


class Part(Section):
    """``[[part]]``: an isothermal part; `group` makes it one of what mechanisms look for."""

    name: Name
    heat_capacity_J_K: Annotated[float, between(1.0, 1e9)]
    group: Literal["housing", "bearings", "returns"] | None = None


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


class TorqueFromPower(Section):
    """``[torque]``: torque at the input shaft from a measured power: ``efficiency * power / speed``."""

    power: Name
    efficiency: Annotated[float, between(0.01, 1.5)]


class Loss(Section):
    """``[[loss]]``: heat in a part at the reference, without load and by the load, and how it goes with operation."""

    name: Name
    part: Name
    no_load_W: Annotated[float, between(0.0, 1e7)]
    speed_exponent: Annotated[float, between(0.0, 5.0)] = 1.5
    viscosity_exponent: Annotated[float, between(-1.0, 2.0)] = 0.3
    load_W: Annotated[float, between(0.0, 1e7)]
    torque_exponent: Annotated[float, between(0.0, 3.0)] = 1.0

    @model_validator(mode="after")
    def _is_a_loss(self) -> Self:
        if self.no_load_W == self.load_W == 0.0:
            raise ValueError(f"no_load_W and load_W of '{self.name}' are both 0; give one, or leave the loss out")
        return self


class ParametricDefinition(Section):
    """The whole file of a machine whose geometry is not known."""

    schema_number: Literal[1] = Field(alias="schema")
    name: Text
    reference: Reference | None = None
    ambient: Surroundings | None = None
    oil: Lubricant | None = None
    input: tuple[NamedInput, ...] = ()
    parameter: tuple[NamedParameter, ...] = ()
    torque: TorqueFromPower | None = None
    boundary: OneOrMore[Boundary]
    part: OneOrMore[Part]
    link: OneOrMore[Path]
    heat: tuple[Heat, ...] = ()
    loss: tuple[Loss, ...] = ()
    recording: dict[str, Any] = Field(default_factory=dict)

    @property
    def viscosity_constants(self) -> tuple[float, float]:
        """Constants m and n of the oil's viscosity, see :func:`models.formulas.oil.kinematic_viscosity_d341`."""
        if self.oil is None:
            return TYPICAL_OIL
        (T_1, nu_1), (T_2, nu_2) = self.oil.viscosity_points
        return d341_constants(T_1, nu_1, T_2, nu_2)

    @property
    def inputs(self) -> dict[str, Input]:
        """Inputs of the network by name: speed and torque if there are losses, ``[[input]]``, then boundaries."""
        own = {given.name: given.as_input() for given in self.input}
        shaft = usual_inputs(speed=0.0, torque=0.0) if self.loss else {}
        if self.torque is not None:
            shaft.pop("torque", None)
        return shaft | own | {b.input: _air(b) for b in self.boundary if b.input not in own}

    @property
    def operation(self) -> Reference:
        """Speed, torque and temperature at which laws are stated; of a machine without losses ones."""
        return self.reference or Reference(speed_rpm=1.0, torque_Nm=1.0, temperature_degC=60.0, running_rpm=1.0)

    @property
    def ambient_degC(self) -> float:
        """Temperature of the surroundings where a recording names none."""
        if self.ambient is not None:
            return self.ambient.temperature_degC
        name = "T_ambient" if "T_ambient" in self.inputs else self.boundary[0].input
        return self.inputs[name].default

    @model_validator(mode="after")
    def _tables_agree(self) -> Self:
        faults = [*_names(self), *_inputs(self), *_losses(self), *_links(self)]
        if faults:
            raise ValueError("\n".join(faults))
        return self


def _names(definition: ParametricDefinition) -> Iterator[str]:
    parts = [part.name for part in definition.part]
    for name, count in Counter([*parts, *(b.name for b in definition.boundary)]).items():
        if count > 1:
            yield f"name '{name}' is given {count} times; every part and boundary needs its own"
    for what, tables in (("loss", definition.loss), ("heat", definition.heat)):
        repeated = Counter(one.name for one in tables)
        yield from (f"{what}: '{name}' is given {count} times" for name, count in repeated.items() if count > 1)
        if "T" in repeated:
            yield f"{what}: the name 'T' is that of temperatures; choose another"
    signals = (*(given.name for given in definition.input), *(p.name for p in definition.parameter))
    yield from (f"'{name}' has a meaning in formulas; give the input or parameter another name" for name in signals
                if iskeyword(name) or name in ("pi", "math", "numpy"))  # fmt: skip
    for heat in definition.heat:
        for part in heat.parts:
            if part not in parts:
                yield f"heat '{heat.name}'.part: there is no part '{part}'{did_you_mean(part, parts)}"


def _inputs(definition: ParametricDefinition) -> Iterator[str]:
    named = {given.name: given for given in definition.input}
    taken = Counter(["time", *(p.name for p in definition.parameter), *(f"T_{part.name}" for part in definition.part)])
    taken.update(f"T_{b.name}" for b in definition.boundary if b.input != f"T_{b.name}")
    taken.update({given.name for given in definition.input} | {b.input for b in definition.boundary})
    taken.update(_factors(definition))
    yield from (
        f"'{name}' names several inputs, parameters, factors or nodes" for name, count in taken.items() if count > 1
    )
    for boundary in definition.boundary:
        yield from _boundary_input(boundary, named.get(boundary.input))
    if definition.torque is None:
        return
    power = named.get(definition.torque.power)
    if power is None or power.quantity != "power":
        hint = did_you_mean(definition.torque.power, named)
        yield f"torque.power: there is no [[input]] '{definition.torque.power}' with quantity = 'power'{hint}"
    if "torque" in named:
        yield "input 'torque': the torque follows from a power ([torque]); keep one of them"
    if not definition.loss:
        yield "torque: there is no [[loss]] that needs it"


def _factors(definition: ParametricDefinition) -> Iterator[str]:
    """Names that :func:`models.assembly.parametric.build_parametric_network` gives to factors and losses."""
    # Tables of one name are told of as such.
    yield from (f"C_{name}" for name in {part.name for part in definition.part})
    yield from (
        f"{kind}_{a}_{b}" for a, b in {path.between for path in definition.link} for kind in ("G", "standstill")
    )
    yield from (f"{name}_gain" for name in {heat.name for heat in definition.heat})
    losses, kinds = {loss.name for loss in definition.loss}, ("no_load", "load")
    exponents = ("speed_exponent", "viscosity_exponent", "torque_exponent")
    yield from (f"{name}_{kind}" for name in losses for kind in (*kinds, *exponents))
    yield from (f"P_{name}_{kind}" for name in losses for kind in kinds)
    if definition.torque is not None:
        yield "efficiency"


def _boundary_input(boundary: Boundary, own: NamedInput | None) -> Iterator[str]:
    if own is None and boundary.temperature_degC is None:
        yield (
            f"boundary '{boundary.name}': '{boundary.input}' is no [[input]]; declare it, or give temperature_degC for "
            "recordings without it"
        )
    if own is not None:
        quantity = own.as_input().quantity
        if not quantity.is_temperature:
            yield f"boundary '{boundary.name}'.input: '{boundary.input}' is a {own.quantity}, not a temperature"
        elif quantity.unit != "degC":
            yield f"input '{own.name}'.unit: the temperature of a boundary is in degC, not {quantity.unit}"


def _losses(definition: ParametricDefinition) -> Iterator[str]:
    parts = [part.name for part in definition.part]
    for loss in definition.loss:
        if loss.part not in parts:
            yield f"loss '{loss.name}'.part: there is no part '{loss.part}'{did_you_mean(loss.part, parts)}"
    if definition.loss:
        absent = [key for key in ("reference", "oil") if getattr(definition, key) is None]
        yield from (f"{key} is missing; [[loss]] needs it" for key in absent)
        if "T_ambient" not in definition.inputs:
            yield "boundary: none has input = 'T_ambient'; the air around the gearbox needs it"
        if "oil" not in parts:
            yield "part: none is called 'oil'; its temperature determines the viscosity"
    elif any(link.standstill_share < 1.0 for link in definition.link) and (
        definition.reference is None or "speed" not in definition.inputs
    ):
        yield "link.standstill_share: needs running_rpm in [reference], and an [[input]] with name = 'speed'"


def _air(boundary: Boundary) -> Input:
    """Return the temperature of a boundary as an input."""
    default = 0.0 if boundary.temperature_degC is None else boundary.temperature_degC
    if boundary.input in GEARBOX_INPUTS:
        return usual_inputs(**{boundary.input: default})[boundary.input]
    return named_input(
        boundary.input, "temperature", low=-90.0, high=250.0, default=default,
        description=f"Temperature of {boundary.name.replace('_', ' ')}",
    )  # fmt: skip


def _links(definition: ParametricDefinition) -> Iterator[str]:
    boundaries = [b.name for b in definition.boundary]
    ends = [*(part.name for part in definition.part), *boundaries]
    joined: list[frozenset[str]] = []
    for number, link in enumerate(definition.link, start=1):
        pair, place = frozenset(link.between), f"link #{number}.between"
        for name in link.between:
            if name not in ends:
                yield f"{place}: there is no part or boundary '{name}'{did_you_mean(name, ends)}"
        if len(pair) == 1:
            yield f"{place}: joins '{link.between[0]}' with itself"
        if pair <= set(boundaries):
            yield f"{place}: joins two boundaries; heat between them warms nothing"
        if pair in joined:
            yield f"{place}: {' and '.join(link.between)} are joined already"
        joined.append(pair)
