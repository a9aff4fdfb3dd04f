"""Numbers of a diagnosis that its user decides."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The four numbers that a user sets.

    Attributes
    ----------
    false_alarm_rate : float
        How often a healthy machine may be called inconsistent, [-]
    matters_K, matters_W : float
        Size from which an effect matters: of a temperature [K], or of a heat [W]; 0 W: 3 % of the typical loss
    claim_from : float
        Probability from which a name is a claim, [-]
    odds_unknown : float
        Prior odds that a cause is in no catalogue, to one that is in it, [-]
    """

    false_alarm_rate: float = 0.02
    matters_K: float = 1.0
    matters_W: float = 0.0
    claim_from: float = 0.9
    odds_unknown: float = 0.1
