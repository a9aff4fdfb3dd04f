"""Effects that no catalogue has: the diagnosis must find their place and form, or say that it has no name for them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from diagnosis.proof.plant import effect
from diagnosis.proof.plant.anatomy import MESH, OIL
from diagnosis.proof.plant.cycles import ROW_S, STAIRS
from diagnosis.proof.plant.draws import (
    at,
    bearing,
    bearings_of_input,
    drawn,
    highest_part,
    input_shaft,
    lowest_part,
    output_shaft,
    relative,
    share_of_loss,
    share_of_shed,
)
from diagnosis.proof.plant.effect import Effect, Grip
from diagnosis.proof.plant.effects_losses import ROLLING, SLIDING
from diagnosis.proof.plant.plant import Plant

OUTSIDE_EFFECTS: dict[str, Effect] = {}
acts = partial(effect.acts, family="outside the catalogue", table=OUTSIDE_EFFECTS, catalogue=False)


def _on_a_stair(plant: Plant, rng: np.random.Generator, strength: float) -> Mapping[str, float]:
    """Strength and the speed of one of the stairs, missed by up to 2 %."""
    level = STAIRS[int(rng.integers(2, len(STAIRS) - 1))][0]
    return {"a": 0.20 * plant.loss_ref * strength, "x": level * float(rng.uniform(0.98, 1.02))}


def _wax(plant: Plant, rng: np.random.Generator, strength: float) -> Mapping[str, float]:
    whole = plant.anatomy.capacities[f"{plant.anatomy.parts[0]}.inner"][0]
    return {
        "a": 3.0 * plant.shed_ref,
        "latent_J": 60.0 * whole * strength,
        **drawn(plant, rng, {"T_melt": (50.0, 62.0)}),
    }


@acts("source", at(OIL), share_of_loss(0.25, period_min=(35.0, 80.0)), "a W for 45 % of every period")
def limit_cycle_pump(g: Grip) -> None:
    """An electric circulation pump that hunts: on for part of every cycle, whatever the gearbox does."""
    on = np.mod(g.hours * 60.0, g.p["period_min"]) < 0.45 * g.p["period_min"]
    g.heat(OIL, g.p["a"] * on, lost=False)


@acts("source", output_shaft, _on_a_stair, "a / (1 + ((x - x0) / (0.05 x0))^2) W")
def resonance_loss(g: Grip) -> None:
    """A resonance shakes the output shaft in a narrow band of speed."""
    g.heat(g.places[0], g.p["a"] / (1.0 + ((g.x - g.p["x"]) / (0.05 * g.p["x"])) ** 2) * (g.x > 0.0), lost=True)


@acts("source", input_shaft, share_of_loss(0.15), "a r(t) exp(-(T - 25) / 14) x^0.4 W")
def grease_plug(g: Grip) -> None:
    """Stiff grease in a labyrinth brakes until it is warm, and runs out for good while it turns warm."""
    left = g.remembered("left", 1.0)
    shaft = g.T(g.places[0])
    watts = g.p["a"] * left * np.exp(-(shaft - 25.0) / 14.0) * g.x**0.4
    g.memory["left"] = left * (1.0 - 0.05 * ROW_S / 3600.0 * (g.x > 0.0))
    g.heat(g.places[0], np.minimum(watts, 3.0 * g.p["a"]), lost=True)


@acts(
    "link_factor", highest_part, relative(0.7, period_min=(60.0, 150.0)), "convection (1 + a) for 40 % of every period"
)
def periodic_draught(g: Grip) -> None:
    """A gate opens and shuts: draught on the upper housing by the clock."""
    phase = np.mod(g.hours * 60.0, g.p["period_min"])
    g.conduct(f"{g.places[0]}-air", g.p["a"] * (phase < 0.4 * g.p["period_min"]), place=g.places[0])


@acts("source", input_shaft, share_of_loss(0.30), "450 a (dx)+ J at every increase of speed")
def start_pulse(g: Grip) -> None:
    """A slipping coupling at the input shaft takes energy at every increase of speed."""
    before = g.remembered("x", 0.0)
    store = g.remembered("store", 0.0)
    store = store + g.p["a"] * 450.0 * np.maximum(g.x - before, 0.0)
    flow = store * (1.0 - np.exp(-ROW_S / 90.0)) / ROW_S
    g.memory["x"], g.memory["store"] = g.x.copy(), store - flow * ROW_S
    g.heat(g.places[0], flow, lost=True)


@acts("source", bearing, share_of_loss(0.15, hours=(1.0, 2.5)), "a (m - y)+ x^0.7 W, m: fading maximum of y")
def torque_hysteresis(g: Grip) -> None:
    """A bearing keeps the preload of the highest torque that it has seen, and forgets it in an hour or two."""
    memory = np.maximum(g.y, g.remembered("y", 0.0) * np.exp(-ROW_S / (3600.0 * g.p["hours"])))
    g.memory["y"] = memory
    g.heat(g.places[0], g.p["a"] * np.maximum(memory - g.y, 0.0) * g.x**0.7, lost=True)


@acts("source", at(MESH), share_of_loss(0.4), "a f W, f fed by drops of speed, fades in 15 min")
def foam_collapse(g: Grip) -> None:
    """After a drop of speed foam collapses into the mesh, with a quarter of an hour of extra friction."""
    before = g.remembered("x", 0.0)
    foam = g.remembered("foam", 0.0) * np.exp(-ROW_S / 900.0) + np.maximum(before - g.x, 0.0)
    g.memory["x"], g.memory["foam"] = g.x.copy(), np.minimum(foam, 1.0)
    g.heat(MESH, g.p["a"] * g.memory["foam"] * (g.x > 0.0), lost=True)


@acts("source", input_shaft, share_of_loss(0.06, x=(0.12, 0.2)), "a W while 0 < x < x0")
def stick_slip(g: Grip) -> None:
    """Below a low speed the input shaft's support creaks; above it slides freely."""
    slow = (g.x > 0.0) & (g.x < g.p["x"])
    g.heat(g.places[0], g.p["a"] * slow * (1.0 - 0.3 * g.x / g.p["x"]), lost=True)


