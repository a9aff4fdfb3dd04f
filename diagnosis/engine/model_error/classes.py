"""Classes of model error: which groups act, with which amplitudes, and how probable each class is beforehand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from models.files.toml_file import parse_schema_1, read_text

FILE = "learnt.toml"


@dataclass(frozen=True, kw_only=True)
class ErrorClass:
    """A class of model error.

    Attributes
    ----------
    name : str
    prior : float
    amplitudes : mapping of group to float
        Prior standard deviations of the groups' unknowns; groups that are not named are absent
    """

    name: str
    prior: float
    amplitudes: Mapping[str, float]


@cache
def error_classes() -> tuple[ErrorClass, ...]:
    """The classes with their priors, from ``diagnosis/engine/learnt.toml``."""
    document = parse_schema_1(read_text(files("diagnosis.engine") / FILE), file=FILE, kind="classes of model error")
    return tuple(ErrorClass(name=one["name"], prior=one["prior"], amplitudes=one["amplitudes"])
                 for one in document["class"])  # fmt: skip
