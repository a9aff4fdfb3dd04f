"""Still air, or draughts: in which of both the explanations are to be weighed."""

from __future__ import annotations

from collections.abc import Sequence
from operator import add

from diagnosis.decision.posterior import Posterior
from diagnosis.decision.scanned import scan_in_classes
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.scan import Scan

FIT_BRINGS = 2.0  # times the evidence of the scan, that fits are given credit for; those of a switch may bring more


def worth_weighing(both: Sequence[tuple[Calibration, Scan]]) -> list[tuple[Calibration, Scan]]:
    """Calibrations in which an effect may be more probable than in the others, by the scan of all single ones.

    Draughts that the machine without an effect asks for are large enough to pass for one: a fan that fails is a long
    calm. So an effect may be judged in still air too, against the machine in draughts.

    Parameters
    ----------
    both : sequence of (Calibration, Scan)
        Of the same recordings, with different random heats
    """
    nothing = [calibration.chosen.log_evidence for calibration, _ in both]
    brings = [max(scan_in_classes(*one).log_e, 0.0) for one in both]
    best = max(map(add, nothing, brings))
    return [one for one, base, more in zip(both, nothing, brings, strict=True) if base + FIT_BRINGS * more >= best]


def most_probable(weighed: Sequence[tuple[Calibration, Posterior]]) -> tuple[Calibration, Posterior]:
    """The calibration with most evidence that something is missing, or else with most evidence without an effect."""
    found = [one for one in weighed if one[1].detected]
    if found:
        return max(found, key=lambda one: one[1].log_e)
    return max(weighed, key=lambda one: one[0].chosen.log_evidence)
