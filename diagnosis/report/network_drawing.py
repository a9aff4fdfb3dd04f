"""The thermal network as a drawing that fits any width: heat is made at the top and leaves at the bottom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from markupsafe import Markup

from diagnosis.report.wording import headline, name, share
from diagnosis.results.result import NO_CLAIM, Diagnosis
from diagnosis.results.result_parts import Finding
from models.quantities.quantities import node_of_channel
from models.simulation.thermal_network import ThermalNetwork

LIKELY = 0.1  # probability from which a place is pointed out
ROW_PX = 92
WIDEST_ROW = 5  # names that a phone has room for
HUB = 3  # links inside a row that make a hub
SWEEPS = 4  # of putting nodes under their neighbours
UNITS = 1000


@dataclass(frozen=True, kw_only=True)
class Marks:
    """Highlights of a drawing.

    Attributes
    ----------
    nodes, links : mapping of str to (str, float)
        Name to a text about it, and its probability
    names : mapping of str to str
        Nodes that are called otherwise than in the network
    """

    nodes: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    links: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)

    def called(self, node: str) -> str:
        """A node as a reader knows it."""
        return name(self.names.get(node, node))

    def told(self, network: ThermalNetwork) -> list[tuple[str, str, float]]:
        """Parts, the text about them, and its probability."""
        parts = [(self.called(node), *said) for node, said in self.nodes.items()]
        ends = {link.name: " to ".join(map(self.called, link.nodes)) for link in network.links}
        return parts + [(f"path from {ends[link]}", *said) for link, said in self.links.items()]


def corrected(diagnosis: Diagnosis) -> ThermalNetwork:
    """The network with the findings; faults of instruments leave it as it is."""
    network = diagnosis.network
    for finding in diagnosis.findings:
        if finding.term is not None:
            network = finding.term.apply(network)
    return network


def marks(diagnosis: Diagnosis) -> Marks:
    """Places of the findings and of unexplained heat, with their probabilities; the first that names a part counts."""
    network = corrected(diagnosis)
    added = set(network.node_names) - set(diagnosis.network.node_names)
    nodes: dict[str, tuple[str, float]] = {}
    links: dict[str, tuple[str, float]] = {}
    names: dict[str, str] = {}
    pointed: list[tuple[str, tuple[str, float]]] = []
    for finding in diagnosis.findings:
        title = " or ".join(headline(one) for one in finding.tie_set or (finding.mechanism,))
        said = (f"acts like {headline(finding.mechanism)}" if finding.acts_like else title, finding.sureness)
        pointed += [(target, said) for target in _targets(finding)]
        if finding.term is not None and finding.term.kind == "link":
            label = finding.term.label
            pointed += [(link.name, said) for link in network.links if link.name.startswith(label)]
            names |= {node: node.removeprefix(f"{label}_") for node in added & set(finding.term.target)}
    if diagnosis.verdict not in NO_CLAIM:
        pointed += [(place.node, ("heat that the calibrated model cannot explain", place.probability))
                    for place in diagnosis.location if place.probability >= LIKELY]  # fmt: skip
    for target, said in pointed:
        found_nodes, found_links = _meant(network, target)
        nodes |= {node: said for node in found_nodes if node not in nodes}
        links |= {link: said for link in found_links if link not in links}
    return Marks(nodes=nodes, links=links, names=names)


def drawn(network: ThermalNetwork, nominal: ThermalNetwork, measured: Iterable[str], marked: Marks) -> Markup:
    """The network as HTML.

    Parameters
    ----------
    network : ThermalNetwork
        What is drawn
    nominal : ThermalNetwork
        As delivered; what it lacks is drawn as new
    measured : iterable of str
        Channels: nodes with a thermometer, or with one of several
    marked : Marks
    """
    rows = _rows(network, nominal)
    place = {node: (x * UNITS, y * UNITS) for node, (x, y) in _places(rows).items()}
    known, has_thermometer = (
        {link.name for link in nominal.links},
        {node_of_channel(name, network.node_names) for name in measured},
    )
    ordered = sorted(network.links, key=lambda link: link.name in marked.links)
    lines = Markup("").join(
        Markup('<path class="{}" d="{}"><title>{}</title></path>').format(
            " ".join(["link"] + ["guilty"] * (link.name in marked.links) + ["new"] * (link.name not in known)),
            _path(place[link.nodes[0]], place[link.nodes[1]], UNITS / len(rows)),
            " to ".join(map(marked.called, link.nodes)),
        )
        for link in ordered
    )
    parts = {part.name for part in network.parts}
    heated = {source.node for source in nominal.sources}
    chips = Markup("").join(
        Markup('<div class="{}" style="left: {:.2f}%; top: {:.2f}%" title="{}">{}{}</div>').format(
            " ".join(
                ["node", ("heated" if node in heated else "part") if node in parts else "boundary"]
                + ["measured"] * (node in has_thermometer)
                + ["guilty"] * (node in marked.nodes)
                + ["new"] * (node not in nominal.node_names)
            ),
            x * 100.0 / UNITS,
            y * 100.0 / UNITS,
            marked.nodes[node][0] if node in marked.nodes else "",
            marked.called(node),
            Markup("<small>{}</small>").format(share(marked.nodes[node][1])) if node in marked.nodes else "",
        )
        for node, (x, y) in place.items()
    )
    return Markup(
        '<div class="network" style="height: {}px"><svg viewBox="0 0 {} {}" preserveAspectRatio="none" role="img"'
        ' aria-label="Thermal network: {} nodes, {} links">{}</svg>{}</div>'
    ).format(len(rows) * ROW_PX, UNITS, UNITS, len(place), len(network.links), lines, chips)


def places(network: ThermalNetwork) -> dict[str, tuple[float, float]]:
    """Where the nodes of a network stand: x and y from the upper left, 0 to 1."""
    return _places(_rows(network, network))


def _places(rows: list[list[str]]) -> dict[str, tuple[float, float]]:
    return {
        node: ((index + 0.5) / len(row), (line + 0.5) / len(rows))
        for line, row in enumerate(rows)
        for index, node in enumerate(row)
    }


def _targets(finding: Finding) -> tuple[str, ...]:
    term = finding.term
    return (finding.node,) if term is None or term.kind in ("link", "signal") else term.target


def _meant(network: ThermalNetwork, target: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Nodes and links that a name denotes: of a node, a group, a loss, or a link."""
    if target in network.node_names:
        return (target,), ()
    if target in network.groups:
        return network.groups[target], ()
    if any(link.name == target for link in network.links):
        return (), (target,)
    return tuple(dict.fromkeys(s.node for s in network.sources if s.name == target)), ()


