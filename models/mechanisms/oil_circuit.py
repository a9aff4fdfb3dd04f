"""Coolers, heaters, pumps and what else is done to the oil from outside."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import sympy as sp

from models.formulas.extremes import Max, Min
from models.mechanisms.forms import (
    EDGE_S,
    RUNNING,
    moment,
    plain,
    positive,
    rises,
    share_between,
    steps,
    strength,
    temperature,
    two_point,
)
from models.mechanisms.mechanism import Mechanism, Memory
from models.mechanisms.scale import Scale
from models.network.laws import Parameter

FAMILY = "oil circuit"
STANDING = 25.0  # sharpness of an interlock: at a tenth of the reference speed it is off
PAST_SET_POINT = "heat up slowly at constant load past the suspected set-point, then hold"
RETURN = "measure the oil where it enters and leaves the gearbox"
# Below and above the surroundings: a fit that goes further trades the coolant's temperature for the cooler's strength.
COLDEST_COOLANT_K, WARMEST_COOLANT_K = 30.0, 20.0
SET_POINTS = (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.1)  # of the way from ambient to the hot oil


def _cooler(scale: Scale) -> Parameter:
    return strength(0.8 * scale.conductance, "W/K", "conductance of the cooler")


def _coolant(scale: Scale) -> Parameter:
    coldest, warmest = scale.ambient - COLDEST_COOLANT_K, scale.ambient + WARMEST_COOLANT_K
    return temperature("coolant", scale.ambient, sd=10.0, lower=coldest, upper=warmest)


def _set_point(scale: Scale) -> Parameter:
    grid = [share_between(scale, share) for share in SET_POINTS]
    return temperature("set_point", share_between(scale, 0.75), sd=15.0, grid=grid)


def _opens(scale: Scale) -> Parameter:
    return replace(_set_point(scale), description="where it begins to open; a band further it is wide open")


def _band() -> Parameter:
    return positive("band", 6.0, sd=0.5, unit="K", grid=(3.0, 8.0))


cooler_thermostat = Mechanism(
    name="cooler_thermostat",
    family=FAMILY,
    kind="link",
    places=("oil",),
    other="coolant",
    other_temperature=lambda s: s.coolant,
    parameters=lambda scale: (
        _cooler(scale),
        _set_point(scale),
        _band(),
        _coolant(scale),
        positive("delay", 15.0, sd=1.0, unit="s"),
    ),
    states=(two_point("valve"), Memory(name="opening", rate=lambda s: (s.valve - s.opening) / s.delay)),
    law=lambda s: s.strength * s.opening,
    says="A thermostat sends the oil through a cooler above a set temperature, and back below a lower one.",
    reference="two-point control; 6 W/K above 80 degC on the FZG rig; that the valve follows with one time constant "
    "of 10 to 60 s is an estimate",
    experiment=PAST_SET_POINT + ": the oil saws between two temperatures",
    separate_by={"cooler_proportional": "hold a load near the set-point: a two-point valve makes the oil saw"},
)

cooler_proportional = Mechanism(
    name="cooler_proportional",
    family=FAMILY,
    kind="link",
    places=("oil",),
    other="coolant",
    other_temperature=lambda s: s.coolant,
    parameters=lambda scale: (
        _cooler(scale),
        _opens(scale),
        positive("band", 10.0, sd=0.6, unit="K", grid=(5.0, 15.0)),
        _coolant(scale),
    ),
    law=lambda s: s.strength * Min(Max((s.T_oil - s.set_point) / s.band, 0.0), 1.0),
    says="A valve opens in proportion above a set temperature and sends the oil through a cooler.",
    reference="wax thermostat: opens over 10 to 15 K",
    experiment=PAST_SET_POINT + " two loads beyond it: the oil temperature hardly rises",
    separate_by={"cooler_thermostat": "hold a load near the set-point: a two-point valve makes the oil saw"},
)

cooler_constant = Mechanism(
    name="cooler_constant",
    family=FAMILY,
    kind="link",
    places=("oil",),
    other="coolant",
    other_temperature=lambda s: s.coolant,
    parameters=lambda scale: (_cooler(scale), _coolant(scale)),
    law=lambda s: s.strength,
    says="An oil cooler is always on.",
    reference="heat exchanger of constant flow",
    experiment="stand still hot with the pump of the cooler on, then off",
    separate_by={
        "foundation_conduction": "measure oil and housing in a cool-down: a cooler makes the oil the cooler one"
    },
)

cooler_shaft_driven = Mechanism(
    name="cooler_shaft_driven",
    family=FAMILY,
    kind="link",
    places=("oil",),
    other="coolant",
    other_temperature=lambda s: s.coolant,
    parameters=lambda scale: (
        _cooler(scale),
        plain("exponent", 0.8, sd=0.3, lower=0.2, upper=1.5, grid=(0.5, 0.9)),
        _coolant(scale),
    ),
    law=lambda s: s.strength * s.n**s.exponent,
    says="The pump or fan of the oil cooler sits on the shaft: it cools with speed and not at standstill.",
    reference="turbulent heat transfer, ~ flow^0.8",
    experiment="compare a cool-down at standstill with one at speed without load",
)

oil_jet = Mechanism(
    name="oil_jet",
    family=FAMILY,
    kind="link",
    places=("oil", "gears"),
    other="supply",
    other_temperature=lambda s: s.supply,
    parameters=lambda scale: (
        strength(1.5 * scale.conductance, "W/K", "heat capacity flow of the jet"),
        temperature(
            "supply",
            share_between(scale, 0.5),
            sd=20.0,
            grid=[share_between(scale, share) for share in (0.2, 0.5, 0.8)],
        ),
    ),
    law=lambda s: s.strength * sp.tanh(RUNNING * s.n),
    says="Oil of a constant temperature is injected while the gears turn: cold ones warm, hot ones cool ({place}).",
    reference="rho c V: 30 W/K per l/min of mineral oil",
    experiment=RETURN,
    separate_by={"hot_neighbour": "stand still hot: the jet stops, the neighbour stays"},
)

pump_heat = Mechanism(
    name="pump_heat",
    family=FAMILY,
    kind="source",
    places=("oil",),
    is_loss=True,
    parameters=lambda scale: (strength(0.1 * scale.loss, "W", "heat at the reference speed"),),
    law=lambda s: s.strength * s.n,
    says="A pump on the shaft works against a constant pressure and its power ends as heat in the oil.",
    reference="displacement pump with a relief valve: p V, proportional to speed",
    experiment="hold a low and a high speed without load, and read the oil pressure",
    separate_by={"windage": "hold low and high speed without load: the pump grows with speed, windage with its cube"},
)


def _pumped(s: Any) -> sp.Expr:
    """Share of the flow: whole while the gearbox turns, the share `standstill` where its pump goes on without it."""
    return 1.0 - (1.0 - s.standstill) * sp.exp(-RUNNING * s.n)


oil_tank = Mechanism(
    name="oil_tank",
    family=FAMILY,
    kind="source",
    places=("oil",),
    parameters=lambda scale: (
        strength(1.5 * scale.conductance, "W/K", "heat capacity flow to the tank"),
        positive("lag", 1000.0, sd=1.0, unit="s", grid=(200.0, 600.0, 1800.0, 5400.0)),
        positive("leak", 0.1, sd=0.8, grid=(0.03, 0.2)),
        plain("standstill", 0.5, sd=0.5, lower=0.0, upper=1.0, grid=(0.0, 1.0)),
    ),
    states=(
        Memory(
            name="tank",  # its rise above the air: it starts at the temperature of the air, whatever that is
            rate=lambda s: (_pumped(s) * (s.T_oil - s.T_ambient - s.tank) - s.leak * s.tank) / s.lag,
        ),
    ),
    law=lambda s: s.strength * _pumped(s) * (s.T_ambient + s.tank - s.T_oil),
    says="Oil circulates through a tank or long pipes outside, which warm late and give heat to the air.",
    reference="stirred tank: lag = its capacity over the heat capacity flow; leak = its loss to air over it",
    experiment=RETURN + " after a step of load",
)

heater_thermostat = Mechanism(
    name="heater_thermostat",
    family=FAMILY,
    kind="source",
    places=("oil",),
    parameters=lambda scale: (
        strength(0.4 * scale.loss, "W", "power of the heater"),
        temperature(
            "set_point",
            share_between(scale, 0.3),
            sd=12.0,
            grid=[share_between(scale, share) for share in (0.4, 0.1, 0.2, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)],
        ),
        positive("band", 6.0, sd=0.5, unit="K"),
        plain("running", 0.5, sd=0.5, lower=0.0, upper=1.0, grid=(1.0, 0.0)),
    ),
    states=(two_point("heating", above=0.0),),
    # Heaters of turbines and drives often are interlocked with the motor; those of test rigs heat while it turns.
    law=lambda s: s.strength * s.heating * (s.running + (1.0 - s.running) * sp.exp(-((STANDING * s.n) ** 2))),
    says="An electric heater keeps the oil warm.",
    reference="two-point control; running: share of its power while the gearbox turns",
    experiment="let it stand until it would be cold: the oil stays at the heater's temperature",
    separate_by={"hot_neighbour": "let it stand: a heater makes the oil the warmest part, a neighbour another one"},
)

oil_added = Mechanism(
    name="oil_added",
    family=FAMILY,
    kind="loss_factor",
    places=("churning",),
    parameters=lambda scale: (strength(0.3, description="relative change of churning"), moment(scale)),
    law=lambda s: s.strength * steps(s.time, at=s.moment, width=EDGE_S),
    says="Oil was added: from then on the gears dip deeper and churn more.",
    reference="churning grows with the immersion depth",
    experiment="read the level before and after, at the same temperature",
)

water_jacket = Mechanism(
    name="water_jacket",
    family=FAMILY,
    kind="link",
    places=("each housing", "housing"),
    other="water",
    other_temperature=lambda s: s.water,
    parameters=lambda scale: (
        strength(scale.conductance, "W/K", "conductance to the water"),
        temperature("water", scale.ambient - 5.0, sd=10.0),
    ),
    law=lambda s: s.strength,
    says="Water of a constant temperature flows through the housing ({place}).",
    reference="heat exchanger of constant flow",
    experiment="stand still hot with the water on, then off",
    separate_by={
        "foundation_conduction": "stand still to the end of the cool-down: it ends at the water's temperature",
        "cooler_constant": "measure oil and housing in a cool-down: a jacket makes the housing the cooler one",
    },
)

cooler_air_thermostat = Mechanism(
    name="cooler_air_thermostat",
    family=FAMILY,
    kind="link",
    places=("returns-air", "returns-outdoor", "oil-outdoor"),
    parameters=lambda scale: (
        strength(1.5 * scale.conductance, "W/K", "conductance of the cooler"),
        _set_point(scale),
        positive("band", 6.0, sd=0.5, unit="K", grid=(3.0, 5.0, 8.0)),
    ),
    states=(two_point("valve"),),
    law=lambda s: s.strength * s.valve,
    says="A thermostat or fan sends the returning oil through an air cooler above a set oil temperature, and past it "
    "below a lower one ({place}).",
    reference="two-point control; wind turbines: fan on at some 60 degC, off at some 55 degC",
    experiment=PAST_SET_POINT + ": the oil saws between two temperatures, the returning oil steps",
    separate_by={"cooler_air_proportional": "hold a load near the set-point: a two-point valve makes the oil saw"},
)

cooler_air_proportional = Mechanism(
    name="cooler_air_proportional",
    family=FAMILY,
    kind="link",
    places=("returns-air", "returns-outdoor"),
    parameters=lambda scale: (
        strength(1.5 * scale.conductance, "W/K", "conductance of the cooler, wide open"),
        _opens(scale),
        positive("band", 10.0, sd=0.6, unit="K", grid=(5.0, 15.0)),
    ),
    law=lambda s: s.strength * Min(Max((s.T_oil - s.set_point) / s.band, 0.0), 1.0),
    says="A wax valve opens with the oil temperature and sends the returning oil through an air cooler ({place}).",
    reference="wax thermostat: opens over 10 to 15 K",
    experiment=PAST_SET_POINT + " two loads beyond it: the oil temperature hardly rises",
    separate_by={"cooler_air_thermostat": "hold a load near the set-point: a two-point valve makes the oil saw"},
)

bearing_fed_by_return = Mechanism(
    name="bearing_fed_by_return",
    family=FAMILY,
    kind="link",
    places=("each bearings-returns",),
    parameters=lambda scale: (strength(0.5 * scale.conductance, "W/K", "heat capacity flow of the feed"),),
    law=lambda s: s.strength * sp.tanh(RUNNING * s.n),
    says="The bearing is fed with the oil that comes back, not from the sump: it follows the cooler ({place}).",
    reference="rho c V: 30 W/K per l/min of mineral oil",
    experiment=RETURN + " while the cooler switches: the bearing follows at once",
)

pump_fast_stage = Mechanism(
    name="pump_fast_stage",
    family=FAMILY,
    kind="link_factor",
    places=("oil-returns",),
    sign=0,
    parameters=lambda _: (
        strength(0.5, description="relative change of the circulation beyond the switch"),
        positive("switch", 0.8, sd=0.3, grid=(0.5, 0.7, 0.9, 0.98)),
    ),
    law=lambda s: s.strength * rises(s.n, at=s.switch, power=24),
    says="The pump has a second stage: above a speed more or less oil circulates.",
    reference="pole-changing motor: 1 to 2; or a pump on the shaft with a relief valve",
    experiment="hold speeds around the switch and measure the oil where it enters and leaves",
)

MECHANISMS = (
    cooler_air_thermostat, cooler_air_proportional, bearing_fed_by_return, pump_fast_stage,
    cooler_thermostat, cooler_proportional, cooler_constant, cooler_shaft_driven, oil_jet, pump_heat, oil_tank,
    heater_thermostat, oil_added, water_jacket,
)  # fmt: skip
