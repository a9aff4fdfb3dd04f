"""Everything that was found, compared once more beside all the rest: a look saw only what had been found before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.candidates.explain import Explanation, instead, linearised, without
from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.acceptance import SECOND_GAIN, holds_out, stands
from diagnosis.decision.holdout import Judge
from diagnosis.decision.stage import LEAST_RIVAL, LEAST_SHARE, Stage, penalised
from models.base.parallel import run_parallel

Found = tuple[Hypothesis, Stage]
MOST_CHANGES = 3  # of what was found


def settled_beside(
    judge: Judge, start: Explanation, found: Sequence[Found], *, jobs: int = 1
) -> tuple[Judge, list[Found]]:
    """What was found, less what is not needed beside all the rest, and with what is more probable in its place.

    A rival takes the place of a finding that is less than half as probable, if it could have been accepted itself.

    Parameters
    ----------
    judge : Judge
        Of the explanation with everything that was found
    start : Explanation
        The calibration, with nothing found
    found : sequence of (Hypothesis, Stage)
        What is left of what was found, with the look that found it
    jobs : int
        Processes

    Returns
    -------
    judge, found : Judge, list of (Hypothesis, Stage)
        Of the explanation that came of it
    """
    ranked = ranked_beside(start, judge.base, found, jobs=jobs)
    for _ in range(MOST_CHANGES):
        better = _replaced(judge, start, ranked) or _dropped(judge, start, ranked)
        if better is None:
            break
        judge, ranked = better[0], ranked_beside(start, better[0].base, better[1], jobs=jobs)
    return judge, ranked


def _gain_of(h: Hypothesis, stage: Stage) -> float:
    return next((gain for fit, gain in zip(stage.fits, stage.gains, strict=True) if fit.labels[-1] == h.label), np.inf)


def _replaced(judge: Judge, start: Explanation, found: Sequence[Found]) -> tuple[Judge, list[Found]] | None:
    """The same with a rival in place of the finding that is behind its own by most; None where all stand."""
    behind = []
    for index, (h, stage) in enumerate(found):
        probability = {fit.labels[-1]: p for fit, p in zip(stage.fits, stage.probabilities(), strict=True)}
        if probability.get(h.label, 1.0) < LEAST_SHARE * max(probability.values()):
            behind.append((_gain_of(h, stage) - stage.gains[0], index))
    for _, index in sorted(behind):
        h, stage = found[index]
        if set(stage.fits[0].labels[:-1]) != set(judge.base.labels) - {h.label}:
            continue  # compared beside something else
        fit = linearised(stage.fits[0])
        if fit is not None and stands(judge, start, fit):
            rival = fit.found[-1]
            final = replace(fit, found=tuple(rival if one.label == h.label else one for one in judge.base.found))
            changed = (rival, replace(stage, accepted=fit))
            return Judge(judge.case, final), [changed if i == index else pair for i, pair in enumerate(found)]
    return None


def _dropped(judge: Judge, start: Explanation, found: Sequence[Found]) -> tuple[Judge, list[Found]] | None:
    """The same without the finding that is needed least; None where all are needed."""
    for index in sorted(range(len(found)), key=lambda i: _gain_of(*found[i])):
        h, stage = found[index]
        if len(found) == 1 or _gain_of(h, stage) >= SECOND_GAIN:
            return None
        try:
            slim = without(start, judge.base, judge.base.labels.index(h.label))
        except ArithmeticError:
            continue
        if holds_out(judge, start, slim):
            return Judge(judge.case, slim), [pair for i, pair in enumerate(found) if i != index]
    return None


def ranked_beside(start: Explanation, final: Explanation, found: Sequence[Found], *, jobs: int = 1) -> list[Found]:
    """What was found, each compared with its rivals once more, with everything else in place that was found.

    A look that saw all the rest already stays as it is.

    Parameters
    ----------
    start : Explanation
        The calibration, with nothing found
    final : Explanation
    found : sequence of (Hypothesis, Stage)
        What is left of what was found, with the look that found it
    jobs : int
        Processes
    """
    rivals = [_rivals(final, stage) for _, stage in found]
    work = [
        (start, final, final.labels.index(h.label), other)
        for (h, _), others in zip(found, rivals, strict=True) if others is not None
        for other in (None, *others)
    ]  # fmt: skip
    fits = iter(run_parallel(_fitted, work, jobs=jobs))
    result = []
    for (h, stage), others in zip(found, rivals, strict=True):
        none, *anew = [next(fits) for _ in (None, *others)] if others is not None else [None]
        result.append((h, _again(final, h, stage, none, [fit for fit in anew if fit is not None])))
    return result


def _rivals(final: Explanation, stage: Stage) -> list[Explanation] | None:
    """What a look held for about as likely; None where it saw all the rest already."""
    if stage.accepted is None or set(stage.accepted.labels) == set(final.labels):
        return None
    return [
        fit for fit, probability in zip(stage.fits, stage.probabilities(), strict=True)
        if probability >= LEAST_RIVAL and fit.found[-1].label not in final.labels
    ]  # fmt: skip


def _fitted(start: Explanation, final: Explanation, index: int, other: Explanation | None) -> Explanation | None:
    try:
        found = instead(start, final, index, other)
    except ArithmeticError:
        return None
    return replace(found, fit=found.fit.without_parts())


def _again(
    final: Explanation, h: Hypothesis, stage: Stage, none: Explanation | None, anew: Sequence[Explanation]
) -> Stage:
    """The look as it would be beside everything else; without a solution with nothing in that place as it was."""
    if none is None:
        return stage
    own = replace(final, found=(*(other for other in final.found if other.label != h.label), h))
    fits = (own, *anew)
    gains = tuple(penalised(fit) - none.log_evidence for fit in fits)
    return replace(stage, fits=fits, gains=gains, accepted=own).ranked()
