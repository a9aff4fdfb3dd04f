"""The oracle's columns on a small plant: every unknown explains what it causes, and nothing else does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.plant.instruments import Instruments
from diagnosis.proof.zoo.oracle import LOSS, OracleDesign
from diagnosis.proof.zoo.oracle_columns import design_of
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import (
    Body,
    Boundary,
    HeatPath,
    Law,
    Moment,
    Probe,
    Source,
    Variant,
    ZooChange,
    ZooPlant,
)  # fmt: skip
from models.base.types import Array

ROWS = 480


def parameter(name: str, factor: float = 1.0) -> Law:
    return lambda m: factor * m.p[name]


def always(value: float) -> Law:
    return lambda m: np.full(m.hours.shape, value)


def oil_to_wall(m: Moment) -> Array:
    return np.asarray(m.p["film"] * (0.5 + m.inputs["speed"] / 2000.0))


def churning(m: Moment) -> Array:
    return np.asarray(m.p["churning"] * (m.inputs["speed"] / 1000.0) ** 1.5 * np.exp(-0.01 * (m.T["oil"] - 60.0)))


PLANT = ZooPlant(
    family="test", gearbox="fzg", inputs=("speed", "torque", "T_ambient"),
    bodies=(Body(name="oil", capacity=parameter("C", 3000.0), part_of="oil"),
            Body(name="wall", capacity=always(8000.0), part_of="housing"),
            Body(name="gear", capacity=always(1500.0), part_of="pinion")),
    boundaries=(Boundary(name="air", temperature=lambda m: m.inputs["T_ambient"] + m.p["warmer"], part_of="air"),),
    paths=(HeatPath(name="film", ends=("oil", "wall"), conductance=oil_to_wall, part_of="oil-housing"),
           HeatPath(name="shed", ends=("wall", "air"), conductance=parameter("shed"), part_of="housing-air"),
           HeatPath(name="splash", ends=("gear", "oil"), conductance=always(8.0), part_of="pinion-oil")),
    sources=(Source(name="churning", power=churning, spread={"oil": 1.0}, is_loss=True, part_of="churning"),
             Source(name="mesh", power=lambda m: 0.0002 * m.inputs["speed"] * m.inputs["torque"],
                    spread={"gear": 0.9, "oil": 0.1}, is_loss=True, part_of="mesh_sliding")),
    probes=(Probe(channel="oil", mix={"oil": 1.0}, lag_s=20.0),
            Probe(channel="wall", mix={"wall": 0.95, "air": 0.05}, lag_s=20.0)),
    parameters={"C": 1.0, "film": 20.0, "shed": 4.0, "churning": 80.0, "warmer": 0.5},
    spread={"C": 0.1, "film": 0.2, "shed": 0.1, "churning": 0.3}, loss_W=150.0,
)  # fmt: skip


def recording(name: str, seed: int, begins_h: float) -> Programme:
    rng = np.random.default_rng(seed)
    speed = np.repeat(rng.uniform(500.0, 3000.0, ROWS // 60), 60)
    heat = np.zeros(ROWS)
    for k in range(1, ROWS):
        heat[k] = 0.99 * heat[k - 1] + 0.3 * rng.standard_normal()
    return Programme(
        name=name, unrecorded=60, begins_h=begins_h, start=dict.fromkeys(("oil", "wall", "gear"), 30.0),
        inputs={"speed": speed, "torque": np.repeat(rng.uniform(10.0, 90.0, ROWS // 40), 40),
                "T_ambient": np.full(ROWS, 24.0)},
        random_heat={"wall": heat},
    )  # fmt: skip


PROGRAMMES = (recording("train_1", 1, 0.0), recording("train_2", 2, 3.0), recording("hold_1", 3, 6.0))
MEASUREMENT = Instruments(channels=("oil", "wall"), noise_K=0.02, quantum_K=0.01, loss_noise=(0.01, 1.0))


@pytest.fixture(scope="module")
def design() -> OracleDesign:
    return design_of(PLANT, PROGRAMMES, MEASUREMENT)


def apart(variant: Variant, from_one: Variant | None = None, **start: float) -> list[Mapping[str, Array]]:
    """Readings of a variant minus those of the plant, by training recording."""
    found: list[Mapping[str, Array]] = []
    for programme in PROGRAMMES[:2]:
        warmer = replace(programme, start={name: T + start.get(name, 0.0) for name, T in programme.start.items()})
        a, b = simulate(PLANT, warmer, [variant]), simulate(PLANT, programme, [from_one or Variant()])
        found.append({name: a.readings[name][0] - b.readings[name][0] for name in a.readings}
                     | {LOSS: a.P_loss[0] - b.P_loss[0]})  # fmt: skip
    return found


@pytest.mark.parametrize("name", PLANT.spread)
def test_a_parameter_one_sd_off_is_worth_half_a_nat_at_most(design: OracleDesign, name: str) -> None:
    step = 0.02  # of an sd, where the response is linear
    value = PLANT.parameters[name]
    x = apart(Variant(parameters={name: value * (1.0 + step * PLANT.spread[name])}))
    whole = [{channel: values / step for channel, values in one.items()} for one in x]
    nats = design.nats_of(whole)
    assert 0.1 < nats.plant < 0.505  # half a nat, and the curvature of the response
    assert nats.tool <= nats.plant


@pytest.mark.parametrize(
    "change",
    [
        ZooChange(kind="source", target="mesh", law=always(0.02)),
        ZooChange(kind="path", target="splash", law=lambda m: 0.1 * (m.inputs["speed"] - 1500.0) / 1500.0),
        ZooChange(kind="capacity", target="gear", law=always(0.05)),
        ZooChange(kind="input", target="T_ambient", law=always(0.3)),
    ],
)
def test_model_error_of_a_tool_explains_what_it_causes(design: OracleDesign, change: ZooChange) -> None:
    nats = design.nats_of(apart(Variant(changes=(change,))))
    assert nats.tool < 0.6
    assert nats.plant > 2.0 * nats.tool


def test_a_sensor_that_is_off_by_its_tolerance(design: OracleDesign) -> None:
    rows = ROWS - 60
    nats = design.nats_of([{"oil": np.full(rows, 1.0)}, {"oil": np.full(rows, 1.0)}])
    assert nats.tool < 50.0  # ten standard deviations
    assert nats.plant > 5.0 * nats.tool


def test_start_temperatures_and_random_heat_are_no_evidence(design: OracleDesign) -> None:
    assert design.nats_of(apart(Variant(), oil=0.5, wall=0.5, gear=0.5)).plant < 0.75
    heat_of_its_own = design.nats_of(apart(Variant(), Variant(quiet=True))).plant
    unexplained = replace(PROGRAMMES[0], random_heat={}), replace(PROGRAMMES[1], random_heat={})
    without = design_of(PLANT, unexplained, MEASUREMENT).nats_of(apart(Variant(), Variant(quiet=True))).plant
    assert heat_of_its_own < 0.5 * without


def test_a_change_at_a_date_is_evidence_for_both(design: OracleDesign) -> None:
    step = ZooChange(kind="path", target="shed", law=lambda m: np.where(m.hours > 0.5, -0.5, 0.0))
    nats = design.nats_of(apart(Variant(changes=(step,))))
    assert nats.plant > nats.tool > 10.0
