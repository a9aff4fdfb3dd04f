"""From posterior and answers to the result: verdict, places, findings, fits, courses, and what to do next."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.answer import Answer, act_on_the_same
from diagnosis.decision.posterior import KINDS, Expected, Judged, Posterior
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.predict import Prediction
from diagnosis.engine.scale import at_stated_size
from diagnosis.forward.grid import too_short
from diagnosis.forward.whitening import RandomHeat
from diagnosis.recordings.recording import Recording
from diagnosis.results.advice import next_test
from diagnosis.results.findings import change_of, estimates_of, finding_of, joint_estimate_of, parameters_of
from diagnosis.results.held_out import validate
from diagnosis.results.instruments import sensors_and_inputs_of
from diagnosis.results.locations import locations_of
from diagnosis.results.mean_loss import mean_loss_of
from diagnosis.results.notes import air_notes, baseline_notes, limit_notes, ratio_notes
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.predictions import PredictingModel
from diagnosis.results.result import Diagnosis, Verdict
from diagnosis.results.result_parts import (
    NO_CLAIM,
    Calibrated,
    CalibratedModel,
    Change,
    Finding,
    NotDetectable,
    Ranked,
    called,
    spoiled_in,
)
from diagnosis.setup.inference_setup import InferenceSetup
from diagnosis.setup.noise import HEAT_FRACTION, HEAT_TIME_S, PARAMETRIC_FRACTION, PARAMETRIC_K, WANDER
from models.base.types import Array
from models.base.version import project_version
from models.terms.term import Term

BADLY = 2.0  # times the size that matters, which a calibrated model may be off for a "consistent"
ENOUGH_VISIBLE = 0.1  # of the effects that were asked for, for a "consistent" that means something
MOST_RANKED = 500
PROBABLY = 0.5
LEFT_OUT = "; a second effect was fitted too and is left out: the held-out recordings contradict it"


@dataclass(frozen=True, kw_only=True, eq=False)
class Others:
    """The machine by all channels but faulty ones.

    Attributes
    ----------
    channels : tuple of str
        The faulty ones
    apart : tuple of str
        All that were left out for the posterior
    """

    posterior: Posterior
    channels: tuple[str, ...]
    apart: tuple[str, ...]


def assemble(
    setup: InferenceSetup,
    experiment: Experiment,
    posterior: Posterior,
    answers: Sequence[Answer],
    *,
    plain: Fit,
    calibration: Calibration,
    others: Others | None = None,
) -> Diagnosis:
    """The result of a decision.

    Parameters
    ----------
    experiment : Experiment
        Of the nominal machine
    answers : sequence of Answer
        Most important first
    plain : Fit
        The nominal machine calibrated without model error, by all but faulty channels
    calibration : Calibration
        With model error
    others : Others or None
        What all but faulty channels say, if there are any
    """
    faulty = () if others is None else others.channels
    valid = validate(setup, experiment, posterior, answers, plain=plain, calibration=calibration, faulty=faulty)
    posterior, best, predicting = valid.posterior, valid.best, valid.model
    final, train, holdout = predicting.final, predicting.train, predicting.holdout
    settings, known = posterior.settings, setup.known
    reported = _distinct([
        (answer, finding_of(answer, answer.best.fit or final, setup, posterior))
        for answer in valid.answers
    ])  # fmt: skip
    findings = tuple(finding for _, finding in reported)
    unseen = _unseen(setup, posterior, findings)
    spoiled = spoiled_in(train, holdout, baselines=[r.name for r in setup.baseline],
                         least_K=settings.matters_K + setup.noise_K)  # fmt: skip
    badly = max(train.calibrated, holdout.calibrated) > BADLY * settings.matters_K + setup.noise_K
    # Held-out recordings that contradict one explanation do not make a machine healthy that the model is far from.
    unfit = bool(spoiled) or train.calibrated - train.before > setup.noise_K or (badly and valid.refuted is not None)
    verdict = verdict_of(posterior, [answer for answer, _ in reported], unseen, unfit=unfit, badly=badly)
    location = locations_of(setup, posterior) if posterior.detected or verdict in NO_CLAIM else ()
    inputs = setup.gearbox.network().inputs
    most_probable = predicting.best if others is None else others.posterior.nothing
    believed = (most_probable.fit if most_probable else None) or calibration.fit
    runs = predicting.train_runs
    effects = predicting.best.effects if predicting.best else ()
    model = _calibrated(final, (runs["after"], runs["before"]), believed, plain, inputs, effects)
    found = Diagnosis(
        verdict=verdict,
        gearbox=setup.gearbox.name,
        log_e_value=posterior.evidence,
        threshold=posterior.needed,
        further_threshold=posterior.class_threshold,
        location=location,
        findings=findings,
        model=model,
        train=train,
        holdout=holdout,
        faulty=faulty,
        terms=_terms(predicting.best, final),
        known=known,
        alone=_calibrated(plain, (runs["calibrated"], runs["before"]), calibration.fit, plain, inputs),
        joint=joint_estimate_of(final),
        starts_at=experiment.starts_at,
        noise_K=setup.noise_K,
        floor=_floor(setup, calibration.near.experiment.random_heat),
        misfit=_misfit(final),
        remaining_nat=0.0 if _looked_no_further(best) else posterior.left_by(best),
        remaining_note=_remaining(posterior, others, best) + (LEFT_OUT if valid.without_second else ""),
        ranking=_ranking(posterior, setup.recordings),
        unseen=unseen,
        not_tried=tuple(sorted(
            setup.catalogue.keys() - {one.effect.name for one in posterior.expected}
            - {f.mechanism for f in known.findings}
        )),
        next_test="",
        courses=_courses(setup, predicting),
        network=setup.nominal,
        shapes=setup.shapes,
        learnt=predicting.learnt,
        left_out_K=predicting.left_out_K,
        as_stated_K=predicting.as_stated_K,
        inputs=_provenance(setup),
        notes=(
            *air_notes(experiment), *ratio_notes(final), *limit_notes(final),
            *baseline_notes(experiment, posterior, valid.answers),
            *_notes_of_recordings(setup),
        ),
        kinds={kind: posterior.of(kind) for kind in KINDS},
        settings=settings,
        assumed=posterior.assumed,
        holdout_gain=valid.log_score_gain,
        contradicted=valid.contradicted,
        refuted=valid.refuted,
        spoiled=spoiled,
    )  # fmt: skip
    return replace(found, next_test=next_test(setup, found))


def _provenance(setup: InferenceSetup) -> dict[str, Any]:
    """Hashes of all that was given, and the version."""

    def hashes(recordings: Sequence[Recording]) -> dict[str, str]:
        return {recording.name: recording.hash for recording in recordings}

    return {
        "recordings": hashes(setup.recordings),
        "held_out": hashes(setup.holdout),
        "baselines": hashes(setup.baseline),
        "switched_off": list(setup.switched_off),
        "gearbox": setup.gearbox.hash,
        "correction": setup.known.summary()["sha256"] if setup.known.has_physics else None,
        "version": project_version(),
    }


def _notes_of_recordings(setup: InferenceSetup) -> Iterator[str]:
    """Pieces that were not used, and what was cleaned."""
    yield from too_short((*setup.recordings, *setup.baseline), setup.learnt)
    yield from too_short(setup.holdout, setup.held_out)
    for recording in (*setup.recordings, *setup.holdout, *setup.baseline):
        yield from (f"{recording.name}: {note}" for note in recording.notes)


def faulty_channels(posterior: Posterior, apart: Sequence[str]) -> tuple[str, ...]:
    """Channels at odds with all others whose sensors are more probably at fault than not."""
    return tuple(
        channel for channel in apart
        if sum(p for one, p in posterior.ranked
               if any(e.term is not None and e.term.kind == "sensor" and channel in e.term.target for e in one.effects)
               ) > PROBABLY
    )  # fmt: skip


def _terms(best: Judged | None, final: Fit) -> tuple[Term, ...]:
    """Terms of the fit that predicts, with its values and standard errors."""
    if best is None or best.fit is None:
        return ()
    found = [(effect.term, parameters_of(final, effect.term)) for effect in best.effects if effect.term is not None]
    return tuple(
        replace(term, parameters=tuple(
            replace(p, start=values[p.name][0], sd=values[p.name][1]) for p in term.parameters
        )) for term, values in found
    )  # fmt: skip


def _distinct(found: Sequence[tuple[Answer, Finding]]) -> list[tuple[Answer, Finding]]:
    """Without names that only act like something where another one acts on the same thing with more heat."""
    kept: list[Answer] = []
    for answer, _ in sorted(found, key=lambda one: (one[0].acts_like, -abs(one[1].heat_mean_W))):
        if not (answer.acts_like and any(act_on_the_same(answer.effect, one.effect) for one in kept)):
            kept.append(answer)
    return [(answer, finding) for answer, finding in found if any(answer is one for one in kept)]


# ---------------------------------------------------------------------- verdict


def verdict_of(
    posterior: Posterior, answers: Sequence[Answer], unseen: Sequence[NotDetectable], *, unfit: bool, badly: bool
) -> Verdict:
    """The verdict.

    Parameters
    ----------
    unfit : bool
        True if calibration made the model worse, of all or of some recordings, or left it far off where an effect was
        detected that does not predict: no machine was found that suits them
    badly : bool
        True if the calibrated model is far off: silence means nothing then
    """
    if posterior.parameter_outside:
        return "parameter_error"
    if not posterior.detected and unfit:
        return "unexplained"
    if not posterior.detected:
        asked = {one.effect.name for one in posterior.expected if one.effect.how == "always"}
        visible = 1.0 - len({one.mechanism for one in unseen}) / max(len(asked), 1)
        return "insufficient_data" if badly or (asked and visible < ENOUGH_VISIBLE) else "consistent"
    effects = [answer.effect for answer in answers if answer.effect.term is not None]
    if not effects or any(answer.best.kind == "outside" or answer.effect.is_open for answer in answers):
        return "unexplained"
    tied = [effect for answer in answers for effect, _ in answer.tied if effect.term is not None]
    if all(effect.of_measurement for effect in (*effects, *tied)):
        return "sensor_fault"
    return "missing_physics"


def _unseen(setup: InferenceSetup, posterior: Posterior, findings: Sequence[Finding]) -> tuple[NotDetectable, ...]:
    """Mechanisms that would not have been seen at the size that matters, at their best place."""
    catalogue = setup.catalogue
    told = {name for finding in findings for name in (finding.mechanism, *finding.tie_set)}
    told |= {rival.mechanism for finding in findings for rival in finding.confusable_with}
    if posterior.detected:  # nobody is silent about a name that looks like what is there
        told |= {one.effects[0].name for one in posterior.judged if one.log_bayes > posterior.threshold}
    best: dict[str, Expected] = {}
    for one in sorted(posterior.expected, key=lambda one: one.weight):
        if one.effect.name in catalogue:
            best[one.effect.name] = one
    return tuple(
        NotDetectable(mechanism=name, place=one.effect.place, needed=catalogue[name].experiment, expected=one.log_bayes)
        for name, one in sorted(best.items()) if one.weight < posterior.threshold and name not in told
    )  # fmt: skip


def _remaining(posterior: Posterior, others: Others | None, best: Judged | None) -> str:
    if not posterior.detected:
        return ""
    if others is not None:
        channels, rest = ", ".join(others.apart), others.posterior
        if rest.detected:
            return (f"something else is missing too (evidence {rest.log_e:.0f} nat without {channels}): "
                    f"leave {channels} out of the recordings and diagnose again")  # fmt: skip
        return f"without {channels} nothing stands out of noise and model error (evidence {rest.log_e:.1f} nat)"
    if _looked_no_further(best):
        return (
            f"two effects were fitted (evidence {posterior.left_by():.0f} nat of the second), no third was looked for"
        )
    left = posterior.left_by(best)
    if left > posterior.class_threshold:
        return f"a further effect would still help (evidence {left:.0f} nat)"
    return f"nothing stands out of noise and model error (evidence {left:.1f} nat of a further effect)"


def _looked_no_further(best: Judged | None) -> bool:
    """True if the answer is a pair, given which no scan looked for a third effect."""
    return best is not None and best.kind == "pair" and best.left is None


def _misfit(fit: Fit) -> float:
    """Mean square of the whitened residuals, model error taken into account."""
    rows = sum(len(part.residual) for part in fit.parts)
    return float(fit.linearised.products[0, 0]) / max(rows, 1)


def _floor(setup: InferenceSetup, factors: RandomHeat) -> str:
    share = HEAT_FRACTION
    text = f"of the typical loss ({setup.loss_W:.0f} W) in every part"
    if setup.gearbox.is_parametric:  # watts are known but for a common factor
        share = PARAMETRIC_FRACTION
        text += f"; of a part of little heat capacity {factors.heat * PARAMETRIC_K:.2g} K"
    less = {part.name: times for part, times in zip(setup.nominal.parts, factors.parts, strict=False) if times < 1.0}
    text += "".join(f"; {100.0 * times:.2g} % of that in {name}" for name, times in less.items())
    together = f", and draughts of {100.0 * factors.draught:.2g} % of all of it" if factors.draught else ""
    return (f"random heat of {100.0 * factors.heat * share:.2g} % {text}; "
            f"of {100.0 * factors.wander * WANDER:.2g} % of the heat of each to the surroundings{together}; "
            f"over {factors.time * HEAT_TIME_S / 60.0:.0f} min")  # fmt: skip


# ---------------------------------------------------------------------- fits and courses


def _courses(setup: InferenceSetup, predicting: PredictingModel) -> tuple[PredictedRun, ...]:
    def by_channel(values: Array) -> dict[str, Array]:
        return {name: values[:, i] for i, name in enumerate(setup.channels)}

    result, parts = [], [part.name for part in setup.nominal.parts]
    for held_out, states in ((False, predicting.train_runs), (True, predicting.holdout_runs)):
        for before, calibrated, after in zip(states["before"], states["calibrated"], states["after"], strict=True):
            piece = before.piece
            at = np.clip(np.arange(len(piece.time)), 0, len(piece.steps) - 1)
            others = {name: after.trajectory.T[:, i] for i, name in enumerate(parts)}
            result.append(PredictedRun(
                recording=piece.recording, held_out=held_out, time=piece.time,
                inputs=dict(zip(setup.model.laws.inputs, piece.inputs[at].T, strict=True)),
                measured=by_channel(piece.measured), before=by_channel(before.read),
                calibrated=by_channel(calibrated.read), after=others | by_channel(after.read),
                counts_from_s=before.counts_from,
                start=dict(zip(parts, after.trajectory.T[0].tolist(), strict=True)),
            ))  # fmt: skip
    return tuple(result)


def _calibrated(
    fit: Fit, runs: tuple[Sequence[Prediction], Sequence[Prediction]], believed: Fit, plain: Fit,
    inputs: Collection[str], effects: Sequence[Hypothesis] = (),
) -> CalibratedModel:  # fmt: skip
    """Every usual parameter, the sensors and the inputs of a fit, without those of effects.

    How far a parameter is from its prior is that of the definition: that of one found is wider.

    Parameters
    ----------
    runs : (sequence of Prediction, sequence of Prediction)
        Of the recordings that were learnt from, by it and by the machine as delivered
    believed : Fit
        With model error in place; what it does not have is as in `fit`
    """
    stated = {unknown.parameter.name: unknown for unknown in plain.experiment.unknowns}
    terms = [effect.term for effect in effects if effect.term is not None]
    found = {p.name for term in terms for p in term.parameters}
    usual = [one.parameter for one in fit.experiment.unknowns if one.parameter.name in {*stated} - found]
    values = estimates_of(fit)
    believed = at_stated_size(believed)
    estimates = {**values, **estimates_of(believed)}
    sensors, true_inputs = sensors_and_inputs_of(fit, findings=[term.label for term in terms], inputs=inputs)
    return CalibratedModel(
        calibration=tuple(
            Calibrated(parameter=p.name, prior=p.start, value=value, stderr=stderr, estimate=estimate,
                       estimate_stderr=sd, shift_in_sd=stated[p.name].z_of(estimate), unit=p.unit)
            for p in usual for (value, stderr), (estimate, sd) in [(values[p.name], estimates[p.name])]
        ),
        sensors=sensors, true_inputs=true_inputs, mean_loss=mean_loss_of(believed, fit, *runs),
    )  # fmt: skip


def _ranking(posterior: Posterior, recordings: Sequence[Recording]) -> tuple[Ranked, ...]:
    """Everything that was judged, most probable first, then by evidence; of a pair both names."""
    ranked = sorted(posterior.ranked, key=lambda one: (-round(one[1], 4), -one[0].log_bayes))
    return tuple(
        Ranked(
            mechanism=" + ".join(effect.name for effect in one.effects),
            place=" + ".join(effect.place for effect in one.effects),
            family=" + ".join(dict.fromkeys(effect.family for effect in one.effects)), log_bayes=one.log_bayes,
            probability=probability, date=_date_of(one, recordings),
            laws=tuple(called(effect.mechanism, effect.place) for effect in one.effects),
        )
        for one, probability in ranked[:MOST_RANKED]
    )  # fmt: skip


def _date_of(one: Judged, recordings: Sequence[Recording]) -> Change | None:
    dated = next((effect for effect in one.effects if effect.date is not None), None)
    if dated is None or one.fit is None:
        return None
    return change_of(estimates_of(one.fit), dated, one.fit.experiment, recordings)
