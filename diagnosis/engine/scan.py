"""Candidates as columns: every mechanism at its places in its best shape, faults of measurement, parameters out of
their priors, all whitened and put into one Gram matrix with the unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidates.hypotheses import Hypothesis, chunks
from diagnosis.engine.fit import Experiment, Fit, Linear
from diagnosis.engine.gram import Given, Gram, Strengths, base_of, gram_of, strengths, whitened_base
from diagnosis.engine.learnt import rule
from diagnosis.engine.metric import Metric
from diagnosis.engine.point import Point, columns_at_once
from diagnosis.engine.unknown import Scope
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.term_on_grid import TermOnGrid
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

SHAPES_TRIED = 3  # of what has a memory: its set-points may have several optima
Starts = tuple[tuple[int, float], ...]  # variants and strengths


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """All candidates in their best shapes, and one Gram matrix.

    Attributes
    ----------
    best : tuple of int
        Best variant of each
    log_bayes : Array, shape (candidates,)
        Mean over the variants, against nothing; 0 of a parameter outside its prior
    spread : Array, shape (candidates,)
        Of the best variant, less that mean; at least 0
    gram : Gram
        Of residual, unknowns, further columns, terms: in this order
    unknowns, further : range
        Their places among the columns of the Gram matrix
    of_candidates : Array of int, shape (candidates,)
        Places of the candidates; of a parameter outside its prior that of the unknown
    sd, sign : Array, shape (candidates,)
        Prior of the strengths; of a parameter what a wider prior adds to its own
    peak_K, peak_W : Array, shape (candidates,)
        Largest change of a temperature [K], and heat into or out of a part [W], per unit of strength
    starts : tuple of tuple of (int, float)
        Further variants and strengths of each to fit from, where the best one may lead to another optimum
    """

    candidates: tuple[Hypothesis, ...]
    best: tuple[int, ...]
    log_bayes: Array
    spread: Array
    gram: Gram
    unknowns: range
    further: range
    of_candidates: NDArray[np.intp]
    sd: Array
    sign: NDArray[np.int_]
    peak_K: Array
    peak_W: Array
    starts: tuple[Starts, ...]

    def in_directions(self, directions: Array) -> Scan:
        """The scan with combinations, shape (further, n), in place of the further columns."""
        first, last = self.further.start, self.further.start + directions.shape[1]
        moved = np.where(self.of_candidates < first, 0, last - self.further.stop)  # parameters stay where they are
        return replace(self, gram=self.gram.combined(self.further, directions), further=range(first, last),
                       of_candidates=self.of_candidates + moved)  # fmt: skip

    def singles(self, given: Given) -> Strengths:
        """Every candidate alone, in its best shape; the sign of a clock fault is that of its variant."""
        at = self.of_candidates + 1
        return strengths(given.matrix[0, at], given.matrix[at, at], self.sd, self.sign)

    def means(self, given: Given) -> Array:
        """Log Bayes factor of every candidate, mean over its variants, shape (candidates,)."""
        return self.singles(given).log_bayes - self.spread


def scan(fit: Fit, candidates: Sequence[Hypothesis], error: Sequence[Array] = ()) -> Scan:
    """Linearise everything at a fit.

    Parameters
    ----------
    fit : Fit
        Model error in its metric becomes columns of the Gram matrix
    candidates : sequence of Hypothesis
        A parameter outside its prior needs no column but that of its unknown
    error : sequence of Array, shape (M, n) each
        Whitened columns of model error per unit, for the Gram matrix; by default those of the metric
    """
    base = whitened_base(fit.parts, fit.z, error) if error else base_of(fit)
    terms = [one for one in candidates if one.term is not None]
    first_term, chosen = base[0].shape[1] - 1, [np.empty((len(W), len(terms)), order="F") for W in base]
    shapes = {one: _outside(one.unknown) for one in candidates if one.unknown is not None}
    warm = [not is_total_loss(name) for name in fit.parts[0].point.sensors.channels]
    everything, residuals, column = _with_unknowns(fit), [W[:, 0] for W in base], 0
    intervals = max(len(part.point.trajectory.T) for part in fit.parts)
    for some in chunks(terms, columns_at_once(intervals)):
        raw, heats = zip(*(columns_of(fit.experiment, part, some) for part in fit.parts), strict=True)
        peaks_K, peaks_W = np.max([np.abs(X[:, warm]).max(axis=(0, 1)) for X in raw], axis=0), np.max(heats, axis=0)
        blocks = [part.filter(X) for part, X in zip(fit.parts, raw, strict=True)]
        (a, b), first = everything.against(residuals, blocks), 0
        for one in some:
            mine = slice(first, first + len(one.variants))
            first = mine.stop
            shape = _best_shape(one, first_term + column, a[mine], b[mine], peaks_K[mine], peaks_W[mine])
            for kept, block in zip(chosen, blocks, strict=True):
                kept[:, column] = block[:, mine.start + shape.variant]
            shapes[one], column = shape, column + 1
    every = [shapes[one] for one in candidates]
    return Scan(
        candidates=tuple(candidates),
        best=tuple(shape.variant for shape in every),
        log_bayes=np.array([shape.log_bayes for shape in every]),
        spread=np.array([shape.spread for shape in every]),
        gram=gram_of(fit.parts, base, chosen),
        unknowns=range(len(fit.z)),
        further=range(len(fit.z), first_term),
        of_candidates=np.array([shape.at for shape in every], dtype=int),
        sd=np.array([shape.sd for shape in every]),
        sign=np.array([shape.sign for shape in every], dtype=int),
        peak_K=np.array([shape.peak_K for shape in every]),
        peak_W=np.array([shape.peak_W for shape in every]),
        starts=tuple(shape.starts for shape in every),
    )


@dataclass(frozen=True, kw_only=True)
class _Shape:
    """The best shape of a candidate, and its place in the Gram matrix; see :class:`Scan` for the numbers."""

    at: int
    sd: float
    variant: int = 0
    log_bayes: float = 0.0
    spread: float = 0.0
    sign: int = 0
    peak_K: float = 0.0
    peak_W: float = 0.0
    starts: Starts = ()


def _outside(unknown: int) -> _Shape:
    """A parameter outside its prior: what a wider prior adds to its own."""
    return _Shape(at=unknown, sd=float(np.sqrt(rule().wider ** 2 - 1.0)))


def _best_shape(candidate: Hypothesis, at: int, a: Array, b: Array, peaks_K: Array, peaks_W: Array) -> _Shape:
    """Compare all shapes of a candidate, by their inner products with the residual and with themselves."""
    sd, way = candidate.added.strength.sd, np.sign(candidate.variants[:, 0]).astype(int)
    sign = way if len(set(way.tolist())) > 1 else np.full(len(way), candidate.sign)
    found = strengths(a, b, sd, sign)
    best = int(np.argmax(found.log_bayes))
    mean = float(np.logaddexp.reduce(found.log_bayes) - np.log(len(way)))
    return _Shape(at=at, sd=sd, variant=best, log_bayes=mean, spread=float(found.log_bayes[best]) - mean,
                  sign=int(sign[best]), peak_K=float(peaks_K[best]), peak_W=float(peaks_W[best]),
                  starts=_further_starts(candidate.added, candidate.variants[:, 0], found, best))  # fmt: skip


def _further_starts(term: Term, sizes: Array, found: Strengths, best: int) -> Starts:
    """Every size with the promised sign of a clock's fault; the next best shapes of what has a memory."""
    if len(np.unique(np.abs(sizes))) > 1:  # none looks like another one, scaled
        return tuple((best, float(size * term.strength.sd)) for size in sizes[sizes * found.value[best] > 0.0])
    if not term.states:
        return ()
    next_best = np.argsort(-found.log_bayes)[:SHAPES_TRIED]
    return tuple((int(i), float(found.value[i])) for i in next_best if i != best)


