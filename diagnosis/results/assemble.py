"""From what the search found to the result: places, findings, fits, courses, and what to do next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from diagnosis.candidates.explain import Explanation
from diagnosis.candidates.heat import heats_of
from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.acceptance import SECOND_GAIN
from diagnosis.decision.holdout import at_holdout
from diagnosis.decision.search import Search
from diagnosis.decision.stage import TEMPER, Stage, log_weights
from diagnosis.inference.evidence import Marginal
from diagnosis.inference.latent import LatentHeat, knots_of, latent_heat
from diagnosis.inference.noise import HEAT_FRACTION, PARAMETRIC_FRACTION, PARAMETRIC_K
from diagnosis.inference.posterior import Problem
from diagnosis.inference.predict import Prediction, overall_rmse, predict, rmse
from diagnosis.inference.shapes import shape_terms
from diagnosis.recordings.recording import Recording
from diagnosis.results.findings import finding_of
from diagnosis.results.identifiable import scale_notes
from diagnosis.results.places import node_in
from diagnosis.results.regime import active, regime, windows
from diagnosis.results.result import Diagnosis, Verdict
from diagnosis.results.result_parts import (
    Calibrated,
    Finding,
    Fits,
    Location,
    MissingHeat,
    NotDetectable,
    PredictedRun,
    Ranked,
)
from diagnosis.setup.inference_setup import FLOORS, InferenceSetup, heat_over_time
from models.base.parallel import run_parallel
from models.base.types import Array
from models.base.version import project_version
from models.mechanisms import OPEN_FORM, Mechanism
from models.quantities.quantities import TOTAL_LOSS, is_total_loss

ENOUGH_VISIBLE = 0.2  # of the catalogue, for a "consistent" that means something
REMAINING_W_SHARE = 0.03  # of the typical loss: a smaller remainder is not worth a word
MOST_MISFIT = 1.0  # noise and structural floor themselves make 0.6 of it in recordings that are explained
UNEXPLAINED_SHARE = 0.25  # of the evidence that is left when the catalogue has done its best


def assembled(
    case: InferenceSetup, found: Search, catalogue: Mapping[str, Mechanism], train: Sequence[Recording],
    holdout: Sequence[Recording], *, false_alarm_rate: float, jobs: int = 1,
) -> Diagnosis:  # fmt: skip
    """The result of a search.

    Parameters
    ----------
    case : InferenceSetup
    found : Search
    catalogue : mapping of str to Mechanism
    train, holdout : sequence of Recording
    false_alarm_rate : float
    jobs : int
        Processes
    """
    detected = found.detected
    findings = tuple(finding_of(case, found.final, h, stage, catalogue) for h, stage in found.findings if detected)
    both = [found.final, found.calibrated] if detected else []
    remaining, first = run_parallel(_latents, [(case, explanation) for explanation in both], jobs=jobs) or ((), ())
    unseen = _unseen(found.stages[-1], catalogue, found.threshold)
    misfit = max(found.final.misfit, found.judge.misfit if detected else 0.0)
    left = _much_is_left(misfit, first, remaining)
    verdict = _verdict(found, findings, unseen, left=left, detected=detected, catalogue=catalogue)
    location = _location(case, found, findings, first) if detected else ()
    shown = _shown(findings, location)
    missing = _missing_heat(case, found, remaining if findings else first, shown) if detected else ()
    predictions = _predictions(case, found, jobs)
    remaining_p, note = _remaining(found, remaining, case, left=left, misfit=misfit, detected=detected)
    return Diagnosis(
        verdict=verdict,
        gearbox=case.gearbox.name,
        log_e_value=found.stages[0].log_e_value,
        threshold=found.threshold,
        p_value=float(min(1.0, np.exp(-max(found.stages[0].log_e_value, -50.0)))),
        false_alarm_rate=false_alarm_rate,
        location=location,
        findings=findings,
        calibration=_calibration(case, found.final),
        train=_fits(case, predictions, "train"),
        holdout=_fits(case, predictions, "holdout"),
        noise_K=case.noise_K,
        floor=_floor(case, found),
        misfit=misfit,
        remaining_p_value=remaining_p,
        remaining_note=note,
        ranking=_ranking(found),
        unseen=unseen,
        next_test=_next_test(verdict, findings, unseen, catalogue, {i for r in (*train, *holdout) for i in r.assumed}),
        missing_heat=missing,
        courses=_courses(case, predictions),
        network=case.nominal,
        shapes=shape_terms(case.nominal, case.scale),
        inputs={
            "recordings": {r.name: r.sha256 for r in train},
            "held_out": {r.name: r.sha256 for r in holdout},
            "gearbox": case.gearbox.hash,
            "version": project_version(),
        },
        notes=(
            *scale_notes(found.final),
            *(f"{r.name}: {note}" for r in (*train, *holdout) for note in r.notes),
        ),
    )


def _floor(case: InferenceSetup, found: Search) -> str:
    share, floor = HEAT_FRACTION, found.final.problem.floor
    text = f"in every part: {'assumed' if floor == FLOORS[0] else 'raised because the remainder asks for it'}"
    if case.gearbox.is_parametric:  # watts are known but for a common factor
        share = PARAMETRIC_FRACTION
        text += f"; of a part of little heat capacity {PARAMETRIC_K * floor:.1f} K"
    return f"random heat of {100.0 * share * floor:.1f} % of the typical loss ({case.loss_W:.0f} W) {text}"


# ---------------------------------------------------------------------- verdict


def _verdict(
    found: Search, findings: Sequence[Finding], unseen: Sequence[NotDetectable], *, left: bool, detected: bool,
    catalogue: Mapping[str, Mechanism],
) -> Verdict:  # fmt: skip
    if not detected:
        physics = {s.hypothesis.name for s in found.stages[-1].scored if s.hypothesis.name in catalogue}
        visible = 1.0 - len({u.mechanism for u in unseen}) / max(len(physics), 1)
        return "insufficient_data" if visible < ENOUGH_VISIBLE else "consistent"
    if not findings:
        return "unexplained"
    kinds = {f.kind for f in findings}
    if left or any(f.family == OPEN_FORM for f in findings):
        return "unexplained"
    if kinds <= {"sensor"}:
        return "sensor_fault"
    if kinds <= {"parameter", "sensor"}:
        return "parameter_error"
    return "missing_physics"


def _much_is_left(misfit: float, first: Sequence[LatentHeat], remaining: Sequence[LatentHeat]) -> bool:
    """Whether residuals are too large, or an unknown heat explains them about as well as it explained the whole."""
    if misfit > MOST_MISFIT:
        return True
    before = max((h.log_bayes for h in first), default=0.0)
    after = max((h.log_bayes for h in remaining), default=0.0)
    return after > SECOND_GAIN and after > UNEXPLAINED_SHARE * before


def _remaining(
    found: Search, remaining: Sequence[LatentHeat], case: InferenceSetup, *, left: bool, misfit: float, detected: bool
) -> tuple[float, str]:
    last = found.stages[-1]
    p_value = float(min(1.0, np.exp(-max(last.log_e_value, 0.0)))) if last.accepted is None else float("nan")
    if not detected:
        return p_value, ""
    best = max(remaining, key=lambda h: h.log_bayes)
    steps = np.concatenate([piece.steps for piece in case.train.pieces])
    size = float(np.sqrt(np.average(np.concatenate(best.mean) ** 2, weights=steps)))
    small = size < REMAINING_W_SHARE * case.loss_W and not left
    notes = []
    if best.log_bayes >= SECOND_GAIN and not small:
        notes.append(f"an unknown heat of about {size:.0f} W (rms) in {best.node} would still help")
    if misfit > MOST_MISFIT:
        notes.append(f"what is left is {misfit:.2g} times what noise and structural floor allow (mean square)")
    return p_value, "; ".join(notes) or "nothing that stands out of noise and structural floor"


# ---------------------------------------------------------------------- where


def _latents(case: InferenceSetup, explanation: Explanation) -> tuple[LatentHeat, ...]:
    """Unknown heat in every part, as mechanical loss (where the loss is measured) and not."""
    marginal, knots = Marginal.of(explanation.fit), knots_of(explanation.problem.pieces)
    kinds = (True, False) if TOTAL_LOSS in case.channels else (False,)
    return tuple(
        latent_heat(explanation.problem.model, explanation.fit, marginal, part.name, loss_W=case.loss_W,
                    is_loss=is_loss, knots=knots)
        for part in case.nominal.parts for is_loss in kinds
    )  # fmt: skip


def _location(
    case: InferenceSetup, found: Search, findings: Sequence[Finding], first: Sequence[LatentHeat]
) -> tuple[Location, ...]:
    """Places by probability: of what was found, with its rivals' places; else by the unknown heat alone."""
    weights: dict[str, float] = {}
    if findings:
        for _, stage in found.findings:
            own: dict[str, float] = {}  # rivals exclude one another, findings do not
            for fit, probability in zip(stage.fits, stage.probabilities(), strict=True):
                node = node_in(case.nominal, fit.found[-1])
                own[node] = own.get(node, 0.0) + float(probability)
            for node, weight in own.items():
                weights[node] = 1.0 - (1.0 - weights.get(node, 0.0)) * (1.0 - min(weight, 1.0))
    else:
        logs = np.array([h.log_bayes for h in first]) / TEMPER
        for latent, weight in zip(first, np.exp(logs - np.logaddexp.reduce(logs)), strict=True):
            weights[latent.node] = weights.get(latent.node, 0.0) + float(weight)
    chosen = sorted(((n, w) for n, w in weights.items() if w >= 0.02), key=lambda item: -item[1])
    return tuple(_place(case, found, first, node, weight) for node, weight in chosen)


