"""A definition without geometry: its tables, and what must agree between them.

A user who has a recording of a gearbox mostly has no drawings of it. The forms of losses and heat paths are known
nevertheless: a loss has a part that depends on the load and one that does not, heat flows from part to part and out,
oil returns from a circuit. The sizes are guesses with wide priors, which a recording narrows. Temperatures alone
determine only ratios of heats, conductances and capacities; see :mod:`diagnosis.results.identifiable`.

The tables are ``[reference]``, ``[ambient]``, ``[oil]``, ``[[boundary]]``, ``[[part]]``, ``[[link]]``, ``[[loss]]`` and
``[recording]``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from models.base.errors import did_you_mean
from models.definition.sections import FluidTemperature, Name, OneOrMore, Section, Text, Viscosity
from models.formulas.oil import d341_constants
from models.quantities.definition_units import between

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

    viscosity_points: tuple[tuple[FluidTemperature, Viscosity], tuple[FluidTemperature, Viscosity]]


class Boundary(Section):
    """``[[boundary]]``: air of a recorded temperature; `input` is the name of that signal."""

    name: Name
    input: Name
    temperature_degC: Annotated[float, between(-60.0, 150.0)]


class Part(Section):
    """``[[part]]``: an isothermal part; `group` makes it one of what mechanisms look for."""

    name: Name
    heat_capacity_J_K: Annotated[float, between(1.0, 1e9)]
    group: Literal["housing", "bearings", "returns"] | None = None


class Path(Section):
    """``[[link]]``: a heat path; `standstill_share` of its conductance is left when the gearbox stands."""

    between: tuple[Name, Name]
    conductance_W_K: Annotated[float, between(1e-4, 1e6)]
    standstill_share: Annotated[float, between(1e-4, 1.0)] = 1.0


class Loss(Section):
    """``[[loss]]``: heat in a part at the reference, without load and by the load, and how it goes with operation."""

    name: Name
    part: Name
    no_load_W: Annotated[float, between(0.0, 1e7)]
    speed_exponent: Annotated[float, between(0.0, 5.0)] = 1.5
    viscosity_exponent: Annotated[float, between(-1.0, 2.0)] = 0.3
    load_W: Annotated[float, between(0.0, 1e7)]
    torque_exponent: Annotated[float, between(0.0, 3.0)] = 1.0


class ParametricDefinition(Section):
    """The whole file of a gearbox whose geometry is not known."""

    schema_number: Literal[1] = Field(alias="schema")
    name: Text
    reference: Reference
    ambient: Surroundings
    oil: Lubricant
    boundary: OneOrMore[Boundary]
    part: OneOrMore[Part]
    link: OneOrMore[Path]
    loss: OneOrMore[Loss]
    recording: dict[str, Any] = Field(default_factory=dict)

    @property
    def viscosity_constants(self) -> tuple[float, float]:
        """Constants m and n of the oil's viscosity, see :func:`models.formulas.oil.kinematic_viscosity_d341`."""
        (T_1, nu_1), (T_2, nu_2) = self.oil.viscosity_points
        return d341_constants(T_1, nu_1, T_2, nu_2)

    @model_validator(mode="after")
    def _tables_agree(self) -> Self:
        faults = [*_names(self), *_links(self)]
        if faults:
            raise ValueError("\n".join(faults))
        return self


def _names(definition: ParametricDefinition) -> Iterator[str]:
    parts = [part.name for part in definition.part]
    for name, count in Counter([*parts, *(b.name for b in definition.boundary)]).items():
        if count > 1:
            yield f"name '{name}' is given {count} times; every part and boundary needs its own"
    for name, count in Counter(loss.name for loss in definition.loss).items():
        if count > 1:
            yield f"loss: '{name}' is given {count} times"
    for loss in definition.loss:
        if loss.part not in parts:
            yield f"loss '{loss.name}'.part: there is no part '{loss.part}'{did_you_mean(loss.part, parts)}"
    if "T_ambient" not in [b.input for b in definition.boundary]:
        yield "boundary: none has input = 'T_ambient'; the air around the gearbox needs it"
    if "oil" not in parts:
        yield "part: none is called 'oil'; its temperature determines the viscosity"


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
