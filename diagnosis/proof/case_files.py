"""Files of a case: recordings as CSV.gz, the truth as JSON elsewhere, and the seal that binds them."""

from __future__ import annotations

import gzip
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from models.atomic_write import atomic_file
from models.errors import InputError
from models.types import Array

SEAL, MAPPING = "seal.json", "mapping.toml"
DECIMALS = {"time_s": 0, "speed_rpm": 1, "torque_Nm": 2}


def keep_apart(recordings: Path, truth: Path) -> None:
    """Refuse to put the truth where the recordings are.

    Raises
    ------
    InputError
        If it would lie there.
    """
    if recordings.resolve() in (truth.resolve(), *truth.resolve().parents):
        raise InputError(f"{truth}: the truth must not lie among the recordings in {recordings}; name another folder")


def keep_other_cases(made: Path, output: Path) -> None:
    """Refuse to replace anything of another case, recordings or truth; the same case may be made again.

    Parameters
    ----------
    made : Path
        Folder with new files
    output : Path
        Folder that they shall go to

    Raises
    ------
    InputError
        If a file of other content is there.
    """
    for file in sorted(path for path in made.rglob("*") if path.is_file()):
        there = output / file.relative_to(made)
        if there.is_file() and there.read_bytes() != file.read_bytes():
            raise InputError(f"{there}: is of another case, which would be lost; choose another output")


def write_case(
    folder: Path,
    truth_file: Path | None,
    recordings: Mapping[str, Mapping[str, Array]],
    truth: Mapping[str, Any],
    stated: Mapping[str, float] | None = None,
) -> None:
    """Write the recordings and their seal into one folder and the truth into a file outside it.

    Parameters
    ----------
    folder : Path
        Gets ``<recording>.csv.gz``, ``seal.json`` and, if anything is stated of the sensors, ``mapping.toml``
    truth_file : Path or None
        Outside `folder`; see :func:`keep_apart`. None: the truth is sealed and not written
    recordings : mapping of name to columns
    truth : mapping
        Goes into JSON, its ``salt`` with it, which makes the seal unguessable
    stated : mapping of key to float, or None
        What the data sheet says of every temperature sensor, by the keys of a mapping file; it may be wrong

    Raises
    ------
    InputError
        If something cannot be written.
    """
    sealed = (json.dumps(truth, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if truth_file is not None:
            truth_file.parent.mkdir(parents=True, exist_ok=True)
        for name, columns in recordings.items():
            # Neither name nor time go into the archive, so that the same case gives the same bytes.
            _write_whole(folder / f"{name}.csv.gz", gzip.compress(_csv(columns), compresslevel=6, mtime=0))
        if stated is not None:
            _write_whole(folder / MAPPING, _mapping(recordings, stated).encode())
        if truth_file is not None:
            _write_whole(truth_file, sealed)
        _write_whole(folder / SEAL, (json.dumps({"truth_sha256": hashlib.sha256(sealed).hexdigest()}) + "\n").encode())
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be written ({error.strerror}); choose another output") from error


def _mapping(recordings: Mapping[str, Mapping[str, Array]], stated: Mapping[str, float]) -> str:
    columns = next(iter(recordings.values()))
    sensors = [name for name in columns if name.startswith("T_") and name != "T_ambient_degC"]
    lines = ["# from the data sheet of the temperature sensors", "schema = 1"]
    for name in sensors:
        lines += ["", f"[columns.{name}]", f'quantity = "{name.removesuffix("_degC")}"', 'unit = "degC"']
        lines += [f"{key} = {value!r}" for key, value in stated.items()]
    return "\n".join(lines) + "\n"


def seal_holds(folder: Path, truth_file: Path) -> bool:
    """Whether a truth is the one that was sealed when the recordings in `folder` were made.

    Raises
    ------
    InputError
        If either file cannot be read.
    """
    try:
        stated = json.loads((folder / SEAL).read_text(encoding="utf-8"))["truth_sha256"]
        return bool(stated == hashlib.sha256(truth_file.read_bytes()).hexdigest())
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{folder / SEAL}, {truth_file}: seal and truth cannot be read ({error})") from error


def _write_whole(path: Path, content: bytes) -> None:
    with atomic_file(path) as partial:
        partial.write_bytes(content)


def _csv(columns: Mapping[str, Array]) -> bytes:
    """Columns as text with the decimals of their instruments; a missing reading is an empty field."""
    texts = [_texts(values, DECIMALS.get(name, 1)) for name, values in columns.items()]
    lines = [",".join(columns), *map(",".join, zip(*texts, strict=True))]
    return ("\n".join(lines) + "\n").encode()


def _texts(values: Array, decimals: int) -> list[str]:
    return ["" if missing else f"{value:.{decimals}f}" for value, missing in zip(values, np.isnan(values), strict=True)]
