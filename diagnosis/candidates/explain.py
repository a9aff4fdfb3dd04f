"""From scores to explanations: the best hypotheses fitted in earnest, one effect after another.

The scan is linear in the strength and on a grid of shapes; a strong effect is neither. So the best few are put into the
model and fitted together with everything else, from several starts, and compared by their Laplace evidence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from diagnosis.candidates.hypotheses import WIDE_PRIOR, Hypothesis, Scored, white_column
from diagnosis.candidates.reshape import reshaped
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.trajectory import Trajectory
from diagnosis.inference.evidence import Marginal
from diagnosis.inference.posterior import Fit, Problem
from models.base.parallel import run_parallel
from models.base.types import Array

FIRST_ITERATIONS, ROUGH_ITERATIONS, ITERATIONS = 4, 3, 10
RACE_SHARE, RACE_LEAD = 0.15, 15.0  # of the best gain, and log evidence: who is further behind can no longer win ...
RACERS = 3  # ... but for the best few where a strong effect has bent the calibration: rough fits tell little there
HOPE = 0.6  # of the best gain of a rough fit, below which such a racer is given up before its shapes are sought again
DISTRESS, SLOW_SENSOR = 2.5, 1.3  # standard deviations: of a parameter, and of a sensor's lag
START_SHARES = (0.6, 0.3, 0.1)
AS_PROMISED = 0.8
MOST_RESHAPED = 3
DISTORTED = 4.0  # standard deviations of a parameter
BACK = (0.3, 0.6)  # of the way that a calibration without an effect went


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

    @property
    def labels(self) -> tuple[str, ...]:
        """What was found, by name and place."""
        return tuple(h.label for h in self.found)

    @property
    def misfit(self) -> float:
        """Mean square of the whitened residuals, in multiples of what noise and structural floor make of it."""
        parts = self.fit.parts
        rows = sum(int(np.isfinite(part.residual).sum()) for part in parts)
        return float(sum(part.white_residual @ part.white_residual for part in parts)) / max(rows, 1)

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


def linearised(explanation: Explanation) -> Explanation | None:
    """An explanation with the linearisation of its fit; None where it cannot be simulated a second time.

    A strong control runs at the edge of what has a solution: from another guess the same numbers may have none.
    """
    try:
        return replace(explanation, fit=explanation.problem.at(explanation.fit))
    except ArithmeticError:
        return None


def distorted(explanation: Explanation) -> bool:
    """Whether a calibration went so far that nothing said about its neighbourhood can be trusted.

    So far from its priors; or, where rows lie minutes apart and priors are wide, always.
    """
    return explanation.problem.slow or float(np.abs(explanation.fit.z).max(initial=0.0)) > DISTORTED


def in_the_middle(explanation: Explanation) -> Explanation | None:
    """An explanation seen from the middle of the priors, but for what was found; None without a solution there.

    A strong effect that is missing bends the calibration so far that the same effect, tried from there, does not fit.
    """
    problem = explanation.problem
    own = {p.name for h in explanation.found if h.term is not None for p in h.term.parameters}
    z = np.where([item.target in own for item in problem.unknowns.items], explanation.fit.z, 0.0)
    try:
        fit = problem.fit(z, [part.trajectory for part in explanation.fit.parts], iterations=0)
    except ArithmeticError:
        return None
    return replace(explanation, fit=fit)


def calibrated(problem: Problem) -> Explanation:
    """The nominal model, its parameters tuned inside their priors.

    A sensor far slower than its data sheet says bends the fit into a corner where heat capacities stand for the lag;
    so where anything is far from its prior, a start with slow sensors is tried as well.
    """
    found = settled(problem, problem.fit(iterations=FIRST_ITERATIONS))
    slow = np.array([SLOW_SENSOR if item.role == "lag" else 0.0 for item in problem.unknowns.items])
    if float(np.abs(found.fit.z).max(initial=0.0)) < DISTRESS or not slow.any():
        return found
    try:
        other = found.problem.fit(slow, iterations=ITERATIONS)
    except ArithmeticError:
        return found
    return settled(problem, other) if other.log_evidence > found.log_evidence else found


def settled(problem: Problem, fit: Fit) -> Explanation:
    """The explanation of a first fit: judged by that fit's filters from now on, and fitted to the end with them."""
    problem = problem.with_whitenings([part.whitening for part in fit.parts])
    fit = problem.fit(fit.z, [part.trajectory for part in fit.parts])
    return Explanation(problem=problem, fit=fit, log_evidence=fit.log_evidence)


def extended(base: Explanation, scored: Scored) -> tuple[Problem, Array]:
    """The problem with one hypothesis more, and where its fit should start."""
    h, z = scored.hypothesis, np.array(base.fit.z)
    problem = _with(base.problem, h)
    if h.unknown is not None:
        z[h.unknown] /= WIDE_PRIOR
        return problem, z
    values = np.array(h.variants[scored.best])
    values[0] = scored.values[scored.best]
    own = [item.z_inside(value)
           for value, item in zip(values, problem.unknowns.items[-len(values) :], strict=True)]  # fmt: skip
    return problem, np.concatenate([z, own])


