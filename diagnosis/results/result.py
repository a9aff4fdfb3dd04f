"""The result of a diagnosis: plain data for ``diagnosis.json``, the report and a notebook."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from diagnosis.decision.stage import LEAST_RIVAL, LEAST_SHARE
from diagnosis.results.number_format import MINUS, with_error
from models.base.types import Array
from models.mechanisms import OPEN_FORM
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Term

SCHEMA = 1
FAR_SD, MOST_FAR = 3.0, 3  # standard deviations of a prior, beyond which the summary tells of a parameter; how many
LIKELY = 0.5  # probability from which a further place is told
NEAREST, MOST_NEAREST = 0.1, 3  # probability from which what was not accepted is told, and of how many
Verdict = Literal[
    "consistent", "parameter_error", "missing_physics", "sensor_fault", "unexplained", "insufficient_data"
]
VERDICT_TEXT: Mapping[str, str] = {
    "consistent": "The recordings agree with the model within its stated uncertainties.",
    "parameter_error": "A known parameter of the model is outside what its definition allows.",
    "missing_physics": "The gearbox shows physics that the model leaves out.",
    "sensor_fault": "A sensor, clock or recorded input is at fault, not the gearbox.",
    "unexplained": "Something is missing, and it matches no physics in the catalogue.",
    "insufficient_data": "These recordings are too short or too calm to decide.",
}
REFUSED = "refused (by the held-out recordings, as impossible, or as too small)"
AHEAD = f"more probable by what was learnt from, but {REFUSED}"
NOT_ACCEPTED = f"by what was learnt from, but it was {REFUSED}"
PARTLY = "Part of what is missing was found; the rest matches no physics in the catalogue."


@dataclass(frozen=True, kw_only=True)
class ParameterValue:
    """A number that was found, with its standard error and unit."""

    name: str
    value: float
    stderr: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Rival:
    """Another explanation that these data do not rule out, and what would.

    Attributes
    ----------
    mechanism, place : str
    probability : float
    separate_by : str
        The experiment or sensor that would separate the two
    """

    mechanism: str
    place: str
    probability: float
    separate_by: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Finding:
    """One effect that was found.

    Attributes
    ----------
    mechanism : str
        Name in the catalogue; ``parameter`` for a parameter out of its prior; of an open form its name
    family, place, node, kind, reference : str
        `node`: the part of the network, or the channel, that it acts on
    equation : str
        LaTeX
    probability : float
        Among all explanations that were compared
    log_bayes : float
        Evidence against leaving it out, [nat]
    parameters : tuple of ParameterValue
    confusable_with : tuple of Rival
    heat_mean_W, heat_stderr_W, heat_max_W : float
        Mean magnitude over the training recordings with its standard error, and the largest one; 0 for a fault of an
        instrument
    heat : mapping of recording to (time [s], heat [W]) Arrays
        Heat of the finding over time; empty for sensor faults
    term : Term or None
        With the found values as its parameters' start
    """

    mechanism: str
    family: str
    place: str
    node: str
    kind: str
    #: The finding in one sentence.
    says: str
    reference: str
    equation: str
    probability: float
    log_bayes: float
    parameters: tuple[ParameterValue, ...]
    confusable_with: tuple[Rival, ...] = ()
    heat_mean_W: float = 0.0
    heat_stderr_W: float = 0.0
    heat_max_W: float = 0.0
    heat: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    term: Term | None = None


@dataclass(frozen=True, kw_only=True)
class Location:
    """Where heat comes or goes that the calibrated model cannot explain.

    Attributes
    ----------
    node : str
    probability : float
    heat_mean_W, heat_max_W : float
    when : tuple of (recording, from_s, to_s)
        Windows in which it acts
    regime : str
        When it acts in words of speed, torque and temperature
    """

    node: str
    probability: float
    heat_mean_W: float
    heat_max_W: float
    when: tuple[tuple[str, float, float], ...]
    regime: str


@dataclass(frozen=True, kw_only=True, eq=False)
class MissingHeat:
    """The heat that the calibrated model lacks at the most probable place, over time.

    Attributes
    ----------
    recording, node : str
    time, mean, sd : Array, shape (K,)
        [s], [W], [W]
    speed, torque, temperature : Array, shape (K,)
        Operating point: [1/min], [N m], and the node's temperature [degC]
    law : Array, shape (K,), or None
        Heat of the findings there, [W]
    """

    recording: str
    node: str
    time: Array
    mean: Array
    sd: Array
    speed: Array
    torque: Array
    temperature: Array
    law: Array | None


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictedRun:
    """One recording as measured and as simulated, free-running.

    Attributes
    ----------
    recording : str
    held_out : bool
    time : Array, shape (rows,)
        [s]
    speed, torque : Array, shape (rows,)
        [1/min], [N m]
    measured, before, calibrated, after : mapping of channel to Array, shape (rows,)
        [degC], or [W] for ``P_loss``; before: the model as delivered; calibrated: its parameters tuned inside their
        priors; after: with the findings
    counts_from_s : float
        Rows before it served to find the start temperatures and do not count
    """

    recording: str
    held_out: bool
    time: Array
    speed: Array
    torque: Array
    measured: Mapping[str, Array]
    before: Mapping[str, Array]
    calibrated: Mapping[str, Array]
    after: Mapping[str, Array]
    counts_from_s: float


@dataclass(frozen=True, kw_only=True)
class Fits:
    """Root mean square errors of one set of recordings.

    Attributes
    ----------
    before, calibrated, after : float
        Over all temperatures, [K]; NaN without recordings
    sensors : mapping of channel to (before, calibrated, after)
        [K], or [W] for ``P_loss``
    """

    before: float
    calibrated: float
    after: float
    sensors: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True, kw_only=True)
class Calibrated:
    """A parameter of the model as calibrated."""

    parameter: str
    prior: float
    value: float
    stderr: float
    shift_in_sd: float
    unit: str = "1"


@dataclass(frozen=True, kw_only=True)
class Ranked:
    """One line of the ranking: every explanation that was scored."""

    mechanism: str
    place: str
    family: str
    log_bayes: float
    probability: float


@dataclass(frozen=True, kw_only=True)
class NotDetectable:
    """An effect of typical size that these data could not have shown, and the test that would show it."""

    mechanism: str
    place: str
    needed: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """The result of :func:`diagnosis.diagnose`.

    Attributes
    ----------
    verdict : str
    gearbox : str
    log_e_value, threshold, p_value : float
        Evidence that something is missing, averaged over everything in the catalogue [nat], the level it had to reach,
        and the bound on the probability of reaching it by chance
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
        Of a further effect, if nothing more is missing; NaN where no further look was taken
    remaining_note : str
    ranking : tuple of Ranked
    unseen : tuple of NotDetectable
    next_test : str
        What to measure next
    missing_heat : tuple of MissingHeat
    courses : tuple of PredictedRun
    network : ThermalNetwork
        The nominal one
    shapes : tuple of Term
        Tilts of the formulas that were calibrated along, see :mod:`diagnosis.inference.shapes`
    inputs : mapping
        Hashes and version
    notes : tuple of str
        What was cleaned in the recordings
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
    missing_heat: tuple[MissingHeat, ...]
    courses: tuple[PredictedRun, ...]
    network: ThermalNetwork
    shapes: tuple[Term, ...]
    inputs: Mapping[str, Any]
    notes: tuple[str, ...] = ()

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
                "test": "mean Bayes factor over the catalogue, all parameters marginalised (nominally an e-value)",
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
            "findings": [_finding(finding) for finding in self.findings],
            "calibration": [
                {"parameter": c.parameter, "prior": c.prior, "value": c.value, "stderr": c.stderr,
                 "shift_in_sd": c.shift_in_sd, "unit": c.unit}
                for c in self.calibration
            ],
            "fit": {"train": _fits(self.train), "holdout": _fits(self.holdout), "noise_K": self.noise_K,
                    "floor": self.floor},
            "remaining": {
                "p_value": self.remaining_p_value if math.isfinite(self.remaining_p_value) else None,
                "note": self.remaining_note,
                "misfit": self.misfit if math.isfinite(self.misfit) else None,
            },
            "ranking": [
                {"mechanism": r.mechanism, "place": r.place, "family": r.family, "log_bayes": r.log_bayes,
                 "probability": r.probability}
                for r in self.ranking
            ],
            "not_visible": [{"mechanism": u.mechanism, "place": u.place, "needed": u.needed} for u in self.unseen],
            "next_test": self.next_test,
            "notes": list(self.notes),
            "inputs": dict(self.inputs),
        }  # fmt: skip

    @property
    def verdict_text(self) -> str:
        """The verdict in a sentence."""
        if self.verdict == "unexplained" and any(f.family != OPEN_FORM for f in self.findings):
            return PARTLY
        return VERDICT_TEXT[self.verdict]

    @property
    def places(self) -> tuple[Location, ...]:
        """The most probable place, and every other one that is likely: several effects have several."""
        return (*self.location[:1], *(place for place in self.location[1:] if place.probability >= LIKELY))

    @property
    def nearest(self) -> tuple[Ranked, ...]:
        """Best explanations of the training data, most probable first, if nothing was accepted."""
        if self.findings or self.verdict in ("consistent", "insufficient_data"):
            return ()
        return tuple(one for one in self.ranking[:MOST_NEAREST] if one.probability >= NEAREST)

    def summary(self) -> list[str]:
        """The diagnosis in about ten lines."""
        lines = [f"{self.verdict.replace('_', ' ')}: {self.verdict_text}"]
        for finding in self.findings:
            lines += _lines(finding)
        if self.location and self.verdict not in ("consistent", "insufficient_data"):
            told = ", ".join(f"{place.node} ({place.probability:.2f})" for place in self.places)
            lines.append(f"Where: {told}; {self.location[0].regime}")
        if self.nearest:
            told = ", ".join(f"{one.mechanism} at {one.place} ({one.probability:.2f})" for one in self.nearest)
            lines.append(f"Most like: {told}; {NOT_ACCEPTED}")
        for name, fits in (("training", self.train), ("held-out", self.holdout)):
            if fits.before == fits.before:
                lines.append(
                    f"RMSE {name}: {fits.before:.2f} K as delivered, {fits.calibrated:.2f} K calibrated, "
                    f"{fits.after:.2f} K with the findings (noise {self.noise_K:.2f} K)"
                )
        far = sorted((c for c in self.calibration if abs(c.shift_in_sd) > FAR_SD), key=lambda c: -abs(c.shift_in_sd))
        if far:
            told = ", ".join(f"{c.parameter} = {c.value:.3g} ({abs(c.shift_in_sd):.1f} sd)" for c in far[:MOST_FAR])
            lines.append(f"Far from what the definition expects: {told}")
        if self.remaining_note:
            lines.append(f"Remaining: {self.remaining_note}")
        if self.next_test:
            lines.append(f"Next: {self.next_test}")
        return lines

    def __str__(self) -> str:
        return "\n".join(self.summary())

    def _repr_html_(self) -> str:
        head, *rest = self.summary()
        items = "".join(f"<li>{html.escape(line.strip())}</li>" for line in rest)
        return f"<div><b>{html.escape(head)}</b><ul>{items}</ul></div>"


