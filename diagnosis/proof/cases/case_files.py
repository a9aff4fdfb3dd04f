"""Files of a case: recordings as CSV.gz, and the truth as JSON in another folder."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
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


@dataclass(frozen=True, kw_only=True)
class CaseFiles:
    """A case as it is written.

    Attributes
    ----------
    files : mapping of name to bytes
        Of its folder
    truth : mapping
        Ready for JSON; it goes into ``<case>.json`` outside the folder
    """

    name: str
    files: Mapping[str, bytes]
    truth: Mapping[str, Any]


def files_of_recordings(
    recordings: Mapping[str, Mapping[str, Array]], stated: Mapping[str, float] | None
) -> dict[str, bytes]:
    """Files of simulated recordings by name: ``<recording>.csv.gz`` and, if sensors have one, their data sheet.

    Parameters
    ----------
    recordings : mapping of name to columns
    stated : mapping of key to float, or None
        Data sheet of every temperature sensor, by the keys of a mapping file; it may be wrong
    """
    # Neither name nor time go into the archive, so that the same case gives the same bytes.
    files = {
        f"{name}.csv.gz": gzip.compress(_csv(columns), compresslevel=6, mtime=0) for name, columns in recordings.items()
    }
    return files if stated is None else {**files, MAPPING: _mapping(recordings, stated).encode()}


def write_case(case: CaseFiles, folder: Path, truth: Path | None) -> None:
    """Write the files of a case into its folder and then the truth, if there is one, into a folder of truths.

    Raises
    ------
    InputError
        If something cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in case.files.items():
            (folder / name).write_bytes(content)
        if truth is not None:
            truth.mkdir(parents=True, exist_ok=True)
            text = json.dumps(case.truth, indent=1, sort_keys=True, allow_nan=False) + "\n"
            (truth / f"{case.name}.json").write_bytes(text.encode())
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be written ({error.strerror}); choose another output") from error


def write_cases(cases: Iterable[CaseFiles], recordings: Path, truth: Path, *, flat: bool = False) -> list[str]:
    """Write cases as they are made, each into a folder of its name, and return their names.

    Parameters
    ----------
    recordings, truth : Path
        Two folders; see :func:`staged_folders`
    flat : bool
        True to write the files of a single case straight into `recordings`
    """
    names = []
    for case in cases:
        write_case(case, recordings if flat else recordings / case.name, truth)
        names.append(case.name)
    return names


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
    pairs = zip(np.round(values, decimals), np.isnan(values), strict=True)
    return ["" if missing else f"{value:.{decimals}f}" for value, missing in pairs]
