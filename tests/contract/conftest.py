"""An FMU of every kind for the contract that all of them keep."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from tests.contract.fmu_host import hosted

Illegal = Callable[[], AbstractContextManager[object]]


@pytest.fixture(params=["python", "native"])
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def path(kind: str, request: pytest.FixtureRequest) -> Path:
    found: Path = request.getfixturevalue({"python": "fzg_fmu", "native": "fzg_native"}[kind])
    return found


@pytest.fixture
def illegal(kind: str) -> Illegal:
    """Around a call that must be refused: with fmi2Error; by pythonfmu, which cannot say it, with a message alone."""
    return nullcontext if kind == "python" else partial(pytest.raises, FMICallException, match=r"\(error\)")


@pytest.fixture
def host(path: Path):
    with hosted(path) as running:
        yield running
