"""Tests of the baselines after an inference: an effect that acts in them too, and sessions of another machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Fit, Linearised
from diagnosis.engine.products import base_of, gram_of
from diagnosis.engine.scan import scan
from diagnosis.engine.sessions import over_sessions, sessions_of
from diagnosis.forward.grid import Piece
from models.base.types import Array


def effects_in_baselines(fit: Fit, candidates: Sequence[Hypothesis]) -> Array:
    """Log Bayes factor of every candidate in the baselines alone, as if it acted there.

    Parameters
    ----------
    fit : Fit
        Machine without any of the candidates; its model error counts
    candidates : sequence of Hypothesis
        Terms

    Returns
    -------
    Array, shape (candidates,)
        Mean over the variants, against a baseline without it, [nat]
    """
    return scan(baselines_of(fit)[1], candidates).log_bayes


def sessions_apart(fit: Fit) -> dict[str, float]:
    """Log Bayes factor for every session of baselines on another machine, against the machine of all other recordings.

    That machine may differ between sessions by :func:`diagnosis.engine.learnt.deviation_priors`.

    Parameters
    ----------
    fit : Fit
        Best explanation, its effects included: what acts in the recordings alone makes no baseline another machine

    Returns
    -------
    dict of session to float
        [nat]
    """
    experiment, gram = fit.experiment, gram_of(fit.parts, base_of(fit))
    every, found = range(gram.count), {}

    def log_evidence(pieces: Sequence[Piece]) -> float:
        return over_sessions(gram, replace(experiment, pieces=tuple(pieces)), every).log_evidence

    together = log_evidence(experiment.pieces)
    for name in dict.fromkeys(experiment.session_of.get(r, "") for r in sorted(experiment.healthy)):
        mine, others = (
            [p for p in experiment.pieces if (experiment.session_of.get(p.recording, "") == name) == is_mine]
            for is_mine in (True, False)
        )
        if mine and others:
            found[name] = log_evidence(mine) + log_evidence(others) - together
    return found


def baselines_of(fit: Fit) -> tuple[list[int], Fit]:
    """Places of the baselines' pieces, and the part of a fit that is about them, in which everything may act."""
    experiment = fit.experiment
    at = [i for i, piece in enumerate(experiment.pieces) if piece.recording in experiment.healthy]
    alone = replace(
        experiment,
        healthy=frozenset(),
        pieces=tuple(experiment.pieces[i] for i in at),
        noise=tuple(experiment.noise[i] for i in at),
        starts=tuple(experiment.starts[i] for i in at),
        filters=None if experiment.filters is None else tuple(experiment.filters[i] for i in at),
    )
    metric = experiment.metric
    if metric is not None:
        alone = replace(alone, metric=replace(
            metric, sessions=sessions_of(alone), columns=tuple(metric.columns[i] for i in at),
            courses=tuple(metric.courses[i] for i in at if metric.courses),
        ))  # fmt: skip
    parts = [fit.parts[i] for i in at]
    return at, Fit(experiment=alone, z=fit.z, linearised=Linearised.of(parts, alone.metric))
