"""From scores to explanations: the best hypotheses fitted in earnest, one effect after another.

The scan is linear in the strength and on a grid of shapes; a strong effect is neither. So the best few are put into the
model and fitted together with everything else, from several starts, and compared by their Laplace evidence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from scipy.special import log_ndtr

from diagnosis.hypotheses import WIDE_PRIOR, Hypothesis, Scored, white_column
from diagnosis.posterior import Fit, Problem
from diagnosis.trajectory import NetworkOnGrid
from models.types import Array

FITTED = 5  # hypotheses that are fitted in earnest
SECOND_STARTS = 1  # of these, how many from two starts
FIRST_ITERATIONS, ITERATIONS = 4, 10
START_SHARES = (0.6, 0.3, 0.1)
AS_PROMISED = 0.8


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """A problem with what has been added to it, fitted.

    Attributes
    ----------
    problem : Problem
    fit : Fit
    found : tuple of Hypothesis
        What was added to the nominal model, in order
    log_evidence : float
        Comparable between explanations of the same data
    """

    problem: Problem
    fit: Fit
    found: tuple[Hypothesis, ...] = ()
    log_evidence: float

    def values_of(self, hypothesis: Hypothesis) -> dict[str, tuple[float, float]]:
        """Value and standard error of every parameter of something found, by name."""
        result = {}
        sd = np.sqrt(np.diag(self.fit.covariance))
        names = (
            [p.name for p in hypothesis.term.parameters]
            if hypothesis.term is not None
            else [hypothesis.place]
        )  # fmt: skip
        for index, item in enumerate(self.fit.unknowns.items):
            if item.role in ("network", "term") and item.target in names:
                z = float(self.fit.z[index])
                value = item.value(z)
                per_z = value * item.parameter.sd if item.parameter.log else item.parameter.sd
                result[item.target] = (value, abs(per_z) * float(sd[index]))
        return result


def calibrated(problem: Problem) -> Explanation:
    """The nominal model, its parameters tuned inside their priors."""
    return settled(problem, problem.fit(iterations=FIRST_ITERATIONS))


def settled(problem: Problem, fit: Fit) -> Explanation:
    """The explanation of a first fit: judged by that fit's filters from now on, and fitted to the end with them."""
    problem = problem.with_whitenings([part.whitening for part in fit.parts])
    fit = problem.fit(fit.z, [part.trajectory for part in fit.parts])
    return Explanation(problem=problem, fit=fit, log_evidence=fit.log_evidence)


def extended(base: Explanation, scored: Scored, variant: int) -> tuple[Problem, Array]:
    """The problem with one hypothesis more, and where its fit should start."""
    h, problem = scored.hypothesis, base.problem
    z = np.array(base.fit.z)
    if h.unknown is not None:
        item = problem.unknowns.items[h.unknown]
        wide = problem.unknowns.with_prior(h.unknown, item.parameter.sd * WIDE_PRIOR)
        z[h.unknown] /= WIDE_PRIOR
        return problem.changed(unknowns=wide), z
    term = h.term
    assert term is not None  # noqa: S101 - the other case is above
    if h.in_network:
        model = NetworkOnGrid(term.apply(problem.model.network), problem.model.losses)
        unknowns = problem.unknowns.with_parameters("network", term.parameters)
        problem = problem.changed(model=model, unknowns=unknowns)
    else:
        unknowns = problem.unknowns.with_parameters("term", term.parameters)
        problem = problem.changed(unknowns=unknowns, terms=(*problem.terms, term))
    values = np.array(h.variants[variant])
    values[0] = scored.values[variant]
    own = [item.z(_inside(value, item.parameter.lower, item.parameter.upper))
           for value, item in zip(values, unknowns.items[-len(values) :], strict=True)]  # fmt: skip
    return problem, np.concatenate([z, own])


def _inside(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)


def fitted(base: Explanation, scored: Scored, starts: int = 1) -> Explanation | None:
    """The explanation with one hypothesis more, from the best of several starts; None if none has a solution."""
    best: Explanation | None = None
    for variant in scored.variants[:starts]:
        problem, middle = extended(base, scored, variant)
        for start in _starts(base, scored, variant, problem, middle):
            try:
                fit = problem.fit(start, [part.trajectory for part in base.fit.parts], iterations=ITERATIONS)
            except ArithmeticError:
                continue  # too far: the next start is nearer to what was there before
            evidence = fit.log_evidence + _one_sided(scored.hypothesis, fit)
            if best is None or evidence > best.log_evidence:
                best = Explanation(
                    problem=problem, fit=fit, found=(*base.found, scored.hypothesis), log_evidence=evidence
                )
            if evidence - base.log_evidence > AS_PROMISED * scored.log_bayes_of[variant]:
                break  # the scan is linear; a fit that reaches what it promised needs no other start
    return best


def _starts(base: Explanation, scored: Scored, variant: int, problem: Problem, z: Array) -> Iterator[Array]:
    """Where a fit may start: what the scan promises, and a fraction of it where a strong effect bends.

    With the effect go the other unknowns: to where they would be with it, back from where the calibration without it
    had pushed them.
    """
    h, count = scored.hypothesis, len(base.fit.z)
    if h.unknown is not None or h.term is None:
        yield z
        return
    if h.term.form == "swapped":  # nothing that was calibrated to exchanged channels is worth keeping
        whole = np.zeros(len(z))
        whole[count] = problem.unknowns.items[count].z(1.0)
        yield whole
        return
    J = base.fit.white_columns
    residual = base.fit.white_residual + J @ base.fit.z
    without = residual - white_column(base.problem, base.fit, h, variant) * scored.values[variant]
    there = np.linalg.solve(np.eye(count) + J.T @ J, J.T @ without)

    def at(share: float) -> Array:
        start = np.array(z)
        start[:count] = base.fit.z + share * (there - base.fit.z)
        start[count] *= share  # the strength comes first among the new unknowns
        return start

    yield at(1.0)
    guesses = [part.trajectory for part in base.fit.parts]
    yield min((at(share) for share in START_SHARES), key=lambda start: problem.objective(start, guesses))


def _one_sided(h: Hypothesis, fit: Fit) -> float:
    """Correction of the Laplace evidence where only one sign of the strength is possible."""
    if not h.sign or h.term is None:
        return 0.0
    index = next(i for i, item in enumerate(fit.unknowns.items) if item.target == h.term.strength.name)
    sd = float(np.sqrt(fit.covariance[index, index]))
    return float(np.log(2.0) + log_ndtr(h.sign * fit.z[index] / sd))


def best_fits(base: Explanation, scored: Sequence[Scored], *, jobs: int = 1, count: int = FITTED) -> list[Explanation]:
    """The best hypotheses of a scan fitted in earnest, best first."""
    chosen = list(scored[:count])
    work = [delayed(fitted)(base, s, 2 if i < SECOND_STARTS and len(s.variants) > 1 else 1)
            for i, s in enumerate(chosen)]  # fmt: skip
    results = Parallel(n_jobs=jobs)(work) if jobs > 1 else [f(*a, **k) for f, a, k in work]
    return sorted((e for e in results if e is not None), key=lambda e: -e.log_evidence)
