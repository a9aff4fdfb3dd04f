"""Losses of the catalogue in forms that are not the catalogue's; ``x``, ``y``: speed and torque over their highest."""

from __future__ import annotations

from functools import partial

import numpy as np

from diagnosis.proof.zoo import effects
from diagnosis.proof.zoo.effects import Maker, ZooEffect, draft
from diagnosis.proof.zoo.setting import EffectSetting, UnfitError, pick, soft
from diagnosis.proof.zoo.structure import Law, constant

LOSS_MAKERS: dict[str, Maker] = {}
makes = partial(effects.makes, in_catalogue=True, table=LOSS_MAKERS)
NO_LOAD, LOAD, CIRCUIT, AGEING = "no-load loss", "load-dependent loss", "oil circuit", "ageing and running-in"
SLIDING, CHURNING = ("mesh_sliding", "gears_load"), ("churning", "gears_no_load")


@makes("source", NO_LOAD)
def windage(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Between the square and the cube of speed, half of it into the oil."""
    x, p = s.speed(), float(rng.uniform(1.8, 2.3))
    law: Law = lambda m: 0.5 * x(m) ** p * (1.0 + x(m))  # noqa: E731
    act = s.heat("oil", law, is_loss=True)
    return draft(act, "a x^p (1 + x) / 2 into the oil", 0.3 * s.loss, p=p)


@makes("source", NO_LOAD)
def pocketing(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Exponential in speed."""
    x, k = s.speed(), float(rng.uniform(2.0, 3.5))
    act = s.heat("oil", lambda m: np.expm1(k * x(m)) / np.expm1(k), is_loss=True)
    return draft(act, "a (exp(k x) - 1) / (exp(k) - 1) into the oil", 0.4 * s.loss, k=k)


@makes("source", NO_LOAD)
def churning_swirl(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Above a soft threshold with the power 1.4 of speed."""
    x, x0 = s.speed(), float(rng.uniform(0.35, 0.7))
    act = s.heat("oil", lambda m: x(m) ** 1.4 * soft((x(m) - x0) / 0.05), is_loss=True)
    return draft(act, "a x^1.4 s((x - x0) / 0.05) into the oil", 0.8 * s.loss, x0=x0)


@makes("source", LOAD)
def churning_load(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Grows with the root of torque."""
    x, y, p = s.speed(), s.load(), float(rng.uniform(0.8, 1.2))
    act = s.heat("oil", lambda m: np.sqrt(y(m)) * x(m) ** p, is_loss=True)
    return draft(act, "a y^0.5 x^p into the oil", 0.5 * s.loss, p=p)


@makes("loss_factor", NO_LOAD)
def oil_level_thermal(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Saturating function of the oil's temperature."""
    T, T0 = s.temperature("oil"), s.quantile("oil", 0.1)
    width = max(0.5 * (s.quantile("oil", 0.95) - T0), 3.0) * float(rng.uniform(0.8, 1.4))
    act = s.loss_factor(s.losses(*CHURNING), lambda m: np.maximum(np.tanh((T(m) - T0) / width), 0.0))
    return draft(act, "churning (1 + a tanh((T_oil - T0) / width)+)", 0.9, T0=T0, width=width)


@makes("loss_factor", LOAD)
def splash_starvation(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A soft step of sliding friction at a speed."""
    x, x0 = s.speed(), float(rng.uniform(0.4, 0.7))
    act = s.loss_factor(s.losses(*SLIDING), lambda m: soft((x(m) - x0) / 0.08))
    return draft(act, "mesh sliding (1 + a s((x - x0) / 0.08))", 2.0, x0=x0)


@makes("loss_factor", LOAD)
def misalignment(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Teeth wind straight under load: less at high torque; a bearing of the input shaft feels half of it."""
    y = s.load()
    act = s.loss_factor(s.losses(*SLIDING), lambda m: 1.0 / (0.5 + y(m)))
    act = act + s.loss_factor(s.losses(s.group("bearings")[0]), constant(0.5))
    return draft(act, "mesh sliding (1 + a / (0.5 + y)), first bearing (1 + a / 2)", 0.5)


@makes("loss_factor", LOAD)
def bearing_preload(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A bearing warmer than its housing closes its clearance softly."""
    bearing = pick(s.group("bearings"), rng)
    T, wall = s.temperature(bearing), s.temperature(s.group("housing")[0])
    dT = float(rng.uniform(1.0, 4.0))
    act = s.loss_factor(s.losses(bearing), lambda m: 0.2 * np.logaddexp(0.0, (T(m) - wall(m) - dT) / 0.8))
    return draft(act, "bearing loss (1 + a log(1 + exp((T - T_housing - dT) / 0.8 K)) / 5)", 4.0, dT=dT)


@makes("loss_factor", LOAD)
def bearing_additive(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Less friction of all bearings at low speed."""
    x, x0 = s.speed(), float(rng.uniform(0.2, 0.5))
    act = s.loss_factor(s.losses(*s.group("bearings")), lambda m: -1.0 / (1.0 + (x(m) / x0) ** 2), sign=-1)
    return draft(act, "bearing losses (1 - a / (1 + (x / x0)^2))", 0.8, x0=x0)


@makes("source", NO_LOAD)
def brake_drag(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Heat in the output shaft that falls off from proportional to speed."""
    x = s.speed()
    act = s.heat(s.group("shafts")[-1], lambda m: x(m) * (1.4 - 0.4 * x(m)), is_loss=True)
    return draft(act, "a x (1.4 - 0.4 x) into the output shaft", 0.5 * s.loss)


@makes("source", CIRCUIT)
def pump_heat(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A pump whose relief valve opens: constant above a speed."""
    x, x0 = s.speed(), float(rng.uniform(0.2, 0.5))
    act = s.heat("oil", lambda m: np.tanh(x(m) / x0), is_loss=True)
    return draft(act, "a tanh(x / x0) into the oil", 0.3 * s.loss, x0=x0)


@makes("loss_factor", AGEING)
def run_in_flanks(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Falls hyperbolically with the hours."""
    life = float(rng.uniform(0.03, 0.2)) * s.span
    act = s.loss_factor(s.losses(*SLIDING), lambda m: 1.0 / (1.0 + m.hours / life))
    return draft(act, "mesh sliding (1 + a / (1 + t / life))", 1.0, life_h=life)


@makes("loss_factor", AGEING)
def run_in_seals(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """Falls with the square root of the hours."""
    names = tuple(n for n in s.losses_all if "seal" in n)
    if not names:
        raise UnfitError("seals")
    life = float(rng.uniform(0.03, 0.2)) * s.span
    act = s.loss_factor(names, lambda m: np.exp(-np.sqrt(m.hours / life)))
    return draft(act, "seals (1 + a exp(-(t / life)^0.5))", 1.5, life_h=life)


@makes("loss_factor", AGEING)
def oil_ageing(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Churning and bearings grow with the root of the hours."""
    law: Law = lambda m: np.sqrt(m.hours / s.span)  # noqa: E731
    act = s.loss_factor((*s.losses(*CHURNING), *s.losses(*s.group("bearings"))), law)
    return draft(act, "churning and bearing losses (1 + a (t / span)^0.5)", 0.6)


@makes("loss_factor", AGEING)
def oil_loss(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """The level sinks to a lower one: less churning, less to warm, drier gears."""
    tau = float(rng.uniform(0.1, 0.4)) * s.span
    law: Law = lambda m: np.expm1(-m.hours / tau)  # noqa: E731
    act = s.loss_factor(s.losses(*CHURNING), law, sign=-1) + s.capacity("oil", law, sign=-1)
    act = act + s.link_factor(s.link_between(s.group("gears"), ("oil",)), law, sign=-1)
    return draft(act, "churning, oil's capacity and gear-oil (1 - a (1 - exp(-t / tau)))", 0.7, tau_h=tau)


@makes("loss_factor", AGEING)
def gear_wear(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """Grows with the square of the hours."""
    act = s.loss_factor(s.losses(*SLIDING), lambda m: (m.hours / s.span) ** 2)
    return draft(act, "mesh sliding (1 + a (t / span)^2)", 0.8)


@makes("source", AGEING)
def bearing_damage(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """One bearing grinds from a moment on, in proportion to speed."""
    bearing, x = pick(s.group("bearings"), rng), s.speed()
    at_h = s.date(rng, 0.05, 0.7)
    act = s.heat(bearing, lambda m: x(m) * soft((m.hours - at_h) / 0.05), is_loss=True)
    return draft(act, "a x s((t - at) / 0.05 h) into the bearing", 0.4 * s.loss, at_h=at_h)


@makes("signal", AGEING)
def torque_decay(s: EffectSetting, _: np.random.Generator) -> ZooEffect:
    """The torque that is set is reached less and less, with the root of the hours."""
    s.load()
    act = s.input_shift("torque", lambda m: -m.inputs["torque"] * np.sqrt(m.hours / s.span), sign=-1)
    return draft(act, "true torque = recorded (1 - a (t / span)^0.5)", 0.3)
