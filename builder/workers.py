"""Where a verb's work is done: in processes of this machine, or on a cluster."""

from __future__ import annotations

from models.errors import InputError


def check_workers(jobs: int | None, dask_address: str | None) -> None:
    """Refuse ``--jobs`` together with ``--dask``.

    Raises
    ------
    InputError
    """
    if jobs is not None and dask_address is not None:
        raise InputError("--jobs and --dask exclude each other: the work is done here or on the cluster")


def processes(jobs: int | None) -> int:
    """How many processes ``--jobs`` asks for; by default as many as there are cores."""
    from joblib import cpu_count

    return int(cpu_count()) if jobs is None else jobs
