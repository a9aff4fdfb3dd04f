"""Other methods on concealed cases: calibration only, naive regression, sparse regression, a black-box network.

All start from the same calibrated model as the diagnosis. They read recordings and the nominal definition; the truth
only scores them, by the rules of a proof. pysindy is in the extra ``dev``. Cases of ``conceal --cases`` or ``prove``:

    python -m benchmarks.other_methods out/proof/recordings out/proof/truth [--gearbox NAME] [--jobs N] [--output FILE]
"""

from __future__ import annotations

import argparse
import json
import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from diagnosis.candidates.explain import Explanation
from diagnosis.decision.search import threshold_at
from diagnosis.inference.evidence import Marginal
from diagnosis.inference.latent import knots_of, latent_heat
from diagnosis.inference.posterior import Fit, Problem
from diagnosis.inference.predict import Prediction, predict
from pysindy import STLSQ
from rich.console import Console
from rich.table import Table
from scipy.signal import lfilter
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of, scan
from diagnosis.forward.term_on_grid import TermOnGrid
from diagnosis.proof.scoring.lines import Task
from diagnosis.proof.scoring.outcome import outcome
from diagnosis.proof.scoring.truth import CONTROL, read_truths
from diagnosis.recordings.read import read_recordings
from diagnosis.results.places import node_in
from diagnosis.setup.inference_setup import InferenceSetup, first, prepare
from models.assembly.gearbox import load_gearbox
from models.base.parallel import run_parallel
from models.base.types import Array
from models.mechanisms import CATALOGUE
from models.quantities.quantities import TOTAL_LOSS, is_total_loss

METHODS: Mapping[str, str] = {"naive": "naive residual regression", "sparse": "sparse regression (pysindy)"}
ERRORS: Mapping[str, str] = {"calibrated_K": "calibration only", "black_box_K": "black-box residual network"}
NOT_THEIRS = ("far parameter named", "heat within 20 %", "held-out error improves")  # rules
SPARSE_THRESHOLD, SPARSE_RIDGE = 0.1, 0.05  # of pysindy's STLSQ on columns of unit norm: its defaults
HIDDEN, SEED = (32, 32), 0
MEMORIES_S = (600.0, 3600.0)  # over which the black box remembers its inputs
MOST_ROWS = 20_000


class _ParametersHeld:
    """In place of :class:`diagnosis.inference.evidence.Marginal`: the residual after calibration, all parameters
    held."""

    def __init__(self, fit: Fit) -> None:
        self.columns, self.rest = fit.white_columns, fit.white_residual

    def products(self, columns: Array) -> tuple[Array, Array]:
        return np.asarray(columns.T @ self.rest), np.einsum("mn,mn->n", columns, columns)


def answers_to(case: InferenceSetup, even: InferenceSetup) -> dict[str, Any]:
    """Answers of the methods to one case.

    Parameters
    ----------
    case : InferenceSetup
    even : InferenceSetup
        The case on intervals of one length, on which the network remembers its inputs

    Returns
    -------
    dict
        For every method of :data:`METHODS` the part of ``diagnosis.json`` that the rules read, and :data:`ERRORS`
    """
    base = first(case)
    candidates = [
        hypothesis_of(placed)
        for mechanism in CATALOGUE.values()
        for placed in mechanism.placed(base.problem.model.network, case.scale, case.channels)
    ]
    return {
        "naive": _naive(case, base, candidates),
        "sparse": _sparse(case, base, candidates),
        **_errors(even, base),
    }


def _naive(case: InferenceSetup, base: Explanation, candidates: Sequence[Hypothesis]) -> dict[str, Any]:
    """Regress the calibrated residual on the response to each candidate; the best wins, at the tool's own threshold."""
    scored = scan(base.problem, base.fit, _ParametersHeld(base.fit), candidates)  # type: ignore[arg-type]
    logs = np.array([s.log_bayes for s in scored])
    if float(np.logaddexp.reduce(logs) - np.log(len(logs))) < threshold_at(0.05):
        return _answer(case, None)
    return _answer(case, scored[0].hypothesis)


