"""Heat paths that the nominal model leaves out or has with another conductance."""

from __future__ import annotations

from typing import Any

from models.mechanisms.forms import plain, positive, rises, share_between, strength, temperature
from models.mechanisms.mechanism import Mechanism, Memory
from models.quantities.units import KELVIN

FAMILY_OUT = "heat to the surroundings"
FAMILY_IN = "heat inside the gearbox"
COOL_DOWN = "stop hot and record the whole cool-down, of the housing above all"

foundation_conduction = Mechanism(
    name="foundation_conduction",
    family=FAMILY_OUT,
    kind="source",
    places=("each housing", "housing", "each others"),
    parameters=lambda scale: (
        strength(0.4 * scale.conductance, "W/K", "from here through the foundation to the air, once it is warm"),
        positive("feet", 1.0, sd=1.5, grid=(0.02, 0.5, 3.0, 15.0)),
        positive("lag", 5000.0, sd=1.0, unit="s", grid=(1500.0, 5000.0, 20000.0)),
    ),
    states=(
        Memory(
            name="frame",  # its rise above the air, at whose temperature it starts
            rate=lambda s: (s.feet / (1.0 + s.feet) * (s.T_here - s.T_ambient) - s.frame) / s.lag,
        ),
    ),
    law=lambda s: s.strength * (1.0 + s.feet) * (s.T_ambient + s.frame - s.T_here),
    says="Heat leaves through the feet into the foundation, a frame or a bed, and warms it ({place}).",
    reference="mass between two conductances: lag = its capacity over their sum; Navet et al. 2020: 2 to 10 W/K, "
    "compared with 7 W/K to air, on the FZG rig; from memory",
    experiment=COOL_DOWN + "; the part on the foundation is the cooler one",
    separate_by={
        "air_cooling_change": "hold one state with the fan on and off: conduction stays",
        "radiation_error": "compare the lower with the upper housing at two temperatures",
        "shaft_ends_to_air": "measure the shafts, or compare standstill with speed at the same oil temperature",
    },
)

hot_neighbour = Mechanism(
    name="hot_neighbour",
    family=FAMILY_OUT,
    kind="link",
    places=("each housing", "housing", "each shafts", "each others"),
    other="neighbour",
    other_temperature=lambda s: s.neighbour,
    parameters=lambda scale: (
        strength(0.15 * scale.conductance, "W/K", "conductance to the neighbour"),
        temperature(
            "neighbour",
            0.5 * (scale.ambient + scale.temperature),
            sd=20.0,
            lower=scale.ambient,
            grid=[share_between(scale, share) for share in (0.3, 0.6, 1.0)],
        ),
    ),
    law=lambda s: s.strength,
    says="A neighbour of constant temperature warms the cold gearbox and cools the hot one ({place}).",
    reference="slave gearbox or flange: 0.5 to 2 W/K on the FZG rig, estimate",
    experiment="stand still until all is at ambient temperature: the part next to the neighbour stays warmer",
)

shaft_ends_to_air = Mechanism(
    name="shaft_ends_to_air",
    family=FAMILY_OUT,
    kind="link",
    places=("each shafts", "shafts"),
    other="air",
    parameters=lambda scale: (
        strength(0.1 * scale.conductance, "W/K", "conductance at the reference speed"),
        plain("still", 0.15, sd=0.1, lower=0.0, upper=1.0),
    ),
    law=lambda s: s.strength * (s.n ** (2 / 3) + s.still) / (1.0 + s.still),
    says="The rotating shaft ends give heat to the air ({place}).",
    reference="Becker 1963: Nu = 0.133 Re^(2/3) Pr^(1/3); Churchill; Dropkin; 0.35 and 0.6 W/K on the FZG rig",
    experiment="measure the shafts at two speeds at the same torque",
)

radiation_error = Mechanism(
    name="radiation_error",
    family=FAMILY_OUT,
    kind="link_factor",
    places=("housing-air",),
    sign=0,
    parameters=lambda _: (strength(0.15, description="relative change of the conductance, housing at 60 degC"),),
    law=lambda s: s.strength * _radiant(s.T_here, s.T_there) / _radiant(60.0, 25.0),
    says="The housing radiates more or less than assumed: another paint, or a hot or bright wall facing it.",
    reference="Stefan-Boltzmann: h_r = eps sigma (T^2 + T_a^2)(T + T_a), a fifth of the conductance to air on the FZG "
    "rig",
    experiment=COOL_DOWN + ", fan off; cover the housing with foil and repeat",
    separate_by={"air_cooling_change": "cover the housing with foil: radiation falls, convection stays"},
)

