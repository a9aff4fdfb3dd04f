"""Nested tables and lists of a definition: single values by path, and with one value exchanged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from models.definition.values_with_source import join


def leaves_of(values: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every single value of nested tables and lists with its dotted path."""
    if isinstance(values, Mapping):
        for key, item in values.items():
            yield from leaves_of(item, join(path, key))
    elif isinstance(values, tuple):
        for index, item in enumerate(values):
            yield from leaves_of(item, join(path, index))
    else:
        yield path, values


def with_value(values: Any, keys: Sequence[str], new: Any) -> Any:
    """Return nested tables and lists with one value exchanged, or with one more key in an existing table.

    Raises
    ------
    LookupError
        If there is no such place.
    """
    if not keys:
        return new
    key, *below = keys
    if isinstance(values, Mapping) and (key in values or not below):
        return {**values, key: with_value(values.get(key), below, new)}
    if isinstance(values, tuple) and key.isdecimal() and int(key) < len(values):
        index = int(key)
        return (*values[:index], with_value(values[index], below, new), *values[index + 1 :])
    raise LookupError(key)


def plain(value: Any) -> Any:
    """Return a value as a TOML reader gives it: numpy scalars as numbers, arrays and lists as tuples."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    return tuple(plain(item) for item in value) if isinstance(value, list | tuple) else value