def _with(problem: Problem, h: Hypothesis) -> Problem:
    """A problem with one hypothesis more; the parameters of a term come last among its unknowns."""
    if h.unknown is not None:
        wide = problem.unknowns.items[h.unknown].parameter.sd * WIDE_PRIOR
        return problem.changed(unknowns=problem.unknowns.with_prior(h.unknown, wide))
    term = h.term
    assert term is not None  # noqa: S101 - the other case is above
    if not h.in_network:
        unknowns = problem.unknowns.with_parameters("term", term.parameters)
        return problem.changed(unknowns=unknowns, terms=(*problem.terms, term))
    model = NetworkOnGrid(term.apply(problem.model.network), problem.model.losses)
    return problem.changed(model=model, unknowns=problem.unknowns.with_parameters("network", term.parameters))


def without(start: Explanation, explanation: Explanation, index: int) -> Explanation:
    """An explanation without one of the things it found, fitted anew from where it was; see :func:`instead`."""
    return instead(start, explanation, index, None)


def instead(start: Explanation, explanation: Explanation, index: int, other: Explanation | None) -> Explanation:
    """An explanation with something else in place of one of the things it found, fitted anew from where it was.

    Parameters
    ----------
    start : Explanation
        With nothing found, to which everything was added
    explanation : Explanation
    index : int
        Which of what was found
    other : Explanation or None
        What it found last comes in its place, from the values that it has there; None for nothing

    Raises
    ------
    ArithmeticError
        If there is no solution.
    """
    found = tuple(h for i, h in enumerate(explanation.found) if i != index)
    values = _values_of(explanation)
    if other is not None:
        found = (*found, other.found[-1])
        values = _values_of(other) | values
    problem, old = start.problem, explanation.problem
    for h in found:
        problem = _with(problem, h)
    problem = problem.changed(floor=old.floor, whitenings=old.whitenings)
    z = np.array([item.z(values[item.role, item.target]) for item in problem.unknowns.items])
    fit = problem.fit(z, [part.trajectory.T for part in explanation.fit.parts], iterations=ITERATIONS)
    return _explanation(found, problem, fit)


def _values_of(explanation: Explanation) -> dict[tuple[str, str], float]:
    items = explanation.problem.unknowns.items
    return {(i.role, i.target): i.value(float(z)) for i, z in zip(items, explanation.fit.z, strict=True)}


def fitted(base: Explanation, scored: Scored, worth: float = -np.inf) -> Explanation | None:
    """The explanation with one hypothesis more, roughly fitted from the best of its starts; None without a solution.

    Parameters
    ----------
    base : Explanation
    scored : Scored
        The hypothesis to add
    worth : float
        Log evidence over the base below which no second start is tried
    """
    best: Explanation | None = None
    problem, middle = extended(base, scored)
    promised = scored.log_bayes_of[scored.best]
    for start in _starts(base, scored, problem, middle):
        try:
            fit = problem.fit(start, [part.trajectory for part in base.fit.parts], iterations=ROUGH_ITERATIONS)
        except ArithmeticError:
            continue  # too far: the next start is nearer to what was there before
        found = _explanation((*base.found, scored.hypothesis), problem, fit)
        if best is None or found.log_evidence > best.log_evidence:
            best = found
        gain = best.log_evidence - base.log_evidence
        if promised < worth or (gain > AS_PROMISED * promised and not problem.slow):
            break  # the scan is linear; a fit that reaches what it promised needs no other start
    if best is None:
        return None
    best = _reshaped(best, ROUGH_ITERATIONS)
    return replace(best, fit=best.fit.without_parts())


def refined(rough: Explanation, worth: float = -np.inf) -> Explanation:
    """A rough fit, fitted to the end; where it stays below a log evidence, without seeking other shapes."""
    better = _better(rough, rough.fit.z, rough.fit.courses, ITERATIONS)
    for _ in range(MOST_RESHAPED if better.log_evidence >= worth else 0):
        before = linearised(better)
        if before is None:
            break
        better = _reshaped(before, ITERATIONS)
        if better is before:
            break
    return replace(better, fit=better.fit.without_parts())


def _better(there: Explanation, z: Array, guesses: Sequence[Trajectory | Array], iterations: int) -> Explanation:
    """An explanation fitted anew from `z`, if that is better."""
    try:
        fit = there.problem.fit(z, guesses, iterations=iterations)
    except ArithmeticError:
        return there
    found = _explanation(there.found, there.problem, fit)
    return found if found.log_evidence > there.log_evidence else there


