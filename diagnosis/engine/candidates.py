"""Candidates as columns: every mechanism at its places in its best shape, faults of measurement, parameters out of
their priors, all whitened and put into one Gram matrix with the unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidates.hypotheses import Hypothesis, chunks
from diagnosis.engine.fit import Experiment, Fit, Linear, Linearised
from diagnosis.engine.gram import Given, Gram, Strengths, strengths
from diagnosis.engine.metric import Metric
from diagnosis.engine.point import AT_ONCE, Machine, Point
from diagnosis.engine.products import base_of, gram_of, whitened_base
from diagnosis.engine.unknown import TERM_STEP, Held, NetworkParameter, Scope, TermParameter, Unknown
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.term_on_grid import TermOnGrid
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

START_SHARES = (1.0, 0.3, 0.03)  # of the strength that the scan promises
ROUGH, ITERATIONS = 3, 10
SHAPES_TRIED = 3  # of what has a memory: its set-points may have several optima
Starts = tuple[tuple[int, float], ...]  # variants and strengths
DATE_STEP_S = 10.0
VALUES_AT_ONCE = 800_000  # of heats that are held together, per part: bounds the memory of long recordings


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """All candidates in their best shapes, and one Gram matrix.

    Attributes
    ----------
    best : tuple of int
        Best variant of each
    log_bayes : Array, shape (candidates,)
        Mean over the variants, against nothing
    spread : Array, shape (candidates,)
        Of the best variant, less that mean; at least 0
    gram : Gram
        Of residual, unknowns, further columns, candidates: in this order
    unknowns, further, of_candidates : range
        Their places among the labels of the Gram matrix
    sd, sign : Array, shape (candidates,)
        Prior of the strengths
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
    of_candidates: range
    sd: Array
    sign: NDArray[np.int_]
    peak_K: Array
    peak_W: Array
    starts: tuple[Starts, ...]

    def in_directions(self, directions: Array) -> Scan:
        """The scan with combinations, shape (further, n), in place of the further columns."""
        first, count = self.further.start, directions.shape[1]
        last = first + count
        return replace(self, gram=self.gram.combined(self.further, directions), further=range(first, last),
                       of_candidates=range(last, last + len(self.of_candidates)))  # fmt: skip

    def singles(self, given: Given) -> Strengths:
        """Every candidate alone, in its best shape; the sign of a clock fault is that of its variant."""
        return given.singles(self.of_candidates, self.sd, self.sign)


