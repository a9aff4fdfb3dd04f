"""The catalogue of physics that a real gearbox may show and the nominal model leaves out."""

from __future__ import annotations

from collections.abc import Mapping

from models.mechanisms import ageing, heat_paths, measurement, oil_circuit, surroundings
from models.mechanisms import power_losses as losses
from models.mechanisms.mechanism import OPEN_FORM, Mechanism, Memory, Placed
from models.mechanisms.scale import Scale
from models.mechanisms.user_files import load_mechanisms

CATALOGUE: Mapping[str, Mechanism] = {
    mechanism.name: mechanism
    for family in (losses, heat_paths, oil_circuit, surroundings, ageing, measurement)
    for mechanism in family.MECHANISMS
}

__all__ = ["CATALOGUE", "OPEN_FORM", "Mechanism", "Memory", "Placed", "Scale", "load_mechanisms"]