def _place(case: InferenceSetup, found: Search, first: Sequence[LatentHeat], node: str, weight: float) -> Location:
    own = [h for h in found.final.found if node_in(case.nominal, h) == node]
    heats = _summed(found.final, own)
    if not heats:
        candidates = [h for h in first if h.node == node]
        if own or not candidates:
            return Location(node=node, probability=min(weight, 1.0), heat_mean_W=0.0, heat_max_W=0.0, when=(),
                            regime="always")  # fmt: skip
        heats = list(max(candidates, key=lambda h: h.log_bayes).mean)
    parts = found.final.fit.parts
    together = np.concatenate(heats)
    T = np.concatenate([p.trajectory.middle[:, p_index(case, node)] for p in parts])
    inputs = np.concatenate([p.trajectory.piece.inputs for p in parts])
    hours = np.concatenate([p.trajectory.piece.middle for p in parts]) / 3600.0
    steps = np.concatenate([p.trajectory.piece.steps for p in parts])
    acting = active(together, steps)
    signals = {"speed": (np.abs(inputs[:, 0]), "1/min"), "torque": (np.abs(inputs[:, 1]), "N m"),
               f"temperature of {node}": (T, "degC"), "time": (hours, "h")}  # fmt: skip
    words = regime(acting, signals, steps)
    when, before = [], 0
    for part, heat in zip(parts, heats, strict=True):
        piece = part.trajectory.piece
        own_acting = acting[before : before + len(heat)]
        when += [(piece.recording, a, b) for a, b in windows(piece.middle, own_acting)]
        before += len(heat)
    return Location(
        node=node, probability=min(weight, 1.0), heat_mean_W=float(np.average(together, weights=steps)),
        heat_max_W=float(together[np.argmax(np.abs(together))]), when=tuple(when), regime=words,
    )  # fmt: skip


