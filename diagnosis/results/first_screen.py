"""The first screen of a diagnosis in plain words: a reader's questions with their answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import median
from typing import TYPE_CHECKING

from diagnosis.decision.posterior import Repeating, ScaledError
from diagnosis.engine.learnt import widest_class
from diagnosis.results.number_format import MINUS, number, share, with_error
from diagnosis.results.result_parts import (
    LEAST_RIVAL,
    MOST_NEAREST,
    NEAREST,
    NO_CLAIM,
    Change,
    Finding,
    Location,
    named,
    title_of,
)
from models.correction.correction import FAR_SD
from models.mechanisms import OPEN_FORM
from models.mechanisms.measurement import FAMILY as MEASUREMENT
from models.quantities.units import behind_a_number

if TYPE_CHECKING:
    from diagnosis.results.result import Diagnosis

VERDICT_TEXT: Mapping[str, str] = {
    "consistent": "Nothing stands out: noise and model error explain the recordings.",
    "parameter_error": "A known parameter of the model is outside what its definition allows.",
    "missing_physics": "The machine shows physics that the model leaves out.",
    "sensor_fault": "A sensor, clock or recorded input is at fault, not the machine.",
    "unexplained": "Something is missing, and no name of the catalogue is certain enough.",
    "insufficient_data": "Nothing stands out, but that means little: much could hide in these recordings.",
}
PARTLY = "Part of what is missing has a name; of the rest none is certain enough."
LIKELY_TEXT: Mapping[str, str] = {  # of the same verdicts where no name is a claim
    "parameter_error": "A parameter of the model is probably outside what its definition allows.",
    "missing_physics": "The machine probably shows physics that the model leaves out; its name is not certain.",
    "sensor_fault": "A sensor, clock or recorded input is probably at fault, not the machine.",
}
EITHER = "The measurement is at fault, or the model leaves out physics: these data do not separate the two."
ODD = 1.8  # times the error of the others, from which a recording that was learnt from is another one
MISSED = "What was learnt from agrees with the model; held-out {names} not."
FAR = "No effect stands out, but parameters had to go far from what was expected."
UNFIT = "The model cannot be brought to fit these recordings, and why has no name."
SIZES = {0.5: "half as large", 1.0: "as assumed", 2.0: "twice as large"}  # of model error, by factor
MOST_FAR = 3  # parameters far from their priors that the summary tells of
MOST_UNSEEN = 6  # effects that the summary names of those that cannot be seen
MOST_TOGETHER = 3  # parts of one place that are all named
OF_DATE = ("since", "lasting", "moment")  # parameters that the date contains
OF_SWITCH = ("set_point", "band")  # parameters that the switching temperatures contain
LONG_S = 7200.0  # times beyond are told in hours
LITTLE_SPREAD = 0.05  # deviation between sessions that is not worth a word, in prior standard deviations


def verdict_text_of(d: Diagnosis) -> str:
    """The verdict in a sentence."""
    if _cannot_be_fitted(d):
        return UNFIT
    if d.verdict == "consistent" and d.missed:
        return MISSED.format(names=f"{', '.join(d.missed)} {'does' if len(d.missed) == 1 else 'do'}")
    if d.verdict == "consistent" and _far(d):
        return FAR
    if d.verdict == "unexplained" and any(f.family != OPEN_FORM for f in d.findings):
        return PARTLY
    if any(finding.grade == "claim" for finding in d.findings):
        return VERDICT_TEXT[d.verdict]
    if _may_be_either(d):
        return EITHER
    return LIKELY_TEXT.get(d.verdict, VERDICT_TEXT[d.verdict])


def first_screen_of(d: Diagnosis) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Questions with their answers; those without an answer are left out."""
    asked = (
        ("Is something missing?", (_missing(d), *_taken_back(d))),
        ("Where?", _where(d)),
        ("What?", _what(d)),
        ("How sure?", _how_sure(d)),
        ("How much better?", _how_much_better(d)),
        ("What next?", (d.next_test,) if d.next_test else ()),
        ("What cannot be seen in these data?", _cannot_be_seen(d)),
    )
    return tuple((question, answers) for question, answers in asked if answers)


