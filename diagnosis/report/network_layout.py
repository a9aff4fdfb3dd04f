"""Places of the nodes of a thermal network in a drawing: heat is made at the top and leaves at the bottom."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import fsum

from models.simulation.thermal_network import ThermalNetwork

WIDEST_ROW = 5  # names that a phone has room for
HUB = 3  # links inside a row that make a hub
SWEEPS = 4  # of putting nodes under their neighbours


def places_of(network: ThermalNetwork, nominal: ThermalNetwork) -> dict[str, tuple[float, int]]:
    """Return where every node stands: from left to right, 0 to 1, and its row, 0 at the top.

    Parameters
    ----------
    nominal : ThermalNetwork
        The same as delivered
    """
    return {
        node: ((index + 0.5) / len(row), line)
        for line, row in enumerate(_rows_of(network, nominal))
        for index, node in enumerate(row)
    }


def _rows_of(network: ThermalNetwork, nominal: ThermalNetwork) -> list[list[str]]:
    """Return the nodes by their distance from the surroundings, farthest first, near their neighbours."""
    layer = _layers(network, nominal)
    rows = [[n for n in network.node_names if layer[n] == depth] for depth in sorted(set(layer.values()), reverse=True)]
    neighbours: dict[str, set[str]] = {node: set() for node in network.node_names}
    for link in network.links:
        for a, b in (link.nodes, link.nodes[::-1]):
            neighbours[a].add(b)
    for sweep in range(SWEEPS):
        for fixed, free in pairwise(rows if sweep % 2 == 0 else rows[::-1]):
            at = {n: (i + 0.5) / len(fixed) for i, n in enumerate(fixed)}
            own = {n: (i + 0.5) / len(free) for i, n in enumerate(free)}
            free.sort(key=lambda n: _middle([at[o] for o in neighbours[n] if o in at], own[n]))
            free[:] = _hubs_amid(free, neighbours)
    return [part for row in rows for part in _split(row)]


def _layers(network: ThermalNetwork, nominal: ThermalNetwork) -> dict[str, int]:
    """Steps from every node to the surroundings, along the links of the model as delivered."""
    joined = [link.nodes for link in nominal.links]
    layer = dict.fromkeys(nominal.boundaries, 0)
    reached = list(layer)
    for near in reached:
        for pair in joined:
            for far in set(pair) - set(layer) if near in pair else ():
                layer[far] = layer[near] + 1
                reached.append(far)
    deepest = max(layer.values(), default=0)
    layer |= {node: deepest for node in nominal.node_names if node not in layer}
    for link in network.links:  # what a finding adds stands beside what it is linked to, not at the bottom
        for new, old in (link.nodes, link.nodes[::-1]):
            if new not in nominal.node_names and old in nominal.node_names:
                layer[new] = max(layer[old] - 1, 0)
    return layer | {node: 0 for node in network.node_names if node not in layer}


def _hubs_amid(row: list[str], neighbours: Mapping[str, set[str]]) -> list[str]:
    """A row with those in its middle that are linked to many of it, as the oil is amid the bearings."""
    hubs = [node for node in row if len(neighbours[node] & set(row)) >= HUB]
    others = [node for node in row if node not in hubs]
    half = len(others) // 2
    return [*others[:half], *hubs, *others[half:]]


def _split(row: list[str]) -> list[list[str]]:
    """A row as several where it is too long, so that none is left with one name."""
    lines = -(-len(row) // WIDEST_ROW)
    size = -(-len(row) // lines)
    return [row[i : i + size] for i in range(0, len(row), size)]


def _middle(values: list[float], otherwise: float) -> float:
    return fsum(values) / len(values) if values else otherwise  # in whatever order a set gives them
