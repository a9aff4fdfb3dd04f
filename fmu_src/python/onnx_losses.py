"""The surrogate for one operating point at a time, as an FMU needs it: the last result is kept."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from models.base.types import Array
from models.portable.surrogate import SurrogateLosses


class OnnxLosses(SurrogateLosses):
    """A surrogate that keeps the losses of the last operating point: a step begins at the outputs of the last one."""

    @cached_property
    def _last(self) -> list[Any]:
        return [None, None]

    def power(self, speed: Any, torque: Any, temperatures: Any) -> Array:
        """Losses [W], shape (components,), at one operating point: speed and torque numbers, temperatures (nodes,)."""
        point = (float(speed), float(torque), temperatures.tobytes())
        last = self._last
        if point != last[0]:
            last[:] = point, super().power(speed, torque, temperatures)
        losses: Array = last[1]
        return losses
