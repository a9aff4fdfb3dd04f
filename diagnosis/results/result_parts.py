"""The parts of a result: findings, places, errors of the predictions, and effects that could not be seen."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

from diagnosis.decision.answer import Grade
from models.base.types import Array
from models.correction.correction import MeanLoss
from models.correction.instruments import InputCorrection, SensorCorrection
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

PARAMETER = "parameter"
NO_CLAIM = ("consistent", "insufficient_data")  # verdicts
LEAST_RIVAL = 0.01  # probability of what is told as a rival
MOST_NEAREST = 3  # names that are told of those that were not reported
NEAREST = 0.1  # their probability at least
MOST_HINTS, HINT_NAT = 2, 10.0  # names that are told where nothing was detected; evidence of each at least
# Models that are compared by their predictions, as people call them.
MODELS: Mapping[str, str] = {"before": "as delivered", "calibrated": "calibrated", "after": "corrected"}


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
    instead : bool
        True if it explains the data in place of the effect; False if it does so only together with it
    """

    mechanism: str
    place: str
    probability: float
    separate_by: str
    instead: bool = True

    @property
    def law(self) -> str:
        """Name of the law; of a parameter its own."""
        return called(self.mechanism, self.place)


@dataclass(frozen=True, kw_only=True)
class Change:
    """When an effect begins, and ends if it does.

    Attributes
    ----------
    recording : str
        In which it begins
    from_s : float
        Since the first row of that recording, [s]
    to_s : float or None
        End, since the first row of the same recording, [s]; None: it stays
    utc : str or None
        Begin by the clock, ISO 8601; None for a recording without dates
    band_s : (float, float) or None
        95 % band of `from_s`, [s]; None if unknown
    """

    recording: str
    from_s: float
    to_s: float | None = None
    utc: str | None = None
    band_s: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Switching:
    """Temperatures at which a two-point control switches.

    Attributes
    ----------
    on_degC, off_degC : float
    of : tuple of str
        Nodes whose temperature it follows, of several the mean
    """

    on_degC: float
    off_degC: float
    of: tuple[str, ...]

    @property
    def followed(self) -> str:
        """Its nodes, in words."""
        return f"{'mean of ' if len(self.of) > 1 else ''}{', '.join(self.of)}"


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
    grade : str
        ``claim``: the name is certain enough; ``likely``: one of a few names, or the nearest one
    tie_set : tuple of str
        Names that these data do not separate, the most probable first; empty of a claim
    joint_probability : float
        Of all names that it may be: of the tie set, of those that act alike; else `probability`
    acts_like : bool
        True if the cause was not found: `mechanism` is the nearest name
    date : Change or None
        When it begins, if not with the first recording
    switching : Switching or None
        Of a two-point control
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
    grade: Grade = "claim"
    tie_set: tuple[str, ...] = ()
    joint_probability: float = math.nan
    acts_like: bool = False
    date: Change | None = None
    switching: Switching | None = None

    @property
    def law(self) -> str:
        """Name of the law; of a parameter its own."""
        return called(self.mechanism, self.place)

    @property
    def title(self) -> str:
        """Names and places as its grade allows them."""
        if self.acts_like:
            return f"acts like {named(self.mechanism, self.place)}"
        if self.mechanism == PARAMETER:
            return " or ".join(self.tie_set or (self.law,))
        places = {r.mechanism: r.place for r in reversed(self.confusable_with)} | {self.mechanism: self.place}
        tied = self.tie_set or (self.mechanism,)
        at: dict[str, list[str]] = {}
        for name in tied:
            at.setdefault(places.get(name, self.place), []).append(name)
        between = " or " if len(at) == len(tied) else ", or "
        return between.join(named(" or ".join(names), place) for place, names in at.items())

    @property
    def item(self) -> tuple[str, ...]:
        """Key of the item that a report shows it in.

        Several laws of one name at one place, with other courses in time, are one item; so are the nearest names of one
        kind at one place, whose cause was not found.
        """
        alone = not self.acts_like or self.mechanism == PARAMETER
        return (self.title,) if alone else (self.place, self.kind)

    @property
    def sureness(self) -> float:
        """Probability that the title is right."""
        return self.probability if math.isnan(self.joint_probability) else self.joint_probability

    def to_dict(self) -> dict[str, Any]:
        """The finding as it is in ``diagnosis.json``."""
        date, alike = self.date, ("mechanism", "family", "place", "node", "kind", "grade", "acts_like")
        return {
            **{key: getattr(self, key) for key in alike},
            "tie_set": list(self.tie_set),
            "joint_probability": self.sureness,
            "says": self.says,
            "equation": self.equation,
            "reference": self.reference,
            "probability": self.probability,
            "log_bayes": self.log_bayes,
            "heat_W": {"mean": self.heat_mean_W, "stderr": self.heat_stderr_W, "max": self.heat_max_W},
            "date": date and asdict(date) | {"band_s": date.band_s and list(date.band_s)},
            "switching": self.switching and asdict(self.switching),
            "parameters": [asdict(one) for one in self.parameters],
            "confusable_with": [asdict(one) for one in self.confusable_with],
        }


