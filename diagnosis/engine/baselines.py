"""Tests of the baselines after an inference: an effect that acts in them too, and sessions of another machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.candidates import scan
from diagnosis.engine.fit import Fit, Linearised
from diagnosis.engine.products import base_of, gram_of
from diagnosis.engine.sessions import over_sessions, sessions_of
from diagnosis.forward.grid import Piece
from models.base.types import Array

NOTED_FROM = 5.0  # nats


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
    alone = _baselines_of(fit)
    return scan(alone, candidates).log_bayes


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


def notes_of_baselines(acting: float, apart: Mapping[str, float], effect: str = "") -> tuple[str, ...]:
    """Notes for a report on baselines that are not as they should be.

    Parameters
    ----------
    acting : float
        Evidence in the baselines for the effect that is reported, see :func:`effects_in_baselines`, [nat]
    apart : mapping of session to float
        See :func:`sessions_apart`, [nat]
    effect : str
        Its name for people
    """
    notes = []
    if effect and acting > NOTED_FROM:
        notes.append(
            f"The baselines show {effect} too (evidence {acting:.0f} nats): the reported size is only its growth since "
            "then. Take baselines from before it began, or leave them out."
        )
    notes += [
        f"Session '{session}' looks like another machine, or one that was rebuilt (evidence {nats:.0f} nats): its "
        "parameters are not those of the other recordings. Leave it out if that is so."
        for session, nats in apart.items() if nats > NOTED_FROM
    ]  # fmt: skip
    return tuple(notes)


def _baselines_of(fit: Fit) -> Fit:
    """Part of a fit that is about the baselines, in which everything may act."""
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
    return Fit(experiment=alone, z=fit.z, linearised=Linearised.of(parts, alone.metric))
