"""Evidence for the catalogue in baselines, where nothing is missing: it is model error, so it does not count."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Placebo
from diagnosis.decision.scanned import OVER_TIME, Scanned, counts_less, scan_in_classes
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.families import with_priors
from diagnosis.engine.fit import Experiment
from diagnosis.engine.learnt import rule
from diagnosis.engine.scan import scan, scope_of

CandidatesIn = Callable[[Experiment], Sequence[Hypothesis]]


def judge_baselines(
    calibration: Calibration, candidates: Sequence[Hypothesis], candidates_in: CandidatesIn
) -> tuple[Placebo | None, tuple[Hypothesis, ...]]:
    """Evidence in every baseline, tested against the others alone, as if it were as many hours as those tested.

    The tested recordings have no say in it: next to an effect in them a baseline would seem to have the opposite one.

    Parameters
    ----------
    candidates : sequence of Hypothesis
        Of the tested recordings
    candidates_in : callable
        Gives what may be missing, wrong or changed in an experiment

    Returns
    -------
    placebo : Placebo or None
        Of all laws that are always there together, in the baseline that brings most; None without baselines
    candidates : tuple of Hypothesis
        Of those that change over time only counts what goes beyond the baselines. Two that are long enough are trusted
        to show what a wrong model makes of changes of the machine (baselines of 2 and 4 h were not, of a healthy one
        that was tested for 22 h); not of those of a channel, which pick what the model has of that channel alone: a
        healthy rig has 72 nat of a loss meter that steps
    """
    whole, reached, over_time = calibration.fit.experiment, list[Placebo](), dict[str, float]()
    if not whole.healthy:
        return None, tuple(candidates)
    hours = dict.fromkeys((piece.recording for piece in whole.pieces), 0.0)
    for piece in whole.pieces:
        hours[piece.recording] += piece.duration
    tested = sum(value for name, value in hours.items() if name not in whole.healthy)
    fit = calibration.fit.part(whole.baselines)
    calibration = replace(calibration, chosen=replace(calibration.chosen, fit=fit))
    experiment, columns = fit.experiment, [calibration.near.columns[i] for i in whole.baselines]
    for pieces in experiment.sessions:
        starts, now = dict[str, float](), 0.0
        for piece in map(experiment.pieces.__getitem__, pieces):
            now = starts.setdefault(piece.recording, now) + float(piece.time[-1])
        swapped = replace(experiment, healthy=whole.healthy - starts.keys(), starts_at=starts)
        tried = [one for one in candidates_in(swapped) if one.term is None or scope_of(whole, one) is not None]
        there = scan(replace(fit, experiment=swapped), with_priors(tried), columns)
        judged = scan_in_classes(calibration, there)
        longer = max(tested / sum(hours[name] for name in starts), 1.0)
        always = _part(judged, [i for i, one in enumerate(judged.candidates) if one.how not in OVER_TIME])
        best = next((one for one in map(always.candidates.__getitem__, always.order) if one.term is not None), None)
        if best is not None:  # else what is switched off has no place in this machine
            session = experiment.session_of.get(min(starts), "")
            reached.append(
                Placebo(session=session, log_e_value=always.log_e * longer, mechanism=best.mechanism, place=best.place)
            )
        for one, value, here in zip(judged.candidates, judged.log_bayes.tolist(), judged.best, strict=True):
            if one.how in OVER_TIME:
                taken = float(counts_less([one], calibration.chosen.error_class, here.error_class)[0])
                over_time[one.law] = max((value + taken) * longer, over_time.get(one.law, 0.0))
    trusted = are_trusted(len(experiment.sessions), sum(hours[name] for name in whole.healthy), tested)
    less = tuple(
        replace(one, less=over_time.get(one.law, 0.0), trusted=trusted and not one.of_measurement)
        if one.how in OVER_TIME else one
        for one in candidates
    )  # fmt: skip
    return max(reached, key=lambda one: one.log_e_value, default=None), less


def are_trusted(sessions: int, lasting: float, tested: float) -> bool:
    """True if so many sessions of baselines, which last so long together, show what goes wrong in such a time [s]."""
    least, share = rule().trusted
    return sessions >= least and lasting >= share * tested


def _part(scanned: Scanned, at: Sequence[int]) -> Scanned:
    return replace(
        scanned, candidates=tuple(scanned.candidates[i] for i in at), best=tuple(scanned.best[i] for i in at),
        log_bayes=scanned.log_bayes[np.array(at, dtype=int)],
    )  # fmt: skip
