"""Where in a network a mechanism may sit: from the patterns of the catalogue to nodes, sources and links.

A pattern is a name, a group (its members together), or ``each`` and a group (one place per member), by kind:

- source, link: nodes. ``oil``, ``housing``, ``each bearings``, ``each parts`` (of all there are), ``each others`` (a
  base frame or a tank: those of no group, where there are groups, that are not inside); of a link also both ends,
  ``each bearings-returns``, the other one a boundary or a group of one
- loss_factor: sources. ``losses``, all that are mechanical; ``mesh_sliding``, where there are several stages that of
  all, and that of each; the losses in a group of nodes,
  ``each bearings``; those in the nodes of a group that hang on one member of another, ``each shafts>bearings``; those
  that a factor of the network multiplies, ``factor seal``; several together, ``mesh_sliding+mesh_rolling``; with
  links that change with them, ``churning+oil-gears``
- link_factor: links by their ends. ``oil-housing``, ``each bearings-housing``, ``oil-gears+oil-housing``
- signal: an input. ``torque``
- sensor: measured channels. ``each sensor`` (temperatures and total loss), ``each thermometer``, ``clock``, ``pair``

A pattern that a network has no part of gives no place.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from models.network.laws import symbol
from models.quantities.quantities import node_of_channel
from models.simulation.thermal_network import Source, ThermalNetwork
from models.terms.term import Kind

EACH, FACTOR, ALL_LOSSES, ALL_PARTS, OTHERS = "each ", "factor ", "losses", "parts", "others"
INSIDE = ("oil", "gears", "mesh")  # parts that no surroundings touch
STAGE_NUMBER = re.compile(r"_\d+$")


@dataclass(frozen=True, kw_only=True)
class Placement:
    """One place of a mechanism.

    Attributes
    ----------
    name : str
        How it is called; an identifier
    target : tuple of str
        Nodes, sources, links, inputs or channels
    here, there : tuple of str
        Nodes whose mean temperatures a law reads as ``T_here`` and ``T_there``
    """

    name: str
    target: tuple[str, ...]
    here: tuple[str, ...] = ()
    there: tuple[str, ...] = ()


def placements(network: ThermalNetwork, kind: Kind, pattern: str, channels: Sequence[str]) -> tuple[Placement, ...]:
    """Return all places of a network that match a pattern.

    Parameters
    ----------
    network : ThermalNetwork
    kind : str
        Of the mechanism
    pattern : str
    channels : sequence of str
        What is measured: nodes, or ``P_loss``

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> network = load_gearbox("fzg").network()
    >>> [one.target for one in placements(network, "link_factor", "each bearings-housing", ())][0]
    ('bearing_1-housing_lower', 'bearing_1-housing_upper')
    >>> [one.target for one in placements(network, "loss_factor", "each shafts>bearings", ())]
    [('bearing_1', 'bearing_2'), ('bearing_3', 'bearing_4')]
    >>> [one.target for one in placements(network, "loss_factor", "churning+oil-gears", ())]
    [('churning', 'pinion-oil', 'wheel-oil')]
    >>> placements(network, "loss_factor", "churning+oil-air", ())
    ()
    """
    if kind in ("source", "link"):
        found = _nodes(network, pattern)
    elif kind == "loss_factor":
        found = _sources(network, pattern)
    elif kind == "link_factor":
        found = _links(network, pattern)
    elif kind == "signal":
        known = pattern in (*network.inputs, *network.derived)
        found = iter([Placement(name=pattern, target=(pattern,))] if known else [])
    else:
        found = _channels(network, pattern, channels)
    return tuple(found)


def _apart(pattern: str) -> tuple[bool, str]:
    return pattern.startswith(EACH), pattern.removeprefix(EACH)


def _members(network: ThermalNetwork, name: str) -> tuple[str, ...]:
    if name == ALL_PARTS:
        return tuple(part.name for part in network.parts)
    if name == OTHERS:
        grouped = {*INSIDE, *(member for members in network.groups.values() for member in members)}
        return tuple(part.name for part in network.parts if network.groups and part.name not in grouped)
    return network.groups.get(name, (name,) if name in network.node_names else ())


def _nodes(network: ThermalNetwork, pattern: str) -> Iterator[Placement]:
    each, name = _apart(pattern)
    name, dash, other = name.partition("-")
    there = tuple(_members(network, other)) if dash else ()
    if dash and len(there) != 1:
        return
    parts = {part.name for part in network.parts}
    members = tuple(node for node in _members(network, name) if node in parts and node not in there)
    ending = f"_{other}" if dash else ""
    if each:
        yield from (Placement(name=node + ending, target=(node,), here=(node,), there=there) for node in members)
    elif members:
        yield Placement(name=name + ending, target=members, here=members, there=there)


def _sources(network: ThermalNetwork, pattern: str) -> Iterator[Placement]:
    each, rest = _apart(pattern)
    holder, carries, held = rest.partition(">")
    if each and carries:
        yield from _held(network, holder, held)
        return
    wanted = [name for name in rest.split("+") if "-" not in name]
    ends = "+".join(name for name in rest.split("+") if "-" in name)
    links = [link for place in _links(network, ends) for link in place.target] if ends else []
    chosen = [
        source
        for source in network.sources
        if source.is_loss
        and any(
            name in (source.name, STAGE_NUMBER.sub("", source.name), ALL_LOSSES, *source.acts_as)
            or (name in network.groups and source.node in network.groups[name])
            or (name.startswith(FACTOR) and symbol(name.removeprefix(FACTOR)) in source.heat.free_symbols)
            for name in wanted
        )
    ]
    if each:
        for node in dict.fromkeys(source.node for source in chosen):
            yield Placement(name=node, target=tuple(s.name for s in chosen if s.node == node), here=(node,))
    elif chosen and bool(links) == bool(ends):
        name = "_".join(identifier(name.removeprefix(FACTOR)) for name in rest.split("+"))
        nodes = tuple(dict.fromkeys(source.node for source in chosen))
        yield Placement(name=name, target=(*(source.name for source in chosen), *links), here=nodes)
        stages: dict[str, list[Source]] = {}
        for source in chosen:
            if not links and source.name not in wanted and STAGE_NUMBER.sub("", source.name) in wanted:
                stages.setdefault(source.name[source.name.rindex("_") :], []).append(source)
        for number, own in stages.items():
            here = tuple(dict.fromkeys(source.node for source in own))
            yield Placement(name=name + number, target=tuple(source.name for source in own), here=here)


def _held(network: ThermalNetwork, holder: str, held: str) -> Iterator[Placement]:
    """One place per member of `holder`: the losses in those nodes of `held` that share a link with it, if several."""
    for member in _members(network, holder):
        neighbours = {node for link in network.links if member in link.nodes for node in link.nodes}
        nodes = tuple(node for node in _members(network, held) if node in neighbours)
        losses = [source for source in network.sources if source.is_loss and source.node in nodes]
        if len({source.node for source in losses}) > 1:
            yield Placement(name=f"{held}_of_{member}", target=tuple(source.name for source in losses), here=nodes)


def _links(network: ThermalNetwork, pattern: str) -> Iterator[Placement]:
    each, rest = _apart(pattern)
    name = identifier(rest)
    chosen: dict[str, tuple[str, str]] = {}
    for ends in rest.split("+"):
        a, _, b = ends.partition("-")
        here, there = _members(network, a), _members(network, b)
        for link in network.links:
            for first, second in (link.nodes, link.nodes[::-1]):
                if first in here and second in there:
                    chosen[link.name] = (first, second)
    if not each:
        if chosen:
            yield _between(name, chosen)
        return
    # One place per member of the end that is a group: the first, where both are.
    side = 0 if rest.partition("-")[0] in network.groups else 1
    for member in dict.fromkeys(nodes[side] for nodes in chosen.values()):
        a, b = rest.split("-")
        own = {link: nodes for link, nodes in chosen.items() if nodes[side] == member}
        yield _between(f"{member}_{b}" if side == 0 else f"{a}_{member}", own)


def identifier(name: str) -> str:
    """Name of a link as an identifier."""
    return re.sub(r"\W", "_", name)


def _between(name: str, chosen: dict[str, tuple[str, str]]) -> Placement:
    here, there = (tuple(dict.fromkeys(nodes)) for nodes in zip(*chosen.values(), strict=True))
    return Placement(name=name, target=tuple(chosen), here=here, there=there)


def _channels(network: ThermalNetwork, pattern: str, channels: Sequence[str]) -> Iterator[Placement]:
    nodes = [name for name in channels if node_of_channel(name, network.node_names) in network.node_names]
    at = {name: node_of_channel(name, network.node_names) for name in nodes}
    if pattern == "clock":
        # The loss comes from the rig's own torque meters, on one clock with speed and torque, more often than not.
        if nodes:
            yield Placement(name="clock", target=tuple(nodes))
        if nodes and len(nodes) < len(channels):
            yield Placement(name="clock_of_all", target=tuple(channels))
    elif pattern == "pair":
        for pair in combinations(nodes, 2):
            yield Placement(name="_".join(pair), target=pair, here=(at[pair[0]],), there=(at[pair[1]],))
    else:
        chosen = nodes if pattern == "each thermometer" else channels
        for name in chosen:
            yield Placement(name=name, target=(name,), here=(at[name],) if name in nodes else ())
