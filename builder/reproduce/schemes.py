"""The paper's schemes (figs. 1, 2, 9): nothing to compare; ours drawn from the definition where that makes sense."""

from __future__ import annotations

import numpy as np

from builder.reproduce.figure import Figure, Graph, Knot
from builder.reproduce.item import Item, Table, Verdict
from builder.reproduce.study import MIDDLE, Study
from models.laws import symbol

BOUNDARY = "boundary"
NO_CONDUCTANCE = 1e-9  # W/K
WIDEST = 100.0  # W/K, drawn as the widest line


def schemes(study: Study) -> list[Item]:
    """Figs. 1 and 2."""
    steps = (
        (
            "full model on sampled points",
            f"{study.ours.preset.samples} points for each of {len(study.ours.networks)} networks",
        ),
        ("training, validation, test", "80 %, 10 %, 10 %"),
        ("networks", ", ".join(one.network.name.replace("_", " ") for one in study.ours.networks)),
        ("sampling and training together", f"{study.ours.seconds:.1f} s"),
    )
    return [
        Item(
            key="Fig. 1",
            title="Scheme: from the design of experiment to the networks",
            reading="The same path here; build-fmu walks it.",
            tables=(Table(title="Ours", header=("step", "here"), rows=steps, texts=True),),
            without_checks=Verdict.SCHEME,
        ),
        Item(
            key="Fig. 2",
            title="Scheme: the FZG rig",
            reading="A drawing of the rig after DIN ISO 14635-1. The definition models one of its two gearboxes.",
            without_checks=Verdict.SCHEME,
        ),
    ]


def thermal_network(study: Study) -> Item:
    """Fig. 9: nodes and links of the network, with the conductances of one steady operating point."""
    network = study.network
    speed, torque = float(study.pinion_speed[MIDDLE]), float(study.pinion_torque[1])
    steady = network.steady_state(losses=study.full, speed=speed, torque=torque)
    temperature = {name: float(T[0, 0]) for name, T in steady.temperatures.items()}
    signals = {f"T_{name}": T for name, T in temperature.items()}
    signals |= {"time": 0.0, "speed": speed, "torque": torque, **network.inputs}
    signals |= {parameter.name: parameter.start for parameter in network.parameters}
    at = {symbol(name): value for name, value in signals.items()}
    values = [float(link.conductance.subs(at)) for link in network.links]
    group = {name: key for key, names in network.groups.items() for name in names}
    knots = tuple(
        Knot(
            name=node.name,
            x=place[0],
            y=place[1],
            group=BOUNDARY if node.temperature is not None else group.get(node.name, node.name),
            tells=f"{temperature[node.name]:.1f} °C"
            + "".join(f"<br>heated by {s.name.replace('_', ' ')}" for s in network.sources if s.node == node.name),
        )
        for node, place in ((node, _place(study, node.name)) for node in network.nodes)
    )
    edges = tuple(
        (*link.nodes, float(np.clip(np.log1p(G) / np.log1p(WIDEST), 0.0, 1.0)), f"{G:.2f} W/K")
        for link, G in zip(network.links, values, strict=True)
        if G > NO_CONDUCTANCE
    )
    rows = tuple((" - ".join(link.nodes), f"{G:.2f}") for link, G in zip(network.links, values, strict=True))
    return Item(
        key="Fig. 9",
        title=f"Scheme of the thermal network, {len(network.nodes)} elements",
        reading=(
            "Drawn from the definition. Conductances at 8.3 m/s and T₂ = 141 N m in steady state, oil at "
            f"{temperature['oil']:.1f} °C. The frame is there and not linked: the paper gives no foundation."
        ),
        tables=(Table(title="Conductances", header=("link", "W/K"), rows=rows),),
        figures=(
            Figure(
                name="fig_09",
                title="Fig. 9: thermal network of the rig",
                panels=(Graph(title="Wider lines conduct more", knots=knots, edges=edges),),
                caption="Heat enters at the mesh (sliding, rolling), the bearings, and the oil (churning, seals).",
            ),
        ),
        without_checks=Verdict.SCHEME,
    )


def _place(study: Study, name: str) -> tuple[float, float]:
    """From the air on the left to the mesh on the right, the oil amid the bearings of both shafts."""
    gearbox, groups = study.gearbox, study.network.groups
    if name in ("oil", "mesh"):
        return (2.7, 1.5) if name == "oil" else (6.4, 1.5)
    if name in groups["bearings"]:
        bearing = next(b for b in gearbox.bearing if b.name == name)
        row = [s.name for s in gearbox.shaft].index(bearing.shaft)
        along = [b.name for b in gearbox.bearing if b.shaft == bearing.shaft].index(name)
        return 2.2 + 1.0 * along, (3.0 - 0.5 * along) if row == 0 else 0.5 * along
    columns = ((0.0, ("air", "frame")), (1.2, groups["housing"][::-1]), (4.2, groups["shafts"]), (5.4, groups["gears"]))
    x, column = next((x, column) for x, column in columns if name in column)
    spread = 1.2 if x == columns[2][0] else 0.75
    return x, float(np.linspace(1.5 + spread, 1.5 - spread, len(column))[list(column).index(name)])
