"""The result of a diagnosis: plain data for ``diagnosis.json``, the report and a notebook."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

from diagnosis.decision.posterior import Assumed
from diagnosis.decision.settings import Settings
from diagnosis.results.first_screen import first_screen_of, verdict_text_of
from diagnosis.results.joint_estimate import JointEstimate
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.result_parts import (
    MODELS,
    MOST_NEAREST,
    NEAREST,
    NO_CLAIM,
    Calibrated,
    CalibratedModel,
    Finding,
    Fits,
    Location,
    NotDetectable,
    Ranked,
    Refuted,
    error_unit,
    hints_of,
    named,
    or_none,
)
from models.base.errors import InputError, did_you_mean
from models.correction.correction import Correction
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Term

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SCHEMA = 1
LIKELY = 0.5  # probability from which a further place is told
MOST_BARS, LEAST_DRAWN = 10, 0.005
Table = Literal["findings", "explanations", "calibration", "errors"]
Verdict = Literal[
    "consistent", "parameter_error", "missing_physics", "sensor_fault", "unexplained", "insufficient_data"
]


def _bound_on_chance(nats: float) -> float:
    return math.exp(-max(nats, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Diagnosis:
    """The result of :func:`diagnosis.diagnose_recordings.diagnose`.

    Attributes
    ----------
    verdict : str
    gearbox : str
    log_e_value, threshold : float
        Log odds of all effects to a machine without one, parameters as they may be, and the level it had to reach,
        [nat]. With the verdict ``parameter_error``: evidence that a parameter is outside its prior
    further_threshold : float
        From which a further effect counts, [nat]
    location : tuple of Location
        Most probable first
    findings : tuple of Finding
    model : CalibratedModel
        The model that predicts, without what is in `terms`
    train, holdout : Fits
    noise_K : float
        White noise of a temperature row
    floor : str
        What structural floor was assumed
    misfit : float
        Mean square of the residual of the model that predicts in the training recordings, in multiples of what noise
        and random heat make of it
    remaining_nat : float
        Evidence of a further effect, [nat]; 0 where no further look was taken
    remaining_note : str
    ranking : tuple of Ranked
    unseen : tuple of NotDetectable
    not_tried : tuple of str
        Mechanisms that have no place in this definition and these recordings
    next_test : str
        What to measure next
    courses : tuple of PredictedRun
    network : ThermalNetwork
        The nominal one
    shapes : tuple of Term
        Tilts of the formulas that were calibrated along, see :mod:`diagnosis.setup.shapes`
    learnt : tuple of Term
        What was learnt of model error and is in the prediction, see :mod:`diagnosis.engine.learnt_error`
    left_out_K : float
        Error of the held-out temperatures with what was learnt, where it is left out for that; else NaN
    as_stated_K : float
        Error of the held-out temperatures with instruments as stated instead of as estimated, but for the faults that
        were found; NaN without any
    inputs : mapping
        Hashes and version
    notes : tuple of str
        What was cleaned in the recordings; what baselines show; what recordings cannot identify
    kinds : mapping of str to float
        Probability of every kind of explanation: nothing, parameter, measurement, mechanism, pair, outside
    settings : Settings
        As asked for
    assumed : Assumed
        Model error, deviation between sessions and draughts that the evidence assumes, and how it changes with them
    holdout_gain : float
        Log predictive density of the held-out readings: final model less the calibrated one, [nat]; NaN without any
    contradicted : bool
        True if held-out recordings contradict the findings, see :meth:`Fits.contradict`: none is a claim
    refuted : Refuted or None
        What would have been detected without the held-out recordings, if there is anything
    spoiled : mapping of recording to (before, calibrated)
        Tested recordings that calibration made worse by more than noise and what matters, [K]
    faulty : tuple of str
        Channels that neither the calibration nor the errors over all temperatures count, because their sensors fail
    terms : tuple of Term
        What the model that predicts has more than the nominal one, with its values as the parameters' start and their
        standard errors as `sd`; of an effect without a name that is certain enough too
    known : Correction
        What was known of the machine before, and is in the nominal network
    alone : CalibratedModel
        The nominal machine calibrated without findings: ``calibrated.toml``
    joint : JointEstimate
        Posterior of all unknowns of the model that predicts: ``posterior.npz``
    starts_at : mapping of str to float
        Start of every recording on the time axis that they share, [s]: the clock of terms with a date
    """

    verdict: Verdict
    gearbox: str
    log_e_value: float
    threshold: float
    further_threshold: float
    location: tuple[Location, ...]
    findings: tuple[Finding, ...]
    model: CalibratedModel
    train: Fits
    holdout: Fits
    noise_K: float
    floor: str
    misfit: float
    remaining_nat: float
    remaining_note: str
    ranking: tuple[Ranked, ...]
    unseen: tuple[NotDetectable, ...]
    next_test: str
    courses: tuple[PredictedRun, ...]
    network: ThermalNetwork
    shapes: tuple[Term, ...]
    inputs: Mapping[str, Any]
    not_tried: tuple[str, ...] = ()
    learnt: tuple[Term, ...] = ()
    left_out_K: float = math.nan
    as_stated_K: float = math.nan
    notes: tuple[str, ...] = ()
    kinds: Mapping[str, float] = field(default_factory=dict)
    settings: Settings = field(default_factory=Settings)
    assumed: Assumed = field(default_factory=Assumed)
    holdout_gain: float = math.nan
    contradicted: bool = False
    refuted: Refuted | None = None
    spoiled: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    faulty: tuple[str, ...] = ()
    terms: tuple[Term, ...] = ()
    known: Correction = field(default_factory=Correction)
    alone: CalibratedModel = field(default_factory=CalibratedModel)
    joint: JointEstimate = field(default_factory=JointEstimate)
    starts_at: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Everything of ``diagnosis.json``, schema :data:`SCHEMA`."""
        assumed = self.assumed
        return {
            "schema": SCHEMA,
            "gearbox": self.gearbox,
            "verdict": self.verdict,
            "significance": {
                "p_value": self.p_value,
                "log_e_value": self.log_e_value,
                "threshold": self.threshold,
                "false_alarm_rate": self.settings.false_alarm_rate,
                "test": "log_e_value: log odds of all effects to a machine without one, whose parameters may be "
                        "outside their priors (verdict parameter_error: of such parameters to none); something is "
                        "missing if it exceeds threshold. p_value = exp(-log_e_value), at most 1: a bound on chance "
                        "for an exact model only, no false-alarm rate",
                "draughts_ahead": assumed.draughts_ahead,
                "refuted": None if self.refuted is None else asdict(self.refuted),
            },
            "location": [
                {
                    "node": place.node,
                    "nodes": list(place.nodes),
                    "probability": place.probability,
                    "heat_W": {"mean": place.heat_mean_W, "max": place.heat_max_W},
                    "when": [{"recording": r, "from_s": a, "to_s": b} for r, a, b in place.when],
                    "regime": place.regime,
                }
                for place in self.location
            ],
            "findings": [finding.to_dict() for finding in self.findings],
            "calibration": [asdict(one) for one in self.calibration],
            "mean_loss": None if self.model.mean_loss is None else self.model.mean_loss.model_dump(),
            "fit": {"train": self.train.to_dict(),
                    "holdout": self.holdout.to_dict() | {"log_score_gain": or_none(self.holdout_gain),
                                                           "rmse_instruments_as_stated_K": or_none(self.as_stated_K),
                                                           "contradicts_findings": self.contradicted,
                                                           "missed": list(self.missed)},
                    "faulty_channels": list(self.faulty), "noise_K": self.noise_K, "floor": self.floor},
            "kinds": dict(self.kinds),
            "settings": asdict(self.settings),
            "model_error": {"class": assumed.error_class, "evidence": dict(assumed.error_evidence),
                            "scaled": [asdict(one) for one in assumed.scaled_error],
                            "learnt": [
                                {"what": term.strength.description, "kind": term.kind, "target": list(term.target),
                                 "size": term.strength.start, "stderr": term.strength.sd} for term in self.learnt
                            ],
                            "left_out_rmse_K": or_none(self.left_out_K)},
            "sessions": {"deviation_in_sd": assumed.session_s, "repeating": [asdict(one) for one in assumed.repeating],
                         "placebo": None if assumed.placebo is None else asdict(assumed.placebo)},
            "remaining": {
                "p_value": _bound_on_chance(self.remaining_nat),
                "note": self.remaining_note,
                "misfit": or_none(self.misfit),
            },
            "ranking": [
                {"mechanism": r.mechanism, "place": r.place, "family": r.family, "log_bayes": r.log_bayes,
                 "probability": r.probability, "date": None if r.date is None else asdict(r.date)}
                for r in self.ranking
            ],
            "not_tried": list(self.not_tried),
            "not_visible": [asdict(one) | {"expected": or_none(one.expected)} for one in self.unseen],
            "next_test": self.next_test,
            "notes": list(self.notes),
            "inputs": dict(self.inputs),
        }  # fmt: skip

    @property
    def has_correction(self) -> bool:
        """True if the corrected model has more than calibrated parameters."""
        return bool(self.findings or self.terms or self.learnt)

    @property
    def calibration(self) -> tuple[Calibrated, ...]:
        """Parameters of the model that predicts."""
        return self.model.calibration

    @property
    def calibrated_alone(self) -> Diagnosis:
        """A diagnosis in which the model that predicts is the nominal one, calibrated without findings."""
        return replace(self, findings=(), terms=(), learnt=(), model=self.alone)

    @property
    def verdict_text(self) -> str:
        """The verdict in a sentence."""
        return verdict_text_of(self)

    @property
    def missed(self) -> tuple[str, ...]:
        """Held-out recordings that the model misses far beyond what it was learnt from, worst first."""
        return self.holdout.far_beyond(self.train, self.settings.matters_K)

    @property
    def places(self) -> tuple[Location, ...]:
        """The most probable place, and every other one that is likely: several effects have several."""
        return (*self.location[:1], *(place for place in self.location[1:] if place.probability >= LIKELY))

    @property
    def items(self) -> tuple[tuple[Finding, ...], ...]:
        """Findings by item, see :attr:`Finding.item`."""
        items = dict.fromkeys(finding.item for finding in self.findings)
        return tuple(tuple(finding for finding in self.findings if finding.item == one) for one in items)

    @property
    def p_value(self) -> float:
        """exp(-evidence), at most 1: a bound on the chance of it in a healthy machine if the model were exact.

        It never is; the threshold decides.
        """
        return _bound_on_chance(self.log_e_value)

    @property
    def further_helps(self) -> bool:
        """True if the recordings give evidence of a further effect; without, its probability is only a prior one."""
        return self.remaining_nat > self.further_threshold

    @property
    def descriptions(self) -> dict[str, str]:
        """Descriptions of the parameters of the machine, of the tilts of its laws and of the findings, by name."""
        terms = (*self.shapes, *(finding.term for finding in self.findings if finding.term is not None))
        known = (*self.network.parameters, *(p for term in terms for p in term.parameters))
        return {p.name: p.description for p in known}

    @property
    def hints(self) -> tuple[Ranked, ...]:
        """Names with the most evidence, at their best places, where nothing was detected and none has enough."""
        if self.findings or self.verdict not in NO_CLAIM or not self.location:
            return ()
        return hints_of(self.ranking)

    @property
    def nearest(self) -> tuple[Ranked, ...]:
        """Most probable names, at their best places, if something is missing and none could be reported."""
        if self.findings or self.verdict in NO_CLAIM:
            return ()
        of_names: dict[tuple[str, ...], list[Ranked]] = {}
        for one in self.ranking:
            of_names.setdefault(one.laws, []).append(one)
        found = [replace(first, probability=min(first.probability + sum(one.probability for one in others), 1.0))
                 for first, *others in of_names.values()]  # fmt: skip
        found.sort(key=lambda one: -one.probability)
        least = 0.0 if self.verdict == "parameter_error" else NEAREST  # one of them it is
        return tuple(one for one in found[:MOST_NEAREST] if one.probability >= least)

    @property
    def first_screen(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """First questions of a reader with their answers; questions without an answer are left out.

        Is something missing, where, what, how sure, how much better, what next, and which effects cannot be seen.
        """
        return first_screen_of(self)

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
        import pandas as pd

        if what not in get_args(Table):
            raise InputError(f"{what!r} is not a table of a diagnosis{did_you_mean(what, get_args(Table))}")
        if what == "findings":
            rows = [(f.mechanism, f.place, f.grade, f.sureness, f.heat_mean_W, p.name, p.value, p.stderr, p.unit)
                    for f in self.findings for p in f.parameters]  # fmt: skip
            return pd.DataFrame(rows, columns=["mechanism", "place", "grade", "probability", "heat_mean_W",
                                               "parameter", "value", "stderr", "unit"])  # fmt: skip
        if what == "explanations":
            ranks = [(r.mechanism, r.place, r.family, r.log_bayes, r.probability) for r in self.ranking]
            return pd.DataFrame(ranks, columns=["mechanism", "place", "family", "log_bayes_nat", "probability"])
        if what == "calibration":
            calibrated = [asdict(one) for one in self.calibration]
            return pd.DataFrame(calibrated, columns=[one.name for one in fields(Calibrated)])
        errors = [(recordings, channel, error_unit(channel), *of)
                  for recordings, fits in (("train", self.train), ("holdout", self.holdout))
                  for channel, of in fits.sensors.items()]  # fmt: skip
        return pd.DataFrame(errors, columns=["recordings", "channel", "unit", *(f"rmse_{model}" for model in MODELS)])

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
        from models.columns.curves import PALETTE, axes_or_new  # imports matplotlib

        likely = [r for r in self.ranking if r.probability >= LEAST_DRAWN]
        shown = likely[:MOST_BARS][::-1]
        with axes_or_new(ax) as axes:
            names = [named(r.mechanism, r.place).replace("__", " ").replace("_", " ") for r in shown]
            axes.barh(names, [r.probability for r in shown], color=PALETTE[0])
            axes.set(xlabel="Probability", xlim=(0.0, 1.0))
        return axes

    def _repr_html_(self) -> str:
        head, *rest = self.summary()
        items = "".join(f"<li>{html.escape(line.strip())}</li>" for line in rest)
        return f"<div><b>{html.escape(head)}</b><ul>{items}</ul></div>"