def _missing(d: Diagnosis) -> str:
    if d.verdict == "insufficient_data":
        hidden, (off_K, what) = len({one.mechanism for one in d.unseen}), _farthest(d)
        why = (
            f"the model fits this machine badly: calibrated, it is {off_K:.2f} K off what was {what}"
            if off_K > d.settings.matters_K + d.noise_K else "the recordings are too short or too calm for them"
        )  # fmt: skip
        return (
            f"Not decided: {hidden} effects could hide that change a temperature by {d.settings.matters_K:g} K "
            f"(--matters-K), because {why}. Evidence {d.log_e_value:.1f} nat, {d.threshold:.1f} needed."
        )
    why = f"false-alarm rate of {100.0 * d.settings.false_alarm_rate:g} % asked for"
    if d.assumed.placebo is not None and d.threshold == d.assumed.placebo.log_e_value:
        why = f"as much as the baseline '{d.assumed.placebo.session}' brings"
    reached = f"evidence {d.log_e_value:.1f} nat, {d.threshold:.1f} needed ({why})"
    if d.verdict == "parameter_error":
        return f"No physics, but a parameter is outside its prior: {reached}."
    if d.log_e_value > d.threshold:
        back = f"; the held-out readings take {-d.holdout_gain:.1f} nat of it back" if d.holdout_gain <= -1.0 else ""
        return f"{'Yes' if _is_clear(d) else 'Probably'}{_in_what(d)}: {reached}{back}."
    if _cannot_be_fitted(d) and not d.spoiled and d.train.calibrated <= d.train.before + d.noise_K:
        off_K, what = _farthest(d)
        return (
            f"Yes: calibrated, the model is {off_K:.2f} K off what was {what}, and what explains the recordings learnt "
            f"from does not predict the held-out ones ({reached}). Look first for a cooler, fan or heater with a "
            "control of another kind, and for wrong columns, other units, and a wrong definition."
        )
    if _cannot_be_fitted(d) and d.train.calibrated <= d.train.before:
        worse = ", ".join(f"{name} ({after:.2f} K, {before:.2f} K as delivered)"
                          for name, (before, after) in d.spoiled.items())  # fmt: skip
        return (
            f"Yes: calibrated, the model is further from {worse}, closer to others. They do not fit one machine, and "
            f"no effect explains that ({reached}). Look first for what was changed between them, and for wrong columns."
        )
    if _cannot_be_fitted(d):
        return (
            f"Yes: calibrated, the model is further from what it was learnt from ({d.train.calibrated:.2f} K) than as "
            f"delivered ({d.train.before:.2f} K), and no effect explains that ({reached}). Look first for swapped or "
            "wrong columns, other units, and a wrong definition."
        )
    where = " in what was learnt from" if d.missed else ""
    return f"Nothing that these data show{where}: {reached}."


def _taken_back(d: Diagnosis) -> tuple[str, ...]:
    """Effects that held-out readings took back."""
    if d.refuted is None:
        return ()
    less = f"with it the held-out readings are less probable, by {-d.refuted.log_score_gain:.0f} nat; both count."
    return (f"What was learnt from supports {d.refuted.names} ({d.refuted.log_e_value:.1f} nat), but {less}",)


def _cannot_be_fitted(d: Diagnosis) -> bool:
    """True if nothing was detected, but calibration made the model worse."""
    return d.verdict == "unexplained" and d.log_e_value <= d.threshold


def _farthest(d: Diagnosis) -> tuple[float, str]:
    """Largest error of the calibrated model, and of what."""
    errors = ((d.train.calibrated, "learnt from"), (d.holdout.calibrated, "held out"))
    return max((error for error in errors if not math.isnan(error[0])), default=(0.0, ""))


def _is_clear(d: Diagnosis) -> bool:
    """True if something is missing with the probability of a claim; at the threshold it is one half."""
    return 1.0 - d.kinds.get("nothing", 0.0) >= d.settings.claim_from


def _in_what(d: Diagnosis) -> str:
    """The model or the measurement; with a word of caution where the other one has some probability too."""
    if d.verdict == "unexplained":
        return ""
    fault = d.verdict == "sensor_fault"
    if _may_be_either(d):
        return ", in the measurement or in the model"
    measurement = sum(one.probability for one in d.ranking if one.family == MEASUREMENT)
    sure = (measurement if fault else 1.0 - measurement) >= d.settings.claim_from or not _is_clear(d)
    return f", {'' if sure else 'probably '}in the {'measurement' if fault else 'model'}"