air_cooling_change = Mechanism(
    name="air_cooling_change",
    family=FAMILY_OUT,
    kind="link_factor",
    places=("housing-air", "each housing-air"),
    sign=0,
    parameters=lambda _: (strength(0.3, description="relative change of the conductance"),),
    law=lambda s: s.strength,
    says="Cooling by air is weaker or stronger than assumed: slower fan, dirt, a cover, a draught ({place}).",
    reference="ISO/TR 14179-2: h ~ v_air^0.64; 26 to 17 W/(m^2 K) from fan to dirt on the FZG rig",
    experiment="hold one state with the fan on, then off",
    separate_by={"radiation_error": "cover the housing with foil: radiation falls, convection stays"},
)

aeration = Mechanism(
    name="aeration",
    family=FAMILY_IN,
    kind="link_factor",
    places=("oil-gears", "oil-gears+oil-housing"),
    sign=-1,
    parameters=lambda _: (
        strength(0.35, description="relative change of the conductance of foaming oil"),
        positive("onset", 0.8, sd=0.6, grid=(0.3, 0.6, 1.0, 1.6)),
    ),
    law=lambda s: s.strength * rises(s.n, at=s.onset, power=4),
    says="At high speed the oil foams and takes less heat from the gears, which run hotter than the oil.",
    reference="a third less conductance; estimate, no published law for gears",
    experiment="hold a high load at medium and high speed and measure the gear against the oil",
    separate_by={"splash_starvation": "measure the loss: foam changes temperatures, starvation the loss as well"},
)

oil_housing_speed = Mechanism(
    name="oil_housing_speed",
    family=FAMILY_IN,
    kind="link_factor",
    places=("oil-housing",),
    parameters=lambda _: (
        strength(0.4, description="share of the conductance that depends on speed"),
        plain("exponent", 0.6, sd=0.2, lower=0.2, upper=1.5),
    ),
    law=lambda s: s.strength * (s.n**s.exponent - 1.0),
    says="The stirring of the oil carries its heat to the housing: slower gears leave the oil hotter than the wall.",
    reference="turbulent wall flow, h ~ v^0.6 to v^0.8; ISO/TR 14179-2 has a constant 200 W/(m^2 K)",
    experiment="compare oil and housing at low and high speed at about the same loss",
)

oil_mist = Mechanism(
    name="oil_mist",
    family=FAMILY_IN,
    kind="link_factor",
    places=("each oil-housing",),
    sign=0,
    parameters=lambda _: (
        strength(0.3, description="relative change of the conductance at the reference speed"),
        plain("exponent", 1.0, sd=0.4, lower=0.2, upper=2.0),
    ),
    law=lambda s: s.strength * s.n**s.exponent,
    says="Mist and inner air carry another amount of heat to one part of the housing ({place}).",
    reference="inner-air layer over the sump; no published law",
    experiment="measure all parts of the housing at low and high speed",
)

bearing_seat_contact = Mechanism(
    name="bearing_seat_contact",
    family=FAMILY_IN,
    kind="link_factor",
    places=("each bearings-housing", "bearings-housing"),
    sign=0,
    parameters=lambda _: (strength(0.3, description="relative change of the conductance"),),
    law=lambda s: s.strength,
    says="The bearing's seat passes another amount of heat into the housing than its ring would ({place}).",
    reference="fit and constriction: 0.3 to 1 of the ring's conductance; estimate",
    experiment="hold a high load and measure the bearing against the housing next to it",
)

motor_flange = Mechanism(
    name="motor_flange",
    family=FAMILY_OUT,
    kind="source",
    places=("each shafts", "each housing"),
    parameters=lambda scale: (
        strength(0.15 * scale.conductance, "W/K", "conductance to the motor"),
        positive("rise", 40.0, sd=0.6, unit="K"),
        positive("lag", 3600.0, sd=0.7, unit="s", grid=(1200.0, 3600.0)),
    ),
    states=(
        Memory(
            name="motor",  # its rise above the air: it starts at the temperature of the air, whatever that is
            rate=lambda s: (s.rise * s.m**2 - s.motor) / s.lag,
        ),
    ),
    law=lambda s: s.strength * (s.T_ambient + s.motor - s.T_here),
    says="The motor, generator or brake at the flange warms with its load and passes heat on ({place}).",
    reference="copper loss ~ current^2 ~ torque^2, one thermal time constant; estimate",
    experiment="measure the flange, or hold a high torque at standstill or creep speed",
)


def _radiant(T: Any, T_a: Any) -> Any:
    """Radiant heat transfer over emissivity and Stefan-Boltzmann's constant, [K^3]."""
    theta, theta_a = T + KELVIN, T_a + KELVIN
    return (theta**2 + theta_a**2) * (theta + theta_a)


MECHANISMS = (
    foundation_conduction, hot_neighbour, shaft_ends_to_air, radiation_error, air_cooling_change, aeration,
    oil_housing_speed, oil_mist, bearing_seat_contact, motor_flange,
)  # fmt: skip
