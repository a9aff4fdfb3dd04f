"""Free-running predictions of all recordings: as delivered, calibrated, with the findings, and corrected."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.decision.posterior import Judged
from diagnosis.engine.calibration import NearReadings
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.learnt_error import is_writable, with_learnt_error
from diagnosis.engine.predict import Prediction, log_score_gain, overall_rmse, predict, rmse, with_pieces_of
from diagnosis.engine.set_apart import without_channels
from diagnosis.engine.to_predict import instruments_of, loss_by_level
from diagnosis.results.result_parts import MODELS, Errors, Fits
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

Predictions = dict[str, Sequence[Prediction]]  # of all pieces: before, calibrated, found, after


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictingModel:
    """A model, and its free-running predictions of all recordings.

    Attributes
    ----------
    best : Judged or None
        The explanation in it; None: the machine as calibrated
    final : Fit
    learnt : tuple of Term
        What was learnt of model error and is in it
    left_out_K : float
        Error of the held-out temperatures with what was learnt, where it is left out for that; else NaN
    train_runs, holdout_runs : mapping of state to predictions
        ``before``: as delivered; ``calibrated``: without model error; ``found``: with the findings; ``after``:
        corrected, with what was learnt of model error too where that helps
    train, holdout : Fits
        Their errors
    as_stated_K : float
        Error of the held-out temperatures with instruments as stated instead of as estimated; NaN without any
    holdout_gain : float
        Log score of it on the held-out readings, less that of the calibrated machine, [nat]; the better of two, with a
        measured loss as its meter has it, and no finer than what predicts is calibrated to
    """

    best: Judged | None
    final: Fit
    learnt: tuple[Term, ...]
    left_out_K: float
    train_runs: Predictions
    holdout_runs: Predictions
    train: Fits
    holdout: Fits
    as_stated_K: float
    holdout_gain: float


def predict_recordings(
    experiment: Experiment, judged: Experiment, *, plain: Fit, found: Fit, best: Judged | None,
    written_into: Judged | None, near: NearReadings, counting: Collection[str], noise_K: float,
) -> PredictingModel:  # fmt: skip
    """Predict all recordings, with model error written into the best explanation if that helps.

    Parameters
    ----------
    experiment, judged : Experiment
        With the pieces to learn from, and those held out
    plain, found : Fit
        The nominal machine, and that with the findings, both calibrated without model error
    best : Judged or None
        The explanation in `found`
    written_into : Judged or None
        What model error may be written into; None: nothing, since it would stand in for a broken sensor
    near : NearReadings
        Where model error was linearised
    counting : collection of str
        Channels that count
    noise_K : float
        Of a row: held-out temperatures that are missed by so much more contradict what was learnt

    Raises
    ------
    ArithmeticError
        If temperatures leave all bounds with the parameters as delivered, calibrated or found.
    """
    columns, as_stated_K = _temperatures(experiment.pieces[0].channels, counting), float("nan")
    train = _states(experiment, plain, found, near=[trajectory.T for trajectory in found.trajectories])
    holdout = _states(judged, plain, found)
    final, learnt, left_out_K = found, tuple[Term, ...](), float("nan")
    after = [train["found"], holdout["found"]]
    if written_into is not None and written_into.fit is not None:
        try:
            if is_writable(written_into.error_class):
                written, terms = with_learnt_error(written_into.fit, near, written_into.error_class)
                there: list[Sequence[Prediction]] = [
                    _predictions(written, one, _courses(known))
                    for one, known in zip((experiment, judged), after, strict=True)
                ]  # fmt: skip
                # Far from a straight line it may do harm: parameters at limits and large factors go together.
                farther = [overall_rmse(with_it, columns) - overall_rmse(without, columns)
                           for with_it, without in zip(there, after, strict=True)]  # fmt: skip
                if farther[0] < 0.0 and farther[1] > noise_K:
                    left_out_K = overall_rmse(there[1], columns)
                elif farther[0] < 0.0:
                    final, learnt, after = written, terms, there
        except ArithmeticError:
            pass  # no solution with what was learnt
    train["after"], holdout["after"] = after
    channels = experiment.pieces[0].channels
    faulty = set(channels) - set(counting)
    runs = holdout["after"], holdout["calibrated"]
    with suppress(ArithmeticError):
        stated = _predictions(_with_stated_instruments(final, best), judged, _courses(after[1]))
        as_stated_K = overall_rmse(stated, columns)
    sound = without_channels(judged, faulty)
    # A measured loss takes nothing back by less than what predicts can follow it.
    gain = max(log_score_gain(final, plain, one, runs) for one in (sound, loss_by_level(sound)))
    return PredictingModel(
        best=best, final=final, learnt=learnt, left_out_K=left_out_K, train_runs=train, holdout_runs=holdout,
        train=_fits(channels, train, counting), holdout=_fits(channels, holdout, counting),
        as_stated_K=as_stated_K, holdout_gain=gain,
    )  # fmt: skip


def _with_stated_instruments(fit: Fit, best: Judged | None) -> Fit:
    """A fit without what was estimated of instruments and recorded inputs, but for the faults that were found."""
    findings = [effect.term.label for effect in (best.effects if best else ()) if effect.term is not None]
    z = fit.z.copy()
    z[instruments_of(fit.experiment, findings)] = 0.0
    return replace(fit, z=z)


def _temperatures(channels: Sequence[str], counting: Collection[str]) -> list[int]:
    """Indices of the channels that are temperatures and count."""
    return [i for i, name in enumerate(channels) if not is_total_loss(name) and name in counting]


def _states(
    pieces_of: Experiment, plain: Fit, found: Fit, *, near: Sequence[Array] | None = None
) -> Predictions:  # fmt: skip
    """As delivered, calibrated, with the findings; `near`: temperatures by the findings, if they are known."""
    before = _predictions(plain, pieces_of, [None] * len(pieces_of.pieces), as_delivered=True)
    tuned = _predictions(plain, pieces_of, _courses(before))
    last = tuned if found is plain else _predictions(found, pieces_of, near or _courses(tuned))
    return {"before": before, "calibrated": tuned, "found": last}


def _predictions(
    fit: Fit, pieces_of: Experiment, near: Sequence[Array | None], *, as_delivered: bool = False
) -> list[Prediction]:  # fmt: skip
    there = with_pieces_of(fit.experiment, pieces_of)
    z = None if as_delivered else fit.z
    with np.errstate(over="ignore", invalid="ignore"):  # what leaves all bounds is refused there
        return [predict(there, index, z, guess=T) for index, T in enumerate(near)]


def _courses(found: Sequence[Prediction]) -> list[Array]:
    return [one.trajectory.T for one in found]


def _fits(channels: Sequence[str], predictions: Predictions, counting: Collection[str]) -> Fits:
    columns = _temperatures(channels, counting)
    nothing = [np.zeros((0, len(channels)))]
    each = {
        state: rmse(np.concatenate([p.residual for p in found] or nothing),
                    np.concatenate([p.weights for p in found] or [np.zeros(0)]))
        for state, found in predictions.items()
    }  # fmt: skip
    overall = {state: overall_rmse(found, columns) for state, found in predictions.items()}

    def alone(recording: str, state: str) -> float:
        return overall_rmse([p for p in predictions[state] if p.piece.recording == recording], columns)

    recordings = {
        name: Errors(*(alone(name, model) for model in MODELS))
        for name in dict.fromkeys(p.piece.recording for p in predictions["before"])
    }
    sensors = {name: Errors(*(float(each[model][i]) for model in MODELS)) for i, name in enumerate(channels)}
    return Fits(**overall, sensors=sensors, recordings=recordings)
