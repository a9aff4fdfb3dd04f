"""A definition without geometry: losses as parametric laws, and a network of as many parts as are known.

Whoever holds a recording of a gearbox mostly does not hold its drawings. What remains is the form of things: a loss has
a part that does not depend on the load and one that does, heat flows from part to part and out, oil comes back from
somewhere. The sizes are guesses with wide priors; a recording narrows them. Temperatures alone tell only ratios of
heats, conductances and capacities; see :mod:`diagnosis.identifiable`.

The tables are ``[reference]``, ``[ambient]``, ``[oil]``, ``[[boundary]]``, ``[[part]]``, ``[[link]]``, ``[[loss]]`` and
``[recording]``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike
from pydantic import Field

from models.definition import FluidTemperature, Name, Section, Text, Viscosity
from models.errors import did_you_mean
from models.laws import Parameter, symbol
from models.network import Link, Node, Source, ThermalNetwork
from models.oil import T_HIGHEST, T_LOWEST, d341_constants, kinematic_viscosity_d341
from models.quantity import between
from models.types import Array

if TYPE_CHECKING:
    from models.gearbox import Gearbox

KEY = "part"  # a definition with this table has no geometry
GROUPS = ("housing", "bearings", "returns")
RUN_POWER = 8  # how sharply running is told from standstill by speed
RATIOS = (0.02, 50.0)  # of speed, torque or viscosity, beyond which an exponent's deviation counts no further
FARTHEST = 1000.0  # a factor is found within so many times what the definition says; its prior keeps it much nearer


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
    boundary: Annotated[tuple[Boundary, ...], Field(min_length=1)]
    part: Annotated[tuple[Part, ...], Field(min_length=1)]
    link: Annotated[tuple[Path, ...], Field(min_length=1)]
    loss: Annotated[tuple[Loss, ...], Field(min_length=1)]
    recording: dict[str, Any] = Field(default_factory=dict)


def parametric_faults(values: Mapping[str, Any]) -> Iterator[str]:
    """What is wrong between the tables of such a definition, one text per fault, each beginning with a path."""
    parts, boundaries = _names(values, "part"), _names(values, "boundary")
    for name, count in Counter([*parts, *boundaries]).items():
        if count > 1:
            yield f"name '{name}' is given {count} times; every part and boundary needs its own"
    for name, count in Counter(_names(values, "loss")).items():
        if count > 1:
            yield f"loss: '{name}' is given {count} times"
    yield from _link_faults(values, parts, boundaries)
    for index, loss in _tables(values, "loss"):
        part = loss.get("part")
        if isinstance(part, str) and part not in parts:
            yield f"loss.{index}.part: there is no part '{part}'{did_you_mean(part, parts)}"
    signals = [b.get("input") for _, b in _tables(values, "boundary")]
    if boundaries and "T_ambient" not in signals:
        yield "boundary: none has input = 'T_ambient'; the air around the gearbox needs it"
    if "oil" not in parts and parts:
        yield "part: none is called 'oil'; its temperature decides on viscosity"


def _link_faults(values: Mapping[str, Any], parts: list[str], boundaries: list[str]) -> Iterator[str]:
    ends = [*parts, *boundaries]
    joined: list[frozenset[str]] = []
    for index, link in _tables(values, "link"):
        pair, path = link.get("between", ()), f"link.{index}.between"
        names = [n for n in pair if isinstance(n, str)] if isinstance(pair, tuple) else []
        for name in names:
            if name not in ends:
                yield f"{path}: there is no part or boundary '{name}'{did_you_mean(name, ends)}"
        if len(names) != 2:
            continue  # the validation says so
        if names[0] == names[1]:
            yield f"{path}: joins '{names[0]}' with itself"
        if set(names) <= set(boundaries):
            yield f"{path}: joins two boundaries; heat between them warms nothing"
        if frozenset(names) in joined:
            yield f"{path}: {' and '.join(names)} are joined already"
        joined.append(frozenset(names))


def _tables(values: Mapping[str, Any], key: str) -> Iterator[tuple[int, Mapping[str, Any]]]:
    items = values.get(key, ())
    for index, item in enumerate(items if isinstance(items, tuple) else ()):
        if isinstance(item, Mapping):
            yield index, item


def _names(values: Mapping[str, Any], key: str) -> list[str]:
    return [table["name"] for _, table in _tables(values, key) if isinstance(table.get("name"), str)]


def viscosity_constants(definition: ParametricDefinition) -> tuple[float, float]:
    """Constants m and n of the oil's viscosity, see :func:`models.oil.kinematic_viscosity_d341`."""
    (T_1, nu_1), (T_2, nu_2) = definition.oil.viscosity_points
    return d341_constants(T_1, nu_1, T_2, nu_2)


