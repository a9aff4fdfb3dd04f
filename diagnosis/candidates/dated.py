"""Changes of a machine over the time that its recordings share: at a date, over hours, or for a while.

Any law may change: one of the catalogue, a loss, a link, a sensor, an input. The change is the law times a course in
time, ``strength * law * course(time + start - since)``; `start` is the start of the recording on the time axis that all
recordings share, so a step is off in earlier recordings and on in later ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from diagnosis.candidates.hypotheses import (
    CARRIED_ON,
    EACH_DAY,
    HOURS,
    STEP,
    WHILE,
    Hypothesis,
    hypothesis_of,
    law_of,
)
from models.base.types import Array
from models.formulas.extremes import Max, Min
from models.mechanisms import Placed
from models.mechanisms.forms import EDGE_S, MOMENTS, plain, positive, steps
from models.network.laws import Parameter, symbol

HOUR_S = 3600.0
LINEAR_S, SETTLING_S = 20.0 * HOUR_S, 3.0 * HOUR_S  # of the courses over the hours
DATE_SD = 0.4  # of the time axis: nearly a uniform prior
RISES, LENGTHS = (3.0,), (1.5, 4.0)  # of a slow step and of a change for a while, in distances between dates
HOURS_OF_DAY = 24.0
NOON, LENGTH = "noon", "length"  # shapes of a law that comes again at one hour: when it is at its height, how long
NOONS_H, LENGTHS_S = tuple(np.arange(0.0, HOURS_OF_DAY, 3.0)), (1.0 * HOUR_S, 2.5 * HOUR_S)


@dataclass(frozen=True, kw_only=True, eq=False)
class Axis:
    """The time axis that recordings share.

    Attributes
    ----------
    dates : Array, shape (n,)
        At which something may change, [s]
    end : float
        End of the last recording learnt from, [s]
    until : float
        End of the last of all, held-out ones too, [s]; what grows is not known to go on after it
    edge_s : float
        Shortest time that a change takes, [s]
    hour : float or None
        Hour of the day (UTC) at which the axis begins; None: the recordings have no dates
    """

    dates: Array
    end: float
    until: float
    edge_s: float = 2.0 * EDGE_S
    hour: float | None = None

    @property
    def distance(self) -> float:
        """Typical distance of dates, [s]."""
        return self.end / max(len(self.dates), 1)

    def clock(self, label: str) -> Parameter:
        """Start of a recording on the axis, [s].

        Its value for a machine that is not one of the recordings' is the end of the last one: what lasted until then
        goes on.
        """
        return Parameter(name=f"{label}_start", unit="s", start=self.end, sd=0.0, lower=0.0, upper=10.0 * self.end,
                         log=False, description="start of the recording on the axis that all share")  # fmt: skip

    def moment(self, name: str) -> Parameter:
        """A date as a parameter, [s]: not so late that next to nothing is recorded after it."""
        latest = 0.5 * (self.end + float(self.dates.max(initial=0.0)))
        return Parameter(name=name, unit="s", start=0.5 * self.end, sd=DATE_SD * self.end, lower=-self.end,
                         upper=latest, log=False,
                         description="time since the first row of the first recording")  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class DatedCourse:
    """A course in time that a law is multiplied by.

    Attributes
    ----------
    ending : str
        Of the name of a law that has it
    sentence : str
        Sentence that comes before the one of the law
    parameters : tuple of Parameter
        By local names
    variants : Array, shape (V, parameters)
    law : sympy.Expr
        Of the local parameters and ``now``, the time on the axis [s]
    """

    ending: str
    sentence: str
    parameters: tuple[Parameter, ...]
    variants: Array
    law: sp.Expr

    @cached_property
    def along(self) -> sp.Expr:
        """The law in a recording that begins at :data:`START`."""
        return self.law.xreplace({NOW: symbol("time") + symbol(START)})


NOW, START = symbol("now"), "start"


def step(axis: Axis, *, slow: bool = True) -> DatedCourse:
    """From a date on, at once or (if `slow` ones are tried) in some hours, and then constant."""
    since, rise = symbol("since"), symbol("within")
    rises = axis.distance * np.array(RISES)
    at_once, slowly = _products(axis.dates, [axis.edge_s]), _products([0.0, *axis.dates[::2]], rises)
    return DatedCourse(
        ending=STEP, sentence="From a date on",
        parameters=(axis.moment("since"), _span("within", axis.edge_s, rises[-1])),
        variants=np.concatenate([at_once, slowly]) if slow else at_once,
        law=Min(Max((NOW - since) / rise, 0), 1),
    )  # fmt: skip


def for_a_while(axis: Axis) -> DatedCourse:
    """From one date to another."""
    since, length = symbol("since"), symbol("lasting")
    lengths = axis.distance * np.array(LENGTHS)
    return DatedCourse(
        ending=WHILE, sentence="From one date to another",
        parameters=(axis.moment("since"), _span("lasting", *lengths)), variants=_products(axis.dates[::2], lengths),
        law=steps(NOW, at=since, width=0.5 * axis.edge_s) - steps(NOW, at=since + length, width=0.5 * axis.edge_s),
    )  # fmt: skip


def in_times(spans: Sequence[tuple[float, float]]) -> DatedCourse:
    """In given times alone.

    Parameters
    ----------
    spans : sequence of (float, float)
        Beginnings and ends on the time axis, [s]
    """
    times = ", ".join(f"{first / HOUR_S:.2f} to {last / HOUR_S:.2f} h" for first, last in spans)
    return DatedCourse(
        ending=WHILE, sentence=f"From {times} after the first row of the first recording",
        parameters=(), variants=np.empty((1, 0)), law=sp.Add(*(_between(first, last) for first, last in spans)),
    )  # fmt: skip


def in_one_of(spans: Sequence[tuple[float, float]]) -> DatedCourse:
    """In one of given times: in one recording, for what is set again with every file.

    Parameters
    ----------
    spans : sequence of (float, float)
        Beginnings and ends on the time axis, [s]
    """
    first, lasting = symbol("since"), symbol("lasting")
    variants = np.array([(begin, end - begin) for begin, end in spans])
    given = (
        Parameter(name=name, unit="s", start=start, sd=0.0, lower=0.0, upper=float(variants.max()), log=False)
        for name, start in zip(("since", "lasting"), variants[0].tolist(), strict=True)
    )
    return DatedCourse(
        ending=WHILE, sentence="In one recording", parameters=tuple(given), variants=variants,
        law=_between(first, first + lasting),
    )  # fmt: skip


def _between(first: float | sp.Expr, last: float | sp.Expr) -> sp.Expr:
    """1 from one moment to another, both included."""
    return sp.Piecewise((1, first <= NOW), (0, True)) - sp.Piecewise((1, last < NOW), (0, True))


def over_hours(axis: Axis) -> DatedCourse:
    """Slowly over the hours since the first row of the first recording: to the end of the last, or until it settles."""
    names = ("linear", "settling", "fading")
    linear, settling, fading = (symbol(name) for name in names)
    parameters = tuple(
        Parameter(name=name, start=0.0, sd=0.0, lower=0.0, upper=1.0, log=False) for name in names
    )  # fmt: skip
    decay = sp.exp(-NOW / SETTLING_S)
    return DatedCourse(
        ending=HOURS, sentence="Slowly over the hours", parameters=parameters, variants=np.eye(3),
        law=linear * Min(NOW, axis.until) / max(LINEAR_S, axis.end) + settling * (1 - decay) + fading * decay,
    )  # fmt: skip


def _span(name: str, low: float, high: float) -> Parameter:
    middle = float(np.sqrt(low * high))
    return Parameter(name=name, unit="s", start=middle, sd=max(0.5 * float(np.log(high / low)), 0.5), lower=0.5 * low,
                     upper=20.0 * high, log=True)  # fmt: skip


def _products(first: Iterable[float], second: Iterable[float]) -> Array:
    return np.array([(a, b) for a in first for b in second]).reshape(-1, 2)


def changing(
    placed: Placed, course: DatedCourse, axis: Axis, *, sd: float | None = None, every_shape: bool = False
) -> Hypothesis:
    """A law times a course in time.

    Parameters
    ----------
    sd : float, optional
        Prior of the strength; by default that of the law
    every_shape : bool
        Whether all grid points of its shape parameters are tried; otherwise they start from the middles of the grids

    Returns
    -------
    Hypothesis
        The last of its term's parameters is the clock
    """
    label = f"{placed.label}_{course.ending}"
    term, clock = _renamed(placed, label), axis.clock(label)
    strength, *shapes = term.parameters
    added = tuple(replace(p, name=f"{label}_{p.name}") for p in course.parameters)
    own = {symbol(p.name): symbol(f"{label}_{p.name}") for p in course.parameters}
    along = course.along.xreplace(own | {symbol(START): symbol(clock.name)})
    mechanism = placed.mechanism
    says = f"{course.sentence}: {mechanism.says[:1].lower()}{mechanism.says[1:]}"
    law = law_of(placed.name)
    name = f"{law}_{course.ending}"
    term = replace(
        term,
        mechanism=replace(mechanism, name=name, says=says),
        written={**term.written, "law": term.written["law"] * course.along},
        expression=term.expression * along,
        parameters=(replace(strength, sd=sd or strength.sd), *shapes, *added, clock),
    )
    grids = [p.grid or (p.start,) for p in shapes]
    tried = product(*grids) if every_shape else [tuple(grid[len(grid) // 2] for grid in grids)]
    rows = [[1.0, *shape, *variant, clock.start] for shape in tried for variant in course.variants.tolist()]
    return Hypothesis(name=name, place=placed.place, family=placed.family, term=term, law=law, variants=np.array(rows),
                      ending=course.ending, clock=clock.name,
                      date=next((p.name for p in added if p.name == f"{label}_since"), None))  # fmt: skip


def carried_on(placed: Placed, axis: Axis, *, ending: str = CARRIED_ON) -> Hypothesis:
    """A law of the time since the start of the first recording, instead of every recording.

    Its moments are looked for at the dates of the axis: within a recording's hours they would miss later recordings.

    Parameters
    ----------
    placed : Placed
        Without memories
    ending : str
        Of its label; a law that comes again every day has an hour of the day in place of a moment
    """
    label, dates = f"{placed.label}_{ending}", tuple(axis.dates.tolist())
    if ending == CARRIED_ON and dates:
        moments = {f"{placed.label}_{name}" for name in MOMENTS}
        placed = replace(placed, parameters=tuple(
            replace(axis.moment(p.name), grid=dates) if p.name in moments else p for p in placed.parameters
        ))  # fmt: skip
    term, clock, base = _renamed(placed, label), axis.clock(label), hypothesis_of(placed)
    now = {symbol("time"): symbol("time") + symbol(clock.name)}
    other = term.boundary_temperature
    written = {symbol("time"): symbol("time") + symbol(START)}
    term = replace(
        term, expression=term.expression.xreplace(now),
        boundary_temperature=None if other is None else other.xreplace(now),
        written={key: law.xreplace(written) for key, law in term.written.items()},
        parameters=(*term.parameters, clock),
    )  # fmt: skip
    variants = np.column_stack([base.variants, np.full(len(base.variants), clock.start)])
    begins = f"{label}_{MOMENTS[0]}"
    return replace(base, term=term, variants=variants, ending=ending, clock=clock.name,
                   date=begins if begins in {p.name for p in term.parameters} else None)  # fmt: skip


def comes_daily(placed: Placed) -> bool:
    """True if a law may come again every day at one hour."""
    return any(p.name == f"{placed.label}_{NOON}" for p in placed.parameters)


def each_day(placed: Placed, axis: Axis) -> Hypothesis:
    """A law that comes again every day, with the hour of the day in place of the time since the start.

    Parameters
    ----------
    placed : Placed
        With the shapes `NOON` and `LENGTH`, and without memories
    axis : Axis
        With the hour of the day at which it begins
    """

    def daily(law: sp.Expr, noon: sp.Symbol) -> sp.Expr:
        now = symbol("time") / HOUR_S + axis.hour
        away = sp.Mod(now - noon + HOURS_OF_DAY / 2.0, HOURS_OF_DAY) - HOURS_OF_DAY / 2.0
        return law.xreplace({symbol("time"): HOUR_S * (noon + away), noon: HOUR_S * noon})

    noon, length, mechanism = f"{placed.label}_{NOON}", f"{placed.label}_{LENGTH}", placed.mechanism
    of_day = {
        noon: plain(NOON, HOURS_OF_DAY / 2.0, sd=HOURS_OF_DAY / 3.0, lower=-HOURS_OF_DAY, upper=2.0 * HOURS_OF_DAY,
                    unit="h", grid=NOONS_H),
        length: positive(LENGTH, LENGTHS_S[-1], sd=0.8, unit="s", grid=LENGTHS_S),
    }  # fmt: skip
    law = replace(
        placed, expression=daily(placed.expression, symbol(noon)),
        written={key: daily(law, symbol(NOON)) for key, law in placed.written.items()},
        parameters=tuple(replace(of_day.get(p.name, p), name=p.name) for p in placed.parameters),
        mechanism=replace(mechanism, says=f"Every day at one hour: {mechanism.says[:1].lower()}{mechanism.says[1:]}"),
    )  # fmt: skip
    return carried_on(law, axis, ending=EACH_DAY)


def _renamed(placed: Placed, label: str) -> Placed:
    """A law with another label, and so with names of parameters, states and boundary that differ from the law's."""

    def new(name: str) -> str:
        return f"{label}_{name.removeprefix(f'{placed.label}_')}"

    names = {name: new(name) for name in (*(p.name for p in placed.parameters), *(s.name for s in placed.states))}
    if placed.boundary_temperature is not None:
        end = placed.target[-1]
        names |= {end: new(end), f"T_{end}": f"T_{new(end)}"}
    other, given = placed.boundary_temperature, {symbol(old): symbol(new) for old, new in names.items()}
    return replace(
        placed, label=label, target=tuple(names.get(one, one) for one in placed.target),
        written={" ".join(names.get(word, word) for word in key.split()): law for key, law in placed.written.items()},
        expression=placed.expression.xreplace(given),
        boundary_temperature=None if other is None else other.xreplace(given),
        parameters=tuple(replace(p, name=names[p.name]) for p in placed.parameters),
        states=tuple(
            replace(s.with_laws(lambda law: law.xreplace(given)), name=names[s.name]) for s in placed.states
        ),
    )  # fmt: skip


def has_clock(placed: Placed) -> bool:
    """True if a law depends on the time, and on nothing that it remembers."""
    return (
        placed.form in (None, "shift", "clock")
        and not placed.states
        and symbol("time") in placed.expression.free_symbols
    )


def may_change(placed: Placed) -> bool:
    """True if a law can be multiplied by a course: it has none yet, and is no delay, exchange or freezing."""
    laws = (placed.expression, *(s.rate for s in placed.states))
    return placed.form in (None, "shift") and all(symbol("time") not in law.free_symbols for law in laws)


def without_repeats(placed: Sequence[Placed]) -> list[Placed]:
    """Laws of which no two are constants times the same losses, links or input."""
    found: dict[tuple[Any, ...], Placed] = {}
    for one in placed:
        law = one.expression.xreplace({symbol(one.strength.name): sp.Integer(1)})
        found.setdefault((one.kind, frozenset(one.target), one.weights, law), one)
    return list(found.values())
