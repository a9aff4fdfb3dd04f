"""Notebooks that CI's build of the site leaves out because they take minutes: executed as a reader would."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from docs.conf import LONG_NOTEBOOKS

NOTEBOOKS = Path(__file__).parents[3] / "docs" / "notebooks"


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG_NOTEBOOKS)
def test_a_long_notebook_runs_and_its_assertions_hold(name: str) -> None:
    command = [sys.executable, "-m", "jupyter", "execute", "--timeout=600", f"{name}.ipynb"]
    done = subprocess.run(command, cwd=NOTEBOOKS, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
