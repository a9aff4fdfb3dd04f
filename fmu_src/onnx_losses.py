"""The surrogate for one operating point at a time, as an FMU needs it: the same result, planned and remembered."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from models.surrogate import Evaluator, SurrogateLosses
from models.types import Array


class OnnxLosses(SurrogateLosses):
    """A surrogate whose evaluators (see :meth:`~models.surrogate.SurrogateLosses.with_evaluators`) cost the most.

    Which inputs go to which network is planned once, and the last operating point is remembered: a step begins where
    the outputs of the one before were read.
    """

    @cached_property
    def _evaluate(self) -> Evaluator:
        evaluators = self.evaluators or {}
        inputs = np.cumsum([0, *(len(n.inputs) for n in self._used_networks)])
        outputs = np.cumsum([0, *(len(n.outputs) for n in self._used_networks)])
        plan = []
        for network in self.networks:
            mine = [i for i, used in enumerate(self._used_networks) if used is network]
            taken = np.array([np.arange(inputs[i], inputs[i + 1]) for i in mine])
            given = np.array([np.arange(outputs[i], outputs[i + 1]) for i in mine])
            plan.append((evaluators[network.name], taken, given))

        def evaluate(row: Array) -> Array:
            result = np.empty(outputs[-1])
            for run, taken, given in plan:
                result[given] = run(row[taken])
            return result

        return evaluate

    @cached_property
    def _remembered(self) -> list[Any]:
        return [None, None]

    def power(self, speed: Any, torque: Any, temperatures: Any) -> Array:
        """Losses [W], shape (components,), at one operating point: speed and torque numbers, temperatures (nodes,)."""
        point = (float(speed), float(torque), temperatures.tobytes())
        remembered = self._remembered
        if point != remembered[0]:
            remembered[:] = point, super().power(speed, torque, temperatures)
        losses: Array = remembered[1]
        return losses
