"""Candidates as columns: every mechanism at its places in its best shape, faults of measurement, parameters out of
their priors, all whitened and put into one Gram matrix with the unknowns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Experiment, Fit, Linear
from diagnosis.engine.gram import Given, Gram, Strengths
from diagnosis.engine.point import AT_ONCE, Column, Machine, Point
from diagnosis.engine.slopes import Heat
from diagnosis.engine.unknown import Group, NetworkParameter, TermParameter, Unknown
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.term_on_grid import TermOnGrid
from models.base.types import Array
from models.terms.term import Term

START_SHARES = (1.0, 0.5, 0.2, 0.02)  # of the strength that the scan promises
ITERATIONS = 10
CANDIDATE = Group(name="candidate")
VALUES_AT_ONCE = 1_500_000  # of heats that are held together, per part: bounds the memory of long recordings


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """All candidates in their best shapes, and one Gram matrix.

    Attributes
    ----------
    candidates : tuple of Hypothesis
    best : tuple of int
        Best variant of each
    log_bayes : Array, shape (candidates,)
        Mean over the variants, against nothing
    gram : Gram
        Of residual, unknowns, further columns, candidates: in this order
    unknowns, further, of_candidates : range
        Their places among the labels of the Gram matrix
    sd, sign : Array, shape (candidates,)
        Prior of the strengths
    """

    candidates: tuple[Hypothesis, ...]
    best: tuple[int, ...]
    log_bayes: Array
    gram: Gram
    unknowns: range
    further: range
    of_candidates: range
    sd: Array
    sign: Array

    def singles(self, given: Given) -> Strengths:
        """Every candidate alone, in its best shape; the sign of a clock fault is that of its variant."""
        return given.singles(self.of_candidates, self.sd, self.sign)

    def pairs(self, given: Given, which: Sequence[int] | None = None) -> tuple[Array, Array, Array]:
        """Log Bayes factors of all pairs of some candidates; their places among the candidates, and the factors."""
        some = np.arange(len(self.candidates)) if which is None else np.asarray(which)
        a, b = np.triu_indices(len(some), 1)
        i, j, first = some[a], some[b], self.of_candidates.start
        log_bayes = given.pairs(first + i, first + j, (self.sd[i], self.sd[j]), (self.sign[i], self.sign[j]))
        return i, j, log_bayes


def scan(fit: Fit, candidates: Sequence[Hypothesis], further: Sequence[Sequence[Column]] = ()) -> Scan:
    """Linearise everything at a fit.

    Parameters
    ----------
    fit : Fit
    candidates : sequence of Hypothesis
        Terms; parameters out of their priors follow from the unknowns themselves
    further : sequence, one per piece, of sequences of Column
        Further unknowns such as model error, per unit

    Returns
    -------
    Scan
    """
    candidates = [c for c in candidates if c.term is not None]
    count, model = len(fit.z), fit.experiment.machine.model
    on_grid = [_on_grid(model, c.term) for c in candidates if c.term is not None]
    base = _whitened_base(fit, further)
    known = range(count)
    given = _gram_of(fit, base, ()).given(known)
    chosen: list[list[Array]] = [[] for _ in fit.parts]
    best, mean, signs = [], [], []
    J = np.concatenate([part.columns for part in fit.parts])
    root = np.linalg.cholesky(np.eye(count) + J.T @ J)
    residual = np.concatenate([W[:, 0] for W in base])
    rest = residual - J @ np.linalg.solve(root.T, np.linalg.solve(root, J.T @ residual))
    intervals = max(len(part.point.trajectory.T) for part in fit.parts)
    for some in _chunks(candidates, max(16, min(AT_ONCE, VALUES_AT_ONCE // intervals))):
        blocks = [part.filter(_columns(part, [(candidates[i], on_grid[i]) for i in some])) for part in fit.parts]
        X = np.concatenate(blocks)
        along = np.linalg.solve(root, J.T @ X)
        a, b = X.T @ rest, np.einsum("mn,mn->n", X, X) - np.einsum("un,un->n", along, along)
        small = np.zeros((1 + len(a), 1 + len(a)))
        small[0, 1:], small[range(1, 1 + len(a)), range(1, 1 + len(a))] = a, b
        first = 0
        for i in some:
            c, n = candidates[i], len(candidates[i].variants)
            way = np.sign(c.variants[:, 0]).astype(int)
            sign = way if len(set(way.tolist())) > 1 else np.full(n, c.sign)
            assert c.term is not None  # noqa: S101 - only terms are here
            found = Given(matrix=small, log_determinant=given.log_determinant).singles(
                np.arange(first, first + n), c.term.strength.sd, sign
            )
            at = int(np.argmax(found.log_bayes))
            best.append(at)
            mean.append(float(np.logaddexp.reduce(found.log_bayes) - np.log(n)))
            signs.append(int(sign[at]))
            for kept, block in zip(chosen, blocks, strict=True):
                kept.append(block[:, first + at].copy())
            first += n
    whole = [np.concatenate([W, np.stack(kept, axis=1)], axis=1) if kept else W
             for W, kept in zip(base, chosen, strict=True)]  # fmt: skip
    extra = whole[0].shape[1] - 1 - count - len(candidates)
    return Scan(
        candidates=tuple(candidates), best=tuple(best), log_bayes=np.array(mean),
        gram=_gram_of(fit, whole, [c.label for c in candidates]), unknowns=known, further=range(count, count + extra),
        of_candidates=range(count + extra, count + extra + len(candidates)),
        sd=np.array([c.term.strength.sd for c in candidates if c.term is not None]), sign=np.array(signs, dtype=int),
    )  # fmt: skip


def _whitened_base(fit: Fit, further: Sequence[Sequence[Column]]) -> list[Array]:
    """Residual at the priors' middles, unknowns and further columns of every piece, whitened, shape (M, n)."""
    result = []
    for index, part in enumerate(fit.parts):
        blocks = [(part.residual + part.columns @ fit.z)[:, None], part.columns]
        for first in range(0, len(further[index]) if further else 0, AT_ONCE):
            blocks.append(part.filter(part.point.responses(further[index][first : first + AT_ONCE])))
        result.append(np.concatenate(blocks, axis=1))
    return result


