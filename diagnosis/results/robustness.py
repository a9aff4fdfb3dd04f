"""Evidence of the scan with other assumptions, and in a healthy machine."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.decision.posterior import Repeating, ScaledError
from diagnosis.results.result_parts import named

SIZES = {0.5: "half as large", 1.0: "as assumed", 2.0: "twice as large"}  # of model error, by factor


def size_of(one: ScaledError) -> str:
    """Size of the model error, in words."""
    return SIZES[one.factor]


def ahead_in(one: ScaledError) -> str:
    """The candidate ahead, or that nothing stands out."""
    return named(one.mechanism, one.place) if one.log_e_value > one.threshold else "nothing"


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
    ahead = {ahead_in(one) for one in every}
    told = [
        f"{size_of(one)} {one.log_e_value:.0f} nat{f' ({ahead_in(one)})' if len(ahead) > 1 else ''}" for one in every
    ]
    together = f": {ahead.pop()} ahead" if len(ahead) == 1 else ""
    return f"Quick scan (before fits) with model error {', '.join(told)}{together}."
