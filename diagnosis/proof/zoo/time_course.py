"""The course of an effect over the hours of a session: always, or from a date on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.base.types import Array


@dataclass(frozen=True, kw_only=True)
class Course:
    """How much of an effect acts at a time.

    Attributes
    ----------
    kind : str
        ``always``; ``step``: from `from_h` on; ``ramp``: growing from `from_h` to `to_h` and staying; ``from_to``:
        between the two only
    from_h, to_h : float
        Since the first row of the first recording of the session, [h]
    """

    kind: Literal["always", "step", "ramp", "from_to"] = "always"
    from_h: float = -math.inf
    to_h: float = math.inf

    def share(self, hours: Array) -> Array:
        """Share of the effect that acts, 0 to 1.

        Parameters
        ----------
        hours : Array, shape (...)
            Since the first row of the first recording, [h]
        """
        if self.kind == "always":
            return np.ones_like(hours)
        if self.kind == "ramp":
            return np.asarray(np.clip((hours - self.from_h) / (self.to_h - self.from_h), 0.0, 1.0))
        return np.asarray((hours >= self.from_h) & (hours < self.to_h), dtype=float)


ALWAYS = Course()