def _sparse(case: InferenceSetup, base: Explanation, candidates: Sequence[Hypothesis]) -> dict[str, Any]:
    """Heat that is missing at the likeliest node, regressed sparsely on the catalogue's heats there."""
    marginal, pieces = Marginal.of(base.fit), base.problem.pieces
    knots = knots_of(pieces)
    kinds = (True, False) if TOTAL_LOSS in case.channels else (False,)
    missing = max(
        (latent_heat(base.problem.model, base.fit, marginal, part.name, loss_W=case.loss_W, is_loss=is_loss,
                     knots=knots) for part in case.nominal.parts for is_loss in kinds),
        key=lambda heat: heat.log_bayes,
    )  # fmt: skip
    here = [h for h in candidates if h.in_network and node_in(case.nominal, h) == missing.node]
    if missing.log_bayes < threshold_at(0.05) or not here:
        return _answer(case, None)
    weights = np.sqrt(np.concatenate([piece.steps for piece in pieces]))  # intervals are of different lengths
    columns = weights[:, None] * np.column_stack([_heat(base, h) for h in here])
    target = weights * np.concatenate(missing.mean)
    norms = np.linalg.norm(columns, axis=0)
    here = [h for h, norm in zip(here, norms, strict=True) if norm > 0.0]
    columns = columns[:, norms > 0.0] / norms[norms > 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns if its threshold leaves no term: then nothing is named
        found = STLSQ(threshold=SPARSE_THRESHOLD * float(np.linalg.norm(target)), alpha=SPARSE_RIDGE).fit(
            columns, target[:, None]
        )
    sizes = np.abs(np.ravel(found.coef_))
    return _answer(case, here[int(sizes.argmax())] if sizes.any() else None)


def _heat(base: Explanation, h: Hypothesis) -> Array:
    """Heat of a candidate with its middle shape along the calibrated run, all parts together, [W] per strength."""
    assert h.term is not None  # noqa: S101 - it is in the network
    term, shape = TermOnGrid(base.problem.model, h.term), h.variants[[len(h.variants) // 2]]
    heats = [term.heat(part.trajectory, shape)[0][:, :, 0].sum(axis=1) for part in base.fit.parts]
    return np.asarray(np.nan_to_num(np.concatenate(heats)))


def _answer(case: InferenceSetup, h: Hypothesis | None) -> dict[str, Any]:
    if h is None:
        return {"verdict": "consistent", "findings": [], "location": []}
    of_measurement = h.term is not None and h.term.of_measurement
    node = node_in(case.nominal, h)
    return {
        "verdict": "sensor_fault" if of_measurement else "missing_physics",
        "findings": [
            {"mechanism": h.name, "place": h.place, "node": node, "family": h.family, "probability": 1.0,
             "kind": "parameter" if h.term is None else h.term.kind, "confusable_with": [], "parameters": []}
        ],
        "location": [{"node": node}],
    }  # fmt: skip


# ---------------------------------------------------------------------- black box


def _errors(even: InferenceSetup, base: Explanation) -> dict[str, float | None]:
    """Held-out error of the calibrated model, alone and with a network on its residual.

    The network goes from inputs, their fading memories and the calibrated prediction to the residual.
    """
    temperatures = [i for i, name in enumerate(even.channels) if not is_total_loss(name)]

    def table(problem: Problem) -> tuple[Array, Array]:
        return _table([predict(problem, i, base.fit.z) for i in range(len(problem.pieces))], temperatures)

    x, y = table(even.train)
    x_held, y_held = table(even.holdout)
    if not len(x) or not len(x_held):
        return dict.fromkeys(ERRORS)
    step = max(1, len(x) // MOST_ROWS)
    scale = StandardScaler().fit(y)
    network = make_pipeline(
        StandardScaler(), MLPRegressor(hidden_layer_sizes=HIDDEN, early_stopping=True, random_state=SEED)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(x[::step], np.squeeze(scale.transform(y[::step])))
    rest = y_held - scale.inverse_transform(np.reshape(network.predict(x_held), y_held.shape))
    return {"calibrated_K": _rms(y_held), "black_box_K": _rms(rest)}


def _rms(values: Array) -> float | None:
    rms = float(np.sqrt(np.mean(values**2)))
    return rms if math.isfinite(rms) else None


def _table(predictions: Sequence[Prediction], temperatures: Sequence[int]) -> tuple[Array, Array]:
    """Features and residuals of the rows that are measured in every channel."""
    features, residuals = [], []
    for one in predictions:
        inputs = one.piece.inputs[np.clip(np.arange(len(one.piece.time)), 0, len(one.piece.inputs) - 1)]
        step = float(np.median(np.diff(one.piece.time)))
        keep = [math.exp(-step / memory) for memory in MEMORIES_S]
        faded = [lfilter([1.0 - k], [1.0, -k], inputs - inputs[0], axis=0) + inputs[0] for k in keep]
        table = np.concatenate([inputs, *faded, one.read[:, temperatures]], axis=1)
        residual = one.residual[:, temperatures]
        good = np.isfinite(residual).all(axis=1) & np.isfinite(table).all(axis=1)
        features.append(table[good])
        residuals.append(residual[good])
    return (np.concatenate(features), np.concatenate(residuals)) if features else (np.empty((0, 1)), np.empty((0, 1)))


# ---------------------------------------------------------------------- a folder of cases


def answers_to_files(folder: Path, gearbox: str) -> dict[str, Any]:
    """Answers of the methods to the recordings ``train*`` and ``hold*`` of a folder."""
    definition = load_gearbox(gearbox)
    train, held = (
        read_recordings(sorted(folder.glob(f"{kind}*.csv*")), definition.network()) for kind in ("train", "hold")
    )
    return answers_to(prepare(definition, train, held), prepare(definition, train, held, even=True))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the rules with the counts of every method, and the median held-out errors."""
    parser = argparse.ArgumentParser(prog="benchmarks.other_methods")
    parser.add_argument("recordings", type=Path, help="folder with one folder of recordings per case")
    parser.add_argument("truth", type=Path, help="folder with one JSON file per case")
    parser.add_argument("--gearbox", default="fzg")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path, help="JSON file for the answers")
    given = parser.parse_args(arguments)
    folders = sorted(path for path in given.recordings.iterdir() if path.is_dir())
    found = run_parallel(answers_to_files, [(folder, given.gearbox) for folder in folders], jobs=given.jobs)
    answers = {folder.name: answer for folder, answer in zip(folders, found, strict=True)}
    if given.output:
        given.output.write_text(json.dumps(answers, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    truths, gearbox = read_truths(given.truth), load_gearbox(given.gearbox)
    scores = [
        outcome(
            truths, {Task(case=c): {"status": "answered", "answer": a[method]} for c, a in answers.items()}, gearbox
        )
        for method in METHODS
    ]
    to_find = [answers[case] for case, truth in truths.items() if truth.group != CONTROL and case in answers]
    show(scores, to_find)


def show(scores: Sequence[Mapping[str, Any]], to_find: Sequence[Mapping[str, Any]]) -> None:
    """Print the two tables.

    Parameters
    ----------
    scores : sequence of mapping
        See :func:`diagnosis.proof.scoring.outcome.outcome`, of every method
    to_find : sequence of mapping
        Answers to the cases in which something is concealed
    """
    rules = Table("rule", *METHODS.values(), title="Other methods, by the rules of a proof")
    for of_methods in zip(*(score["rules"] for score in scores), strict=True):
        if of_methods[0]["name"] not in NOT_THEIRS:
            counts = [next(iter(rule["counts"].values())) for rule in of_methods]  # all cases, or the only kind
            rules.add_row(of_methods[0]["name"], *(f"{count['hits']}/{count['of']}" for count in counts))
    errors = Table("held-out error, median", "K", "cases", title="Cases with an effect")
    for key, text in ERRORS.items():
        values = [answer[key] for answer in to_find if answer[key] is not None]
        errors.add_row(text, f"{np.median(values):.2f}" if values else "-", str(len(values)))
    for table in (rules, errors):
        Console().print(table)


if __name__ == "__main__":
    main()
