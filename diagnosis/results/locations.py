"""Where and when something acts: places by probability, time windows, and the operation in simple words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidates.hypotheses import WHILE
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.recordings.cleaning import runs
from diagnosis.results.findings import heats_of
from diagnosis.results.places import node_in, nodes_in
from diagnosis.results.result_parts import Location
from diagnosis.setup.inference_setup import InferenceSetup
from models.base.types import Array

LEAST_PLACE = 0.02  # probability of a place that is told
FROM_DATE, BETWEEN = "from its date on", "between its two dates"
ACTIVE_SHARE = 0.3  # of the largest magnitude
SHORTEST_WINDOW_S, SHORTEST_GAP_S = 120.0, 300.0
GOOD_ENOUGH = 0.9  # of the intervals told rightly


def locations_of(setup: InferenceSetup, posterior: Posterior) -> tuple[Location, ...]:
    """Places by probability, over everything that was judged; the first that acts there as the best fit has it.

    Where nothing was detected: if something is missing all the same, and no place if the evidence is against that.
    """
    if posterior.log_e <= 0.0:
        return ()
    weights: dict[str, float] = {}
    best: dict[str, Judged] = {}
    nodes: dict[str, str] = {}
    given = 1.0 if posterior.detected else posterior.something
    for judged, probability in posterior.ranked:
        if judged.of_parameters and not posterior.detected:
            continue
        for effect in judged.effects:
            nodes.setdefault(effect.label, node_in(setup.nominal, effect))
        for node in {nodes[effect.label] for effect in judged.effects}:
            weights[node] = weights.get(node, 0.0) + probability / given
            if judged.fit is not None and probability / given >= LEAST_PLACE:
                best.setdefault(node, judged)
    told = sorted(((n, w) for n, w in weights.items() if w >= LEAST_PLACE), key=lambda item: -item[1])
    return tuple(_place(setup, node, weight, best.get(node), nodes) for node, weight in told)


def _place(
    setup: InferenceSetup, node: str, weight: float, judged: Judged | None, nodes: Mapping[str, str]
) -> Location:
    fit = None if judged is None else judged.fit
    # Of two that act there, one may add heat and one take some away: their sum would be neither's.
    effects = [effect for effect in (judged.effects if judged else ()) if nodes[effect.label] == node]
    warm = [(effect, heats) for effect in effects if fit is not None and (heats := heats_of(fit, effect))]
    if fit is None or not warm:
        nodes_there = nodes_in(setup.nominal, effects[0]) if effects else (node,)
        return Location(nodes=nodes_there, probability=min(weight, 1.0), heat_mean_W=0.0, heat_max_W=0.0, when=(),
                        regime="always")  # fmt: skip
    here, heat = warm[0]
    tested = fit.experiment.tested
    heats = [heat[i] for i in tested]
    trajectories = [fit.trajectories[i] for i in tested]
    pieces = [trajectory.piece for trajectory in trajectories]
    together, steps = np.concatenate(heats), np.concatenate([piece.steps for piece in pieces])
    inputs = np.concatenate([piece.inputs for piece in pieces])
    signals = {"speed": (np.abs(inputs[:, 0]), "1/min"), "torque": (np.abs(inputs[:, 1]), "N m")}
    parts = [part.name for part in setup.nominal.parts]
    if node in parts:
        T = np.concatenate([trajectory.middle[:, parts.index(node)] for trajectory in trajectories])
        signals[f"temperature of {node}"] = (T, "degC")
    signals["time"] = (np.concatenate([piece.middle for piece in pieces]) / 3600.0, "h")
    signals = {name: signal for name, signal in signals.items() if np.ptp(signal[0]) > 0.0}
    acting = active(together, steps)
    dated = BETWEEN if here.ending == WHILE else FROM_DATE if here.how == "from_date" else ""
    split = np.split(acting, np.cumsum([len(heat) for heat in heats])[:-1])
    when = [(piece.recording, a, b) for piece, acts in zip(pieces, split, strict=True)
            for a, b in windows(piece.middle, acts)]  # fmt: skip
    return Location(
        nodes=nodes_in(setup.nominal, here), probability=min(weight, 1.0),
        heat_mean_W=float(np.average(together, weights=steps)),
        heat_max_W=float(together[np.argmax(np.abs(together))]), when=tuple(when),
        regime=dated or regime(acting, signals, steps),
    )  # fmt: skip


def active(heat: Array, steps: Array) -> NDArray[np.bool_]:
    """Where a heat acts, shape (K,): where it is at least a third of the size that it has for a hundredth of the time.

    Parameters
    ----------
    heat : Array, shape (K,)
    steps : Array, shape (K,)
        Lengths of the intervals
    """
    size = np.abs(heat)
    order = np.argsort(-size)
    largest = size[order[int(np.searchsorted(np.cumsum(steps[order]), 0.01 * steps.sum()))]]
    return np.asarray(size > ACTIVE_SHARE * max(float(largest), 1e-9))


def windows(time: Array, acting: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Time windows in which something acts, short gaps closed and short windows left out, [s].

    Examples
    --------
    >>> time = np.arange(0.0, 4000.0, 100.0)
    >>> windows(time, (time >= 1000.0) & (time < 2500.0) & (time != 1500.0))
    [(1000.0, 2400.0)]
    """
    found: list[tuple[float, float]] = []
    for begin, end in runs(acting):
        window = float(time[begin]), float(time[end - 1])
        if found and window[0] - found[-1][1] <= SHORTEST_GAP_S:
            found[-1] = (found[-1][0], window[1])
        else:
            found.append(window)
    return [w for w in found if w[1] - w[0] >= SHORTEST_WINDOW_S]


def regime(acting: NDArray[np.bool_], signals: Mapping[str, tuple[Array, str]], steps: Array) -> str:
    """The operation in which something acts, as one threshold (a percentile) of one signal, if enough.

    Parameters
    ----------
    acting : bool array, shape (K,)
    signals : mapping of name to (values of shape (K,), unit)
    steps : Array, shape (K,)
        Lengths of the intervals

    Examples
    --------
    >>> n = np.linspace(0.0, 3000.0, 301)
    >>> regime(n > 2000.0, {"speed": (n, "1/min")}, np.ones(301))
    'speed above 1980 1/min'
    """
    share = float(np.average(acting, weights=steps))
    if share > 0.95:
        return "always"
    if share < 0.02:
        return "rarely"
    best, words = 0.0, ""
    for name, (values, unit) in signals.items():
        for threshold in np.unique(np.percentile(values, np.arange(2, 99, 2))):
            above = values > threshold
            # Both sides count alike, however rare one is.
            hit = 0.5 * (float(np.average(above[acting], weights=steps[acting]))
                         + float(np.average(~above[~acting], weights=steps[~acting])))  # fmt: skip
            for told, side in ((hit, "above"), (1.0 - hit, "below")):
                if told > best + 0.005:
                    exact = f"{threshold:.0f}" if threshold >= 100.0 else f"{threshold:.3g}"
                    best, words = told, f"{name} {side} {exact} {unit}"
    if best >= GOOD_ENOUGH:
        return words
    return f"{share:.0%} of the time; no single threshold of {', '.join(signals)} separates it" + (
        f" (nearest: {words})" if best > 0.75 else "")  # fmt: skip
