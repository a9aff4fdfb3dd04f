"""Sensors and inputs of a fit: the full model, driven and read with them, reads what the fit reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.point import Machine
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.unknown import ClockOffset, TermParameter
from diagnosis.forward.recorder import simulated_as_recorded
from diagnosis.recordings.recording import Recording
from diagnosis.results.instruments import sensors_and_inputs_of
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.correction.correction import Correction
from models.correction.instruments import InputCorrection, SensorCorrection
from models.files.cycle import Cycle
from models.mechanisms import CATALOGUE, Scale
from models.network.laws import Parameter
from tests.unit.diagnosis.inference_example import recording_of

VALUES = {"bias_oil": 1.3, "lag_oil": 60.0, "bias_pinion": -0.7, "lag_pinion": 5.0, "loss_gain": 1.03,
          "bias_P_loss": 4.0, "delay_P_loss": 6.0, "torque_gain": 1.04, "ambient_offset": -2.0}  # fmt: skip


@pytest.fixture(scope="module")
def made(fzg: Gearbox, ride: dict[str, Array], simulated: dict[str, Array]) -> Recording:
    channels = {"oil": simulated["T_oil_degC"], "pinion": simulated["T_pinion_degC"], "P_loss": simulated["P_loss_W"]}
    return recording_of(ride, channels)


@pytest.fixture(scope="module")
def experiment(fzg: Gearbox, made: Recording) -> Experiment:
    return prepare_experiment(fzg, [made], [made], even=True)[1]


def fitted(experiment: Experiment, values: dict[str, float]) -> Fit:
    """Values put in, with everything else at the middle of its prior."""
    z = np.array([u.z_of(values.get(u.parameter.name, u.parameter.start)) for u in experiment.unknowns])
    return Fit(experiment=experiment, z=z, linearised=experiment.linearise(z))


def test_numbers_of_a_fit(experiment: Experiment) -> None:
    fit = fitted(experiment, VALUES)
    sensors, inputs = sensors_and_inputs_of(fit)
    assert [s.channel for s in sensors] == ["oil", "pinion", "P_loss"]
    oil, loss = sensors[0], sensors[2]
    assert (oil.bias, oil.lag) == pytest.approx((1.3, 60.0))
    assert (loss.gain, loss.bias, loss.delay) == pytest.approx((1.03, 4.0, 6.0))
    assert {i.name: (round(i.gain, 6), round(i.offset, 6)) for i in inputs} == {
        "torque": (1.04, 0.0), "T_ambient": (1.0, -2.0),
    }  # fmt: skip
    at = [u.parameter.name for u in experiment.unknowns].index("lag_oil")
    lag_sd = experiment.unknowns[at].parameter.sd * 60.0
    assert oil.lag_stderr == pytest.approx(lag_sd * np.sqrt(fit.covariance[at, at]))


@pytest.mark.parametrize("clock", [0.0, 40.0])
def test_the_full_model_reads_what_the_fit_reads(
    fzg: Gearbox, experiment: Experiment, made: Recording, clock: float
) -> None:
    late = Parameter(name="clock", unit="s", start=0.0, sd=20.0, lower=-600.0, upper=600.0, log=False)
    experiment = replace(experiment, unknowns=(*experiment.unknowns, ClockOffset(parameter=late)))
    fit = fitted(experiment, VALUES | {"clock": clock})
    sensors, inputs = sensors_and_inputs_of(fit)
    assert {i.clock for i in inputs} == ({0.0} if clock == 0.0 else {40.0})
    (point,) = (part.point for part in fit.parts)
    start = dict(zip(experiment.machine.model.parts, point.trajectory.T[0].tolist(), strict=True))

    def run(cycle: Cycle) -> dict[str, Array]:
        return dict(fzg.network().simulate(cycle, losses=fzg.losses(), initial=start).columns())

    result = simulated_as_recorded(
        Cycle(made.time, made.inputs), Correction.of(fzg, sensors=sensors, inputs=inputs), run
    )
    at = np.searchsorted(made.time, point.trajectory.piece.time)
    settled = slice(10, None)  # a late clock repeats the first row before it
    for index, channel in enumerate(point.sensors.channels):
        column = "P_loss_W" if channel == "P_loss" else f"T_{channel}_degC"
        apart = (result[f"{column}_as_recorded"][at] - point.read[:, index])[settled]
        allowed = 3.0 if channel == "P_loss" else 0.1
        assert np.abs(apart).max() < allowed, (channel, np.abs(apart).max())


def test_terms_are_folded_in_unless_they_are_findings(fzg: Gearbox, experiment: Experiment) -> None:
    scale = Scale.of(fzg, speed=2600.0, torque=150.0)
    network = experiment.machine.model.network
    wanted = {"sensor_bias": ("oil",), "torque_gain": ("torque",), "ambient_probe_offset": ("T_ambient",)}
    terms = [next(t for t in CATALOGUE[n].placed(network, scale) if t.target == target) for n, target in wanted.items()]
    added = [TermParameter(parameter=t.strength, label=t.label) for t in terms]
    experiment = replace(experiment, machine=Machine(experiment.machine.model, terms),
                         unknowns=(*experiment.unknowns, *added))  # fmt: skip
    values = VALUES | {t.strength.name: v for t, v in zip(terms, (2.0, 0.1, 0.5), strict=True)}
    fit = fitted(experiment, values)
    sensors, inputs = sensors_and_inputs_of(fit)
    by_name = {one.name: one for one in inputs}
    assert sensors[0].bias == pytest.approx(1.3 + 2.0)
    assert by_name["torque"].gain == pytest.approx(1.04 * 1.1)
    assert by_name["T_ambient"].offset == pytest.approx(-1.5)
    sensors, inputs = sensors_and_inputs_of(fit, findings=[t.label for t in terms])
    assert sensors[0].bias == pytest.approx(1.3) and isinstance(sensors[0], SensorCorrection)
    assert [isinstance(one, InputCorrection) for one in inputs] == [True, True]
    assert {one.name: one.gain for one in inputs}["torque"] == pytest.approx(1.04)
    assert not sensors_and_inputs_of(fit, inputs=["speed"])[1]
