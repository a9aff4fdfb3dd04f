"""A recording with known instruments: the model with the correction, read by its sensors, is the recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from diagnosis.forward.recorder import read_as_recorded, simulated_as_recorded, true_inputs, true_start
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.correction.correction import Correction, Finding
from models.correction.instruments import InputCorrection, Mix, SensorCorrection
from models.files.cycle import Cycle
from models.files.cycle_file import RecordedStart
from models.mechanisms import CATALOGUE, Scale

TIME = 10.0 * np.arange(120)
CYCLE = Cycle(TIME, {
    "speed": np.where(TIME < 500.0, 1500.0, 2500.0), "torque": np.full(len(TIME), 80.0),
    "T_ambient": 20.0 + TIME / 600.0, "air_speed": np.full(len(TIME), 2.0),
})  # fmt: skip
RESULT = {"time_s": TIME, "T_oil_degC": 40.0 + TIME / 50.0, "T_pinion_degC": np.full(len(TIME), 70.0),
          "T_ambient_degC": np.full(len(TIME), 20.0), "P_loss_W": np.where(TIME < 500.0, 200.0, 300.0)}  # fmt: skip


def placed(fzg: Gearbox, name: str, target: str, value: float) -> Finding:
    spots = CATALOGUE[name].placed(fzg.network(), Scale.of(fzg, speed=2500.0, torque=80.0))
    term = next(one for one in spots if one.target == (target,))
    return Finding.of(term, {p.name: (p.start, 0.0) for p in term.parameters} | {term.strength.name: (value, 0.1)},
                      mechanism=name)  # fmt: skip


def test_inputs_as_they_probably_were(fzg: Gearbox) -> None:
    inputs = (InputCorrection(name="T_ambient", offset=-1.5), InputCorrection(name="torque", gain=1.1, offset=2.0),
              InputCorrection(name="speed", clock=100.0))  # fmt: skip
    gain = placed(fzg, "torque_gain", "torque", 0.5)
    found = true_inputs(CYCLE, Correction.of(fzg, inputs=inputs, findings=[gain]))
    np.testing.assert_allclose(found.inputs["T_ambient"], CYCLE.inputs["T_ambient"] - 1.5)
    np.testing.assert_allclose(found.inputs["torque"], 1.5 * (1.1 * 80.0 + 2.0))
    assert TIME[np.argmax(found.inputs["speed"] > 2400.0)] == TIME[np.argmax(CYCLE.inputs["speed"] > 2400.0)] + 100.0
    np.testing.assert_array_equal(found.inputs["air_speed"], CYCLE.inputs["air_speed"])


def test_a_fault_that_follows_the_machine_is_applied_with_its_temperatures(fzg: Gearbox) -> None:
    """The probe reads a tenth of the housing's rise too much: the true air is cooler."""
    heated = placed(fzg, "ambient_probe_heated", "T_ambient", -0.1)
    correction = Correction.of(fzg, findings=[heated])
    assert true_inputs(CYCLE, correction).inputs["T_ambient"] is CYCLE.inputs["T_ambient"]
    driven: list[Array] = []

    def run(cycle: Cycle) -> dict[str, Array]:
        driven.append(cycle.inputs["T_ambient"])
        housing = {f"T_{part.name}_degC": np.full(len(TIME), 60.0) for part in fzg.network().parts}
        return RESULT | housing

    result = simulated_as_recorded(CYCLE, correction, run)
    recorded = CYCLE.inputs["T_ambient"]
    np.testing.assert_allclose(driven[-1], recorded - 0.1 * (60.0 - recorded))
    np.testing.assert_array_equal(result["T_ambient_degC_as_recorded"], recorded)


