"""Faults of sensors, clocks and of the instruments that record the inputs; the gearbox itself has none of them."""

from __future__ import annotations

from collections.abc import Callable

from models.mechanisms.forms import plain, share, strength
from models.mechanisms.mechanism import Mechanism, Parameters
from models.network.laws import LawLike, Parameter
from models.terms.term import Form

FAMILY = "measurement"
DAY_S = 86400.0
EXCHANGE = "exchange the sensor with another one and repeat: a fault of the sensor goes with it"
EQUAL_TEMPERATURE = "hold a second thermometer next to each, or let all rest for a night: all must agree then"


def _sensor(
    name: str, form: Form, *, places: str, parameters: Parameters, law: LawLike, says: str, reference: str,
    experiment: str = EXCHANGE, signed: bool = True,
) -> Mechanism:  # fmt: skip
    return Mechanism(
        name=name, family=FAMILY, kind="sensor", form=form, of_measurement=True, places=(places,),
        sign=0 if signed else 1, parameters=parameters, law=law, says=says, reference=reference, experiment=experiment,
    )  # fmt: skip


def _input(
    name: str, place: str, *, size: Callable[..., Parameter], law: LawLike, says: str, reference: str, experiment: str,
    signed: bool = True,
) -> Mechanism:  # fmt: skip
    return Mechanism(
        name=name, family=FAMILY, kind="signal", of_measurement=True, places=(place,), sign=0 if signed else -1,
        parameters=lambda scale: (size(scale),), law=law, says=says, reference=reference, experiment=experiment,
    )  # fmt: skip


sensor_bias = _sensor(
    "sensor_bias",
    "shift",
    places="each thermometer",
    parameters=lambda _: (strength(2.0, "K", "reading less truth"),),
    law=lambda s: s.strength,
    says="The sensor at {place} reads too much or too little by a constant amount.",
    reference="class of the thermocouple and its amplifier: 1 to 2 K",
    experiment=EQUAL_TEMPERATURE,
)

sensor_drift = _sensor(
    "sensor_drift",
    "shift",
    places="each thermometer",
    parameters=lambda _: (strength(3.0, "K", "reading less truth after the reference duration"),),
    law=lambda s: s.strength * s.x,
    says="The reading of the sensor at {place} drifts away in the course of the recording.",
    reference="ageing thermocouple or loosening contact",
    experiment=EQUAL_TEMPERATURE + ", before and after a test",
)

sensor_gain = _sensor(
    "sensor_gain",
    "shift",
    places="each thermometer",
    parameters=lambda _: (strength(0.04, description="error per kelvin above ambient"),),
    law=lambda s: s.strength * (s.T_here - s.T_ambient),
    says="The sensor at {place} shows a wrong share of the rise above ambient: heat flows along its leads, or its gain "
    "is off.",
    reference="stem conduction of a thermocouple: 1 to 5 % of the rise; estimate",
    experiment="insulate the leads and repeat: the error changes",
)

sensor_lag = _sensor(
    "sensor_lag",
    "lag",
    places="each thermometer",
    parameters=lambda _: (strength(60.0, "s", "time constant, on top of the usual or stated one"),),
    law=lambda s: s.strength,
    says="The sensor at {place} answers late: it has bad contact or a heavy sheath.",
    reference="first order, 30 to 120 s",
    experiment="step the torque and compare with a fast sensor next to it",
    signed=False,
)

sensor_stuck = _sensor(
    "sensor_stuck",
    "stuck",
    places="each sensor",
    parameters=lambda _: (share("share of the reading that is held"),),
    law=lambda s: s.strength,
    says="The reading of {place} stands still.",
    reference="frozen channel of a logger",
    experiment="restart the logger",
    signed=False,
)

swapped_channels = _sensor(
    "swapped_channels",
    "swapped",
    places="pair",
    parameters=lambda _: (share("1: exchanged"),),
    law=lambda s: s.strength,
    says="Two channels are exchanged: {place}.",
    reference="wiring or naming",
    experiment="warm one sensor by hand and see which channel moves",
    signed=False,
)

