"""Mechanical losses that the nominal model leaves out or has in another form."""

from __future__ import annotations

from models.formulas.extremes import Max
from models.mechanisms.forms import plain, positive, rises, strength
from models.mechanisms.mechanism import Mechanism

FAMILY_SPEED = "no-load loss"
FAMILY_LOAD = "load-dependent loss"
TWO_OIL_TEMPERATURES = "hold the highest speed without load at two oil temperatures that lie 30 K apart"

windage = Mechanism(
    name="windage",
    family=FAMILY_SPEED,
    kind="source",
    places=("oil", "gears"),
    is_loss=True,
    parameters=lambda scale: (
        strength(0.05 * scale.loss, "W", "heat at the reference speed"),
        plain("exponent", 2.9, sd=0.2, lower=2.0, upper=3.5),
    ),
    law=lambda s: s.strength * s.n**s.exponent,
    says="The gears drag the air and oil mist around them: a loss that grows with almost the cube of speed and hardly "
    "depends on temperature ({place}).",
    reference="Dawson, The Engineer 1984: P ~ n^2.9; Anderson, Loewenthal, NASA TP-1622: n^2.8; from memory",
    experiment="hold three high speeds without load, each until the oil settles",
    separate_by={
        "pocketing": "compare a wide with a narrow gear, or read the mesh temperature: pocketing heats the mesh",
        "churning_swirl": TWO_OIL_TEMPERATURES,
        "brake_drag": "hold low and high speed without load: drag grows with speed, windage with its cube",
    },
)

pocketing = Mechanism(
    name="pocketing",
    family=FAMILY_SPEED,
    kind="source",
    places=("oil", "mesh"),
    is_loss=True,
    parameters=lambda scale: (strength(0.05 * scale.loss, "W", "heat at the reference speed"),),
    law=lambda s: s.strength * s.n**3,
    says="Oil and air are squeezed out of the closing tooth spaces: a loss that grows with the cube of speed, part of "
    "it in the mesh ({place}).",
    reference="Diab, Ville, Velex, Changenet 2005; Seetharaman, Kahraman 2009; from memory",
    experiment="hold three high speeds without load, each until the oil settles, at two oil levels",
    separate_by={"windage": "compare two oil levels at the highest speed: pocketing falls with the level"},
)

churning_swirl = Mechanism(
    name="churning_swirl",
    family=FAMILY_SPEED,
    kind="source",
    places=("oil",),
    is_loss=True,
    parameters=lambda scale: (
        strength(0.3 * scale.loss, "W", "heat at the reference speed in the swirling regime"),
        positive("switch", 0.5, sd=0.8, grid=(0.1, 0.2, 0.4, 0.7, 1.1, 1.8)),
        plain("exponent", 1.8, sd=0.3, lower=1.0, upper=3.0, grid=(1.8, 2.4)),
    ),
    law=lambda s: s.strength * s.n**s.exponent * rises(s.n / s.nu, at=s.switch, power=8),
    says="Beyond a critical speed the gears swirl the sump and churning jumps; warm, thin oil at lower speed "
    "({place}).",
    reference="Changenet, Velex, J. Mech. Des. 129 (2007) and 133 (2011): regimes at Re = 6000 to 9000 (their loss "
    "beyond ~ n^1.2; the exponent here is assumed); switch in speed over viscosity, both in ratio to the reference; "
    "from memory",
    experiment="raise the speed in small steps at two oil temperatures: the kink moves to lower speed as the oil warms",
    separate_by={
        "windage": TWO_OIL_TEMPERATURES,
        "pocketing": TWO_OIL_TEMPERATURES,
        "churning_load": "hold a high speed with and without load: swirling does not depend on torque",
    },
)

churning_load = Mechanism(
    name="churning_load",
    family=FAMILY_LOAD,
    kind="source",
    places=("oil",),
    is_loss=True,
    parameters=lambda scale: (
        strength(0.05 * scale.loss, "W", "heat at the reference speed and torque"),
        plain("exponent", 1.5, sd=0.3, lower=1.0, upper=2.5),
    ),
    law=lambda s: s.strength * s.m * s.n**s.exponent,
    says="Loaded flanks drag more oil through the sump: a loss that grows with torque and speed together but heats the "
    "oil, not the mesh ({place}).",
    reference="a hypothesis, no published law",
    experiment="hold a high speed at three torques, each until the oil settles",
)

