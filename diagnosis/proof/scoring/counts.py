"""Counts of cases and medians of errors, with their confidence limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest, quantile_test

CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class Count:
    """Number of hits among a number of cases."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        """Share of hits; NaN without cases."""
        return self.hits / self.of if self.of else math.nan

    @property
    def limits(self) -> tuple[float, float]:
        """Wilson's 95 % confidence limits of the share; 0 and 1 without cases.

        Examples
        --------
        >>> low, high = Count(hits=57, of=60).limits
        >>> round(low, 3), round(high, 3)
        (0.863, 0.983)
        """
        if not self.of:
            return 0.0, 1.0
        interval = binomtest(self.hits, self.of).proportion_ci(CONFIDENCE, method="wilson")
        return float(interval.low), float(interval.high)

    @classmethod
    def over(cls, verdicts: Sequence[bool | None]) -> Count:
        """Count the True values; None is left out."""
        counted = [v for v in verdicts if v is not None]
        return cls(hits=sum(counted), of=len(counted))

    def as_dict(self) -> dict[str, Any]:
        """Fields for JSON."""
        low, high = self.limits
        return {"hits": self.hits, "of": self.of, "low": round(low, 4), "high": round(high, 4)}


@dataclass(frozen=True, kw_only=True)
class Median:
    """Median with its 95 % confidence limits; NaN if there are too few numbers."""

    value: float
    low: float
    high: float
    of: int

    @classmethod
    def over(cls, values: Sequence[float]) -> Median:
        """Median of the finite values."""
        good = np.array([v for v in values if math.isfinite(v)])
        if not len(good):
            return cls(value=math.nan, low=math.nan, high=math.nan, of=0)
        # As an array: the stubs of SciPy take the interval for a number.
        low, high = np.asarray(quantile_test(good, p=0.5).confidence_interval(CONFIDENCE))
        return cls(value=float(np.median(good)), low=float(low), high=float(high), of=len(good))

    def as_dict(self) -> dict[str, Any]:
        """Fields for JSON."""
        shown = {"median": self.value, "low": self.low, "high": self.high}
        return {"of": self.of, **{k: round(v, 4) if math.isfinite(v) else None for k, v in shown.items()}}
