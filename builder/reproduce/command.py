"""The verb ``reproduce``."""

from __future__ import annotations

import time
from pathlib import Path

import click

from builder.base import console
from builder.base.options import example, jobs_option
from builder.base.progress import LOADING, progress


@click.command("reproduce", epilog=example("reproduce --output out/paper"))
@click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/paper"),
    show_default=True,
    metavar="DIR",
    help="Folder for the report, its figures and the FMU.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0, max=2**32 - 1),
    default=0,
    show_default=True,
    metavar="N",
    help="Seed of samples and starts.",
)
@jobs_option()
def reproduce(output: Path, seed: int, jobs: int) -> None:
    """Recompute every table and figure of the paper.

    One report compares ours with the print.
    """
    with progress(LOADING):
        from builder.reproduce.report import FIGURES, NUMBERS, PAGE, SUMMARY  # imports matplotlib, scikit-learn, onnx
        from builder.reproduce.reproduce import reproduce as run
        from builder.reproduce.study import StudySettings

    begin = time.perf_counter()
    with progress("starting") as told:
        report = run(output, settings=StudySettings(seed=seed, jobs=jobs), progress=told)
    rows = [(item.key, item.title, item.verdict.value) for item in report.items]
    console.table("The paper, reproduced", ["item", "what", "verdict"], rows, text_columns=3)
    counted = ", ".join(f"{number} {verdict.value}" for verdict, number in report.count.items())
    console.out.print(f"{len(report.items)} items: {counted}; {time.perf_counter() - begin:.0f} s")
    for name in (PAGE, NUMBERS, SUMMARY, f"{FIGURES}/", "fzg.fmu"):
        console.out.print(f"wrote {output / name}")
