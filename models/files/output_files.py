"""Files that the verbs write: refusal to replace what is read, tables of results."""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.files.paths import is_folder, kind_of

if TYPE_CHECKING:
    import pandas as pd

DECIMALS = 6  # of results: a millionth of a kelvin or a watt; of columns below 1, as many significant digits


def refuse_to_replace(inputs: Iterable[Path], outputs: Iterable[Path]) -> None:
    """Refuse, before any work, to write over what is read or over a folder; links to a file count as the file.

    Raises
    ------
    InputError
        All such outputs.
    """
    read = list(inputs)
    faults = []
    for out in outputs:
        if is_folder(out):
            faults.append(f"{out}: is a folder; name a file")
        elif any(_same_file(path, out) for path in read):
            faults.append(f"{out}: is read as well and would be replaced; choose another output")
    if faults:
        raise InputError("\n".join(faults))


def _same_file(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except (OSError, ValueError):  # one of them is not there
        return False


def write_table(path: Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns as CSV, CSV.gz or Parquet by the file's ending.

    Raises
    ------
    InputError
        If the ending is another one or the folder cannot be written to.
    """
    kind = kind_of(path)
    import pandas as pd

    table = pd.DataFrame(dict(columns))
    with atomic_file(path) as partial:
        if kind == ".parquet":
            try:
                table.to_parquet(partial)
            except ImportError as error:
                raise InputError(f"{path}: writing Parquet needs pyarrow; python -m pip install pyarrow") from error
        else:
            text = table.round({name: _decimals(table[name]) for name in table}).to_csv(
                index=False, lineterminator="\n"
            )
            # Neither name nor time go into the archive, so that the same table gives the same bytes.
            partial.write_bytes(gzip.compress(text.encode(), mtime=0) if kind == ".csv.gz" else text.encode())


def _decimals(values: pd.Series[Any]) -> int:
    """Decimals of a column by its largest number: a flow in m3/s needs more than a temperature."""
    if values.dtype.kind != "f":
        return DECIMALS
    largest = float(np.abs(values[np.isfinite(values)]).max()) if np.isfinite(values).any() else 0.0
    return DECIMALS - (math.floor(math.log10(largest)) + 1 if 0.0 < largest < 1.0 else 0)
