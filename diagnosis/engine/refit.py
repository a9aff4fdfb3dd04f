"""One candidate fitted together with everything else, from where the scan puts it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Experiment, Fit, Linearised
from diagnosis.engine.point import Machine
from diagnosis.engine.scan import Starts, columns_of, scope_of
from diagnosis.engine.switch_grid import held_numbers, refined, switch_numbers
from diagnosis.engine.unknown import TERM_STEP, Held, NetworkParameter, TermParameter, Unknown
from diagnosis.forward.network_on_grid import NetworkOnGrid
from models.base.types import Array

START_SHARES = (1.0, 0.1)  # of the strength that the scan promises: until one brings something
SWITCH_SHARES = (1.0, 0.5, 2.0)  # of the same for what switches, as long as they do: its objective has many minima
ROUGH, ITERATIONS = 3, 10
FAR_NAT = 20.0  # that a fit would gain by a further step: it is far from its optimum
DATE_STEP_S = 10.0


def refit(
    fit: Fit, candidate: Hypothesis, variant: int, strength: float, *, further: Starts = (),
    iterations: int = ITERATIONS,
) -> Fit:  # fmt: skip
    """A candidate fitted together with everything else, judged by the noise filters of a fit without it.

    The other unknowns start where the straight line puts them with the candidate there. What it does may be far from
    a straight line; so smaller shares of the promised strength are tried until a rough fit agrees better with the
    readings than without the candidate, and all further starts. The best rough fit goes on. What switches starts where
    finer scans put its numbers, with several shares of the strength as long as they bring something, and from the fit
    as it is too; the numbers stay there while everything else is far from where it belongs.

    Raises
    ------
    ArithmeticError
        If there is no solution at any of the starts.
    """
    held = held_numbers(fit.experiment, [candidate], len(fit.z))
    switches = candidate.term is not None and bool(switch_numbers(candidate.term))
    if switches:
        candidate, strength = refined(fit, candidate, [variant, *(other for other, _ in further)])
        variant, further = 0, ()
    line = cache(lambda one: _straight_line(fit, candidate, one))
    # The fit may be far from an optimum: readings of a channel may be back that it never saw.
    step = fit.linearised.step(fit.z, 0.0, *fit.experiment.bounds)
    gained = 0.5 * float(step @ (fit.linearised.products[1:, 0] - fit.z))
    bases = [fit.z + step, fit.z] if gained > FAR_NAT else [fit.z]

    def rough_fit(which: int, size: float, base: Array = bases[0]) -> list[Fit]:
        """A few steps from one start; empty if it has no solution."""
        aside, experiment, shape = line(which)
        z = np.concatenate([base + size * aside, [experiment.unknowns[len(fit.z)].z_of(size)], shape[1:]])
        try:
            return [experiment.fit(z, fit.trajectories, iterations=ROUGH, held=held)]
        except ArithmeticError:
            return []

    rough: list[Fit] = []
    for base in bases if switches else bases[:1]:
        for share in SWITCH_SHARES if switches else START_SHARES:
            found = rough_fit(variant, share * strength, base)
            rough += found
            better = any(one.objective < fit.objective for one in found)
            if found and better != switches:
                break
    for other, size in further:
        rough += rough_fit(other, size)
    if not rough:
        raise ArithmeticError(f"no simulation has a solution with {candidate.label}")
    best = min(rough, key=lambda one: one.objective)
    return best.experiment.fit(best.z, iterations=iterations - ROUGH, at=best.linearised, held=held)


def _straight_line(fit: Fit, candidate: Hypothesis, variant: int) -> tuple[Array, Experiment, Array]:
    """Change of the other unknowns per unit of strength, and the experiment with one variant and its ``z``."""
    one = replace(candidate, variants=candidate.variants[[variant]])
    column = [part.filter(columns_of(fit.experiment, part, [one])[0]) for part in fit.parts]
    both = Linearised.of([replace(part, residual=x[:, 0]) for part, x in zip(fit.parts, column, strict=True)],
                         fit.experiment.metric)  # fmt: skip
    return (-fit.covariance @ both.products[1:, 0], *with_candidate(fit, candidate, variant))


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
    experiment, term = fit.experiment, candidate.added
    machine = experiment.machine
    if candidate.in_network:
        machine = Machine(NetworkOnGrid(term.apply(machine.model.network), machine.model.losses), machine.terms)
    else:
        machine = Machine(machine.model, (*machine.terms, term))
    values = candidate.variants[variant].tolist()
    scopes = [scope_of(experiment, candidate), *(None for _ in term.parameters[1:])]
    added: list[Unknown] = []
    for p, value, scope in zip(term.parameters, values, scopes, strict=True):
        if p.name == candidate.clock:
            added.append(Held(parameter=p, of_recording=experiment.starts_at))
        elif p.sd == 0.0:
            added.append(Held(parameter=replace(p, start=value)))
        elif candidate.in_network:
            added.append(NetworkParameter(parameter=p, scope=scope))
        else:
            # Differences by a date must be small next to the time that a step takes.
            step = DATE_STEP_S / p.sd if candidate.clock and p.unit == "s" and not p.log else TERM_STEP
            added.append(TermParameter(parameter=p, scope=scope, label=term.label, step=min(step, TERM_STEP)))
    z = [unknown.z_of(value) for unknown, value in zip(added, values, strict=True)]
    return replace(experiment, machine=machine, unknowns=(*experiment.unknowns, *added)), np.array(z)
