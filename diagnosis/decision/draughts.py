"""Still air, or draughts: in which of both the explanations are to be weighed."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Posterior
from diagnosis.decision.scanned import scan_in_classes
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.families import with_priors
from diagnosis.engine.scan import scan

FIT_BRINGS = 2.0  # times the evidence of the scan, that fits are given credit for; those of a switch may bring more


def worth_weighing(both: Sequence[Calibration], candidates: Sequence[Hypothesis]) -> list[Calibration]:
    """Calibrations in which an effect may be more probable than in the others, by the scan of all single ones.

    Draughts that the machine without an effect asks for are large enough to pass for one: a fan that fails is a long
    calm. So an effect may be judged in still air too, against the machine in draughts.

    Parameters
    ----------
    both : sequence of Calibration
        Of the same recordings, with different random heats
    candidates : sequence of Hypothesis
        All that may be missing, without priors
    """
    evidence = [max(scan_in_classes(one, scan(one.fit, with_priors(candidates), one.near.columns)).log_e, 0.0)
                for one in both]  # fmt: skip
    best = max(one.chosen.log_evidence + more for one, more in zip(both, evidence, strict=True))
    return [one for one, more in zip(both, evidence, strict=True)
            if one.chosen.log_evidence + FIT_BRINGS * more >= best]  # fmt: skip


def most_probable(weighed: Sequence[tuple[Calibration, Posterior]]) -> tuple[Calibration, Posterior]:
    """The calibration with most evidence that something is missing, or else with most evidence without an effect."""
    found = [one for one in weighed if one[1].detected]
    if found:
        return max(found, key=lambda one: one[1].log_e)
    return max(weighed, key=lambda one: one[0].chosen.log_evidence)
