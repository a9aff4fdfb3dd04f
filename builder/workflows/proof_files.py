"""Files of scores: ``proof.json``, ``proof.md`` and the reliability diagram."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl

from diagnosis.proof.scoring.outcome import tables_of
from models.base.atomic_write import atomic_folder

NUMBERS, PAGE, PICTURE = "proof.json", "proof.md", "reliability.png"


def write_scores(result: Mapping[str, Any], output: Path) -> list[Path]:
    """Write numbers, tables and diagram of scores into a folder.

    Parameters
    ----------
    result : mapping
        See :func:`diagnosis.proof.scoring.outcome.outcome`
    output : Path

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    with atomic_folder(output) as stage:
        (stage / NUMBERS).write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        (stage / PAGE).write_text(page_of(result), encoding="utf-8", newline="\n")
        draw_reliability(result, stage / PICTURE)
    return [output / name for name in (PAGE, NUMBERS, PICTURE)]


def page_of(result: Mapping[str, Any]) -> str:
    """All tables and the meaning of every rule as Markdown."""
    parts = [f"# Scores on {result['gearbox']}"]
    if result["settings"]:
        s = result["settings"]
        made = f"plant {s['plant']}, seed {s['seed']}, a {result['role_of_seed']} seed"
        parts.append(f"{made if s['plant'] != 'given' else 'Given recordings'}; code `{result['code'][:12]}`.")
    if result["failed"]:
        parts.append(f"{result['failed']} diagnoses ended without an answer; they count as wrong.")
    for title, header, rows in tables_of(result, list(result["cases"])):
        lines = [f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows)]
        parts += [f"## {title}", "\n".join(lines)]
    parts += ["## Rules", "\n".join(f"- **{rule['name']}**: {rule['meaning']}" for rule in result["rules"])]
    return "\n\n".join(parts) + "\n"


def draw_reliability(result: Mapping[str, Any], file: Path) -> None:
    """Draw the share of right names over the stated probability, with exact 95 % limits.

    Parameters
    ----------
    result : mapping
        See :func:`diagnosis.proof.scoring.outcome.outcome`
    file : Path
        PNG
    """
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    bins = [b for b in result["reliability"] if b["of"]]
    x = [b["stated"] for b in bins]
    y = [b["hits"] / b["of"] for b in bins]
    errors = [
        [share - b["low"] for share, b in zip(y, bins, strict=True)],
        [b["high"] - share for share, b in zip(y, bins, strict=True)],
    ]
    figure, axes = plt.subplots(figsize=(4.5, 4.5), layout="constrained")
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1, label="as stated")
    axes.errorbar(x, y, yerr=errors, fmt="o", capsize=3, label="right, with 95 % limits")
    for b, share in zip(bins, y, strict=True):
        axes.annotate(f"{b['hits']}/{b['of']}", (b["stated"], share), xytext=(6, 5), textcoords="offset points", size=8)
    axes.set(xlim=(-0.04, 1.1), ylim=(-0.04, 1.1), xlabel="stated probability", ylabel="share that is right")
    axes.legend(loc="upper left", frameon=False)
    figure.savefig(file, dpi=120)
    plt.close(figure)
