"""The search: is anything missing, what is it, is anything else.

Step by step: scan everything, fit the best few in earnest, keep the best if the data want it and the held-out
recordings do not object; drop what is no longer needed beside it; look again at what remains. The structural floor
follows the explanation, see :func:`diagnosis.case.floored`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import delayed

from diagnosis.case import Case, first, floored
from diagnosis.evidence import Marginal
from diagnosis.explain import Explanation, best_fits, distorted, evidence_of, in_the_middle, without
from diagnosis.holdout import Judge
from diagnosis.hypotheses import Hypothesis, Scored, hypothesis_of, parameter_hypotheses, scan, sharpened, spread
from diagnosis.mapping import LOSS
from diagnosis.observation import reading_columns, readings
from diagnosis.open_form import open_hypotheses
from diagnosis.term_on_grid import TermOnGrid
from models.mechanisms import Mechanism
from models.types import Array

# All set on development cases (seed 1 of `conceal`) and by the four open ones; the proof draws others.
THRESHOLD = 5.0  # log e-value at a false-alarm rate of 5 %
SECOND_GAIN = 10.0  # log evidence that each further effect has to bring
OPEN_PENALTY = 10.0  # an open form has to beat the catalogue by this
LEAST_SHARE = 0.5  # of the best probability, of what may be taken where that fails on held-out data
LEAST_PROBABILITY = 0.05  # of what counts when it is asked whether anything of a size that matters is there
SHARPENED, SHARPEN_FROM = 15, 2.0  # best hypotheses whose shapes are sought between the grid, from this score on
FITTED, WORTH = 5, 0.12  # hypotheses that are fitted in earnest, and the share of the best score that they need
MOST_FITTED, NEAR = 12, 0.6  # where more of them score about as well as the best: the scan is only linear
# So strong a first effect bends so much that what is best in a straight line may be far from best: other names from
# this share of the best score are fitted as well.
STRONG, WORTH_OF_STRONG = 200.0, 0.04
# What was nearly as likely as what was accepted may be right beside a further effect: so many are seen, from this share
# of its probability.
OTHERS, LIKELY = 2, 0.1
# Log evidences are divided by a temperature before they become probabilities, because no model is exactly true: a
# constant, and a share of the whole evidence, since the form of an effect is known no better than that.
TEMPER, TEMPER_SHARE = 3.0, 0.03
# Log odds of what is rarer than a piece of missing physics or a biased sensor.
RARITY = {
    "sensor_gain": -2.0,
    "speed_gain": -3.0,
    "clock_offset": -1.0,
    "swapped_channels": -2.0,
    "water_jacket": -1.0,
    # Like what formulas of mesh and bearings leave in consistent recordings; the first has no published law either.
    "churning_load": -5.0,
    "misalignment": -4.0,
    "bearing_seat_contact": -4.0,
}
FORM_DOUBT = 0.3  # that a further effect is only what the form of the one before lacks
MOST_EFFECTS = 4
HOLDOUT_LOSS = -3.0  # log predictive density that what is found may cost on held-out data
HOLDOUT_SLACK = 1.05  # of the calibrated model's error there ...
HOLDOUT_SLACK_K = 0.04  # ... or this much more, which is nothing beside the noise of a reading
FURTHER_SLACK = 1.3  # of the error with what was found before
CLEARLY_BETTER = 0.97  # of that error, where rows are means over minutes
HOLDOUT_SLACK_INSTRUMENT = 1.3  # its fault says little about temperatures to come, and calibration swallows half of it
# Of the typical loss, and of temperature: half of what matters in practice, since that much of it may be hidden in what
# was calibrated.
SMALLEST_HEAT, SMALLEST_K = 0.01, 0.15
# Standard deviations: an instrument's fault changes nothing in the gearbox. One that holds only with a parameter of it
# so far off, and so much further than without, is none: a sensor's lag stands for a heat capacity gone to nothing.
FAR_OFF, FURTHER_OFF = 8.0, 3.0
CERTAIN = 50.0  # log evidence below which it has to be the whole of it


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One look for one more effect.

    Attributes
    ----------
    scored : tuple of Scored
        Everything, best first
    log_e_value : float
        Log of the mean Bayes factor over everything that was scored
    fits : tuple of Explanation
        The best few, fitted in earnest, best first
    gains : tuple of float
        Their log evidence over the explanation before
    accepted : Explanation or None
    tentative : bool
        Whether what was accepted stands only if a further effect is found with which the held-out error does not grow
    otherwise : Stage or None
        The same look with what else is accepted then
    matters : bool
        Whether what was accepted, or else anything that would explain the data, is large enough to matter in practice
    note : str
        Why nothing was accepted, if so
    """

    scored: tuple[Scored, ...]
    log_e_value: float
    fits: tuple[Explanation, ...] = ()
    gains: tuple[float, ...] = ()
    accepted: Explanation | None = None
    tentative: bool = False
    otherwise: Stage | None = None
    matters: bool = False
    note: str = ""

    def probabilities(self) -> Array:
        """Of the fits, among each other, shape (fits,)."""
        weights = np.array(self.gains) / (TEMPER + TEMPER_SHARE * max(0.0, *self.gains))
        weights += np.array([RARITY.get(fit.found[-1].name, 0.0) for fit in self.fits])
        weights = np.exp(weights - weights.max())
        return np.asarray(weights / weights.sum())

    def ranked(self) -> Stage:
        """The same, the most probable fit first."""
        order = np.argsort(-self.probabilities())
        return replace(self, fits=tuple(self.fits[i] for i in order), gains=tuple(self.gains[i] for i in order))


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """All that the search found.

    Attributes
    ----------
    calibrated, final : Explanation
    stages : tuple of Stage
        The last one found nothing more, unless the search ended at its greatest number of effects
    threshold : float
        Log e-value that the first stage had to reach
    floor : float
        Structural floor of the final explanation, in multiples of the least
    """

    calibrated: Explanation
    final: Explanation
    stages: tuple[Stage, ...]
    threshold: float
    floor: float

    @property
    def detected(self) -> bool:
        """Whether anything is amiss that matters: found, or sought in vain."""
        return any(stage.matters for stage in self.stages)

    @property
    def findings(self) -> tuple[tuple[Hypothesis, Stage], ...]:
        """What is left of what was found, with the look that found it; what hardly matters comes last."""
        by = {stage.accepted.found[-1].label: stage for stage in self.stages if stage.accepted is not None}
        pairs = [(h, by[h.label]) for h in self.final.found]
        return tuple(sorted(pairs, key=lambda pair: not pair[1].matters))


