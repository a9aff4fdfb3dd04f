"""The options ``--jobs`` and ``--dask`` of the verbs that spread their work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click
from click.core import ParameterSource

Command = TypeVar("Command", bound=Callable[..., Any])

JOBS_HELP = "Processes on this machine."
DASK_HELP = "Scheduler of a Dask cluster to work on instead, e.g. tcp://host:8786."


def worker_options(*, jobs_help: str = JOBS_HELP, dask_help: str = DASK_HELP) -> Callable[[Command], Command]:
    """Give a command the options ``--jobs`` (int, by default one per core) and ``--dask`` (str or None); one of them.

    Parameters
    ----------
    jobs_help, dask_help : str
    """

    def decorate(command: Command) -> Command:
        dask = click.option("--dask", default=None, metavar="ADDRESS", callback=_without_jobs, help=dask_help)
        return jobs_option(jobs_help)(dask(command))

    return decorate


def jobs_option(help_text: str = JOBS_HELP) -> Callable[[Command], Command]:
    """Give a command the option ``--jobs`` (int, by default one per core)."""
    return click.option(
        "--jobs", type=click.IntRange(min=1), default=_cores, show_default="all cores", metavar="N", is_eager=True,
        help=help_text,
    )  # fmt: skip


def _without_jobs(context: click.Context, _: click.Parameter, address: str | None) -> str | None:
    if address is not None and context.get_parameter_source("jobs") == ParameterSource.COMMANDLINE:
        raise click.UsageError("--jobs and --dask exclude each other: the work is done here or on the cluster", context)
    return address


def _cores() -> int:
    from joblib import cpu_count  # 0.1 s that --help need not wait for

    return int(cpu_count())
