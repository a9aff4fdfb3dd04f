"""A family of plants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from diagnosis.proof.zoo.structure import ZooPlant
from models.assembly.gearbox import Gearbox


@dataclass(frozen=True, kw_only=True)
class PlantFamily:
    """Plants of one kind.

    Attributes
    ----------
    machines : tuple of str
        Nominal definitions of the package that it can be drawn for
    draw : Callable
        Gearbox and random numbers to a :class:`ZooPlant`; InputError where the definition cannot be split
    """

    name: str
    description: str
    machines: tuple[str, ...]
    draw: Callable[[Gearbox, np.random.Generator], ZooPlant]
