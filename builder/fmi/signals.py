"""The table of signals: everything that an FMU takes and shows, in one place.

From this table come the model description of every kind of FMU, the value references inside it, the columns that
driving one gives, and the nomenclature in the documentation. Signals are in SI units at the FMI interface; the network
and all files work in the units of the file columns (1/min, degC), and :data:`models.quantities.units.UNITS`
converts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf
from typing import Literal

import sympy as sp

from models.base.errors import InputError, did_you_mean
from models.network.laws import symbol
from models.portable.surrogate import KELVIN, SurrogateLosses
from models.quantities.quantities import GEARBOX_INPUTS, MEMORY, TYPES, quantity_of_signal
from models.quantities.units import INSIDE, UNITS, conversion, convert, find_unit, fmi_symbol
from models.simulation.thermal_network import ThermalNetwork

START_DEGC = 20.0  # of a network without an ambient temperature
INITIAL = ("initial.uniform", "initial.T")
HEADER = ("signal", "kind", "unit", "shown in", "column of files", "start", "range", "trained on", "meaning")
LOWEST_START, HIGHEST_START = 173.15, 773.15  # K; what lies outside is most likely degC

MAYBE_LINEAR = ("temperature", "total_loss", "loss", "heat")  # roles of outputs that are their expressions

Role = Literal[
    "input", "temperature", "total_loss", "loss", "heat", "heat_flow", "heat_to_boundary",
    "heat_in", "heat_stored", "torque_loss", "efficiency", "in_domain", "domain_distance",
    "initial_uniform", "initial_temperature", "start_temperature", "factor", "state", "start_state", "other",
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Signal:
    """One variable of the FMU.

    Attributes
    ----------
    name : str
        At the FMI interface, structured: ``oil.T``
    role : Role
        What it is, and `of` the name that the network has for it (a node, a loss, a parameter); "other" in the FMU of
        another model than a gearbox's network
    description : str
    type : str or None
        Key of :data:`models.quantities.quantities.TYPES`; None for a Boolean and for a Real of `unit`
    unit : str or None
        Key of :data:`models.quantities.units.UNITS`; None for a Boolean, and where the network does not say
    causality, variability, initial : str
        As FMI 2.0 defines them; `initial` is "" where FMI gives it
    start : float, bool or None
    minimum, maximum : float
        Infinite where there is no bound
    nominal : float or None
    domain : (float, float) or None
        Range that the networks were trained on, in `unit`
    column : str or None
        Column of cycle and result files
    depends, depends_initially : tuple of str
        Signals that an output depends on directly, and at initialization
    linear : mapping of str to str
        Those that it is linear in: "constant" where the factor is a number, "tunable" where it follows parameters
    inner_unit : str or None
        Unit in the network, if it is not that of file columns
    display_unit : str or None
        Unit in which a tool should show it, if it is not that of `type`; "" for none
    reference : int
        FMI value reference, its place in the table
    """

    name: str
    role: Role
    of: str = ""
    description: str
    type: str | None = None
    unit: str | None = None
    causality: Literal["input", "output", "parameter", "local"]
    variability: Literal["continuous", "discrete", "fixed", "tunable"]
    initial: Literal["exact", "calculated", ""]
    start: float | bool | None = None
    minimum: float = -inf
    maximum: float = inf
    nominal: float | None = None
    domain: tuple[float, float] | None = None
    column: str | None = None
    depends: tuple[str, ...] = ()
    depends_initially: tuple[str, ...] = ()
    linear: Mapping[str, str] = field(default_factory=dict)
    inner_unit: str | None = None
    display_unit: str | None = None
    reference: int = -1

    @property
    def is_boolean(self) -> bool:
        """True if the signal is a Boolean; all others are Real."""
        return self.role in ("in_domain", "initial_uniform")

    @property
    def display(self) -> str | None:
        """Unit in which a tool should show it, if that is not `unit`."""
        if self.display_unit is not None:
            return self.display_unit or None
        return TYPES[self.type].display if self.type is not None else None

    @property
    def to_inner(self) -> tuple[float, float]:
        """Factor and offset from the value at the FMI to the unit of the network."""
        unit = UNITS.get(self.unit or "")
        # Only signals of the network's own quantities are converted; a parameter stays in the unit of its law.
        if unit is None or self.role == "factor":
            return 1.0, 0.0
        if self.inner_unit is None:
            return unit.to_column
        return conversion(unit, find_unit(self.inner_unit, unit.dimension))


class SignalTable:
    """All signals of one FMU in the order of their value references.

    Raises
    ------
    InputError
        If two signals have the same name, or one is the beginning of another's: no record can hold both.
    """

    def __init__(self, signals: Sequence[Signal]) -> None:
        self.signals = tuple(replace(signal, reference=index) for index, signal in enumerate(signals))
        names = [signal.name for signal in self.signals]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two signals of the FMU would be called {name!r}; rename a node, source or parameter")
            if longer := next((other for other in names if other.startswith(f"{name}.")), None):
                raise InputError(f"the FMU would have the signals {name!r} and {longer!r}; rename a node or an input")

    def __iter__(self) -> Iterator[Signal]:
        return iter(self.signals)

    def __len__(self) -> int:
        return len(self.signals)

    @cached_property
    def _by_name(self) -> dict[str, Signal]:
        return {signal.name: signal for signal in self.signals}

    def __getitem__(self, name: str) -> Signal:
        try:
            return self._by_name[name]
        except KeyError:
            raise InputError(f"the FMU has no signal {name!r}{did_you_mean(name, self._by_name)}") from None

    def of_role(self, *roles: Role) -> tuple[Signal, ...]:
        """The signals of some roles, in order."""
        return tuple(signal for signal in self.signals if signal.role in roles)

    def markdown(self) -> str:
        """The nomenclature as a Markdown table.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> lines = signal_table(load_gearbox("fzg").network()).markdown().splitlines()
        >>> lines[2][:72]
        '| `speed` | input | rad/s | rpm | `speed_rpm` | 0 | -20944 ... 20944 |  '
        """
        header, *rows = nomenclature(self)
        lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
        for row in rows:
            cells = [f"`{cell}`" if index in (0, 4) and cell else cell for index, cell in enumerate(row)]
            lines.append("| " + " | ".join(cells) + " |")
        return "\n".join(lines) + "\n"


def nomenclature(table: SignalTable) -> list[tuple[str, ...]]:
    """The table for people: a header and one row of texts per signal."""
    rows: list[tuple[str, ...]] = [HEADER]
    for signal in table:
        kind = f"{signal.variability} {signal.causality}" if signal.causality == "parameter" else signal.causality
        bounds = ("" if abs(bound) == inf else f"{bound:.5g}" for bound in (signal.minimum, signal.maximum))
        low, high = bounds
        start = {True: "true", False: "false"}[signal.start] if isinstance(signal.start, bool) else signal.start
        rows.append((
            signal.name,
            kind,
            "Boolean" if signal.is_boolean else signal.unit or "",
            signal.display or "",
            signal.column or "",
            "" if start is None else start if isinstance(start, str) else f"{start:.5g}",
            f"{low} ... {high}" if low or high else "",
            "" if signal.domain is None else f"{signal.domain[0]:.5g} ... {signal.domain[1]:.5g}",
            signal.description,
        ))  # fmt: skip
    return rows


def fmi_name(name: str) -> str:
    """A name of the network as one level of a structured FMI name: quoted where it is no plain identifier.

    Examples
    --------
    >>> fmi_name("bearing_1"), fmi_name("oil-air (extra)")
    ('bearing_1', "'oil-air (extra)'")
    """
    if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        return name
    return "'" + re.sub(r"[^A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~ ]", "_", name) + "'"


def result_column(name: str) -> str | None:
    """Column of a result file for an output or memory of an FMU; None for one that has no column.

    Examples
    --------
    >>> result_column("oil.T"), result_column("loss.total"), result_column("loss.seal_1"), result_column("heat.extra")
    ('T_oil_degC', 'P_loss_W', 'P_loss_seal_1_W', None)
    """
    if name.startswith("state."):
        return MEMORY + name.removeprefix("state.").strip("'")
    quantity = quantity_of_signal(name)
    return None if quantity is None else quantity.column


def input_name(fmi: str) -> str:
    """Name in the network and in files of an input of an FMU.

    Examples
    --------
    >>> input_name("oil_flow"), input_name("frame.T_in")
    ('oil_flow', 'frame_T_in')
    """
    return fmi.strip("'").replace(".", "_")


def signal_table(network: ThermalNetwork, losses: SurrogateLosses | None = None) -> SignalTable:
    """The signals of a thermal network.

    Parameters
    ----------
    network : ThermalNetwork
    losses : SurrogateLosses or None
        The trained networks of its losses, whose range of training is shown; None if it has none

    Raises
    ------
    InputError
        If two signals would get the same name.

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> table = signal_table(load_gearbox("fzg").network())
    >>> table["oil.T"].unit, table["oil.T"].column
    ('K', 'T_oil_degC')
    """
    return SignalTable(list(_Table(network, losses).signals()))


def start_temperature(network: ThermalNetwork) -> float:
    """Temperature at which an FMU starts unless it is given another one: the ambient one of its definition, [degC]."""
    ambient = network.inputs.get("T_ambient")
    return START_DEGC if ambient is None else ambient.default


class _Table:
    """The network at hand while its signals are listed."""

    def __init__(self, network: ThermalNetwork, losses: SurrogateLosses | None) -> None:
        self.network = network
        self.losses = losses
        self.inputs = tuple(network.inputs)
        self.parameters = {parameter.name: f"factor.{fmi_name(parameter.name)}" for parameter in network.parameters}
        self.boundaries = network.boundaries
        self.loss_heats = [source.heat for source in network.sources if source.is_loss]

    def signals(self) -> Iterator[Signal]:
        yield from self._inputs()
        yield from self._temperatures()
        yield from self._powers()
        yield from self._heats()
        yield from self._quality()
        yield from self._initial()
        yield from self._factors()
        for state in self.network.states:
            name, nominal = f"state.{fmi_name(state.name)}", max(abs(state.start), 1.0)
            switches = state.update is not None and state.rate.is_zero
            yield Signal(name=name, role="state", of=state.name, causality="local", column=result_column(name),
                         variability="discrete" if switches else "continuous", initial="calculated", nominal=nominal,
                         description=f"Memory {state.name} of the thermal network")  # fmt: skip
            yield Signal(name=f"initial.{name}", role="start_state", of=state.name, causality="parameter",
                         variability="fixed", initial="exact", start=state.start, nominal=nominal,
                         description=f"Memory {state.name} at the start")  # fmt: skip

    def _domain(self, name: str) -> tuple[float, float] | None:
        """Range of training of an input or of the temperature of a node, in SI units."""
        if self.losses is None:
            return None
        bounds = {"speed": ("Speed", self.losses.speed_bounds), "torque": ("Torque", self.losses.torque_bounds)}
        bounds |= {
            f"T_{node}": ("Temperature", self.losses.temperature_bounds) for node in self.losses.temperature_nodes
        }
        if name not in bounds:
            return None
        kind, (low, high) = bounds[name]
        unit = UNITS[TYPES[kind].unit]
        inside = find_unit(INSIDE[unit.dimension], unit.dimension)
        return convert(low, inside, unit), convert(high, inside, unit)

    def _inputs(self) -> Iterator[Signal]:
        texts = {
            "speed": "Speed of the input shaft; its sign does not change the losses",
            "torque": "Torque at the input shaft; positive with positive speed drives",
            "T_ambient": "Ambient temperature, in kelvin",
            "air_speed": "Speed of the air along the housing",
        }
        for name, given in self.network.inputs.items():
            quantity = given.quantity
            kind = TYPES[quantity.type or "Ratio"]
            unit, own = find_unit(kind.unit, quantity.dimension), find_unit(quantity.unit, quantity.dimension)
            at_fmi = partial(convert, unit=own, to=unit)
            display = None if name in GEARBOX_INPUTS else quantity.unit * (quantity.unit != kind.unit)
            yield Signal(
                name=quantity.fmi, role="input", of=name,
                description=given.description or texts.get(name, name.replace("_", " ")), type=quantity.type,
                unit=kind.unit, inner_unit=quantity.unit, display_unit=display, causality="input",
                variability="continuous", initial="",
                start=at_fmi(given.default), minimum=at_fmi(quantity.low), maximum=at_fmi(quantity.high),
                domain=self._domain(name), column=given.column, nominal=kind.nominal,
            )  # fmt: skip

    def _output(self, *, name: str, role: Role, of: str = "", kind: str | None, description: str, expression: sp.Expr,
                minimum: float = -inf, maximum: float = inf, domain: tuple[float, float] | None = None,
                needs_state: bool = True) -> Signal:  # fmt: skip
        inputs, parameters = self._direct(expression)
        nodes = [of] if role == "temperature" else [part.name for part in self.network.parts]
        memories = [f"initial.state.{fmi_name(s.name)}" for s in self.network.states if role != "temperature"]
        starts = (*INITIAL, *(f"{fmi_name(node)}.T_start" for node in nodes), *memories) if needs_state else ()
        return Signal(
            name=name, role=role, of=of, description=description, type=kind, unit=TYPES[kind].unit if kind else None,
            causality="output", variability="continuous" if kind else "discrete", initial="calculated", minimum=minimum,
            maximum=maximum, nominal=TYPES[kind].nominal if kind else None, domain=domain, column=result_column(name),
            depends=inputs, depends_initially=(*inputs, *parameters, *starts),
            linear=self._linear(expression) if role in MAYBE_LINEAR else {},
        )  # fmt: skip

    def _linear(self, expression: sp.Expr) -> dict[str, str]:
        """Kind of dependency on each input that an expression is linear in; empty with losses of the networks."""
        known = {f"T_{node}": temperature for node, temperature in self.boundaries.items()}
        expression = expression.subs({s: known[s.name] for s in expression.free_symbols if s.name in known})
        if any(s.name[2:] in self.network.components for s in expression.free_symbols):
            return {}
        kinds = {}
        for given in (s for s in expression.free_symbols if s.name in self.inputs):
            factors = {s.name for s in sp.diff(expression, given).free_symbols}
            if factors <= set(self.parameters):
                kinds[self.network.inputs[given.name].quantity.fmi] = "tunable" if factors else "constant"
        return kinds

    def _direct(self, expression: sp.Expr) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Inputs and parameters that an expression depends on without a detour through the temperatures of parts."""
        names = {s.name for s in expression.free_symbols}
        if any(name.startswith("P_") and name[2:] in self.network.components for name in names):
            names |= {s.name for s in self._operating_point().free_symbols}
        names |= {s.name for name, law in self.network.derived.items() if name in names for s in law.free_symbols}
        names |= {s.name for node, T in self.boundaries.items() if f"T_{node}" in names for s in T.free_symbols}
        inputs = tuple(given.quantity.fmi for name, given in self.network.inputs.items() if name in names)
        return inputs, tuple(fmi for name, fmi in self.parameters.items() if name in names)

    def _temperatures(self) -> Iterator[Signal]:
        for node in self.network.nodes:
            boundary = node.temperature is not None
            yield self._output(
                name=f"{fmi_name(node.name)}.T", role="temperature", of=node.name, kind="Temperature", minimum=0.0,
                description=f"Temperature of {node.name.replace('_', ' ')}" + (" (boundary)" if boundary else ""),
                expression=sp.Integer(0) if node.temperature is None else node.temperature, needs_state=not boundary,
                domain=self._domain(f"T_{node.name}"),
            )  # fmt: skip

    def _powers(self) -> Iterator[Signal]:
        total = sum(self.loss_heats, sp.Integer(0))
        if self.loss_heats:
            yield self._output(name="loss.total", role="total_loss", kind="Power", description="Sum of all losses",
                               expression=total)  # fmt: skip
        for source in self.network.sources:
            named = source.name.replace("_", " ")
            yield self._output(
                name=f"{'loss' if source.is_loss else 'heat'}.{fmi_name(source.name)}", of=source.name, kind="Power",
                role="loss" if source.is_loss else "heat", expression=source.heat,
                description=f"Loss: {named}" if source.is_loss else f"Heat into {source.node}: {named}",
                minimum=0.0 if source.name in self.network.components else -inf,
            )  # fmt: skip
        if not self.loss_heats or not {"speed", "torque"} <= set(self.inputs):
            return
        yield self._output(name="torque_loss", role="torque_loss", kind="Torque", expression=total / symbol("speed"),
                           description="Loss torque at the input shaft, signed as the speed; the output shaft has the "
                                       "gear ratio times (torque - torque_loss)")  # fmt: skip
        yield self._output(name="efficiency", role="efficiency", kind="Ratio", minimum=0.0, maximum=1.0,
                           expression=total + symbol("speed") * symbol("torque"),
                           description="Power out over power in; 0 without power")  # fmt: skip

    def _heats(self) -> Iterator[Signal]:
        """Heat flows to the boundaries, and the terms of the energy balance; none depends on the inputs at a moment."""
        for node in self.boundaries:
            name, text = fmi_name(node), node.replace("_", " ")
            flow = self._output(
                name=f"{name}.heat_flow", role="heat_flow", of=node, kind="Power", expression=self._outflow(node),
                description=f"Heat flow to {text}, mean over the last step",
            )  # fmt: skip
            yield replace(flow, depends=())
            yield self._output(
                name=f"{name}.heat", role="heat_to_boundary", of=node, kind="Energy", expression=sp.Integer(0),
                needs_state=False, description=f"Heat given to {text} since the start",
            )  # fmt: skip
        totals: dict[Role, str] = {
            "heat_in": "Heat brought in by all sources since the start",
            "heat_stored": "Heat stored in all nodes since the start: heat_in less the heat given to the boundaries",
        }
        for role, text in totals.items():
            yield self._output(name=role, role=role, kind="Energy", expression=sp.Integer(0), needs_state=False,
                               description=text)  # fmt: skip

    def _outflow(self, boundary: str) -> sp.Expr:
        """An expression of what the heat flow to a boundary depends on."""
        temperature = self.boundaries[boundary]
        links = [link.conductance for link in self.network.links if boundary in link.nodes]
        return sum((conductance * temperature for conductance in links), sp.Integer(0))

    def _operating_point(self) -> sp.Expr:
        """An expression of what speed and torque depend on as the losses see them."""
        shifted = self.network.operating
        return sum((shifted.get(name, symbol(name)) for name in ("speed", "torque")), sp.Integer(0))

    def _quality(self) -> Iterator[Signal]:
        if not self.network.components:
            return
        point = self._operating_point()
        yield self._output(
            name="in_domain", role="in_domain", kind=None, expression=point,
            description="True if the operating point is inside the range that the networks were trained on",
        )  # fmt: skip
        yield self._output(
            name="domain_distance", role="domain_distance", kind="Ratio", minimum=0.0, expression=point,
            description="How far outside the trained range, as a fraction of it; 0 inside",
        )  # fmt: skip

    def _initial(self) -> Iterator[Signal]:
        start = start_temperature(self.network) + KELVIN

        def fixed(name: str, role: Role, text: str, of: str = "") -> Signal:
            return Signal(
                name=name, role=role, of=of, description=text, type="Temperature", unit="K", start=start,
                causality="parameter", variability="fixed", initial="exact", minimum=LOWEST_START,
                maximum=HIGHEST_START, nominal=TYPES["Temperature"].nominal,
            )  # fmt: skip

        yield Signal(name="initial.uniform", role="initial_uniform", causality="parameter", variability="fixed",
                     initial="exact", start=True,
                     description="True: all nodes start at initial.T; false: each at its T_start")  # fmt: skip
        text = "Temperature of all nodes at the start, if initial.uniform; it does not follow T_ambient"
        yield fixed("initial.T", "initial_temperature", text)
        for part in self.network.parts:
            text = f"Temperature of {part.name.replace('_', ' ')} at the start, unless initial.uniform"
            yield fixed(f"{fmi_name(part.name)}.T_start", "start_temperature", text, part.name)

    def _factors(self) -> Iterator[Signal]:
        for parameter in self.network.parameters:
            unit = fmi_symbol(parameter.unit)
            text = parameter.description or parameter.name
            yield Signal(
                name=self.parameters[parameter.name], role="factor", of=parameter.name,
                unit=unit if unit in UNITS else None, type="Ratio" if unit == "1" else None,
                causality="parameter", variability="tunable", initial="exact",
                start=parameter.start, minimum=min(parameter.lower, parameter.start),
                maximum=max(parameter.upper, parameter.start), nominal=abs(parameter.start) or 1.0,
                description=(text[0].upper() + text[1:]) + ("" if unit in UNITS else f" [{parameter.unit}]"),
            )  # fmt: skip
