"""Answers of a diagnosis as the scoring reads them from ``diagnosis.json``."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from models.mechanisms import OPEN_FORM

TIE_PROBABILITY = 0.05  # from which a rival belongs to the tie set
SILENT = ("consistent", "insufficient_data", "refused", "failed")
CANNOT_TELL = ("insufficient_data", "refused")
NO_ANSWER = ("refused", "failed")
PARAMETER = "parameter"  # a parameter of the definition outside its prior


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One finding of a diagnosis, with its rivals.

    Attributes
    ----------
    mechanism, place, node, family : str
    odds : mapping of mechanism to float
        Probability of the finding and of its rivals, summed over the places of each mechanism
    parameters : mapping of str to float
        Probability of each parameter outside its prior
    heat_W, heat_sd_W : float
        Mean magnitude of the heat, and its stated standard error
    strength, strength_sd : float
        First parameter of the law, and its stated standard error
    """

    mechanism: str
    place: str
    node: str
    family: str
    odds: Mapping[str, float]
    parameters: Mapping[str, float] = field(default_factory=dict)
    heat_W: float
    heat_sd_W: float = math.nan
    strength: float
    strength_sd: float = math.nan

    @property
    def tied(self) -> frozenset[str]:
        """Tie set: the finding and every rival of at least 5 %."""
        return frozenset({self.mechanism, *(m for m, p in self.odds.items() if p >= TIE_PROBABILITY)})


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Answer of a diagnosis to one case.

    Attributes
    ----------
    verdict : str
        Verdict; ``refused`` if the recordings were not accepted, ``failed`` if the process gave no answer
    claims : tuple of Claim
    node : str
        Most probable place, or ``""``
    holdout_K : (float, float, float)
        Held-out error as delivered, calibrated and with the findings; NaN if unknown
    unseen : frozenset of str
        Mechanisms reported as not detectable in these data
    evidence : mapping of mechanism to float
        Best log Bayes factor over its places in the first scan, [nat]; only mechanisms of the ranking
    """

    verdict: str
    claims: tuple[Claim, ...] = ()
    node: str = ""
    holdout_K: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    unseen: frozenset[str] = frozenset()
    evidence: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, result: Mapping[str, Any] | None, *, otherwise: str = "failed") -> Answer:
        """Read the content of ``diagnosis.json``; None becomes the verdict `otherwise`."""
        if result is None:
            return cls(verdict=otherwise)
        errors = result.get("fit", {}).get("holdout", {})
        values = [errors.get(f"rmse_{stage}_K") for stage in ("before", "calibrated", "after")]
        before, calibrated, after = (math.nan if v is None else float(v) for v in values)
        location = result.get("location", [])
        evidence: dict[str, float] = {}
        for row in result.get("ranking", []):
            evidence[row["mechanism"]] = max(row["log_bayes"], evidence.get(row["mechanism"], -math.inf))
        return cls(
            verdict=result["verdict"],
            claims=tuple(_claim(finding) for finding in result.get("findings", [])),
            node=location[0]["node"] if location else "",
            holdout_K=(before, calibrated, after),
            unseen=frozenset(one["mechanism"] for one in result.get("not_visible", [])),
            evidence=evidence,
        )

    @property
    def silent(self) -> bool:
        """True if no fault is claimed."""
        return self.verdict in SILENT

    @property
    def unnamed(self) -> bool:
        """True if a fault is claimed without a name of the catalogue or a parameter."""
        return not self.silent and not self.known

    @property
    def partly(self) -> bool:
        """True if a name is given and reported not to explain everything."""
        return bool(self.known) and self.verdict == "unexplained"

    @property
    def known(self) -> frozenset[str]:
        """Mechanisms of all claims except open forms."""
        return frozenset(claim.mechanism for claim in self.claims if claim.family != OPEN_FORM)

    @property
    def named(self) -> frozenset[str]:
        """Mechanisms of all claims."""
        return frozenset(claim.mechanism for claim in self.claims)

    @property
    def tied(self) -> frozenset[str]:
        """Union of the tie sets of all claims."""
        return frozenset().union(*(claim.tied for claim in self.claims))


def _claim(finding: Mapping[str, Any]) -> Claim:
    odds: Counter[str] = Counter()
    off: Counter[str] = Counter()
    for one in (finding, *finding.get("confusable_with", [])):
        odds[one["mechanism"]] += one["probability"]
        if one["mechanism"] == PARAMETER:
            off[one["place"]] += one["probability"]
    parameters, heat = finding.get("parameters", []), finding.get("heat_W", {})
    first = parameters[0] if parameters else {}
    return Claim(
        mechanism=finding["mechanism"], place=finding["place"], node=finding["node"], family=finding["family"],
        odds=dict(odds), parameters=dict(off),
        heat_W=heat.get("mean", math.nan), heat_sd_W=heat.get("stderr", math.nan),
        strength=first.get("value", math.nan), strength_sd=first.get("stderr", math.nan),
    )  # fmt: skip
