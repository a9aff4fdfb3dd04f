"""Machines without recorded speed or torque: the inference gets them as inputs all the same.

Its grid, loss tangents and summaries have columns of speed and torque. A machine without losses gets zeros; of one
whose torque follows from a power, the torque is calculated, and the factor on the efficiency is the torque's gain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from diagnosis.recordings.recording import Recording
from models.base.types import Array
from models.network.laws import Parameter, symbol
from models.quantities.quantities import usual_inputs
from models.simulation.thermal_network import ThermalNetwork

EFFICIENCY = "efficiency"
SHAFT = ("speed", "torque")


def with_shaft(network: ThermalNetwork) -> ThermalNetwork:
    """Return a network with speed and torque as its first two inputs."""
    if tuple(network.inputs)[:2] == SHAFT:
        return network
    first = usual_inputs(speed=0.0, torque=0.0)
    kept = tuple(p for p in network.parameters if not (network.derived and p.name == EFFICIENCY))
    return replace(network, inputs=first | dict(network.inputs), derived={}, parameters=kept)


def shafts(recordings: Sequence[Recording], network: ThermalNetwork) -> tuple[Recording, ...]:
    """Return recordings with speed [1/min] and torque [N m] of every row: as recorded, derived, or 0."""
    return tuple(_with_shaft(recording, network) for recording in recordings)


def _with_shaft(recording: Recording, network: ThermalNetwork) -> Recording:
    given = dict(recording.inputs)
    zero = np.zeros(len(recording.time))
    speed = given.pop("speed", zero)
    torque = _torque(network, recording.inputs, zero) if network.derived else given.pop("torque", zero)
    return replace(recording, inputs={"speed": speed, "torque": torque} | given)


def _torque(network: ThermalNetwork, inputs: Mapping[str, Array], zero: Array) -> Array:
    law = network.derived["torque"].xreplace({symbol(p.name): sp.Float(p.start) for p in network.parameters})
    names = sorted(s.name for s in law.free_symbols)
    return np.asarray(zero + sp.lambdify(names, law, "numpy")(*(inputs[name] for name in names)))


def torque_gain(network: ThermalNetwork) -> Parameter | None:
    """Return the factor on the efficiency, which a recording calibrates as the gain of the torque; None without one."""
    found = [p for p in network.parameters if network.derived and p.name == EFFICIENCY]
    return found[0] if found else None
