"""Posteriors made by hand, and effects in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.learnt import error_classes, rule
from diagnosis.results.result import Diagnosis
from diagnosis.setup.inference_setup import InferenceSetup
from models.mechanisms import CATALOGUE

WINDAGE_W, NOISE_K = 65.0, 0.1
Prepared = tuple[InferenceSetup, Experiment, Fit]
Assemble = Callable[..., Diagnosis]


def effect_of(setup: InferenceSetup, fit: Fit, name: str, place: str) -> Hypothesis:
    network = fit.experiment.machine.model.network
    found = next(p for p in CATALOGUE[name].placed(network, setup.scale, setup.channels) if p.place == place)
    h = hypothesis_of(found)
    return replace(h, variants=h.variants[[len(h.variants) // 2]], log_prior=-5.0)


def judged_of(prepared: Prepared, name: str, place: str, log_bayes: float) -> Judged:
    setup, _, plain = prepared
    return Judged(effects=(effect_of(setup, plain, name, place),), log_bayes=log_bayes,
                  error_class=error_classes()[0])  # fmt: skip


def posterior_of(
    nothing: Fit, *judged: Judged, log_e: float = 80.0, remainder: float | None = None, **given: Any
) -> Posterior:
    if remainder is not None:
        judged = (replace(judged[0], left=remainder), *judged[1:])
    return Posterior(
        nothing=Judged(effects=(), log_bayes=0.0, fit=nothing, error_class=error_classes()[0]),
        judged=judged, log_e=log_e,
        threshold=4.0, class_threshold=4.0, rule=replace(rule(), temper=(3.0, 0.0)), **given,
    )  # fmt: skip
