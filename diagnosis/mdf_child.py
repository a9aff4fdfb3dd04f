"""Reads the numeric channels of one MDF file and writes them as one .npz: run as a process of its own.

A damaged or hostile MDF file can crash the reader, fill the memory or run forever; here that ends this process only.
Imports nothing of the house. Usage: ``python mdf_child.py MDF NPZ MOST_ROWS MOST_COLUMNS MOST_BYTES``.
"""

from __future__ import annotations

import json
import sys
import warnings

import numpy as np

FAULT = 3  # exit status: what is wrong stands on stdout


def main(source: str, target: str, most_rows: int, most_columns: int, most_bytes: int) -> int:
    """Write the channels; return the exit status."""
    _hold_memory(most_bytes)
    warnings.simplefilter("ignore")
    from asammdf import MDF

    arrays: dict[str, np.ndarray] = {}
    catalogue: list[dict[str, str]] = []
    with MDF(source) as mdf:
        places = [(g, c) for g, group in enumerate(mdf.groups) for c in range(len(group.channels))]
        if len(places) > most_columns:
            return _fault(f"has {len(places)} channels, more than the {most_columns} that are read; drop some")
        if any(int(group.channel_group.cycles_nr) > most_rows for group in mdf.groups):
            return _fault(f"has more than {most_rows} rows; take a part of it, or every n-th row")
        for g, c in places:
            if mdf.masters_db.get(g) == c:
                continue
            signal = mdf.get(group=g, index=c)
            values = np.asarray(signal.samples)
            if values.ndim != 1 or values.dtype.kind not in "biuf":
                continue
            valid = signal.invalidation_bits
            values = values.astype(np.float64)
            if valid is not None:
                values[np.asarray(valid).astype(bool)] = np.nan
            number = len(catalogue)
            catalogue.append({"name": str(signal.name), "unit": str(signal.unit or "")})
            arrays[f"values_{number}"] = values
            arrays[f"times_{number}"] = np.asarray(signal.timestamps, dtype=np.float64)
        start = mdf.start_time.timestamp() if mdf.start_time is not None else None
    header = np.array(json.dumps({"channels": catalogue, "start": start}))
    np.savez(target, allow_pickle=False, header=header, **arrays)
    return 0


def _fault(text: str) -> int:
    sys.stdout.write(text)
    return FAULT


def _hold_memory(most_bytes: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (most_bytes, most_bytes))


if __name__ == "__main__":
    try:
        status = main(sys.argv[1], sys.argv[2], *(int(number) for number in sys.argv[3:6]))
    except Exception as error:  # noqa: BLE001  whatever a damaged file makes of the reader
        text = str(error).strip().splitlines()
        status = _fault(f"cannot be read as mf4: {text[0] if text else type(error).__name__}")
    sys.stdout.flush()
    sys.exit(status)
