"""Values with provenance: a number written as ``{ value = 950.0, sd = 190.0, source = "Table 5" }``.

Separates a parsed TOML document into plain values (for validation), the sources of its tables and leaves, and the
standard deviations of its numbers, both by dotted path (``stage.0.roughness_Ra_um.1``).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from models.base.errors import did_you_mean

PERCENT = re.compile(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*%\s*")
LEAF_KEYS = ("value", "sd", "source")


@dataclass(frozen=True)
class Annotations:
    """Sources and standard deviations of the values of a file, by dotted path.

    Attributes
    ----------
    sources : dict
        Source of every table or value that names one; ``""`` is the path of the file itself
    priors : dict
        Standard deviation of every single number that has one
    faults : list of (path, message)
        Annotations that cannot be used
    """

    sources: dict[str, str] = field(default_factory=dict)
    priors: dict[str, float] = field(default_factory=dict)
    faults: list[tuple[str, str]] = field(default_factory=list)

    def source_of(self, path: str) -> str:
        """Return the source of a value: its own, else that of the nearest table around it that names one."""
        while path and path not in self.sources:
            path = path.rpartition(".")[0]
        return self.sources.get(path, "")


def join(path: str, key: object) -> str:
    """Return the dotted path of a key below another path.

    Examples
    --------
    >>> join("stage.0", "z"), join("", "oil")
    ('stage.0.z', 'oil')
    """
    return f"{path}.{key}" if path else str(key)


def strip(node: Any, notes: Annotations, path: str = "") -> Any:
    """Return a parsed document (lists as tuples) as plain values, and add their annotations to `notes`.

    Examples
    --------
    >>> notes = Annotations()
    >>> strip({"source": "report 7", "seal": ({"diameter_mm": {"value": 24.0, "sd": "5 %"}},)}, notes)
    {'seal': ({'diameter_mm': 24.0},)}
    >>> notes.priors, notes.source_of("seal.0.diameter_mm")
    ({'seal.0.diameter_mm': 1.2}, 'report 7')
    """
    if isinstance(node, tuple):
        return tuple(strip(item, notes, join(path, index)) for index, item in enumerate(node))
    if not isinstance(node, dict):
        return node
    if "source" in node:
        if isinstance(node["source"], str) and node["source"].strip():
            notes.sources[path] = node["source"]
        else:
            notes.faults.append((join(path, "source"), "must be a text that names where the value comes from"))
    if "value" in node and path:
        return _leaf(node, notes, path)
    if "sd" in node:
        notes.faults.append((join(path, "sd"), "has no value next to it"))
    return {key: strip(item, notes, join(path, key)) for key, item in node.items() if key not in ("source", "sd")}


def _leaf(node: Mapping[str, Any], notes: Annotations, path: str) -> Any:
    for key in node:
        if key not in LEAF_KEYS:
            notes.faults.append((path, f"'{key}' is not a known key{did_you_mean(key, LEAF_KEYS)}"))
    value = strip(node["value"], notes, path)
    if "sd" in node:
        _read_sd(node["sd"], value, notes, path)
    return value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _read_sd(sd: Any, value: Any, notes: Annotations, path: str) -> None:
    """Record the standard deviation(s) of a number or of every number in a list; 0 in a list means exactly known."""
    if isinstance(value, tuple):
        each = sd if isinstance(sd, tuple) else [sd] * len(value)
        if len(each) != len(value):
            notes.faults.append((path, f"has {len(value)} values but {len(each)} sd"))
            return
        for index, (item_sd, item) in enumerate(zip(each, value, strict=True)):
            if isinstance(sd, tuple) and item_sd == 0:
                continue
            _read_sd(item_sd, item, notes, join(path, index))
        return
    if not _is_number(value):
        notes.faults.append((path, "only a number can have an sd"))
        return
    percent = PERCENT.fullmatch(sd) if isinstance(sd, str) else None
    try:
        size = float(percent[1]) * abs(value) / 100.0 if percent else float(sd) if _is_number(sd) else -1.0
    except OverflowError:
        size = -1.0
    if 0.0 < size < float("inf"):
        notes.priors[path] = size
    else:
        notes.faults.append((path, "sd must be a number above 0 or a text such as '20 %' (of a value that is not 0)"))
