"""Figures as plotly describes them: one drawing per panel, so that a page can set them as its width allows."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from builder.reproduce.figure import MARKED, Curve, Figure, Graph, Map, Panel, Plot
from models.types import Array

FONT = {"family": "system-ui, sans-serif", "size": 13, "color": "#222222"}
LINE = "#D8D8D8"
HEIGHT, BAR_PIXELS, GRAPH_HEIGHT = 340, 34, 460
NAME_LENGTH = 24  # characters in a line beside a bar
SIGNIFICANT = 5  # digits: what is drawn needs no more
CIVIDIS = "Cividis"


def drawings(figure: Figure) -> list[dict[str, Any]]:
    """Return plotly's data and layout of every panel."""
    colours = figure.colours()
    return [_drawing(panel, colours) for panel in figure.panels]


def legend(figure: Figure) -> list[dict[str, str]]:
    """Return label, colour and kind of every legend entry; none where there is nothing to tell apart."""
    kinds: dict[str, str] = {}
    for panel in figure.panels:
        if isinstance(panel, Graph):
            kinds |= {knot.group: "area" for knot in panel.knots}
        elif isinstance(panel, Plot):
            kinds |= {c.label: "dashed" if c.dashed else c.kind for c in panel.curves if c.label not in kinds}
    colours = figure.colours()
    entries = [{"label": label, "colour": colours[label], "kind": kind} for label, kind in kinds.items()]
    return entries if len(entries) > 1 else []


def _drawing(panel: Panel, colours: dict[str, str]) -> dict[str, Any]:
    layout: dict[str, Any] = {
        "font": FONT,
        "margin": {"l": 62, "r": 14, "t": 26, "b": 52},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "height": HEIGHT,
        "showlegend": False,
        "hovermode": "closest",
    }
    if isinstance(panel, Graph):
        return {"data": _graph(panel, colours), "layout": layout | _no_axes()}
    layout |= {"xaxis": _axis(panel.x_label), "yaxis": _axis(panel.y_label)}
    if isinstance(panel, Map):
        return {"data": [_map(panel)], "layout": layout}
    bars = [curve for curve in panel.curves if curve.kind == "bars"]
    layout["xaxis"] |= {"type": "log"} if panel.x_log else {}
    layout["yaxis"] |= {"type": "log", "exponentformat": "power"} if panel.y_log else {}
    if bars:
        layout["height"] = BAR_PIXELS * len(bars[0].y) + 110
        layout["margin"] |= {"l": 10}
        layout["barmode"] = "group"
        layout["yaxis"] |= {"autorange": "reversed", "showgrid": False, "automargin": True, "title": {"text": ""}}
    elif panel.square:
        layout["yaxis"] |= {"scaleanchor": "x", "constrain": "domain"}
        layout["xaxis"] |= {"constrain": "domain"}
    elif panel.from_zero and not panel.y_log:
        layout["yaxis"] |= {"rangemode": "tozero"}
    data = [trace for curve in panel.curves for trace in _traces(curve, panel, colours[curve.label])]
    return {"data": data, "layout": layout}


def _traces(curve: Curve, panel: Plot, colour: str) -> list[dict[str, Any]]:
    common: dict[str, Any] = {"name": curve.label, "legendgroup": curve.label}
    x, y = _short(curve.x), _short(curve.y)
    names = {"customdata": list(curve.names)} if curve.names else {}
    told = "<br>%{customdata}" if curve.names else ""
    hover = f"{panel.x_label}: %{{x}}<br>{panel.y_label}: %{{y}}{told}<extra>{curve.label}</extra>"
    if curve.kind == "bars":
        hover = f"{panel.x_label}: %{{x:.3g}}<extra>%{{y}}, {curve.label}</extra>"
        return [
            common
            | {
                "type": "bar",
                "orientation": "h",
                "x": x,
                "y": [_wrapped(name) for name in curve.names],
                "marker": {"color": colour},
                "hovertemplate": hover,
            }
        ]
    trace = common | names | {"type": "scatter", "x": x, "y": y, "hovertemplate": hover}
    if curve.kind in ("points", "rings"):
        marker: dict[str, Any] = {"color": colour, "size": 5}
        if curve.kind == "rings":
            marker = {"color": colour, "size": 9, "symbol": "circle-open"}
        return [trace | {"type": "scattergl" if len(x) > 2000 else "scatter", "mode": "markers", "marker": marker}]
    if curve.kind == "area":
        return [
            trace | {"mode": "lines", "stackgroup": "all", "fillcolor": colour, "line": {"width": 0.5, "color": colour}}
        ]
    if curve.kind == "band":
        low = curve.low if curve.low is not None else np.zeros_like(curve.y)
        edge = common | {"type": "scatter", "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip", "x": x}
        return [edge | {"y": _short(low)}, edge | {"y": y, "fill": "tonexty", "fillcolor": colour}]
    line = {"color": colour, "width": 2, "dash": "dash" if curve.dashed else "solid"}
    return [trace | {"mode": "lines+markers" if len(x) in MARKED else "lines", "line": line, "marker": {"size": 6}}]


