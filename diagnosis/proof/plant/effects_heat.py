"""Effects that move heat without losing power: heat paths, oil circuit, surroundings. Forms are the plant's own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from diagnosis.proof.plant import effect
from diagnosis.proof.plant.anatomy import OIL
from diagnosis.proof.plant.draws import (
    all_parts,
    at,
    bearing,
    gears,
    highest_part,
    input_shaft,
    lowest_part,
    output_shaft,
    relative,
    shafts,
    share_of_loss,
    share_of_shed,
)
from diagnosis.proof.plant.effect import Effect, Grip
from diagnosis.proof.plant.effects_losses import CHURNING
from diagnosis.proof.plant.plant import REFERENCE_SPEED, Plant
from models.formulas.heat_transfer import STEFAN_BOLTZMANN
from models.quantities.units import KELVIN

STEP_H = 10.0 / 3600.0
HEAT_EFFECTS: dict[str, Effect] = {}
acts = partial(effect.acts, table=HEAT_EFFECTS)


def _radiation(_: Plant, rng: np.random.Generator, strength: float) -> Mapping[str, float]:
    return {"a": -min(0.45 * strength, 0.85) if rng.random() < 0.8 else 0.1 * min(strength, 1.0)}


def _mist(_: Plant, rng: np.random.Generator, strength: float) -> Mapping[str, float]:
    return {"a": (0.9 if rng.random() < 0.6 else -0.9) * strength}


# ---------------------------------------------------------------------- heat paths


@acts("link_factor", gears, relative(0.35, 0.8), "conductance gear-oil (1 - a s(x)), walls 40 % of it",
      family="oil circuit")  # fmt: skip
def aeration(g: Grip) -> None:
    """Foam: the oil takes less heat from the gears and brings less to the walls, and brakes less."""
    foam = g.x**2 / (g.x**2 + 0.30**2)
    for gear in g.places:
        g.conduct(f"{gear}-oil", -g.p["a"] * foam, place=gear)
    for part in g.plant.anatomy.parts:
        g.conduct(f"oil-{part}", -0.4 * g.p["a"] * foam, place=part)
    g.factor(CHURNING, -0.4 * g.p["a"] * foam)


@acts(
    "link_factor", all_parts, relative(0.55), "film oil-housing (x / 0.415)^a in place of constant", family="heat path"
)
def oil_housing_speed(g: Grip) -> None:
    """The film on the walls follows the speed instead of being constant."""
    change = np.clip(np.maximum(g.x / REFERENCE_SPEED, 0.05) ** g.p["a"], 0.1, 3.0) - 1.0
    for part in g.places:
        g.conduct(f"oil-{part}", change, place=part)


@acts("link", all_parts, _radiation, "emissivity + a", family="surroundings")
def radiation_error(g: Grip) -> None:
    """The paint is another one."""
    area = g.plant.gearbox.housing.outside_area_m2
    for part in g.places:
        theta, theta_a = g.T(part) + KELVIN, g.air + KELVIN
        per_area = STEFAN_BOLTZMANN * (theta**2 + theta_a**2) * (theta + theta_a)
        g.sink(part, g.p["a"] * per_area * area * g.plant.anatomy.share[part], g.air)


@acts("link_factor", all_parts, relative(0.45, 0.95), "housing to air 0.2 + 0.8 (1 - a)^0.58", family="surroundings")
def air_cooling_change(g: Grip) -> None:
    """The fan blows less than it did: forced convection, four fifths of what the housing sheds, with v^0.58."""
    for part in g.places:
        g.conduct(f"{part}-air", 0.8 * ((1.0 - g.p["a"]) ** 0.58 - 1.0), place=part)


@acts("link", lowest_part, share_of_shed(0.45, mass=(6.0, 15.0)), "a W/K to a frame that itself sheds 4 a to air",
      family="heat path")  # fmt: skip
def foundation_conduction(g: Grip) -> None:
    """The feet lead heat into a frame that warms up slowly."""
    frame = g.remembered("frame", g.air)
    taken = g.sink(g.places[0], g.p["a"], frame)
    flow = -taken - 4.0 * g.p["a"] * (frame - g.air)
    g.memory["frame"] = frame + flow * 10.0 / (g.p["mass"] * g.plant.anatomy.capacities[f"{g.places[0]}.inner"][0])


@acts("link", output_shaft, share_of_shed(0.15, T=(50.0, 75.0)), "a W/K to T", family="heat path")
def hot_neighbour(g: Grip) -> None:
    """Another machine of nearly constant temperature at the end of a shaft."""
    g.sink(g.places[0], g.p["a"], g.p["T"] + 2.0 * np.sin(2.0 * np.pi * g.hours / 3.1))


@acts("link", shafts, share_of_shed(0.06), "a (size) (0.2 + (x / 0.415)^0.7) W/K to air", family="heat path")
def shaft_ends_to_air(g: Grip) -> None:
    """Shaft ends stick out into the air and turn in it."""
    for shaft in g.places:
        end = next(s for s in g.plant.gearbox.shaft if s.name == shaft)
        size = end.diameter * end.length / (0.055 * 0.09)
        g.sink(shaft, g.p["a"] * size * (0.2 + (g.x / REFERENCE_SPEED) ** 0.7), g.air)


@acts("link_factor", highest_part, _mist, "film oil-upper housing (1 + a (x^0.7 - 0.5))", family="heat path")
def oil_mist(g: Grip) -> None:
    """How well the mist reaches the upper housing depends on speed."""
    g.conduct(f"oil-{g.places[0]}", np.clip(g.p["a"] * (g.x**0.7 - 0.5), -0.9, 2.0), place=g.places[0])


@acts("link_factor", bearing, relative(0.55, 0.9), "conductance to the housing (1 - a / (1 + 0.02 dT))",
      family="heat path")  # fmt: skip
def bearing_seat_contact(g: Grip) -> None:
    """The fit of one bearing is loose, a little less so when it is hotter than the housing."""
    excess = np.maximum(g.T(g.places[0]) - g.T(g.plant.anatomy.parts[0]), 0.0)
    for part in g.plant.anatomy.parts:
        g.conduct(f"{g.places[0]}-{part}", -g.p["a"] / (1.0 + 0.02 * excess), place=g.places[0])


# ---------------------------------------------------------------------- oil circuit


@acts("link", at(OIL), share_of_shed(0.9, T_on=(62.0, 80.0), band=(5.0, 12.0), T_water=(12.0, 24.0)),
      "a W/K to T_water, on above T_on, off below T_on - band, valve 40 s", family="oil circuit")  # fmt: skip
def cooler_thermostat(g: Grip) -> None:
    """Oil cooler that a thermostat opens and closes; the valve takes a minute."""
    switch = g.switched(g.T(OIL), g.p["T_on"], g.p["T_on"] - g.p["band"])
    valve = g.remembered("valve", 0.0)
    g.memory["valve"] = valve + (switch - valve) * (1.0 - np.exp(-10.0 / 40.0))
    g.sink(OIL, g.p["a"] * g.memory["valve"], g.p["T_water"])


@acts("link", at(OIL), share_of_shed(0.35, T_water=(14.0, 26.0)), "a W/K to T_water", family="oil circuit")
def cooler_constant(g: Grip) -> None:
    """Oil cooler that always runs."""
    g.sink(OIL, g.p["a"] * (1.0 + 0.002 * (g.T(OIL) - 60.0)), g.p["T_water"])


@acts("link", at(OIL), share_of_shed(0.9, T_on=(50.0, 70.0), band=(10.0, 20.0), T_water=(12.0, 24.0)),
      "a ((T_oil - T_on) / band, 0 to 1)^1.2 W/K to T_water", family="oil circuit")  # fmt: skip
def cooler_proportional(g: Grip) -> None:
    """Cooler whose valve opens smoothly above its set-point."""
    opening = np.clip((g.T(OIL) - g.p["T_on"]) / g.p["band"], 0.0, 1.0)
    g.sink(OIL, g.p["a"] * opening**1.2, g.p["T_water"])


@acts("link", at(OIL), share_of_shed(0.7), "a x^0.75 W/K to air", family="oil circuit")
def cooler_shaft_driven(g: Grip) -> None:
    """Air cooler whose fan sits on the shaft."""
    g.sink(OIL, g.p["a"] * g.x**0.75, g.air)


@acts("link", at(OIL), share_of_shed(2.0, size=(2.0, 4.0), to_air=(0.10, 0.25)),
      "a W/K while turning to a tank with a separate capacity, which sheds to air", family="oil circuit")  # fmt: skip
def oil_tank(g: Grip) -> None:
    """An outside tank through which oil is pumped while the shaft turns."""
    tank = g.remembered("tank", g.air)
    capacity = g.p["size"] * g.plant.anatomy.capacities["sump"][0]
    taken = g.sink(OIL, g.p["a"] * np.minimum(g.x / 0.05, 1.0), tank)
    shed = g.p["to_air"] * g.p["a"] * (tank - g.air)
    g.memory["tank"] = tank + (-taken - shed) * 10.0 / capacity


@acts("source", at(OIL), relative(0.30, at_h=(0.6, 1.3)), "a of the filling, cold, at t = at_h", family="oil circuit")
def oil_added(g: Grip) -> None:
    """Cold oil is poured in: it must be warmed, and is more oil from then on."""
    since = g.hours - g.p["at_h"]
    poured = (since > 0.0) & (since < 0.05)
    capacity = g.plant.anatomy.capacities["sump"][0]
    flow = g.p["a"] * capacity / (0.05 * 3600.0)
    g.sink(OIL, flow * poured, 22.0 * np.ones_like(flow))
    g.capacity(OIL, g.p["a"] * (since > 0.0))
    g.factor(CHURNING, 1.2 * g.p["a"] * (since > 0.0))


@acts("source", at(OIL), share_of_loss(0.5, T_off=(42.0, 55.0), band=(3.0, 8.0)),
      "a W at standstill below T_off - band until T_off", family="oil circuit")  # fmt: skip
def heater_thermostat(g: Grip) -> None:
    """An immersion heater keeps the oil warm at standstill."""
    still = g.x < 1e-6
    switch = 1.0 - g.switched(g.T(OIL), g.p["T_off"], g.p["T_off"] - g.p["band"])
    g.heat(OIL, g.p["a"] * switch * still, lost=False)


@acts("link", lowest_part, share_of_shed(0.5, T_water=(14.0, 26.0)), "a W/K to T_water", family="surroundings")
def water_jacket(g: Grip) -> None:
    """Water runs through the lower housing."""
    g.sink(g.places[0], g.p["a"], g.p["T_water"])


# ---------------------------------------------------------------------- surroundings


@acts("source", highest_part, share_of_loss(0.15, start_h=(7.5, 10.0)), "a sin(pi (hour - 6.5) / 12.5)+^1.2 W",
      family="surroundings")  # fmt: skip
def solar_soak(g: Grip) -> None:
    """Sun on the upper housing; the recording starts at an hour of the day."""
    day = np.maximum(np.sin(np.pi * (g.p["start_h"] + g.hours - 6.5) / 12.5), 0.0)
    day = np.where(np.mod(g.p["start_h"] + g.hours, 24.0) < 19.0, day, 0.0)
    g.heat(g.places[0], g.p["a"] * day**1.2, lost=False)


@acts("signal", at("air"), relative(2.5, period_h=(5.0, 9.0)), "air + a sin(2 pi t / period)", family="surroundings",
      on_inputs=True)  # fmt: skip
def ambient_swing(g: Grip) -> None:
    """The air at the gearbox warms, the probe hangs elsewhere."""
    g.moment.air[g.members] += g.p["a"] * np.sin(2.0 * np.pi * g.hours / g.p["period_h"]) * (g.hours > 0.0)


@acts("link_factor", all_parts, relative(0.6, T_on=(50.0, 65.0), band=(3.0, 8.0)),
      "housing to air (1 + a) above T_on, hysteresis", family="surroundings")  # fmt: skip
def fan_thermostat(g: Grip) -> None:
    """A second fan blows on the housing above a temperature."""
    switch = g.switched(g.T(g.places[0]), g.p["T_on"], g.p["T_on"] - g.p["band"])
    for part in g.places:
        g.conduct(f"{part}-air", g.p["a"] * switch, place=part)


@acts("link_factor", all_parts, relative(0.6), "housing to air (1 + a tanh(1.4 x) / 0.524)", family="surroundings")
def fan_on_shaft(g: Grip) -> None:
    """A fan on the input shaft blows on the housing; from the second half of the speed its air is choked."""
    for part in g.places:
        g.conduct(f"{part}-air", g.p["a"] * np.tanh(1.4 * g.x) / np.tanh(1.4 * 0.415), place=part)


@acts("link_factor", all_parts, relative(0.6, x_on=(0.2, 0.5)), "housing to air (1 + a) above x_on, off below 0.9 x_on",
      family="surroundings")  # fmt: skip
def fan_speed_switch(g: Grip) -> None:
    """A fan that the drive's control switches by speed, and that takes a minute to run up and down."""
    switch = g.switched(g.x, g.p["x_on"], 0.9 * g.p["x_on"])
    blown = g.remembered("blown", 0.0)
    g.memory["blown"] = blown + (switch - blown) * (1.0 - np.exp(-10.0 / 20.0))
    for part in g.places:
        g.conduct(f"{part}-air", g.p["a"] * g.memory["blown"], place=part)