def _may_be_either(d: Diagnosis) -> bool:
    """True if all that is reported are ties that a fault of the measurement leads, with physics among them."""
    led = [bool(finding.tie_set) and finding.kind == "sensor" for finding in d.findings]
    return d.verdict == "missing_physics" and bool(led) and all(led)


def _where(d: Diagnosis) -> tuple[str, ...]:
    if not d.location:
        return ()
    if d.verdict in NO_CLAIM:
        likely = [place for place in d.location[:MOST_NEAREST] if place.probability >= NEAREST]
        told = _places_told(likely)
        return (f"If something is missing all the same, most probably in {told}",) if told else ()
    told = _places_told(d.places)
    place = next((one for one in d.places if one.heat_max_W), None)
    if place is None:
        fault = d.verdict == "sensor_fault" or d.location[0].node not in d.network.node_names
        return (f"{told}: {'in a reading or an input; no heat' if fault else 'no heat was estimated there'}",)
    way = "taken away" if place.heat_mean_W < 0.0 else "added"
    mean, most = number(abs(place.heat_mean_W)), number(abs(place.heat_max_W))
    where = "" if place is d.places[0] else f"in {' and '.join(place.nodes)} "
    heat = f"{where}{mean} W {way} on average over the recordings, {most} W at most"
    return (f"{told}; {heat}; {place.regime}",)


def _places_told(places: Sequence[Location]) -> str:
    named = (
        f"{', '.join(place.nodes[:2])} and {len(place.nodes) - 2} more"
        if len(place.nodes) > MOST_TOGETHER
        else " and ".join(place.nodes)
        for place in places
    )
    return ", ".join(f"{name} ({share(place.probability)})" for name, place in zip(named, places, strict=True))


def _what(d: Diagnosis) -> tuple[str, ...]:
    lines: list[str] = []
    for item in d.items:
        lines.append(f"{item[0].grade.capitalize()}: {item[0].says} [{title_of(item)}]")
        for finding in item:
            says = "" if finding.says == item[0].says else f"with it: {finding.says}"
            date = "" if finding.date is None else date_told(finding.date)
            numbers = (values_told(finding), date, predicting_told(d, finding))
            lines += [f"  {line}" for line in (says, *numbers) if line]
    if d.nearest:
        told = ", ".join(f"{named(one.mechanism, one.place)} ({one.probability:.2f}"
                         f"{f'; {date_told(one.date)}' if one.date else ''})" for one in d.nearest)  # fmt: skip
        lines.append(f"No name is certain enough to be reported; most like: {told}.")
        if d.verdict == "parameter_error":
            lines.append("Several may be off, or the definition lacks a part or a path.")
    elif d.hints:
        told = ", ".join(f"{named(one.mechanism, one.place)} ({one.log_bayes:.0f} nat"
                         f"{f'; {date_told(one.date)}' if one.date else ''})" for one in d.hints)  # fmt: skip
        lines.append(f"Not shown by these data, but ahead of all other names: {told}.")
    elif not d.findings and d.verdict not in NO_CLAIM and not _cannot_be_fitted(d):
        lines.append(f"No name of the catalogue stands out: none has a probability of {NEAREST:g}.")
    lines += _far(d) if d.verdict in NO_CLAIM else ()
    return tuple(lines)


def _far(d: Diagnosis) -> list[str]:
    """Parameters far from their priors; where no effect was found, what to make of them."""
    far = sorted((c for c in d.calibration if c.is_far), key=lambda c: -abs(c.shift_in_sd))
    if not far:
        return []
    deviations = {p.name for p in d.network.parameters if p.start == 0.0}  # from what the definition assumes
    told = []
    for c in far[:MOST_FAR]:
        what = "; ".join(filter(None, (d.descriptions.get(c.parameter), f"{abs(c.shift_in_sd):.1f} sd")))
        way = "off by" if c.parameter in deviations else "="
        told.append(f"{c.parameter} {way} {c.estimate:.3g}{behind_a_number(c.unit)} ({what})")
    use = ": check what they rest on, or whether a part or a path is missing" if d.verdict in NO_CLAIM else ""
    return [f"Far from what was expected: {', '.join(told)}{use}."]


