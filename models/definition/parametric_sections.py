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
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, model_validator

from models.base.errors import did_you_mean
from models.definition.machine_definition import Boundary, MachineDefinition, Part, Path
from models.definition.machine_faults import input_faults, link_faults, name_faults, repeated_names
from models.definition.sections import (
    FluidTemperature,
    Name,
    OneOrMore,
    Section,
    Viscosity,
    check_viscosity_points,
)
from models.formulas.oil import TYPICAL_OIL, d341_constants
from models.quantities.definition_units import between
from models.quantities.quantities import Input, usual_inputs


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


class TorqueFromPower(Section):
    """``[torque]``: torque at the input shaft from a measured power: ``efficiency * power / speed``."""

    power: Name
    efficiency: Annotated[float, between(0.01, 1.5)]


class Loss(Section):
    """``[[loss]]``: heat in a part at the reference, without load and by the load, and how it goes with operation.

    `kind` is what loses it. Unless stated, a loss in a part of the group of bearings is theirs, one whose name begins
    with ``seal`` that of seals, and any other that of gears: churning without load, sliding by the load.
    """

    name: Name
    part: Name
    kind: Literal["gears", "bearings", "seals", "other"] | None = None
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


class ParametricDefinition(MachineDefinition):
    """The whole file of a machine whose geometry is not known."""

    reference: Reference | None = None
    ambient: Surroundings | None = None
    oil: Lubricant | None = None
    torque: TorqueFromPower | None = None
    boundary: OneOrMore[Boundary]
    part: OneOrMore[Part]
    link: OneOrMore[Path]
    loss: tuple[Loss, ...] = ()

    @property
    def viscosity_constants(self) -> tuple[float, float]:
        """Constants m and n of the oil's viscosity, see :func:`models.formulas.oil.kinematic_viscosity_d341`."""
        if self.oil is None:
            return TYPICAL_OIL
        (T_1, nu_1), (T_2, nu_2) = self.oil.viscosity_points
        return d341_constants(T_1, nu_1, T_2, nu_2)

    @property
    def own_inputs(self) -> dict[str, Input]:
        """Speed and torque if there are losses, the torque unless it follows from a power."""
        names = ("speed", *(("torque",) if self.torque is None else ())) if self.loss else ()
        return usual_inputs(**dict.fromkeys(names, 0.0))

    @property
    def own_signals(self) -> tuple[str, ...]:
        """Names that :func:`models.assembly.parametric.build_parametric_network` gives to losses and their factors."""
        kinds, of_power = ("no_load", "load"), () if self.torque is None else ("efficiency",)
        exponents = ("speed_exponent", "viscosity_exponent", "torque_exponent")
        losses = dict.fromkeys(loss.name for loss in self.loss)  # those of one name are reported as such
        factors = (f"{name}_{kind}" for name in losses for kind in (*kinds, *exponents))
        return (*factors, *(f"P_{name}_{kind}" for name in losses for kind in kinds), *of_power)

    @property
    def derived(self) -> tuple[str, ...]:
        """The torque, if it follows from a power."""
        return () if self.torque is None else ("torque",)

    @property
    def operation(self) -> Reference:
        """Speed, torque and temperature at which laws are stated; of a machine without losses ones."""
        return self.reference or Reference(speed_rpm=1.0, torque_Nm=1.0, temperature_degC=60.0, running_rpm=1.0)

    @property
    def full_operation(self) -> tuple[float, float, float]:
        """Speed [1/min], torque [N m] and temperature [degC] at which laws are stated."""
        return self.operation.speed_rpm, self.operation.torque_Nm, self.operation.temperature_degC

    @property
    def ambient_degC(self) -> float:
        """Temperature of the surroundings where a recording names none."""
        if self.ambient is not None:
            return self.ambient.temperature_degC
        name = "T_ambient" if "T_ambient" in self.inputs else self.boundary[0].input
        return self.inputs[name].default

    @model_validator(mode="after")
    def _tables_agree(self) -> Self:
        faults = [*name_faults(self), *input_faults(self), *_torque(self), *_losses(self), *link_faults(self)]
        if faults:
            raise ValueError("\n".join(faults))
        return self


def _torque(definition: ParametricDefinition) -> Iterator[str]:
    if definition.torque is None:
        return
    named = {given.name: given for given in definition.input}
    power = named.get(definition.torque.power)
    if power is None or power.quantity != "power":
        hint = did_you_mean(definition.torque.power, named)
        yield f"torque.power: there is no [[input]] '{definition.torque.power}' with quantity = 'power'{hint}"
    if "torque" in named:
        yield "input 'torque': the torque follows from a power ([torque]); keep one of them"
    if not definition.loss:
        yield "torque: there is no [[loss]] that needs it"


def _losses(definition: ParametricDefinition) -> Iterator[str]:
    parts = [part.name for part in definition.part]
    yield from repeated_names("loss", Counter(loss.name for loss in definition.loss))
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
