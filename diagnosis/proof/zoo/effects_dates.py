"""Changes at a date of anything that a plant is made of: losses, other heats, links, capacities, inputs."""

from __future__ import annotations

from functools import partial

import numpy as np

from diagnosis.proof.cases.time_course import FORMS, TimeCourse
from diagnosis.proof.zoo import effects
from diagnosis.proof.zoo.effects import Maker, ZooEffect, draft
from diagnosis.proof.zoo.setting import EffectSetting, UnfitError, either, pick
from diagnosis.proof.zoo.structure import constant

DATED_MAKERS: dict[str, Maker] = {}
makes = partial(effects.makes, family="change at a date", table=DATED_MAKERS)
DOWN, UP = 0.9, 2.0  # greatest relative changes


@makes("loss_factor")
def loss_changes(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """One loss grows or falls."""
    if not s.losses_all:
        raise UnfitError("losses")
    return _relative(s, rng, "loss", s.losses_all)


@makes("source")
def heat_changes(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A heat that is no loss grows or falls."""
    names = [n for one in s.plant.sources if not one.is_loss for n in one.part_of.split("+") if n]
    if not names:
        raise UnfitError("heats")
    return _relative(s, rng, "heat", tuple(dict.fromkeys(names)))


@makes("link_factor")
def link_changes(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """One link conducts more or less."""
    return _relative(s, rng, "link", s.links)


@makes("capacity")
def capacity_changes(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """One node stores more or less."""
    return _relative(s, rng, "capacity", s.nodes)


@makes("source")
def heat_appears(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A constant heat into one node."""
    node = pick(s.nodes, rng)
    return draft(s.heat(node, constant(1.0)), f"a into {node}", 0.3 * s.loss)


@makes("link")
def link_appears(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A further way from one node to the air."""
    node = pick(s.nodes, rng)
    act = s.bridge(node, s.air(), constant(1.0), called="air")
    return draft(act, f"a between {node} and air", 0.4 * s.shed)


@makes("signal")
def set_point_changes(s: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    """A control that misses: the true input is larger or smaller than the recorded one."""
    names = [name for name in ("torque", "speed", "heater_power") if name in s.plant.inputs]
    if not names:
        raise UnfitError("inputs")
    name, sign = pick(names, rng), either(rng)
    act = s.input_shift(name, lambda m: sign * m.inputs[name], sign=sign)
    return draft(act, f"true {name} = recorded (1 {_plus(sign)} a)", 0.2)


def _relative(s: EffectSetting, rng: np.random.Generator, what: str, names: tuple[str, ...]) -> ZooEffect:
    name, sign = pick(names, rng), either(rng)
    law = constant(float(sign))
    if what == "link":
        act = s.link_factor((name,), law, sign=sign)
    elif what == "capacity":
        act = s.capacity(name, law, sign=sign)
    else:
        act = s.loss_factor((name,), law, sign=sign, is_loss=what == "loss")
    return draft(act, f"{what} {name} (1 {_plus(sign)} a)", UP if sign > 0 else DOWN, "1")


def _plus(sign: int) -> str:
    return "+" if sign > 0 else "-"


def draw_course(s: EffectSetting, rng: np.random.Generator) -> TimeCourse:
    """A step, ramp or passing change that begins in the training recordings and lasts through later ones."""
    from_h = s.date(rng, 0.1, 0.75)
    kind = FORMS[int(rng.choice(3, p=(0.5, 0.3, 0.2)))]
    if kind == "step":
        return TimeCourse(kind="step", begins=from_h)
    lasts = float(rng.uniform(0.1, 0.6)) * s.hours
    return TimeCourse(kind=kind, begins=from_h, ends=from_h + lasts)
