"""Mechanisms of ageing and wear."""

from __future__ import annotations

import sympy as sp

from models.formulas.extremes import Max
from models.mechanisms.forms import EDGE_S, RUNNING, moment, plain, positive, steps, strength
from models.mechanisms.mechanism import Mechanism, Memory
from models.mechanisms.scale import Scale
from models.network.laws import Parameter

FAMILY = "ageing and running-in"
REPEAT = "repeat the first test after the last one: only what changes with time differs"


def _life(scale: Scale) -> Parameter:
    """Time, at the reference speed and torque where these count, that takes an effect to 1/e."""
    d = scale.duration
    return positive("life", 0.3 * d, sd=0.8, unit="s", grid=(0.04 * d, 0.12 * d, 0.4 * d, 1.2 * d))


def _wear_rate(n: sp.Expr, exponent: sp.Expr) -> sp.Expr:
    """Rate of wear while the shafts turn: by hours (exponent 0), by revolutions (1) or between."""
    return sp.tanh(RUNNING * n) * n**exponent


run_in_flanks = Mechanism(
    name="run_in_flanks",
    family=FAMILY,
    kind="loss_factor",
    places=("mesh_sliding",),
    parameters=lambda scale: (
        strength(0.2, description="relative change of the sliding loss, flanks new and speed low"),
        _life(scale),
        plain("film", 3.0, sd=3.0, lower=0.0, upper=20.0, grid=(0.0, 6.0)),
    ),
    states=(Memory(name="worn", rate=lambda s: s.n / s.life),),
    law=lambda s: s.strength * sp.exp(-s.worn) / (1.0 + s.film * s.n),
    says="New flanks are still rough: sliding friction starts higher, most of all where the film is thin, and falls "
    "with the revolutions run.",
    reference="Sjoeberg 2010, Sosa 2017: roughness falls with the first revolutions; the exponential form is ours, and "
    "so is how the film, which grows with speed, hides roughness",
    experiment=REPEAT,
    separate_by={"run_in_seals": "repeat without load: run-in of the flanks shows under torque only"},
)

run_in_seals = Mechanism(
    name="run_in_seals",
    family=FAMILY,
    kind="loss_factor",
    places=("factor seal",),
    parameters=lambda scale: (
        strength(0.3, description="relative change of the seal losses, lips new"),
        _life(scale),
        plain("exponent", 0.5, sd=0.4, lower=0.0, upper=1.5, grid=(0.0, 1.0)),
    ),
    states=(Memory(name="worn", rate=lambda s: _wear_rate(s.n, s.exponent) / s.life),),
    law=lambda s: s.strength * sp.exp(-s.worn),
    says="New seal lips press harder: their friction starts higher and falls while the shafts turn.",
    reference="Freudenberg: 1.5 times the settled torque during the first hours; the exponential form is ours, and so "
    "is that it goes with a power of speed between hours run (0) and revolutions (1)",
    experiment=REPEAT,
    separate_by={"run_in_flanks": "repeat without load: run-in of the seals shows without torque as well"},
)

oil_ageing = Mechanism(
    name="oil_ageing",
    family=FAMILY,
    kind="loss_factor",
    places=("losses",),
    sign=0,
    parameters=lambda scale: (strength(0.2, description="relative change of the viscosity in the end"), _life(scale)),
    law=lambda s: s.strength * (1.0 - sp.exp(-s.time / s.life)),
    weights=lambda scale, source: round(scale.viscosity_exponents.get(source, 0.0), 2),
    says="The oil's viscosity drifts during the test: thicker oil costs more in bearings and seals and less in the "
    "mesh.",
    reference="2 % of viscosity per hour of test; every loss with its own exponent of viscosity, as the loss model has "
    "it at the reference point",
    experiment=REPEAT + "; take oil samples before and after",
)

oil_loss = Mechanism(
    name="oil_loss",
    family=FAMILY,
    kind="loss_factor",
    places=("churning", "churning+oil-gears"),
    sign=-1,
    parameters=lambda scale: (strength(0.3, description="relative change in the end"), _life(scale)),
    law=lambda s: s.strength * (1.0 - sp.exp(-s.time / s.life)),
    says="Oil leaks or is carried away: the gears dip less and less deep. They churn less, and the oil wets "
    "less of their surface ({place}).",
    reference="1 mm/h on the FZG rig; churning grows with the immersion depth; that the conductance between gears and "
    "oil falls by the same share, or not at all, is a hypothesis",
    experiment="read the level before and after, at the same temperature",
)

gear_wear = Mechanism(
    name="gear_wear",
    family=FAMILY,
    kind="loss_factor",
    places=("mesh_sliding",),
    parameters=lambda _: (
        strength(0.2, description="relative change after the reference duration at reference speed and torque"),
        plain("exponent", 1.0, sd=0.3, lower=0.3, upper=2.5),
        plain("speed_exponent", 0.5, sd=0.4, lower=0.0, upper=1.5, grid=(0.0, 1.0)),
    ),
    states=(Memory(name="worn", rate=lambda s: _wear_rate(s.n, s.speed_exponent) * s.m / s.duration_ref),),
    law=lambda s: s.strength * Max(s.worn, 0.0) ** s.exponent,
    says="The flanks wear or pit: sliding friction grows with the work done.",
    reference="Archard: wear ~ load times sliding distance; its effect on friction is a hypothesis, and so is that it "
    "goes with a power of speed between loaded hours (0) and loaded revolutions (1)",
    experiment=REPEAT + "; look at the flanks",
    separate_by={"oil_ageing": "change the oil and repeat: wear stays"},
)

bearing_damage = Mechanism(
    name="bearing_damage",
    family=FAMILY,
    kind="source",
    places=("each bearings",),
    is_loss=True,
    parameters=lambda scale: (
        strength(0.1 * scale.loss, "W", "heat at the reference speed and torque"),
        moment(scale),
        plain("load_share", 0.3, sd=0.3, lower=0.0, upper=1.0),
    ),
    law=lambda s: (
        s.strength * s.n * (1.0 - s.load_share + s.load_share * s.m) * steps(s.time, at=s.moment, width=EDGE_S)
    ),
    says="From a moment on the bearing runs with additional friction: damage, dirt or lost lubrication ({place}).",
    reference="an additional friction torque, part of it constant and part with the load, as rolling bearings have "
    "(Palmgren's M_0 and M_1); hypothesis",
    experiment="repeat the first test, and listen to the bearing",
    separate_by={"misalignment": "repeat the first test: damage came later, misalignment was there from the start"},
)

torque_decay = Mechanism(
    name="torque_decay",
    family=FAMILY,
    kind="signal",
    of_measurement=True,
    places=("torque",),
    sign=-1,
    parameters=lambda scale: (strength(0.2, description="relative change of torque in the end"), _life(scale)),
    law=lambda s: s.strength * s.torque * (1.0 - sp.exp(-s.time / s.life)),
    says="The load clutch creeps: the true torque falls below the recorded one.",
    reference="2 % per hour on a back-to-back rig; estimate",
    experiment="measure the torque on the rotating shaft, or re-clamp and repeat",
)

MECHANISMS = (
    run_in_flanks, run_in_seals, oil_ageing, oil_loss, gear_wear, bearing_damage, torque_decay,
)  # fmt: skip