def threshold_at(false_alarm_rate: float) -> float:
    """Log e-value that consistent recordings exceed with this probability at most.

    An e-value exceeds 1/alpha with probability alpha at most (Markov), if the model is true. The threshold at 5 % lies
    higher, as a margin for formulas that are not exactly the gearbox's; which rate that gives the proof measures.
    """
    return THRESHOLD + float(np.log(0.05 / false_alarm_rate))


def hypotheses_of(case: Case, explanation: Explanation, catalogue: Mapping[str, Mechanism]) -> list[Hypothesis]:
    """Everything that may be added to an explanation."""
    taken = set(explanation.labels)
    found = [
        hypothesis_of(placed)
        for mechanism in catalogue.values()
        for placed in mechanism.placed(case.train.model.network, case.scale, case.channels)
        if f"{placed.name}@{placed.place}" not in taken
    ]
    found += open_hypotheses(case.train.model.network, case.scale, case.channels)
    own = {p.name for h in explanation.found if h.term is not None for p in h.term.parameters}
    found += [h for h in parameter_hypotheses(explanation.problem) if h.place not in own]
    return [h for h in found if h.label not in taken]


def search(
    case: Case, catalogue: Mapping[str, Mechanism], *, false_alarm_rate: float = 0.05, jobs: int = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> Search:  # fmt: skip
    """Look for effects one after another.

    Parameters
    ----------
    case : Case
    catalogue : mapping of str to Mechanism
    false_alarm_rate : float
    jobs : int
        Processes
    progress : callable
        Told what is being done
    """
    progress("calibrating the model inside its priors")
    start, start_floor = base, floor = first(case)
    threshold = threshold_at(false_alarm_rate)
    stages: list[Stage] = []
    others: list[Explanation] = []
    for look in range(MOST_EFFECTS):
        progress("scoring everything that may be missing" if not look else "looking for a further effect")
        needed = SECOND_GAIN if look else threshold
        judge = Judge(case, base, floor)
        stage = _look(judge, start, catalogue, needed, jobs, progress, others)
        if stage.accepted is None and stages and stages[-1].tentative:
            alone = stages.pop()
            stage = alone.otherwise or replace(alone, accepted=None, tentative=False)
            base, floor = start, start_floor
            judge = Judge(case, base, floor)
        stages.append(stage)
        if stage.accepted is None:
            break
        stages = _reconsidered(stages, base)
        if stage.tentative:
            base = stage.accepted
            others = _others(base, stage)
            continue
        slim = _needed_of(judge, start, stage.accepted)
        raised, floor_after = floored(slim)
        if floor_after > 1.0 and not _holds_out(judge, start, raised):
            raised, floor_after = slim, 1.0  # fitted anew with a higher floor it went astray
        base, floor = raised, floor_after
        others = _others(base, stage)
    return Search(calibrated=start, final=base, stages=tuple(stages), threshold=threshold, floor=floor)


def _others(base: Explanation, stage: Stage) -> list[Explanation]:
    """What was nearly as likely as what a look accepted, judged by the same noise as the base that came of it."""
    accepted = stage.accepted
    if accepted is None or base.labels != accepted.labels:
        return []
    probability = {fit.found[-1].label: p for fit, p in zip(stage.fits, stage.probabilities(), strict=True)}
    likely = LIKELY * probability[accepted.found[-1].label]
    found = []
    for fit in stage.fits:
        last = fit.found[-1]
        if last.label == accepted.found[-1].label or last.family == "open form" or probability[last.label] < likely:
            continue
        problem = fit.problem.changed(noise=base.problem.noise, whitenings=base.problem.whitenings)
        same = fit.problem.whitenings is base.problem.whitenings
        try:
            again = problem.fit(fit.fit.z, fit.fit.courses, iterations=0 if same else 2)
        except ArithmeticError:
            continue
        found.append(replace(fit, problem=problem, fit=again, log_evidence=evidence_of(fit.found, again)))
    return found[:OTHERS]


def _reconsidered(stages: Sequence[Stage], base: Explanation) -> list[Stage]:
    """The looks, where the last one accepted its effect beside another one than the base has: that one stands then."""
    *before, last = stages
    assert last.accepted is not None  # noqa: S101 - the caller looked
    now = last.accepted.labels[:-1]
    gone, come = set(base.labels) - set(now), set(now) - set(base.labels)
    if len(gone) != 1 or len(come) != 1:
        return list(stages)
    beside_base = [fit.log_evidence for fit in last.fits if fit.labels[:-1] == base.labels]
    ahead = last.accepted.log_evidence - max([base.log_evidence, *beside_base])
    for index, stage in enumerate(before):
        labels = [fit.found[-1].label for fit in stage.fits]
        if stage.accepted is not None and stage.accepted.found[-1].label in gone and come <= set(labels):
            mine, old = (labels.index(next(iter(which))) for which in (come, gone))
            gains = list(stage.gains)
            gains[mine] = gains[old] + ahead
            before[index] = replace(stage, gains=tuple(gains), accepted=stage.fits[mine]).ranked()
    return [*before, last]


def _needed_of(judge: Judge, calibrated: Explanation, accepted: Explanation) -> Explanation:
    """What was accepted, without anything found earlier that is not needed beside it."""
    for index in reversed(range(len(accepted.found) - 1)):
        try:
            slim = without(calibrated, accepted, index)
        except ArithmeticError:
            continue
        if accepted.log_evidence - slim.log_evidence < SECOND_GAIN and _holds_out(judge, calibrated, slim):
            accepted = slim
    return accepted


def _look(
    judge: Judge, calibrated: Explanation, catalogue: Mapping[str, Mechanism], needed: float, jobs: int,
    progress: Callable[[str], None], others: Sequence[Explanation],
) -> Stage:  # fmt: skip
    """Look for one more effect than the judge's base has; it may be found beside one of `others` instead."""
    case, base = judge.case, judge.base
    hypotheses = hypotheses_of(case, base, catalogue)
    real, opened = _scanned(base, hypotheses, jobs)
    scored = sorted([*real, *opened], key=lambda s: -s.log_bayes)
    log_e = log_e_value(real)
    if log_e < needed:
        return Stage(scored=tuple(scored), log_e_value=log_e, note="nothing reaches the threshold")
    progress("fitting the best explanations in earnest")
    first_look = not base.found
    chosen = [(base, s) for s in [*_worth(real, strong=first_look), *opened[:2]]
              if s.hypothesis.family != "open form" or s.log_bayes > real[0].log_bayes + OPEN_PENALTY]  # fmt: skip
    views = list(others)
    if distorted(base) and first_look and (middle := in_the_middle(base)) is not None:
        views.append(middle)
    for view in views:
        known = [h for h in hypotheses_of(case, view, catalogue) if h.family != "open form"]
        chosen += [(view, s) for s in _worth(_scanned(view, known, jobs)[0], strong=first_look)]
    fits = best_fits(base, chosen, jobs=jobs)
    if not fits:
        return Stage(scored=tuple(scored), log_e_value=log_e, note="no explanation has a solution")
    gains = [_penalised(fit) - base.log_evidence for fit in fits]
    stage = Stage(scored=tuple(scored), log_e_value=log_e, fits=tuple(fits), gains=tuple(gains)).ranked()
    return _judged(judge, calibrated, stage, needed)


def _scanned(base: Explanation, hypotheses: Sequence[Hypothesis], jobs: int) -> tuple[list[Scored], list[Scored]]:
    """Scores of what is known and of open forms, each best first."""
    marginal = Marginal.of(base.fit)
    scored = scan(base.problem, base.fit, marginal, hypotheses, jobs=jobs)
    real = [s for s in scored if s.hypothesis.family != "open form"]
    near = [s for s in real[:SHARPENED] if s.log_bayes > SHARPEN_FROM]
    finer = spread(jobs, [delayed(sharpened)(base.problem, base.fit, marginal, s) for s in near])
    real = sorted([*finer, *real[len(near) :]], key=lambda s: -s.log_bayes)
    return real, [s for s in scored if s.hypothesis.family == "open form"]


def _worth(scored: Sequence[Scored], *, strong: bool) -> list[Scored]:
    """What of a scan is worth a fit, two at least; more where an effect may be `strong`."""
    most = scored[0].log_bayes
    found = [s for s in scored[:FITTED] if s.log_bayes > WORTH * most]
    found += [s for s in scored[FITTED:MOST_FITTED] if s.log_bayes > NEAR * most]
    if strong and most > STRONG:
        for s in scored:
            new = s.hypothesis.name not in {f.hypothesis.name for f in found}
            if new and s.log_bayes > WORTH_OF_STRONG * most and len(found) < MOST_FITTED:
                found.append(s)
    return found if len(found) > 1 else list(scored[:2])


def log_weights(scored: Sequence[Scored]) -> Array:
    """Logarithms of what everything weighs in the mean Bayes factor, together 1, shape (scored,).

    All names weigh the same, but for their rarity, and share it among their places; every instrument may fail for
    itself, and every parameter be off.

    Parameters
    ----------
    scored : sequence of Scored
        Everything that competes, without open forms
    """

    def shares(h: Hypothesis) -> str:
        return h.label if h.term is None or h.term.of_measurement else h.name

    places = Counter(shares(s.hypothesis) for s in scored)
    weights = np.array([RARITY.get(s.hypothesis.name, 0.0) - np.log(places[shares(s.hypothesis)]) for s in scored])
    return np.asarray(weights - np.logaddexp.reduce(weights))


def log_e_value(scored: Sequence[Scored]) -> float:
    """Log of the mean Bayes factor, see :func:`log_weights`."""
    return float(np.logaddexp.reduce(np.array([s.log_bayes for s in scored]) + log_weights(scored)))


def _judged(judge: Judge, calibrated: Explanation, stage: Stage, needed: float) -> Stage:
    """A look with what of its fits is accepted.

    What is too small to matter is accepted only to clear the way, as long as nothing that matters was found. What the
    held-out recordings refuse stays a rival of what is accepted only if they hold it for about as likely; what the
    training data hold for much less likely than that is accepted only where the held-out recordings themselves speak
    for it. Where another strong effect is still missing, the first one may make their error larger although it makes
    them far more probable: that one is accepted tentatively, before anything less likely.
    """
    case, base, probabilities = judge.case, judge.base, stage.probabilities()
    cleared = any(_matters(case, base, h) for h in base.found)
    matters, note = False, "the best explanation is hardly better than none"
    refused: set[int] = set()
    impossible: set[int] = set()
    by_name: dict[str, float] = {}  # another place of the same physics is no rival
    for fit, probability in zip(stage.fits, probabilities, strict=True):
        by_name[fit.found[-1].name] = by_name.get(fit.found[-1].name, 0.0) + float(probability)
    ahead = 0.0  # probability of what is more likely and too small
    promising: Explanation | None = None
    promised = -1
    for index, (fit, gain, probability) in enumerate(zip(stage.fits, stage.gains, probabilities, strict=True)):
        left = [i for i in range(len(stage.fits)) if i not in refused | impossible]
        if gain < needed or probability < LEAST_PROBABILITY * probabilities[left].sum():
            continue
        fit = replace(fit, fit=fit.problem.at(fit.fit))
        large = _matters(case, fit, fit.found[-1], 1.0 if gain > CERTAIN else 2.0)
        matters = matters or large
        if _drives_away(base, fit):
            impossible.add(index)
            note = "the fault of an instrument would need a parameter of the gearbox where it cannot be"
            continue
        unlikely = by_name[fit.found[-1].name] < LEAST_SHARE * probabilities[0]
        if probability < LEAST_SHARE * ahead or (unlikely and judge.gain(fit) < SECOND_GAIN):
            continue
        if not large and cleared:
            ahead = max(ahead, float(probability))
            note = "what the data show is too small to matter"
        elif _holds_out(judge, calibrated, fit):
            as_likely = {i for i in refused if judge.gain(stage.fits[i]) > judge.gain(fit) + HOLDOUT_LOSS}
            found = replace(_only(stage, as_likely.union(left)), accepted=fit, matters=large)
            if promising is None or probability > LEAST_SHARE * probabilities[promised]:
                return found
            both = _only(stage, as_likely.union(left, [promised]))
            return replace(both, accepted=promising, tentative=True, matters=True, otherwise=found)
        else:
            refused.add(index)
            note = "what would explain the training data makes the held-out data worse"
            if promising is None and large and not base.found and judge.gain(fit) > CERTAIN:
                promising, promised = fit, index
    return replace(stage, matters=matters, note=note, accepted=promising, tentative=promising is not None)


def _only(stage: Stage, indices: Iterable[int]) -> Stage:
    """A look with some of its fits."""
    chosen = sorted(indices)
    return replace(stage, fits=tuple(stage.fits[i] for i in chosen), gains=tuple(stage.gains[i] for i in chosen))


def _drives_away(base: Explanation, fit: Explanation) -> bool:
    """Whether the fault of an instrument sends a parameter of the gearbox where its prior hardly reaches."""
    term = fit.found[-1].term
    if term is None or not term.of_measurement:
        return False
    own = {p.name for h in fit.found if h.term is not None for p in h.term.parameters}
    own |= {h.place for h in fit.found if h.term is None}
    before = {(i.role, i.target): abs(float(z)) for i, z in zip(base.fit.unknowns.items, base.fit.z, strict=True)}
    return any(
        abs(float(z)) > max(FAR_OFF, before.get((i.role, i.target), 0.0) + FURTHER_OFF)
        for i, z in zip(fit.fit.unknowns.items, fit.fit.z, strict=True)
        if i.target not in own
    )


def _penalised(fit: Explanation) -> float:
    return fit.log_evidence - (OPEN_PENALTY if fit.found[-1].family == "open form" else 0.0)


def _holds_out(judge: Judge, calibrated: Explanation, fit: Explanation) -> bool:
    """Whether the held-out recordings support what was found, and the free-running error does not grow by it.

    Against the calibrated model it may not grow at all, but for chance; from one effect to the next it may by more, as
    long as what is predicted becomes more probable: two wrong models can err in opposite directions.
    """
    if not judge.case.holdout.pieces:
        return True
    # Means over minutes do not show when a switch acted: where that goes wrong only the free run tells.
    clearly = judge.case.holdout.slow and judge.rmse(fit) < CLEARLY_BETTER * judge.rmse(judge.base)
    if judge.gain(fit) < HOLDOUT_LOSS and not clearly:
        return False
    term = fit.found[-1].term
    slack = HOLDOUT_SLACK_INSTRUMENT if term is not None and term.of_measurement else HOLDOUT_SLACK
    after = judge.rmse(fit)
    before = judge.rmse(calibrated)
    return after <= max(slack * before, before + HOLDOUT_SLACK_K) and after <= FURTHER_SLACK * judge.rmse(judge.base)


def _matters(case: Case, fit: Explanation, h: Hypothesis, times: float = 1.0) -> bool:
    """Whether something found is so many times what matters: by its heat, or by what it does to a reading."""
    if h.term is None:
        return True
    values = fit.values_of(h)
    given = np.array([values[p.name][0] for p in h.term.parameters])
    if h.term.form == "clock" and abs(given[0]) < times * case.scale.interval:
        return False  # what a row stands for, the time before its stamp or after it, is not known either
    model, term = fit.problem.model, TermOnGrid(fit.problem.model, h.term)
    changes = []
    for part in fit.fit.parts:
        if h.term.kind == "sensor":
            read = readings(model, part.trajectory, part.sensors)
            changes.append(term.distorted(part.trajectory, part.sensors, read, given) - read)
        else:
            heat, loss = term.heat(part.trajectory, given[None, :])
            T = part.trajectory.response(heat)
            changes.append(reading_columns(model, part.trajectory, part.sensors, T, loss)[:, :, 0])
    change = np.sqrt(np.mean(np.concatenate(changes) ** 2, axis=0))
    least = times * np.array([SMALLEST_HEAT * case.loss_W if name == LOSS else SMALLEST_K for name in case.channels])
    heats = heats_of(fit, h)  # none of a fault of an instrument: there the error of the reading counts alone
    warms = bool(heats) and float(np.mean(np.abs(np.concatenate(heats)))) > times * SMALLEST_HEAT * case.loss_W
    return warms or bool((change > least).any())


def heats_of(explanation: Explanation, h: Hypothesis) -> Sequence[Array]:
    """Heat of something found, over all intervals, summed over the parts it warms, [W]; none of a fault."""
    if h.term is None or h.term.kind in ("sensor", "signal"):
        return []
    values = explanation.values_of(h)
    given = np.array([[values[p.name][0] for p in h.term.parameters]])
    return [heat[:, 0] for heat in _heats_with(explanation, h, given)]


def _heats_with(explanation: Explanation, h: Hypothesis, values: Array) -> list[Array]:
    """Heat with each row of `values`, the first as fitted, for its parameters; shape (K, rows) per piece, [W]."""
    assert h.term is not None  # noqa: S101 - only a term brings heat
    term, result = TermOnGrid(explanation.problem.model, h.term), []
    for part in explanation.fit.parts:
        heat = term.heat(part.trajectory, values, there=values[0])[0]
        positive, negative = heat.clip(0.0).sum(axis=1), heat.clip(None, 0.0).sum(axis=1)
        result.append(np.where(positive > -negative, positive, negative))
    return result


def mean_heat_of(explanation: Explanation, h: Hypothesis) -> tuple[float, float]:
    """Mean magnitude of the heat of something found and its standard error, [W]; nothing of a fault.

    The error is that of the term's own parameters, everything else that was fitted marginalised.
    """
    if h.term is None or h.term.kind in ("sensor", "signal"):
        return 0.0, 0.0
    items, fit = explanation.fit.unknowns.items, explanation.fit
    own = fit.unknowns.of(h.term.parameters)
    covariance = fit.covariance[np.ix_(own, own)]
    sd = np.sqrt(np.diag(covariance))
    moved = fit.z[own] + np.concatenate([np.zeros((1, len(own))), np.diag(sd), -np.diag(sd)])
    values = np.array([[items[i].value(float(x)) for i, x in zip(own, row, strict=True)] for row in moved])
    steps = np.concatenate([part.trajectory.piece.steps for part in fit.parts])
    means = np.average(np.abs(np.concatenate(_heats_with(explanation, h, values))), axis=0, weights=steps)
    up, down = np.split(means[1:], 2)
    slope = (up - down) / (2.0 * sd)
    return float(means[0]), float(np.sqrt(slope @ covariance @ slope))
