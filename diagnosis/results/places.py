"""Where a hypothesis acts, in the nodes of the network."""

from __future__ import annotations

from diagnosis.candidates.factors import SHAPE
from diagnosis.candidates.hypotheses import Hypothesis
from models.simulation.thermal_network import ThermalNetwork


def node_in(network: ThermalNetwork, h: Hypothesis) -> str:
    """The part of the network (or the channel, or the boundary) that a hypothesis acts on."""
    term = h.term
    if term is None:
        return _node_of_parameter(network, h.place)
    if term.kind == "loss_factor":
        nodes = {source.name: source.node for source in network.sources}
        most = max((one for one in term.weighted if one[0] in nodes), key=lambda one: abs(one[1]))[0]
        return nodes[most]
    if term.kind == "link_factor":
        parts = {p.name for p in network.parts}
        ends = next(k.nodes for k in network.links if k.name == term.target[0])
        return next(node for node in ends if node in parts)
    if term.kind == "signal":
        return {"T_ambient": "air", "air_speed": "air"}.get(term.target[0], term.target[0])
    return term.target[0]


def nodes_in(network: ThermalNetwork, h: Hypothesis) -> tuple[str, ...]:
    """All parts that share the heat or the fault of a hypothesis, :func:`node_in` first; at most places it is one."""
    term = h.term
    several = {} if term is None else {"source": term.target, "link": term.target[:-1], "sensor": term.target}
    shared = () if term is None else several.get(term.kind, ())
    return tuple(dict.fromkeys((node_in(network, h), *(node for node in shared if node in network.node_names))))


def _node_of_parameter(network: ThermalNetwork, name: str) -> str:
    bare = name.removeprefix(SHAPE)
    for source in network.sources:
        if any(s.name == name or bare.startswith(f"{s.name}_") for s in source.heat.free_symbols):
            return source.node
    for link in network.links:
        if any(s.name == name or bare.startswith(f"{s.name}_") for s in link.conductance.free_symbols):
            return next(n for n in link.nodes if n in {p.name for p in network.parts})
    for part in network.parts:
        if part.capacity is not None and name in {s.name for s in part.capacity.free_symbols}:
            return part.name
    return network.parts[0].name
