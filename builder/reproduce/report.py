"""All items in one report: a page that needs nothing else, figures as PNG and CSV, and the numbers as JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from builder.files import write_table
from builder.reproduce import render_html
from builder.reproduce.figure import Figure
from builder.reproduce.item import Item, Verdict
from builder.reproduce.render_png import write_png

PAGE, NUMBERS, SUMMARY, FIGURES = "report.html", "report.json", "summary.md", "figures"
PAPER = (
    "A Data-Driven Approach to Estimate the Power Loss and Thermal Behaviour of Cylindrical Gearboxes under Transient "
    "Operating Conditions"
)


@dataclass(frozen=True, kw_only=True)
class Report:
    """What was reproduced.

    Attributes
    ----------
    items : tuple of Item
        In the order of the paper
    provenance : tuple of (str, str)
        What it was made with
    """

    items: tuple[Item, ...]
    provenance: tuple[tuple[str, str], ...]

    @property
    def count(self) -> Counter[Verdict]:
        """How many items there are of each verdict."""
        return Counter(item.verdict for item in self.items)

    def as_dict(self) -> dict[str, Any]:
        """Verdicts, statements, and the numbers they were made from."""
        return {
            "provenance": dict(self.provenance),
            "verdicts": {verdict.value: number for verdict, number in self.count.items()},
            "items": [
                {
                    "key": item.key,
                    "title": item.title,
                    "verdict": item.verdict.value,
                    "why": item.why,
                    "checks": [asdict(check) for check in item.checks],
                    "figures": [figure.name for figure in item.figures],
                }
                for item in self.items
            ],
        }


def write_report(report: Report, folder: Path, progress: Callable[[str], None]) -> None:
    """Write ``report.html``, ``report.json``, ``summary.md`` and ``figures/*.png, *.csv`` into a folder."""
    (folder / FIGURES).mkdir(parents=True, exist_ok=True)
    for item in report.items:
        for figure in item.figures:
            progress(f"drawing {figure.name}")
            write_png(figure, folder / FIGURES / f"{figure.name}.png")
            write_table(folder / FIGURES / f"{figure.name}.csv", figure.rows())  # type: ignore[arg-type]
    (folder / NUMBERS).write_text(json.dumps(report.as_dict(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    (folder / SUMMARY).write_text(summary(report), encoding="utf-8")
    (folder / PAGE).write_text(page(report), encoding="utf-8")


def summary(report: Report) -> str:
    """Return the verdicts and the times as Markdown tables."""
    timing = next(table for item in report.items if item.key == "Speed" for table in item.tables)
    lines = ["| item | what | verdict |", "|---|---|---|"]
    lines += [f"| {item.key} | {item.title} | {item.verdict.value} |" for item in report.items]
    lines += ["", f"| {timing.title} | {' | '.join(timing.header[1:])} |", "|---|" + "---:|" * (len(timing.header) - 1)]
    lines += [f"| {' | '.join(row)} |" for row in timing.rows]
    return "\n".join(lines) + "\n"


def page(report: Report) -> str:
    """Return the report as one HTML page."""
    figures = [figure for item in report.items for figure in item.figures]
    drawings = _json({figure.name: render_html.drawings(figure) for figure in figures})
    source = (resources.files("builder.reproduce") / "report.html.j2").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(source).render(
        paper=PAPER,
        report=report,
        Verdict=Verdict,
        plotly=Markup(get_plotlyjs()),  # noqa: S704 - the library itself
        drawings=Markup(drawings),  # noqa: S704 - escaped by _json
        legends={figure.name: render_html.legend(figure) for figure in figures},
        folder=FIGURES,
        arrangement=_arrangement,
    )


def _arrangement(figure: Figure) -> str:
    """How the panels stand on a wide screen: so that no row is left with one."""
    return {1: "one", 2: "pairs", 4: "pairs"}.get(len(figure.panels), "threes")


def _json(value: object) -> str:
    """JSON that can stand inside a script element."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def verdict_rows(items: Sequence[Item]) -> list[list[str]]:
    """Rows of the summary that a terminal shows."""
    return [[item.key, item.title, item.verdict.value] for item in items]