def _how_sure(d: Diagnosis) -> tuple[str, ...]:
    lines = []
    for item in d.items:
        finding = item[0]
        of = "of this name, the nearest one," if finding.acts_like else "of one of these" if finding.tie_set else ""
        if finding.acts_like and finding.sureness > finding.probability:
            of = f"of this name {share(finding.probability)}, of all that act alike"
        title = f"{title_of(item)}: " if len(d.items) > 1 else ""
        line = " ".join(filter(None, (f"{title}{finding.grade}, probability", of, share(finding.sureness))))
        others = [rival for rival in finding.confusable_with if rival.law not in finding.tie_set]
        roles = (("not ruled out instead", True), ("may act as well", False))
        for words, instead in roles[: 1 + d.further_helps]:
            told = [f"{named(r.mechanism, r.place)} ({r.probability:.2f})" for r in others if r.instead is instead]
            line += f"; {words}: {', '.join(told[:MOST_NEAREST])}" if told else ""
        lines.append(line)
    if not d.findings and d.kinds and not _cannot_be_fitted(d):
        kinds = sorted(d.kinds.items(), key=lambda kind: -kind[1])
        told = [f"{kind} {share(p)}" for kind, p in kinds if p >= LEAST_RIVAL]
        lines.append(f"Probabilities: {', '.join(told)}.")
    if d.known.has_physics:
        known = ", ".join(d.known.summary()["findings"]) or "calibrated values"
        lines.append(f"Known before, and part of the model as delivered: {known}.")
    lines += _assumed_told(d)
    lines += () if d.verdict in NO_CLAIM else _far(d)
    if d.remaining_note:
        lines.append(f"Remaining: {d.remaining_note}")
    return tuple(lines)


def _assumed_told(d: Diagnosis) -> list[str]:
    """Model error, draughts and sessions as assumed; where something is missing, the evidence with others too."""
    lines, assumed, missing = [], d.assumed, d.log_e_value > d.threshold
    if assumed.error_class:
        what = "part of a finding" if d.findings else "a real effect"
        hides = f", the largest, because the model fits badly: {what} can hide in it"
        lines.append(f"Model error assumed: class {assumed.error_class}"
                     f"{hides if assumed.error_class == widest_class().name else ''}.")  # fmt: skip
    if missing and assumed.draughts_ahead > 0.0:
        still = d.log_e_value + assumed.draughts_ahead
        lines.append(f"Against the machine in still air it is {still:.1f} nat; without an effect draughts are more "
                     f"probable, by {assumed.draughts_ahead:.1f} nat.")  # fmt: skip
    if missing and assumed.scaled_error:
        lines.append(robustness_told(assumed.scaled_error))
    if missing and assumed.repeating:
        lines.append(repeating_told(*assumed.repeating))
    if assumed.session_s > LITTLE_SPREAD:
        lines.append(
            f"Between sessions parameters differ by {assumed.session_s:.2f} standard deviations of their priors."
        )
    return lines


