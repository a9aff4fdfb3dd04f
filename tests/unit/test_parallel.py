"""Work over processes: the same results in the same order, however it is tied together."""

from __future__ import annotations

import os
import warnings
from uuid import uuid4

import pytest
from joblib import delayed
from joblib.externals.loky import get_reusable_executor

from diagnosis import parallel
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


class _Shared:
    """Something that tells how often it travelled."""

    def __init__(self) -> None:
        self.arrived = "never"

    def __setstate__(self, state: dict[str, str]) -> None:
        self.__dict__.update(state)
        self.arrived = uuid4().hex


def _arrived(shared: _Shared) -> str:
    return shared.arrived


@pytest.mark.parametrize("bundles", [0, 2])
def test_what_a_bundle_has_in_common_travels_once(bundles: int) -> None:
    shared = _Shared()
    arrivals = set(spread(2, [delayed(_arrived)(shared) for _ in range(24)], bundles=bundles))
    assert len(arrivals) == (bundles or 24)


@pytest.mark.parametrize(("text", "shown"), [("A worker stopped while some jobs were given to the executor.", False),
                                             ("something else", True)])  # fmt: skip
def test_only_the_warning_of_a_replaced_process_is_kept_quiet(
    monkeypatch: pytest.MonkeyPatch, text: str, shown: bool
) -> None:
    class Stub:
        def __init__(self, **_: object) -> None:
            pass

        def __call__(self, work: list[object]) -> list[int]:
            warnings.warn(text, UserWarning, stacklevel=1)
            return list(range(len(work)))

    monkeypatch.setattr(parallel, "Parallel", Stub)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert spread(2, [delayed(_worked)(number) for number in range(3)]) == [0, 1, 2]
    assert bool(caught) is shown
