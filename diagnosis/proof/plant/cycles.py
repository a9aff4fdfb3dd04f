"""Test programmes of the plant: an 18 h staircase and random cycles to learn from, others to judge by.

Everything is relative to the range that a gearbox definition names in ``[training]``: on the FZG rig the highest stair
is 20 m/s at the pitch circle and the reference torque 94 N m.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from models.assembly.gearbox import Gearbox
from models.base.types import Array

TRAIN, HOLD, BASELINE = "train", "hold", "baseline"  # how the name of a recording begins
ROW_S = 10.0
TOP_SPEED, REFERENCE_TORQUE = 0.8021, 94.0 / 350.0  # of the upper ends of the training range
# Stairs as fraction of the top speed, each with a torque that keeps the oil of a dip-lubricated box below 120 degC.
STAIRS = ((0.05, 1.6), (0.10, 1.6), (0.25, 1.2), (0.415, 1.0), (0.60, 0.8), (0.75, 0.6), (1.0, 0.4))
HOLD_STAIRS = ((0.17, 0.65), (0.33, 0.70), (0.52, 0.55), (0.68, 0.45), (0.88, 0.35))
STAIR_S, STANDSTILL_S = 8400.0, 6000.0
RANDOM_S, HOLD_STAIRCASE_S = 7200.0, 14400.0
WARM_UP_S = 3600.0
STEADY_POWER = 0.33  # highest product of the fractions in random cycles: speed of the top's, torque of 1.6 references


@dataclass(frozen=True, kw_only=True, eq=False)
class Programme:
    """Inputs of one recording in rows.

    Attributes
    ----------
    name : str
        ``train_1`` ... ``hold_2``, ``baseline_1`` ...
    inputs : mapping of str to Array, shape (rows,)
        True inputs by their names in the nominal network: ``speed`` [1/min], ``torque`` [N m], ``T_ambient`` [degC] ...
    random_heat : mapping of str to Array, shape (rows,)
        Heat that no law describes, [W]: by body of a plant of the zoo, by place of one of the own kind
    start : mapping of str to float
        Temperatures of bodies at the first row, [degC]
    unrecorded : int
        Rows at the start that happen before the recording is switched on (a warm start)
    begins_h : float
        Time of the first recorded row since that of the first recording of the session, [h]
    """

    name: str
    inputs: Mapping[str, Array]
    random_heat: Mapping[str, Array] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    unrecorded: int = 0
    begins_h: float = 0.0

    def __len__(self) -> int:
        return len(next(iter(self.inputs.values())))


def top_speed(gearbox: Gearbox) -> float:
    """Speed of the highest stair, [1/min]."""
    return TOP_SPEED * gearbox.training.speed_rpm[1]


def reference_torque(gearbox: Gearbox) -> float:
    """Torque that the stairs are relative to, [N m]."""
    return REFERENCE_TORQUE * gearbox.training.torque_Nm[1]


def programmes(gearbox: Gearbox, rng: np.random.Generator) -> tuple[Programme, ...]:
    """Speed and torque of the five recordings of one case: about 22 h to learn from, 6 h held out at others.

    Returns
    -------
    tuple of Programme
        ``train_1`` (staircase and standstill), ``train_2`` (random, cold), ``train_3`` (random, warm), ``hold_1``
        (random, warm), ``hold_2`` (staircase)
    """
    n, M = top_speed(gearbox), reference_torque(gearbox)
    return (
        _staircase(rng, n, M),
        _random("train_2", rng, n, M, warm=False),
        _random("train_3", rng, n, M, warm=True),
        _random("hold_1", rng, n, M, warm=True),
        _hold_staircase(rng, n, M),
    )


def ambient(rows: int, rng: np.random.Generator) -> Array:
    """Ambient temperature that wanders around 22 to 28 degC by about 0.7 K in an hour or two, shape (rows,), [degC]."""
    return np.asarray(rng.uniform(22.0, 28.0) + ornstein_uhlenbeck(rows, rng, sd=0.7, tau_s=5400.0))


def ornstein_uhlenbeck(rows: int, rng: np.random.Generator, *, sd: float, tau_s: float) -> Array:
    """Stationary coloured noise of standard deviation `sd` and correlation time `tau_s`, shape (rows,)."""
    keep = np.exp(-ROW_S / tau_s)
    kicks = rng.standard_normal(rows) * sd * np.sqrt(1.0 - keep**2)
    kicks[0] = sd * rng.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -keep], kicks))


def _staircase(rng: np.random.Generator, n: float, M: float) -> Programme:
    """Every stair at its torque with two excursions, in random order, then standstill."""
    speed, torque = [], []
    for index in rng.permutation(len(STAIRS)):
        level, load = STAIRS[index]
        marks = np.sort(rng.uniform(0.25, 0.95, 4))
        loads = (1.0, rng.uniform(0.3, 0.7), 1.0, rng.uniform(1.15, 1.6), 1.0)
        at = np.arange(0.0, STAIR_S, ROW_S) / STAIR_S
        speed.append(np.full(len(at), level * n))
        torque.append(np.choose(np.searchsorted(marks, at, side="right"), loads) * load * M)
    rest = np.zeros(round(STANDSTILL_S / ROW_S))
    inputs = {"speed": np.concatenate([*speed, rest]), "torque": np.concatenate([*torque, rest])}
    return Programme(name="train_1", inputs=inputs)


def _hold_staircase(rng: np.random.Generator, n: float, M: float) -> Programme:
    speed, torque = [], []
    chosen = rng.permutation(len(HOLD_STAIRS))[:4]
    rows = round(HOLD_STAIRCASE_S / ROW_S / len(chosen))
    for index in chosen:
        level, load = HOLD_STAIRS[index]
        speed.append(np.full(rows, level * n * rng.uniform(0.95, 1.05)))
        torque.append(np.full(rows, load * M * rng.uniform(0.8, 1.2)))
    return Programme(name="hold_2", inputs={"speed": np.concatenate(speed), "torque": np.concatenate(torque)})


def _random(name: str, rng: np.random.Generator, n: float, M: float, *, warm: bool) -> Programme:
    """Holds of 1 to 12 minutes at random speeds and torques, joined by ramps of 10 s; before a warm start an hour."""
    unrecorded = round(WARM_UP_S / ROW_S) if warm else 0
    rows = unrecorded + round(RANDOM_S / ROW_S)
    speed, torque = np.empty(rows), np.empty(rows)
    row = 0
    while row < rows:
        length = rows if row < unrecorded else round(rng.uniform(60.0, 720.0) / ROW_S)
        end = min(row + length, unrecorded if row < unrecorded else rows)
        level = rng.uniform(0.06, 0.95)
        highest = min(2.1, STEADY_POWER * 3.0 / level)
        speed[row:end], torque[row:end] = level * n, rng.uniform(0.1, highest) * M
        if rng.random() < 0.06 and row >= unrecorded:
            speed[row:end], torque[row:end] = 0.0, 0.0
        row = end
    return Programme(name=name, inputs={"speed": speed, "torque": torque}, unrecorded=unrecorded)
