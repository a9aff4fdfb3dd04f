"""Effects that no catalogue has; ``x``, ``y``: speed and torque over their highest."""

from __future__ import annotations

from functools import partial

import numpy as np

from diagnosis.proof.zoo import effects
from diagnosis.proof.zoo.effects import Maker, ZooEffect, draft
from diagnosis.proof.zoo.setting import EffectSetting, pick, soft
from diagnosis.proof.zoo.structure import Law, constant

OUTSIDE_MAKERS: dict[str, Maker] = {}
makes = partial(effects.makes, family="outside the catalogue", table=OUTSIDE_MAKERS)


@makes("source")
def bearing_torque_square(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A bearing that bends loses power with the square of torque."""
    x, y, node = s.speed(), s.load(), pick(s.group("bearings"), rng)
    act = s.heat(node, lambda m: y(m) ** 2 * x(m), is_loss=True)
    return draft(act, "a y^2 x into the bearing", 0.4 * s.loss)


@makes("source")
def resonance(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A narrow band of speed shakes one node."""
    x, x0, node = s.speed(), float(rng.uniform(0.2, 0.8)), pick(s.group("bearings"), rng)
    act = s.heat(node, lambda m: 1.0 / (1.0 + ((x(m) - x0) / (0.06 * x0)) ** 2), is_loss=True)
    return draft(act, "a / (1 + ((x - x0) / (0.06 x0))^2)", 0.5 * s.loss, x0=x0)


@makes("source")
def stick_slip(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A support creaks below a speed and slides above it."""
    x, x0, node = s.speed(), float(rng.uniform(0.1, 0.3)), pick(s.group("bearings"), rng)
    act = s.heat(node, lambda m: soft((x0 - x(m)) / 0.01) * np.tanh(x(m) / 0.01), is_loss=True)
    return draft(act, "a while 0 < x < x0", 0.5 * s.loss, x0=x0)


@makes("source")
def eddy_brake(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A stray field brakes a turning part: rises, then saturates."""
    x, x0 = s.speed(), float(rng.uniform(0.2, 0.5))
    node = s.group("gears" if s.groups.get("gears") else "bearings")[-1]
    act = s.heat(node, lambda m: x(m) ** 2 / (x(m) ** 2 + x0**2), is_loss=True)
    return draft(act, "a x^2 / (x^2 + x0^2)", 0.4 * s.loss, x0=x0)


@makes("source")
def stiff_grease(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Grease that stiffens at rest is sheared soft in every recording."""
    x, tau, node = s.speed(), float(rng.uniform(0.4, 2.0)), pick(s.group("bearings"), rng)
    act = s.heat(node, lambda m: np.sqrt(x(m)) * np.exp(-m.since_start / tau), is_loss=True)
    return draft(act, "a x^0.5 exp(-t / tau), t since the recording began", 0.6 * s.loss, tau_h=tau)


@makes("source")
def sludge(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Sludge brakes below a temperature of the oil."""
    x, T, T0 = s.speed(), s.temperature("oil"), s.quantile("oil", float(rng.uniform(0.2, 0.6)))
    act = s.heat("oil", lambda m: np.sqrt(x(m)) * soft((T0 - T(m)) / 0.5), is_loss=True)
    return draft(act, "a x^0.5 below T0 into the oil", 0.4 * s.loss, T0=T0)


@makes("source")
def water_evaporation(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Water boils out of the oil, steeply with its temperature."""
    T = s.temperature("oil")
    T0 = s.quantile("oil", 0.95)
    act = s.heat("oil", lambda m: -np.exp(np.minimum((T(m) - T0) / 14.0, 1.5)), sign=-1)
    return draft(act, "-a exp((T_oil - T0) / 14 K)", 0.4 * s.loss, T0=T0)


@makes("link_factor")
def growing_insulation(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A layer that grows with the hours covers one way to the air."""
    tau, names = float(rng.uniform(0.05, 0.3)) * s.span, _way_to_air(s, rng)
    act = s.link_factor(names, lambda m: -(m.hours / tau) / (1.0 + m.hours / tau), sign=-1)
    return draft(act, "conductance to air (1 - a (t / tau) / (1 + t / tau))", 0.9, tau_h=tau)


@makes("link_factor")
def opening_gap(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A gap opens in one link inside as it warms."""
    inside = [n for n in s.links if all(node in s.nodes for node in n.split("-"))]
    name = pick(inside, rng)
    node = name.split("-")[0]
    T, T0 = s.temperature(node), s.quantile(node, float(rng.uniform(0.3, 0.7)))
    act = s.link_factor((name,), lambda m: -soft((T(m) - T0) / 2.0), sign=-1)
    return draft(act, f"conductance of {name} (1 - a s((T - T0) / 2 K))", 0.95, T0=T0)


@makes("link")
def timed_neighbour(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A machine next to it runs by a timer."""
    node, (on, timer) = _outer(s, rng), _timer(rng)
    rise = 1.5 * s.rise
    warm: Law = lambda m: m.inputs["T_ambient"] + rise * on(m)  # noqa: E731
    act = s.bridge(node, "timed neighbour", constant(1.0), parts=s.boundary("timed neighbour", warm))
    return draft(act, "a to a neighbour that runs by a timer", 0.4 * s.shed, rise_K=rise, **timer)


@makes("source")
def timed_heat(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """An auxiliary gives its heat to one part for a share of every period."""
    node, (on, timer) = _outer(s, rng), _timer(rng)
    act = s.heat(node, on)
    return draft(act, "a for 40 % of every period", 0.4 * s.loss, **timer)


@makes("link_factor")
def door_draught(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A door opens by the clock: one way to the air conducts more."""
    names, (on, timer) = _way_to_air(s, rng), _timer(rng)
    act = s.link_factor(names, on)
    return draft(act, "conductance to air (1 + a) for 40 % of every period", 2.0, **timer)


@makes("capacity")
def melting_wax(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A filling melts: capacity around its melting point."""
    node = _outer(s, rng)
    T, T0, width = s.temperature(node), s.quantile(node, float(rng.uniform(0.3, 0.7))), float(rng.uniform(1.0, 2.5))
    act = s.capacity(node, lambda m: np.exp(-0.5 * ((T(m) - T0) / width) ** 2))
    return draft(act, "capacity (1 + a exp(-((T - T0) / width)^2 / 2))", 15.0, T0=T0, width_K=width)


@makes("link")
def heat_pipe(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A wet crack leads heat between two nodes that touch nowhere, once one is warm."""
    pairs = [
        (a, b)
        for i, a in enumerate(s.nodes)
        for b in s.nodes[i + 1 :]
        if f"{a}-{b}" not in s.links and f"{b}-{a}" not in s.links
    ]
    here, there = pairs[int(rng.integers(len(pairs)))]
    T, T0 = s.temperature(here), s.quantile(here, float(rng.uniform(0.2, 0.6)))
    body = max(s.bodies(there).items(), key=lambda item: item[1])[0]
    act = s.bridge(here, body, lambda m: soft((T(m) - T0) / 3.0), called=there)
    return draft(act, f"a s((T - T0) / 3 K) between {here} and {there}", 0.5 * s.shed, T0=T0)


@makes("link")
def wet_floor(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """The lowest part stands on a floor that swings between day and night."""
    node, phase, T0 = s.nodes[0], float(rng.uniform(0.0, 1.0)), s.air_mean - float(rng.uniform(2.0, 8.0))
    floor: Law = lambda m: T0 + 5.0 * np.sin(2.0 * np.pi * (m.hours / 24.0 + phase))  # noqa: E731
    act = s.bridge(node, "floor", constant(1.0), parts=s.boundary("floor", floor))
    return draft(act, "a to T0 + 5 sin(2 pi (t / 24 h + phase))", 0.4 * s.shed, T0=T0, phase=phase)


def _timer(rng: np.random.Generator) -> tuple[Law, dict[str, float]]:
    """1 for 40 % of every period, 0 else; and the period and phase drawn."""
    period_h, phase = float(rng.uniform(0.7, 3.0)), float(rng.uniform(0.0, 1.0))
    law: Law = lambda m: np.asarray(np.mod(m.hours / period_h + phase, 1.0) < 0.4, dtype=float)  # noqa: E731
    return law, {"period_h": period_h, "phase": phase}


def _outer(s: EffectSetting, rng: np.random.Generator) -> str:
    """A node that touches the air, a housing part if there is one."""
    return pick(s.group("housing"), rng) if s.groups.get("housing") else pick(s.nodes, rng)


def _way_to_air(s: EffectSetting, rng: np.random.Generator) -> tuple[str, ...]:
    return (pick(s.link_between(s.nodes, ("air",)), rng),)
