"""Effects that lose mechanical power, or change what is lost. Forms and exponents are the plant's own."""

from __future__ import annotations

from functools import partial

import numpy as np

from diagnosis.proof.plant import effect
from diagnosis.proof.plant.anatomy import MESH, OIL
from diagnosis.proof.plant.draws import (
    all_bearings,
    at,
    bearing,
    bearings_of_input,
    output_shaft,
    relative,
    share_of_loss,
)
from diagnosis.proof.plant.effect import Effect, Grip
from diagnosis.proof.plant.plant import REFERENCE_SPEED
from diagnosis.proof.plant.sizes import T_SERVICE
from models.losses.bearing import BearingLaw
from models.portable.evaluation import RPM

SLIDING, ROLLING, CHURNING = "mesh_sliding", "mesh_rolling", "churning"
LOSS_EFFECTS: dict[str, Effect] = {}
acts = partial(effect.acts, table=LOSS_EFFECTS)


# ---------------------------------------------------------------------- no-load losses


@acts("source", at(OIL), share_of_loss(0.025, exponent=(2.5, 2.75)),
      "a x^2.6 W, x = speed / top speed; 80 % oil, 10 % each gear", family="no-load loss")  # fmt: skip
def windage(g: Grip) -> None:
    """Air dragged by the gears; mostly into the mist, a little into the gears."""
    watts = g.p["a"] * g.x ** g.p["exponent"]
    g.heat(OIL, 0.8 * watts, lost=True)
    for gear in g.plant.anatomy.gears:
        g.heat(gear, 0.1 * watts, lost=True)


@acts("source", at(MESH, OIL), share_of_loss(0.05), "a x^3.2 W; 60 % mesh, 40 % oil", family="no-load loss")
def pocketing(g: Grip) -> None:
    """Oil squeezed out of the meshing teeth."""
    watts = g.p["a"] * g.x**3.2
    g.heat(MESH, 0.6 * watts, lost=True)
    g.heat(OIL, 0.4 * watts, lost=True)


@acts("source", at(OIL), share_of_loss(0.40, Re=(6500.0, 8500.0)),
      "a (0.15 + 0.85 s(Re)) x^1.9 W, s: step at Re = v b / nu(T_oil)", family="no-load loss")  # fmt: skip
def churning_swirl(g: Grip) -> None:
    """Regime change of churning at a Reynolds number, that is at a speed that depends on the oil's temperature."""
    oil, pair = g.plant.oil, g.plant.anatomy.pair
    v = g.x * g.plant.speed_top * RPM * pair.r_w[0]
    Re = v * pair.b / (oil.kinematic_viscosity(g.T(OIL)) * 1e-6)
    turbulent = 1.0 / (1.0 + np.exp(-(Re - g.p["Re"]) / 500.0))
    g.heat(OIL, g.p["a"] * (0.15 + 0.85 * turbulent) * g.x**1.9, lost=True)


@acts("source", at(OIL), share_of_loss(0.05), "a y^0.85 (x / 0.415)^1.4 W", family="load-dependent loss")
def churning_load(g: Grip) -> None:
    """Oil dragged into the loaded mesh."""
    g.heat(OIL, g.p["a"] * g.y**0.85 * (g.x / REFERENCE_SPEED) ** 1.4, lost=True)


@acts("loss_factor", at(OIL), relative(0.30), "churning (1 + a (T_oil - 40) / 60)", family="no-load loss")
def oil_level_thermal(g: Grip) -> None:
    """The oil expands and the gears dip deeper."""
    g.factor(CHURNING, g.p["a"] * (g.T(OIL) - 40.0) / 60.0)


@acts("loss_factor", at(OIL), relative(0.04), "level falls by a per hour: churning, drag, capacity", family="ageing")
def oil_loss(g: Grip) -> None:
    """The level sinks: less churning, less oil to warm, drier gears."""
    lost = np.minimum(g.p["a"] * g.hours, 0.7)
    g.factor(CHURNING, -np.minimum(1.4 * lost, 0.95))
    for name in g.plant.anatomy.bearings:
        g.factor(name, -0.3 * lost)
    g.capacity(OIL, -0.5 * lost)


@acts("loss_factor", at(MESH), relative(0.30), "mesh sliding (1 + a ((x - 0.25)+ / 0.75)^1.2)", family="lubrication")
def splash_starvation(g: Grip) -> None:
    """At high speed the flanks run dry."""
    g.factor(SLIDING, g.p["a"] * np.maximum((g.x - 0.25) / 0.75, 0.0) ** 1.2)


@acts("source", at(OIL), share_of_loss(0.18, T=(40.0, 55.0)), "0.3 a x^1.9 W, and a / 30 W/K to oil of temperature T",
      family="oil circuit")  # fmt: skip
def oil_jet(g: Grip) -> None:
    """Oil injected at a fixed temperature and brought to speed by the gears."""
    g.heat(OIL, 0.3 * g.p["a"] * g.x**1.9, lost=True)
    g.sink(OIL, g.p["a"] / 30.0 * np.minimum(g.x / 0.1, 1.0), g.p["T"])


@acts("source", at(OIL), share_of_loss(0.045), "a x^1.15 W", family="oil circuit")
def pump_heat(g: Grip) -> None:
    """A gear pump on the shaft, its flow limited by a valve."""
    g.heat(OIL, g.p["a"] * g.x**1.15, lost=True)


# ---------------------------------------------------------------------- ageing and running in


@acts("loss_factor", at(MESH), relative(0.35, life=(0.6, 1.2)),
      "mesh sliding (1 + a m(x nu) exp(-w / life)), dw = x y^0.5 dt", family="ageing")  # fmt: skip
