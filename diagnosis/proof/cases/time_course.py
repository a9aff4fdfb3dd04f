"""The course of an effect over time: always, or from a date on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.base.types import Array

Form = Literal["step", "ramp", "from_to"]
FORMS: tuple[Form, ...] = ("step", "ramp", "from_to")


@dataclass(frozen=True, kw_only=True)
class TimeCourse:
    """How much of an effect acts at a time.

    Attributes
    ----------
    kind : str
        ``always``; ``step``: from `begins` on; ``ramp``: growing from `begins` to `ends` and staying; ``from_to``:
        between the two only
    begins, ends : float
        In the zoo since the first row of the first recording of the session, [h]; of an injection since the first row
        of the recording, [s]
    """

    kind: Literal["always"] | Form = "always"
    begins: float = -math.inf
    ends: float = math.inf

    def share(self, time: Array) -> Array:
        """Share of the effect that acts, 0 to 1.

        Parameters
        ----------
        time : Array, shape (...)
            In the unit of `begins`
        """
        if self.kind == "always":
            return np.ones_like(time)
        if self.kind == "ramp":
            return np.asarray(np.clip((time - self.begins) / (self.ends - self.begins), 0.0, 1.0))
        return np.asarray((time >= self.begins) & ((time < self.ends) | (self.kind == "step")), dtype=float)


ALWAYS = TimeCourse()
