"""MDF4 files as tables: every channel on the times of one of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd

from diagnosis.recordings.time_axis import STANDARD
from models.base.errors import InputError

FARTHEST_STEPS = 1.5  # of the usual time between rows, that a sample may be from its row


def read_mdf(path: Path, *, bases: Sequence[str]) -> tuple[pd.DataFrame, dict[str, str], float]:
    """Read the numeric channels of an MDF file as one table.

    Parameters
    ----------
    bases : sequence of str
        Channels, of which the first that the file has gives the rows; a sample of another channel goes to the nearest
        row, several to their mean

    Returns
    -------
    table : DataFrame
        ``time_s`` since the start of the measurement, and the channels; NaN where a slower channel has no sample. A
        name that several groups have is followed by the group, as ``n (group 2)``
    units : dict of channel to str
        As the file names them
    start : float
        Start of the measurement since 1970, [s]

    Raises
    ------
    InputError
        If asammdf is not installed, or the file cannot be read or has none of `bases`.
    """
    if find_spec("asammdf") is None:
        raise InputError(f"{path}: reading MDF4 needs asammdf; python -m pip install asammdf")
    from asammdf import MDF

    groups: list[tuple[pd.DataFrame, dict[str, str]]] = []
    try:
        with MDF(path) as file:
            start = file.start_time.timestamp()
            for index in range(len(file.groups)):
                channels = [
                    (None, group, c) for group, own in file.included_channels(index)[index].items() for c in own
                ]
                # Interpolated samples would count as measured; without it, invalid and missing samples are NaN.
                frame = file.to_dataframe(channels, time_from_zero=False, use_interpolation=False, numeric_1D_only=True)
                own = {file.groups[group].channels[channel].name: file.get_channel_unit(group=group, index=channel)
                       for _, group, channel in channels}  # fmt: skip
                groups.append((frame, own))
    except Exception as error:
        text = str(error).strip().splitlines()
        raise InputError(f"{path}: cannot be read as mf4: {text[0] if text else type(error).__name__}") from error
    count = Counter(name for frame, _ in groups for name in frame.columns)
    frames, units = list[pd.DataFrame](), dict[str, str]()
    for number, (frame, own) in enumerate(groups, start=1):
        apart = {name: f"{name} (group {number})" for name in frame.columns if count[name] > 1}
        frames.append(frame.rename(columns=apart))
        units |= {apart.get(name, name): unit for name, unit in own.items() if unit}
    return _on_rows_of(bases, frames, path), units, start


def _on_rows_of(bases: Sequence[str], groups: list[pd.DataFrame], path: Path) -> pd.DataFrame:
    names = [str(name) for frame in groups for name in frame.columns]
    base = next((name for name in bases if name in names), None)
    if base is None:
        shown = ", ".join(sorted(names)[:20]) or "no numeric channel"
        raise InputError(f"{path}: channel {' or '.join(bases)} is missing; it has: {shown}")
    time = next(frame for frame in groups if base in frame.columns).index.to_numpy(dtype=np.float64)
    if len(time) == 0:
        raise InputError(f"{path}: channel {base} has no samples")
    middles = 0.5 * (time[1:] + time[:-1])
    steps = np.diff(time)
    shorter = np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf))  # of the two next to a row
    reach = FARTHEST_STEPS * shorter  # rows of another raster may come together; nobody fills a hole
    columns = []
    for frame in groups:
        values = frame.astype(np.float64)
        if not np.array_equal(values.index, time):
            at = values.index.to_numpy(dtype=np.float64)
            row = np.searchsorted(middles, at)
            near = np.abs(at - time[row]) <= reach[row]
            values = values[near].groupby(row[near]).mean().reindex(range(len(time)))
        columns.append(values.set_axis(range(len(time))))
    return pd.concat([pd.DataFrame({STANDARD: time}), *columns], axis=1)
