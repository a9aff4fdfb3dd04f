"""A machine that stood still has one temperature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

COLD_K, AGREE_K, FAULTY_K = 8.0, 1.5, 10.0


def is_isothermal(readings: Sequence[float], ambient: float) -> bool:
    """True if a cold machine has one temperature: its readings agree, of four or more all but one that may be wrong."""
    if len(readings) < 2 or abs(np.median(readings) - ambient) > COLD_K:
        return False
    apart = np.sort(np.abs(np.asarray(readings) - np.median(readings)))
    return bool(apart[-1] < AGREE_K or (len(apart) > 3 and apart[-2] < AGREE_K and apart[-1] < FAULTY_K))