def _reshaped(there: Explanation, iterations: int) -> Explanation:
    """An explanation fitted anew with other shapes of what was found last, if that is better."""
    z = reshaped(there.found[-1], there.problem, there.fit)
    if z is None:
        return there
    return _better(there, z, [part.trajectory for part in there.fit.parts], iterations)


def _explanation(found: tuple[Hypothesis, ...], problem: Problem, fit: Fit) -> Explanation:
    return Explanation(problem=problem, fit=fit, found=found, log_evidence=evidence_of(found, fit))


def evidence_of(found: Sequence[Hypothesis], fit: Fit) -> float:
    """Log evidence of a fit with what was found."""
    return fit.log_evidence + sum(_one_sided(h, fit) for h in found)


def _starts(base: Explanation, scored: Scored, problem: Problem, z: Array) -> Iterator[Array]:
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
    if problem.slow and not base.found:
        # Weeks under wide priors bend too much: some of the way back to their middles, the effect at its usual size.
        item, value = problem.unknowns.items[count], float(scored.values[scored.best])
        usual = np.copysign(max(abs(value), item.parameter.sd), h.sign or value)
        for share in BACK:
            nearer = np.concatenate([share * z[:count], z[count:]])
            nearer[count] = item.z_inside(float(usual))
            yield nearer
    marginal = Marginal.of(base.fit)
    brought = white_column(base.problem, base.fit, h, scored.best) * scored.values[scored.best]
    there = marginal.most_probable(marginal.residual - brought)

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
    (index,) = fit.unknowns.of([h.term.strength])
    sd = float(np.sqrt(fit.covariance[index, index]))
    return float(np.log(2.0) + log_ndtr(h.sign * fit.z[index] / sd))


def best_fits(base: Explanation, chosen: Sequence[tuple[Explanation, Scored]], *, jobs: int = 1) -> list[Explanation]:
    """Hypotheses of scans fitted, best first: all of them roughly, those that may still win to the end.

    Every one comes with the explanation that it was scanned from: the base, the same seen from elsewhere, or a rival of
    it. Of two that add the same the better one counts. The fits come without their linearisation, see
    :meth:`Problem.at`: a dozen of them would fill the memory.
    """
    most = max((s.log_bayes for view, s in chosen if view is base), default=0.0)
    # What remembers takes longest to fit; so it comes first, and no process waits for another one at the end.
    chosen = sorted(chosen, key=lambda pair: -len(pair[1].hypothesis.term.states) if pair[1].hypothesis.term else 0)
    # The base seen from elsewhere is a further start already.
    again = [view is not base and view.labels == base.labels for view, _ in chosen]
    work = [(view, s, np.inf if it else AS_PROMISED * most)
            for (view, s), it in zip(chosen, again, strict=True)]  # fmt: skip
    by_label: dict[str, Explanation] = {}
    for found in run_parallel(fitted, work, jobs=jobs):
        if found is not None:
            label = found.found[-1].label
            by_label[label] = max(found, by_label.get(label, found), key=lambda e: e.log_evidence)
    rough = sorted(by_label.values(), key=lambda e: -e.log_evidence)
    gains = [e.log_evidence - base.log_evidence for e in rough]
    least = (1.0 - RACE_SHARE) * max(gains, default=0.0) - RACE_LEAD
    count = sum(gain >= least for gain in gains)
    if distorted(base) and not base.problem.slow:
        count = max(count, RACERS)
    racing, beaten = rough[:count], rough[count:]
    worth = base.log_evidence + HOPE * max(gains, default=0.0)
    done = run_parallel(refined, [(e, worth) for e in racing], jobs=jobs)
    return sorted(_elsewhere([*done, *beaten], jobs), key=lambda e: -e.log_evidence)


def _elsewhere(fits: Sequence[Explanation], jobs: int) -> list[Explanation]:
    """The same fits; those of the best one's physics at other places started once more from what the best one found.

    Moments and set-points that one place found hold at the others as well: only then the places are compared.
    """
    if not fits:
        return []
    best = max(fits, key=lambda e: e.log_evidence)
    own = best.found[-1]
    shaped = own.variants.shape[1] > 1
    # What was found beside another explanation has other unknowns.
    beside = best.labels[:-1]
    again = [shaped and e is not best and e.found[-1].name == own.name and e.labels[:-1] == beside for e in fits]
    work = [(e, best) for e, it in zip(fits, again, strict=True) if it]
    better = iter(run_parallel(_started_from, work, jobs=jobs))
    return [next(better) if it else e for e, it in zip(fits, again, strict=True)]


def _started_from(there: Explanation, other: Explanation) -> Explanation:
    """An explanation fitted anew from where another one with the same unknowns ended, if that is better."""
    better = _better(there, other.fit.z, other.fit.courses, ITERATIONS)
    return replace(better, fit=better.fit.without_parts())
