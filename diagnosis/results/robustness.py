"""Evidence of the scan with other assumptions, and in a healthy machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.results.result_parts import named

SIZES = {0.5: "half as large", 1.0: "as assumed", 2.0: "twice as large"}  # of model error, by factor


@dataclass(frozen=True, kw_only=True)
class ScaledError:
    """Evidence of the scan of all candidates with larger or smaller model error; nothing is fitted for it.

    Attributes
    ----------
    factor : float
        On all amplitudes of model error; 1: as assumed
    log_e_value, threshold : float
        Evidence that something is missing, and what it has to reach, [nat]
    mechanism, place : str
        The candidate ahead
    """

    factor: float
    log_e_value: float
    threshold: float
    mechanism: str
    place: str

    @property
    def size(self) -> str:
        """Size of the model error, in words."""
        return SIZES[self.factor]

    @property
    def ahead(self) -> str:
        """The candidate ahead, or that nothing stands out."""
        return named(self.mechanism, self.place) if self.log_e_value > self.threshold else "nothing"


@dataclass(frozen=True, kw_only=True)
class Repeating:
    """Evidence of the scan of all candidates if the machine differs between sessions by so much.

    Attributes
    ----------
    deviation_in_sd : float
        In standard deviations of the priors
    log_e_value : float
        Evidence that something is missing, [nat]
    mechanism, place : str
        The candidate ahead
    """

    deviation_in_sd: float
    log_e_value: float
    mechanism: str
    place: str


@dataclass(frozen=True, kw_only=True)
class PlaceboEvidence:
    """Evidence of the scan in a baseline, in which nothing can be missing.

    Attributes
    ----------
    session : str
        The one that brings most
    log_e_value : float
        For as many hours as are tested, [nat]
    mechanism, place : str
        The candidate ahead
    """

    session: str
    log_e_value: float
    mechanism: str
    place: str


def repeating_told(supported: Repeating, worse: Repeating) -> str:
    """Sentence on what the scan would say if the machine repeated worse.

    Examples
    --------
    >>> from dataclasses import replace
    >>> one = Repeating(deviation_in_sd=0.05, log_e_value=40.2, mechanism="windage", place="oil")
    >>> repeating_told(one, replace(one, deviation_in_sd=0.1, log_e_value=31.0))
    'Quick scan: 40 nat; 31 nat if sessions differ by 0.1 prior widths instead of 0.05: windage at oil ahead.'
    """
    ahead = ", then ".join(dict.fromkeys(named(one.mechanism, one.place) for one in (supported, worse)))
    return (
        f"Quick scan: {supported.log_e_value:.0f} nat; {worse.log_e_value:.0f} nat if sessions differ by "
        f"{worse.deviation_in_sd:g} prior widths instead of {supported.deviation_in_sd:g}: {ahead} ahead."
    )


def robustness_told(every: Sequence[ScaledError]) -> str:
    """Sentence on the evidence that the scan gives with model error of all sizes.

    Examples
    --------
    >>> from dataclasses import replace
    >>> one = ScaledError(factor=0.5, log_e_value=40.2, threshold=5.0, mechanism="windage", place="oil")
    >>> robustness_told([one, replace(one, factor=2.0, log_e_value=31.0)])
    'Quick scan (before fits) with model error half as large 40 nat, twice as large 31 nat: windage at oil ahead.'
    >>> robustness_told([one, replace(one, factor=2.0, log_e_value=3.0)])
    'Quick scan (before fits) with model error half as large 40 nat (windage at oil), twice as large 3 nat (nothing).'
    """
    ahead = {one.ahead for one in every}
    told = [f"{one.size} {one.log_e_value:.0f} nat{f' ({one.ahead})' if len(ahead) > 1 else ''}" for one in every]
    together = f": {ahead.pop()} ahead" if len(ahead) == 1 else ""
    return f"Quick scan (before fits) with model error {', '.join(told)}{together}."
