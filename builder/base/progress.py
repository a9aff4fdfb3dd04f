"""Long work on the command line: a line that changes on a terminal, a line now and then in a pipe or a file."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from builder.base.console import err
from models.base.progress import Progress

# On a terminal nothing is silent for 5 s, and what is done at once does not flicker. In a pipe work within a minute
# says nothing.
TERMINAL_AFTER_S = 1.0
PIPE_AFTER_S, PIPE_EVERY_S = 60.0, 30.0
BAR_WIDTH = 20
LOADING = "loading libraries"
PER_SECOND = 4


class Work:
    """The step that is being done, how much of it, and since when; called as :class:`~models.base.progress.Progress`.

    Attributes
    ----------
    what : str
    done, of : int
    """

    def __init__(self, what: str) -> None:
        self.began = self._counted = self._at = time.monotonic()
        self.what, self.done, self.of, self._first = what, 0, 0, 0

    def __call__(self, what: str, done: int = 0, of: int = 0, /) -> None:
        """Take a step; counts begin again where their sum changes."""
        now = time.monotonic()
        if of != self.of or done < self.done:
            self._counted, self._first = now, done
        self.what, self.done, self.of, self._at = what, done, of, now

    @property
    def left_s(self) -> float | None:
        """Time that the counted step still needs at its pace, [s]; None before something is counted, and overdue."""
        if self.done <= self._first:
            return None
        pace = (self._at - self._counted) / (self.done - self._first)
        left = pace * (self.of - self.done) - (time.monotonic() - self._at)
        return left if left > 0.0 else None

    def __str__(self) -> str:
        count = f": {self.done} of {self.of}" if self.of else ""
        left = "" if self.left_s is None else f", about {duration(self.left_s)} left"
        return f"{self.what}{count}, {duration(time.monotonic() - self.began)}{left}"


def duration(seconds: float) -> str:
    """Return a time as people say it.

    Examples
    --------
    >>> duration(9.6), duration(125), duration(7500)
    ('10 s', '2 min 05 s', '2 h 05 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    return f"{minutes} min {rest:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


@contextmanager
def progress(what: str) -> Iterator[Progress]:
    """Show long work on stderr while the context lasts; gives the function that takes its steps.

    Parameters
    ----------
    what : str
        The first step, in words
    """
    work, ended = Work(what), threading.Event()
    on_terminal = err.is_terminal and not err.is_dumb_terminal
    watch = threading.Thread(target=_watch_terminal if on_terminal else _watch_pipe, args=(work, ended), daemon=True)
    watch.start()
    try:
        yield work
    finally:
        ended.set()
        watch.join()


def _watch_terminal(work: Work, ended: threading.Event) -> None:
    if ended.wait(TERMINAL_AFTER_S):
        return
    spinner = Spinner("dots")

    def line() -> Table:
        grid = Table.grid(padding=(0, 1))
        bar = [ProgressBar(total=work.of, completed=work.done, width=BAR_WIDTH)] if work.of else []
        for _ in bar:
            grid.add_column()
        grid.add_column()
        grid.add_column(no_wrap=True, overflow="ellipsis")
        grid.add_row(spinner, *bar, Text(str(work)))
        return grid

    with Live(get_renderable=line, console=err, transient=True, refresh_per_second=PER_SECOND,
              redirect_stdout=False, redirect_stderr=False):  # fmt: skip
        ended.wait()


def _watch_pipe(work: Work, ended: threading.Event) -> None:
    wait_s = PIPE_AFTER_S
    while not ended.wait(wait_s):
        err.print(str(work))
        wait_s = PIPE_EVERY_S