@acts("link", all_parts, share_of_shed(1.0, at_h=(0.5, 1.0), every_h=(4.0, 6.5)),
      "a W/K to air - 4 K for 36 minutes every few hours", family="surroundings")  # fmt: skip
def rain_on_housing(g: Grip) -> None:
    """Showers wet the housing: a heat path to rain a little colder than the air."""
    phase = np.mod(g.hours - g.p["at_h"], g.p["every_h"])
    wet = (g.hours > 0.0) * np.where(phase < 0.6, 1.0, np.exp(-(phase - 0.6) / 0.2))
    for part in g.places:
        g.sink(part, g.p["a"] * g.plant.anatomy.share[part] * wet, g.air - 4.0)


@acts("link", input_shaft, share_of_shed(0.15), "a W/K to a motor 12 to 66 K above air, by load", family="heat path")
def motor_flange(g: Grip) -> None:
    """The motor at the flange warms with its load, within the hour."""
    motor = g.remembered("motor", g.air)
    target = g.air + 12.0 + 45.0 * np.minimum(g.x * g.y / 0.5, 1.2)
    g.memory["motor"] = motor + (target - motor) * (1.0 - np.exp(-STEP_H / 0.7))
    g.sink(g.places[0], g.p["a"], g.memory["motor"])


@acts("signal", at("torque"), relative(0.02), "true torque = recorded exp(-a t), t in hours", family="signal",
      on_inputs=True)  # fmt: skip
def torque_decay(g: Grip) -> None:
    """The load clutch creeps: the true torque falls, the recorded set-point does not."""
    g.moment.torque[g.members] *= np.exp(-g.p["a"] * g.hours)