def _summed(final: Explanation, found: Sequence[Hypothesis]) -> list[Array]:
    """Heats of several things that were found, together, of every piece, [W]; empty where none of them is a heat."""
    laws = [heats for h in found if (heats := heats_of(final, h))]
    return [np.sum(values, axis=0) for values in zip(*laws, strict=True)]


def p_index(case: InferenceSetup, node: str) -> int:
    """Index of a node among the parts; of the first part for one that is none (a boundary, an input)."""
    names = [part.name for part in case.nominal.parts]
    return names.index(node) if node in names else 0


def _shown(findings: Sequence[Finding], location: Sequence[Location]) -> list[str]:
    nodes = [f.node for f in findings if f.kind not in ("sensor", "signal")]
    return list(dict.fromkeys(nodes or [place.node for place in location[:1]]))


def _missing_heat(
    case: InferenceSetup, found: Search, latents: Sequence[LatentHeat], nodes: Sequence[str]
) -> tuple[MissingHeat, ...]:
    """What was found, and what an unknown heat would add to it; without findings that heat alone.

    Taken with the parameters of the final explanation: those of the calibration without it have swallowed most of it.
    """
    result = []
    pieces = [part.trajectory.piece for part in found.final.fit.parts]
    for node in nodes:
        candidates = [h for h in latents if h.node == node]
        if not candidates:
            continue
        latent = max(candidates, key=lambda h: h.log_bayes)
        summed = _summed(found.final, [h for h in found.final.found if node_in(case.nominal, h) == node])
        lacking = [a + b for a, b in zip(summed, latent.mean, strict=True)] if summed else latent.mean
        mean, sd = heat_over_time(pieces, lacking), heat_over_time(pieces, latent.sd)
        law = heat_over_time(pieces, summed) if summed else None
        index = p_index(case, node)
        T = heat_over_time(pieces, [p.trajectory.middle[:, index] for p in found.final.fit.parts])
        speed, torque = (heat_over_time(pieces, [np.abs(p.inputs[:, i]) for p in pieces]) for i in (0, 1))
        result += [
            MissingHeat(
                recording=name, node=node, time=time, mean=values, sd=sd[name][1], speed=speed[name][1],
                torque=torque[name][1], temperature=T[name][1], law=None if law is None else law[name][1],
            )
            for name, (time, values) in mean.items()
        ]  # fmt: skip
    return tuple(result)