@dataclass(frozen=True, kw_only=True)
class Location:
    """Where heat comes or goes that the calibrated model cannot explain.

    Attributes
    ----------
    nodes : tuple of str
        That share the heat; of one place the first is the one that scorers read
    probability : float
    heat_mean_W, heat_max_W : float
        Of all of them together
    when : tuple of (recording, from_s, to_s)
        Windows in which it acts
    regime : str
        When it acts in words of speed, torque and temperature
    """

    nodes: tuple[str, ...]
    probability: float
    heat_mean_W: float
    heat_max_W: float
    when: tuple[tuple[str, float, float], ...]
    regime: str

    @property
    def node(self) -> str:
        """The first node, which is that of :attr:`nodes` in single places."""
        return self.nodes[0]


class Errors(NamedTuple):
    """Root mean square errors of the models in :data:`MODELS`, [K] or [W]."""

    before: float
    calibrated: float
    after: float


@dataclass(frozen=True, kw_only=True)
class Refuted:
    """Effects that the recordings learnt from support, and the held-out ones contradict so much that none is detected.

    Attributes
    ----------
    names : str
        Of the effects, with their places
    log_e_value : float
        Evidence that something is missing, by the recordings learnt from alone, [nat]
    log_score_gain : float
        Log predictive density of the held-out readings with it, less that of the calibrated model, [nat]
    """

    names: str
    log_e_value: float
    log_score_gain: float


FAR_SD = 3.0  # standard deviations of a prior, beyond which a parameter is far from it
MISSED = 3.0  # times the error of the recordings learnt from, beyond which a held-out one is missed


@dataclass(frozen=True, kw_only=True)
class Fits:
    """Root mean square errors of one set of recordings.

    Attributes
    ----------
    before, calibrated, found, after : float
        Over all temperatures, as delivered, calibrated, with the findings alone, and with what was learnt of model
        error too, [K]; NaN without recordings
    sensors : mapping of channel to Errors
        [K], or [W] for ``P_loss``
    recordings : mapping of recording to Errors
        Over all temperatures of each, [K]
    """

    before: float
    calibrated: float
    found: float
    after: float
    sensors: Mapping[str, Errors]
    recordings: Mapping[str, Errors]

    def contradict(self, gain: float, noise_K: float, needed: float) -> bool:
        """True if these recordings contradict the findings: by the log score, or by an error larger by the noise.

        The gain in log score and the evidence that an effect needs are in nat, the white noise of a temperature row
        in K.
        """
        return gain < -needed or self.after - self.calibrated > noise_K

    def far_beyond(self, train: Fits, matters_K: float) -> tuple[str, ...]:
        """Recordings whose error is several times that of those learnt from and larger by what matters, worst first."""
        far = {
            name: errors.after for name, errors in self.recordings.items()
            if errors.after > MISSED * train.after and errors.after - train.after > matters_K
        }  # fmt: skip
        return tuple(sorted(far, key=lambda name: -far[name]))

    def to_dict(self) -> dict[str, Any]:
        """The errors as they are in ``diagnosis.json``."""
        return {
            "rmse_before_K": or_none(self.before),
            "rmse_calibrated_K": or_none(self.calibrated),
            "rmse_findings_K": or_none(self.found),
            "rmse_after_K": or_none(self.after),
            **{
                what: {name: dict(zip(MODELS, map(or_none, errors), strict=True)) for name, errors in of.items()}
                for what, of in (("sensors", self.sensors), ("recordings", self.recordings))
            },
        }


