"""Changes that may be injected, a row per kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from diagnosis.proof.cases.time_course import FORMS, Form
from diagnosis.proof.injection.instrument_faults import (
    bias,
    clock,
    gain,
    input_gain,
    input_offset,
    lag,
    stuck,
    swapped,
)
from diagnosis.proof.injection.machine_changes import capacity, heat, link_factor, loss_factor, new_link, thermostat
from diagnosis.proof.injection.real_recording import RealRecording
from diagnosis.proof.injection.trial import Trial
from models.simulation.thermal_network import ThermalNetwork


@dataclass(frozen=True)
class Kind:
    """A kind of change.

    Attributes
    ----------
    group : str
        What it changes
    make : callable
        Of the recording (``instrument``) or the calibrated model (others), a place, a course and a random generator
    noun : str
        Where it is, for people
    places : callable
        Of the recording and the nominal network: where it can be
    law : str
        In words
    forms : tuple of str
        Courses that it can have
    """

    group: Literal["machine", "instrument", "input"]
    make: Callable[..., Trial]
    noun: str
    places: Callable[[RealRecording, ThermalNetwork], list[str]]
    law: str
    forms: tuple[Form, ...] = FORMS


def _nodes(_: RealRecording, network: ThermalNetwork) -> list[str]:
    return [part.name for part in network.parts]


def _to_surroundings(_: RealRecording, network: ThermalNetwork) -> list[str]:
    return [f"{part.name}-{boundary}" for part in network.parts for boundary in network.boundaries]


def _without_a_link(real: RealRecording, network: ThermalNetwork) -> list[str]:
    parts, known = _nodes(real, network), {frozenset(link.nodes) for link in network.links}
    pairs = [(a, b) for a in parts for b in network.boundaries]
    pairs += [(a, b) for i, a in enumerate(parts) for b in parts[i + 1 :]]
    return [f"{a}-{b}" for a, b in pairs if frozenset((a, b)) not in known]


def _sensors(real: RealRecording, _: ThermalNetwork) -> list[str]:
    """Sensors whose readings move."""
    return [name for name, values in real.channels.items() if np.nanmax(values) > np.nanmin(values)]


def _one_of_two(real: RealRecording, network: ThermalNetwork) -> list[str]:
    names = _sensors(real, network)
    return names if len(names) > 1 else []


def _all_sensors(real: RealRecording, network: ThermalNetwork) -> list[str]:
    return ["temperatures"] if _sensors(real, network) else []


def _no_temperatures(real: RealRecording, network: ThermalNetwork) -> list[str]:
    return [name for name in real.inputs if not network.inputs[name].quantity.is_temperature]


KINDS: Mapping[str, Kind] = {
    "loss_factor": Kind("machine", loss_factor, "loss or heat source",
                        lambda _, network: [source.name for source in network.sources],
                        "a loss or heat source becomes larger or smaller, -60 % to +150 %"),
    "link_factor": Kind("machine", link_factor, "link", lambda _, network: [link.name for link in network.links],
                        "a heat path conducts more or less, -60 % to +150 %"),
    "new_link": Kind("machine", new_link, "pair of nodes without a link", _without_a_link,
                     "a further heat path between two nodes, or to the surroundings"),
    "thermostat": Kind("machine", thermostat, "pair of node and boundary", _to_surroundings,
                       "a cooler with a thermostat valve"),
    "heat": Kind("machine", heat, "node", _nodes, "heat into a node or out of it, steady or with the speed"),
    "capacity": Kind("machine", capacity, "node", _nodes, "a heat capacity changes, -50 % to +100 %", ("step",)),
    "bias": Kind("instrument", bias, "sensor", _sensors, "a sensor shows too much or too little", ("step", "from_to")),
    "gain": Kind("instrument", gain, "sensor", _sensors, "a sensor's scale is wrong"),
    "drift": Kind("instrument", bias, "sensor", _sensors, "a sensor's bias grows", ("ramp",)),
    "lag": Kind("instrument", lag, "sensor", _sensors, "a sensor follows slowly", ("step", "from_to")),
    "stuck": Kind("instrument", stuck, "sensor", _sensors, "a sensor hangs for hours", ("from_to",)),
    "swapped": Kind("instrument", swapped, "sensor", _one_of_two, "two sensors are recorded in each other's columns",
                    ("step", "from_to")),
    "clock": Kind("instrument", clock, "sensor", _all_sensors, "temperatures come late against the inputs", ("step",)),
    "input_offset": Kind("input", input_offset, "input", lambda real, _: list(real.inputs),
                         "a recorded input is off by a constant"),
    "input_gain": Kind("input", input_gain, "input", _no_temperatures, "a recorded input is off by a factor"),
}  # fmt: skip