def run_in_flanks(g: Grip) -> None:
    """Asperities are worn off with loaded revolutions, and matter in the mixed regime only."""
    oil = g.plant.oil
    worn = g.remembered("worn", 0.0)
    g.memory["worn"] = worn + (g.hours > 0.0) * g.x * g.y**0.5 * 10.0 / 3600.0
    nu = oil.kinematic_viscosity(g.T(g.plant.anatomy.gears[0]))
    mixed = 1.0 / (1.0 + (g.x * nu / 6.0) ** 1.1)
    g.factor(SLIDING, g.p["a"] * mixed * np.exp(-g.memory["worn"] / g.p["life"]))


@acts(
    "loss_factor", at(OIL), relative(0.5, life=(1.5, 3.0)), "seals (1 + a exp(-(t_run / life)^0.85))", family="ageing"
)
def run_in_seals(g: Grip) -> None:
    """Lips bed in while the shafts turn."""
    run = g.remembered("run", 0.0)
    g.memory["run"] = run + (g.hours > 0.0) * (g.x > 0.0) * 10.0 / 3600.0
    for seal in g.plant.gearbox.seal:
        g.factor(seal.name, g.p["a"] * np.exp(-((g.memory["run"] / g.p["life"]) ** 0.85)))


@acts(
    "loss_factor", all_bearings, relative(0.03), "viscosity (1 + a t^0.9), t in hours", family="ageing", on_inputs=True
)
def oil_ageing(g: Grip) -> None:
    """The oil thickens, a few percent per hour; thicker oil is read as colder oil."""
    beta = g.plant.oil.thermoviscosity(T_SERVICE)
    g.moment.thinning[g.members] -= np.log1p(g.p["a"] * g.hours**0.9) / beta


@acts("loss_factor", at(MESH), relative(0.012), "mesh sliding (1 + a w^1.3), dw = y^1.2 dt (hours)", family="ageing")
def gear_wear(g: Grip) -> None:
    """Pitting grows with loaded time."""
    load = g.remembered("load", 0.0)
    g.memory["load"] = load + (g.hours > 0.0) * g.y**1.2 * 10.0 / 3600.0
    g.factor(SLIDING, g.p["a"] * g.memory["load"] ** 1.3)


@acts("source", bearing, share_of_loss(0.10, onset_h=(0.5, 1.2)), "a s(t) (0.2 + 0.8 x) (0.6 + 0.4 y) W from t = onset",
      family="damage")  # fmt: skip
def bearing_damage(g: Grip) -> None:
    """From a moment on one bearing grinds."""
    grown = np.clip((g.hours - g.p["onset_h"]) / 0.15, 0.0, 1.0)
    g.heat(g.places[0], g.p["a"] * grown * (0.2 + 0.8 * g.x) * (0.6 + 0.4 * g.y) * (g.x > 0.0), lost=True)


# ---------------------------------------------------------------------- load and bearings


@acts("loss_factor", bearings_of_input, relative(0.12, dT=(4.0, 7.0)),
      "loss (1 + a ((T_shaft - T_housing) - dT)+^1.15)", family="load-dependent loss")  # fmt: skip
def bearing_preload(g: Grip) -> None:
    """A shaft hotter than the housing takes the clearance of its bearings."""
    shaft, part = g.plant.gearbox.stage[0].driver, g.plant.anatomy.parts[0]
    excess = np.maximum(g.T(shaft) - g.T(part) - g.p["dT"], 0.0)
    for name in g.places:
        g.factor(name, g.p["a"] * excess**1.15)


@acts("loss_factor", all_bearings, relative(0.55, 0.95), "sliding moment of the bearings (1 - a)", family="lubrication")
def bearing_additive(g: Grip) -> None:
    """Additives lower the sliding friction of the rollers."""
    plant = g.plant
    speed = np.maximum(g.x * plant.speed_top, 1.0)
    for name in plant.anatomy.bearings:
        term = plant.losses[0].term(name)
        assert isinstance(term.law, BearingLaw)  # noqa: S101
        n, load, *_ = term.inputs
        moments = term.law.bearing.friction_moments(
            n_rpm=speed * n.factor,
            F_r=np.maximum(load.factor * np.abs(g.y * plant.torque_ref), term.law.bearing.lightest_load),
            nu=plant.oil.kinematic_viscosity(0.5 * (g.T(OIL) + g.T(name))),
        )
        g.factor(name, -g.p["a"] * moments[1] / sum(moments))


def misaligned_load(g: Grip) -> None:
    """The load leans to one bearing of each shaft."""
    for k in range(len(g.plant.anatomy.bearings)):
        g.moment.bearing_load[g.members, k] *= 1.0 + (0.4 if k % 2 == 0 else -0.4) * np.minimum(g.p["a"] / 0.05, 2.0)


@acts("loss_factor", at(MESH), relative(0.05),
      "mesh sliding (1 + a min(0.7 + 0.3 y, 1.5)); bearing loads +-40 % a / 0.05", family="load-dependent loss",
      before=misaligned_load)  # fmt: skip
def misalignment(g: Grip) -> None:
    """Load concentrates at one end of the teeth, more so when it is high."""
    g.factor(SLIDING, g.p["a"] * np.minimum(0.7 + 0.3 * g.y, 1.5))


@acts("source", output_shaft, share_of_loss(0.08), "a x^0.85 W", family="damage")
def brake_drag(g: Grip) -> None:
    """A brake or clutch that does not quite open; its torque falls a little with speed."""
    g.heat(g.places[0], g.p["a"] * g.x**0.85, lost=True)
