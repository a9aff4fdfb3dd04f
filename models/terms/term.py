"""A term: physics that is added to a thermal network, whoever found or wrote it.

A mechanism of the catalogue at its place, a term found by regression and a line of a correction file are all this. Its
law is linear in the first parameter, the strength, and vanishes with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import sympy as sp

from models.base.errors import InputError, did_you_mean
from models.network.laws import Parameter, symbol
from models.simulation.thermal_network import ExtraState, ThermalNetwork

Kind = Literal["source", "link", "loss_factor", "link_factor", "signal", "sensor"]
FACTORS: tuple[Kind, ...] = ("loss_factor", "link_factor")
Form = Literal["shift", "lag", "clock", "stuck", "swapped"]
DIGITS = 4  # of the numbers in a printed equation
LETTERS = {
    "speed": "n", "torque": "M", "time": "t",
    "n": "n^*", "m": "M^*", "x": "t^*", "nu": r"\nu^*",
    "duration_ref": r"t_{\mathrm{ref}}", "ambient_ref": r"T_{\mathrm{ref}}",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Term:
    """A term with its place in one network.

    Attributes
    ----------
    label : str
        Name of the term in the network, prefix of its parameters and states
    kind : str
        ``source``: `expression` is a heat [W], shared evenly by the nodes of `target`.
        ``link``: a conductance [W/K], shared evenly by the nodes of `target` but the last, which is the other end.
        ``loss_factor``, ``link_factor``: the relative change of every source or link in `target`, [-]; a loss_factor
        may have links as well.
        ``signal``: what the input `target` really is more than the recorded one, in its unit.
        ``sensor``: a fault of the measured channels in `target`, which the network does not feel; see `form`
    target : tuple of str
        Nodes, sources, links, inputs or channels
    expression : sympy.Expr
        The law, of the network's signals and of the term's own parameters and states
    parameters : tuple of Parameter
        The strength first
    weights : tuple of float
        Of a ``loss_factor`` or ``link_factor``: how much of the change each of the targets has; empty where all have
        the whole of it
    states : tuple of ExtraState
        Memories; none depends on the strength
    is_loss : bool
        Whether the heat is mechanical power lost in the gearbox
    boundary_temperature : sympy.Expr or None
        Temperature of the other end of a link, [degC], where that is a boundary of the term's own
    form : str or None
        Of a ``sensor``. ``shift``: the reading is the truth plus `expression` (in which ``T_<channel>`` is the truth).
        ``lag``: the reading follows the truth with a time constant of `expression` [s]. ``clock``: the readings come
        `expression` [s] after the inputs. ``stuck``: the reading is the truth plus `expression` times (what it was when
        `expression` left 0, less the truth). ``swapped``: each of the two channels of `target` is the truth plus
        `expression` times (the other's truth less its own)
    of_measurement : bool
        Whether it is in the recording only, as a fault of an instrument is: the gearbox itself has none of it
    """

    label: str
    kind: Kind
    target: tuple[str, ...]
    expression: sp.Expr
    parameters: tuple[Parameter, ...]
    weights: tuple[float, ...] = ()
    states: tuple[ExtraState, ...] = ()
    is_loss: bool = False
    boundary_temperature: sp.Expr | None = None
    form: Form | None = None
    of_measurement: bool = False

    @property
    def strength(self) -> Parameter:
        """The parameter that the law is linear in."""
        return self.parameters[0]

    def with_values(self, values: Mapping[str, float]) -> Term:
        """The term with other values of its parameters as their start.

        Raises
        ------
        InputError
            If a name is not one of its parameters.
        """
        known = [p.name for p in self.parameters]
        for name in values:
            if name not in known:
                raise InputError(f"{name!r} is not a parameter of {self.label}{did_you_mean(name, known)}")
        return replace(self, parameters=tuple(replace(p, start=values.get(p.name, p.start)) for p in self.parameters))

    def apply(
        self, network: ThermalNetwork, values: Mapping[str, float] | None = None, *, as_recorded: bool = False
    ) -> ThermalNetwork:
        """The network with this term.

        Parameters
        ----------
        values : mapping of str to float or None
            Values of parameters where they differ from their start
        as_recorded : bool
            Whether the network is driven with inputs as the faulty instruments recorded them. Otherwise, as in a twin
            that a vehicle model drives, it gets true ones, and a fault of an instrument leaves the network as it is. A
            fault of a sensor always does.

        Raises
        ------
        InputError
            If the network lacks a place or signal, or has the term already.
        """
        if self.kind == "sensor" or (self.of_measurement and not as_recorded):
            return network
        for parameter in self.with_values(values or {}).parameters:
            network = network.with_parameter(parameter)
        for state in self.states:
            network = network.with_state(
                state.name,
                start=state.start,
                rate=state.rate,
                update=state.update,
                averaged_update=state.averaged_update,
            )
        return self._placed_in(network)

    def _placed_in(self, network: ThermalNetwork) -> ThermalNetwork:
        if self.kind == "source":
            heat = self.expression / len(self.target)
            for node, name in self._named(self.target):
                network = network.with_source(node, heat, name=name, is_loss=self.is_loss)
            return network
        if self.kind == "link":
            *sides, end = self.target
            if self.boundary_temperature is not None:
                network = network.with_boundary(end, self.boundary_temperature)
            for node, name in self._named(sides):
                network = network.with_link(node, end, self.expression / len(sides), name=name)
            return network
        links = {link.name for link in network.links}
        for name, weight in self.weighted:
            change = self.expression if weight == 1.0 else weight * self.expression
            if self.kind == "signal":
                network = network.with_signal_shift(name, change)
            elif name in links:
                network = network.with_link_factor(name, change)
            else:
                network = network.with_loss_factor(name, change)
        return network

    @property
    def weighted(self) -> tuple[tuple[str, float], ...]:
        """Every target with how much of the change it has."""
        return tuple(zip(self.target, self.weights or (1.0,) * len(self.target), strict=True))

    def _named(self, nodes: Sequence[str]) -> list[tuple[str, str]]:
        return [(node, self.label if len(nodes) == 1 else f"{self.label}_{node}") for node in nodes]

    # ------------------------------------------------------------------ for people

    def equation(self, values: Mapping[str, float] | None = None) -> str:
        """The law as LaTeX; with `values` of parameters, these numbers in place of them."""
        return equation(self, self.laws, values or {})

    @property
    def laws(self) -> Mapping[str, sp.Expr]:
        """All expressions: ``law``, ``T_<boundary>``, ``rate <state>`` and ``update <state>``."""
        laws = {"law": self.expression}
        if self.boundary_temperature is not None:
            laws[f"T_{self.target[-1]}"] = self.boundary_temperature
        for state in self.states:
            laws[f"rate {state.name}"] = state.rate
            if state.update is not None:
                laws[f"update {state.name}"] = state.update
        return laws


def equation(term: Term, laws: Mapping[str, sp.Expr], values: Mapping[str, float]) -> str:
    """Laws of a term as LaTeX.

    Parameters
    ----------
    laws : mapping of str to sympy.Expr
        As :attr:`Term.laws`, in whatever symbols are good to read
    values : mapping of str to float
        Numbers in place of the term's parameters
    """
    numbers = {symbol(name): sp.Float(value) for name, value in values.items()}

    def name_of(name: str) -> str:
        if name in LETTERS:
            return LETTERS[name]
        if name[:2] in ("T_", "P_"):
            return f"{name[0]}_{{{_roman(name[2:].removeprefix(f'{term.label}_'))}}}"
        return _roman(name.removeprefix(f"{term.label}_"))

    def latex(expression: sp.Expr) -> str:
        expression = expression.xreplace(numbers)
        rounded = expression.xreplace({f: sp.Float(f"{float(f):.{DIGITS}g}") for f in expression.atoms(sp.Float)})
        names = {s: name_of(s.name) for s in rounded.free_symbols}
        return str(sp.latex(rounded, symbol_names=names))

    place = _roman(", ".join(term.target) if len(term.target) <= 2 else term.label)
    left = {
        "source": rf"\dot{{Q}}_{{{place}}} = ",
        "link": rf"G_{{{_roman('-'.join(n.removeprefix(f'{term.label}_') for n in term.target))}}} = ",
        "loss_factor": rf"\Delta P / P_{{{place}}} = ",
        "link_factor": rf"\Delta G / G_{{{place}}} = ",
        "signal": rf"\Delta {name_of(term.target[0])} = ",
        "sensor": rf"{_roman(term.form or 'shift')}_{{{place}}} = ",
    }[term.kind]
    lines = []
    for key, expression in laws.items():
        what, _, state = key.partition(" ")
        if what == "rate" and expression.is_zero:
            continue
        if state:
            name = name_of(state)
            head = rf"\mathrm{{d}}{name}/\mathrm{{d}}t = " if what == "rate" else rf"{name} \leftarrow "
        else:
            head = left if key == "law" else f"{name_of(key)} = "
        lines.append(head + latex(expression))
    if term.weights:
        names: dict[float, list[str]] = {}
        for target, weight in term.weighted:
            names.setdefault(weight, []).append(_roman(target))
        shares = ",\\ ".join(rf"{weight:.2g}\,({', '.join(group)})" for weight, group in names.items())
        lines.append(rf"\mathrm{{times}}\ {shares}")
    return r",\quad ".join(lines)


def _roman(text: str) -> str:
    escaped = text.replace("_", r"\_")
    return rf"\mathrm{{{escaped}}}"