@dataclass(frozen=True)
class ParametricLosses:
    r"""Losses of a gearbox of which only the form is known.

    .. math::

        P = P_0 \left(\frac{n}{n_r}\right)^a \left(\frac{\nu}{\nu_r}\right)^b
            + P_1 \frac{n}{n_r} \left(\frac{M}{M_r}\right)^c

    with the viscosity at the temperature of the part that the loss warms.

    References
    ----------
    ISO/TR 14179-1 and -2: load-independent (churning, seals, no-load bearing friction: exponents of speed from 1 to 3,
    of viscosity from 0 to 0.6) and load-dependent losses (mesh and bearings: proportional to power at constant
    friction).
    """

    definition: ParametricDefinition

    @property
    def components(self) -> tuple[str, ...]:
        """Two per loss: ``<name>_no_load`` and ``<name>_load``."""
        return tuple(f"{loss.name}_{kind}" for loss in self.definition.loss for kind in ("no_load", "load"))

    @property
    def temperature_nodes(self) -> tuple[str, ...]:
        """Parts that losses warm."""
        return tuple(dict.fromkeys(loss.part for loss in self.definition.loss))

    @property
    def reads(self) -> tuple[frozenset[str], ...]:
        """Which of these each component reads: the part that it warms."""
        return tuple(frozenset({loss.part}) for loss in self.definition.loss for _ in ("no_load", "load"))

    def power(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Losses [W], shape (..., components), at speed [1/min], torque [N m] and temperatures [degC]."""
        reference, nodes = self.definition.reference, self.temperature_nodes
        T = np.asarray(temperatures, dtype=float)
        n = np.abs(np.asarray(speed, dtype=float)) / reference.speed_rpm
        m = np.abs(np.asarray(torque, dtype=float)) / reference.torque_Nm
        constants = viscosity_constants(self.definition)
        nu_ref = kinematic_viscosity_d341(reference.temperature_degC, *constants)
        found = []
        for loss in self.definition.loss:
            T_here = np.clip(T[..., nodes.index(loss.part)], T_LOWEST, T_HIGHEST)
            nu = kinematic_viscosity_d341(T_here, *constants) / nu_ref
            # At standstill nothing is lost, whatever the exponent.
            turning = n > 0.0
            no_load = loss.no_load_W * n**loss.speed_exponent * nu**loss.viscosity_exponent
            found += [np.where(turning, no_load, 0.0), loss.load_W * n * m**loss.torque_exponent + 0.0 * T_here]
        return np.stack(np.broadcast_arrays(*found), axis=-1)

    def domain_distance(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Zero everywhere, shape (...): the laws hold as well, or as badly, at any operating point."""
        T = np.asarray(temperatures, dtype=float)[..., 0]
        return np.zeros(np.broadcast_shapes(np.shape(speed), np.shape(torque), T.shape))


def build_parametric_network(gearbox: Gearbox, definition: ParametricDefinition) -> ThermalNetwork:
    """The network that the tables of a definition without geometry spell out.

    Every value with a standard deviation becomes a factor on it: ``C_<part>``, ``G_<part>_<part>``,
    ``standstill_<part>_<part>``, ``<loss>_no_load``, ``<loss>_load``; exponents become deviations from what is
    assumed: ``<loss>_speed_exponent`` and its like.

    Parameters
    ----------
    gearbox : Gearbox
        Tells the standard deviations
    definition : ParametricDefinition
    """
    return _Builder(definition, gearbox.priors).network()


class _Builder:
    """The definition at hand while its network is put together."""

    def __init__(self, definition: ParametricDefinition, priors: Mapping[str, float]) -> None:
        self.definition, self.priors = definition, priors
        self.parameters: list[Parameter] = []
        self.n = sp.Abs(symbol("speed")) / definition.reference.speed_rpm
        self.m = sp.Abs(symbol("torque")) / definition.reference.torque_Nm

    def network(self) -> ThermalNetwork:
        definition = self.definition
        boundaries = [Node(name=b.name, temperature=symbol(b.input)) for b in definition.boundary]
        parts = [
            Node(name=part.name, capacity=part.heat_capacity_J_K * self._factor(
                f"C_{part.name}", f"part.{index}.heat_capacity_J_K", part.heat_capacity_J_K,
                f"factor on the heat capacity of {part.name}"))
            for index, part in enumerate(definition.part)
        ]  # fmt: skip
        links = [self._link(index, path) for index, path in enumerate(definition.link)]
        sources = [source for index, loss in enumerate(definition.loss) for source in self._sources(index, loss)]
        return ThermalNetwork(
            nodes=(*boundaries, *parts),
            links=tuple(links),
            sources=tuple(sources),
            parameters=tuple(self.parameters),
            components=ParametricLosses(definition).components,
            inputs={b.input: b.temperature_degC for b in definition.boundary},
            groups={g: names for g in GROUPS if (names := tuple(p.name for p in definition.part if p.group == g))},
            recording=definition.recording,
        )

    def _link(self, index: int, path: Path) -> Link:
        a, b = path.between
        name = f"{a}_{b}"
        G = path.conductance_W_K * self._factor(
            f"G_{name}", f"link.{index}.conductance_W_K", path.conductance_W_K, f"factor on the conductance {a} - {b}"
        )
        if path.standstill_share < 1.0:
            share = path.standstill_share * self._factor(
                f"standstill_{name}", f"link.{index}.standstill_share", path.standstill_share,
                f"factor on the share of the conductance {a} - {b} at standstill", highest=1.0 / path.standstill_share,
            )  # fmt: skip
            speed = sp.Abs(symbol("speed")) / self.definition.reference.running_rpm
            running = speed**RUN_POWER / (1 + speed**RUN_POWER)
            G = G * (share + (1 - share) * running)
        return Link(name=f"{a}-{b}", nodes=(a, b), conductance=sp.sympify(G))

    def _sources(self, index: int, loss: Loss) -> Iterator[Source]:
        path = f"loss.{index}"
        constants = viscosity_constants(self.definition)
        T = sp.Min(sp.Max(symbol(f"T_{loss.part}"), T_LOWEST), T_HIGHEST)
        nu_ref = kinematic_viscosity_d341(self.definition.reference.temperature_degC, *constants)
        nu = kinematic_viscosity_d341(T, *constants, xp=sp) / nu_ref
        no_load = self._factor(f"{loss.name}_no_load", f"{path}.no_load_W", loss.no_load_W, f"no-load loss {loss.name}")
        no_load *= self._tilt(f"{loss.name}_speed_exponent", f"{path}.speed_exponent", self.n)
        no_load *= self._tilt(f"{loss.name}_viscosity_exponent", f"{path}.viscosity_exponent", nu)
        load = self._factor(f"{loss.name}_load", f"{path}.load_W", loss.load_W, f"load-dependent loss {loss.name}")
        load *= self._tilt(f"{loss.name}_torque_exponent", f"{path}.torque_exponent", self.m)
        for kind, law in (("no_load", no_load), ("load", load)):
            name = f"{loss.name}_{kind}"
            # The loss as assumed, times what a recording made of it; its name is the parameter's, so apart from it.
            yield Source(name=name, node=loss.part, heat=symbol(f"P_{name}") * law, is_loss=True)

    def _factor(self, name: str, path: str, value: float, description: str, *, highest: float = FARTHEST) -> sp.Expr:
        sd = self.priors.get(path, 0.0)
        if sd <= 0.0 or value == 0.0:
            return sp.Integer(1)
        self.parameters.append(Parameter(
            name=name, start=1.0, lower=1.0 / FARTHEST, upper=highest, sd=sd / abs(value), description=description,
        ))  # fmt: skip
        return symbol(name)

    def _tilt(self, name: str, path: str, ratio: sp.Expr) -> sp.Expr:
        """``ratio ** deviation`` of an uncertain exponent."""
        sd = self.priors.get(path, 0.0)
        if sd <= 0.0:
            return sp.Integer(1)
        self.parameters.append(Parameter(
            name=name, start=0.0, lower=-2.0, upper=2.0, sd=sd, log=False, description="deviation from what is assumed",
        ))  # fmt: skip
        return sp.Min(sp.Max(ratio, RATIOS[0]), RATIOS[1]) ** symbol(name)