def _with_unknowns(fit: Fit) -> Metric:
    """The metric of a fit, with its unknowns marginalised as well."""
    metric, columns, count = fit.experiment.metric, [part.columns for part in fit.parts], len(fit.z)
    if not metric.columns:
        return Metric(sessions=(tuple(range(len(columns))),), columns=tuple(columns), shared=count, own=count)
    both = tuple(np.column_stack(pair) for pair in zip(columns, metric.columns, strict=True))
    return replace(metric, columns=both, shared=count + metric.shared, own=count + metric.own)


def columns_of(experiment: Experiment, part: Linear, some: Sequence[Hypothesis]) -> tuple[Array, Array]:
    """Effect per unit of strength of all variants of some terms; zero where a candidate cannot act.

    Returns
    -------
    readings : Array, shape (K + 1, channels, n)
        [K] or [W]
    heat : Array, shape (n,)
        Largest heat into or out of a part, [W]
    """
    point, trajectory = part.point, part.point.trajectory
    count, recording = sum(len(candidate.variants) for candidate in some), trajectory.piece.recording
    scopes = [scope_of(experiment, candidate) for candidate in some]
    acting = [scope is None or recording in scope for scope in scopes]
    if not any(acting):
        return np.zeros((*point.read.shape, count)), np.zeros(count)
    into = np.zeros((len(trajectory.piece.steps), trajectory.decay.shape[-1], count))
    loss, shown, first = np.zeros((len(into), count)), {}, 0
    for candidate, acts in zip(some, acting, strict=True):
        mine = slice(first, first + len(candidate.variants))
        first = mine.stop
        if candidate.term is None or not acts:
            continue
        on_grid = term_on_grid(experiment.machine.model, candidate.term)
        values = _by_clock(candidate, experiment.starts_at.get(recording))
        if on_grid.term.kind == "sensor":
            shown[mine.start] = _faults(point, values, on_grid)
        else:
            heat, own = on_grid.heat(trajectory, values)
            into[:, : heat.shape[1], mine] = _finite(heat)
            loss[:, mine] = _finite(own)
    result = point.heated(into, loss)
    for start, columns in shown.items():
        result[:, :, start : start + columns.shape[2]] = columns
    return result, np.abs(into[:, : point.machine.model.n]).max(axis=(0, 1))


