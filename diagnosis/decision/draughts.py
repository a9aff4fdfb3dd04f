"""Still air, or draughts: which of both leaves the best explanation."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.scanned import scan_in_classes
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.families import with_priors
from diagnosis.engine.scan import scan


def best_explained_first(both: Sequence[Calibration], candidates: Sequence[Hypothesis]) -> list[Calibration]:
    """Calibrations by the evidence of all single effects, which the scan gives, most first.

    Draughts chosen by the machine without an effect are large enough to pass for one: a fan that fails is a long calm.
    So an effect may be judged in still air, against a machine in draughts.
    """

    def evidence(one: Calibration) -> float:
        found = scan_in_classes(one, scan(one.fit, with_priors(candidates), one.near.columns))
        return one.chosen.log_evidence + found.log_e

    return sorted(both, key=evidence, reverse=True)
