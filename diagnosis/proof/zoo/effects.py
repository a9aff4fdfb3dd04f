"""Effects that are concealed in a plant of the zoo: changes of given form and strength, always or at a date.

The law of an effect is linear in its strength, which has a unit and a greatest value that a real machine could show.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from diagnosis.proof.cases.time_course import ALWAYS, Course
from diagnosis.proof.zoo.faults import Fault
from diagnosis.proof.zoo.setting import Act, Changed, Setting
from diagnosis.proof.zoo.structure import Change, Law

UNITS = {"source": "W", "link": "W/K"}  # of a strength by the kind of the effect; of others 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Draft:
    """An effect as its maker draws it.

    Attributes
    ----------
    act : Act
        At a strength of 1, without its course in time
    law : str
        In words and symbols; ``a`` is the strength
    cap : float
        Greatest strength that is physical
    unit : str
        Of the strength; of a draft empty if it is that of its kind, see :data:`UNITS`
    parameters : mapping of str to float
        What was drawn for this specimen
    """

    act: Act = field(default_factory=Act)
    law: str
    cap: float
    unit: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)


def draft(act: Act, law: str, cap: float, unit: str = "", /, **parameters: float) -> Draft:
    """Draft of what was drawn."""
    return Draft(act=act, law=law, cap=cap, unit=unit, parameters=parameters)


Draw = Callable[[Setting, np.random.Generator], Draft]


@dataclass(frozen=True, kw_only=True)
class Maker:
    """Kind of effect.

    Attributes
    ----------
    family, kind : str
        As in the catalogue: kind is ``source``, ``link``, ``loss_factor``, ``link_factor``, ``signal`` ...
    draw : callable
        Of the setting and a random generator: the draft. Raises UnfitError if the plant lacks what it needs.
    """

    family: str
    kind: str
    draw: Draw


def makes(kind: str, family: str, *, table: dict[str, Maker]) -> Callable[[Draw], Draw]:
    """Enter the decorated function into a table of makers, under its own name."""

    def enter(draw: Draw) -> Draw:
        table[draw.__name__] = Maker(family=family, kind=kind, draw=draw)
        return draw

    return enter


@dataclass(frozen=True, kw_only=True, eq=False)
class ZooEffect(Draft):
    """One concealed effect of one plant.

    Attributes
    ----------
    catalogue : str or None
        Mechanism of the catalogue that it is a form of
    fault : Fault or None
        Of measurement, at its strength
    least : float
        Least strength that stands out of ordinary errors of instruments
    """

    name: str
    catalogue: str | None
    family: str
    kind: str
    fault: Fault | None = None
    least: float = 0.0
    strength: float = 1.0
    course: Course = ALWAYS

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Changes of the plant at this strength and in the course of time."""
        return tuple(
            replace(change, law=_in_time(change.law, self.strength, self.course)) for change in self.act.changes
        )

    @property
    def changed(self) -> tuple[Changed, ...]:
        """Things that it changed, by the names of the nominal model."""
        if self.fault is None:
            return self.act.changed
        return tuple(
            Changed(what=self.fault.what, of=name, nodes=self.fault.nodes, sign=self.fault.direction)
            for name in self.fault.channels
        )

    @property
    def nodes(self) -> tuple[str, ...]:
        """Nominal nodes that it concerns, each once."""
        return tuple(dict.fromkeys(node for one in self.changed for node in one.nodes))

    def with_strength(self, strength: float) -> ZooEffect:
        """Effect with another strength."""
        fault = None if self.fault is None else replace(self.fault, strength=strength)
        return replace(self, strength=strength, fault=fault)


def made(
    name: str, maker: Maker, setting: Setting, rng: np.random.Generator, *, catalogue: str | None, course: Course
) -> ZooEffect:
    """Draw an effect for a plant; its strength is still 1.

    Raises
    ------
    UnfitError
        If the plant lacks what it needs.
    """
    drawn = maker.draw(setting, rng)
    facts = {**vars(drawn), "unit": drawn.unit or UNITS.get(maker.kind, "1")}
    return ZooEffect(**facts, name=name, catalogue=catalogue, family=maker.family, kind=maker.kind, course=course)


def _in_time(law: Law, strength: float, course: Course) -> Law:
    if course.kind == "always":
        return lambda m: strength * law(m)
    return lambda m: strength * course.share(m.hours) * law(m)
