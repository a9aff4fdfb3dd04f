"""From recordings of a real gearbox to the physics that its model left out."""

from diagnosis.diagnose import diagnose
from diagnosis.result import Diagnosis

__all__ = ["Diagnosis", "diagnose"]
