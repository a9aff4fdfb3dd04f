r"""Deviations between test sessions, as a mixture.

A machine does not repeat exactly. Every unknown and every model error may differ from session to session by a share
:math:`s` of its prior standard deviation; how much is not known, so evidences are weighed over a grid of `s`. All rows
weigh it, under nothing as under every candidate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.gram import Given, Gram, base_of, gram_of
from diagnosis.engine.learnt import deviation_priors, rule
from models.base.types import Array

SURE, ROUNDING = 0.95, 1e-9  # probability that a machine does not repeat worse


@dataclass(frozen=True, kw_only=True, eq=False)
class OverSessions:
    """Products of a Gram matrix for every deviation between sessions.

    Attributes
    ----------
    deviations, log_priors : Array, shape (S,)
    given : tuple of Given
        With unknowns and model error marginalised
    """

    deviations: Array
    log_priors: Array
    given: tuple[Given, ...]

    @property
    def weights(self) -> Array:
        """Log prior and evidence of every deviation, shape (S,)."""
        return np.asarray(self.log_priors + np.array([one.log_evidence for one in self.given]))

    @property
    def log_evidence(self) -> float:
        """Log evidence of the readings, all deviations weighed."""
        return float(logsumexp(self.weights))

    @property
    def mean(self) -> float:
        """Mean deviation that the readings support, in prior standard deviations."""
        return float(np.exp(self.weights - self.log_evidence) @ self.deviations)

    @property
    def most_probable(self) -> int:
        """Place of the deviation with the largest weight."""
        return int(np.argmax(self.weights))

    def weighed(self, log_bayes: Sequence[Array]) -> Array:
        """Log Bayes factors over all deviations from those of each."""
        return np.asarray(logsumexp(self.weights[:, None] + np.stack(log_bayes), axis=0) - self.log_evidence)


def over_sessions(
    gram: Gram, experiment: Experiment, unknowns: Sequence[int], fixed: Sequence[int] = ()
) -> OverSessions:
    """Marginalise unknowns and model error, with deviations between sessions.

    Parameters
    ----------
    experiment : Experiment
        Says which recordings are one session, and how far sessions may differ
    unknowns : sequence of int
        Columns with prior N(0, 1) that may differ between sessions
    fixed : sequence of int
        Columns with prior N(0, 1) that do not
    """
    recordings = [{experiment.pieces[p].recording for p in pieces} for pieces in experiment.sessions]
    prior = deviation_priors() if len(recordings) > 1 else {0.0: 1.0}
    every = np.array([*unknowns, *fixed], dtype=int)
    found = []
    for s in prior:
        own = [gram.given(unknowns, s, recordings=names) for names in recordings]
        matrix = np.sum([one.matrix for one in own], axis=0)
        whole = Given(matrix=matrix, log_determinant=sum(one.log_determinant for one in own))
        found.append(whole.given(every))
    deviations, log_priors = np.array(list(prior)), np.log(list(prior.values()))
    possible = deviations <= experiment.most_deviation
    log_priors = np.where(possible, log_priors - logsumexp(log_priors[possible]), -np.inf)
    return OverSessions(deviations=deviations, log_priors=log_priors, given=tuple(found))


def most_deviation(gram: Gram, experiment: Experiment) -> float:
    """Deviation between sessions that the baselines alone do not exceed, at least the one that all are granted.

    The tested recordings have no say in it: a machine that has changed would pass for one that does not repeat. With a
    single baseline what is assumed before decides.

    Parameters
    ----------
    gram : Gram
        Of residual, unknowns and model error
    experiment : Experiment
        Says which recordings are baselines, and which are one session

    Returns
    -------
    float
        In prior standard deviations; without baselines there is no limit
    """
    if not experiment.healthy:
        return np.inf
    alone, prior = experiment.part(experiment.baselines), deviation_priors()
    repeated = len(alone.sessions) > 1
    weights = over_sessions(gram, alone, range(gram.count)).weights if repeated else np.log(list(prior.values()))
    below = np.cumsum(np.exp(weights - logsumexp(weights)))
    return max(rule().repeats, float(np.array(list(prior))[np.searchsorted(below, SURE - ROUNDING)]))


def fit_over_sessions(fit: Fit, base: int) -> OverSessions:
    """A fit with all deviations between sessions weighed.

    Parameters
    ----------
    base : int
        How many of its unknowns, from the first, may differ between sessions; the others are those of an effect
    """
    count = len(fit.z)
    gram = gram_of(fit.parts, base_of(fit))
    error = range(count, gram.count)
    return over_sessions(gram, fit.experiment, [*range(base), *error], range(base, count))


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
    sessions = [experiment.session_of.get(piece.recording, "") for piece in experiment.pieces]
    found = {}

    def log_evidence(at: Sequence[int]) -> float:
        return over_sessions(gram, experiment.part(at), range(gram.count)).log_evidence

    together = log_evidence(range(len(sessions)))
    for name in dict.fromkeys(experiment.session_of.get(r, "") for r in sorted(experiment.healthy)):
        mine, others = ([i for i, one in enumerate(sessions) if (one == name) is it] for it in (True, False))
        if mine and others:
            found[name] = log_evidence(mine) + log_evidence(others) - together
    return found
