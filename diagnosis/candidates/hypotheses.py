"""What competes to explain a mismatch, and the score of each: mechanisms at their places, faults of instruments, and
parameters out of their priors, all in one list and by one measure.

The scan is linear: one column per combination of shape parameters, judged with everything else marginalised
(:mod:`diagnosis.inference.evidence`). It is fast and decides who is fitted in earnest, not who wins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np

from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.term_on_grid import TermOnGrid
from diagnosis.inference.evidence import Marginal, strength
from diagnosis.inference.latent import white_columns
from diagnosis.inference.posterior import Fit, Linearised, Problem
from models.base.parallel import run_parallel
from models.base.types import Array
from models.mechanisms import OPEN_FORM, Placed
from models.terms.term import Term

MOST_VARIANTS = 24
CHUNK, CHUNK_VALUES = 64, 250_000  # columns that go through the filter together, and values of one of them in all
BUNDLES = 2  # of such chunks, per process
FINER, FINER_ENDS = 9, 33  # values between the neighbours of the best one of a grid
SHARPENED_FROM = 2  # variants of the grid, the best ones
WIDE_PRIOR = 4.0  # standard deviations of a parameter that is out of its prior
NEAR_ZERO = 1e-9
How = Literal["U", "D", "C", "W", "P"]
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
    variants : Array, shape (V, parameters)
        Values of the term's parameters that are tried, the strength 1
    how : str
        ``U``: a mechanism of the catalogue; ``D``: from a date on; ``C``: a law of time that goes on in the next
        recording; ``W``: over the hours; ``P``: a parameter outside
        its prior
    clock : str or None
        Parameter of the term that is the start of the recording on the time axis that all recordings share, [s]
    """

    name: str
    place: str
    family: str
    term: Term | None = None
    unknown: int | None = None
    variants: Array
    how: How = "U"
    clock: str | None = None

    @property
    def label(self) -> str:
        """Name and place, and whether a memory goes on in the next recording."""
        return f"{self.name}@{self.place}" + (" (carried on)" if self.how == "C" else "")

    @property
    def is_open(self) -> bool:
        """Whether it is a mere form, of something that no catalogue has."""
        return self.family == OPEN_FORM

    @property
    def sign(self) -> int:
        """Of the strength; 0 where it may be either."""
        if self.term is None:
            return 0
        p = self.term.strength
        return int(p.lower >= 0.0) - int(p.upper <= 0.0)

    @property
    def in_network(self) -> bool:
        """Whether it is heat, and so becomes part of the network."""
        return self.term is not None and self.term.kind not in ("sensor", "signal")


@dataclass(frozen=True, kw_only=True, eq=False)
class Scored:
    """A hypothesis with what the scan says.

    Attributes
    ----------
    hypothesis : Hypothesis
    log_bayes : float
        Mean over the variants, against nothing
    best : int
        Its best variant
    values : Array, shape (V,)
        Most probable strength of every variant
    log_bayes_of : Array, shape (V,)
    expected : float
        Log Bayes factor to be expected if it were there with its typical strength
    """

    hypothesis: Hypothesis
    log_bayes: float
    best: int
    values: Array
    log_bayes_of: Array
    expected: float


def hypothesis_of(placed: Placed) -> Hypothesis:
    """A mechanism at a place, with the grid of its shape parameters."""
    grids = [parameter.grid or (parameter.start,) for parameter in placed.parameters[1:]]
    grid = np.array(list(product(*grids)), dtype=float)
    if len(grid) > MOST_VARIANTS:
        grid = grid[np.unique(np.linspace(0, len(grid) - 1, MOST_VARIANTS).round().astype(int))]
    return Hypothesis(
        name=placed.name, place=placed.place, family=placed.family, term=placed,
        variants=_both_ways(placed, np.concatenate([np.ones((len(grid), 1)), grid], axis=1)),
    )  # fmt: skip


def two_point_columns(h: Hypothesis, problem: Problem) -> tuple[int, int] | None:
    """Which of a term's parameters are the set-point and the band of a two-point control.

    None where it has no such control, and where rows are means over minutes, which blur when it switches.
    """
    if problem.slow or h.term is None or not any(memory.update is not None for memory in h.term.states):
        return None
    names = [p.name for p in h.term.parameters]
    found = [[i for i, name in enumerate(names) if name.endswith(ending)] for ending in ("_set_point", "_band")]
    return (found[0][0], found[1][0]) if all(found) else None


