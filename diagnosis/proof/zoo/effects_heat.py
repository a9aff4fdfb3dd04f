"""Heat paths, oil circuit and surroundings of the catalogue in forms that are not the catalogue's."""

from __future__ import annotations

from functools import partial

import numpy as np

from diagnosis.proof.zoo import effects
from diagnosis.proof.zoo.effects import Maker, ZooEffect, draft
from diagnosis.proof.zoo.setting import Act, EffectSetting, pick, soft
from diagnosis.proof.zoo.structure import Law, Moment, constant
from models.base.types import Array
from models.quantities.units import KELVIN

HEAT_MAKERS: dict[str, Maker] = {}
makes = partial(effects.makes, in_catalogue=True, table=HEAT_MAKERS)
INSIDE, OUT, CIRCUIT, AROUND = "heat inside the gearbox", "heat to the surroundings", "oil circuit", "surroundings"
AIR = "air"
WATER, COOLANT = "water", "coolant"


@makes("link_factor", INSIDE)
def aeration(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Foam lowers what gears give to the oil, by a logistic function of speed."""
    x, x0 = s.speed(), float(rng.uniform(0.3, 0.6))
    act = s.link_factor(s.link_between(s.group("gears"), ("oil",)), lambda m: -soft((x(m) - x0) / 0.1), sign=-1)
    return draft(act, "conductance gear-oil (1 - a s((x - x0) / 0.1))", 0.9, x0=x0)


@makes("link_factor", INSIDE)
def oil_housing_speed(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """The film on the walls grows with the logarithm of speed."""
    x = s.speed()
    act = s.link_factor(s.link_between(s.group("housing"), ("oil",)), lambda m: np.log1p(8.0 * x(m)) / np.log(9.0))
    return draft(act, "conductance oil-housing (1 + a log(1 + 8 x) / log(9))", 3.0)


@makes("link_factor", INSIDE)
def oil_mist(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Mist wets the uppermost housing part, saturating with speed."""
    x = s.speed()
    names = s.link_between(s.group("housing")[-1:], ("oil",))
    act = s.link_factor(names, lambda m: -np.expm1(-3.0 * x(m)))
    return draft(act, "conductance oil-upper housing (1 + a (1 - exp(-3 x)))", 3.0)


@makes("link_factor", INSIDE)
def bearing_seat_contact(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A loose seat, tighter while the bearing is warmer than the wall."""
    bearing = pick(s.group("bearings"), rng)
    T, wall = s.temperature(bearing), s.temperature(s.group("housing")[0])
    names = s.link_between((bearing,), s.group("housing"))
    act = s.link_factor(names, lambda m: -np.exp(-np.maximum(T(m) - wall(m), 0.0) / 20.0), sign=-1)
    return draft(act, "conductance bearing-housing (1 - a exp(-dT+ / 20 K))", 0.9)


@makes("link_factor", OUT)
def radiation_error(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Walls radiate less: the part of their conductance that grows with the cube of the absolute temperature."""
    wall = s.temperature(s.group("housing")[0])
    names = s.link_between(s.group("housing"), (AIR,))
    act = s.link_factor(names, lambda m: -(((wall(m) + KELVIN) / 330.0) ** 3), sign=-1)
    return draft(act, "conductance housing-air (1 - a (T / 330 K)^3)", 0.35)


@makes("link_factor", OUT)
def air_cooling_change(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A fan cools one wall less than it did."""
    wall = pick(s.group("housing"), rng)
    names = s.link_between((wall,), (AIR,))
    act = s.link_factor(names, constant(-1.0), sign=-1)
    return draft(act, "conductance of one wall to air (1 - a)", 0.8)


@makes("link_factor", AROUND)
def fan_thermostat(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A fan cools one wall, faster the warmer its feeler is."""
    wall = pick(s.group("housing"), rng)
    T_on, tau = s.quantile(wall, float(rng.uniform(0.4, 0.8))), s.lag(rng, 300.0)
    act = s.link_factor(s.link_between((wall,), (AIR,)), lambda m: soft((m.T["fan feeler"] - T_on) / 1.0))
    act = act + Act(parts=s.follower("fan feeler", wall, tau))
    return draft(act, "conductance of one wall to air (1 + a s((T_feeler - T_on) / 1 K))", 4.0, T_on=T_on, tau_s=tau)


@makes("link", OUT)
def foundation_conduction(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """The lowest part stands on a plinth that stores heat."""
    part = s.group("housing")[0]
    mass = float(rng.uniform(3.0, 15.0)) * _capacity(s, part)
    act = s.bridge(part, "plinth", constant(1.0), called="frame", parts=s.reservoir("plinth", mass, 2.0 * s.shed))
    return draft(act, "a to a plinth that stores heat", 0.8 * s.shed, capacity_J_K=mass)


@makes("link", OUT)
def hot_neighbour(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A warm machine at one shaft or housing part, which itself follows the air."""
    node = s.group("shafts" if s.groups.get("shafts") else "housing")[-1]
    rise = float(rng.uniform(0.5, 1.3)) * s.rise
    around = s.boundary("neighbour", lambda m: m.inputs["T_ambient"] + rise)
    act = s.bridge(node, "neighbour", constant(1.0), parts=around)
    return draft(act, "a to a neighbour warmer than the air by dT", 0.4 * s.shed, dT=rise)


@makes("link", OUT)
def motor_flange(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A motor at the input whose warmth follows the root of its power."""
    node = s.group("shafts" if s.groups.get("shafts") else "housing")[0]
    x, y, rise = s.speed(), s.load(), float(rng.uniform(0.6, 1.2)) * s.rise
    warm: Law = lambda m: m.inputs["T_ambient"] + 0.3 * rise + rise * np.sqrt(x(m) * y(m))  # noqa: E731
    act = s.bridge(node, "motor", constant(1.0), parts=s.boundary("motor", warm))
    return draft(act, "a to a motor warmer than the air by dT (0.3 + (x y)^0.5)", 0.4 * s.shed, dT=rise)


@makes("link", OUT)
def shaft_ends_to_air(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Shaft ends in the air, with the root of speed."""
    x, air = s.speed(), s.air()
    law: Law = lambda m: 0.1 + np.sqrt(x(m))  # noqa: E731
    shafts = s.group("shafts")
    act = s.bridge(shafts[0], air, law, called=AIR)
    for shaft in shafts[1:]:
        act = act + s.bridge(shaft, air, law, called=AIR)
    return draft(act, "a (0.1 + x^0.5) from every shaft to air", 0.2 * s.shed)


@makes("link", CIRCUIT)
def water_jacket(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Water whose flow falls off as it warms the valve."""
    part, cold = s.group("housing")[0], _below_air(s, rng)
    T, T0 = s.temperature(part), s.quantile(part, 0.5)
    act = s.bridge(part, WATER, lambda m: 0.5 + soft((T(m) - T0) / 5.0), parts=s.boundary(WATER, constant(cold)))
    return draft(act, "a (0.5 + s((T - T0) / 5 K)) to water", 0.6 * s.shed, T_water=cold, T0=T0)


# ---------------------------------------------------------------------- oil circuit


@makes("link", CIRCUIT)
def cooler_thermostat(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A water cooler that a slow thermostat opens within a kelvin."""
    return _cooler(s, rng, width=0.4, power=1.0, water=True)


@makes("link", CIRCUIT)
def cooler_proportional(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A water cooler with a proportional valve behind a lag."""
    return _cooler(s, rng, width=5.0, power=0.7, water=True)


@makes("link", CIRCUIT)
def cooler_air_thermostat(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """An air cooler that a slow thermostat opens within a kelvin."""
    return _cooler(s, rng, width=0.4, power=1.0, water=False)


@makes("link", CIRCUIT)
def cooler_air_proportional(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """An air cooler with a proportional valve behind a lag."""
    return _cooler(s, rng, width=5.0, power=0.7, water=False)


def _cooler(s: EffectSetting, rng: np.random.Generator, *, width: float, power: float, water: bool) -> ZooEffect:
    T_on, tau = s.quantile("oil", float(rng.uniform(0.4, 0.8))), s.lag(rng, 400.0)
    parts = s.follower("valve feeler", "oil", tau)
    cold = _below_air(s, rng)

    def opening(m: Moment) -> Array:
        return np.asarray(soft((m.T["valve feeler"] - T_on) / width) ** power)

    if water:
        act = s.bridge("oil", COOLANT, opening, parts=s.boundary(COOLANT, constant(cold))) + Act(parts=parts)
    else:
        act = s.bridge("oil", s.air(), opening, called=AIR, parts=parts)
    return draft(
        act,
        f"a s((T_feeler - T_on) / {width:g} K)^{power:g} to the coolant",
        1.5 * s.shed,
        T_on=T_on,
        tau_s=tau,
        T_water=cold,
    )


@makes("link", CIRCUIT)
def cooler_constant(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A water cooler that always runs, a little better with thin oil."""
    T, T0, cold = s.temperature("oil"), s.quantile("oil", 0.5), _below_air(s, rng)
    law: Law = lambda m: np.exp((T(m) - T0) / 80.0)  # noqa: E731
    act = s.bridge("oil", COOLANT, law, parts=s.boundary(COOLANT, constant(cold)))
    return draft(act, "a exp((T_oil - T0) / 80 K) to water", 0.6 * s.shed, T0=T0, T_water=cold)


@makes("link", CIRCUIT)
def cooler_shaft_driven(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """An air cooler whose fan sits on the shaft and stalls."""
    x, x0 = s.speed(), float(rng.uniform(0.2, 0.6))
    act = s.bridge("oil", s.air(), lambda m: x(m) / (x(m) + x0), called=AIR)
    return draft(act, "a x / (x + x0) to air", 1.0 * s.shed, x0=x0)


@makes("link", CIRCUIT)
def oil_jet(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Oil of fixed temperature is injected as long as the shaft turns."""
    x, T = s.speed(), s.air_mean + float(rng.uniform(0.2, 0.6)) * s.rise
    act = s.bridge("oil", "jet", lambda m: np.tanh(x(m) / 0.05), parts=s.boundary("jet", constant(T)))
    return draft(act, "a tanh(x / 0.05) to oil of T_jet", 1.0 * s.shed, T_jet=T)


@makes("link", CIRCUIT)
def oil_tank(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A tank outside with a pump whose flow follows the root of speed."""
    x, size = s.speed(), float(rng.uniform(1.0, 4.0)) * _capacity(s, "oil")
    to_air = 0.3 * s.shed
    act = s.bridge("oil", "tank", lambda m: np.sqrt(x(m)), parts=s.reservoir("tank", size, to_air))
    return draft(act, "a x^0.5 to a tank that sheds heat to air", 2.0 * s.shed, capacity_J_K=size, to_air_W_K=to_air)


@makes("source", CIRCUIT)
def heater_thermostat(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A heater at rest whose power falls smoothly as the oil warms."""
    x, T = s.speed(), s.temperature("oil")
    T_off = s.quantile("oil", float(rng.uniform(0.3, 0.7)))
    act = s.heat("oil", lambda m: soft((T_off - T(m)) / 2.0) * np.exp(-((x(m) / 0.02) ** 2)))
    return draft(act, "a s((T_off - T_oil) / 2 K) at standstill into the oil", 1.0 * s.loss, T_off=T_off)


@makes("link_factor", CIRCUIT)
def pump_fast_stage(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """The circulation runs smoothly faster when the oil is warm."""
    T, T_on = s.temperature("oil"), s.quantile("oil", float(rng.uniform(0.4, 0.8)))
    names = s.link_between(("oil",), s.group("returns"))
    act = s.link_factor(names, lambda m: soft((T(m) - T_on) / 2.0))
    return draft(act, "conductance oil-return (1 + a s((T_oil - T_on) / 2 K))", 3.0, T_on=T_on)


# ---------------------------------------------------------------------- surroundings


@makes("source", AROUND)
def solar_soak(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Sun on the uppermost part: a bell over the hours of the day."""
    start, width = float(rng.uniform(0.0, 24.0)), float(rng.uniform(2.0, 3.5))

    def law(m: Moment) -> Array:
        hour = np.mod(start + m.hours, 24.0)
        return np.asarray(np.exp(-0.5 * ((hour - 13.0) / width) ** 2))

    act = s.heat(s.group("housing")[-1], law)
    return draft(
        act, "a exp(-((hour - 13) / width)^2 / 2) into the upper part", 0.5 * s.loss, start_hour=start, width_h=width
    )


@makes("link", AROUND)
def rain_on_housing(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Showers of an hour that rise and fall smoothly, on one part."""
    every, first = float(rng.uniform(3.0, 7.0)), float(rng.uniform(0.5, 2.5))
    act = s.bridge(
        s.group("housing")[-1], "rain",
        lambda m: np.exp(-(((np.mod(m.hours - first + 0.5 * every, every) - 0.5 * every) / 0.4) ** 2)),
        parts=s.boundary("rain", lambda m: m.inputs["T_ambient"] - 5.0),
    )  # fmt: skip
    return draft(
        act, "a exp(-(t' / 0.4 h)^2) to air - 5 K around every shower", 2.0 * s.shed, every_h=every, first_h=first
    )


@makes("signal", AROUND)
def ambient_swing(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """The air at the machine swings like a triangle, the probe's does not."""
    period = float(rng.uniform(3.0, 10.0))
    act = s.input_shift("T_ambient", lambda m: 2.0 * np.abs(2.0 * np.mod(m.hours / period, 1.0) - 1.0) - 1.0, sign=0)
    return draft(act, "air at the machine + a triangle(t / period)", 6.0, "K", period_h=period)


@makes("signal", AROUND)
def ambient_drift(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """The air at the machine warms to a new temperature, the probe's does not."""
    tau = float(rng.uniform(0.02, 0.2)) * s.span
    act = s.input_shift("T_ambient", lambda m: -np.expm1(-m.hours / tau))
    return draft(act, "air at the machine + a (1 - exp(-t / tau))", 6.0, "K", tau_h=tau)


def _below_air(s: EffectSetting, rng: np.random.Generator) -> float:
    """Temperature of cooling water, [degC]."""
    return s.air_mean - float(rng.uniform(3.0, 12.0))


def _capacity(s: EffectSetting, node: str) -> float:
    return sum(s.capacities(node).values())
