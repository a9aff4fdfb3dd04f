"""Parts of a thermal network: nodes, links and sources, each with a symbolic law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import sympy as sp
from numpy.typing import ArrayLike

from models.base.types import Array
from models.network.laws import NumericLaw, Parameter, Signals, symbol
from models.quantities.quantities import Input


class Losses(Protocol):
    """Interface of a loss model to a network; the full model (F-PL) and the surrogate (ROM-PL) both have it."""

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the losses."""
        ...

    @property
    def temperature_nodes(self) -> tuple[str, ...]:
        """Nodes whose temperatures are read."""
        ...

    @property
    def reads(self) -> tuple[frozenset[str], ...]:
        """Which of these nodes each component reads."""
        ...

    def power(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Losses [W], shape (..., components), at speed [1/min], torque [N m] and temperatures [degC]."""
        ...

    def domain_distance(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """How far outside its domain the model is asked, as a fraction of the domain's range; 0 inside. Shape (...)."""
        ...


@dataclass(frozen=True, kw_only=True)
class Node:
    """An isothermal part of the gearbox, or a boundary of known temperature.

    Attributes
    ----------
    capacity : sympy.Expr or None
        Heat capacity, [J/K]; None for a boundary
    temperature : sympy.Expr or None
        Temperature of a boundary, [degC]; None for a part of the gearbox
    """

    name: str
    capacity: sp.Expr | None = None
    temperature: sp.Expr | None = None


@dataclass(frozen=True, kw_only=True)
class Link:
    """A heat path between two nodes; `conductance` in [W/K]."""

    name: str
    nodes: tuple[str, str]
    conductance: sp.Expr


@dataclass(frozen=True, kw_only=True)
class Source:
    """A heat source in a node; `heat` in [W].

    Attributes
    ----------
    is_loss : bool
        Whether the heat is mechanical power lost, and counts as such
    acts_as : tuple of str
        What a definition with geometry would call it, see :mod:`models.mechanisms.places`
    """

    name: str
    node: str
    heat: sp.Expr
    is_loss: bool
    acts_as: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ExtraState:
    """A state of the network in addition to its temperatures.

    Attributes
    ----------
    rate : sympy.Expr
        Time derivative, [1/s]; 0 for a state that only switches
    update : sympy.Expr or None
        Its value after each accepted step of the solver, e.g. a thermostat's hysteresis
    averaged_update : sympy.Expr or None
        The same where temperatures are means over minutes, which hide the moment at which something switches
    """

    name: str
    start: float
    rate: sp.Expr
    update: sp.Expr | None
    averaged_update: sp.Expr | None = None

    def with_laws(self, changed: Callable[[sp.Expr], sp.Expr]) -> ExtraState:
        """The state with each of its laws changed."""
        update, averaged = (None if law is None else changed(law) for law in (self.update, self.averaged_update))
        return replace(self, rate=changed(self.rate), update=update, averaged_update=averaged)


BASE_SIGNALS = ("time",)


@dataclass(frozen=True, kw_only=True, eq=False)
class Network:
    """Nodes, links and sources of one gearbox.

    Attributes
    ----------
    components : tuple of str
        Losses that the sources may use as the signal ``P_<component>``
    inputs : mapping of str to Input
        By the name that laws use, in the order of the solver's columns
    derived : mapping of str to sympy.Expr
        Signals that follow from inputs and parameters, as a torque from an electrical power
    groups : mapping of str to tuple of str
        Names for several nodes together, e.g. ``housing``
    numeric_laws : mapping of str to NumericLaw
        Laws that could not be traced, by the symbol in their place
    operating : mapping of str to sympy.Expr
        ``speed`` or ``torque`` as the losses see it, if that is not the input itself
    recording : mapping
        How recordings of this gearbox name their columns, as in a mapping file, if the definition states it
    """

    nodes: tuple[Node, ...]
    links: tuple[Link, ...] = ()
    sources: tuple[Source, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    components: tuple[str, ...] = ()
    inputs: Mapping[str, Input] = field(default_factory=dict)
    derived: Mapping[str, sp.Expr] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    states: tuple[ExtraState, ...] = ()
    numeric_laws: Mapping[str, NumericLaw] = field(default_factory=dict)
    operating: Mapping[str, sp.Expr] = field(default_factory=dict)
    recording: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def node_names(self) -> tuple[str, ...]:
        """All nodes, in order."""
        return tuple(node.name for node in self.nodes)

    @cached_property
    def parts(self) -> tuple[Node, ...]:
        """Nodes whose temperature is a state."""
        return tuple(node for node in self.nodes if node.temperature is None)

    @cached_property
    def boundaries(self) -> dict[str, sp.Expr]:
        """Nodes of given temperature, with its law, [degC]."""
        return {node.name: node.temperature for node in self.nodes if node.temperature is not None}

    @cached_property
    def varying(self) -> tuple[bool, ...]:
        """True for every link whose conductance depends on more than parameters."""
        parameters = {parameter.name for parameter in self.parameters}
        return tuple(bool({s.name for s in link.conductance.free_symbols} - parameters) for link in self.links)

    @cached_property
    def signals(self) -> tuple[str, ...]:
        """Every name that a law may use."""
        return (
            *BASE_SIGNALS,
            *self.inputs,
            *self.derived,
            *(f"T_{name}" for name in self.node_names),
            *(f"P_{name}" for name in self.components),
            *(parameter.name for parameter in self.parameters),
            *(state.name for state in self.states),
        )

    def symbols(self) -> Signals:
        """All signals and parameters as symbols, for writing laws."""
        return Signals({name: symbol(name) for name in self.signals})
