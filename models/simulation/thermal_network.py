"""The thermal network: nodes, links and sources, each with a law.

A network is data. :meth:`ThermalNetwork.with_source`, :meth:`~ThermalNetwork.with_link` and their like give a new
network with one more term; a base term, a mechanism of the catalogue and a user's own are the same kind of thing.
``m c dT/dt = sources - sum of conductance * difference`` at every node; what leaves one node enters another, so heat is
conserved whatever the laws say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from keyword import iskeyword
from math import inf

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from models.base.errors import InputError, did_you_mean
from models.definition.sections import Training
from models.files.cycle import Cycle
from models.network.laws import LawLike, NumericLaw, Parameter, symbol, trace
from models.network.structure import BASE_SIGNALS, ExtraState, Link, Losses, Network, Node, Source
from models.quantities.quantities import INPUT_KINDS, named_input
from models.simulation.result import Result, SteadyState
from models.simulation.simulate import simulate
from models.simulation.steady_state import steady_state

LOWEST_BOUNDARY, HIGHEST_BOUNDARY, USUAL_BOUNDARY = -90.0, 250.0, 20.0  # degC, of a coupled boundary
__all__ = ["BASE_SIGNALS", "ExtraState", "Link", "Losses", "Node", "Source", "ThermalNetwork"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ThermalNetwork(Network):
    """A network that can be extended, one term at a time, and simulated.

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> load_gearbox("heated_rod").network()
    <ThermalNetwork: 13 nodes, 23 links, 5 sources, 17 parameters>
    """

    def __repr__(self) -> str:
        shape = f"{len(self.nodes)} nodes, {len(self.links)} links, {len(self.sources)} sources"
        return f"<ThermalNetwork: {shape}, {len(self.parameters)} parameters>"

    # ------------------------------------------------------------------ extension

    def with_node(self, name: str, heat_capacity: LawLike) -> ThermalNetwork:
        """A network with one more part of `heat_capacity` [J/K]; link it with :meth:`with_link`."""
        self._new_node(name)
        capacity, numeric = trace(heat_capacity, [p.name for p in self.parameters], f"heat_capacity_{name}")
        if numeric is not None:
            raise InputError(f"the heat capacity of node {name!r} must be a number or a function of parameters")
        return replace(self, nodes=(*self.nodes, Node(name=name, capacity=capacity)))

    def with_boundary(self, name: str, temperature: LawLike) -> ThermalNetwork:
        """A network with one more boundary node of known `temperature` [degC], a law of time, inputs and parameters."""
        self._new_node(name)
        allowed = (*BASE_SIGNALS, *self.inputs, *self.derived, *(p.name for p in self.parameters))
        expression, numeric = trace(temperature, allowed, f"temperature_{name}")
        if numeric is not None:
            raise InputError(f"the temperature of boundary {name!r} must be an expression; no branches or numpy calls")
        return replace(self, nodes=(*self.nodes, Node(name=name, temperature=expression)))

    def with_coupled_boundary(self, name: str) -> ThermalNetwork:
        """A network that takes the temperature of a boundary from an input, for coupling with another model.

        The input is ``<boundary>_T_in`` in laws and files [degC], ``<boundary>.T_in`` at the FMI; its default is what
        the boundary's law gives at the defaults of the other inputs.

        Parameters
        ----------
        name : str
            A boundary node

        Raises
        ------
        InputError
            If the network has no such boundary, or it follows an input that nothing else uses.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> network = load_gearbox("fzg").network().with_coupled_boundary("frame")
        >>> network.inputs["frame_T_in"].default, [n.temperature for n in network.nodes if n.name == "frame"]
        (27.0, [frame_T_in])
        """
        laws = self.boundaries
        if name not in laws:
            raise InputError(f"{name!r} is not a boundary of this network{did_you_mean(name, laws)}")
        elsewhere = (
            *(law for boundary, law in laws.items() if boundary != name),
            *(link.conductance for link in self.links), *(source.heat for source in self.sources),
            *self.derived.values(),
        )  # fmt: skip
        own = next((key for key in self.inputs if laws[name] == symbol(key)), None)
        if own is not None and not any(symbol(own) in law.free_symbols for law in elsewhere):
            raise InputError(f"boundary {name!r} follows the input {own!r} alone: that couples it with another model")
        values = {"time": 0.0} | {key: given.default for key, given in self.inputs.items()}
        values |= {parameter.name: parameter.start for parameter in self.parameters}
        law = laws[name].xreplace({symbol(key): expression for key, expression in self.derived.items()})
        default = law.xreplace({symbol(key): sp.Float(value) for key, value in values.items()})
        added = named_input(
            f"{name}_T_in", "temperature", low=LOWEST_BOUNDARY, high=HIGHEST_BOUNDARY,
            default=USUAL_BOUNDARY if default.free_symbols else float(default),
            description=f"Temperature of {name.replace('_', ' ')}, from the model that {name}.heat_flow goes to",
        )  # fmt: skip
        at_port = replace(added.quantity, fmi=f"{name}.T_in")
        self._new_name(added.name, self.signals, "signal")
        return replace(
            self,
            inputs={**self.inputs, added.name: replace(added, quantity=at_port)},
            nodes=tuple(replace(n, temperature=symbol(added.name)) if n.name == name else n for n in self.nodes),
        )

    def with_input(
        self, name: str, default: float, *, quantity: str = "ratio", unit: str = "", low: float = -inf,
        high: float = inf,
    ) -> ThermalNetwork:  # fmt: skip
        """A network with one more input signal, e.g. a measured column, that laws may use.

        Parameters
        ----------
        name : str
        default : float
            Where a cycle does not give it
        quantity : str
            Key of :data:`models.quantities.quantities.INPUT_KINDS`
        unit : str
            Of laws and files; by default the unit inside of the quantity
        low, high : float
            Plausible range

        Raises
        ------
        InputError
            If the name is taken or no name of a signal, or the quantity or unit is unknown.
        """
        self._new_name(name, self.signals, "signal")
        if quantity not in INPUT_KINDS:
            raise InputError(f"quantity {quantity!r} of input {name!r} is unknown{did_you_mean(quantity, INPUT_KINDS)}")
        added = named_input(name, quantity, unit=unit, low=low, high=high, default=default)
        return replace(self, inputs={**self.inputs, name: added})

    def with_parameter(self, parameter: Parameter) -> ThermalNetwork:
        """A network with one more tunable parameter that laws may use by its name."""
        self._new_name(parameter.name, self.signals, "signal")
        return replace(self, parameters=(*self.parameters, parameter))

    def with_state(
        self, name: str, *, start: float, rate: LawLike = 0.0, update: LawLike | None = None,
        averaged_update: sp.Expr | None = None,
    ) -> ThermalNetwork:  # fmt: skip
        """A network with a memory.

        Parameters
        ----------
        name : str
            Name of the state; laws use it like a signal
        start : float
            Its value at the start
        rate : law
            Its time derivative, [1/s]
        update : law or None
            Its value after each accepted step of the solver
        averaged_update : sympy.Expr or None
            The same where temperatures are means over minutes
        """
        self._new_name(name, self.signals, "signal")
        names = [*self.signals, name]
        rate_expression, numeric = trace(rate, names, f"rate_{name}")
        update_expression = None
        if update is not None:
            update_expression, numeric_update = trace(update, names, f"update_{name}")
            numeric = numeric or numeric_update
        if numeric is not None:
            raise InputError(f"the laws of state {name!r} must be expressions; write branches with sympy.Piecewise")
        state = ExtraState(
            name=name, start=start, rate=rate_expression, update=update_expression, averaged_update=averaged_update
        )
        return replace(self, states=(*self.states, state))

    def with_source(self, node: str, law: LawLike, *, name: str, is_loss: bool = False) -> ThermalNetwork:
        """A network with one more heat source.

        Parameters
        ----------
        node : str
            A node, or a group whose nodes share the heat evenly
        law : callable of :class:`~models.network.laws.Signals`, sympy expression, or number
            Heat, [W]; positive warms the node
        name : str
            Name of the source
        is_loss : bool
            Whether the heat is mechanical power lost in the gearbox: it then counts in ``P_loss_W`` and gets a column

        Raises
        ------
        InputError
            If the node or a signal is unknown, the node is a boundary, or the name is taken.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> network = load_gearbox("fzg").network()
        >>> extra = network.with_source("oil", lambda s: 8.0 * (s.speed / 3000.0) ** 3, name="extra")
        >>> extra.sources[-1].heat
        2.96296296296296e-10*speed**3
        """
        members = self._members(node)
        for member in members:
            if member not in {part.name for part in self.parts}:
                raise InputError(f"node {member!r} has a given temperature; a source there has no effect")
        names = [f"{name}_{member}" if len(members) > 1 else name for member in members]
        for new in names:
            self._new_name(new, [source.name for source in self.sources], "source")
        expression, numeric_laws = self._traced(law, f"source_{name}")
        added = tuple(
            Source(name=new, node=member, heat=expression / len(members), is_loss=is_loss)
            for new, member in zip(names, members, strict=True)
        )
        return replace(self, sources=(*self.sources, *added), numeric_laws=numeric_laws)

    def with_link(
        self, node_a: str, node_b: str, law: LawLike, *, name: str | None = None, temperature: LawLike | None = None
    ) -> ThermalNetwork:
        """A network with one more heat path.

        Parameters
        ----------
        node_a : str
            A node, or a group whose nodes share the conductance evenly
        node_b : str
            A node; a name that the network does not have becomes a new boundary node
        law : callable of :class:`~models.network.laws.Signals`, sympy expression, or number
            Conductance, [W/K], >= 0
        name : str or None
            Name of the link, by default ``<node_a>-<node_b>``
        temperature : law or None
            Temperature of a new boundary node, [degC]; ambient by default

        Raises
        ------
        InputError
            If a node or signal is unknown, both nodes are the same, or the name is taken. An unknown `node_b` that is
            close to a known name is taken for a slip unless `temperature` is given.
        """
        members = self._members(node_a)
        if node_b not in self.node_names:
            close = get_close_matches(node_b, self.node_names, n=1, cutoff=0.8)
            if close and temperature is None:
                raise InputError(
                    f"node {node_b!r} is unknown; did you mean {close[0]!r}? "
                    "Give a temperature to make it a new boundary node"
                )
            boundary = "T_ambient" if temperature is None else temperature
            law_b: LawLike = (lambda s: s[boundary]) if isinstance(boundary, str) else boundary
            return self.with_boundary(node_b, law_b).with_link(node_a, node_b, law, name=name)
        if temperature is not None:
            raise InputError(f"node {node_b!r} exists; a temperature can be given to a new boundary node only")
        if node_b in members:
            raise InputError(f"a link joins two different nodes; {node_a!r} and {node_b!r} were given")
        name = name or f"{node_a}-{node_b}"
        names = [f"{name}_{member}" if len(members) > 1 else name for member in members]
        for new in names:
            self._new_name(new, [link.name for link in self.links], "link")
        expression, numeric_laws = self._traced(law, f"link_{name}")
        self._refuse_losses(expression, f"the conductance of link {name!r}")
        added = tuple(
            Link(name=new, nodes=(member, node_b), conductance=expression / len(members))
            for new, member in zip(names, members, strict=True)
        )
        return replace(self, links=(*self.links, *added), numeric_laws=numeric_laws)

    def with_loss_factor(self, source: str, law: LawLike) -> ThermalNetwork:
        """A network in which one heat source is ``1 + law`` times what it was.

        Parameters
        ----------
        source : str
            Name of a source
        law : callable of :class:`~models.network.laws.Signals`, sympy expression, or number
            Relative change, [-]

        Raises
        ------
        InputError
            If the source or a signal is unknown.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> network = load_gearbox("fzg").network().with_loss_factor("churning", lambda s: 0.1 * s.speed / 3000.0)
        >>> [source.heat for source in network.sources if source.name == "churning"]
        [P_churning*churning*(3.33333333333333e-5*speed + 1)]
        """
        known = [s.name for s in self.sources]
        if source not in known:
            raise InputError(f"the network has no source {source!r}{did_you_mean(source, known)}")
        factor, numeric_laws = self._traced(law, f"loss_factor_{len(self.numeric_laws)}_{source}")
        scaled = tuple(replace(s, heat=s.heat * (1 + factor)) if s.name == source else s for s in self.sources)
        return replace(self, sources=scaled, numeric_laws=numeric_laws)

    def with_link_factor(self, link: str, law: LawLike) -> ThermalNetwork:
        """A network in which the conductance of one link is ``1 + law`` times what it was.

        Parameters
        ----------
        link : str
            Name of a link
        law : callable of :class:`~models.network.laws.Signals`, sympy expression, or number
            Relative change, [-]

        Raises
        ------
        InputError
            If the link or a signal is unknown, or the law depends on a loss.
        """
        known = [s.name for s in self.links]
        if link not in known:
            raise InputError(f"the network has no link {link!r}{did_you_mean(link, known)}")
        factor, numeric_laws = self._traced(law, f"link_factor_{len(self.numeric_laws)}_{link}")
        self._refuse_losses(factor, f"the factor of link {link!r}")
        scaled = tuple(
            replace(s, conductance=s.conductance * (1 + factor)) if s.name == link else s for s in self.links
        )
        return replace(self, links=scaled, numeric_laws=numeric_laws)

    def with_signal_shift(self, name: str, law: LawLike) -> ThermalNetwork:
        """A network that takes one input for ``input + law``: laws, boundaries and losses see the shifted value.

        Parameters
        ----------
        name : str
            An input, or a torque that follows from others
        law : callable of :class:`~models.network.laws.Signals`, sympy expression, or number
            What is added, in the unit of the input

        Raises
        ------
        InputError
            If the input or a signal is unknown, the law depends on a loss, or a law of the network is no expression.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> warm = load_gearbox("fzg").network().with_signal_shift("T_ambient", 2.0)
        >>> warm.nodes[0].temperature
        T_ambient + 2.0
        """
        known = (*self.inputs, *self.derived)
        if name not in known:
            raise InputError(f"{name!r} is not an input of this network{did_you_mean(name, known)}")
        shift, numeric = trace(law, self.signals, f"shift_{name}")
        if numeric is not None or self.numeric_laws:
            raise InputError(f"the input {name!r} can be shifted only where all laws are expressions, without branches")
        self._refuse_losses(shift, f"the shift of {name!r}")
        # A boundary's temperature may itself follow this input: the shift means it as it was.
        boundary = {symbol(f"T_{node}"): law for node, law in self.boundaries.items()}
        seen = {symbol(name): symbol(name) + shift.xreplace(boundary)}
        operating = {key: law.xreplace(seen) for key, law in self.operating.items()}
        if name in self.derived:
            return replace(self, derived={**self.derived, name: self.derived[name] + shift.xreplace(boundary)})
        if name in ("speed", "torque"):
            operating.setdefault(name, seen[symbol(name)])
        return replace(
            self,
            nodes=tuple(n if n.temperature is None else replace(n, temperature=n.temperature.xreplace(seen))
                        for n in self.nodes),
            links=tuple(replace(link, conductance=link.conductance.xreplace(seen)) for link in self.links),
            sources=tuple(replace(source, heat=source.heat.xreplace(seen)) for source in self.sources),
            states=tuple(state.with_laws(lambda law: law.xreplace(seen)) for state in self.states),
            operating=operating,
            derived={key: law.xreplace(seen) for key, law in self.derived.items()},
        )  # fmt: skip

    # ------------------------------------------------------------------ use

    def simulate(
        self,
        cycle: Cycle | Mapping[str, ArrayLike],
        *,
        losses: Losses,
        initial: float | Mapping[str, float] | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        trained: Training | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> Result:
        """Temperatures and losses over a cycle; see :func:`models.simulation.simulate.simulate`.

        Raises
        ------
        InputError
            Also if a parameter is outside its bounds.
        """
        self._refuse_outside_bounds(parameters or {})
        return simulate(
            self, cycle, losses=losses, initial=initial, parameters=parameters, trained=trained, progress=progress
        )

    def steady_state(
        self,
        *,
        losses: Losses,
        speed: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        inputs: Mapping[str, ArrayLike] | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        trained: Training | None = None,
    ) -> SteadyState:
        """Temperatures and losses at rest; see :func:`models.simulation.steady_state.steady_state`.

        Raises
        ------
        InputError
            Also if a parameter is outside its bounds.
        """
        self._refuse_outside_bounds(parameters or {})
        return steady_state(
            self, losses=losses, speed=speed, torque=torque, inputs=inputs, parameters=parameters, trained=trained
        )

    # ------------------------------------------------------------------ checks

    def _refuse_outside_bounds(self, values: Mapping[str, ArrayLike]) -> None:
        """Refuse what FMU and corrections refuse; a start outside its bounds widens them, as there."""
        for parameter in (one for one in self.parameters if one.name in values):
            given = np.asarray(values[parameter.name], dtype=float)
            low, high = min(parameter.lower, parameter.start), max(parameter.upper, parameter.start)
            if not np.all((given >= low) & (given <= high)):
                raise InputError(f"parameter {parameter.name!r} is {given}; {low:g} to {high:g} is possible")

    def _members(self, node: str) -> tuple[str, ...]:
        if node in self.groups:
            return self.groups[node]
        if node not in self.node_names:
            raise InputError(f"node {node!r} is unknown{did_you_mean(node, [*self.node_names, *self.groups])}")
        return (node,)

    def _new_node(self, name: str) -> None:
        self._new_name(name, [*self.node_names, *self.groups], "node")
        self._new_name(f"T_{name}", self.signals, "signal")

    def _traced(self, law: LawLike, label: str) -> tuple[sp.Expr, Mapping[str, NumericLaw]]:
        label = "".join(c if c.isalnum() else "_" for c in label)
        expression, numeric = trace(law, self.signals, label)
        return expression, self.numeric_laws if numeric is None else {**self.numeric_laws, label: numeric}

    def _refuse_losses(self, expression: sp.Expr, what: str) -> None:
        losses = {symbol(f"P_{component}") for component in self.components} & expression.free_symbols
        if losses:
            raise InputError(
                f"{what} depends on the loss {min(s.name for s in losses)!r}; "
                "it may depend on inputs, temperatures, parameters and states only"
            )

    @staticmethod
    def _new_name(name: str, taken: Iterable[str], kind: str) -> None:
        if name in taken:
            raise InputError(f"the network has a {kind} {name!r} already; choose another name")
        if kind == "signal" and (not name.isidentifier() or iskeyword(name) or name.startswith("_")):
            raise InputError(f"{name!r} cannot be a signal; a name starts with a letter and has letters, digits and _")
