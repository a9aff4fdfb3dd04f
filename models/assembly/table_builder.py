"""From the tables that every definition may have to nodes, links, heats and parameters of a network.

Without geometry they are all of it but the losses (:mod:`models.assembly.parametric`); with geometry they are added to
the network that follows from it (:mod:`models.assembly.gearbox_network`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Generic, TypeVar

import sympy as sp

from models.definition.machine_definition import Heat, MachineDefinition, Path
from models.network.expressions import parse_expression
from models.network.laws import Parameter, symbol
from models.simulation.thermal_network import Link, Node, Source, ThermalNetwork

D = TypeVar("D", bound=MachineDefinition)
GROUPS = ("housing", "bearings", "gears", "shafts", "returns")
FARTHEST = 1000.0  # limits of a factor; its prior keeps it much nearer to 1


def with_tables(network: ThermalNetwork, definition: MachineDefinition, priors: Mapping[str, float]) -> ThermalNetwork:
    """Return a network with what the tables of its definition add; its inputs are those of the definition.

    Parameters
    ----------
    network : ThermalNetwork
        As it follows from the geometry
    priors : mapping of str to float
        Standard deviations by dotted path
    """
    tables = TableBuilder(definition, priors)
    boundaries, parts, links, heats = tables.boundaries(), tables.parts(), tables.links(), tables.heats()
    given = tuple(node for node in network.nodes if node.temperature is not None)
    own, groups = network.groups, tables.groups()
    return replace(
        network,
        nodes=(*given, *boundaries, *network.parts, *parts),
        links=(*network.links, *links),
        sources=(*network.sources, *heats),
        parameters=(*network.parameters, *tables.parameters),
        inputs=definition.inputs,
        groups={**own, **{name: (*own.get(name, ()), *members) for name, members in groups.items()}},
        recording=definition.recording,
    )


class TableBuilder(Generic[D]):
    """Parts of the network of one definition; every value with a standard deviation becomes a factor on it.

    Attributes
    ----------
    parameters : list of Parameter
        ``[[parameter]]``, then the factors, in the order in which their parts are asked for
    """

    def __init__(self, definition: D, priors: Mapping[str, float]) -> None:
        self.definition, self.priors = definition, priors
        self.parameters: list[Parameter] = []
        for index, given in enumerate(definition.parameter):
            sd = priors.get(f"parameter.{index}.start", 0.0) / given.start
            self.parameters.append(Parameter(
                name=given.name, unit=given.unit, start=given.start, lower=given.start / FARTHEST,
                upper=given.start * FARTHEST, sd=sd, description=given.description or given.name.replace("_", " "),
            ))  # fmt: skip

    def boundaries(self) -> tuple[Node, ...]:
        """Nodes of ``[[boundary]]``."""
        return tuple(Node(name=b.name, temperature=symbol(b.input)) for b in self.definition.boundary)

    def parts(self) -> tuple[Node, ...]:
        """Nodes of ``[[part]]``."""
        return tuple(
            Node(name=part.name, capacity=part.heat_capacity_J_K * self.factor(
                f"C_{part.name}", f"part.{index}.heat_capacity_J_K", part.heat_capacity_J_K,
                f"factor on the heat capacity of {part.name}"))
            for index, part in enumerate(self.definition.part)
        )  # fmt: skip

    def links(self) -> tuple[Link, ...]:
        """Links of ``[[link]]``."""
        return tuple(self._link(index, path) for index, path in enumerate(self.definition.link))

    def heats(self) -> tuple[Source, ...]:
        """Sources of ``[[heat]]``."""
        return tuple(source for index, heat in enumerate(self.definition.heat) for source in self._heats(index, heat))

    def groups(self) -> dict[str, tuple[str, ...]]:
        """Parts by `group`."""
        parts = self.definition.part
        return {g: names for g in GROUPS if (names := tuple(part.name for part in parts if part.group == g))}

    def conductance(self, index: int, path: Path) -> sp.Expr:
        """Conductance of a path before its `factor`, [W/K]."""
        a, b = path.between
        return path.conductance_W_K * self.factor(
            f"G_{a}_{b}", f"link.{index}.conductance_W_K", path.conductance_W_K,
            f"factor on the conductance {a} - {b}",
        )  # fmt: skip

    def factor(self, name: str, path: str, value: float, description: str, *, highest: float = FARTHEST) -> sp.Expr:
        """Return the factor on a value, whose parameter is added, or 1 if the value has no standard deviation.

        Parameters
        ----------
        name : str
            Of the factor
        path : str
            Dotted path of the value
        highest : float
            Limit of the factor, [-]
        """
        sd = self.priors.get(path, 0.0)
        if sd <= 0.0 or value == 0.0:
            return sp.Integer(1)
        self.parameters.append(Parameter(
            name=name, start=1.0, lower=1.0 / FARTHEST, upper=highest, sd=sd / abs(value), description=description,
        ))  # fmt: skip
        return symbol(name)

    def _link(self, index: int, path: Path) -> Link:
        a, b = path.between
        factor = sp.Integer(1) if path.factor is None else parse_expression(path.factor)
        return Link(name=f"{a}-{b}", nodes=(a, b), conductance=sp.sympify(self.conductance(index, path) * factor))

    def _heats(self, index: int, heat: Heat) -> Iterator[Source]:
        gain = heat.gain * self.factor(
            f"{heat.name}_gain", f"heat.{index}.gain", heat.gain, f"factor on the heat {heat.name}"
        )
        law = gain * parse_expression(heat.heat_W) / len(heat.parts)
        for part in heat.parts:
            name = heat.name if len(heat.parts) == 1 else f"{heat.name}_{part}"
            yield Source(name=name, node=part, heat=sp.sympify(law), is_loss=False)