oil_level_thermal = Mechanism(
    name="oil_level_thermal",
    family=FAMILY_SPEED,
    kind="loss_factor",
    places=("churning",),
    parameters=lambda _: (strength(0.1, description="relative change of churning per 60 K"),),
    law=lambda s: s.strength * (s.T_oil - s.ambient_ref) / 60.0,
    says="The oil expands as it warms, the gears dip deeper and churn more.",
    reference="beta V / A_sump: about 3 mm per 60 K on the FZG rig, 5 to 10 % of churning; own estimate",
    experiment="hold the highest speed without load at two oil temperatures, and read the level in the sight glass",
)

splash_starvation = Mechanism(
    name="splash_starvation",
    family=FAMILY_LOAD,
    kind="loss_factor",
    places=("mesh_sliding",),
    parameters=lambda _: (
        strength(0.3, description="relative change of sliding loss per reference speed beyond the onset"),
        positive("onset", 0.5, sd=0.6, grid=(0.2, 0.5, 0.9, 1.4)),
    ),
    law=lambda s: s.strength * Max(s.n - s.onset, 0.0),
    says="At high speed the splashed oil no longer fills the mesh: the film is thinner and sliding friction higher.",
    reference="Navet et al. 2020: film over (1 + 0.67 (v - 5) / 15), v in m/s; from memory, the friction's answer ours",
    experiment="hold a high speed at two torques with and without an oil jet into the mesh",
    separate_by={"pocketing": "hold the highest speed at two torques: pocketing does not depend on torque"},
)

misalignment = Mechanism(
    name="misalignment",
    family=FAMILY_LOAD,
    kind="loss_factor",
    places=("mesh_sliding", "each bearings"),
    sign=0,
    parameters=lambda _: (
        strength(0.1, description="relative change of the loss at the reference torque"),
        plain("exponent", 0.0, sd=0.4, lower=0.0, upper=1.5, grid=(0.0, 0.5)),
    ),
    law=lambda s: s.strength * s.m**s.exponent,
    says="The shafts are not parallel: load gathers at one face end and on one bearing ({place}).",
    reference="ISO 6336-1, K_H-beta: a few per cent of loss, bearing loads of 1.4 to 0.6 of the even ones",
    experiment="measure both bearings of a shaft at two torques: one is warmer, the other cooler than computed",
)

bearing_preload = Mechanism(
    name="bearing_preload",
    family=FAMILY_LOAD,
    kind="loss_factor",
    places=("factor bearing", "each shafts>bearings", "each bearings"),
    parameters=lambda _: (
        strength(0.3, description="relative change of the bearing loss per 10 K beyond the threshold"),
        plain("threshold", 15.0, sd=12.0, lower=-10.0, upper=80.0, unit="K", grid=(0.0, 8.0, 16.0, 24.0, 32.0)),
    ),
    law=lambda s: s.strength * Max(s.T_shafts - s.T_housing - s.threshold, 0.0) / 10.0,
    says="The shaft is warmer than the housing, the bearing's clearance is used up and it runs preloaded ({place}).",
    reference="Harris, Rolling Bearing Analysis; clearance 20 to 45 um, 0.7 um/K, so 25 to 35 K on the FZG rig",
    experiment="start cold at high load: the loss rises while the housing is still cold, then falls",
)

bearing_additive = Mechanism(
    name="bearing_additive",
    family=FAMILY_LOAD,
    kind="loss_factor",
    places=("factor bearing",),
    sign=0,
    parameters=lambda _: (
        strength(0.3, description="relative change of the bearing loss at standstill"),
        positive("fade", 0.2, sd=0.8, grid=(0.03, 0.1, 0.3)),
    ),
    law=lambda s: s.strength / (1.0 + (s.n * s.nu / s.fade) ** 2),
    says="The oil's additives change the bearings' friction where the film is thin: at low speed and with warm oil.",
    reference="Fernandes et al. 2013: mu_bl 0.05 and mu_EHL 0.012 in SKF's model; the fade with speed times viscosity "
    "replaces SKF's exp(-2.6e-8 (n nu)^1.4 d_m)",
    experiment="hold a high torque at very low speed with warm oil",
)

brake_drag = Mechanism(
    name="brake_drag",
    family=FAMILY_SPEED,
    kind="source",
    places=("each shafts",),
    is_loss=True,
    parameters=lambda scale: (strength(0.1 * scale.loss, "W", "heat at the reference speed"),),
    law=lambda s: s.strength * s.n,
    says="A brake or clutch on the shaft drags with a constant torque ({place}).",
    reference="Coulomb friction: heat proportional to speed",
    experiment="hold a low and a high speed without load: the drag torque is the same",
    separate_by={"windage": "hold low and high speed without load: drag grows with speed, windage with its cube"},
)

MECHANISMS = (
    windage, pocketing, churning_swirl, churning_load, oil_level_thermal, splash_starvation, misalignment,
    bearing_preload, bearing_additive, brake_drag,
)  # fmt: skip
