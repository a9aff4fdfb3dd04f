"""Files of a case: recordings as CSV.gz, and the truth as JSON in another folder."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from models.base.atomic_write import atomic_folder
from models.base.errors import InputError
from models.base.types import Array

MAPPING = "mapping.toml"
DEFINITION = "gearbox.toml"  # of a case whose machine is not that of the whole set
OF_AIR = ("T_ambient", "T_outdoor")  # temperatures that are inputs
DECIMALS = {"time_s": 0, "speed_rpm": 1, "torque_Nm": 2}


def case_names(number: int) -> list[str]:
    """Names of so many cases, in an order that is that of the alphabet.

    Examples
    --------
    >>> case_names(2), case_names(1000)[0]
    (['case_001', 'case_002'], 'case_0001')
    """
    digits = max(3, len(str(number)))
    return [f"case_{i:0{digits}d}" for i in range(1, number + 1)]


@contextmanager
def staged_folders(recordings: Path, truth: Path) -> Iterator[tuple[Path, Path]]:
    """Folders to write cases into; both replace those named when all is done, or nothing changes.

    A case may be made again: files that are there may be replaced by the same content.

    Yields
    ------
    recordings, truth : Path
        Folders to write into

    Raises
    ------
    InputError
        If the truth is to lie among the recordings, or files of another case would be lost.
    """
    if recordings.resolve() in (truth.resolve(), *truth.resolve().parents):
        raise InputError(f"{truth}: the truth must not lie among the recordings in {recordings}; name another folder")
    with atomic_folder(recordings) as stage, atomic_folder(truth) as truth_stage:
        yield stage, truth_stage
        for made, output in ((stage, recordings), (truth_stage, truth)):
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
    definition: str | None = None,
) -> None:
    """Write the recordings into a folder and the truth into a file outside it.

    Parameters
    ----------
    folder : Path
        Gets ``<recording>.csv.gz`` and, if anything is stated of the sensors, ``mapping.toml``
    truth_file : Path or None
        Outside `folder`; see :func:`staged_folders`. None: the truth is not written
    recordings : mapping of name to columns
    stated : mapping of key to float, or None
        Data sheet of every temperature sensor, by the keys of a mapping file; it may be wrong
    definition : str or None
        Text of ``gearbox.toml``, if the folder gets one

    Raises
    ------
    InputError
        If something cannot be written.
    """
    # Neither name nor time go into the archive, so that the same case gives the same bytes.
    files = {
        f"{name}.csv.gz": gzip.compress(_csv(columns), compresslevel=6, mtime=0) for name, columns in recordings.items()
    }
    if stated is not None:
        files[MAPPING] = _mapping(recordings, stated).encode()
    if definition is not None:
        files[DEFINITION] = definition.encode()
    write_files(folder, files, truth_file, truth)


def write_files(folder: Path, files: Mapping[str, bytes], truth_file: Path | None, truth: Mapping[str, Any]) -> None:
    """Write files of a case, by name, into a folder and the truth into a file outside it; as :func:`write_case`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
        if truth_file is not None:
            truth_file.parent.mkdir(parents=True, exist_ok=True)
            truth_file.write_bytes((json.dumps(truth, indent=1, sort_keys=True, allow_nan=False) + "\n").encode())
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be written ({error.strerror}); choose another output") from error


def _mapping(recordings: Mapping[str, Mapping[str, Array]], stated: Mapping[str, float]) -> str:
    columns = next(iter(recordings.values()))
    sensors = [name for name in columns if name.startswith("T_") and name.removesuffix("_degC") not in OF_AIR]
    lines = ["# from the data sheet of the temperature sensors", "schema = 1"]
    for name in sensors:
        lines += ["", f"[columns.{name}]", f'quantity = "{name.removesuffix("_degC")}"', 'unit = "degC"']
        lines += [f"{key} = {value!r}" for key, value in stated.items()]
    return "\n".join(lines) + "\n"


def _csv(columns: Mapping[str, Array]) -> bytes:
    """Columns as text with the decimals of their instruments; a missing reading is an empty field."""
    texts = [_texts(values, DECIMALS.get(name, 1)) for name, values in columns.items()]
    lines = [",".join(columns), *map(",".join, zip(*texts, strict=True))]
    return ("\n".join(lines) + "\n").encode()


def _texts(values: Array, decimals: int) -> list[str]:
    return ["" if missing else f"{value:.{decimals}f}" for value, missing in zip(values, np.isnan(values), strict=True)]
