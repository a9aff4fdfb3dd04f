"""Diagnoses of short recordings of the rig that a seed makes: verdict, name, place, and strength within two errors.

They hold for any way to reach the decision; a test of its branches would not.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from diagnosis import diagnose
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale
from tests.golden.recordings import record


@dataclass(frozen=True)
class Outcome:
    """What is concealed, and what must be found."""

    seed: int
    hours: float
    verdict: str
    found: tuple[str, str] | None = None  # mechanism and node
    strength: float = 0.0
    bias_K: float = 0.0  # of the upper housing's sensor


OUTCOMES = {
    "consistent": Outcome(seed=4, hours=4.0, verdict="consistent"),
    "sensor bias": Outcome(
        seed=3, hours=4.0, verdict="sensor_fault", found=("sensor_bias", "housing_upper"), strength=3.0, bias_K=3.0
    ),
    "windage": Outcome(seed=6, hours=4.0, verdict="missing_physics", found=("windage", "oil"), strength=60.0),
    "ten minutes": Outcome(seed=5, hours=0.2, verdict="insufficient_data"),
}


@pytest.mark.parametrize("name", OUTCOMES)
def test_outcome(name: str, fzg: Gearbox, tmp_path: Path) -> None:
    case = OUTCOMES[name]
    network, values = fzg.network(), {"mesh": 0.9, "h_air": 1.15, "bearing": 1.2, "C_oil": 1.08}
    if case.found and case.found[0] in CATALOGUE and not case.bias_K:
        term = CATALOGUE[case.found[0]].placed(network, Scale.of(fzg, speed=2600.0, torque=150.0))[0]
        network, values = term.apply(network), values | {term.strength.name: case.strength}
    path = record(
        network, fzg, tmp_path / "run.csv", seed=case.seed, hours=case.hours, bias=case.bias_K, parameters=values
    )
    found = diagnose(path, fzg, jobs=1)
    assert found.verdict == case.verdict
    assert [(f.mechanism, f.node) for f in found.findings] == ([case.found] if case.found else [])
    for finding in found.findings:
        assert finding.probability > 0.9
        strength = finding.parameters[0]
        assert abs(strength.value - case.strength) < 2.0 * strength.stderr
