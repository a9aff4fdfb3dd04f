"""A mechanism: a named piece of physics that a real gearbox may show and the nominal model leaves out.

It is a declaration: where it may sit, a law, its parameters with priors, one sentence for a test engineer, a reference,
and the experiment that distinguishes it from others. :meth:`Mechanism.placed` puts it into a network.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Literal, TypeAlias

import sympy as sp

from models.base.errors import InputError
from models.mechanisms.places import Placement, placements
from models.mechanisms.scale import Scale
from models.network.laws import LawLike, NumericLaw, Parameter, symbol, trace
from models.quantities.quantities import TOTAL_LOSS
from models.simulation.thermal_network import ExtraState, ThermalNetwork
from models.terms.term import Form, Kind, Term, equation

Parameters: TypeAlias = Callable[[Scale], tuple[Parameter, ...]]
Traced: TypeAlias = Callable[[LawLike, tuple[str, ...]], tuple[sp.Expr, NumericLaw | None]]
STRENGTH = "strength"
OPEN_FORM = "open form"  # family of a heat without a name
GROUPS = ("housing", "bearings", "shafts", "gears")  # that a law may name; in a network without one it has no place
OPTIONAL = ("T_outdoor",)  # inputs that not every network has; without one it has no place either
ABSENT = symbol("absent")


@dataclass(frozen=True, kw_only=True)
class Memory:
    """Extra state of a mechanism; the laws read it by its name and must not depend on the strength.

    Attributes
    ----------
    name : str
    start : callable of :class:`Scale`
        Value at the start
    rate : law
        Time derivative, [1/s]
    update : law or None
        Its value after each step, e.g. of a thermostat's switch
    averaged_update : law or None
        The same for temperatures that are means over minutes
    """

    name: str
    start: Callable[[Scale], float] = field(default=lambda _: 0.0)
    rate: LawLike = 0.0
    update: LawLike | None = None
    averaged_update: LawLike | None = None


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """A piece of physics that may be missing.

    Attributes
    ----------
    name, family : str
    kind : str
        What the law is, see :class:`~models.terms.term.Term`
    places : tuple of str
        Patterns of :mod:`models.mechanisms.places`
    parameters : callable of :class:`Scale`
        Parameters by local names, ``strength`` first; its `sd` is the size that the effect typically has
    law : callable of :class:`~models.network.laws.Signals`, or sympy expression
        Reads the network's signals and, by their local names, the parameters and memories; also ``T_here``, ``T_there``
        (mean temperatures at the place and the other end), ``T_<group>``, ``ambient_ref`` [degC], ``duration_ref`` [s],
        and in ratios to the scale ``n`` (magnitude of speed), ``m`` (of torque), ``x`` (time since the start of the
        recording) and ``nu`` (viscosity of the oil at its temperature)
    weights : callable of (:class:`Scale`, str) or None
        Of a factor: how much of the change a loss component or link has, by its name; those that have none drop out.
        By default all have the whole of it
    sign : int
        Of the strength; 0 if it may be either
    is_loss : bool
        Whether the heat is mechanical power lost
    other : str or None
        The other end of a link: a node, or a name for a new boundary
    other_temperature : law or None
        Temperature of a new boundary, [degC], of time, inputs and own parameters
    states : tuple of Memory
    form, of_measurement
        See :class:`~models.terms.term.Term`
    reference : str
    separate_by : mapping of str to str
        Experiment that distinguishes it from another mechanism, by the other's name
    experiment : str
        Experiment that shows it best, for all others
    """

    name: str
    family: str
    kind: Kind
    places: tuple[str, ...]
    parameters: Parameters
    law: LawLike
    #: One sentence that a test engineer understands; ``{place}`` is replaced by the place
    says: str
    reference: str
    experiment: str
    separate_by: Mapping[str, str] = field(default_factory=dict)
    weights: Callable[[Scale, str], float] | None = None
    sign: Literal[-1, 0, 1] = 1
    is_loss: bool = False
    other: str | None = None
    other_temperature: LawLike | None = None
    states: tuple[Memory, ...] = ()
    form: Form | None = None
    of_measurement: bool = False

    def placed(
        self, network: ThermalNetwork, scale: Scale, channels: Sequence[str] | None = None
    ) -> tuple[Placed, ...]:
        """The mechanism at each of its places in a network.

        Parameters
        ----------
        network : ThermalNetwork
        scale : Scale
        channels : sequence of str or None
            What is measured: nodes, or ``P_loss``; by default all of it

        Raises
        ------
        InputError
            If a law uses a name that it does not have, or is no expression.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> from models.mechanisms import CATALOGUE
        >>> rig = load_gearbox("fzg")
        >>> windage = CATALOGUE["windage"].placed(rig.network(), Scale.of(rig, speed=3000.0, torque=94.0))[0]
        >>> windage.target, windage.parameters[0].name
        (('oil',), 'windage_oil_strength')
        """
        without_losses = (
            scale.loss == 0.0
        )  # they size the heats of the catalogue, and speed and torque act by them only
        if without_losses and (self.kind == "source" or set(self.places) <= {"speed", "torque"}):
            return ()
        if channels is None:
            channels = (*(part.name for part in network.parts), TOTAL_LOSS)
        found: dict[Placement, Placement] = {}
        for one in (p for pattern in self.places for p in placements(network, self.kind, pattern, channels)):
            found.setdefault(replace(one, name=""), one)  # a group of one node is that node
        common, traced = _aliases(network, scale), cache(partial(trace, stand_in=self.name))
        placed = [self._at(network, scale, placement, common, traced) for placement in found.values()]
        return tuple(
            p for p in placed if p.target and not any(ABSENT in law.free_symbols for law in p.written.values())
        )

    def _at(
        self, network: ThermalNetwork, scale: Scale, placement: Placement, common: Mapping[str, sp.Expr], traced: Traced
    ) -> Placed:  # fmt: skip
        label = f"{self.name}_{placement.name}"
        own = self.parameters(scale)
        if not own or own[0].name != STRENGTH:
            raise InputError(f"mechanism {self.name!r}: its first parameter must be called {STRENGTH!r}")
        local = {p.name: symbol(f"{label}_{p.name}") for p in own}
        local |= {memory.name: symbol(f"{label}_{memory.name}") for memory in self.states}
        aliases = {**common, **_ends(placement)}
        clash = sorted(set(local) & (set(aliases) | set(network.signals)))
        if clash:
            raise InputError(f"mechanism {self.name!r}: {clash[0]!r} is a signal; name the parameter differently")

        other = placement.there[0] if self.kind == "link" and placement.there else self.other or "air"
        own_boundary = self.kind == "link" and other not in network.node_names
        target = placement.target
        if self.kind == "link":
            end = f"{label}_{other}" if own_boundary else other
            target = (*(node for node in placement.target if node != end), end)
        weights: tuple[float, ...] = ()
        if self.weights is not None:
            kept = [(name, weight) for name in target if (weight := self.weights(scale, name)) != 0.0]
            target, weights = tuple(name for name, _ in kept), tuple(weight for _, weight in kept)

        def read(law: LawLike) -> sp.Expr:
            expression, numeric = traced(law, (*network.signals, *local, *aliases))
            if numeric is not None:
                raise InputError(f"mechanism {self.name!r}: a law must be an expression; write branches with Piecewise")
            return expression.xreplace({symbol(name): value for name, value in local.items()})

        written = {"law": read(self.law)}
        if own_boundary:
            written[f"T_{target[-1]}"] = read(self.other_temperature or symbol("T_ambient"))
        for memory in self.states:
            written[f"rate {label}_{memory.name}"] = read(memory.rate)
            if memory.update is not None:
                written[f"update {label}_{memory.name}"] = read(memory.update)
        meant = {symbol(name): value for name, value in aliases.items()}
        full = {key: expression.xreplace(meant) for key, expression in written.items()}
        absent = {symbol(name): value for name, value in aliases.items() if value == ABSENT}
        written = {key: expression.xreplace(absent) for key, expression in written.items()}
        return Placed(
            mechanism=self,
            place=placement.name,
            written=written,
            scale=scale,
            label=label,
            kind=self.kind,
            target=target,
            expression=full["law"],
            parameters=tuple(self._prefixed(p, label) for p in own),
            weights=weights,
            states=tuple(
                ExtraState(
                    name=f"{label}_{memory.name}",
                    start=float(memory.start(scale)),
                    rate=full[f"rate {label}_{memory.name}"],
                    update=full.get(f"update {label}_{memory.name}"),
                    averaged_update=None
                    if memory.averaged_update is None
                    else read(memory.averaged_update).xreplace(meant),
                )
                for memory in self.states
            ),
            is_loss=self.is_loss or self.kind == "loss_factor",
            boundary_temperature=full.get(f"T_{target[-1]}"),
            form=self.form or ("shift" if self.kind == "sensor" else None),
            of_measurement=self.of_measurement or self.kind == "sensor",
        )

    def _prefixed(self, parameter: Parameter, label: str) -> Parameter:
        lower, upper = parameter.lower, parameter.upper
        if parameter.name == STRENGTH:
            lower = max(lower, 0.0) if self.sign > 0 else lower
            upper = min(upper, 0.0) if self.sign < 0 else upper
        return replace(parameter, name=f"{label}_{parameter.name}", lower=lower, upper=upper)


@dataclass(frozen=True, kw_only=True, eq=False)
class Placed(Term):
    """A mechanism at its place in one network.

    Attributes
    ----------
    mechanism : Mechanism
    place : str
        As a report calls it
    written : mapping of str to sympy.Expr
        The laws as the catalogue writes them, in ratios to the scale; see :attr:`~models.terms.term.Term.laws`
    scale : Scale
        What they are ratios to
    """

    mechanism: Mechanism
    place: str
    written: Mapping[str, sp.Expr]
    scale: Scale

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.mechanism.name

    @property
    def family(self) -> str:
        """Family of the mechanism."""
        return self.mechanism.family

    @property
    def sign(self) -> int:
        """Sign of the strength; 0 if it may be either."""
        return self.mechanism.sign

    @property
    def says(self) -> str:
        """One sentence about it."""
        return self.mechanism.says.format(place=self.place.replace("_", " "))

    def equation(self, values: Mapping[str, float] | None = None) -> str:
        """The law as LaTeX, in ratios to the scale, which follow it; with `values`, these numbers for parameters."""
        used = {s.name for law in self.written.values() for s in law.free_symbols}
        scale = self.scale
        ratios = {
            "n": rf"n^* = |n| / {scale.speed:.4g}\,\mathrm{{min^{{-1}}}}",
            "m": rf"M^* = |M| / {scale.torque:.4g}\,\mathrm{{N\,m}}",
            "x": rf"t^* = t / {scale.duration:.4g}\,\mathrm{{s}}",
            "nu": rf"\nu^* = \nu(T_{{\mathrm{{oil}}}}) / {scale.viscosity:.3g}\,\mathrm{{mm^2/s}}",
            "duration_ref": rf"t_{{\mathrm{{ref}}}} = {scale.duration:.4g}\,\mathrm{{s}}",
            "ambient_ref": rf"T_{{\mathrm{{ref}}}} = {scale.ambient:.3g}\,^\circ\mathrm{{C}}",
        }
        lines = [equation(self, self.written, values or {}), *(text for name, text in ratios.items() if name in used)]
        return r",\quad ".join(lines)


def _aliases(network: ThermalNetwork, scale: Scale) -> dict[str, sp.Expr]:
    """Names that a law of the catalogue may use in addition to the network's own signals."""
    aliases = {
        "n": sp.Abs(symbol("speed")) / scale.speed,
        "m": sp.Abs(symbol("torque")) / scale.torque,
        "x": symbol("time") / scale.duration,
        "ambient_ref": sp.Float(scale.ambient),
        "duration_ref": sp.Float(scale.duration),
    }
    if "oil" in network.node_names:
        aliases["nu"] = scale.viscosity_at(symbol("T_oil")) / scale.viscosity
    aliases |= {f"T_{group}": ABSENT for group in GROUPS if group not in network.node_names}
    aliases |= {name: ABSENT for name in OPTIONAL if name not in network.signals}
    aliases |= {f"T_{group}": _mean(members) for group, members in network.groups.items()}
    return aliases


def _ends(placement: Placement) -> dict[str, sp.Expr]:
    """Temperatures of the place and of the other end."""
    ends = {"T_here": placement.here, "T_there": placement.there}
    return {name: _mean(nodes) for name, nodes in ends.items() if nodes}


def _mean(nodes: Sequence[str]) -> sp.Expr:
    return sp.Add(*(symbol(f"T_{node}") for node in nodes)) / len(nodes)
