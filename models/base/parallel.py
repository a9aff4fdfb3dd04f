"""Independent pieces of work: in processes of this machine, or on a Dask cluster. Nothing else knows joblib or Dask."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, TypeVar

from joblib import Parallel, cpu_count, delayed, parallel_config
from threadpoolctl import threadpool_limits

from models.base.errors import InputError

CONNECT_S = 10.0  # that a scheduler may need to answer
R = TypeVar("R")


def run_parallel(
    function: Callable[..., R], items: Iterable[Sequence[Any]], *, jobs: int | None = 1, dask: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[R]:  # fmt: skip
    """Results of ``function(*item)`` for every item, in order.

    Parameters
    ----------
    function : callable
        Can be pickled. It runs with one BLAS thread per process, so that the numbers do not depend on `jobs`
    items : iterable of sequences
        Arguments of one call each
    jobs : int or None
        Processes on this machine, None for one per core. With one, or with a single item, everything runs in this
        process
    dask : str, optional
        Address of a Dask scheduler (``"tcp://host:8786"``) that does the work instead
    progress : callable, optional
        Told how many of how many results there are

    Raises
    ------
    InputError
        If Dask is not installed or the scheduler does not answer.

    Examples
    --------
    >>> run_parallel(pow, [(2, 3), (3, 2)])
    [8, 9]
    """
    items = list(items)
    calls = (delayed(_numbered)(function, *numbered) for numbered in enumerate(items))
    found: dict[int, R] = {}
    with _backend(dask), warnings.catch_warnings():
        # joblib replaces a worker whose memory has grown between two calls; no result is lost.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs were given to the executor")
        for index, result in _pool(jobs if len(items) > 1 else 1, dask)(calls):
            found[index] = result
            if progress is not None:
                progress(len(found), len(items))
    return [found[index] for index in range(len(items))]


def _numbered(function: Callable[..., R], index: int, item: Sequence[Any]) -> tuple[int, R]:
    return index, _call(function, item)


def iterate_parallel(
    function: Callable[..., R], items: Iterable[Sequence[Any]], *, jobs: int | None = 1, dask: str | None = None
) -> Iterator[R]:
    """Results of ``function(*item)`` in the order in which they are completed; items are taken as they are needed.

    Parameters, errors as those of :func:`run_parallel`.

    Examples
    --------
    >>> sorted(iterate_parallel(pow, [(2, 3), (3, 2)]))
    [8, 9]
    """
    with _backend(dask):
        yield from _pool(jobs, dask)(delayed(_call)(function, item) for item in items)


@contextmanager
def one_thread() -> Iterator[None]:
    """Context, or decorator, with one BLAS thread as in the processes of :func:`run_parallel`: numbers depend on it."""
    with threadpool_limits(1):
        yield


def _call(function: Callable[..., R], item: Sequence[Any]) -> R:
    with one_thread():
        return function(*item)


def _pool(jobs: int | None, dask: str | None) -> Parallel:
    """Every item is sent alone, which suits few large ones of unequal size. One job is done in this process."""
    processes = None if dask is not None else cpu_count() if jobs is None else jobs
    return Parallel(n_jobs=processes, batch_size=1, return_as="generator_unordered")


def _backend(dask: str | None) -> AbstractContextManager[None]:
    return nullcontext() if dask is None else _dask_cluster(dask)


@contextmanager
def _dask_cluster(address: str) -> Iterator[None]:
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("a dask address is given but dask is not installed; install the extra 'dask'") from error
    try:
        client = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError) as error:  # a TimeoutError is an OSError
        raise InputError(
            f"no dask scheduler answers at {address} ({error}); is it running, is the port open?"
        ) from error
    with client, parallel_config(backend="dask", client=client):
        yield
