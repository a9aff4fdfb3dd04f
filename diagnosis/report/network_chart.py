"""The thermal network as a chart, with the findings marked in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import plotly.graph_objects as go

from diagnosis.report.chart import INK, Chart, dressed
from diagnosis.report.network_layout import places_of
from diagnosis.report.wording import name, short_title
from diagnosis.results.number_format import share
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import NO_CLAIM, Finding
from models.base.types import Array
from models.quantities.part_colours import AMBIENT, part_colours
from models.quantities.quantities import node_of_channel
from models.simulation.thermal_network import ThermalNetwork

LIKELY = 0.1  # probability from which a place is pointed out
ROW_PX = 100
LACKS, MISREAD = "heat that the calibrated model cannot explain", "a reading or an input of it may be at fault"
MARKED = " Red: pointed out, with its probability. Dashed: not in the model as delivered."
MARK = "#C2211A"
SAG = 0.42  # of the distance of rows, by which a link within a row hangs
ASIDE = 0.12  # of the width, by which a link over several rows bends
BENT = 13  # points of a bent link
SHORT = 7  # letters of a name that stay on one line


@dataclass(frozen=True, kw_only=True)
class Marks:
    """Highlights of a drawing.

    Attributes
    ----------
    network : ThermalNetwork
        To be drawn
    nodes, links : mapping of str to (str, float)
        Name to a text about it, and its probability
    names : mapping of str to str
        Nodes that are called otherwise than in the network
    """

    network: ThermalNetwork
    nodes: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    links: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)

    def called(self, node: str) -> str:
        """A node as a reader knows it."""
        return name(self.names.get(node, node))

    @property
    def told(self) -> list[tuple[str, str, float]]:
        """Parts, the text about them, and its probability."""
        parts = [(self.called(node), *said) for node, said in self.nodes.items()]
        ends = {link.name: " to ".join(map(self.called, link.nodes)) for link in self.network.links}
        return parts + [(f"path from {ends[link]}", *said) for link, said in self.links.items()]


def marks(diagnosis: Diagnosis) -> Marks:
    """The network with the findings, with their places and those of unexplained heat; the first at a part counts."""
    network = diagnosis.network
    for finding in diagnosis.findings:  # faults of instruments leave it as it is
        if finding.term is not None:
            network = finding.term.apply(network)
    added = set(network.node_names) - set(diagnosis.network.node_names)
    nodes: dict[str, tuple[str, float]] = {}
    links: dict[str, tuple[str, float]] = {}
    names: dict[str, str] = {}
    pointed: list[tuple[str, tuple[str, float]]] = []
    for finding in diagnosis.findings:
        title = f"acts like {name(finding.law)}" if finding.acts_like else short_title(finding)
        said = (title, finding.sureness)
        pointed += [(target, said) for target in _targets(finding)]
        if finding.term is not None and finding.term.kind == "link":
            label = finding.term.label
            pointed += [(link.name, said) for link in network.links if link.name.startswith(label)]
            names |= {node: node.removeprefix(f"{label}_") for node in added & set(finding.term.target)}
    if diagnosis.verdict not in NO_CLAIM:
        pointed += [(node, (LACKS if place.heat_max_W else MISREAD, place.probability))
                    for place in diagnosis.location if place.probability >= LIKELY for node in place.nodes]  # fmt: skip
    for target, said in pointed:
        found_nodes, found_links = _meant(network, target)
        nodes |= {node: said for node in found_nodes if node not in nodes}
        links |= {link: said for link in found_links if link not in links}
    return Marks(network=network, nodes=nodes, links=links, names=names)


def network_with_places(diagnosis: Diagnosis) -> Chart:
    """The network as corrected, with thermometers, and the places of the findings."""
    marked = marks(diagnosis)
    network = marked.network
    measured = {channel for course in diagnosis.courses for channel in course.measured}
    told = "; ".join(f"{part}: {said}, probability {share(p)}" for part, said, p in marked.told)
    thermometers = sorted(
        {name(node_of_channel(channel, network.node_names)) for channel in measured}
        & set(map(name, network.node_names))
    )
    return Chart(
        name="network", title="The network and the place", figure=drawn(marked, diagnosis.network, measured),
        note="Full: has a thermometer. Ring: no thermometer. Square: surroundings. Heat is made at the top and leaves "
             "at the bottom." + (MARKED if told else ""),
        alt=f"Thermal network of {len(network.node_names)} nodes and {len(network.links)} links; with a thermometer: "
            f"{', '.join(thermometers)}. " + (f"Pointed out: {told}." if told else "No place is marked."),
    )  # fmt: skip


def drawn(marked: Marks, nominal: ThermalNetwork, measured: Iterable[str]) -> go.Figure:
    """The network of the marks as a figure.

    Parameters
    ----------
    nominal : ThermalNetwork
        As delivered; nodes and links that it lacks are drawn as new
    measured : iterable of str
        Channels: nodes with a thermometer, or with one of several
    """
    network = marked.network
    place = {node: (x, -float(row)) for node, (x, row) in places_of(network, nominal).items()}
    rows = 1.0 - min(y for _, y in place.values())
    figure = go.Figure()
    known = {link.name for link in nominal.links}
    for link in sorted(network.links, key=lambda link: link.name in marked.links):
        x, y = _bent(place[link.nodes[0]], place[link.nodes[1]])
        guilty = link.name in marked.links
        said = f"<br>{marked.links[link.name][0]}: {share(marked.links[link.name][1])}" if guilty else ""
        figure.add_scatter(
            x=x, y=y, mode="lines", text=[" to ".join(map(marked.called, link.nodes)) + said] * len(x),
            line={"color": MARK if guilty else "#A3ABB5", "width": 4.0 if guilty else 1.2,
                  "dash": "solid" if link.name in known else "dash", "shape": "spline"},
            hovertemplate="%{text}<extra></extra>",
        )  # fmt: skip
    thermometers = {node_of_channel(channel, network.node_names) for channel in measured}
    colours, parts = part_colours(network.node_names), {part.name for part in network.parts}
    nodes = list(place)
    guilty_nodes = [node for node in nodes if node in marked.nodes]
    figure.add_scatter(
        x=[place[node][0] for node in guilty_nodes], y=[place[node][1] for node in guilty_nodes], mode="markers",
        marker={"size": 36, "color": "rgba(194,33,26,0.14)", "line": {"color": MARK, "width": 3}}, hoverinfo="skip",
    )  # fmt: skip
    figure.add_scatter(
        x=[place[node][0] for node in nodes], y=[place[node][1] for node in nodes], mode="markers",
        marker={"size": 20, "symbol": ["circle" if node in parts else "square" for node in nodes],
                "color": [_fill(node, colours, node in parts, node in thermometers) for node in nodes],
                "line": {"color": [colours[node] if node in parts else AMBIENT for node in nodes], "width": 3}},
        text=[_hover(node, marked, node in thermometers) for node in nodes], hovertemplate="%{text}<extra></extra>",
    )  # fmt: skip
    figure.update_layout(annotations=[_name_of(node, place[node], marked) for node in nodes])
    dressed(figure, int(ROW_PX * rows) + 20, showlegend=False, margin={"l": 0, "r": 0, "t": 10, "b": 10})
    figure.update_xaxes(visible=False, range=[0.0, 1.0], fixedrange=True)
    figure.update_yaxes(visible=False, range=[0.6 - rows, 0.45], fixedrange=True)
    return figure


def _fill(node: str, colours: Mapping[str, str], part: bool, measured: bool) -> str:
    return AMBIENT if not part else colours[node] if measured else "#FFFFFF"


def _hover(node: str, marked: Marks, measured: bool) -> str:
    said = f"<br>{marked.nodes[node][0]}: {share(marked.nodes[node][1])}" if node in marked.nodes else ""
    return f"<b>{marked.called(node)}</b>{', has a thermometer' if measured else ''}{said}"


def _name_of(node: str, at: tuple[float, float], marked: Marks) -> dict[str, Any]:
    """The name under a node, on lines short enough for a phone; its probability, if it is pointed out."""
    guilty = node in marked.nodes
    text = marked.called(node).replace(" ", "<br>", 1) if len(marked.called(node)) > SHORT else marked.called(node)
    text = f"<b>{text}<br>{share(marked.nodes[node][1])}</b>" if guilty else text
    return {"x": at[0], "y": at[1], "text": text, "showarrow": False, "yanchor": "top", "borderpad": 0,
            "yshift": -19 if guilty else -12, "font": {"size": 12, "color": MARK if guilty else INK},
            "bgcolor": "rgba(255,255,255,0.75)"}  # fmt: skip


def _bent(a: tuple[float, float], b: tuple[float, float]) -> tuple[Array, Array]:
    """A line; a bow where it would run through the names of a row."""
    (x_1, y_1), (x_2, y_2) = a, b
    middle, along = (0.5 * (x_1 + x_2), 0.5 * (y_1 + y_2)), np.linspace(0.0, 1.0, BENT)
    if y_1 == y_2:
        middle = (middle[0], y_1 + SAG + 0.4 * abs(x_1 - x_2))
    elif abs(y_1 - y_2) > 1.5:
        middle = (middle[0] + (ASIDE if x_1 + x_2 > 1.0 else -ASIDE), middle[1])
    else:
        along = np.array([0.0, 0.5, 1.0])
    first, last, centre = np.array(a), np.array(b), np.array(middle)
    t = along[:, None]
    points = (1.0 - t) ** 2 * first + 2.0 * t * (1.0 - t) * centre + t**2 * last
    return points[:, 0], points[:, 1]


def _targets(finding: Finding) -> tuple[str, ...]:
    term = finding.term
    if term is None or term.kind == "signal":
        return (finding.node,)
    return term.target[:-1] if term.kind == "link" else term.target


def _meant(network: ThermalNetwork, target: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Nodes and links that a name denotes: of a node, a group, a loss, or a link."""
    if target in network.node_names:
        return (target,), ()
    if target in network.groups:
        return network.groups[target], ()
    if any(link.name == target for link in network.links):
        return (), (target,)
    return tuple(dict.fromkeys(s.node for s in network.sources if s.name == target)), ()
