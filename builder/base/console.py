"""Output of the command line: progress on a terminal, tables, and faults of the input as one message."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

# No markup: names of files and gearboxes may hold brackets. In a pipe rich would assume 80 columns and cut the tables.
PIPE_WIDTH = 160
for stream in (sys.stdout, sys.stderr):  # a finished job must not end with what the console's encoding cannot show
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="backslashreplace")
out = Console(soft_wrap=True, highlight=False, markup=False, width=None if sys.stdout.isatty() else PIPE_WIDTH)
err = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)

Report = Callable[[int, int], None]


@contextmanager
def progress_bar(label: str) -> Iterator[Report]:
    """A progress bar on a terminal, nothing in a pipe; gives a function that takes (done, in all)."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as progress:
        task = progress.add_task(label, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


def table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]], *, text_columns: int = 1) -> None:
    """Print a table; the first columns are text, the others numbers."""
    grid = Table(title=title, title_justify="left", title_style="bold", header_style="bold", pad_edge=False, box=None)
    for index, name in enumerate(header):
        grid.add_column(name, justify="left" if index < text_columns else "right", no_wrap=True)
    for row in rows:
        grid.add_row(*row)
    out.print(grid)
    out.print()
