"""Anything that may explain a mismatch: mechanisms at their places, faults of instruments, parameters outside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from models.base.types import Array
from models.mechanisms import OPEN_FORM, Placed
from models.terms.term import Term

MOST_VARIANTS = 24
How = Literal["always", "from_date", "carried_on", "over_hours", "parameter"]
STEP, WHILE, HOURS, CARRIED_ON, EACH_DAY = "step", "for_a_while", "over_hours", "carried_on", "each_day"
HOW: Mapping[str, How] = {  # a law acts, by what its course in time adds to its label
    "": "always", STEP: "from_date", WHILE: "from_date", HOURS: "over_hours", CARRIED_ON: "carried_on",
    EACH_DAY: "carried_on",
}  # fmt: skip
CLOCK_SIZES = (-2.0, -1.0, -0.3, 0.3, 1.0, 2.0)  # of the typical one


@dataclass(frozen=True, kw_only=True, eq=False)
class Hypothesis:
    """One explanation more.

    Attributes
    ----------
    name, place, family : str
        Mechanism (or ``parameter``), where it acts, what kind of physics
    term : Term or None
        What is added; None for a parameter out of its prior
    unknown : int or None
        Index of that parameter among the unknowns
    law : str
        Name whatever its place and its course in time; of a parameter its own
    known_as : str or None
        The mechanism of the catalogue that has this law; None: the catalogue has none
    variants : Array, shape (V, parameters)
        Values of the term's parameters that are tried, the strength 1
    ending : str
        What the course in time adds to the label of the law
    clock : str or None
        Parameter of the term that is the start of the recording on the time axis that all recordings share, [s]
    date : str or None
        Parameter of the term that is the moment at which it begins, on that time axis, [s]
    less : float
        What baselines bring of its law over time, which does not count, [nat]
    log_prior : float
        Of it at its place, to 1 of nothing, [nat]; see :func:`diagnosis.engine.families.with_priors`
    trusted : bool
        True if baselines alone say how much of a change over time counts, not also the class of model error
    """

    name: str
    place: str
    family: str
    term: Term | None = None
    unknown: int | None = None
    law: str
    known_as: str | None = None
    variants: Array
    ending: str = ""
    clock: str | None = None
    date: str | None = None
    log_prior: float = 0.0
    less: float = 0.0
    trusted: bool = False

    @property
    def how(self) -> How:
        """When it acts.

        ``always``: as the law has it; ``from_date``: from a date on, or between two; ``carried_on``: a law of time that
        goes on in the next recording, or comes again every day; ``over_hours``: slowly; ``parameter``: one outside its
        prior.
        """
        return HOW[self.ending] if self.unknown is None else "parameter"

    @property
    def label(self) -> str:
        """Name and place, and whether a law of time goes on in the next recording, or comes again every day."""
        over = self.ending.replace("_", " ")
        return f"{self.name}@{self.place}" + (f" ({over})" if self.how == "carried_on" else "")

    @property
    def mechanism(self) -> str:
        """Name in the catalogue, of a law with a date or a course too; else its own."""
        return self.known_as or self.name

    @property
    def added(self) -> Term:
        """Its term, of one that is no parameter."""
        assert self.term is not None, self.label  # noqa: S101
        return self.term

    @property
    def is_open(self) -> bool:
        """True if it is a mere form, of something that no catalogue has."""
        return self.family == OPEN_FORM

    @property
    def sign(self) -> int:
        """Sign of the strength; 0 if it may be either."""
        if self.term is None:
            return 0
        p = self.term.strength
        return int(p.lower >= 0.0) - int(p.upper <= 0.0)

    @property
    def of_measurement(self) -> bool:
        """True if it is a fault of a thermometer or of a recorded input."""
        return self.term is not None and (self.term.of_measurement or self.term.kind == "sensor")

    @property
    def has_course(self) -> bool:
        """True if its law is multiplied by a course in time that begins at a date."""
        return self.how == "from_date" and self.date is not None

    @property
    def holds_a_reading(self) -> bool:
        """True if a reading stands still by it."""
        return self.term is not None and self.term.form == "stuck"

    @property
    def in_network(self) -> bool:
        """True if it is heat, and so becomes part of the network."""
        return self.term is not None and self.term.kind not in ("sensor", "signal")


def law_of(name: str) -> str:
    """Name of a law without the ending for a difference from its nominal value: a change of it has no use for that.

    Examples
    --------
    >>> law_of("air_cooling_change"), law_of("radiation_error"), law_of("windage")
    ('air_cooling', 'radiation', 'windage')
    """
    return name.removesuffix("_change").removesuffix("_error")


def hypothesis_of(placed: Placed) -> Hypothesis:
    """A mechanism at a place, with the grid of its shape parameters."""
    grids = [parameter.grid or (parameter.start,) for parameter in placed.parameters[1:]]
    grid = np.array(list(product(*grids)), dtype=float)
    if len(grid) > MOST_VARIANTS:
        grid = grid[np.unique(np.linspace(0, len(grid) - 1, MOST_VARIANTS).round().astype(int))]
    return Hypothesis(
        name=placed.name, place=placed.place, family=placed.family, term=placed, law=law_of(placed.name),
        variants=_both_ways(placed, np.concatenate([np.ones((len(grid), 1)), grid], axis=1)),
    )  # fmt: skip


def _both_ways(term: Term, variants: Array) -> Array:
    """Variants of a fault of a clock of both signs and several sizes: none looks like another one, scaled."""
    if term.form != "clock":
        return variants
    return np.concatenate([variants * [size, *np.ones(variants.shape[1] - 1)] for size in CLOCK_SIZES])


def chunks(hypotheses: Sequence[Hypothesis], most: int) -> Iterator[list[Hypothesis]]:
    """Hypotheses in order, in lists that have so many variants at most, or one hypothesis."""
    chunk: list[Hypothesis] = []
    columns = 0
    for hypothesis in hypotheses:
        if chunk and columns + len(hypothesis.variants) > most:
            yield chunk
            chunk, columns = [], 0
        chunk.append(hypothesis)
        columns += len(hypothesis.variants)
    if chunk:
        yield chunk
