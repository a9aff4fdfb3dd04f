"""The plant of the own kind as a zoo plant: the same run, and evidence that knows its faults."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.proof.plant.cycles import Programme, reference_torque, top_speed
from diagnosis.proof.plant.effect import Concealed
from diagnosis.proof.plant.instruments import SENSOR_EFFECTS, Instruments, default_channels
from diagnosis.proof.plant.plant import Plant
from diagnosis.proof.plant.plant_run import Individual, PlantRun, run_plant
from diagnosis.proof.zoo.own_kind import as_programme, as_zoo, design_of_own_kind, effect_on_readings
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Variant
from models.assembly.gearbox import Gearbox

ROWS = 240


@pytest.fixture(scope="module")
def plant(fzg: Gearbox) -> Plant:
    return Plant(fzg)


@pytest.fixture(scope="module")
def run(plant: Plant, fzg: Gearbox) -> PlantRun:
    n, M = top_speed(fzg), reference_torque(fzg)
    speed = np.concatenate([np.full(120, 0.4 * n), np.full(120, 0.7 * n)])
    inputs = {
        "speed": speed,
        "torque": np.full(ROWS, M),
        "T_ambient": np.full(ROWS, 25.0),
        "air_speed": np.full(ROWS, 2.0),
    }
    start = dict.fromkeys(plant.anatomy.nodes, 40.0)
    programme = Programme(name="train_1", inputs=inputs, start=start, unrecorded=30)
    who = Individual(factors=dict(fzg.factors) | {"mesh": 1.1, "C_oil": 0.9}, reading=1, oil_exponent=0.02)
    return PlantRun(individual=who, programme=programme)


@pytest.fixture(scope="module")
def instruments(plant: Plant) -> Instruments:
    channels = default_channels(plant)
    return Instruments(channels=channels, lag_s=dict.fromkeys(channels, 1e-3))


def test_the_run_is_the_same(plant: Plant, run: PlantRun, instruments: Instruments) -> None:
    outcome = run_plant(plant, [run])[0]
    at_once = replace(instruments, lag_s=dict.fromkeys(instruments.channels, 0.0))
    zoo = simulate(as_zoo(plant, run.individual, at_once), as_programme(plant, run), [Variant()])
    for channel in instruments.channels:
        own = outcome.T[:, plant.anatomy.coarse.index(channel)]
        np.testing.assert_allclose(zoo.readings[channel][0], own, atol=1e-9)


@pytest.mark.slow
def test_a_bias_counts_and_a_torque_within_its_tolerance_does_not(
    plant: Plant, run: PlantRun, instruments: Instruments
) -> None:
    design = design_of_own_kind(plant, run.individual, [run], instruments)

    def nats(name: str, place: str, a: float) -> float:
        fault = Concealed(effect=SENSOR_EFFECTS[name], places=(place,), parameters={"a": a}, strength=1.0)
        return design.nats_of(effect_on_readings(plant, [run], instruments, [fault])).tool

    assert nats("sensor_bias", "oil", 0.1) < 0.5
    assert nats("sensor_bias", "oil", 4.0) > 10.0 * nats("sensor_bias", "oil", 1.0) > 0.0
    assert 0.0 < nats("torque_gain", "torque", 0.01) < 0.5


def test_a_wrong_recorded_input_counts_as_what_it_would_cause(
    plant: Plant, run: PlantRun, instruments: Instruments
) -> None:
    kind = SENSOR_EFFECTS["ambient_probe_offset"]
    fault = Concealed(effect=kind, places=("T_ambient",), parameters={"a": 2.0}, strength=1.0)
    x = effect_on_readings(plant, [run], instruments, [fault])[0]
    inputs = run.programme.inputs
    warmer = replace(run.programme, inputs={**inputs, "T_ambient": inputs["T_ambient"] + 2.0})
    true, recorded = run_plant(plant, [run, replace(run, programme=warmer)])
    oil = plant.anatomy.coarse.index("oil")
    np.testing.assert_allclose(x["oil"], true.T[:, oil] - recorded.T[:, oil], atol=1e-6)
