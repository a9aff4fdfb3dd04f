"""Pictures of zoo plants next to the nominal model: the network drawn, steady temperatures, a warm-up.

python -m benchmarks.zoo_pictures FOLDER [--seed 1]

Each picture has the plant of one family and definition; the nominal model is not calibrated.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.zoo.families import FAMILIES
from diagnosis.proof.zoo.programmes import MINUTES_S, programmes
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Variant, ZooPlant
from models.assembly.gearbox import load_gearbox
from models.base.types import Array
from models.columns.curves import PALETTE, STYLE
from models.files.cycle import Cycle
from models.simulation.simulate import simulate as simulate_nominal

OF_GEARBOXES = ("walls", "rings", "splash", "merged", "open")
CHOSEN = (
    *((family, machine) for machine in ("fzg", "conveyor") for family in OF_GEARBOXES),
    ("blocks", "heated_rod"), ("streams", "la_haute_borne"),
)  # fmt: skip
HOURS, SLOW_HOURS = 8.0, 96.0
ROUNDS = 400


def main(arguments: Sequence[str] | None = None) -> None:
    """Write one picture per family and definition."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    given.folder.mkdir(parents=True, exist_ok=True)
    for k, (family, machine) in enumerate(CHOSEN):
        rng = np.random.default_rng([given.seed, k])
        plant = FAMILIES[family].draw(load_gearbox(machine), rng)
        path = given.folder / f"{k + 1:02d}_{family}_{machine}.png"
        picture(plant, held(plant, programmes(plant, rng)[0]), path)
        print(path)


def held(plant: ZooPlant, programme: Programme) -> Programme:
    """Inputs of ordinary operation, held: the median of a programme while it runs."""
    slow = plant.row_s > MINUTES_S
    rows = round((SLOW_HOURS if slow else HOURS) * 3600.0 / plant.row_s)
    driven = next((programme.inputs[n] for n in ("torque", "heater_power") if n in programme.inputs), np.ones(1))
    running = driven > 0.0
    inputs = {
        name: np.full(rows, float(np.median(values if name.startswith("T_") else values[running])))
        for name, values in programme.inputs.items()
    }
    air = next(float(values[0]) for name, values in inputs.items() if name.startswith("T_"))
    return replace(programme, inputs=inputs, random_heat={}, start=dict.fromkeys(programme.start, air), unrecorded=0)


def nominal_temperatures(plant: ZooPlant, programme: Programme) -> Mapping[str, Array]:
    """Temperatures of the nominal model's nodes with the same inputs, [degC] by name."""
    gearbox = load_gearbox(plant.gearbox)
    network = gearbox.network()
    time = plant.row_s * np.arange(len(next(iter(programme.inputs.values()))))
    start = next(iter(programme.start.values()))
    result = simulate_nominal(
        network, Cycle(time=time, inputs=dict(programme.inputs)), losses=gearbox.loss_laws(), initial=start
    )
    return result.temperatures


def picture(plant: ZooPlant, programme: Programme, path: Path) -> None:
    """Draw one plant."""
    outcome = simulate(plant, programme, [Variant(quiet=True)])
    nominal = nominal_temperatures(plant, programme)
    end = {name: float(values[0, -1]) for name, values in outcome.T.items()}
    with mpl.rc_context({**STYLE, "font.size": 8.0}):
        figure = Figure(figsize=(17.0, 6.5), layout="constrained")
        axes = figure.subplots(1, 3, width_ratios=(1.5, 1.0, 1.0))
        draw_network(axes[0], plant, end)
        draw_steady(axes[1], plant, end, nominal)
        draw_warm_up(axes[2], plant, outcome.readings, nominal)
        inputs = ", ".join(f"{name} {values[0]:.4g}" for name, values in programme.inputs.items())
        loss = float(outcome.P_loss[0, -1])
        figure.suptitle(
            f"{plant.family} for {plant.gearbox}: {len(plant.bodies)} bodies, {len(plant.paths)} paths; {inputs}; "
            f"loss {loss:.0f} W"
        )
        figure.savefig(path, dpi=90)


