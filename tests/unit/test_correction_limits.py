"""Calibrated values of a correction: within the limits that the fit has, which are those of the FMU's factors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from builder.signals import signal_table
from models.correction import Correction, Estimate, read_correction, write_correction
from models.errors import InputError
from models.gearbox import load_gearbox

RIG = load_gearbox("fzg")
NETWORK = RIG.network()


def calibrated(**values: float) -> Correction:
    found = tuple(Estimate(name=name, value=value, stderr=0.1) for name, value in values.items())
    return Correction(gearbox=RIG.name, gearbox_sha256=RIG.hash, calibration=found)


@pytest.mark.parametrize("value", [111.0, 0.0, -1.0, 0.0499, 20.01])
def test_a_factor_that_no_fit_can_give_is_refused(tmp_path: Path, value: float) -> None:
    path = tmp_path / "correction.toml"
    write_correction(calibrated(mesh=value, churning=1.5), path)
    with pytest.raises(InputError) as caught:
        read_correction(path, NETWORK, made_for=RIG)
    assert str(caught.value) == f"{path}: the correction calibrates 'mesh' to {value:g}; 0.05 to 20 is possible"
    with pytest.raises(InputError, match=r"^the correction calibrates 'mesh' to"):
        calibrated(mesh=value).apply(NETWORK)


def test_all_faults_of_the_calibration_come_at_once(tmp_path: Path) -> None:
    path = tmp_path / "correction.toml"
    write_correction(calibrated(mesh=111.0, mush=1.0, C_oil=0.001), path)
    with pytest.raises(InputError) as caught:
        read_correction(path, NETWORK)
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    assert all(line.startswith(f"{path}: the correction calibrates '") for line in lines)
    assert "did you mean 'mesh'?" in lines[1]


@pytest.mark.parametrize("value", [0.05, 20.0, 20.0 * (1.0 + 1e-12)])
def test_a_fit_may_end_at_its_bounds(value: float) -> None:
    parameters = {p.name: p for p in calibrated(mesh=value).apply(NETWORK).parameters}
    assert parameters["mesh"].start == value


def test_the_limits_are_those_of_the_fmu() -> None:
    """One place tells them, the parameters of the network; a value beyond would widen the FMU's own limits unseen."""
    table = signal_table(RIG)
    for p in NETWORK.parameters:
        signal = table[f"factor.{p.name}"]
        assert (signal.minimum, signal.maximum) == (p.lower, p.upper)


def test_the_limits_go_with_the_definition() -> None:
    """A factor that starts at 3 may end at 60, as the fit of a diagnosis may."""
    other = RIG.with_values({"factors.churning": 3.0})
    made = replace(calibrated(churning=45.0), gearbox_sha256=other.hash)
    parameters = {p.name: p for p in made.network(other).parameters}
    assert parameters["churning"].start == 45.0
    with pytest.raises(InputError, match="0.15 to 60 is possible"):
        replace(calibrated(churning=61.0), gearbox_sha256=other.hash).network(other)
