"""A change that may be injected, with several sizes to choose from, and its course in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from diagnosis.proof.cases.time_course import FORMS, Form, TimeCourse
from models.base.types import Array

EARLIEST, LATEST, SHORTEST = 0.25, 0.7, 0.1  # of the recording's length: when a change begins, how long it takes
SIZES = 24  # that are tried
SMALLEST = 1.0 / 300.0  # of the largest size


def draw_course(
    duration_s: float, rng: np.random.Generator, *, forms: Sequence[Form] = FORMS, date_s: float | None = None,
    longest_s: float = np.inf,
) -> TimeCourse:  # fmt: skip
    """Draw a course over the seconds of a recording.

    Parameters
    ----------
    duration_s : float
        Length of the recording
    forms : sequence of str
        To choose from
    date_s : float or None
        When it begins; by default between a quarter and 0.7 of the recording
    longest_s : float
        Of a ``from_to``
    """
    form = forms[int(rng.integers(len(forms)))]
    share, length = rng.uniform(EARLIEST, LATEST), rng.uniform(0.0, 1.0)
    begin = share * duration_s if date_s is None else date_s
    room = duration_s - begin
    shortest = min(SHORTEST * duration_s, 0.5 * room, 0.5 * longest_s)
    end = begin + shortest + length * (min(0.9 * room, longest_s) - shortest)
    return TimeCourse(kind=form, begins=begin, ends=duration_s if form == "step" else end)


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """A change in B sizes.

    Attributes
    ----------
    what : str
        ``loss``, ``link``, ``capacity``, ``heat``, ``sensor``, ``input`` or ``clock``
    of : str
        Loss, link, node, channel or input
    sizes : Array, shape (B,)
    columns : mapping of quantity to Array, shape (B, rows)
        Added to the columns, in the unit inside
    K : mapping of channel to Array, shape (B, rows)
        Change of a temperature, [K]
    heat : mapping of node to Array, shape (B, blocks)
        Heat that the change itself makes, [W]
    approximate : str
        Why the injection is not exact; empty if it is
    facts : mapping
        Further facts for the truth
    size_K : Array, shape (B,), or None
        By which the size is chosen, if that is not the largest of `K`, [K]
    kind : str
        Its name in the table of kinds
    """

    what: str
    of: str
    nodes: tuple[str, ...]
    course: TimeCourse
    sizes: Array
    unit: str
    columns: Mapping[str, Array]
    K: Mapping[str, Array]
    heat: Mapping[str, Array] = field(default_factory=dict)
    approximate: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)
    size_K: Array | None = None
    kind: str = ""

    @property
    def largest_K(self) -> Array:
        """Largest change of a temperature, by which the size is chosen, shape (B,), [K]."""
        if self.size_K is not None:
            return self.size_K
        largest = [np.nanmax(np.abs(values), axis=-1, initial=0.0) for values in self.K.values()]
        return np.asarray(np.max(largest, axis=0))


def ladder(low: float, high: float, rng: np.random.Generator) -> Array:
    """Return sizes up to `low` < 0 or `high` > 0, the sign drawn, shape (B,)."""
    cap = (low, high)[int(rng.integers(2))] if low < 0.0 < high else low or high
    return cap * np.geomspace(SMALLEST, 1.0, SIZES)


def choose_size(largest: Array, bounds: tuple[float, float], rng: np.random.Generator) -> int:
    """Choose the size whose largest change is log-uniform between the bounds; the largest size if all are below.

    Parameters
    ----------
    largest : Array, shape (B,)
        Largest change of a temperature per size, [K]
    bounds : (float, float)
        [K]
    """
    share, reach = rng.uniform(), float(largest.max())
    low, high = bounds
    inside = (largest >= low) & (largest <= high)
    if not inside.any():
        return len(largest) - 1 if reach < low else int(np.argmin(largest))
    target = low * (min(high, reach) / low) ** share
    return int(np.argmin(np.where(inside, np.abs(np.log(np.maximum(largest, 1e-12) / target)), np.inf)))
