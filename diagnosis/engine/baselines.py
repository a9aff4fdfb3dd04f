"""What the baselines alone say: whether an effect acts in them too, and whether they are of the same machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.candidates import Scan, scan
from diagnosis.engine.fit import Fit
from diagnosis.engine.gram import Gram, Index
from diagnosis.engine.point import Column
from models.base.types import Array

LEAST = 5.0  # nats from which it is said


def scan_baselines(fit: Fit, candidates: Sequence[Hypothesis], further: Sequence[Sequence[Column]] = ()) -> Scan:
    """Linearise the baselines alone, every candidate as if it acted in them.

    Parameters
    ----------
    fit : Fit
        Of the machine without any of the candidates
    candidates : sequence of Hypothesis
    further : sequence, one per piece of the fit, of sequences of Column
        Such as model error, see :func:`diagnosis.engine.candidates.scan`

    Returns
    -------
    Scan
    """
    experiment = fit.experiment
    at = [i for i, piece in enumerate(experiment.pieces) if piece.recording in experiment.healthy]
    alone = replace(
        experiment,
        pieces=tuple(experiment.pieces[i] for i in at),
        noise=tuple(experiment.noise[i] for i in at),
        starts=tuple(experiment.starts[i] for i in at),
        filters=None if experiment.filters is None else tuple(experiment.filters[i] for i in at),
    )
    parts = tuple(fit.parts[i] for i in at)
    return scan(Fit(experiment=alone, z=fit.z, parts=parts), candidates, [further[i] for i in at] if further else ())


def effects_in_baselines(found: Scan, amplitudes: Array | float = 1.0) -> Array:
    """Log Bayes factor of every candidate in the baselines, against a baseline without it.

    Parameters
    ----------
    found : Scan
        Of :func:`scan_baselines`
    amplitudes : Array, shape (further columns,), or float
        Prior standard deviations of the further columns

    Returns
    -------
    Array, shape (candidates,)
        [nat]
    """
    given = found.gram.given(found.unknowns).given(found.further, amplitudes)
    return found.singles(given).log_bayes


def machine_apart(gram: Gram, unknowns: Index, amplitudes: Array | float, session: Sequence[str]) -> float:
    """Log Bayes factor for a session on a machine of its own, against the machine of all other recordings.

    Parameters
    ----------
    gram : Gram
        Of all recordings
    unknowns : sequence of int
        Of machine, sensors, model error, and effects that were found, whose columns are 0 in the baselines
    amplitudes : Array, shape (unknowns,), or float
        Prior standard deviations
    session : sequence of str
        Its recordings

    Returns
    -------
    float
        [nat]
    """
    others = set(gram.of_recording) - set(session)
    alone = sum(gram.given(unknowns, amplitudes, some).log_evidence for some in (others, set(session)))
    return alone - gram.given(unknowns, amplitudes).log_evidence


def notes_of_baselines(acting: float, apart: dict[str, float], effect: str = "") -> tuple[str, ...]:
    """What a report says about baselines that are not what they should be.

    Parameters
    ----------
    acting : float
        Of the effect that is reported, see :func:`effects_in_baselines`, [nat]
    apart : dict of session to float
        See :func:`machine_apart`, [nat]
    effect : str
        What is reported, as people call it
    """
    notes = []
    if effect and acting > LEAST:
        notes.append(
            f"The baselines show {effect} too (evidence {acting:.0f} nats): what is reported is then only what it has "
            "grown by. Take baselines from before it began, or leave them out."
        )
    notes += [
        f"Session {session} looks like another machine, or one that was rebuilt (evidence {nats:.0f} nats): its "
        "parameters are not those of the other recordings. Leave it out if that is so."
        for session, nats in apart.items() if nats > LEAST
    ]  # fmt: skip
    return tuple(notes)
