"""Shapes of what was found, moved by trial: a set-point or a moment acts by jumps, and no derivative tells where a
better one lies.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis, switched_elsewhere, two_point_columns
from diagnosis.forward.term_on_grid import TermOnGrid
from diagnosis.inference.evidence import Marginal, strength
from diagnosis.inference.latent import white_columns
from diagnosis.inference.posterior import Fit, Problem
from diagnosis.inference.unknowns import Unknown
from models.base.types import Array

LOCAL, ZOOM = 9, (1.0, 0.25, 0.06)  # shapes around those of a fit, within so many spacings of the grid
ENDS = 33  # values of each of the two temperatures at which something switches
SWEPT = 65  # values of a period, everything else as fitted
LEAST_GAIN = 3.0  # log evidence for which a fit goes on with other shapes
RUNAWAY_W = 1e9


def reshaped(h: Hypothesis, problem: Problem, fit: Fit) -> Array | None:
    """Where a fit should go on: other shapes of a term in it, and all the rest as it would follow linearly.

    Parameters
    ----------
    h : Hypothesis
        That was added to the problem
    problem : Problem
    fit : Fit
        With its linearisation

    Returns
    -------
    Array, shape (unknowns,), or None
        None where no other shapes promise more.
    """
    free = _free(h)
    if h.term is None or h.term.kind == "sensor" or not free:
        return None
    items, z = problem.unknowns.items, np.array(fit.z)
    own = problem.unknowns.of(h.term.parameters)
    rest = np.setdiff1d(np.arange(len(items)), own)
    values = np.array([items[i].value(float(z[i])) for i in own])
    here = np.concatenate([[1.0], values[1:]])[None, :]
    now = _columns(h, problem, fit, here, values)[:, 0] * values[0]
    J = fit.white_columns[:, rest]
    marginal = Marginal(J, fit.white_residual + J @ z[rest] + now)  # as if the term had never been added
    coarse = np.concatenate([np.ones((len(h.variants), 1)), h.variants[:, 1:]], axis=1)
    best, most, first, value = here[0], -np.inf, -np.inf, values[0]
    for look, zoom in enumerate(ZOOM):
        shapes = _around(h, problem, free, best, zoom)
        if look == 0:
            shapes = np.concatenate([here, coarse, shapes, *_swept(h, best)])
        score = strength(*marginal.products(_columns(h, problem, fit, shapes, values)), h.term.strength.sd, h.sign)
        total = score.log_bayes + _prior([items[i] for i in own[1:]], shapes[:, 1:])
        if look == 0:
            first = float(total[0])
        top = int(np.argmax(total))
        if total[top] > most:
            best, most, value = shapes[top], float(total[top]), float(score.value[top])
    if most < first + LEAST_GAIN:
        return None
    z[own] = [items[i].z_inside(float(v)) for i, v in zip(own, [value, *best[1:]], strict=True)]
    then = _columns(h, problem, fit, best[None, :], values)[:, 0] * value
    z[rest] = marginal.most_probable(marginal.residual - then)
    return z


def _free(h: Hypothesis) -> list[int]:
    """Which of a term's parameters are sought: those with a grid or a sweep."""
    return [c for c in range(1, h.variants.shape[1]) if len(np.unique(h.variants[:, c])) > 1 or _sweep(h, c)]


def _sweep(h: Hypothesis, column: int) -> tuple[float, float] | None:
    return None if h.term is None else h.term.parameters[column].sweep


def _swept(h: Hypothesis, values: Array) -> list[Array]:
    """Values of a term's parameters, one of them gone through over all its range; for every one that has such."""
    found = []
    for column in _free(h):
        if ends := _sweep(h, column):
            rows = np.tile(values, (SWEPT, 1))
            rows[:, column] = np.geomspace(*ends, SWEPT)
            found.append(rows)
    return found


def _columns(h: Hypothesis, problem: Problem, fit: Fit, shapes: Array, values: Array) -> Array:
    """Whitened readings per unit of strength for several shapes; `values` are those of the fit."""
    assert h.term is not None  # noqa: S101 - a term is asked for
    term, white = TermOnGrid(problem.model, h.term), []
    for part in fit.parts:
        with np.errstate(over="ignore", invalid="ignore"):
            heat, loss = term.heat(part.trajectory, shapes, values)
        # A memory faster than the grid runs away in its explicit steps: such a shape brings nothing.
        good = (np.abs(heat) < RUNAWAY_W).all(axis=(0, 1))
        white.append(white_columns(problem.model, part, np.where(good, heat, 0.0), np.where(good, loss, 0.0)))
    return np.concatenate(white)


def _prior(items: list[Unknown], shapes: Array) -> Array:
    """Log prior of shapes, shape (V,), but for a constant."""
    z = np.array([[item.z(float(v)) for item, v in zip(items, row, strict=True)] for row in shapes])
    return np.asarray(-0.5 * np.square(z).sum(axis=1))


def _around(h: Hypothesis, problem: Problem, free: list[int], values: Array, zoom: float) -> Array:
    """Values of a term's parameters around some, the strength 1: all pairs of its first two shapes, others alone."""
    assert h.term is not None  # noqa: S101 - a term is asked for
    axes, ends = {}, two_point_columns(h, problem)
    for column in free:
        p, grid = h.term.parameters[column], np.unique(h.variants[:, column])
        if p.sweep:
            reach = zoom * values[column] * np.log(p.sweep[1] / p.sweep[0]) / (SWEPT - 1)
        else:
            reach = zoom * float(np.ptp(grid)) / (len(grid) - 1)
        axes[column] = np.clip(values[column] + reach * np.linspace(-1.0, 1.0, LOCAL), p.lower, p.upper)
    blocks = []
    if ends:
        reach = 0.5 * float(np.ptp(axes[ends[0]]))
        blocks += switched_elsewhere(h, ends, values, reach * np.linspace(-1.0, 1.0, ENDS))
    for columns in (free[:2], *([column] for column in free[2:])):
        block = np.array(list(product(*(axes[column] for column in columns))))
        rows = np.tile(values, (len(block), 1))
        rows[:, columns] = block
        blocks.append(rows)
    rows = np.concatenate(blocks)
    rows[:, 0] = 1.0
    return rows