def scan(fit: Fit, candidates: Sequence[Hypothesis], error: Sequence[Array] = ()) -> Scan:
    """Linearise everything at a fit.

    Parameters
    ----------
    fit : Fit
        Model error in its metric becomes columns of the Gram matrix
    candidates : sequence of Hypothesis
        Terms; parameters out of their priors follow from the unknowns themselves
    error : sequence of Array, shape (M, n) each
        Whitened columns of model error per unit, for the Gram matrix; by default those of the metric
    """
    count, model = len(fit.z), fit.experiment.machine.model
    placed = [(c, _on_grid(model, c.term)) for c in candidates if c.term is not None]
    candidates, priors = [c for c, _ in placed], [on_grid.term.strength for _, on_grid in placed]
    base = whitened_base(fit.parts, fit.z, error) if error else base_of(fit)
    known = range(count)
    chosen = [np.empty((len(W), len(candidates)), order="F") for W in base]
    best: list[int] = []
    mean, spread, signs, peak, starts = [], [], [], [], []
    warm = [not is_total_loss(name) for name in fit.parts[0].point.sensors.channels]
    everything, residuals = _with_unknowns(fit), [W[:, 0] for W in base]
    intervals = max(len(part.point.trajectory.T) for part in fit.parts)
    for chunk in chunks(candidates, max(16, min(AT_ONCE, VALUES_AT_ONCE // intervals))):
        some = placed[len(best) : len(best) + len(chunk)]
        raw, heats = zip(*(_columns(fit.experiment, part, some) for part in fit.parts), strict=True)
        peaks_K, peaks_W = np.max([np.abs(X[:, warm]).max(axis=(0, 1)) for X in raw], axis=0), np.max(heats, axis=0)
        blocks = [part.filter(X) for part, X in zip(fit.parts, raw, strict=True)]
        (a, b), first = everything.against(residuals, blocks), 0
        for c, on_grid in some:
            n = len(c.variants)
            way = np.sign(c.variants[:, 0]).astype(int)
            sign = way if len(set(way.tolist())) > 1 else np.full(n, c.sign)
            mine = slice(first, first + n)
            found = strengths(a[mine], b[mine], on_grid.term.strength.sd, sign)
            at = int(np.argmax(found.log_bayes))
            for kept, block in zip(chosen, blocks, strict=True):
                kept[:, len(best)] = block[:, first + at]
            best.append(at)
            peak.append((float(peaks_K[first + at]), float(peaks_W[first + at])))
            mean.append(float(np.logaddexp.reduce(found.log_bayes) - np.log(n)))
            spread.append(float(found.log_bayes[at]) - mean[-1])
            signs.append(int(sign[at]))
            starts.append(_further_starts(c, found, at))
            first += n
    extra = base[0].shape[1] - 1 - count
    peak_K, peak_W = np.array(peak).reshape(-1, 2).T
    return Scan(
        candidates=tuple(candidates), best=tuple(best), log_bayes=np.array(mean), spread=np.array(spread),
        gram=gram_of(fit.parts, base, chosen), unknowns=known,
        further=range(count, count + extra), of_candidates=range(count + extra, count + extra + len(candidates)),
        sd=np.array([strength.sd for strength in priors]), sign=np.array(signs, dtype=int), peak_K=peak_K,
        peak_W=peak_W, starts=tuple(starts),
    )  # fmt: skip


def _further_starts(candidate: Hypothesis, found: Strengths, best: int) -> Starts:
    """Every size with the promised sign of a clock's fault; the next best shapes of what has a memory."""
    assert candidate.term is not None  # noqa: S101 - parameters out of their priors have no term
    sizes = candidate.variants[:, 0]
    if len(np.unique(np.abs(sizes))) > 1:  # none looks like another one, scaled
        sd = candidate.term.strength.sd
        return tuple((best, float(size * sd)) for size in sizes[sizes * found.value[best] > 0.0])
    if not candidate.term.states:
        return ()
    next_best = np.argsort(-found.log_bayes)[:SHAPES_TRIED]
    return tuple((int(i), float(found.value[i])) for i in next_best if i != best)


def _with_unknowns(fit: Fit) -> Metric:
    """The metric of a fit, with its unknowns marginalised as well."""
    metric, columns, count = fit.experiment.metric, [part.columns for part in fit.parts], len(fit.z)
    if metric is None:
        return Metric(sessions=(tuple(range(len(columns))),), columns=tuple(columns), shared=count, own=count)
    both = tuple(np.column_stack(pair) for pair in zip(columns, metric.columns, strict=True))
    return replace(metric, columns=both, shared=count + metric.shared, own=count + metric.own)


def _columns(
    experiment: Experiment, part: Linear, some: Sequence[tuple[Hypothesis, TermOnGrid]]
) -> tuple[Array, Array]:
    """Effect per unit of strength of all variants of some candidates; zero where a candidate cannot act.

    Returns
    -------
    readings : Array, shape (K + 1, channels, n)
        [K] or [W]
    heat : Array, shape (n,)
        Largest heat into or out of a part, [W]
    """
    point, trajectory = part.point, part.point.trajectory
    count, recording = sum(len(candidate.variants) for candidate, _ in some), trajectory.piece.recording
    acting = [_acts_in(experiment, candidate, recording) for candidate, _ in some]
    if not any(acting):
        return np.zeros((*point.read.shape, count)), np.zeros(count)
    into = np.zeros((len(trajectory.piece.steps), trajectory.decay.shape[-1], count))
    loss, shown, first = np.zeros((len(into), count)), {}, 0
    for (candidate, on_grid), acts in zip(some, acting, strict=True):
        mine = slice(first, first + len(candidate.variants))
        first = mine.stop
        if not acts:
            continue
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
    assert candidate.term is not None  # noqa: S101 - it has a parameter
    names = [p.name for p in candidate.term.parameters]
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


@lru_cache(maxsize=2048)
def _on_grid(model: NetworkOnGrid, term: Term) -> TermOnGrid:
    return TermOnGrid(model, term)


def with_candidate(fit: Fit, candidate: Hypothesis, variant: int) -> tuple[Experiment, Array]:
    """The experiment with one candidate as further unknowns, and their ``z`` in one of its shapes.

    Parameters
    ----------
    candidate : Hypothesis
        Of a term
    variant : int
        Shape, with strength 1

    Returns
    -------
    experiment : Experiment
    z : Array, shape (further unknowns,)
    """
    experiment, term = fit.experiment, candidate.term
    assert term is not None  # noqa: S101 - parameters out of their priors have no term
    machine = experiment.machine
    names = tuple(p.name for p in term.parameters)
    outside = term.kind in ("sensor", "signal")
    if outside:
        machine = Machine(machine.model, (*machine.terms, term))
    else:
        machine = Machine(NetworkOnGrid(term.apply(machine.model.network), machine.model.losses), machine.terms)
    values = candidate.variants[variant].tolist()
    scopes = [_scope(experiment, candidate), *(None for _ in names[1:])]
    added: list[Unknown] = []
    for p, value, scope in zip(term.parameters, values, scopes, strict=True):
        if p.name == candidate.clock:
            added.append(Held(parameter=p, label=term.label, names=names, of_recording=experiment.starts_at))
        elif p.sd == 0.0:
            added.append(Held(parameter=replace(p, start=value), label=term.label, names=names))
        elif outside:
            # Differences by a date must be small next to the time that a step takes.
            step = DATE_STEP_S / p.sd if candidate.clock and p.unit == "s" and not p.log else TERM_STEP
            added.append(
                TermParameter(parameter=p, scope=scope, label=term.label, names=names, step=min(step, TERM_STEP))
            )
        else:
            added.append(NetworkParameter(parameter=p, scope=scope))
    z = [unknown.z_of(value) for unknown, value in zip(added, values, strict=True)]
    return replace(experiment, machine=machine, unknowns=(*experiment.unknowns, *added)), np.array(z)


def _acts_in(experiment: Experiment, candidate: Hypothesis, recording: str) -> bool:
    """True if a candidate may act in a recording."""
    scope = _scope(experiment, candidate)
    return scope is None or recording in scope


def _scope(experiment: Experiment, candidate: Hypothesis) -> Scope:
    return experiment.scope_of(candidate.name, dated=candidate.clock is not None)


def refit(
    fit: Fit, candidate: Hypothesis, variant: int, strength: float, *, further: Starts = (),
    iterations: int = ITERATIONS,
) -> Fit:  # fmt: skip
    """A candidate fitted together with everything else, judged by the noise filters of a fit without it.

    The other unknowns start where the straight line puts them with the candidate there. What it does may be far from
    a straight line; so smaller shares of the promised strength are tried until a rough fit agrees better with the
    readings than without the candidate, and all further starts. The best rough fit goes on.

    Raises
    ------
    ArithmeticError
        If there is no solution at any of the starts.
    """
    line = cache(lambda one: _straight_line(fit, candidate, one))

    def rough_fit(which: int, size: float) -> list[Fit]:
        """A few steps from one start; empty if it has no solution."""
        aside, experiment, shape = line(which)
        z = np.concatenate([fit.z + size * aside, [experiment.unknowns[len(fit.z)].z_of(size)], shape[1:]])
        try:
            return [experiment.fit(z, fit.trajectories, iterations=ROUGH)]
        except ArithmeticError:
            return []

    rough: list[Fit] = []
    for share in START_SHARES:
        rough += rough_fit(variant, share * strength)
        if rough and rough[-1].objective < fit.objective:
            break
    for other, size in further:
        rough += rough_fit(other, size)
    if not rough:
        raise ArithmeticError(f"no simulation has a solution with {candidate.label}")
    best = min(rough, key=lambda one: one.objective)
    return best.experiment.fit(best.z, iterations=iterations - ROUGH, at=best.linearised)


def _straight_line(fit: Fit, candidate: Hypothesis, variant: int) -> tuple[Array, Experiment, Array]:
    """Change of the other unknowns per unit of strength, and the experiment with one variant and its ``z``."""
    one = replace(candidate, variants=candidate.variants[[variant]])
    assert candidate.term is not None  # noqa: S101 - parameters out of their priors have no term
    on_grid = _on_grid(fit.experiment.machine.model, candidate.term)
    column = [part.filter(_columns(fit.experiment, part, [(one, on_grid)])[0]) for part in fit.parts]
    both = Linearised.of([replace(part, residual=x[:, 0]) for part, x in zip(fit.parts, column, strict=True)],
                         fit.experiment.metric)  # fmt: skip
    return (-fit.covariance @ both.products[1:, 0], *with_candidate(fit, candidate, variant))
