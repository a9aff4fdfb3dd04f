"""A two-point control of the real machine, found in its recording: a temperature that saws between two levels.

It is in no definition, but it answers to a change: it holds the temperature and removes more or less heat. Where the
recording shows it at work, the model gets a feedback that does the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import find_peaks

from diagnosis.proof.injection.real_recording import RealRecording
from models.base.types import Array
from models.quantities.quantities import node_of_channel

PROMINENCE_K, PROMINENCE_SHARE = 1.0, 0.25  # of a turn, at least; the second of the range between the deciles
FEWEST_TURNS = 10
LEVEL_SHARE = 0.2  # of the distance between the levels: how far a turn may miss its level
AT_LEVEL = 0.5  # share of the turns that meet their level
LONGEST_PAUSE = 4.0  # times the usual time between turns, for which the control counts as at work
AFTER_TURN = 2  # rows after a peak, in which the cooled place falls most

SHARED = 0.1  # of the distance between the levels: how far another sensor falls with it, at least


@dataclass(frozen=True, kw_only=True, eq=False)
class Control:
    """A two-point control.

    Attributes
    ----------
    channel : str
        The sensor that it holds between its levels
    node : str
        Node of this sensor
    acts_at : str
        Node that falls fastest when it switches
    low, high : float
        Levels, [degC]
    active : Array, shape (rows,)
        1 where it is at work, else 0
    """

    channel: str
    node: str
    acts_at: str
    low: float
    high: float
    active: Array


def find_control(real: RealRecording) -> Control | None:
    """Find the two-point control that a recording shows; None if no temperature turns at two fixed levels.

    Of several sensors that do, it is the one whose turns meet their levels most often.
    """
    whole = {name: real.reading_at(name, real.time) for name in real.channels}
    best: tuple[float, Control] | None = None
    for channel, T in whole.items():
        spread = float(np.percentile(T, 90.0) - np.percentile(T, 10.0))
        prominence = max(PROMINENCE_K, PROMINENCE_SHARE * spread)
        peaks, _ = find_peaks(T, prominence=prominence)
        valleys, _ = find_peaks(-T, prominence=prominence)
        if min(len(peaks), len(valleys)) < FEWEST_TURNS:
            continue
        high, low = float(np.median(T[peaks])), float(np.median(T[valleys]))
        near = LEVEL_SHARE * (high - low)
        hits = [np.abs(T[peaks] - high) <= near, np.abs(T[valleys] - low) <= near]
        met = min(float(hit.mean()) for hit in hits)
        if met < AT_LEVEL:
            continue
        turns = np.sort(np.concatenate([peaks[hits[0]], valleys[hits[1]]]))
        usual = float(np.median(np.diff(real.time[turns])))
        active = np.zeros(len(T))
        for a, b in pairwise(turns.tolist()):
            if real.time[b] - real.time[a] <= LONGEST_PAUSE * usual:
                active[a : b + 1] = 1.0
        before = peaks[hits[0]]
        before = before[before < len(T) - AFTER_TURN]
        falls = {name: float(np.mean(values[before] - values[before + AFTER_TURN])) for name, values in whole.items()}
        cooled, *others = sorted(falls, key=lambda name: -falls[name])
        if others and falls[others[0]] < SHARED * (high - low):  # noise or a broken sensor, which no other one follows
            continue
        node, acts_at = (node_of_channel(name, real.nodes) for name in (channel, cooled))
        if best is None or met > best[0]:
            best = met, Control(channel=channel, node=node, acts_at=acts_at, low=low, high=high, active=active)
    return None if best is None else best[1]
