"""Names of the package, and when its parts are loaded."""

from __future__ import annotations

import subprocess
import sys

import pytest

import diagnosis


def test_reading_does_not_load_the_inference() -> None:
    code = (
        "import sys; from diagnosis.recordings.read import read_recordings; import diagnosis;"
        "print(*sorted(m for m in sys.modules if m.startswith('diagnosis.') or m in ('joblib', 'sympy', 'sklearn')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert all(name.startswith("diagnosis.recordings") for name in done.stdout.split()), done.stdout


def test_diagnose_is_a_function_whatever_is_imported_first() -> None:
    code = "import diagnosis.diagnose_recordings; from diagnosis import diagnose, Diagnosis; print(callable(diagnose))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def test_a_wrong_name_of_the_package_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'diagnos'"):
        diagnosis.diagnos  # noqa: B018
