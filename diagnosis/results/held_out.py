"""Validation of answers on held-out recordings, which can take back a claim, a term of the model, or the detection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from diagnosis.decision.answer import Answer, decide, withdraw_claim
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.prepare import held_out_experiment
from diagnosis.engine.switch_grid import switch_numbers
from diagnosis.engine.to_predict import refit_to_predict
from diagnosis.forward.whitening import RandomHeat
from diagnosis.results.predictions import PredictingModel, predict_recordings
from diagnosis.results.result_parts import Fits, Refuted, named
from diagnosis.setup.inference_setup import InferenceSetup


@dataclass(frozen=True, kw_only=True, eq=False)
class Validated:
    """A decision, validated on the held-out recordings.

    Attributes
    ----------
    posterior : Posterior
    answers : sequence of Answer
        To report
    best : Judged or None
        Their explanation
    log_score_gain : float
        Of it on the held-out readings, [nat]
    contradicted : bool
        True if the held-out recordings contradict the answers
    model : PredictingModel
        With `best`, but where that makes held-out temperatures worse
    without_second : bool
        True if a second effect was left out because it does the harm
    refuted : Refuted or None
        What would have been detected without the held-out recordings
    """

    posterior: Posterior
    answers: Sequence[Answer]
    best: Judged | None
    log_score_gain: float
    contradicted: bool
    model: PredictingModel
    without_second: bool
    refuted: Refuted | None


def validate(
    setup: InferenceSetup, experiment: Experiment, posterior: Posterior, answers: Sequence[Answer], *,
    plain: Fit, calibration: Calibration, faulty: Sequence[str],
) -> Validated:  # fmt: skip
    """Predict the held-out recordings by the answers, and withdraw what they contradict.

    Parameters
    ----------
    experiment, answers, plain, calibration
        See :func:`diagnosis.results.assemble.assemble`
    faulty : sequence of str
        Channels that do not count
    """
    counting = [name for name in setup.channels if name not in faulty]
    found = calibration.near.experiment.random_heat
    held_out = held_out_experiment(setup, experiment).with_random_heat(
        RandomHeat(draught=found.draught, parts=found.parts)
    )

    def model_with(best: Judged | None) -> PredictingModel:
        return predict_recordings(
            experiment, held_out, plain=plain, found=_final(best, plain, faulty), best=best,
            written_into=None if faulty else best or posterior.nothing, near=calibration.near, counting=counting,
            noise_K=setup.noise_K,
        )  # fmt: skip

    def contradict(one: PredictingModel) -> bool:
        """True if the held-out recordings contradict what is in a model."""
        best, gain = one.best, one.holdout_gain
        unconfirmed = best is not None and (
            (best.error_class.is_large and all(effect.how == "always" for effect in best.effects)
             and gain < posterior.rule.confirmed)
            or _switches_for_nothing(best, one.holdout)
        )  # fmt: skip
        return not faulty and (unconfirmed or one.holdout.contradict(gain, setup.noise_K, posterior.class_threshold))

    model, without_second, refuted = model_with(_best(posterior, answers)), False, None
    if contradict(model) and model.best is not None and len(model.best.effects) == 2:
        # A second effect that the held-out recordings contradict takes nothing back from the first one.
        singles = replace(posterior, judged=tuple(one for one in posterior.judged if len(one.effects) == 1))
        alone = decide(singles)
        first = model_with(_best(singles, alone))
        if first.holdout_gain > model.holdout_gain:
            posterior, answers, model, without_second = singles, alone, first, not contradict(first)
    both = posterior.log_e + model.holdout_gain
    if model.best is not None and posterior.detected and both < posterior.threshold and not faulty:
        names = " and ".join(named(effect.mechanism, effect.place) for effect in model.best.effects)
        refuted = Refuted(names=names, log_e_value=posterior.log_e, log_score_gain=model.holdout_gain)
        posterior = replace(posterior, log_e=both)
        answers, without_second = decide(posterior), False
        model = model_with(_best(posterior, answers))
    best, gain, contradicted = model.best, model.holdout_gain, contradict(model) and bool(answers)
    if contradicted:
        answers = [withdraw_claim(answer, posterior.rule) for answer in answers]
    if contradicted and model.holdout.after > model.holdout.calibrated:
        train, holdout, model = model.train, model.holdout, model_with(None)
        model = replace(model, train=replace(model.train, found=train.found),
                        holdout=replace(model.holdout, found=holdout.found))  # fmt: skip
    return Validated(posterior=posterior, answers=answers, best=best, log_score_gain=gain, contradicted=contradicted,
                      model=model, without_second=without_second, refuted=refuted)  # fmt: skip


def _switches_for_nothing(best: Judged, holdout: Fits) -> bool:
    """True if an explanation has a control that switches, with which held-out temperatures are no nearer.

    It has so many numbers and minima that it can follow what comes and goes for another reason.
    """
    switches = any(effect.term is not None and switch_numbers(effect.term) for effect in best.effects)
    return switches and holdout.after >= holdout.calibrated


def _best(posterior: Posterior, answers: Sequence[Answer]) -> Judged | None:
    """The explanation that predicts: of the answers, else the most probable one, which needs no name for that.

    A heat that is like no law is never fitted and predicts nothing: the most probable law does so in its place.
    """
    if answers and answers[0].best.fit is not None:
        return answers[0].best
    fitted = (one for one, _ in posterior.ranked if one.fit is not None and one.kind != "nothing")
    return next(fitted, None) if posterior.detected else None


def _final(best: Judged | None, plain: Fit, faulty: Sequence[str]) -> Fit:
    """The fit that predicts: of the best explanation, without model error; else of the machine as calibrated."""
    first = best.fit if best else None
    if first is None:
        return plain
    try:
        return refit_to_predict(first, plain, faulty)
    except ArithmeticError:  # no solution without what model error allows
        return first
