"""The verb ``prove``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from builder.base import console
from builder.base.workers import worker_options

LINES = 20  # of progress where there is no terminal


@click.command("prove")
@click.option("--cases", type=click.IntRange(min=1, max=10_000), default=None, metavar="N",
              help="Number of cases, in the proportions of the whole mix.  [default: the whole mix, 247]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0, max=2**32 - 1), default=None, metavar="N",
              help="Seed of the cases.  [default: 2042, which nobody has opened]")  # fmt: skip
@click.option(
    "--gearbox", default="fzg", show_default=True, metavar="NAME|FILE", help="Name or definition file (TOML)."
)
@click.option("--cells-every", type=click.IntRange(min=0), default=3, show_default=True, metavar="N",
              help="Every N-th case is also diagnosed with fewer sensors and shorter recordings; 0: none.")  # fmt: skip
@worker_options()
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=Path("out/proof"),
              show_default=True, metavar="DIR",
              help="Folder of the proof; an interrupted one is continued.")  # fmt: skip
def prove(
    cases: int | None,
    seed: int | None,
    gearbox: str,
    cells_every: int,
    jobs: int,
    dask: str | None,
    output: Path,
) -> None:
    """Test the diagnosis on sealed cases: hide effects, diagnose blindly, hash the answers, open the truth, score.

    The truth is on no disk while anything is diagnosed. The same command in the same folder continues a proof.
    """
    from builder.workflows.prove import NUMBERS, PAGE
    from builder.workflows.prove import prove as run
    from diagnosis.proof.scoring.protocol import UNOPENED_SEED, WHOLE, Settings

    settings = Settings(seed=UNOPENED_SEED if seed is None else seed, cases=WHOLE if cases is None else cases,
                        gearbox=gearbox, cells_every=cells_every)  # fmt: skip
    with _progress() as progress:
        result = run(settings, output, jobs=jobs, dask=dask, progress=progress)
    show(result)
    for name in (PAGE, NUMBERS):
        console.out.print(f"wrote {output / name}")


def show(result: Mapping[str, Any]) -> None:
    """Print the rules with their counts."""
    rows = []
    for rule in result["rules"]:
        count = rule["count"]
        asked = "" if rule["needed"] is None else f"{'<=' if rule['at_most'] else '>='} {100 * rule['needed']:.0f} %"
        met = {True: "yes", False: "NO", None: ""}[rule["met"]]
        share = f"{100 * count['hits'] / count['of']:.0f} %" if count["of"] else "-"
        limits = f"{100 * count['low']:.0f} to {100 * count['high']:.0f} %" if count["of"] else ""
        rows.append([rule["text"], f"{count['hits']}/{count['of']}", share, limits, asked, met])
    console.table("Proof", ["rule", "cases", "share", "95 % limits", "asked", "met"], rows)
    protocol = result["protocol"]
    if protocol["on_development_seed"]:
        console.out.print(f"Seed {protocol['seed']} was opened while the diagnosis was developed: this is no proof.")
    if protocol["failed"]:
        console.out.print(f"{protocol['failed']} processes failed; the files of their answers contain the message.")


@contextmanager
def _progress() -> Iterator[Callable[[str, int, int], None]]:
    """Progress bar on a terminal, else a line now and then."""
    if console.err.is_terminal:
        with console.progress_bar("starting") as advance:
            yield lambda _, done, of: advance(done, of)
        return
    begin, last = time.perf_counter(), {"": -1}

    def report(what: str, done: int, of: int) -> None:
        part = LINES * done // max(of, 1)
        if last.get(what) != part:
            last[what] = part
            console.err.print(f"{what}: {done} of {of}, {(time.perf_counter() - begin) / 60.0:.0f} min")

    yield report
