"""A machine as calibrated, in the form of a correction."""

from __future__ import annotations

from dataclasses import dataclass

from diagnosis.results.result_parts import Calibrated
from models.correction.instruments import InputCorrection, SensorCorrection


@dataclass(frozen=True, kw_only=True)
class CalibratedModel:
    """Parameters, sensors and inputs of a fit.

    Attributes
    ----------
    calibration : tuple of Calibrated
    sensors : tuple of SensorCorrection
        How its sensors differ from the machine
    true_inputs : tuple of InputCorrection
        What it took the inputs to be
    """

    calibration: tuple[Calibrated, ...] = ()
    sensors: tuple[SensorCorrection, ...] = ()
    true_inputs: tuple[InputCorrection, ...] = ()