def _how_much_better(d: Diagnosis) -> tuple[str, ...]:
    lines, without = [], f" without {', '.join(d.faulty)}" if d.faulty else ""
    for name, fits in (("held-out", d.holdout), ("training", d.train)):
        if fits.before == fits.before:
            what = "the findings" if d.findings else "what was fitted"
            found = f", {fits.found:.2f} K with {what}" if d.findings or d.terms else ""
            learnt = f", {fits.after:.2f} K with what was learnt of model error" if d.learnt else ""
            lines.append(
                f"RMSE {name}{without}: {fits.before:.2f} K as delivered, {fits.calibrated:.2f} K calibrated"
                f"{found}{learnt} (noise {d.noise_K:.2f} K)"
            )
    lines += [*_as_stated(d), *_odd_recordings(d)]
    if (loss := d.model.mean_loss) is not None:
        apart = (
            ": more than its error, so take no losses from that model; temperatures alone give ratios of heats, and a "
            "measured loss would settle it"
        ) if loss.is_far else (
            ". Without a measured loss watts rest on the heat capacities of the definition: a mass that it lacks, as a "
            "bed or a frame, makes them too few (add FILE foundation_conduction)"
        ) if loss.moved else ""  # fmt: skip
        weighed = "" if loss.other_by_weight_W is None else (
            f" ({number(loss.other_by_weight_W)} W if all heat capacities together are as the definition states)"
        )  # fmt: skip
        lines.append(
            f"Mean total loss, not measured: {with_error(loss.estimate_W, loss.stderr_W)} W estimated{weighed}, "
            f"{number(loss.delivered_W)} W as delivered, {number(loss.predicting_W)} W in the model that predicts"
            f"{apart}"
        )
    if math.isfinite(d.left_out_K):
        lines.append(
            "What was learnt of model error is left out: with it held-out temperatures are missed by "
            f"{d.left_out_K:.2f} K"
        )
    nat = f"{abs(d.holdout_gain):.0f} nat" if abs(d.holdout_gain) >= 1.0 else "less than one nat"
    not_closer, more_probable = d.has_correction and d.holdout.after > d.holdout.calibrated, d.holdout_gain > 0.0
    if not_closer:
        score = f"; with model error allowed for they are more probable with the correction, by {nat} of log score"
        lines.append(
            "Held-out temperatures are not closer than with the calibrated model: predict with calibrated.toml"
            f"{score if more_probable else ''}"
        )
    lines += [
        f"{name} is missed: {d.holdout.recordings[name].after:.2f} K, where it was learnt from {d.train.after:.2f} K"
        for name in d.missed
    ]
    lines += _worse_recordings(d)
    named_terms = {finding.term.label for finding in d.findings if finding.term is not None}
    further = [term.label.replace("__", " ").replace("_", " ") for term in d.terms if term.label not in named_terms]
    if d.findings and further:
        lines.append(
            f"The correction also holds what predicts best, without a certain name (grade learnt): {', '.join(further)}"
        )
    scored = d.has_correction and math.isfinite(d.holdout_gain) and d.holdout_gain != 0.0  # 0: nothing was fitted
    withdrawn = d.contradicted and d.holdout.found > d.holdout.calibrated
    if scored and not ((not_closer or withdrawn) and more_probable):
        way = "better than" if more_probable else "worse than"
        lines.append(f"Held-out readings are predicted {way} by the calibrated model, by {nat} of log score")
    if d.contradicted:
        if d.holdout.contradict(d.holdout_gain, d.noise_K, d.further_threshold):
            by = "less probable readings" if d.holdout_gain < -d.further_threshold else "larger error of temperatures"
            of_terms = all(finding.term is not None for finding in d.findings)  # not a parameter, which has none
            without = ", and the corrected model does without them" if of_terms and not d.terms else ""
            lines.append(f"So the held-out recordings contradict the findings ({by}): no name is a claim{without}")
        else:
            by = " (temperatures are no closer with them)" if withdrawn else ""
            lines.append(f"So the held-out recordings do not confirm the findings{by}: no name is a claim")
    return tuple(lines)


def _as_stated(d: Diagnosis) -> list[str]:
    if not d.as_stated_K - d.holdout.after > d.noise_K:
        return []
    told = f"With instruments as stated held-out temperatures are missed by {d.as_stated_K:.2f} K"
    return [f"{told}: offsets, gains and lags that were estimated belong to the recorder, and an FMU has none"]


def _odd_recordings(d: Diagnosis) -> list[str]:
    """A recording that was learnt from and is missed by far more than the others: something is wrong in it alone."""
    off_K = {name: errors.after for name, errors in d.train.recordings.items()}
    if len(off_K) < 2:
        return []
    worst = max(off_K, key=lambda name: off_K[name])
    others = median(value for name, value in off_K.items() if name != worst)
    if off_K[worst] < ODD * others or off_K[worst] - others < d.settings.matters_K:
        return []
    told = f"{worst} alone is missed by {off_K[worst]:.2f} K, the others that were learnt from by {others:.2f} K"
    return [f"{told}: look in it for units, columns, instruments, and what was changed before"]


def _worse_recordings(d: Diagnosis) -> list[str]:
    """Held-out recordings that the correction misses by more than the calibrated model, where all together gain."""
    fits = d.holdout
    if not d.has_correction or fits.after > fits.calibrated:
        return []
    return [
        f"{name} alone is not closer: {errors.calibrated:.2f} K calibrated, {errors.after:.2f} K corrected"
        for name, errors in fits.recordings.items()
        if errors.after - errors.calibrated > d.noise_K
    ]


def _cannot_be_seen(d: Diagnosis) -> tuple[str, ...]:
    def first(names: list[str]) -> str:
        more = f" and {len(names) - MOST_UNSEEN} more" if len(names) > MOST_UNSEEN else ""
        return f"{', '.join(names[:MOST_UNSEEN])}{more}"

    names, lines = list(dict.fromkeys(one.mechanism for one in d.unseen)), []
    if names:
        lines.append(f"{first(names)}: silence about them means nothing.")
    if d.not_tried:
        lines.append(f"Not tried, having no place in this machine and its recordings: {first([*d.not_tried])}.")
    return tuple(lines)


