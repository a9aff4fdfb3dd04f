"""Rows that two recordings share: they would count twice, or be held out and used for training."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pandas.util import hash_pandas_object

from diagnosis.recordings.recording import Recording
from diagnosis.recordings.time_axis import moment_text
from models.base.errors import InputError

SHARED_ROWS, SHARED_SHARE = 20, 0.2  # distinct rows that two recordings have in common


def check_shared_rows(
    train: Sequence[Recording], holdout: Sequence[Recording] = (), baseline: Sequence[Recording] = ()
) -> None:
    """Refuse recordings that share rows.

    Raises
    ------
    InputError
        With every pair that shares rows.
    """
    given = [(recording, _distinct_rows(recording)) for recording in (*train, *holdout, *baseline)]
    lines, judged = [], len(train) + len(holdout)
    for (i, (one, rows)), (j, (other, others)) in combinations(enumerate(given), 2):
        shared = _shared(one, other, rows, others)
        if shared and i < judged <= j:
            lines.append(
                f"{other.path}: is a baseline, but {shared} {one.path}, in which the effect may act; name a "
                "recording, or a part FILE@start..end, from before it"
            )
        elif shared and i < len(train) <= j < judged:
            lines.append(
                f"{other.path}: is held out, but {shared} {one.path}, which is used for training; hold out another "
                "recording, or a part FILE@start..end that does not overlap"
            )
        elif shared:
            lines.append(f"{other.path}: {shared} {one.path}; name every row once")
    if lines:
        raise InputError("\n".join(lines))


def _shared(one: Recording, other: Recording, mine: NDArray[np.uint64], theirs: NDArray[np.uint64]) -> str:
    """Describe the overlap of two recordings, as the start of a sentence that ends with a file; empty without one."""
    if one.hash == other.hash:
        first, last = max(one.from_s, other.from_s), min(one.to_s, other.to_s)
        if last < first:
            return ""
        unit = "" if one.clock is not None and one.clock.is_date else " s"
        return (
            f"has the rows of {moment_text(first, one.clock)} ... {moment_text(last, one.clock)}{unit} in common with"
        )
    common = len(np.intersect1d(mine, theirs, assume_unique=True))
    least = min(len(mine), len(theirs))
    if common >= SHARED_ROWS and common > SHARED_SHARE * least:
        return f"has {common} of {least} distinct rows in common with"
    return ""


def _distinct_rows(recording: Recording) -> NDArray[np.uint64]:
    """Hash every four rows as measured, without the time: two of them are never equal by chance."""
    columns = list(recording.inputs.values())[:2]
    columns += [channel.values for channel in sorted(recording.channels, key=lambda channel: channel.name)]
    values = np.round(np.nan_to_num(np.column_stack(columns), nan=-1e9), 3) + 0.0  # no -0.0
    row = hash_pandas_object(pd.DataFrame(values), index=False).to_numpy()
    four = pd.DataFrame({0: row[:-3], 1: row[1:-2], 2: row[2:-1], 3: row[3:]})
    return np.unique(hash_pandas_object(four[four[0] != four[3]], index=False).to_numpy())
