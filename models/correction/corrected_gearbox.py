"""A gearbox with physics that its definition lacks: a cooler that is known, or what an earlier diagnosis found."""

from __future__ import annotations

from dataclasses import dataclass

from models.assembly.gearbox import Gearbox
from models.correction.correction import Correction
from models.simulation.thermal_network import ThermalNetwork


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedGearbox(Gearbox):
    """A definition together with a correction; :func:`corrected_gearbox` makes one.

    Attributes
    ----------
    correction : Correction
    """

    correction: Correction

    def network(self) -> ThermalNetwork:
        """Return the corrected network."""
        return self.correction.apply(super().network())


def corrected_gearbox(gearbox: Gearbox, correction: Correction) -> CorrectedGearbox:
    """Return a gearbox whose network holds the physics and calibrated values of a correction, nothing of a recorder.

    Raises
    ------
    InputError
        If the correction was made for another definition, or cannot be applied to its network.

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> from models.correction.correction import Estimate
    >>> fzg = load_gearbox("fzg")
    >>> known = Correction.of(fzg, calibration=[Estimate(name="h_air", value=2.0, stderr=0.1)])
    >>> steady = [one.steady_state(speed=1500.0, torque=94.0) for one in (fzg, corrected_gearbox(fzg, known))]
    >>> [round(one.temperatures["oil"], 1) for one in steady]
    [63.6, 48.6]
    """
    correction.check_made_for(gearbox)
    found = CorrectedGearbox(gearbox.definition, gearbox.notes, gearbox.given, gearbox.file, correction)
    found.network()
    return found
