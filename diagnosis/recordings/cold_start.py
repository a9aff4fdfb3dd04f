"""A machine that stood still has one temperature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Chosen by hand, not fitted.
COLD_K, AGREE_K = 8.0, 1.5  # above the air; of a reading from the median
AT_REST_K, FAULTY_K = 1.0, 5.0  # above the air and from the median, at most, where one thermometer is wrong


def is_isothermal(readings: Sequence[float], ambient: float) -> bool:
    """True if a cold machine has one temperature: its readings agree.

    Of four and more one may be off if the others are as cold as the air: it is wrong then. In a machine that cools
    down, parts differ by a share of what they are above the air, and oil that is preheated is warmer by more.

    Parameters
    ----------
    readings : sequence of float
        First temperatures of all parts that are measured, [degC]
    ambient : float
        Of the air then, [degC]
    """
    if len(readings) < 2 or (rise := abs(np.median(readings) - ambient)) > COLD_K:
        return False
    apart = np.sort(np.abs(np.asarray(readings) - np.median(readings)))
    one_is_wrong = len(apart) > 3 and apart[-2] < AGREE_K and apart[-1] < FAULTY_K and rise < AT_REST_K
    return bool(apart[-1] < AGREE_K or one_is_wrong)
