"""Structured model error: further unknowns with small prior amplitudes for what a lumped model cannot know.

Stub of the contract: classes, amplitudes and columns are written by one hand, evidence by another.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from diagnosis.engine.fit import Experiment
from diagnosis.engine.point import Column, Point
from models.base.types import Array


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


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelError:
    """The unknowns of model error of one experiment: the same for all its pieces, in one order.

    Attributes
    ----------
    labels, groups : tuple of str
        What every unknown changes, and its group
    """

    labels: tuple[str, ...]
    groups: tuple[str, ...]

    @classmethod
    def of(cls, experiment: Experiment) -> ModelError:
        """Unknowns of a machine with its recordings; features are standardised over the recordings' rows."""
        raise NotImplementedError

    def columns(self, point: Point) -> list[Column]:
        """Change per unit of every unknown, shape (unknowns,)."""
        raise NotImplementedError

    def amplitudes(self, one: ErrorClass) -> Array:
        """Amplitude of every unknown in a class, 0 of those that are absent, shape (unknowns,)."""
        return np.array([one.amplitudes.get(group, 0.0) for group in self.groups])


def error_classes() -> tuple[ErrorClass, ...]:
    """The classes with their priors, as learnt."""
    raise NotImplementedError
