"""What others do, on the same recordings: the naive regression, sparse regression, and a black box.

All start from the same calibrated model as the diagnosis. They see recordings and the nominal definition, never the
truth. As a program: ``python -m diagnosis.proof.baselines RECORDING... --holdout RECORDING... --output FILE``.
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
from scipy.signal import lfilter
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from diagnosis.case import Case, first, prepare
from diagnosis.evidence import Marginal
from diagnosis.explain import Explanation
from diagnosis.findings import node_of
from diagnosis.hypotheses import Hypothesis, hypothesis_of, scan
from diagnosis.latent import knots_of, latent_heat
from diagnosis.posterior import Fit, Problem
from diagnosis.predict import Prediction, predict
from diagnosis.quantities import LOSS
from diagnosis.read_recordings import read_recordings
from diagnosis.search import threshold_at
from diagnosis.term_on_grid import TermOnGrid
from models.gearbox import load_gearbox
from models.mechanisms import CATALOGUE
from models.types import Array

METHODS: Mapping[str, str] = {
    "calibration": "calibration only",
    "naive": "naive residual regression",
    "sparse": "sparse regression (pysindy)",
    "black_box": "black-box residual network",
}
NAMING = ("naive", "sparse")  # methods that name something
SPARSE_THRESHOLD, SPARSE_RIDGE = 0.1, 0.05  # of pysindy's STLSQ on columns of unit norm: its defaults
HIDDEN, SEED = (32, 32), 0
MEMORIES_S = (600.0, 3600.0)  # over which the black box remembers its inputs
MOST_ROWS = 20_000


class _ParametersHeld:
    """Stands in for :class:`diagnosis.evidence.Marginal`: the residual after calibration, no parameter may move."""

    def __init__(self, fit: Fit) -> None:
        self.columns, self.rest = fit.white_columns, fit.white_residual

    def products(self, columns: Array) -> tuple[Array, Array]:
        return np.asarray(columns.T @ self.rest), np.einsum("mn,mn->n", columns, columns)


def baselines(case: Case, even: Case) -> dict[str, Any]:
    """What the methods say of one case.

    Parameters
    ----------
    case : Case
    even : Case
        The same on intervals of one length, on which the network remembers its inputs

    Returns
    -------
    dict
        Of every method of :data:`METHODS` but the calibration something like ``diagnosis.json``; None of ``sparse``
        where pysindy is not installed
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
        "black_box": _black_box(even, base),
    }


def _naive(case: Case, base: Explanation, candidates: Sequence[Hypothesis]) -> dict[str, Any]:
    """Regress the calibrated residual on the response to each candidate; the best wins, at the tool's own threshold."""
    scored = scan(base.problem, base.fit, _ParametersHeld(base.fit), candidates)  # type: ignore[arg-type]
    logs = np.array([s.log_bayes for s in scored])
    if float(np.logaddexp.reduce(logs) - np.log(len(logs))) < threshold_at(0.05):
        return _said(case, None)
    return _said(case, scored[0].hypothesis)


