"""Diagnoses of short recordings of the rig that a seed makes: verdict, name, place, and strength within two errors.

They hold for any way to reach the decision; a test of its branches would not.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from diagnosis.diagnose_recordings import diagnose
from models.assembly.gearbox import Gearbox
from tests.golden.recordings import record


@dataclass(frozen=True)
class Outcome:
    """What is concealed, and what must be found."""

    seed: int
    hours: float
    verdict: str
    found: tuple[str, str] | None = None  # mechanism and node
    bias_K: float = 0.0  # of the upper housing's sensor


OUTCOMES = {
    "consistent": Outcome(seed=4, hours=4.0, verdict="consistent"),
    "sensor bias": Outcome(
        seed=3, hours=4.0, verdict="sensor_fault", found=("sensor_bias", "housing_upper"), bias_K=3.0
    ),
    "ten minutes": Outcome(seed=5, hours=0.2, verdict="insufficient_data"),
}


# Those that take a minute are slow: the fleet of tests/integration has a sound machine and a biased sensor too.
@pytest.mark.parametrize(
    "name", ["ten minutes", *(pytest.param(name, marks=pytest.mark.slow) for name in ("consistent", "sensor bias"))]
)
def test_outcome(name: str, fzg: Gearbox, tmp_path: Path) -> None:
    case = OUTCOMES[name]
    values = {"mesh": 0.9, "h_air": 1.15, "bearing": 1.2, "C_oil": 1.08}
    file = tmp_path / "run.csv"
    path = record(fzg.network(), fzg, file, seed=case.seed, hours=case.hours, bias=case.bias_K, parameters=values)
    found = diagnose(path, fzg)
    assert found.verdict == case.verdict
    assert [(f.mechanism, f.node) for f in found.findings] == ([case.found] if case.found else [])
    for finding in found.findings:
        assert finding.probability > 0.9
        strength = finding.parameters[0]
        assert abs(strength.value - case.bias_K) < 2.0 * strength.stderr