# ---------------------------------------------------------------------- fits and courses


Predictions = dict[str, dict[str, list[Prediction]]]


def _predictions(case: InferenceSetup, found: Search, jobs: int) -> Predictions:
    """Free-running predictions: as delivered, calibrated and after, of the training and held-out pieces."""
    problems = {
        "train": (case.train, found.calibrated.problem, found.final.problem),
        "holdout": (case.holdout, at_holdout(case, found.calibrated), at_holdout(case, found.final)),
    }
    zs = (found.calibrated.fit.z, found.final.fit.z)
    places = [(name, index) for name, (nominal, *_) in problems.items() for index in range(len(nominal.pieces))]
    fitted = found.final.fit.without_parts().courses
    near = {"train": fitted, "holdout": (None,) * len(case.holdout.pieces)}
    three = run_parallel(
        _predicted, [(*problems[name], *zs, index, near[name][index]) for name, index in places], jobs=jobs
    )
    return {
        name: {state: [them[which] for (one, _), them in zip(places, three, strict=True) if one == name]
               for which, state in enumerate(("before", "calibrated", "after"))}
        for name in problems
    }  # fmt: skip


def _predicted(
    nominal: Problem, calibrated: Problem, final: Problem, z: Array, z_final: Array, index: int, near: Array | None
) -> tuple[Prediction, Prediction, Prediction]:
    """One piece as delivered, calibrated and after; each starts from the one before, or the last from one `near` it."""
    before = predict(nominal, index, np.zeros(len(nominal.unknowns)), as_delivered=True)
    tuned = predict(calibrated, index, z, guess=before.trajectory.T)
    return before, tuned, predict(final, index, z_final, guess=tuned.trajectory.T if near is None else near)


def _fits(case: InferenceSetup, predictions: Predictions, which: str) -> Fits:
    per_state, overall = {}, {}
    temperatures = [i for i, name in enumerate(case.channels) if not is_total_loss(name)]
    for state, predicted in predictions[which].items():
        nothing = [np.zeros((0, len(case.channels)))]
        residual = np.concatenate([p.residual for p in predicted] or nothing)
        per_state[state] = rmse(residual, np.concatenate([p.weights for p in predicted] or [np.zeros(0)]))
        overall[state] = overall_rmse(predicted, temperatures)
    sensors = {
        name: (float(per_state["before"][i]), float(per_state["calibrated"][i]), float(per_state["after"][i]))
        for i, name in enumerate(case.channels)
    }
    return Fits(before=overall["before"], calibrated=overall["calibrated"], after=overall["after"], sensors=sensors)


def _courses(case: InferenceSetup, predictions: Predictions) -> tuple[PredictedRun, ...]:
    result = []
    for which, states in predictions.items():
        for before, calibrated, after in zip(states["before"], states["calibrated"], states["after"], strict=True):
            piece = before.piece
            at = np.clip(np.arange(len(piece.time)), 0, len(piece.steps) - 1)
            result.append(PredictedRun(
                recording=piece.recording, held_out=which == "holdout", time=piece.time, speed=piece.inputs[at, 0],
                torque=piece.inputs[at, 1], measured=_by_channel(case, piece.measured),
                before=_by_channel(case, before.read), calibrated=_by_channel(case, calibrated.read),
                after={**_unmeasured(case, after), **_by_channel(case, after.read)},
                counts_from_s=before.counts_from,
            ))  # fmt: skip
    return tuple(result)


