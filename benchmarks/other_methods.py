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
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pysindy import STLSQ
from rich.console import Console
from rich.table import Table
from scipy.signal import lfilter
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from benchmarks.ablation import read_case
from benchmarks.latent_heat import latent_heat
from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.engine.fit import Experiment, Fit, Linearised, calibrate
from diagnosis.engine.predict import Prediction, predict
from diagnosis.engine.prepare import held_out_experiment, prepare_experiment
from diagnosis.engine.scan import scan
from diagnosis.forward.term_on_grid import TermOnGrid
from diagnosis.proof.scoring.lines import Task
from diagnosis.proof.scoring.outcome import outcome
from diagnosis.proof.scoring.truth import CONTROL, read_truths
from diagnosis.results.places import node_in
from diagnosis.setup.inference_setup import InferenceSetup
from models.assembly.gearbox import load_gearbox
from models.base.parallel import run_parallel
from models.base.types import Array
from models.mechanisms import CATALOGUE
from models.quantities.quantities import TOTAL_LOSS, is_total_loss

METHODS: Mapping[str, str] = {"naive": "naive residual regression", "sparse": "sparse regression (pysindy)"}
ERRORS: Mapping[str, str] = {"calibrated_K": "calibration only", "black_box_K": "black-box residual network"}
NOT_THEIRS = ("far parameter named", "heat within 20 %", "held-out error improves")  # rules
THRESHOLD = 5.0  # evidence from which something is named, [nat]
SPARSE_THRESHOLD, SPARSE_RIDGE = 0.1, 0.05  # of pysindy's STLSQ on columns of unit norm: its defaults
HIDDEN, SEED = (32, 32), 0
MEMORIES_S = (600.0, 3600.0)  # over which the black box remembers its inputs
MOST_ROWS = 20_000


def answers_to(setup: InferenceSetup, experiment: Experiment, even: tuple[Experiment, Experiment]) -> dict[str, Any]:
    """Answers of the methods to one case.

    Parameters
    ----------
    setup : InferenceSetup
    experiment : Experiment
    even : (Experiment, Experiment)
        Recordings to learn from and to judge by on intervals of one length, on which the network remembers its inputs

    Returns
    -------
    dict
        For every method of :data:`METHODS` the part of ``diagnosis.json`` that the rules read, and :data:`ERRORS`
    """
    base = calibrate(experiment)
    candidates = [
        hypothesis_of(placed)
        for mechanism in CATALOGUE.values()
        for placed in mechanism.placed(experiment.network, setup.scale, setup.channels)
    ]
    return {
        "naive": _naive(setup, base, candidates),
        "sparse": _sparse(setup, base, candidates),
        **_errors(even, base),
    }


def _naive(setup: InferenceSetup, base: Fit, candidates: Sequence[Hypothesis]) -> dict[str, Any]:
    """Regress the calibrated residual on the response to each candidate, all parameters held; the best wins."""
    parts = [replace(part, columns=part.columns[:, :0]) for part in base.parts]
    held = Fit(experiment=replace(base.experiment, unknowns=()), z=np.zeros(0), linearised=Linearised.of(parts, None))
    scanned = scan(held, candidates)
    logs = scanned.log_bayes
    if float(np.logaddexp.reduce(logs) - np.log(len(logs))) < THRESHOLD:
        return _answer(setup, None)
    return _answer(setup, scanned.candidates[int(np.argmax(logs))])


def _sparse(setup: InferenceSetup, base: Fit, candidates: Sequence[Hypothesis]) -> dict[str, Any]:
    """Heat that is missing at the likeliest node, regressed sparsely on the catalogue's heats there."""
    kinds = (True, False) if TOTAL_LOSS in setup.channels else (False,)
    missing = max(
        (latent_heat(base, part.name, loss_W=setup.loss_W, is_loss=is_loss)
         for part in setup.nominal.parts for is_loss in kinds),
        key=lambda heat: heat.log_bayes,
    )  # fmt: skip
    here = [h for h in candidates if h.in_network and node_in(setup.nominal, h) == missing.node]
    if missing.log_bayes < THRESHOLD or not here:
        return _answer(setup, None)
    # Intervals are of different lengths.
    weights = np.sqrt(np.concatenate([part.point.piece.steps for part in base.parts]))
    columns = weights[:, None] * np.column_stack([_heat(base, h) for h in here])
    target = weights * missing.mean
    norms = np.linalg.norm(columns, axis=0)
    here = [h for h, norm in zip(here, norms, strict=True) if norm > 0.0]
    columns = columns[:, norms > 0.0] / norms[norms > 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns if its threshold leaves no term: then nothing is named
        found = STLSQ(threshold=SPARSE_THRESHOLD * float(np.linalg.norm(target)), alpha=SPARSE_RIDGE).fit(
            columns, target[:, None]
        )
    sizes = np.abs(np.ravel(found.coef_))
    return _answer(setup, here[int(sizes.argmax())] if sizes.any() else None)


def _heat(base: Fit, h: Hypothesis) -> Array:
    """Heat of a candidate with its middle shape along the calibrated run, all parts together, [W] per strength."""
    assert h.term is not None  # noqa: S101 - it is in the network
    term, shape = TermOnGrid(base.experiment.machine.model, h.term), h.variants[[len(h.variants) // 2]]
    heats = [term.heat(part.point.trajectory, shape)[0][:, :, 0].sum(axis=1) for part in base.parts]
    return np.asarray(np.nan_to_num(np.concatenate(heats)))


def _answer(setup: InferenceSetup, h: Hypothesis | None) -> dict[str, Any]:
    if h is None:
        return {"verdict": "consistent", "findings": [], "location": []}
    of_measurement = h.term is not None and h.term.of_measurement
    node = node_in(setup.nominal, h)
    return {
        "verdict": "sensor_fault" if of_measurement else "missing_physics",
        "findings": [
            {"mechanism": h.name, "place": h.place, "node": node, "family": h.family, "probability": 1.0,
             "kind": "parameter" if h.term is None else h.term.kind, "confusable_with": [], "parameters": []}
        ],
        "location": [{"node": node}],
    }  # fmt: skip


# ---------------------------------------------------------------------- black box


def _errors(even: tuple[Experiment, Experiment], base: Fit) -> dict[str, float | None]:
    """Held-out error of the calibrated model, alone and with a network on its residual.

    The network goes from inputs, their fading memories and the calibrated prediction to the residual.
    """

    def table(experiment: Experiment) -> tuple[Array, Array]:
        return _table([predict(experiment, i, base.z) for i in range(len(experiment.pieces))])

    (x, y), (x_held, y_held) = map(table, even)
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


def _table(predictions: Sequence[Prediction]) -> tuple[Array, Array]:
    """Features and residuals of the rows that are measured in every channel."""
    features, residuals = [], []
    for one in predictions:
        temperatures = [i for i, name in enumerate(one.piece.channels) if not is_total_loss(name)]
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
    """Answers of the methods to the recordings ``train_*`` and ``hold_*`` of a folder, which may have a definition."""
    definition, train, held = read_case(folder, gearbox)
    setup, experiment = prepare_experiment(definition, train, held)
    on_even, even = prepare_experiment(definition, train, held, even=True)
    return answers_to(setup, experiment, (even, held_out_experiment(on_even, even)))


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