def _gram_of(fit: Fit, whitened: Sequence[Array], names: Sequence[str]) -> Gram:
    """Gram matrices by recording."""
    of_recording: dict[str, Array] = {}
    determinants: dict[str, float] = {}
    rows: dict[str, int] = {}
    for part, W in zip(fit.parts, whitened, strict=True):
        name = part.point.trajectory.piece.recording
        of_recording[name] = of_recording.get(name, 0.0) + W.T @ W
        determinants[name] = determinants.get(name, 0.0) + part.filter.log_determinant
        rows[name] = rows.get(name, 0) + int(np.isfinite(part.point.residual).sum())
    known = [unknown.parameter.name for unknown in fit.experiment.unknowns]
    extra = whitened[0].shape[1] - 1 - len(known) - len(names)
    labels = (*known, *(f"further_{i}" for i in range(extra)), *names)
    return Gram(labels=labels, of_recording=of_recording, log_determinants=determinants, rows=rows)


def _columns(part: Linear, some: Sequence[tuple[Hypothesis, TermOnGrid]]) -> Array:
    """What the sensors read per unit of strength, for all variants of some candidates, shape (K + 1, channels, n)."""
    columns = [column for candidate, on_grid in some for column in candidate_columns(part.point, candidate, on_grid)]
    return part.point.responses(columns)


def candidate_columns(point: Point, candidate: Hypothesis, on_grid: TermOnGrid) -> Iterator[Column]:
    """Columns per unit of strength of all variants of a candidate."""
    term = on_grid.term
    if term.kind != "sensor":
        into, loss = on_grid.heat(point.trajectory, candidate.variants)
        into, loss = np.nan_to_num(into), np.nan_to_num(loss)
        coupled = len(point.machine.model.coupled)
        for v in range(into.shape[2]):
            yield Column(heat=Heat(into=np.pad(into[:, :, v], ((0, 0), (0, coupled))), loss=loss[:, v]))
        return
    read = readings(point.machine.model, point.trajectory, point.sensors)
    for variant in candidate.variants:
        values = np.array(variant)
        values[0] *= term.strength.sd  # by a difference of the size that the fault typically has
        yield Column(reading=(on_grid.distorted(point.trajectory, point.sensors, read, values) - read) / values[0])


def _chunks(candidates: Sequence[Hypothesis], most: int) -> Iterator[list[int]]:
    chunk: list[int] = []
    columns = 0
    for index, candidate in enumerate(candidates):
        if chunk and columns + len(candidate.variants) > most:
            yield chunk
            chunk, columns = [], 0
        chunk.append(index)
        columns += len(candidate.variants)
    if chunk:
        yield chunk


@lru_cache(maxsize=2048)
def _on_grid(model: NetworkOnGrid, term: Term) -> TermOnGrid:
    return TermOnGrid(model, term)


def with_candidate(fit: Fit, candidate: Hypothesis, variant: int, strength: float) -> tuple[Experiment, Array]:
    """The experiment with one candidate as further unknowns, and where its fit should start.

    Parameters
    ----------
    fit : Fit
    candidate : Hypothesis
        Of a term
    variant : int
        Whose shape the fit starts from
    strength : float
        And with which strength
    """
    experiment, term = fit.experiment, candidate.term
    assert term is not None  # noqa: S101 - parameters out of their priors have no term
    machine = experiment.machine
    values = np.array(candidate.variants[variant])
    values[0] = strength
    names = tuple(p.name for p in term.parameters)
    added: list[Unknown]
    if term.kind in ("sensor", "signal"):
        machine = Machine(machine.model, (*machine.terms, term))
        added = [TermParameter(parameter=p, group=CANDIDATE, label=term.label, names=names) for p in term.parameters]
    else:
        network = term.apply(machine.model.network)
        machine = Machine(NetworkOnGrid(network, machine.model.losses), machine.terms)
        added = [NetworkParameter(parameter=p, group=CANDIDATE) for p in term.parameters]
    z = [unknown.z_of(value) for unknown, value in zip(added, values.tolist(), strict=True)]
    return replace(experiment, machine=machine, unknowns=(*experiment.unknowns, *added)), np.concatenate([fit.z, z])


def refit(fit: Fit, candidate: Hypothesis, variant: int, strength: float, *, iterations: int = ITERATIONS) -> Fit:
    """A candidate fitted together with everything else, judged by the same noise filters.

    What it does may be far from a straight line of its strength; so the fit starts from the largest share of the
    promised strength with which the readings agree better than without it.

    Raises
    ------
    ArithmeticError
        If there is no solution at any of the starts.
    """
    guesses = [part.point.trajectory for part in fit.parts]
    experiment, z = with_candidate(fit, candidate, variant, strength)
    added, found = experiment.unknowns[len(fit.z)], None
    for share in START_SHARES:
        z[len(fit.z)] = added.z_of(share * strength)
        if share > START_SHARES[-1] and experiment.objective(z, guesses) > fit.objective:
            continue
        found = experiment.fit(z, guesses, iterations=iterations)
        if found.objective < fit.objective:
            return found
    assert found is not None  # noqa: S101 - the last start is always tried
    return found
