"""The result of a diagnosis: plain data for ``diagnosis.json``, the report and a notebook."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from diagnosis.results.number_format import MINUS, number, with_error
from diagnosis.results.result_parts import (
    Calibrated,
    Finding,
    Fits,
    Location,
    NotDetectable,
    PredictedRun,
    Ranked,
    ScaledError,
    named,
    or_none,
    robustness_told,
)
from diagnosis.results.tables import Table, draw_explanations, table_of
from models.correction.instruments import InputCorrection, SensorCorrection
from models.mechanisms import OPEN_FORM
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Term

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SCHEMA = 1
FAR_SD, MOST_FAR = 3.0, 3  # standard deviations of a prior, beyond which the summary tells of a parameter; how many
LIKELY = 0.5  # probability from which a further place is told
LEAST_RIVAL = 0.01  # probability of what is told as a rival
NEAREST, MOST_NEAREST = 0.1, 3  # probability from which an explanation is told that was not reported; of how many
MOST_UNSEEN = 6  # effects that the summary names of those that cannot be seen
OF_DATE = ("since", "lasting")  # parameters that the date contains
OF_SWITCH = ("set_point", "band")  # parameters that the switching temperatures contain
LONG_S = 7200.0  # times beyond are told in hours
LITTLE_SPREAD = 0.05  # deviation between sessions that is not worth a word, in prior standard deviations
NO_CLAIM = ("consistent", "insufficient_data")
Verdict = Literal[
    "consistent", "parameter_error", "missing_physics", "sensor_fault", "unexplained", "insufficient_data"
]
VERDICT_TEXT: Mapping[str, str] = {
    "consistent": "Nothing stands out: noise and model error explain the recordings.",
    "parameter_error": "A known parameter of the model is outside what its definition allows.",
    "missing_physics": "The machine shows physics that the model leaves out.",
    "sensor_fault": "A sensor, clock or recorded input is at fault, not the machine.",
    "unexplained": "Something is missing, and it matches no physics in the catalogue.",
    "insufficient_data": "These recordings are too short or too calm to decide.",
}
MEASUREMENT = "measurement"  # family
LARGEST_ERROR = "full"  # class of model error
PARTLY = "Part of what is missing was found; the rest matches no physics in the catalogue."
LIKELY_TEXT: Mapping[str, str] = {  # of the same verdicts where no name is a claim
    "parameter_error": "A parameter of the model is probably outside what its definition allows.",
    "missing_physics": "The machine probably shows physics that the model leaves out; its name is not certain.",
    "sensor_fault": "A sensor, clock or recorded input is probably at fault, not the machine.",
}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Diagnosis:
    """The result of :func:`diagnosis.diagnose`.

    Attributes
    ----------
    verdict : str
    gearbox : str
    log_e_value, threshold, p_value : float
        Evidence that something is missing, averaged over everything in the catalogue [nat], the level it had to reach,
        and exp(-evidence), at most 1. That would bound the chance of such evidence in a healthy machine only if the
        model were exact, which it never is; the threshold decides
    false_alarm_rate : float
        As asked for
    location : tuple of Location
        Most probable first
    findings : tuple of Finding
    calibration : tuple of Calibrated
    train, holdout : Fits
    noise_K : float
        White noise of a temperature row
    floor : str
        What structural floor was assumed
    misfit : float
        Mean square of the residual in the training recordings or, where something was found, in the held-out ones,
        whichever is larger, in multiples of what noise and structural floor make of it; above 1 they are not explained
    remaining_p_value : float
        exp(-evidence) of a further effect, at most 1, as `p_value`; NaN where no further look was taken
    remaining_note : str
    ranking : tuple of Ranked
    unseen : tuple of NotDetectable
    next_test : str
        What to measure next
    courses : tuple of PredictedRun
    network : ThermalNetwork
        The nominal one
    shapes : tuple of Term
        Tilts of the formulas that were calibrated along, see :mod:`diagnosis.setup.shapes`
    inputs : mapping
        Hashes and version
    notes : tuple of str
        What was cleaned in the recordings
    kinds : mapping of str to float
        Probability of every kind of explanation: nothing, parameter, measurement, mechanism, pair, outside
    claim_from : float
        Probability from which a name is a claim, as asked for
    matters_K, matters_W : float
        Size from which an effect matters, as asked for
    error_class : str
        Class of model error of the best explanation; of nothing where nothing is missing
    error_evidence : mapping of str to float
        Log evidence of every class without any effect, less that of the best, [nat]
    scaled_error : tuple of ScaledError
    session_s : float
        Deviation between sessions that the data support, in prior standard deviations
    holdout_gain : float
        Log predictive density of the held-out readings: final model less the calibrated one, [nat]; NaN without any
    faulty : tuple of str
        Channels that neither the calibration nor the errors over all temperatures count, because their sensors fail
    terms : tuple of Term
        What the model that predicts has more than the nominal one, with its values as the parameters' start and their
        standard errors as `sd`; of an effect without a name that is certain enough too
    sensors : tuple of SensorCorrection
        How its sensors differ from the machine, without what is in `terms`
    true_inputs : tuple of InputCorrection
        What it took the inputs to be
    starts_at : mapping of str to float
        Start of every recording on the time axis that they share, [s]: the clock of terms with a date
    """

    verdict: Verdict
    gearbox: str
    log_e_value: float
    threshold: float
    p_value: float
    false_alarm_rate: float
    location: tuple[Location, ...]
    findings: tuple[Finding, ...]
    calibration: tuple[Calibrated, ...]
    train: Fits
    holdout: Fits
    noise_K: float
    floor: str
    misfit: float
    remaining_p_value: float
    remaining_note: str
    ranking: tuple[Ranked, ...]
    unseen: tuple[NotDetectable, ...]
    next_test: str
    courses: tuple[PredictedRun, ...]
    network: ThermalNetwork
    shapes: tuple[Term, ...]
    inputs: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    kinds: Mapping[str, float] = field(default_factory=dict)
    claim_from: float = 0.9
    matters_K: float = 1.0
    matters_W: float = 0.0
    error_class: str = ""
    error_evidence: Mapping[str, float] = field(default_factory=dict)
    scaled_error: tuple[ScaledError, ...] = ()
    session_s: float = 0.0
    holdout_gain: float = math.nan
    faulty: tuple[str, ...] = ()
    terms: tuple[Term, ...] = ()
    sensors: tuple[SensorCorrection, ...] = ()
    true_inputs: tuple[InputCorrection, ...] = ()
    starts_at: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Everything of ``diagnosis.json``, schema :data:`SCHEMA`."""
        return {
            "schema": SCHEMA,
            "gearbox": self.gearbox,
            "verdict": self.verdict,
            "significance": {
                "p_value": self.p_value,
                "log_e_value": self.log_e_value,
                "threshold": self.threshold,
                "false_alarm_rate": self.false_alarm_rate,
                "test": "log_e_value: log of the mean Bayes factor over the catalogue, all parameters marginalised; "
                        "something is missing if it exceeds threshold. p_value = exp(-log_e_value), at most 1: a bound "
                        "on chance for an exact model only",
            },
            "location": [
                {
                    "node": place.node,
                    "probability": place.probability,
                    "heat_W": {"mean": place.heat_mean_W, "max": place.heat_max_W},
                    "when": [{"recording": r, "from_s": a, "to_s": b} for r, a, b in place.when],
                    "regime": place.regime,
                }
                for place in self.location
            ],
            "findings": [finding.to_dict() for finding in self.findings],
            "calibration": [asdict(one) for one in self.calibration],
            "fit": {"train": self.train.to_dict(),
                    "holdout": self.holdout.to_dict() | {"log_score_gain": or_none(self.holdout_gain)},
                    "faulty_channels": list(self.faulty), "noise_K": self.noise_K, "floor": self.floor},
            "kinds": dict(self.kinds),
            "settings": {"false_alarm_rate": self.false_alarm_rate, "claim_from": self.claim_from,
                         "matters_K": self.matters_K, "matters_W": self.matters_W},
            "model_error": {"class": self.error_class, "evidence": dict(self.error_evidence),
                            "scaled": [asdict(one) for one in self.scaled_error]},
            "sessions": {"deviation_in_sd": self.session_s},
            "remaining": {
                "p_value": or_none(self.remaining_p_value),
                "note": self.remaining_note,
                "misfit": or_none(self.misfit),
            },
            "ranking": [
                {"mechanism": r.mechanism, "place": r.place, "family": r.family, "log_bayes": r.log_bayes,
                 "probability": r.probability}
                for r in self.ranking
            ],
            "not_visible": [asdict(one) | {"expected": or_none(one.expected)} for one in self.unseen],
            "next_test": self.next_test,
            "notes": list(self.notes),
            "inputs": dict(self.inputs),
        }  # fmt: skip

    @property
    def verdict_text(self) -> str:
        """The verdict in a sentence."""
        if self.verdict == "unexplained" and any(f.family != OPEN_FORM for f in self.findings):
            return PARTLY
        if any(finding.grade == "claim" for finding in self.findings):
            return VERDICT_TEXT[self.verdict]
        return LIKELY_TEXT.get(self.verdict, VERDICT_TEXT[self.verdict])

    @property
    def places(self) -> tuple[Location, ...]:
        """The most probable place, and every other one that is likely: several effects have several."""
        return (*self.location[:1], *(place for place in self.location[1:] if place.probability >= LIKELY))

    @property
    def items(self) -> tuple[tuple[Finding, ...], ...]:
        """Findings by their titles: several laws of one name at one place, with other courses in time, are one item."""
        titles = dict.fromkeys(finding.title for finding in self.findings)
        return tuple(tuple(finding for finding in self.findings if finding.title == title) for title in titles)

    @property
    def further_helps(self) -> bool:
        """True if the recordings give evidence of a further effect; without, its probability is only a prior one."""
        return self.remaining_p_value < math.exp(-self.threshold)

    @property
    def nearest(self) -> tuple[Ranked, ...]:
        """Most probable explanations if something is missing and none could be reported."""
        if self.findings or self.verdict in NO_CLAIM:
            return ()
        return tuple(one for one in self.ranking[:MOST_NEAREST] if one.probability >= NEAREST)

    @property
    def first_screen(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """First questions of a reader with their answers; questions without an answer are left out.

        Is something missing, where, what, how sure, how much better, what next, and which effects cannot be seen.
        """
        asked = (
            ("Is something missing?", (self._missing(),)),
            ("Where?", self._where()),
            ("What?", self._what()),
            ("How sure?", self._how_sure()),
            ("How much better?", self._how_much_better()),
            ("What next?", (self.next_test,) if self.next_test else ()),
            ("What cannot be seen in these data?", self._cannot_be_seen()),
        )
        return tuple((question, answers) for question, answers in asked if answers)

    def _missing(self) -> str:
        if self.verdict == "insufficient_data":
            return "These data cannot decide it."
        reached = f"evidence {self.log_e_value:.1f} nat, {self.threshold:.1f} needed"
        rate = f"false-alarm rate {100.0 * self.false_alarm_rate:g} %"
        if self.log_e_value > self.threshold:
            return f"Yes{self._in_what()}: {reached} ({rate})."
        return f"Nothing that these data show: {reached} ({rate})."

    def _in_what(self) -> str:
        """The model or the measurement; with a word of caution where the other one has some probability too."""
        if self.verdict == "unexplained":
            return ""
        measurement = sum(one.probability for one in self.ranking if one.family == MEASUREMENT)
        fault = self.verdict == "sensor_fault"
        sure = (measurement if fault else 1.0 - measurement) >= self.claim_from
        return f", {'' if sure else 'probably '}in the {'measurement' if fault else 'model'}"

    def _where(self) -> tuple[str, ...]:
        if not self.location or self.verdict in NO_CLAIM:
            return ()
        told = ", ".join(f"{place.node} ({_share(place.probability)})" for place in self.places)
        place = self.location[0]
        if not place.heat_max_W:
            return (f"{told}: in a reading or an input; no heat",)
        way = "taken away" if place.heat_mean_W < 0.0 else "added"
        mean, most = number(abs(place.heat_mean_W)), number(abs(place.heat_max_W))
        heat = f"{mean} W {way} on average, {most} W at most"
        return (f"{told}; {heat}; {place.regime}",)

    def _what(self) -> tuple[str, ...]:
        lines: list[str] = []
        for item in self.items:
            lines.append(f"{item[0].grade.capitalize()}: {item[0].says} [{item[0].title}]")
            lines += [f"  {line}" for finding in item for line in (values_told(finding), date_told(finding)) if line]
        if self.nearest:
            told = ", ".join(f"{one.mechanism} at {one.place} ({one.probability:.2f})" for one in self.nearest)
            lines.append(f"No name is certain enough to be reported; most like: {told}.")
        elif not self.findings and self.verdict not in NO_CLAIM:
            lines.append("Nothing in the catalogue is like it.")
        return tuple(lines)

    def _how_sure(self) -> tuple[str, ...]:
        lines = []
        for finding, *_ in self.items:
            of = "of this name, the nearest one," if finding.acts_like else "of one of these" if finding.tie_set else ""
            if finding.acts_like and finding.sureness > finding.probability:
                of = f"of this name {_share(finding.probability)}, of all that act alike"
            title = f"{finding.title}: " if len(self.items) > 1 else ""
            line = " ".join(filter(None, (f"{title}{finding.grade}, probability", of, _share(finding.sureness))))
            others = [r for r in finding.confusable_with
                      if r.probability >= LEAST_RIVAL and r.mechanism not in finding.tie_set]  # fmt: skip
            roles = (("not ruled out instead", True), ("may act as well", False))
            for words, instead in roles[: 1 + self.further_helps]:
                told = [f"{named(r.mechanism, r.place)} ({r.probability:.2f})" for r in others if r.instead is instead]
                line += f"; {words}: {', '.join(told[:MOST_NEAREST])}" if told else ""
            lines.append(line)
        if not self.findings and self.kinds:
            kinds = sorted(self.kinds.items(), key=lambda kind: -kind[1])
            told = [f"{kind} {_share(p)}" for kind, p in kinds if p >= LEAST_RIVAL]
            lines.append(f"Probabilities: {', '.join(told)}.")
        if self.error_class:
            hides = ", the largest: a real effect can hide in it" if self.error_class == LARGEST_ERROR else ""
            lines.append(f"Model error assumed: class {self.error_class}{hides}.")
        if self.scaled_error and self.log_e_value > self.threshold:
            lines.append(robustness_told(self.scaled_error))
        if self.session_s > LITTLE_SPREAD:
            lines.append(f"Between sessions the machine differs by {self.session_s:.2f} of the priors' widths.")
        far = sorted((c for c in self.calibration if abs(c.shift_in_sd) > FAR_SD), key=lambda c: -abs(c.shift_in_sd))
        if far:
            told = [f"{c.parameter} = {c.value:.3g}{_unit(c.unit)} ({abs(c.shift_in_sd):.1f} sd)"
                    for c in far[:MOST_FAR]]  # fmt: skip
            lines.append(f"Far from what the definition expects: {', '.join(told)}.")
        if self.remaining_note:
            lines.append(f"Remaining: {self.remaining_note}")
        return tuple(lines)

    def _how_much_better(self) -> tuple[str, ...]:
        lines = []
        for name, fits in (("held-out", self.holdout), ("training", self.train)):
            if fits.before == fits.before:
                after = f", {fits.after:.2f} K with the findings" if self.findings else ""
                lines.append(
                    f"RMSE {name}: {fits.before:.2f} K as delivered, {fits.calibrated:.2f} K calibrated{after} "
                    f"(noise {self.noise_K:.2f} K)"
                )
        if self.findings and self.holdout.after > self.holdout.calibrated:
            lines.append("Held-out temperatures are not closer than with the calibrated model: predict with that one")
        named_terms = {finding.term.label for finding in self.findings if finding.term is not None}
        further = len([term for term in self.terms if term.label not in named_terms])
        if self.findings and further:
            lines.append(f"The findings' model holds {further} more effect{'s' * (further > 1)} without a certain name")
        if self.findings and math.isfinite(self.holdout_gain):
            way = "better" if self.holdout_gain >= 0.0 else "worse"
            lines.append(
                f"Held-out readings are predicted {way} than by the calibrated model, by "
                f"{abs(self.holdout_gain):.0f} nat of log score"
            )
        return tuple(lines)

    def _cannot_be_seen(self) -> tuple[str, ...]:
        if not self.unseen:
            return ()
        names = list(dict.fromkeys(one.mechanism for one in self.unseen))
        more = f" and {len(names) - MOST_UNSEEN} more" if len(names) > MOST_UNSEEN else ""
        return (f"{', '.join(names[:MOST_UNSEEN])}{more}: silence about them means nothing.",)

    def summary(self) -> list[str]:
        """The diagnosis in some ten lines: the verdict, then the answers of :attr:`first_screen`."""
        lines = [f"{self.verdict.replace('_', ' ')}: {self.verdict_text}"]
        for question, answers in self.first_screen:
            first, *rest = answers
            lines += [f"{question} {first}", *(f"    {line}" for line in rest)]
        return lines

    def __str__(self) -> str:
        return "\n".join(self.summary())

    def __repr__(self) -> str:
        found = "; ".join(f"{f.grade}: {f.title}" for f in self.findings) or "no findings"
        return f"<Diagnosis of {self.gearbox!r}: {self.verdict.replace('_', ' ')}; {found}>"

    def to_dataframe(self, what: Table = "findings") -> pd.DataFrame:
        """Return a table.

        Parameters
        ----------
        what : str
            ``findings``: their numbers with errors and units; ``explanations``: all that were compared, with
            probabilities; ``calibration``: parameters of the model; ``errors``: of every channel, [K] or [W]

        Raises
        ------
        InputError
            If there is no such table.
        """
        return table_of(self, what)

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the most probable explanations; predictions over time are drawn by :meth:`PredictedRun.plot`.

        Parameters
        ----------
        ax : Axes or None
            By default new ones

        Returns
        -------
        Axes
        """
        return draw_explanations(self, ax)

    def _repr_html_(self) -> str:
        head, *rest = self.summary()
        items = "".join(f"<li>{html.escape(line.strip())}</li>" for line in rest)
        return f"<div><b>{html.escape(head)}</b><ul>{items}</ul></div>"


def values_told(finding: Finding) -> str:
    """Numbers of a finding for a terminal."""
    told_else = OF_DATE if finding.switching is None else (*OF_DATE, *OF_SWITCH)
    values = [(p.name, p.value, p.stderr, p.unit) for p in finding.parameters if p.name not in told_else]
    if finding.heat_mean_W > 0.0:
        values.append(("mean |heat|", finding.heat_mean_W, finding.heat_stderr_W, "W"))
    told = [
        f"{name} = {with_error(value, stderr).replace(MINUS, '-')}{_unit(unit)}" for name, value, stderr, unit in values
    ]
    if finding.switching is not None:
        told.append(f"on at {finding.switching.on_degC:.1f} degC, off at {finding.switching.off_degC:.1f} degC")
    return ", ".join(told)


def date_told(finding: Finding) -> str:
    """Date of a finding for a terminal."""
    date = finding.date
    if date is None:
        return ""
    band = "" if date.band_s is None else f" ({_time(date.band_s[0])} to {_time(date.band_s[1])})"
    end = "" if date.to_s is None else f", until {_time(date.to_s)}"
    utc = "" if date.utc is None else f", {date.utc[:16].replace('T', ' ')} UTC"
    return f"from {_time(date.from_s)} of {date.recording} on{band}{utc}{end}"


def _time(seconds: float) -> str:
    return f"{seconds / 3600.0:.2f} h" if abs(seconds) > LONG_S else f"{seconds:.0f} s"


def _unit(symbol: str) -> str:
    """A unit behind a number."""
    return "" if symbol == "1" else f" {symbol}"


def _share(probability: float) -> str:
    """A probability; never rounded to certainty."""
    return f"{probability:.2f}" if probability < 0.995 else "> 0.99"