def switched_elsewhere(h: Hypothesis, columns: tuple[int, int], values: Array, moves: Array) -> list[Array]:
    """Values of a term's parameters with one of its two switching temperatures moved; first the upper, then the lower.

    Parameters
    ----------
    h : Hypothesis
    columns : (int, int)
        Of its :func:`two_point_columns`
    values : Array, shape (parameters,)
    moves : Array, shape (V,)
        [K]

    Returns
    -------
    list of Array, shape (V, parameters)
    """
    assert h.term is not None  # noqa: S101 - it has parameters
    result = []
    for sign in (1.0, -1.0):
        rows = np.tile(values, (len(moves), 1))
        for column, change in zip(columns, (0.5 * moves, sign * moves), strict=True):
            p = h.term.parameters[column]
            rows[:, column] = np.clip(values[column] + change, p.lower, p.upper)
        result.append(rows)
    return result


def _both_ways(term: Term, variants: Array) -> Array:
    """Variants of a fault of a clock of both signs and several sizes: none looks like another one, scaled."""
    if term.form != "clock":
        return variants
    return np.concatenate([variants * [size, *np.ones(variants.shape[1] - 1)] for size in CLOCK_SIZES])


def parameter_hypotheses(problem: Problem) -> list[Hypothesis]:
    """Every parameter of the network out of its prior."""
    return [
        Hypothesis(name="parameter", place=item.target, family="parameter", unknown=index, variants=np.ones((1, 1)))
        for index, item in enumerate(problem.unknowns.items)
        if item.role == "network"
    ]


