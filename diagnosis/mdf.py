"""MDF4 files as tables: every channel on the times of one of them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from diagnosis.recording_time import STANDARD
from models.errors import InputError
from models.table_file import LIMITS, Limits, check_file
from models.types import Array

LONGEST_READING_S = 300.0
MEMORY_BYTES = 8_000_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class MdfTable:
    """The channels of an MDF file as one table.

    Attributes
    ----------
    table : DataFrame
        ``time_s`` since the start of the measurement, and the channels; NaN where a slower channel has no sample
    units : mapping of channel to str
        As the file names them
    start : float or None
        Start of the measurement since 1970, [s]
    """

    table: pd.DataFrame
    units: Mapping[str, str]
    start: float | None


def read_mdf(path: Path, *, base: str, limits: Limits = LIMITS) -> MdfTable:
    """Read an MDF file.

    Parameters
    ----------
    path : Path
    base : str
        Channel whose times become the rows; samples of others go to the nearest row, several of them as their mean
    limits : Limits

    Raises
    ------
    InputError
        If asammdf is not installed, or the file cannot be read, is too large, or names a channel twice.
    """
    check_file(path, limits)
    if find_spec("asammdf") is None:
        raise InputError(f"{path}: reading MDF4 needs asammdf; python -m pip install asammdf")
    header, channels = _in_own_process(path, limits)
    names = [channel["name"] for channel in header["channels"]]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InputError("\n".join(f"{path}: channel {name[:80]} is there twice; keep one" for name in repeated[:10]))
    if base not in names:
        shown = ", ".join(sorted(names)[:20]) or "no numeric channel"
        raise InputError(f"{path}: channel {base} is missing; it has: {shown}")
    time = channels[names.index(base)][0]
    if len(time) == 0:
        raise InputError(f"{path}: channel {base} has no samples")
    columns = {STANDARD: time} | {
        name: _at_nearest(time, *channel) for name, channel in zip(names, channels, strict=True)
    }
    units = {channel["name"]: channel["unit"] for channel in header["channels"] if channel["unit"]}
    return MdfTable(table=pd.DataFrame(columns), units=units, start=header["start"])


def _in_own_process(path: Path, limits: Limits) -> tuple[dict[str, Any], list[tuple[Array, Array]]]:
    child = Path(__file__).with_name("mdf_child.py")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "channels.npz"
        numbers = [str(limits.rows), str(limits.columns), str(MEMORY_BYTES)]
        try:
            # -P: the folder of the child must not hide modules of the same names.
            done = subprocess.run(  # noqa: S603  our own file, no shell
                [sys.executable, "-P", str(child), str(path.resolve()), str(target), *numbers],
                capture_output=True, timeout=LONGEST_READING_S, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired as error:
            raise InputError(f"{path}: cannot be read as mf4 within {LONGEST_READING_S:g} s; is it damaged?") from error
        if done.returncode != 0 or not target.exists():
            said = done.stdout.decode(errors="replace").strip()[:300]
            raise InputError(f"{path}: {said or 'cannot be read as mf4: the reader broke off; is it damaged?'}")
        with np.load(target, allow_pickle=False) as arrays:
            header = json.loads(str(arrays["header"]))
            count = len(header["channels"])
            return header, [(arrays[f"times_{i}"], arrays[f"values_{i}"]) for i in range(count)]


def _at_nearest(time: Array, times: Array, values: Array) -> Array:
    """Samples at the rows they are nearest to, shape (rows,); NaN elsewhere."""
    if len(times) == len(time) and np.array_equal(times, time):
        return values
    good = np.isfinite(values) & (len(time) > 1)
    edges = 0.5 * (time[1:] + time[:-1])
    row = np.searchsorted(edges, times[good])
    count = np.bincount(row, minlength=len(time))
    total = np.bincount(row, values[good], minlength=len(time))
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))