def test_a_clock_that_all_inputs_share_delays_the_readings(fzg: Gearbox) -> None:
    """All readings by it; the loss, which has the clock of the inputs, by nothing: its delay is the negative."""
    inputs = [InputCorrection(name=name, clock=60.0) for name in CYCLE.inputs]
    sensors = [SensorCorrection(channel="oil", bias=1.0), SensorCorrection(channel="P_loss", delay=-60.0)]
    correction = Correction.of(fzg, inputs=inputs, sensors=sensors)
    driven: list[Cycle] = []

    def run(cycle: Cycle) -> dict[str, Array]:
        driven.append(cycle)
        return RESULT

    result = simulated_as_recorded(CYCLE, correction, run)
    np.testing.assert_array_equal(driven[0].inputs["speed"], CYCLE.inputs["speed"])
    np.testing.assert_allclose(result["T_oil_degC_as_recorded"][6:], RESULT["T_oil_degC"][:-6] + 1.0)
    np.testing.assert_allclose(result["P_loss_W_as_recorded"][:-6], RESULT["P_loss_W"][:-6])
    assert "T_pinion_degC_as_recorded" in result and "T_ambient_degC_as_recorded" not in result


def test_readings_of_a_sensor(fzg: Gearbox) -> None:
    """Mix, then lag, then bias; a found fault comes on top; a slow sensor is behind a ramp by its time constant."""
    mix = (Mix(node="pinion", share=0.1), Mix(node="air", share=-0.05))
    oil = SensorCorrection(channel="oil", lag=30.0, bias=0.8, mix=mix)
    loss = SensorCorrection(channel="P_loss", gain=1.1, bias=5.0, delay=50.0)
    more = placed(fzg, "sensor_bias", "oil", 2.0)
    read = read_as_recorded(RESULT, Correction.of(fzg, sensors=[oil, loss], findings=[more]))
    assert set(read) == {"T_oil_degC_as_recorded", "P_loss_W_as_recorded"}
    slope = (1.0 - 0.1 + 0.05) / 50.0
    mixed = RESULT["T_oil_degC"] + 0.1 * (70.0 - RESULT["T_oil_degC"]) - 0.05 * (20.0 - RESULT["T_oil_degC"])
    late = read["T_oil_degC_as_recorded"] - 0.8 - 2.0
    assert late[0] == pytest.approx(mixed[0])
    np.testing.assert_allclose((mixed - late)[60:], 30.0 * slope, rtol=1e-6)
    np.testing.assert_allclose(read["P_loss_W_as_recorded"][:50], 1.1 * 200.0 + 5.0)
    assert TIME[np.argmax(read["P_loss_W_as_recorded"] > 330.0)] == 550.0


def test_a_share_of_a_reading_that_comes_late(fzg: Gearbox) -> None:
    """Of a ramp a fifth is behind by its time constant, so the whole is by a fifth of that."""
    oil = SensorCorrection(channel="oil", mix=(Mix(node="oil", share=0.2, lag=40.0), Mix(node="oil", share=0.0)))
    read = read_as_recorded(RESULT, Correction.of(fzg, sensors=[oil]))["T_oil_degC_as_recorded"]
    np.testing.assert_allclose((RESULT["T_oil_degC"] - read)[60:], 0.2 * 40.0 / 50.0, rtol=1e-3)


def test_several_sensors_at_a_node(fzg: Gearbox) -> None:
    sensors = [SensorCorrection(channel="oil__sump", bias=1.0), SensorCorrection(channel="oil__drain", bias=-1.0)]
    read = read_as_recorded(RESULT, Correction.of(fzg, sensors=sensors))
    np.testing.assert_allclose(read["T_oil__sump_degC_as_recorded"] - read["T_oil__drain_degC_as_recorded"], 2.0)


def test_a_recorded_start_loses_its_bias(fzg: Gearbox) -> None:
    start = RecordedStart(Path("a.csv"), {"oil": 41.0, "pinion": 50.0}, {"oil": 1, "pinion": 1}, {"oil": "T_oil_degC"})
    found = true_start(start, Correction.of(fzg, sensors=[SensorCorrection(channel="oil__sump", bias=0.8)]))
    assert found.temperatures == {"oil": 40.2, "pinion": 50.0}