def _map(panel: Map) -> dict[str, Any]:
    """Colours in even steps between the levels, as in the printed figure: the shown value is the level's number."""
    levels = np.array(panel.levels)
    steps = np.interp(panel.z, levels, np.arange(len(levels)))
    ticks = list(range(len(levels)))
    return {
        "type": "contour",
        "x": _short(panel.x),
        "y": _short(panel.y),
        "z": [_short(row) for row in steps],
        "customdata": [_short(row) for row in panel.z],
        "colorscale": CIVIDIS,
        "contours": {"start": 0, "end": len(levels) - 1, "size": 1, "coloring": "fill"},
        "line": {"width": 0.6, "color": "white"},
        "colorbar": {
            "title": {"text": panel.z_label, "side": "right", "font": {"size": 13}},
            "tickvals": ticks,
            "ticktext": [f"{level:g}" for level in panel.levels],
            "thickness": 14,
        },
        "hovertemplate": (
            f"{panel.x_label}: %{{x}}<br>{panel.y_label}: %{{y}}<br>{panel.z_label}: %{{customdata:.4g}}<extra></extra>"
        ),
    }


def _graph(panel: Graph, colours: dict[str, str]) -> list[dict[str, Any]]:
    place = {knot.name: (knot.x, knot.y) for knot in panel.knots}
    traces: list[dict[str, Any]] = []
    for a, b, width, tells in panel.edges:
        (x_1, y_1), (x_2, y_2) = place[a], place[b]
        # Points along the line, so that the whole of it answers to hovering.
        share = np.linspace(0.0, 1.0, 15)
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": _short(x_1 + share * (x_2 - x_1)),
                "y": _short(y_1 + share * (y_2 - y_1)),
                "line": {"color": "#9A9A9A", "width": 1.0 + 6.0 * width},
                "hovertemplate": f"{a} - {b}<br>{tells}<extra></extra>",
                "name": "link",
            }
        )
    for group in dict.fromkeys(knot.group for knot in panel.knots):
        knots = [knot for knot in panel.knots if knot.group == group]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers+text",
                "x": [k.x for k in knots],
                "y": [k.y for k in knots],
                "text": [k.name.replace("_", "<br>") for k in knots],
                "customdata": [k.tells for k in knots],
                "textposition": "top center",
                "textfont": {"size": 12},
                "cliponaxis": False,
                "name": group,
                "marker": {"size": 20, "color": colours[group], "line": {"color": "white", "width": 2}},
                "hovertemplate": "%{text}<br>%{customdata}<extra></extra>",
            }
        )
    return traces


def _no_axes() -> dict[str, Any]:
    hidden = {"visible": False, "fixedrange": True}
    return {"xaxis": hidden, "yaxis": hidden, "height": GRAPH_HEIGHT, "margin": {"l": 34, "r": 34, "t": 44, "b": 20}}


def _axis(label: str) -> dict[str, Any]:
    return {
        "title": {"text": label, "standoff": 8, "font": {"size": 13}},
        "gridcolor": LINE,
        "zerolinecolor": LINE,
        "linecolor": "#888888",
        "showline": True,
        "ticks": "outside",
        "automargin": True,
    }


def _wrapped(name: str) -> str:
    """Names beside bars in short lines: on a phone they would leave the bars no room."""
    return "<br>".join(textwrap.wrap(name, NAME_LENGTH))


def _short(values: Array) -> list[float]:
    """Numbers of as many digits as a drawing needs."""
    return [float(f"{value:.{SIGNIFICANT}g}") for value in np.asarray(values, dtype=float).tolist()]
