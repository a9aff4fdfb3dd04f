"""The type of a concealed case, and its plan."""

from __future__ import annotations

from dataclasses import dataclass

from diagnosis.proof.plant.effect import Concealed
from diagnosis.proof.plant.instruments import SENSOR_EFFECTS, Instruments
from diagnosis.proof.plant.plant_run import Individual, PlantRun

FAULTS = tuple(SENSOR_EFFECTS)
CONTROLS = ("clean", "parameters_off", "parameter_far", "noise_misstated", "lag_wrong")


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Group and effects of a case, before anything is drawn.

    Attributes
    ----------
    group : str
        ``control``, ``single``, ``double``, ``sensor``, ``outside`` or ``messy``
    kind : str
        One of :data:`CONTROLS` for a control, else ``effects``
    effects : tuple of str
        Names, the dominant one first
    strength : float or None
        Strength of the first effect relative to its nominal one; drawn if None
    """

    group: str
    kind: str = "effects"
    effects: tuple[str, ...] = ()
    strength: float | None = None


@dataclass(frozen=True, kw_only=True)
class ConcealedCase:
    """A drawn case: the gearbox, its five programmes, the concealed effects and the instruments."""

    name: str
    plan: Plan
    seed: tuple[int, ...]
    individual: Individual
    effects: tuple[Concealed, ...]
    instruments: Instruments
    runs: tuple[PlantRun, ...]

    @property
    def physics(self) -> tuple[Concealed, ...]:
        """Effects that act in the plant."""
        return tuple(effect for effect in self.effects if not effect.is_fault)

    @property
    def faults(self) -> tuple[Concealed, ...]:
        """Effects that act in the measurement."""
        return tuple(effect for effect in self.effects if effect.is_fault)