def draw_network(axes: Axes, plant: ZooPlant, T: Mapping[str, float]) -> None:
    """Bodies by temperature, paths with the heat that they carry at the end, [W]."""
    names = [part.name for part in (*plant.bodies, *plant.boundaries)]
    place = layout(names, [path.ends for path in plant.paths])
    for path in plant.paths:
        (x0, y0), (x1, y1) = (place[end] for end in path.ends)
        nominal = bool(path.part_of)
        axes.plot([x0, x1], [y0, y1], "-" if nominal else "--", color="#6B6B6B" if nominal else PALETTE[1], lw=0.8)
    drawn = axes.scatter(
        [place[n][0] for n in names], [place[n][1] for n in names], c=[T[n] for n in names], cmap="inferno", s=90,
        zorder=3, edgecolors="black",
    )  # fmt: skip
    for name in names:
        axes.annotate(f"{name}\n{T[name]:.1f}", place[name], fontsize=6, ha="center", va="bottom", xytext=(0, 5),
                      textcoords="offset points", zorder=4)  # fmt: skip
    axes.figure.colorbar(drawn, ax=axes, label="degC", fraction=0.03)
    axes.set_axis_off()
    axes.set_title("network; dashed: no link of the model")


def layout(names: Sequence[str], ends: Sequence[tuple[str, str]]) -> dict[str, Array]:
    """Places of nodes by springs along paths and repulsion (Fruchterman, Reingold 1991)."""
    index = {name: k for k, name in enumerate(names)}
    n = len(names)
    tied = np.zeros((n, n))
    for a, b in ends:
        tied[index[a], index[b]] = tied[index[b], index[a]] = 1.0
    angle = 2.0 * np.pi * np.arange(n) / n
    x, ideal = np.stack([np.cos(angle), np.sin(angle)], axis=1), 1.6 / np.sqrt(n)
    for k in range(ROUNDS):
        apart = x[:, None] - x[None]
        distance = np.sqrt((apart**2).sum(axis=-1)) + 1e-9
        force = apart / distance[..., None] * (ideal**2 / distance - tied * distance**2 / ideal)[..., None]
        step = force.sum(axis=1)
        length = np.sqrt((step**2).sum(axis=1, keepdims=True)) + 1e-9
        x = x + step / length * np.minimum(length, 0.1 * (1.0 - k / ROUNDS))
    return dict(zip(names, x, strict=True))


def draw_steady(axes: Axes, plant: ZooPlant, T: Mapping[str, float], nominal: Mapping[str, Array]) -> None:
    """Bodies at the end, next to the nominal node that they are a piece of."""
    bodies = sorted(plant.bodies, key=lambda body: (body.part_of, body.name))
    y = np.arange(len(bodies))
    model = [np.mean([nominal[node][-1] for node in body.part_of.split("+")]) for body in bodies]
    axes.plot([T[body.name] for body in bodies], y, "o", color=PALETTE[1], label="plant")
    axes.plot(model, y, "|", color=PALETTE[0], ms=10, mew=2, label="nominal model")
    axes.set_yticks(y, [body.name for body in bodies], fontsize=6)
    axes.set_xlabel("temperature at the end, degC")
    axes.legend()


def draw_warm_up(axes: Axes, plant: ZooPlant, readings: Mapping[str, Array], nominal: Mapping[str, Array]) -> None:
    """Readings over time, dashed the nominal model."""
    for k, (channel, values) in enumerate(readings.items()):
        hours = plant.row_s * np.arange(values.shape[1]) / 3600.0
        colour = PALETTE[k % len(PALETTE)]
        axes.plot(hours, values[0], color=colour, lw=1.2, label=channel)
        axes.plot(hours, nominal[channel], "--", color=colour, lw=0.8)
    axes.set_xlabel("time, h")
    axes.set_ylabel("reading, degC; dashed: nominal model")
    axes.legend(fontsize=6)


if __name__ == "__main__":
    main()