def _rows(network: ThermalNetwork, nominal: ThermalNetwork) -> list[list[str]]:
    """Nodes by their distance from the surroundings, farthest first, each row in the order of its neighbours."""
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
    layer = {node.name: 0 for node in nominal.nodes if node.temperature is not None}
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
    return sum(values) / len(values) if values else otherwise


def _path(a: tuple[float, float], b: tuple[float, float], row: float) -> str:
    """A line; an arc where it would run through the names of a row."""
    (x_1, y_1), (x_2, y_2) = a, b
    if abs(y_1 - y_2) < 0.5 * row:
        sag = y_1 + row * (0.5 + 0.0004 * abs(x_1 - x_2))
        return f"M{x_1:.0f} {y_1:.0f}Q{0.5 * (x_1 + x_2):.0f} {sag:.0f} {x_2:.0f} {y_2:.0f}"
    if abs(y_1 - y_2) > 1.5 * row:
        side = 0.5 * (x_1 + x_2) + (0.1 if x_1 + x_2 > UNITS else -0.1) * UNITS
        return f"M{x_1:.0f} {y_1:.0f}Q{side:.0f} {0.5 * (y_1 + y_2):.0f} {x_2:.0f} {y_2:.0f}"
    return f"M{x_1:.0f} {y_1:.0f}L{x_2:.0f} {y_2:.0f}"
