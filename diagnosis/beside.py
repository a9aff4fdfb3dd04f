"""How probable each finding is beside all the others: a look saw only what had been found before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from joblib import delayed

from diagnosis.explain import Explanation, instead
from diagnosis.hypotheses import Hypothesis
from diagnosis.parallel import spread
from diagnosis.stage import LEAST_RIVAL, Stage, penalised

Found = tuple[Hypothesis, Stage]


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
        delayed(_fitted)(start, final, final.labels.index(h.label), other)
        for (h, _), others in zip(found, rivals, strict=True) if others
        for other in (None, *others)
    ]  # fmt: skip
    fits = iter(spread(jobs, work))
    result = []
    for (h, stage), others in zip(found, rivals, strict=True):
        none, *anew = [next(fits) for _ in (None, *others)] if others else [None]
        result.append((h, _again(final, h, stage, none, [fit for fit in anew if fit is not None])))
    return result


def _rivals(final: Explanation, stage: Stage) -> list[Explanation]:
    """What a look held for about as likely, if anything was found after it."""
    if stage.accepted is None or set(stage.accepted.labels) == set(final.labels):
        return []
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