def _by_channel(case: InferenceSetup, values: Array) -> dict[str, Array]:
    return {name: values[:, i] for i, name in enumerate(case.channels)}


def _unmeasured(case: InferenceSetup, prediction: Prediction) -> dict[str, Array]:
    names = [part.name for part in case.nominal.parts]
    return {name: prediction.trajectory.T[:, i] for i, name in enumerate(names)}


def _calibration(case: InferenceSetup, final: Explanation) -> tuple[Calibrated, ...]:
    """Every parameter, how far it is from its prior as the definition has it: that of one found far off is wider."""
    stated = {(item.role, item.target): item for item in case.train.unknowns.items}
    sd = np.sqrt(np.diag(final.fit.covariance))
    taken = {p.name for h in final.found if h.term is not None for p in h.term.parameters}
    result = []
    for index, item in enumerate(final.fit.unknowns.items):
        if item.target in taken:
            continue
        value, p = item.value(float(final.fit.z[index])), item.parameter
        per_z = value * p.sd if p.log else p.sd
        result.append(Calibrated(
            parameter=item.target if item.role == "network" else p.name, prior=p.start, value=value,
            stderr=float(abs(per_z) * sd[index]), shift_in_sd=stated[item.role, item.target].z(value), unit=p.unit,
        ))  # fmt: skip
    return tuple(result)


# ---------------------------------------------------------------------- ranking and advice


def _ranking(found: Search) -> tuple[Ranked, ...]:
    """Everything of the first look: by its fit where it was fitted in earnest, the rest by the scan.

    Probabilities are those of what was compared in the end; what the held-out recordings refused has none.
    """
    stage = found.stages[0]
    left = [fit.found[-1].label for fit in stage.fits]
    probability = dict(zip(left, stage.probabilities() if left else (), strict=True))
    rows = [
        Ranked(mechanism=s.hypothesis.name, place=s.hypothesis.place, family=s.hypothesis.family,
               log_bayes=stage.fitted.get(s.hypothesis.label, s.log_bayes),
               probability=float(probability.get(s.hypothesis.label, 0.0)))
        for s in stage.scored
        if s.hypothesis.label in stage.fitted or not s.hypothesis.is_open
    ]  # fmt: skip
    return tuple(sorted(rows, key=lambda r: (-r.probability, -r.log_bayes)))


def _unseen(stage: Stage, catalogue: Mapping[str, Mechanism], threshold: float) -> tuple[NotDetectable, ...]:
    """Mechanisms that would not have been seen at their typical strength, at their best place."""
    best: dict[str, tuple[float, str]] = {}
    competing = [s for s in stage.scored if not s.hypothesis.is_open]
    for s, weight in zip(competing, log_weights(competing), strict=True):
        name, reached = s.hypothesis.name, s.expected + float(weight)
        if name in catalogue and reached > best.get(name, (-np.inf, ""))[0]:
            best[name] = (reached, s.hypothesis.place)
    return tuple(
        NotDetectable(mechanism=name, place=place, needed=catalogue[name].experiment)
        for name, (reached, place) in sorted(best.items()) if reached < threshold
    )  # fmt: skip


def _next_test(
    verdict: Verdict, findings: Sequence[Finding], unseen: Sequence[NotDetectable], catalogue: Mapping[str, Mechanism],
    assumed: Collection[str],
) -> str:  # fmt: skip
    if verdict == "unexplained" and "T_ambient" in assumed:
        return "record T_ambient_degC: a constant stands for it, and what the air did is missed elsewhere"
    for finding in findings:
        if finding.confusable_with and finding.confusable_with[0].probability >= 0.05:
            return finding.confusable_with[0].separate_by
    if verdict in ("consistent", "insufficient_data") and unseen:
        wanted = Counter(u.needed for u in unseen).most_common(1)[0][0]
        shown = sum(u.needed == wanted for u in unseen)
        return f"{wanted} (it would show {shown} effect{'s' if shown > 1 else ''} that these data cannot)"
    if verdict == "unexplained":
        return "repeat the operation in which the heat is missing with one input changed at a time"
    if findings and findings[0].mechanism in catalogue:
        return catalogue[findings[0].mechanism].experiment
    return ""
