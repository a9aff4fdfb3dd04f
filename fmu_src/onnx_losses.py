"""The losses of one operating point from ONNX networks: :class:`models.surrogate.SurrogateLosses`, only faster.

The surrogate works on arrays of any shape. Inside an FMU there is one point at a time, three times per step, so all
gathering is planned once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from models.surrogate import SurrogateLosses
from models.types import Array


class OnnxLosses:
    """Losses of single operating points.

    Parameters
    ----------
    surrogate : SurrogateLosses
    run : mapping of network name to callable, (uses, inputs) -> (uses, outputs)
        What computes each network
    """

    def __init__(self, surrogate: SurrogateLosses, run: Mapping[str, Callable[[Array], Array]]) -> None:
        self._surrogate = surrogate
        self.temperature_nodes = surrogate.temperature_nodes
        self.speed_bounds = surrogate.speed_bounds
        self.torque_bounds = surrogate.torque_bounds
        self.temperature_bounds = surrogate.temperature_bounds
        column = {name: i for i, name in enumerate(("speed", "torque", *surrogate.temperature_nodes))}
        place = {name: i for i, name in enumerate(surrogate.components)}
        self._plan = []
        for network in surrogate.networks:
            uses = [use for use in surrogate.uses if use.network == network.name]
            sources = np.array([[column[source] for source in use.sources] for use in uses])
            factors = np.array([use.factors for use in uses])
            goals = np.array([[place[name] for name in use.components] for use in uses])
            self._plan.append((run[network.name], sources, factors, goals))
        self._driven = np.array([name in surrogate.torque_driven for name in surrogate.components])
        self._last: tuple[bytes, Array] = (b"", np.zeros(0))

    def power(self, speed: float, torque: float, temperatures: Array) -> Array:
        """Loss of every component [W], shape (components,), at speed [1/min], torque [N m] and temperatures [degC]."""
        point = np.empty(2 + len(temperatures))
        point[0], point[1], point[2:] = abs(speed), abs(torque), temperatures
        key = point.tobytes()
        if key == self._last[0]:  # outputs are read where the next step begins
            return self._last[1]
        losses = np.empty(len(self._driven))
        for run, sources, factors, goals in self._plan:
            losses[goals] = run(point[sources] * factors)
        if point[0] < self.speed_bounds[0]:
            losses *= point[0] / self.speed_bounds[0]
        if point[1] < self.torque_bounds[0]:
            losses[self._driven] *= point[1] / self.torque_bounds[0]
        self._last = key, losses
        return losses

    def domain_distance(self, speed: float, torque: float, temperatures: Array) -> Any:
        """As :meth:`models.surrogate.SurrogateLosses.domain_distance`."""
        return self._surrogate.domain_distance(speed, torque, temperatures)
