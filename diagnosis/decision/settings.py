"""Numbers of a diagnosis that its user decides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from models.base.errors import InputError

LIMITS: Mapping[str, tuple[float, float]] = {
    "false_alarm_rate": (1e-4, 0.5), "matters_K": (0.01, 100.0), "matters_W": (0.0, 1e9), "claim_from": (0.5, 0.999),
    "odds_unknown": (0.001, 10.0),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Numbers that a user sets.

    Attributes
    ----------
    false_alarm_rate : float
        How often a healthy machine may be called inconsistent, [-]
    matters_K, matters_W : float
        Size from which an effect matters: of a temperature [K], or of a heat [W]; 0 W: by temperatures alone
    claim_from : float
        Probability from which a name is a claim, [-]
    odds_unknown : float
        Prior odds that a cause is in no catalogue, to one that is in it, [-]

    Raises
    ------
    InputError
        If a number is outside :data:`LIMITS`.
    """

    false_alarm_rate: float = 0.02
    claim_from: float = 0.9
    matters_K: float = 1.0
    matters_W: float = 0.0
    odds_unknown: float = 0.1

    def __post_init__(self) -> None:
        for name, (low, high) in LIMITS.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"{name} = {value:g} is not possible; {low:g} to {high:g} is")