def _sparse(case: Case, base: Explanation, candidates: Sequence[Hypothesis]) -> dict[str, Any] | None:
    """Heat that is missing at the likeliest node, regressed sparsely on the catalogue's heats there."""
    try:
        from pysindy import STLSQ
    except ImportError:
        return None
    marginal, pieces = Marginal.of(base.fit), base.problem.pieces
    knots = knots_of(pieces)
    kinds = (True, False) if LOSS in case.channels else (False,)
    missing = max(
        (latent_heat(base.problem.model, base.fit, marginal, part.name, loss_W=case.loss_W, is_loss=is_loss,
                     knots=knots) for part in case.nominal.parts for is_loss in kinds),
        key=lambda heat: heat.log_bayes,
    )  # fmt: skip
    here = [h for h in candidates if h.in_network and node_of(case, h) == missing.node]
    if missing.log_bayes < threshold_at(0.05) or not here:
        return _said(case, None)
    weights = np.sqrt(np.concatenate([piece.steps for piece in pieces]))  # intervals are of different lengths
    columns = weights[:, None] * np.column_stack([_heat(base, h) for h in here])
    target = weights * np.concatenate(missing.mean)
    norms = np.linalg.norm(columns, axis=0)
    here = [h for h, norm in zip(here, norms, strict=True) if norm > 0.0]
    columns = columns[:, norms > 0.0] / norms[norms > 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns where its threshold leaves nothing: then nothing is named
        found = STLSQ(threshold=SPARSE_THRESHOLD * float(np.linalg.norm(target)), alpha=SPARSE_RIDGE).fit(
            columns, target[:, None]
        )
    sizes = np.abs(np.ravel(found.coef_))
    return _said(case, here[int(sizes.argmax())] if sizes.any() else None)


def _heat(base: Explanation, h: Hypothesis) -> Array:
    """Heat of a candidate with its middle shape along the calibrated run, all parts together, [W] per strength."""
    assert h.term is not None  # noqa: S101 - it is in the network
    term, shape = TermOnGrid(base.problem.model, h.term), h.variants[[len(h.variants) // 2]]
    heats = [term.heat(part.trajectory, shape)[0][:, :, 0].sum(axis=1) for part in base.fit.parts]
    return np.asarray(np.nan_to_num(np.concatenate(heats)))


def _said(case: Case, h: Hypothesis | None) -> dict[str, Any]:
    if h is None:
        return {"verdict": "consistent", "findings": [], "location": []}
    of_measurement = h.term is not None and h.term.of_measurement
    node = node_of(case, h)
    return {
        "verdict": "sensor_fault" if of_measurement else "missing_physics",
        "findings": [
            {"mechanism": h.name, "place": h.place, "node": node, "family": h.family, "probability": 1.0,
             "confusable_with": [], "parameters": []}
        ],
        "location": [{"node": node}],
    }  # fmt: skip


# ---------------------------------------------------------------------- black box


def _black_box(even: Case, base: Explanation) -> dict[str, Any]:
    """A network from inputs, their fading memories and the calibrated prediction to what that prediction lacks."""
    temperatures = [i for i, name in enumerate(even.channels) if name != LOSS]

    def table(problem: Problem) -> tuple[Array, Array]:
        return _table([predict(problem, i, base.fit.z) for i in range(len(problem.pieces))], temperatures)

    x, y = table(even.train)
    x_held, y_held = table(even.holdout)
    if not len(x) or not len(x_held):
        return {"rmse_K": None}
    step = max(1, len(x) // MOST_ROWS)
    scale = StandardScaler().fit(y)
    network = make_pipeline(
        StandardScaler(), MLPRegressor(hidden_layer_sizes=HIDDEN, early_stopping=True, random_state=SEED)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(x[::step], np.squeeze(scale.transform(y[::step])))
    rest = y_held - scale.inverse_transform(np.reshape(network.predict(x_held), y_held.shape))
    rmse = float(np.sqrt(np.mean(rest**2)))
    return {"rmse_K": rmse if math.isfinite(rmse) else None}


def _table(predictions: Sequence[Prediction], temperatures: Sequence[int]) -> tuple[Array, Array]:
    """Features and residuals of the rows that count and are measured everywhere."""
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


def main(arguments: Sequence[str] | None = None) -> None:
    """Write what the baselines say of recordings."""
    parser = argparse.ArgumentParser(prog="baselines")
    parser.add_argument("recordings", nargs="+")
    parser.add_argument("--holdout", action="append", default=[])
    parser.add_argument("--gearbox", default="fzg")
    parser.add_argument("--output", type=Path, required=True)
    given = parser.parse_args(arguments)
    gearbox = load_gearbox(given.gearbox)
    network = gearbox.network()
    train = read_recordings(given.recordings, network)
    held = read_recordings(given.holdout, network) if given.holdout else ()
    said = baselines(prepare(gearbox, train, held), prepare(gearbox, train, held, even=True))
    given.output.write_text(json.dumps(said, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
