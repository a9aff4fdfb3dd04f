"""Output of the command line: tables, and faults of the input as one message."""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

# No markup: names of files and gearboxes may hold brackets. In a pipe rich would assume 80 columns and cut the tables.
PIPE_WIDTH = 160
for stream in (sys.stdout, sys.stderr):  # a finished job must not end with what the console's encoding cannot show
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="backslashreplace")
out = Console(soft_wrap=True, highlight=False, markup=False, width=None if sys.stdout.isatty() else PIPE_WIDTH)
err = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)


def table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]], *, text_columns: int = 1) -> None:
    """Print a table; the first columns are text, which is folded where the width ends, the others numbers."""
    grid = Table(title=title, title_justify="left", title_style="bold", header_style="bold", pad_edge=False, box=None)
    for index, name in enumerate(header):
        grid.add_column(name, justify="left" if index < text_columns else "right", no_wrap=index >= text_columns)
    for row in rows:
        grid.add_row(*row)
    out.print(grid)
    out.print()
