"""Work over processes and on a cluster: the same results in the same order."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from models.base.errors import InputError
from models.base.parallel import iterate_parallel, one_thread, run_parallel


def _worked(number: int, exponent: int) -> tuple[int, int]:
    return number**exponent, os.getpid()


ITEMS = [(number, 2) for number in range(7)]


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, protocol="tcp", dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


@pytest.mark.parametrize("jobs", [1, 2, None])
def test_results_come_in_order(jobs: int | None) -> None:
    found = run_parallel(_worked, ITEMS, jobs=jobs)
    assert [result for result, _ in found] == [number**2 for number in range(7)]
    if jobs is not None:
        assert (os.getpid() not in {process for _, process in found}) == (jobs > 1)


@pytest.mark.slow
def test_a_cluster_does_the_work(scheduler: str) -> None:
    found = run_parallel(_worked, ITEMS, dask=scheduler)
    assert [result for result, _ in found] == [number**2 for number in range(7)]
    assert os.getpid() not in {process for _, process in found}
    assert sorted(result for result, _ in iterate_parallel(_worked, ITEMS, dask=scheduler)) == sorted(
        number**2 for number in range(7)
    )


def test_one_item_and_none_need_no_process() -> None:
    assert run_parallel(_worked, [(3, 2)], jobs=2) == [(9, os.getpid())]
    assert run_parallel(_worked, [], jobs=2) == []


def test_results_come_as_they_are_completed_and_items_as_they_are_needed() -> None:
    taken = []

    def items() -> Iterator[tuple[int, int]]:
        for item in ITEMS:
            taken.append(item)
            yield item

    results = iterate_parallel(_worked, items(), jobs=1)
    next(results)
    assert len(taken) < len(ITEMS)
    assert sorted(result for result, _ in results) == [number**2 for number in range(1, 7)]


def test_a_failure_arrives() -> None:
    with pytest.raises(ZeroDivisionError):
        run_parallel(divmod, [(1, 1), (1, 0)], jobs=2)


def _threads() -> int:
    import numpy  # noqa: F401, ICN001 - its BLAS is counted

    return max((pool["num_threads"] for pool in threadpool_info()), default=1)


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_call_has_one_blas_thread(jobs: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    with threadpool_limits(2):
        assert run_parallel(_threads, [(), ()], jobs=jobs) == [1, 1]
    assert one_thread()(_threads)() == 1


def test_a_scheduler_that_does_not_answer_and_a_missing_dask_are_input_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    monkeypatch.setattr("models.base.parallel.CONNECT_S", 0.3)
    with pytest.raises(InputError, match=r"no dask scheduler answers at tcp://127.0.0.1:1 .*port open"):
        run_parallel(abs, [(1,)], dask="tcp://127.0.0.1:1")
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(InputError, match="install the extra 'dask'"):
        run_parallel(abs, [(1,)], dask="tcp://127.0.0.1:1")