def _by_clock(candidate: Hypothesis, starts_at: float | None) -> Array:
    """Variants of a candidate in a recording that starts at a time of the shared axis, shape (V, parameters)."""
    if candidate.clock is None or starts_at is None:
        return candidate.variants
    names = [p.name for p in candidate.added.parameters]
    values = np.array(candidate.variants)
    values[:, names.index(candidate.clock)] = starts_at
    return values


def _faults(point: Point, variants: Array, on_grid: TermOnGrid) -> Array:
    """Change of the recorded readings per unit of strength of a fault, shape (K + 1, channels, variants)."""
    read = readings(point.machine.model, point.trajectory, point.sensors)
    columns = []
    for variant in variants:
        values = np.array(variant)
        values[0] *= on_grid.term.strength.sd  # by a difference of the size that the fault typically has
        columns.append((on_grid.distorted(point.trajectory, point.sensors, read, values) - read) / values[0])
    return np.stack(columns, axis=2)


def _finite(heat: Array) -> Array:
    """A heat without values that are no numbers, as of a factor on a link that another effect has cut off."""
    return heat if np.isfinite(heat.sum()) else np.nan_to_num(heat, nan=0.0, posinf=0.0, neginf=0.0)


def course_of_heat(fit: Fit, term: Term) -> Array:
    """Net heat of a term of the network in every interval of a fit, times the root of its length, [W s^0.5].

    So the inner product of two of them is their integral over the time.

    Parameters
    ----------
    term : Term
        In the network of the fit

    Returns
    -------
    Array, shape (intervals of all pieces,)
    """
    index, on_grid = fit.experiment.machine.parameter_index, term_on_grid(fit.experiment.machine.model, term)
    at, courses = [index[p.name] for p in term.parameters], list[Array]()
    for point in (part.point for part in fit.parts):
        heat, _ = on_grid.heat(point.trajectory, point.setting.values[None, at])
        courses.append(heat[:, :, 0].sum(axis=1) * np.sqrt(point.piece.steps))
    return np.concatenate(courses)


@lru_cache(maxsize=2048)
def term_on_grid(model: NetworkOnGrid, term: Term) -> TermOnGrid:
    """A term at its place in a network; kept, since its laws take long to compile."""
    return TermOnGrid(model, term)


def scope_of(experiment: Experiment, candidate: Hypothesis) -> Scope:
    """Recordings in which a candidate may act; None for all."""
    return experiment.scope_of(candidate.name, dated=candidate.clock is not None)
