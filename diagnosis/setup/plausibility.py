"""Checks of recordings against the nominal model: another gearbox, or units that the ranges of values cannot show.

Missing physics, worn parts and wrong parameters move temperatures by some kelvin; only what none of them explains is
refused here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.trajectory import simulate
from diagnosis.recordings.recording import Recording
from models.base.errors import InputError
from models.base.types import Array
from models.portable.evaluation import RPM
from models.quantities.quantities import TOTAL_LOSS as LOSS
from models.simulation.thermal_network import Losses, ThermalNetwork

ROWS = 200  # of the thinned recording that is simulated
FEWEST_ROWS = 10
WRONG_K, WRONG_SHARE = 30.0, 0.5  # deviation of temperatures [K] and share of their rise: no physics is so far off
WARM_DEGC, WARM_SHARE = 45.0, 0.3  # surroundings that are never cooler: probably degF, so that less is enough
WRONG_LOSS = 4.0  # factor between measured and nominal loss
RUNAWAY_DEGC = 1000.0  # if the model has no solution
LEAST_LOSS, MOST_LOSS = 2e-4, 1.0  # possible loss over power through the gearbox


def check_plausible(
    recordings: Sequence[Recording], network: ThermalNetwork, losses: Losses, *, judge_temperatures: bool = True
) -> None:
    """Refuse recordings whose temperatures or power balance no missing physics explains.

    Parameters
    ----------
    judge_temperatures : bool
        False if the model is too uncertain for that (a definition without geometry)

    Raises
    ------
    InputError
        With each deviation and the mistakes that it may come from.
    """
    model = NetworkOnGrid(network, losses)
    lines = []
    for recording in recordings:
        for problem in _problems(recording, model, judge_temperatures=judge_temperatures):
            lines.append(f"{recording.path}: {problem}")
    if lines:
        raise InputError("\n".join(lines))


def _problems(recording: Recording, model: NetworkOnGrid, *, judge_temperatures: bool) -> list[str]:
    time, values = _thinned(recording)
    measured = {c.name: values[c.name] for c in recording.channels if np.isfinite(values[c.name]).any()}
    loss = measured.pop(LOSS, None)
    if len(time) < FEWEST_ROWS or not (loss is not None or (measured and judge_temperatures)):
        return []
    simulated, nominal_loss = _simulated(time, values, measured, model)
    problems = []
    if judge_temperatures and measured:
        ambient = values["T_ambient"]
        off = [simulated[name] - T for name, T in measured.items()]
        rises = [
            max(np.nanmax(np.abs(T - ambient)), np.max(np.abs(simulated[name] - ambient)), 1.0)
            for name, T in measured.items()
        ]
        kelvin = float(np.sqrt(np.mean([np.nanmean(deviation**2) for deviation in off])))
        limit = WARM_SHARE if np.min(ambient) > WARM_DEGC else WRONG_SHARE
        if kelvin > WRONG_K and kelvin / np.mean(rises) > limit:
            problems.append(
                f"temperatures are {kelvin:.0f} K off the nominal model over the rows of {time[0]:.0f} ... "
                f"{time[-1]:.0f} s, more than missing physics explains; check the units of speed (rad/s, 1/s), torque "
                "(kN m, N mm), time (ms, min, h) and temperatures (degF) and give them in a mapping file; or is it "
                "another gearbox, or are speed and torque those of another shaft?"
            )
    if loss is not None:
        problems.append(loss_problem(0.5 * (loss[1:] + loss[:-1]), _through(values), nominal_loss))
    return [problem for problem in problems if problem]


def loss_problem(loss: Array, power: Array, nominal_loss: Array) -> str:
    """Find slips of unit in a measured loss from the power balance of loaded rows; empty if there is none.

    Only rows whose power through the gearbox exceeds the nominal loss count: drag may be larger than the power through
    an idling gearbox. Without such rows, measured and nominal loss are compared.

    Parameters
    ----------
    loss, power, nominal_loss : Array, shape (rows,)
        Measured loss, power through the gearbox, loss of the nominal model, [W]; NaN where missing
    """
    fix = "Give the unit in a mapping file"
    known = np.isfinite(loss)
    high = known & (nominal_loss > 0.5 * np.max(nominal_loss))
    loaded = known & (power > nominal_loss)
    if loaded.sum() < FEWEST_ROWS:
        if not high.any():
            return ""
        lost, nominal = float(np.median(np.abs(loss[high]))), float(np.median(nominal_loss[high]))
        if nominal / WRONG_LOSS <= lost <= nominal * WRONG_LOSS:
            return ""
        return (
            f"{LOSS} is {lost:.3g} W (median), the nominal model's loss {nominal:.3g} W; is {LOSS} in kW or mW, torque "
            f"in kN m, or speed in rad/s? {fix}"
        )
    loaded &= power >= 0.5 * np.quantile(power[loaded], 0.99)
    lost, through = float(np.median(np.abs(loss[loaded]))), float(np.median(power[loaded]))
    if lost == 0.0:
        return f"{LOSS} is 0 while {through:.4g} W go through the gearbox; remove the column, or mend it"
    if lost < LEAST_LOSS * through:
        return (
            f"{LOSS} is {lost:.3g} W (median of loaded rows) while {through:.4g} W go through the gearbox: an "
            f"efficiency of {100.0 * (1.0 - lost / through):.4f} % is not possible; is {LOSS} in kW, or torque in "
            f"N mm? {fix}"
        )
    if lost > MOST_LOSS * through:
        return (
            f"{LOSS} is {lost:.4g} W (median of loaded rows), but only {through:.4g} W go through the gearbox; is "
            f"speed in rad/s, torque in kN m, or {LOSS} in mW? {fix}"
        )
    return ""


def _through(values: dict[str, Array]) -> Array:
    """Return the power through the gearbox in the intervals, shape (rows - 1,), [W]."""
    power = np.abs(values["speed"] * RPM * values["torque"])
    return 0.5 * (power[1:] + power[:-1])


def _thinned(recording: Recording) -> tuple[Array, dict[str, Array]]:
    """Return means over stretches of the longest piece: time [s] and values by signal and channel, shape (rows,)."""
    piece = max(recording.segments, key=lambda rows: recording.time[rows][-1] - recording.time[rows][0])
    time = recording.time[piece]
    stretches = np.array_split(np.arange(len(time)), min(ROWS, len(time)))

    def means(values: Array) -> Array:
        own = values[piece]
        known = [own[part][np.isfinite(own[part])] for part in stretches]
        return np.array([part.mean() if len(part) else np.nan for part in known])

    given = dict(recording.inputs) | {channel.name: channel.values for channel in recording.channels}
    return means(recording.time), {name: means(own) for name, own in given.items()}


def _simulated(
    time: Array, values: dict[str, Array], measured: dict[str, Array], model: NetworkOnGrid
) -> tuple[dict[str, Array], Array]:
    """Simulate the nominal model from the first measured temperatures.

    Returns
    -------
    temperatures : dict of node to Array, shape (rows,)
        [degC]; 1000 if the model runs away
    loss : Array, shape (rows - 1,)
        Total loss in the intervals, [W]
    """
    first = {model.parts[model.part_index(name)]: float(T[np.isfinite(T)][0]) for name, T in measured.items()}
    other = float(np.mean(list(first.values()))) if first else float(values["T_ambient"][0])
    inputs = np.stack([values[name] for name in model.laws.inputs], axis=-1)
    piece = Piece(
        recording="", time=time, samples=0.5 * (inputs[1:] + inputs[:-1])[:, None, :], channels=(),
        measured=np.empty((len(time), 0)), counts=np.empty((len(time), 0)),
    )  # fmt: skip
    start = np.array([first.get(name, other) for name in model.parts])
    try:
        with np.errstate(all="ignore"):
            trajectory = simulate(model, piece, model.start, start)
    except ArithmeticError:
        return {name: np.full(len(time), RUNAWAY_DEGC) for name in measured}, np.full(len(time) - 1, np.inf)
    temperatures = {name: trajectory.T[:, model.part_index(name)] for name in measured}
    return temperatures, trajectory.balance.sources[:, model.is_loss].sum(axis=-1)