def scan(
    problem: Problem, fit: Fit, marginal: Marginal, hypotheses: Sequence[Hypothesis], *, jobs: int = 1
) -> list[Scored]:
    """The scores of all hypotheses, best first.

    Parameters
    ----------
    problem, fit, marginal
        The explanation so far
    hypotheses : sequence of Hypothesis
    jobs : int
        Processes
    """
    intervals = sum(len(piece.steps) for piece in problem.pieces)
    most = max(8, min(CHUNK, CHUNK_VALUES // max(intervals, 1)))
    work = [(problem, fit, marginal, chunk) for chunk in chunks(hypotheses, most)]
    results = run_parallel(_scan_chunk, work, jobs=jobs, batches=BUNDLES * jobs)
    scored = [one for result in results for one in result]
    return sorted(scored, key=lambda s: -s.log_bayes)


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


def _scan_chunk(problem: Problem, fit: Fit, marginal: Marginal, chunk: Sequence[Hypothesis]) -> list[Scored]:
    model = problem.model
    heating = [h for h in chunk if h.term is not None and h.term.kind != "sensor"]
    found = []
    if heating:
        terms = [TermOnGrid(model, h.term) for h in heating if h.term is not None]
        blocks = [_heat_columns(model, part, terms, heating) for part in fit.parts]
        columns = np.concatenate(blocks)
        before = 0
        for h in heating:
            found.append(_judged(h, marginal, columns[:, before : before + len(h.variants)]))
            before += len(h.variants)
    for h in chunk:
        if h.unknown is not None:
            found.append(_judged(h, marginal, marginal.columns[:, [h.unknown]], prior_sd=WIDE_PRIOR))
        elif h.term is not None and h.term.kind == "sensor":
            term = TermOnGrid(model, h.term)
            columns = np.concatenate([_distortion_columns(model, part, term, h) for part in fit.parts])
            found.append(_judged(h, marginal, columns))
    return found


def sharpened(problem: Problem, fit: Fit, marginal: Marginal, scored: Scored) -> Scored:
    """A score whose best variant lies between the values of the grid, one shape parameter after the other.

    A fit that starts too far from the right moment creeps: where an edge is does not show beyond its neighbourhood. The
    score becomes at least what a grid that much finer would have given.
    """
    h = scored.hypothesis
    if len(h.variants) < 2:
        return scored
    # Around the second best as well: where a strong effect has bent the calibration, their order tells little.
    chosen = np.argsort(-scored.log_bayes_of)[:SHARPENED_FROM]
    tried = [_finer(problem, fit, marginal, scored, int(index)) for index in chosen]
    best, value, log_bayes = max(tried, key=lambda one: one[2])
    return replace(
        scored, hypothesis=replace(h, variants=np.concatenate([h.variants, best[None, :]])),
        log_bayes=max(scored.log_bayes, log_bayes - float(np.log(FINER * len(h.variants)))),
        best=len(h.variants), values=np.append(scored.values, value),
        log_bayes_of=np.append(scored.log_bayes_of, log_bayes),
    )  # fmt: skip


def _finer(problem: Problem, fit: Fit, marginal: Marginal, scored: Scored, index: int) -> tuple[Array, float, float]:
    """A variant moved between the values of the grid; with its strength and its log Bayes factor."""
    h = scored.hypothesis
    best, value, log_bayes = h.variants[index], float(scored.values[index]), float(scored.log_bayes_of[index])
    for line in _lines(h, problem):
        (finer,) = _scan_chunk(problem, fit, marginal, [replace(h, variants=line(best))])
        if finer.log_bayes_of[finer.best] > log_bayes:
            best, value = finer.hypothesis.variants[finer.best], float(finer.values[finer.best])
            log_bayes = float(finer.log_bayes_of[finer.best])
    return best, value, log_bayes


def _lines(h: Hypothesis, problem: Problem) -> list[Callable[[Array], Array]]:
    """Ways through the shapes of a term from one of them, each up to the neighbours on the grid.

    What a two-point control does hangs on the two temperatures at which it switches, each sharply and for itself.
    """
    grids = [np.unique(h.variants[:, column]) for column in range(h.variants.shape[1])]
    ends = two_point_columns(h, problem)

    def along(column: int, best: Array) -> Array:
        grid = grids[column]
        at = int(np.searchsorted(grid, best[column]))
        variants = np.tile(best, (FINER, 1))
        variants[:, column] = np.linspace(grid[max(at - 1, 0)], grid[min(at + 1, len(grid) - 1)], FINER)
        return variants

    lines: list[Callable[[Array], Array]] = [
        partial(along, column) for column in range(1, len(grids)) if len(grids[column]) > 1
    ]
    if ends is None or len(grids[ends[0]]) < 2:
        return lines
    moves = float(np.diff(grids[ends[0]]).max()) * np.linspace(-1.0, 1.0, FINER_ENDS)

    def switched(end: int, best: Array) -> Array:
        return switched_elsewhere(h, ends, best, moves)[end]

    return [*lines, partial(switched, 0), partial(switched, 1)]


def white_column(problem: Problem, fit: Fit, h: Hypothesis, variant: int) -> Array:
    """Whitened change of the readings per unit of strength, for one variant of a term, shape (M,)."""
    assert h.term is not None  # noqa: S101 - a term is asked for
    one, term = replace(h, variants=h.variants[[variant]]), TermOnGrid(problem.model, h.term)
    if h.term.kind == "sensor":
        return np.concatenate([_distortion_columns(problem.model, part, term, one) for part in fit.parts])[:, 0]
    return np.concatenate([_heat_columns(problem.model, part, [term], [one]) for part in fit.parts])[:, 0]


def _heat_columns(
    model: NetworkOnGrid, part: Linearised, terms: Sequence[TermOnGrid], hypotheses: Sequence[Hypothesis]
) -> Array:
    heats, losses = [], []
    for term, h in zip(terms, hypotheses, strict=True):
        heat, loss = term.heat(part.trajectory, h.variants)
        heats.append(np.nan_to_num(heat))
        losses.append(np.nan_to_num(loss))
    return white_columns(model, part, np.concatenate(heats, axis=2), np.concatenate(losses, axis=1))


def _distortion_columns(model: NetworkOnGrid, part: Linearised, term: TermOnGrid, h: Hypothesis) -> Array:
    """Whitened readings per unit of strength, by a difference of the size that the fault typically has."""
    read = readings(model, part.trajectory, part.sensors)
    size = term.term.strength.sd
    columns = []
    for variant in h.variants:
        values = np.array(variant)
        values[0] *= size
        columns.append((term.distorted(part.trajectory, part.sensors, read, values) - read) / values[0])
    return part.whitening(np.stack(columns, axis=2))


def _judged(h: Hypothesis, marginal: Marginal, columns: Array, prior_sd: float | None = None) -> Scored:
    a, b = marginal.products(columns)
    if prior_sd is None:
        assert h.term is not None  # noqa: S101 - a parameter has its prior given
        prior_sd = h.term.strength.sd
    # A clock that is early does not look like a late one turned over: every variant speaks for its own sign only.
    way = np.sign(h.variants[:, 0])
    both = len(set(way)) > 1
    found = strength(a * way, b, prior_sd, 1 if both else h.sign)
    log_bayes = np.where(b > NEAR_ZERO, found.log_bayes, 0.0)
    return Scored(
        hypothesis=h, log_bayes=float(np.logaddexp.reduce(log_bayes) - np.log(len(log_bayes))),
        best=int(np.argmax(log_bayes)), values=found.value * way, log_bayes_of=log_bayes,
        expected=float(np.median(0.5 * b * prior_sd**2 - 0.5 * np.log1p(b * prior_sd**2))),
    )  # fmt: skip
