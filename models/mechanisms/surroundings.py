"""Mechanisms of the surroundings: sun, rain, fans and ambient air at the housing."""

from __future__ import annotations

from typing import Any

import sympy as sp

from models.formulas.extremes import Max, Min
from models.mechanisms.forms import (
    length,
    moment,
    period,
    plain,
    positive,
    rises,
    share_between,
    strength,
    temperature,
    two_point,
)
from models.mechanisms.mechanism import Mechanism
from models.mechanisms.scale import Scale
from models.network.laws import Parameter

FAMILY = "surroundings"
HOUR_S = 3600.0
SWITCHES = 24.0  # sharpness of a switch: from a tenth below a speed to a tenth above it
WETTED_S = 300.0  # after which a shower has wetted everything
STANDSTILL_DAY = "leave the machine at standstill for a day with an ambient probe on each side"

solar_soak = Mechanism(
    name="solar_soak",
    family=FAMILY,
    kind="source",
    places=("each housing", "housing"),
    parameters=lambda scale: (
        strength(0.12 * scale.loss, "W", "heat at the height of it"),
        moment(scale, "noon"),
        length(scale, 0.1, 0.25),
    ),
    law=lambda s: s.strength * sp.exp(-(((s.time - s.noon) / s.length) ** 2)),
    says="Sun or a hot exhaust shines on the housing for a while ({place}).",
    reference="34 to 60 W on the FZG rig's upper housing; the bell shape is ours",
    experiment="shade the housing and repeat at the same hour",
)


def _wet(s: Any) -> sp.Expr:
    """Share of the housing that is wet: all of it soon after a shower begins, until that ends and the housing dries."""
    since = sp.Mod(s.time - s.onset, s.every)  # the last one began
    return Min(since / WETTED_S, 1.0) * sp.exp(-Max(since - s.length, 0.0) / s.drying)


rain_on_housing = Mechanism(
    name="rain_on_housing",
    family=FAMILY,
    kind="link",
    places=("each housing", "housing"),
    other="rain",
    other_temperature=lambda s: s.T_ambient - s.colder,
    parameters=lambda scale: (
        strength(1.5 * scale.conductance, "W/K", "additional conductance to the air"),
        moment(scale, "onset"),
        length(scale, 0.04, 0.1, 0.3),
        period(scale),
        positive("drying", 400.0, sd=0.7, unit="s"),
        plain("colder", 2.0, sd=2.0, lower=0.0, upper=15.0, unit="K"),
    ),
    law=lambda s: s.strength * _wet(s),
    says="For a while, once or again and again, the housing is cooled much better: rain, spray or a gust ({place}).",
    reference="wet walls: 100 to 500 W/(m^2 K), down to the wet-bulb temperature; estimate",
    experiment="log the weather, or repeat under a roof",
)


def _fan(scale: Scale, description: str = "additional conductance to the air") -> Parameter:
    return strength(0.7 * scale.conductance, "W/K", description)


fan_thermostat = Mechanism(
    name="fan_thermostat",
    family=FAMILY,
    kind="link",
    places=("housing",),
    other="air",
    parameters=lambda scale: (
        _fan(scale),
        temperature(
            "set_point",
            share_between(scale, 0.7),
            sd=15.0,
            grid=[share_between(scale, share) for share in (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)],
        ),
        positive("band", 6.0, sd=0.5, unit="K", grid=(3.0, 8.0)),
    ),
    states=(two_point("blowing", reads="T_here"),),
    law=lambda s: s.strength * s.blowing,
    says="A fan switches on when the housing is warm and off when it is cooler.",
    reference="two-point control; a fan doubles to triples the conductance to air",
    experiment="heat up slowly at constant load past the suspected set-point: the housing temperature saws",
    separate_by={"cooler_thermostat": "measure oil and housing when it switches: with a fan the housing moves first"},
)

fan_on_shaft = Mechanism(
    name="fan_on_shaft",
    family=FAMILY,
    kind="link",
    places=("housing",),
    other="air",
    parameters=lambda scale: (
        _fan(scale, "additional conductance to the air at the reference speed"),
        plain("exponent", 0.7, sd=0.25, lower=0.2, upper=1.5, grid=(0.5, 0.9)),
    ),
    law=lambda s: s.strength * s.n**s.exponent,
    says="A fan on a shaft blows air over the housing: it cools with speed and not at standstill.",
    reference="a fan's flow goes with its speed, h ~ v_air^0.64 by ISO/TR 14179-2",
    experiment="compare a cool-down at standstill with one at speed without load, and measure the air at the housing",
    separate_by={
        "cooler_shaft_driven": "measure oil and housing after a change of speed: with a fan the housing moves first",
        "shaft_ends_to_air": "measure the shafts: their ends would make them the cooler ones",
    },
)

fan_speed_switch = Mechanism(
    name="fan_speed_switch",
    family=FAMILY,
    kind="link",
    places=("housing",),
    other="air",
    parameters=lambda scale: (
        _fan(scale),
        positive("switch", 0.6, sd=0.8, grid=(0.05, 0.3, 0.6, 0.9, 1.2)),
    ),
    law=lambda s: s.strength * rises(s.n, at=s.switch, power=SWITCHES),
    says="A fan runs above a speed: with the drive, or switched by its control.",
    reference="a fan doubles to triples the conductance to air; that it switches within a tenth of the speed is ours",
    experiment="hold speeds below and above the suspected one at the same loss",
    separate_by={
        "fan_on_shaft": "hold two speeds above the suspected one: a fan on the shaft cools better at the higher"
    },
)

ambient_drift = Mechanism(
    name="ambient_drift",
    family=FAMILY,
    kind="signal",
    of_measurement=True,
    places=("T_ambient",),
    sign=0,
    parameters=lambda _: (strength(3.0, "K", "true less recorded at the end of the recording"),),
    law=lambda s: s.strength * s.x,
    says="The air at the gearbox warms or cools during the test, which the recorded ambient does not show.",
    reference="25 to 29 degC in a test cell, where one constant is recorded",
    experiment=STANDSTILL_DAY,
)

ambient_swing = Mechanism(
    name="ambient_swing",
    family=FAMILY,
    kind="signal",
    of_measurement=True,
    places=("T_ambient",),
    sign=0,
    parameters=lambda _: (
        strength(2.0, "K", "true less recorded, half of the swing"),
        positive("period", 6.0 * HOUR_S, sd=0.6, unit="s", grid=[h * HOUR_S for h in (3.0, 6.0, 9.0, 24.0)]),
        plain("phase", 0.0, sd=1.0, lower=-4.0, upper=4.0, unit="rad", grid=(-0.8, 0.0, 0.8, 1.6)),
    ),
    law=lambda s: s.strength * sp.sin(2.0 * sp.pi * s.time / s.period + s.phase),
    says="The air at the gearbox swings with the day or with the hall's heating, which the recorded ambient does not "
    "show.",
    reference="25 to 29 degC in a test cell, where one constant is recorded; the sine is ours",
    experiment=STANDSTILL_DAY,
)

MECHANISMS = (solar_soak, rain_on_housing, fan_thermostat, fan_on_shaft, fan_speed_switch, ambient_drift, ambient_swing)
