"""Effects that are concealed in a plant of the zoo: changes of given form and strength, always or at a date.

The law of an effect is linear in its strength, which has a unit and a greatest value that a real machine could show.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps

import numpy as np

from diagnosis.proof.cases.time_course import ALWAYS, TimeCourse
from diagnosis.proof.zoo.faults import Fault
from diagnosis.proof.zoo.setting import Act, Changed, EffectSetting
from diagnosis.proof.zoo.structure import Law, ZooChange

UNITS = {"source": "W", "link": "W/K"}  # of a strength by the kind of the effect; of others 1


@dataclass(frozen=True, kw_only=True, eq=False)
class ZooEffect:
    """One concealed effect of one plant.

    Attributes
    ----------
    act : Act
        At a strength of 1, without its course in time
    law : str
        In words and symbols; ``a`` is the strength
    cap, least : float
        Greatest strength that is physical, and the least that stands out of ordinary errors of instruments
    unit : str
        Of the strength
    parameters : mapping of str to float
        What was drawn for this specimen
    family, kind : str
        As in the catalogue: kind is ``source``, ``link``, ``loss_factor``, ``link_factor``, ``signal`` ...
    catalogue : str or None
        Mechanism of the catalogue that it is a form of
    fault : Fault or None
        Of measurement, at its strength
    """

    name: str
    catalogue: str | None
    family: str
    kind: str
    law: str
    unit: str
    cap: float
    least: float = 0.0
    act: Act = field(default_factory=Act)
    parameters: Mapping[str, float] = field(default_factory=dict)
    fault: Fault | None = None
    strength: float = 1.0
    course: TimeCourse = ALWAYS

    @cached_property
    def changes(self) -> tuple[ZooChange, ...]:
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


Maker = Callable[[EffectSetting, np.random.Generator], ZooEffect]  # UnfitError if the plant lacks what it needs


def draft(act: Act, law: str, cap: float, unit: str = "", /, **parameters: float) -> ZooEffect:
    """An effect as it is drawn; :func:`makes` adds its name, and the unit of its kind if none is given."""
    return ZooEffect(
        name="", catalogue=None, family="", kind="", law=law, unit=unit, cap=cap, act=act, parameters=parameters
    )


def makes(kind: str, family: str, *, table: dict[str, Maker], in_catalogue: bool = False) -> Callable[[Maker], Maker]:
    """Enter the decorated function into a table of makers, under its own name, which its effects get."""

    def enter(draw: Maker) -> Maker:
        name = draw.__name__

        @wraps(draw)
        def make(setting: EffectSetting, rng: np.random.Generator) -> ZooEffect:
            drawn, catalogue = draw(setting, rng), name if in_catalogue else None
            unit = drawn.unit or UNITS.get(kind, "1")
            return replace(drawn, name=name, catalogue=catalogue, family=family, kind=kind, unit=unit)

        table[name] = make
        return make

    return enter


def _in_time(law: Law, strength: float, course: TimeCourse) -> Law:
    if course.kind == "always":
        return lambda m: strength * law(m)
    return lambda m: strength * course.share(m.hours) * law(m)
