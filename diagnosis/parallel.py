"""Independent pieces of work, over processes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from joblib import Parallel, delayed


def spread(jobs: int, work: Sequence[Any], *, bundles: int = 0) -> list[Any]:
    """Results of ``joblib.delayed`` calls, in order: over processes, or here and now where there is one only.

    Parameters
    ----------
    jobs : int
        Processes
    work : sequence of ``joblib.delayed`` calls
    bundles : int
        Into how many bundles to tie them: what many small calls have in common then travels once per bundle. By default
        each goes alone, as large ones of unequal size should
    """
    if jobs < 2 or len(work) < 2:
        return [function(*given, **named) for function, given, named in work]
    size = -(-len(work) // bundles) if bundles else 1
    with warnings.catch_warnings():
        # A process that has grown, as weeks of rows make it, is replaced between two calls: nothing is lost.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs were given to the executor")
        return list(Parallel(n_jobs=jobs, batch_size=size, pre_dispatch=2 * jobs * size)(work))


@contextmanager
def starting(jobs: int) -> Iterator[None]:
    """Let the processes of :func:`spread` start, which takes seconds, while something else is done."""
    begun = Parallel(n_jobs=jobs, return_as="generator")(delayed(_loaded)() for _ in range(jobs)) if jobs > 1 else ()
    try:
        yield
    finally:
        for _ in begun:
            pass


def _loaded() -> None:
    import_module("diagnosis.search")
