"""Where a calibration begins if the machine is known to have a switch or a memory with numbers that are known roughly.

The objective has many minima along a set-point: a control that hardly misses a peak never switches. So the numbers are
looked for as those of a mechanism that nobody knew of, by two scans of a grid with switches that follow the readings,
and the calibration begins at the best place.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Experiment, calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.switch_grid import finer_scans, switch_numbers
from diagnosis.setup.inference_setup import InferenceSetup
from models.base.types import Array
from models.correction.corrected_gearbox import corrected_gearbox
from models.terms.term import Term

WIDTH, VARIANTS, POINTS = 2.0, 700, 61  # prior sd to either side; how many places a grid has, and in one direction


def start_with_switches(setup: InferenceSetup, experiment: Experiment) -> Array | None:
    """Unknowns to start from, shape (unknowns,); None if no switch has uncertain numbers: the middles of the priors."""
    values: dict[str, float] = {}
    findings = setup.known.findings
    for known in findings:
        term = _may_be_absent(known.term)
        rough = _roughly_known(term)
        if not rough:
            continue
        others = tuple(finding for finding in findings if finding is not known)
        without = corrected_gearbox(setup.gearbox, setup.known.model_copy(update={"findings": others}))
        with suppress(ArithmeticError):
            lacking = prepare_experiment(without, setup.recordings, setup.holdout, setup.baseline)[1]
            fit = calibrate(replace(lacking, healthy=frozenset()))  # what is known acts in the baselines too
            shape = np.array([[1.0, *(p.start for p in term.parameters[1:])]])
            here = Hypothesis(name=term.label, place=term.label, family="known", law=term.label, term=term,
                              variants=shape)  # fmt: skip
            points = min(int(VARIANTS ** (1.0 / len(rough))), POINTS)
            reaches = [WIDTH * term.parameters[i].sd for i in rough]
            found, *_ = finer_scans(fit, here, rough, reaches, points=points, levels=2)
            values |= {term.parameters[i].name: float(found.variants[0, i]) for i in rough}
    if not values:
        return None
    return np.array([u.z_of(values.get(u.parameter.name, u.value(0.0))) for u in experiment.unknowns])


def _may_be_absent(term: Term) -> Term:
    """A term that may be absent, as in a scan."""
    strength, *shapes = term.parameters
    return replace(term, parameters=(replace(strength, sd=abs(strength.start) + strength.sd), *shapes))


def _roughly_known(term: Term) -> list[int]:
    """Places of the uncertain parameters that decide when a term switches, or else of those of its memories."""
    if any(state.update is not None for state in term.states):
        return switch_numbers(term)
    remembered = {symbol.name for state in term.states for symbol in state.rate.free_symbols}
    return [i for i, p in enumerate(term.parameters[1:], start=1) if p.name in remembered and p.sd > 0.0]
