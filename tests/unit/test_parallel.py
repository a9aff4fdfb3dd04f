"""Work over processes: the same results in the same order, however it is tied together."""

from __future__ import annotations

import os

import pytest
from joblib import delayed
from joblib.externals.loky import get_reusable_executor

from diagnosis.parallel import spread, starting


def _worked(number: int) -> tuple[int, int]:
    return number**2, os.getpid()


@pytest.mark.parametrize(("jobs", "bundles"), [(1, 0), (1, 3), (2, 0), (2, 1), (2, 3), (2, 50)])
def test_results_come_in_order(jobs: int, bundles: int) -> None:
    found = spread(jobs, [delayed(_worked)(number) for number in range(7)], bundles=bundles)
    assert [result for result, _ in found] == [number**2 for number in range(7)]
    elsewhere = {process for _, process in found} - {os.getpid()}
    assert bool(elsewhere) == (jobs > 1)


def test_one_call_alone_stays_here() -> None:
    assert spread(2, [delayed(_worked)(3)]) == [(9, os.getpid())]
    assert spread(2, []) == []


def test_processes_that_were_started_are_those_that_work() -> None:
    get_reusable_executor().shutdown(wait=True)  # those of other tests may be ended any time, for their memory
    with starting(2):
        pass
    before = {process for _, process in spread(2, [delayed(_worked)(number) for number in range(8)])}
    with starting(2):
        pass
    after = {process for _, process in spread(2, [delayed(_worked)(number) for number in range(8)])}
    assert len(before | after) <= 2


def test_what_fails_meanwhile_is_told() -> None:
    with pytest.raises(ArithmeticError, match="no solution"), starting(2):
        raise ArithmeticError("no solution")