@acts("link", lowest_part, share_of_shed(0.25, T=(20.0, 40.0), phase=(0.0, 1.0)),
      "a W/K to T + 14 sin(2 pi (t / 24 h + phase))")  # fmt: skip
def day_and_night_wall(g: Grip) -> None:
    """The lower housing faces a wall that swings between day and night, out of step with the air."""
    wall = g.p["T"] + 14.0 * np.sin(2.0 * np.pi * (g.hours / 24.0 + g.p["phase"]))
    g.sink(g.places[0], g.p["a"], wall)


@acts("source", lowest_part, _wax, "latent heat at T_melt +- 1.5 K")
def phase_change(g: Grip) -> None:
    """Wax in a cavity of the lower housing melts and freezes: heat without temperature around its melting point."""
    stored = g.remembered("stored", 0.0)
    melting = stored / g.p["latent_J"]
    wax = g.p["T_melt"] + 1.5 * (2.0 * np.clip(melting, 0.0, 1.0) - 1.0)
    flow = g.p["a"] * (g.T(g.places[0]) - wax)
    flow = np.where((melting <= 0.0) & (flow < 0.0) | (melting >= 1.0) & (flow > 0.0), 0.0, flow)
    flow = np.clip(flow, -stored / ROW_S, (g.p["latent_J"] - stored) / ROW_S)
    g.memory["stored"] = stored + flow * ROW_S
    g.heat(g.places[0], -flow, lost=False)


@acts("source", lowest_part, share_of_loss(0.3), "-a w ((T - 35) / 25, 0 to 1) W, w dries up")
def drying(g: Grip) -> None:
    """Damp insulation on the lower housing dries between 35 and 60 degC and stays dry."""
    water = g.remembered("water", 1.0)
    T = g.T(g.places[0])
    rate = water * np.clip((T - 35.0) / 25.0, 0.0, 1.0)
    g.memory["water"] = water * np.exp(-rate * ROW_S / 5400.0)
    g.heat(g.places[0], -g.p["a"] * rate, lost=False)


@acts("source", bearings_of_input, share_of_loss(0.3), "a f W, f fed by changes of torque, fades in 25 min")
def torque_flutter(g: Grip) -> None:
    """A loose coupling hammers after every change of torque; the bearings of the input shaft take it."""
    before = g.remembered("y", g.y)
    stirred = g.remembered("stirred", 0.0) * np.exp(-ROW_S / 1500.0) + np.abs(g.y - before)
    g.memory["y"], g.memory["stirred"] = g.y.copy(), np.minimum(stirred, 2.0)
    for name in g.places:
        g.heat(name, g.p["a"] / len(g.places) * g.memory["stirred"] * (g.x > 0.0), lost=True)


@acts("source", at(OIL), share_of_loss(0.12, T=(42.0, 55.0)), "a x^0.5 W below T")
def sludge_threshold(g: Grip) -> None:
    """Sludge brakes the wheel below an oil temperature, from one moment to the next."""
    g.heat(OIL, g.p["a"] * (g.T(OIL) < g.p["T"]) * (g.x > 0.0) * np.sqrt(g.x), lost=True)


@acts("loss_factor", at(MESH), relative(0.2, 0.6, T=(62.0, 75.0)), "mesh sliding (1 - a s((T_pinion - T) / 2.5))")
def worn_film(g: Grip) -> None:
    """Rolling loss that turns into sliding loss: a coating that works only while the contact is hot."""
    hot = 1.0 / (1.0 + np.exp(-(g.T(g.plant.anatomy.gears[0]) - g.p["T"]) / 2.5))
    g.factor(SLIDING, -g.p["a"] * hot)
    g.factor(ROLLING, g.p["a"] * hot)
