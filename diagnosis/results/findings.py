"""A finding for the report: place, sentence, equation, numbers, and the effects that it may be confused with."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from diagnosis.candidates.explain import Explanation
from diagnosis.candidates.heat import heats_of, mean_heat_of
from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.search import FORM_DOUBT
from diagnosis.decision.stage import LEAST_RIVAL, Stage
from diagnosis.results.places import node_in
from diagnosis.results.result_parts import Finding, ParameterValue, Rival
from diagnosis.setup.inference_setup import InferenceSetup, heat_over_time
from models.mechanisms import Mechanism, Placed

FORM_ERROR = 0.1  # of a strength and its heat: laws of the literature are hardly known better


def rivals_of(stage: Stage, catalogue: Mapping[str, Mechanism], doubt: float = 0.0) -> tuple[Rival, ...]:
    """Rival explanations, with the experiment that separates each from the accepted one.

    Parameters
    ----------
    stage : Stage
    catalogue : mapping of str to Mechanism
    doubt : float
        Probability that all of them are only what the form of an earlier finding lacks
    """
    if stage.accepted is None:
        return ()
    own = stage.accepted.found[-1]
    result = []
    for fit, probability in zip(stage.fits, stage.probabilities(), strict=True):
        other = fit.found[-1]
        told = float(probability) * (1.0 - doubt)
        if other is own or told < LEAST_RIVAL:
            continue
        result.append(Rival(
            mechanism=other.name, place=other.place, probability=told,
            separate_by=_separation(own, other, catalogue),
        ))  # fmt: skip
    return tuple(sorted(result, key=lambda r: -r.probability))


def _separation(own: Hypothesis, other: Hypothesis, catalogue: Mapping[str, Mechanism]) -> str:
    if own.name == other.name:
        if own.term is not None and other.term is not None and own.term.target[0] == other.term.target[0]:
            return f"see on the machine which: {own.place.replace('_', ' ')}, or {other.place.replace('_', ' ')}"
        return f"a temperature sensor at {other.place.replace('_', ' ')}"
    if own.name in catalogue:
        return catalogue[own.name].separation(other.name)
    if other.name in catalogue:
        return catalogue[other.name].separation(own.name)
    return "a second recording with other speeds and torques"


def finding_of(
    case: InferenceSetup, final: Explanation, h: Hypothesis, stage: Stage, catalogue: Mapping[str, Mechanism]
) -> Finding:
    """A finding with the values of the final explanation."""
    probabilities = dict(zip((f.found[-1].label for f in stage.fits), stage.probabilities(), strict=True))
    doubt = 0.0 if final.found[0].label == h.label else FORM_DOUBT
    values = _with_form(h, _with_bias(final, h))
    heats = heats_of(final, h)
    pieces = [part.trajectory.piece for part in final.fit.parts]
    together = np.abs(np.concatenate(heats)) if heats else np.zeros(1)
    mean, stderr = mean_heat_of(final, h)
    stderr = math.hypot(stderr, FORM_ERROR * mean)
    term = h.term
    if term is not None:
        known = {name: value for name, (value, _) in values.items()}
        term = term.with_values(known)
        equation = term.equation(known)
        units = {p.name: p.unit for p in term.parameters}
        prefix = f"{term.label}_"
    else:
        equation, units, prefix = "", {p.name: p.unit for p in case.nominal.parameters}, ""
    return Finding(
        mechanism=h.name,
        family=h.family,
        place=h.place,
        node=node_in(case.nominal, h),
        kind="parameter" if h.term is None else "sensor" if h.term.of_measurement else h.term.kind,
        says=_says(h, values),
        reference=h.term.mechanism.reference if isinstance(h.term, Placed) else "",
        equation=equation,
        probability=float(probabilities.get(h.label, 0.0)) * (1.0 - doubt),
        log_bayes=next((g for f, g in zip(stage.fits, stage.gains, strict=True) if f.labels[-1] == h.label), 0.0),
        parameters=tuple(
            ParameterValue(name=name.removeprefix(prefix), value=value, stderr=sd, unit=units.get(name, "1"))
            for name, (value, sd) in values.items()
        ),
        confusable_with=rivals_of(stage, catalogue, doubt),
        heat_mean_W=mean,
        heat_stderr_W=stderr,
        heat_max_W=float(together.max()),
        heat=heat_over_time(pieces, heats) if heats else {},
        term=term,
    )


def _says(h: Hypothesis, values: Mapping[str, tuple[float, float]]) -> str:
    if isinstance(h.term, Placed):
        return h.term.says
    value = next(iter(values.values()), (float("nan"), 0.0))[0]
    return f"The parameter {h.place} is {value:.3g}, far from what the definition allows."


def _with_form(h: Hypothesis, values: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Parameter values of a finding; a law's strength includes the error of its form, a sensor fault's does not."""
    if h.term is None or h.term.of_measurement:
        return dict(values)
    value, sd = values[h.term.strength.name]
    return {**values, h.term.strength.name: (value, math.hypot(sd, FORM_ERROR * value))}


def _with_bias(final: Explanation, h: Hypothesis) -> dict[str, tuple[float, float]]:
    """Parameter values of a finding; a bias includes the sensor's ordinary tolerance."""
    values = final.values_of(h)
    term = h.term
    if term is None or term.form != "shift" or term.kind != "sensor" or len(term.parameters) != 1:
        return values
    if {s.name for s in term.expression.free_symbols} != {term.strength.name}:
        return values
    items, fit = final.fit.unknowns.items, final.fit
    (own,) = fit.unknowns.of([term.strength])
    bias = next((i for i, item in enumerate(items) if item.role == "bias" and item.target == term.target[0]), None)
    if bias is None:
        return values
    pick = np.zeros(len(items))
    pick[own], pick[bias] = items[own].parameter.sd, items[bias].parameter.sd
    total = items[own].value(float(fit.z[own])) + items[bias].value(float(fit.z[bias]))
    return {term.strength.name: (total, float(np.sqrt(pick @ fit.covariance @ pick)))}