def spoiled_in(
    train: Fits, holdout: Fits, *, baselines: Collection[str], least_K: float
) -> dict[str, tuple[float, float]]:
    """Errors as delivered and calibrated, [K], of tested recordings that calibration made worse by more than `least_K`.

    What is both learnt from and held out counts by its held-out part.
    """
    tested = {name: errors for name, errors in train.recordings.items() if name not in baselines}
    return {
        name: (errors.before, errors.calibrated) for name, errors in {**tested, **holdout.recordings}.items()
        if errors.calibrated - errors.before > least_K
    }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Calibrated:
    """A parameter of the machine.

    Attributes
    ----------
    value, stderr : float
        In the model that predicts: they stand in for model error that it does not know
    estimate, estimate_stderr : float
        With model error in place: what the recordings say of it
    shift_in_sd : float
        From the prior to the estimate, in its standard deviations
    """

    parameter: str
    prior: float
    value: float
    stderr: float
    estimate: float
    estimate_stderr: float
    shift_in_sd: float
    unit: str = "1"

    @property
    def is_far(self) -> bool:
        """True if it is further from its prior than is likely."""
        return abs(self.shift_in_sd) > FAR_SD


@dataclass(frozen=True, kw_only=True)
class CalibratedModel:
    """Parameters, sensors and inputs of a fit.

    Attributes
    ----------
    calibration : tuple of Calibrated
    sensors : tuple of SensorCorrection
        How its sensors differ from the machine
    true_inputs : tuple of InputCorrection
        What it took the inputs to be
    mean_loss : MeanLoss or None
        None if a loss is measured, or nothing in the definition fixes its size
    """

    calibration: tuple[Calibrated, ...] = ()
    sensors: tuple[SensorCorrection, ...] = ()
    true_inputs: tuple[InputCorrection, ...] = ()
    mean_loss: MeanLoss | None = None


@dataclass(frozen=True, kw_only=True)
class Ranked:
    """One line of the ranking: every explanation that was scored.

    Attributes
    ----------
    mechanism, place, family : str
        Of a pair both, joined by ``" + "``
    log_bayes, probability : float
    laws : tuple of str
        Names of its effects, whatever their course in time
    date : Change or None
        When its first effect that has a date begins, if it was fitted
    """

    mechanism: str
    place: str
    family: str
    log_bayes: float
    probability: float
    laws: tuple[str, ...]
    date: Change | None = None


def hints_of(ranking: Sequence[Ranked]) -> tuple[Ranked, ...]:
    """Names with evidence worth a hint, those with most of it, each at its best place."""
    best: dict[tuple[str, ...], Ranked] = {}
    for one in sorted(ranking, key=lambda one: -one.log_bayes):
        if len(one.laws) == 1 and one.log_bayes >= HINT_NAT:
            best.setdefault(one.laws, one)
    return tuple(best.values())[:MOST_HINTS]


@dataclass(frozen=True, kw_only=True)
class NotDetectable:
    """An effect that these data could not have shown, and the test that would show it.

    Attributes
    ----------
    mechanism, place : str
        `place`: where it would show best
    needed : str
        Test that would show it
    expected : float
        Expected evidence at the size that matters, [nat]; NaN if unknown
    """

    mechanism: str
    place: str
    needed: str
    expected: float = math.nan


def named(mechanism: str, place: str) -> str:
    """A mechanism and its place.

    Examples
    --------
    >>> named("windage", "oil"), named("parameter", "h_air")
    ('windage at oil', 'parameter h_air')
    """
    return f"{mechanism} {place}" if mechanism == PARAMETER else f"{mechanism} at {place}"


def title_of(item: Sequence[Finding]) -> str:
    """One title of the findings of an item."""
    first, names = item[0], dict.fromkeys(finding.mechanism for finding in item)
    return first.title if len(names) == 1 else f"acts like {named(' with '.join(names), first.place)}"


def called(mechanism: str, place: str) -> str:
    """Name of a law; of a parameter its own.

    Examples
    --------
    >>> called("windage", "oil"), called("parameter", "h_air")
    ('windage', 'parameter h_air')
    """
    return named(mechanism, place) if mechanism == PARAMETER else mechanism


def error_unit(channel: str) -> str:
    """Unit of the error of a channel."""
    return "W" if is_total_loss(channel) else "K"


def or_none(value: float) -> float | None:
    """A number as JSON has it: null for NaN and infinity."""
    return value if math.isfinite(value) else None
