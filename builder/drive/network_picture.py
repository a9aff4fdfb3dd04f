"""The thermal network of a machine as a picture: where the reports of a diagnosis put its nodes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from diagnosis.report.network_layout import places_of
from models.columns.curves import PALETTE, STYLE
from models.simulation.thermal_network import ThermalNetwork

INCH_PER_ROW, WIDTH_INCH = 1.1, 9.0
BOX = {"boxstyle": "round,pad=0.4", "linewidth": 1.2}
SHOWN_WHOLE = 100.0  # W/K, from which conductances have no decimals
BOUNDARY, HEATED, PLAIN = "#e8e8e8", "#fdebdc", "#ffffff"
KINDS = (("warmed by losses or heats", HEATED), ("part", PLAIN), ("surroundings", BOUNDARY))


def draw_network(path: Path, network: ThermalNetwork, conductances: Mapping[str, float], *, title: str) -> None:
    """Draw nodes and links into a PNG, SVG or PDF; the wider a line, the larger its conductance.

    Parameters
    ----------
    path : Path
        File to write; its ending is the kind
    network : ThermalNetwork
    conductances : mapping of str to float
        Of every link, [W/K]
    title : str
    """
    found = places_of(network, network)
    rows = 1 + max(row for _, row in found.values())
    place = {node: (x, -(row + 0.5) / rows) for node, (x, row) in found.items()}
    heated = {source.node for source in network.sources}
    parts = {part.name for part in network.parts}
    largest = max(conductances.values(), default=1.0)
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        figure = Figure(figsize=(WIDTH_INCH, 1.0 + INCH_PER_ROW * rows), layout="constrained")
        axes = figure.subplots()
        axes.set_xlim(-0.02, 1.02)
        axes.set_ylim(-1.0, 0.0)
        axes.set_axis_off()
        axes.set_title(f"{title}\nnumbers: conductances in W/K", fontsize=9.0)
        labels = []
        for link in network.links:
            a, b = sorted(place[node] for node in link.nodes)
            G = conductances[link.name]
            bend = 0.25 if a[1] == b[1] else 0.08
            width = 0.6 + 3.0 * (G / largest) ** 0.5 if largest > 0.0 else 0.6
            axes.add_patch(FancyArrowPatch(a, b, arrowstyle="-", connectionstyle=f"arc3,rad={bend}", color=PALETTE[6],
                                           linewidth=width, alpha=0.7, zorder=1))  # fmt: skip
            labels.append((a, b, bend, f"{G:.3g}" if G < SHOWN_WHOLE else f"{G:.0f}"))
        for node, (x, y) in place.items():
            colour = BOUNDARY if node not in parts else HEATED if node in heated else PLAIN
            axes.annotate(node.replace("_", " "), (x, y), ha="center", va="center", zorder=3,
                          bbox={**BOX, "facecolor": colour, "edgecolor": PALETTE[6]})  # fmt: skip
        for label, colour in KINDS:
            axes.plot([], [], "s", color=colour, markeredgecolor=PALETTE[6], label=label)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=len(KINDS), fontsize=8.0)
        figure.draw_without_rendering()  # now the layout is known, and with it where the middles of the curves are
        for a, b, bend, text in labels:
            A, B = axes.transData.transform([a, b])
            at = axes.transData.inverted().transform(0.5 * (A + B + bend * np.array([B[1] - A[1], A[0] - B[0]])))
            axes.annotate(text, (at[0], at[1]), fontsize=6.5, color=PALETTE[0], ha="center", va="center", zorder=2,
                          bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"})  # fmt: skip
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)
