"""What a report consists of: items of the paper, each with the paper's statements checked, tables and figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from builder.reproduce.figure import Figure


class Verdict(StrEnum):
    """What came out for a statement or an item."""

    REPRODUCED = "reproduced"
    DIFFERS = "differs"
    SILENT = "cannot be compared"
    SCHEME = "scheme"
    OURS = "not in the paper"
    MET = "target met"
    MISSED = "target not met"


@dataclass(frozen=True, kw_only=True)
class Check:
    """One statement of the paper against our numbers.

    Attributes
    ----------
    name : str
        Name of the check, e.g. ``sliding_dominates_at_high_torque``
    statement : str
        What the paper says or prints
    found : str
        Our numbers in words
    verdict : Verdict
    why : str
        Why it differs, or cannot be compared
    numbers : mapping of str to float
        What the verdict was made from
    """

    name: str
    statement: str
    found: str
    verdict: Verdict
    why: str = ""
    numbers: Mapping[str, float] = field(default_factory=dict)


def judged(
    name: str, statement: str, found: str, holds: bool, *, numbers: Mapping[str, float], otherwise: str
) -> Check:
    """A check that came to a result; `otherwise` says why where it does not hold."""
    verdict = Verdict.REPRODUCED if holds else Verdict.DIFFERS
    plain = {key: float(value) for key, value in numbers.items()}
    return Check(
        name=name, statement=statement, found=found, verdict=verdict, why="" if holds else otherwise, numbers=plain
    )


def target(name: str, statement: str, found: str, met: bool, *, numbers: Mapping[str, float], otherwise: str) -> Check:
    """A target of our own that the paper does not have; it leaves the item's verdict alone."""
    verdict = Verdict.MET if met else Verdict.MISSED
    plain = {key: float(value) for key, value in numbers.items()}
    return Check(
        name=name, statement=statement, found=found, verdict=verdict, why="" if met else otherwise, numbers=plain
    )


def silent(
    name: str, statement: str, why: str, *, found: str = "", numbers: Mapping[str, float] | None = None
) -> Check:
    """A statement that nothing can be held against."""
    return Check(name=name, statement=statement, found=found, verdict=Verdict.SILENT, why=why, numbers=numbers or {})


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; the first column is text, and numbers follow unless all columns are `texts`."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    texts: bool = False


@dataclass(frozen=True, kw_only=True)
class Item:
    """A table, figure or statement of the paper.

    Attributes
    ----------
    key : str
        As the paper calls it: ``Table 1``, ``Figs. 6-8``
    title : str
    reading : str
        How it was recomputed: what was taken where the paper leaves something open
    checks, tables, figures : tuple
    without_checks : Verdict
        The verdict where nothing is stated: a scheme, or an item of our own
    """

    key: str
    title: str
    reading: str
    checks: tuple[Check, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    without_checks: Verdict = Verdict.SILENT

    @property
    def verdict(self) -> Verdict:
        """One statement that differs makes the item differ; one that holds, where none differs, reproduces it."""
        verdicts = {check.verdict for check in self.checks}
        for verdict in (Verdict.DIFFERS, Verdict.REPRODUCED, Verdict.SILENT):
            if verdict in verdicts:
                return verdict
        return self.without_checks

    @property
    def why(self) -> str:
        """Why it differs, or why it cannot be compared; else how many statements hold."""
        told = " ".join(dict.fromkeys(c.why for c in self.checks if c.verdict == self.verdict and c.why))
        if told or not self.checks:
            return told
        count = Counter(check.verdict for check in self.checks)
        return ", ".join(f"{number} {verdict.value}" for verdict, number in count.items())

    @property
    def anchor(self) -> str:
        """Name of its place in the page."""
        return "".join(c if c.isalnum() else "-" for c in self.key.lower()).strip("-")