def values_told(finding: Finding) -> str:
    """Numbers of a finding for a terminal."""
    told_else = (*_of_date(finding), *(OF_SWITCH if finding.switching is not None else ()))
    values = [(p.name, p.value, p.stderr, p.unit) for p in finding.parameters if p.name not in told_else]
    if finding.heat_mean_W > 0.0:
        values.append(("mean |heat|", finding.heat_mean_W, finding.heat_stderr_W, "W"))
    told = [
        f"{name} = {with_error(value, stderr).replace(MINUS, '-')}{behind_a_number(unit)}"
        for name, value, stderr, unit in values
    ]
    if (switch := finding.switching) is not None:
        told.append(f"on at {switch.on_degC:.1f} degC, off at {switch.off_degC:.1f} degC ({switch.followed})")
    return ", ".join(told)


def _of_date(finding: Finding) -> tuple[str, ...]:
    return () if finding.date is None else OF_DATE


def predicting_told(d: Diagnosis, finding: Finding) -> str:
    """Numbers of a finding that are far from the estimate in the model that predicts, and so in the FMU."""
    term = next((one for one in d.terms if finding.term is not None and one.label == finding.term.label), None)
    if term is None:
        return ""
    there = {p.name.removeprefix(f"{term.label}_"): p.start for p in term.parameters}
    both = [(p, there[p.name]) for p in finding.parameters if p.name in there and p.name not in _of_date(finding)]
    told = [f"{p.name} = {number(value)}{behind_a_number(p.unit)}" for p, value in both
            if 0.0 < FAR_SD * p.stderr < abs(value - p.value)]  # fmt: skip
    return f"in the model that predicts (correction.toml): {', '.join(told)}" if told else ""


def date_told(date: Change) -> str:
    """A date for a terminal."""
    band = "" if date.band_s is None else f" ({_time(date.band_s[0])} to {_time(date.band_s[1])})"
    end = "" if date.to_s is None else f", until {_time(date.to_s)}"
    utc = "" if date.utc is None else f", {date.utc[:16].replace('T', ' ')} UTC"
    return f"from {_time(date.from_s)} of {date.recording} on{band}{utc}{end}"


def _time(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f} h" if abs(seconds) > LONG_S else f"{seconds:.0f} s"


def size_of(one: ScaledError) -> str:
    """Size of the model error, in words."""
    return SIZES[one.factor]


def repeating_told(supported: Repeating, worse: Repeating) -> str:
    """Sentence on what the scan would say if the machine repeated worse.

    Examples
    --------
    >>> from dataclasses import replace
    >>> one = Repeating(deviation_in_sd=0.05, log_e_value=40.2, mechanism="windage", place="oil")
    >>> repeating_told(one, replace(one, deviation_in_sd=0.1, log_e_value=31.0))
    'Quick scan: 40 nat; 31 nat if sessions differ by 0.1 prior widths instead of 0.05: windage at oil ahead.'
    """
    ahead = ", then ".join(dict.fromkeys(named(one.mechanism, one.place) for one in (supported, worse)))
    return (
        f"Quick scan: {supported.log_e_value:.0f} nat; {worse.log_e_value:.0f} nat if sessions differ by "
        f"{worse.deviation_in_sd:g} prior widths instead of {supported.deviation_in_sd:g}: {ahead} ahead."
    )


def robustness_told(every: Sequence[ScaledError]) -> str:
    """Sentence on the evidence that the scan gives with model error of all sizes.

    Examples
    --------
    >>> one = ScaledError(factor=0.5, log_e_value=40.2, threshold=5.0, mechanism="windage", place="oil")
    >>> robustness_told([one])
    'Quick scan (before fits) with model error half as large 40 nat (5 needed): windage at oil ahead.'
    """
    names = [f"{named(one.mechanism, one.place)} ahead" for one in every]
    together = names[0] if len(set(names)) == 1 else ""
    told = [
        f"{size_of(one)} {one.log_e_value:.0f} nat ({one.threshold:.0f} needed{'' if together else f'; {name}'})"
        for one, name in zip(every, names, strict=True)
    ]
    return f"Quick scan (before fits) with model error {', '.join(told)}{f': {together}' if together else ''}."
