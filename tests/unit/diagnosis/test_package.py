"""When the parts of the package are loaded."""

from __future__ import annotations

import subprocess
import sys


def test_reading_does_not_load_the_inference() -> None:
    code = (
        "import sys; from diagnosis.recordings.read import read_recordings; import diagnosis;"
        "print(*sorted(m for m in sys.modules if m.startswith('diagnosis.') or m in ('joblib', 'sympy', 'sklearn')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert all(name.startswith("diagnosis.recordings") for name in done.stdout.split()), done.stdout
