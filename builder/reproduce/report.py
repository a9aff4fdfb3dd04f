"""Items of the paper with their checks, tables and figures, and the report that shows them."""

from __future__ import annotations

import base64
import io
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import resources
from pathlib import Path
from typing import Any

import matplotlib as mpl
from jinja2 import Environment, StrictUndefined

from builder.reproduce.figure import Figure
from builder.reproduce.printed import PAPER
from builder.reproduce.study import Study
from models.base.progress import Progress
from models.columns.curves import STYLE
from models.files.output_files import write_table

PAGE, NUMBERS, SUMMARY, FIGURES = "report.html", "report.json", "summary.md", "figures"
DPI = 150


class Verdict(StrEnum):
    """Outcome of a check or an item."""

    REPRODUCED = "reproduced"
    DIFFERS = "differs"
    SILENT = "cannot be compared"
    SCHEME = "scheme"
    OURS = "not in the paper"
    MET = "target met"
    MISSED = "target not met"


@dataclass(frozen=True)
class Check:
    """One statement of the paper against our numbers.

    Attributes
    ----------
    name : str
    statement : str
        Of the paper; of a target, ours
    found : str
        Our numbers in words
    holds : bool or None
        None if there is nothing to compare with
    numbers : mapping of str to float
        Those that the verdict depends on
    otherwise : str
        Why it does not hold, or cannot be compared
    target : bool
        True for a target of our own, which leaves the verdict of the item alone
    """

    name: str
    statement: str
    found: str
    holds: bool | None
    numbers: Mapping[str, float] = field(default_factory=dict)
    otherwise: str = ""
    target: bool = False

    @property
    def verdict(self) -> Verdict:
        """The outcome."""
        if self.holds is None:
            return Verdict.SILENT
        if self.target:
            return Verdict.MET if self.holds else Verdict.MISSED
        return Verdict.REPRODUCED if self.holds else Verdict.DIFFERS

    @property
    def why(self) -> str:
        """Why it does not hold, or cannot be compared."""
        return "" if self.holds else self.otherwise


@dataclass(frozen=True)
class Table:
    """A table; the first column is text, and numbers follow unless all columns are `texts`."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    texts: bool = False


@dataclass(frozen=True)
class Item:
    """A table, figure or section of the paper.

    Attributes
    ----------
    key, title : str
    unchecked : Verdict
        Verdict of an item without checks
    readings : tuple of str
        How it was recomputed: what was assumed where the paper leaves something open
    checks, tables, figures : tuple
    """

    key: str
    title: str
    unchecked: Verdict
    readings: tuple[str, ...] = ()
    checks: tuple[Check, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """Differs if one check does; reproduced if one holds and none differs."""
        verdicts = {check.verdict for check in self.checks}
        order = (Verdict.DIFFERS, Verdict.REPRODUCED, Verdict.SILENT)
        return next((verdict for verdict in order if verdict in verdicts), self.unchecked)

    @property
    def why(self) -> str:
        """Why it differs, or cannot be compared; otherwise the number of checks per verdict."""
        reasons = dict.fromkeys(c.why for c in self.checks if c.verdict == self.verdict and c.why)
        count = Counter(check.verdict for check in self.checks)
        return " ".join(reasons) or ", ".join(f"{number} {verdict}" for verdict, number in count.items())

    @property
    def anchor(self) -> str:
        """Name of its place in the page."""
        return "".join(c if c.isalnum() else "-" for c in self.key.lower()).strip("-")


Part = str | Check | Table | Figure
Recompute = Callable[[Study], Item]


def item(key: str, title: str, *, unchecked: Verdict = Verdict.SILENT) -> Callable[[Callable[..., Any]], Recompute]:
    """Decorate a generator of readings, checks, tables and figures: it becomes a function that returns the `Item`."""

    def decorate(function: Callable[[Study], Iterator[Part]]) -> Recompute:
        def recompute(study: Study) -> Item:
            study.progress(f"{key}: {title}")
            parts = list(function(study))
            readings, checks, tables, figures = (
                tuple(part for part in parts if isinstance(part, kind)) for kind in (str, Check, Table, Figure)
            )
            return Item(key, title, unchecked, readings, checks, tables, figures)  # type: ignore[arg-type]

        return recompute

    return decorate


@dataclass(frozen=True)
class Report:
    """All items in the order of the paper, and with what they were made."""

    items: Sequence[Item]
    provenance: Mapping[str, str]

    @property
    def count(self) -> Counter[Verdict]:
        """Number of items per verdict."""
        return Counter(item.verdict for item in self.items)

    def as_dict(self) -> dict[str, Any]:
        """Verdicts, statements and numbers, for JSON."""
        return {
            "provenance": dict(self.provenance),
            "verdicts": {verdict.value: number for verdict, number in self.count.items()},
            "items": [
                {
                    "key": item.key,
                    "title": item.title,
                    "verdict": item.verdict.value,
                    "why": item.why,
                    "checks": [
                        {
                            "name": check.name,
                            "statement": check.statement,
                            "found": check.found,
                            "verdict": check.verdict.value,
                            "why": check.why,
                            "numbers": {name: float(value) for name, value in check.numbers.items()},
                        }
                        for check in item.checks
                    ],
                    "figures": [figure.name for figure in item.figures],
                }
                for item in self.items
            ],
        }

    def summary(self) -> str:
        """Verdicts and times as Markdown tables."""
        timing = next(table for item in self.items if item.key == "Speed" for table in item.tables)
        lines = ["| item | what | verdict |", "|---|---|---|"]
        lines += [f"| {item.key} | {item.title} | {item.verdict} |" for item in self.items]
        lines += ["", f"| {timing.title} | {' | '.join(timing.header[1:])} |"]
        lines += ["|---|" + "---:|" * (len(timing.header) - 1)]
        lines += [f"| {' | '.join(row)} |" for row in timing.rows]
        return "\n".join(lines) + "\n"

    def write(self, folder: Path, progress: Progress) -> None:
        """Write ``report.html``, ``report.json``, ``summary.md`` and ``figures/*.png, *.csv`` into a folder."""
        (folder / FIGURES).mkdir(parents=True, exist_ok=True)
        images = {}
        for figure in (figure for item in self.items for figure in item.figures):
            progress(f"drawing {figure.name}")
            images[figure.name] = _draw(figure, folder / FIGURES)
        numbers = json.dumps(self.as_dict(), indent=2, ensure_ascii=False)
        (folder / NUMBERS).write_text(numbers + "\n", encoding="utf-8")
        (folder / SUMMARY).write_text(self.summary(), encoding="utf-8")
        environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
        source = (resources.files("builder.reproduce") / "report.html.j2").read_text(encoding="utf-8")
        page = environment.from_string(source).render(paper=PAPER, report=self, images=images, folder=FIGURES)
        (folder / PAGE).write_text(page, encoding="utf-8")


def _draw(figure: Figure, folder: Path) -> str:
    """Write the PNG and the CSV of a figure; the SVG is returned as an address that holds the whole picture."""
    write_table(folder / f"{figure.name}.csv", dict(figure.rows().items()))  # type: ignore[arg-type]
    canvas, svg = figure.draw(), io.BytesIO()
    with mpl.rc_context(STYLE):
        canvas.savefig(folder / f"{figure.name}.png", dpi=DPI, metadata={"Software": None})
        canvas.set_layout_engine("none")  # the arrangement of the PNG
        canvas.savefig(svg, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(svg.getvalue()).decode()