clock_offset = _sensor(
    "clock_offset",
    "clock",
    places="clock",
    # Loggers of rows minutes apart are set by hand to the hour, with summer time or without.
    parameters=lambda scale: (strength(max(60.0, 3.0 * scale.interval), "s", "readings late by"),),
    law=lambda s: s.strength,
    says="The clocks of inputs and temperatures differ.",
    reference="two loggers, started by hand",
    experiment="step the speed and look where temperatures begin to move; record one signal with both loggers",
)

clock_drift = _sensor(
    "clock_drift",
    "clock",
    places="clock",
    parameters=lambda scale: (strength(max(20.0, 3.0 * scale.interval), "s/d", "further delay of the readings"),),
    law=lambda s: s.strength * s.time / DAY_S,
    says="The clock of the temperatures runs slow or fast against that of the inputs.",
    reference="quartz of a logger: 2 s a day at 25 ppm; some are ten times worse",
    experiment="step the speed at the beginning and at the end, and look where temperatures begin to move",
)

torque_offset = _input(
    "torque_offset",
    "torque",
    size=lambda scale: strength(0.05 * scale.torque, "N m", "true less recorded"),
    law=lambda s: s.strength,
    says="The torque meter's zero is off by a constant amount.",
    reference="zero drift of a strain gauge shaft with temperature",
    experiment="read the torque of the uncoupled shaft, cold and hot",
)

torque_gain = _input(
    "torque_gain",
    "torque",
    size=lambda _: strength(0.05, description="true over recorded, less 1"),
    law=lambda s: s.strength * s.torque,
    says="The torque meter shows a wrong share of the torque.",
    reference="calibration: 0.1 to 2 %; gross errors by a wrong range",
    experiment="calibrate with a lever and weights",
)

speed_gain = _input(
    "speed_gain",
    "speed",
    size=lambda _: strength(0.03, description="true over recorded, less 1"),
    law=lambda s: s.strength * s.speed,
    says="The recorded speed is a wrong share of the true one.",
    reference="wrong pulse count, slip of a belt-driven tachometer",
    experiment="compare with a hand tachometer",
)

ambient_probe_offset = _input(
    "ambient_probe_offset",
    "T_ambient",
    size=lambda _: strength(2.0, "K", "true less recorded"),
    law=lambda s: s.strength,
    says="The ambient probe reads too much or too little by a constant amount, or hangs where the air is another.",
    reference="stratified air in a test cell: 1 to 3 K",
    experiment=EQUAL_TEMPERATURE,
)

ambient_follows_outdoor = Mechanism(
    name="ambient_follows_outdoor",
    family=FAMILY,
    kind="signal",
    of_measurement=True,
    places=("T_ambient",),
    parameters=lambda _: (
        strength(0.5, description="1: the air at the gearbox follows the outdoor air, 0: it is as recorded"),
        plain("above", 8.0, sd=8.0, lower=-20.0, upper=40.0, unit="K", grid=(2.0, 8.0, 14.0)),
    ),
    law=lambda s: s.strength * (s.T_outdoor + s.above - s.T_ambient),
    says="The air at the gearbox was not recorded, or elsewhere: it goes with the outdoor air, some kelvin above it.",
    reference="ventilated enclosure: its air is the outdoor air and a rise; the constant rise is ours",
    experiment="hang a probe next to the gearbox for some days",
)

ambient_probe_heated = _input(
    "ambient_probe_heated",
    "T_ambient",
    size=lambda _: strength(0.06, description="true less recorded per kelvin of the housing above it"),
    law=lambda s: s.strength * (s.T_housing - s.T_ambient),
    says="The gearbox warms its own ambient probe: the hotter it is, the more the recorded ambient is too high.",
    reference="plume or radiation of the housing: 3 to 10 % of its rise; estimate",
    experiment="hang a second probe a metre away, shielded",
    signed=False,
)

MECHANISMS = (
    sensor_bias, sensor_drift, sensor_gain, sensor_lag, sensor_stuck, swapped_channels, clock_offset,
    clock_drift, torque_offset, torque_gain, speed_gain, ambient_probe_offset, ambient_probe_heated,
    ambient_follows_outdoor,
)  # fmt: skip
