"""A native FMU in a host written in C, without Python: as delivered, and under AddressSanitizer, UBSan and TSan."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.contract.native_hosts import (
    SANITIZED,
    THREAD_SANITIZED,
    Unpacked,
    compiled,
    needs_compiler,
    run,
    sanitized,
    unpacked,
)

pytestmark = needs_compiler
CPPCHECK = shutil.which("cppcheck")


@pytest.fixture(scope="module")
def fmu(fzg_native: Path, tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    return unpacked(fzg_native, tmp_path_factory.mktemp("c_host"))


def reference(fmu: Unpacked, folder: Path) -> list[str]:
    """Arguments of ``life.c``: the FMU's own reference run, Booleans left out, and where its columns belong."""
    tables = [pd.read_csv(fmu.folder / f"documentation/reference_{side}.csv") for side in ("in", "out")]
    tables[1] = tables[1][["time", *fmu.named("output")]]
    files = [folder / "in.csv", folder / "out.csv"]
    for table, file in zip(tables, files, strict=True):
        table.to_csv(file, index=False)
    columns = [fmu.references(*table.columns[1:]) for table in tables]
    return [*columns, fmu.references("initial.T"), fmu.references("in_domain"), *map(str, files)]


def test_the_whole_life_as_delivered(fmu: Unpacked, tmp_path: Path) -> None:
    host = compiled("life", fmu, tmp_path / "life")
    assert run([host, *fmu.arguments, *reference(fmu, tmp_path)]) == "done\n"


def test_the_whole_life_under_the_sanitizers(fmu: Unpacked, tmp_path: Path) -> None:
    host = compiled("life", fmu, tmp_path / "life", *SANITIZED)
    library = sanitized(fmu, tmp_path / "sanitized.so")
    arguments = [str(library), *fmu.arguments[1:], *reference(fmu, tmp_path)]
    options = {"ASAN_OPTIONS": "detect_leaks=1:abort_on_error=0", "UBSAN_OPTIONS": "print_stacktrace=1"}
    assert run([host, *arguments], env=os.environ | options) == "done\n"


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="written for Linux")
def test_threads_do_not_race(fmu: Unpacked, tmp_path: Path) -> None:
    host = compiled("threads", fmu, tmp_path / "threads", *THREAD_SANITIZED)
    library = sanitized(fmu, tmp_path / "sanitized.so", THREAD_SANITIZED)
    inputs, outputs, _, _, table, _ = reference(fmu, tmp_path)
    printed = run([host, library, *fmu.arguments[1:], inputs, outputs, table])
    last = pd.read_csv(fmu.folder / "documentation/reference_out.csv")[fmu.named("output")].iloc[-1]
    np.testing.assert_allclose([float(cell) for cell in printed.split(",")], last, rtol=1e-6, atol=1e-6)


@pytest.mark.skipif(CPPCHECK is None, reason="no cppcheck")
@pytest.mark.parametrize("fixture", ["fzg_native", "fzg_native3"])
def test_cppcheck_finds_nothing_in_the_sources(fixture: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    """Hand-written and generated C, with all groups of checks but those of unused functions and missing headers."""
    sources = unpacked(request.getfixturevalue(fixture), tmp_path).folder / "sources"
    options = ["--quiet", "--std=c99", "--enable=warning,style,performance,portability", "--error-exitcode=1", "-I."]
    assert run([CPPCHECK, *options, *sorted(file.name for file in sources.glob("*.c"))], cwd=sources) == ""