def _lines(finding: Finding) -> list[str]:
    """A finding for a terminal: what, how strong, what else it may be."""
    lines = [f"{finding.says} [{finding.mechanism} at {finding.place}, probability {finding.probability:.2f}]"]
    values = [(p.name, p.value, p.stderr, p.unit) for p in finding.parameters]
    if finding.heat_mean_W > 0.0:
        values.append(("mean |heat|", finding.heat_mean_W, finding.heat_stderr_W, "W"))
    if values:
        told = (
            f"{name} = {with_error(value, stderr).replace(MINUS, '-')}" + (f" {unit}" if unit != "1" else "")
            for name, value, stderr, unit in values
        )
        lines.append(f"    {', '.join(told)}")
    rivals = [r for r in finding.confusable_with if r.probability >= LEAST_RIVAL]
    ahead = [r for r in rivals if finding.probability < LEAST_SHARE * r.probability]
    for words, some in (("not ruled out", [r for r in rivals if r not in ahead]), (AHEAD, ahead)):
        if some:
            named = ", ".join(f"{r.mechanism} at {r.place} ({r.probability:.2f})" for r in some)
            lines.append(f"    {words}: {named}; {some[0].separate_by}")
    return lines


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "mechanism": finding.mechanism,
        "family": finding.family,
        "place": finding.place,
        "node": finding.node,
        "kind": finding.kind,
        "says": finding.says,
        "equation": finding.equation,
        "reference": finding.reference,
        "probability": finding.probability,
        "log_bayes": finding.log_bayes,
        "heat_W": {"mean": finding.heat_mean_W, "stderr": finding.heat_stderr_W, "max": finding.heat_max_W},
        "parameters": [
            {"name": p.name, "value": p.value, "stderr": p.stderr, "unit": p.unit} for p in finding.parameters
        ],
        "confusable_with": [
            {"mechanism": r.mechanism, "place": r.place, "probability": r.probability, "separate_by": r.separate_by}
            for r in finding.confusable_with
        ],
    }


def _fits(fits: Fits) -> dict[str, Any]:
    def number(value: float) -> float | None:
        return value if value == value else None

    return {
        "rmse_before_K": number(fits.before),
        "rmse_calibrated_K": number(fits.calibrated),
        "rmse_after_K": number(fits.after),
        "sensors": {
            name: {"before": number(b), "calibrated": number(c), "after": number(a)}
            for name, (b, c, a) in fits.sensors.items()
        },
    }
