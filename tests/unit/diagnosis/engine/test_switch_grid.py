"""Numbers of a switch, looked for by scans of a grid."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.refit import with_candidate
from diagnosis.engine.switch_grid import refined, switch_numbers, with_refined_switches
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Placed, Scale
from tests.unit.diagnosis.inference_example import acting

TRUE = {"strength": 25.0, "set_point": 43.0, "band": 4.0, "coolant": 27.0, "delay": 15.0}


@pytest.fixture(scope="module")
def cooler(fzg: Gearbox, experiment: Experiment) -> Placed:
    return CATALOGUE["cooler_thermostat"].placed(
        experiment.machine.model.network, Scale.of(fzg, speed=2600.0, torque=150.0)
    )[0]


@pytest.fixture(scope="module")
def without(experiment: Experiment, cooler: Placed) -> Fit:
    """The machine calibrated without its cooler."""
    return calibrate(acting(experiment, cooler, TRUE))


def distance(one: Hypothesis) -> tuple[float, float]:
    """Of set-point and band from the true ones, [K]."""
    return abs(float(one.variants[0, 1]) - TRUE["set_point"]), abs(float(one.variants[0, 2]) - TRUE["band"])


def test_what_switches_by_numbers_that_are_not_exact(cooler: Placed, experiment: Experiment, fzg: Gearbox) -> None:
    assert [cooler.parameters[i].name for i in switch_numbers(cooler)] == [
        "cooler_thermostat_oil_set_point", "cooler_thermostat_oil_band"]  # fmt: skip
    (tank,) = CATALOGUE["oil_tank"].placed(experiment.machine.model.network, Scale.of(fzg))
    assert switch_numbers(tank) == []


def test_numbers_of_a_switch_are_found_between_the_grid(without: Fit, cooler: Placed) -> None:
    coarse = hypothesis_of(cooler)
    near = np.abs(coarse.variants[:, 1] - TRUE["set_point"]) + np.abs(coarse.variants[:, 2] - TRUE["band"])
    found, strength = refined(without, coarse, [int(np.argmin(near))])
    assert len(found.variants) == 1 and strength > 10.0
    assert max(distance(found)) < 1.0 < 10.0 < near.min()


def test_a_fit_that_ended_beside_them_is_continued_there(without: Fit, cooler: Placed) -> None:
    one = hypothesis_of(cooler)
    row = np.array([[1.0, TRUE["set_point"] + 1.0, 1.3 * TRUE["band"], TRUE["coolant"], TRUE["delay"]]])
    experiment, z = with_candidate(without, Hypothesis(**{**one.__dict__, "variants": row}), 0)
    z[0] = experiment.unknowns[len(without.z)].z_of(TRUE["strength"])
    beside = experiment.fit(np.concatenate([without.z, z]), without.trajectories)
    further = with_refined_switches(beside, one, len(without.z))
    assert further.objective < beside.objective - 10.0
