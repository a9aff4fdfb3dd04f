"""Unknowns, the linearisation and the scan: against repeated simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit
from diagnosis.engine.scan import scan
from diagnosis.engine.unknown import ClockOffset, InputGain, SensorBias
from diagnosis.recordings.recording import Recording
from diagnosis.setup.inference_setup import InferenceSetup
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE
from models.network.laws import Parameter
from tests.unit.diagnosis.inference_example import windage_ride

WINDAGE_W = 60.0
LOOKED_FOR = (
    "windage",
    "aeration",
    "radiation_error",
    "pocketing",
    "sensor_bias",
    "torque_offset",
    "hot_neighbour",
    "sensor_lag",
)


@pytest.fixture(scope="module")
def recording(fzg: Gearbox) -> Recording:
    """Three hours of the model with windage in the oil, with a little noise."""
    time = np.arange(0.0, 10_800.0, 10.0)
    speed = np.interp(time, [600, 660, 4000, 4060, 8000, 8060], [900, 2600, 2600, 3300, 3300, 1500])
    torque = np.interp(time, [2500, 2510, 6000, 6010], [60.0, 150.0, 150.0, 90.0])
    return windage_ride(fzg, time, speed, torque, windage_W=WINDAGE_W, seed=0)


@pytest.fixture(scope="module")
def prepared(fzg: Gearbox, recording: Recording) -> tuple[InferenceSetup, Experiment]:
    return prepare_experiment(fzg, [recording], [recording])


@pytest.fixture(scope="module")
def fit(prepared: tuple[InferenceSetup, Experiment]) -> Fit:
    return calibrate(prepared[1])


@pytest.fixture(scope="module")
def hypotheses(prepared: tuple[InferenceSetup, Experiment]) -> list[Hypothesis]:
    setup, experiment = prepared
    network = experiment.machine.model.network
    return [
        hypothesis_of(p) for name in LOOKED_FOR for p in CATALOGUE[name].placed(network, setup.scale, setup.channels)
    ]


def test_columns_are_those_of_repeated_simulation(prepared: tuple[InferenceSetup, Experiment]) -> None:
    """Of every unknown of the usual ones, of a gain of the speed and of a clock, away from the priors' middles."""
    _, experiment = prepared
    speed = Parameter(name="speed_gain", start=1.0, sd=0.01, lower=0.9, upper=1.1, log=False)
    clock = Parameter(name="clock", unit="s", start=0.0, sd=20.0, lower=-600.0, upper=600.0, log=False)
    more = (InputGain(parameter=speed, input="speed"), ClockOffset(parameter=clock))
    experiment = replace(experiment, unknowns=(*experiment.unknowns, *more))
    z = 0.3 * np.random.default_rng(3).standard_normal(len(experiment.unknowns))
    here = experiment.point(0, z, rounds=12)
    columns = experiment.columns(here, z)
    for index, unknown in enumerate(experiment.unknowns):
        step = 0.03 * (np.arange(len(z)) == index)
        there, back = (experiment.point(0, z + way * step, here.trajectory, rounds=8).read for way in (1.0, -1.0))
        # In the first minutes the cold parts jump within an interval, and the derivative is that of its middle.
        difference, column = (
            (x / scale)[8:].ravel() for x, scale in ((there - back, 0.06), (columns[:, :, index], 1.0))
        )
        size = float(np.linalg.norm(difference))
        error = float(np.linalg.norm(difference - column))
        # Delays move readings along the straight lines between rows, with a kink at every row.
        allowed = 0.3 if unknown.parameter.name in ("clock", "delay_P_loss") else 0.04
        assert error <= allowed * size + 0.01, (unknown.parameter.name, error, size)


def test_what_a_mapping_states_of_a_sensor_is_its_prior(fzg: Gearbox, recording: Recording) -> None:
    stated = tuple(replace(c, lag_s=40.0, lag_sd_s=10.0, resolution=0.5) if c.name == "oil" else c
                   for c in recording.channels)  # fmt: skip
    setup, experiment = prepare_experiment(fzg, [replace(recording, channels=stated)], [recording])
    lags = {u.parameter.name: u.parameter for u in experiment.unknowns if u.parameter.name.startswith("lag_")}
    assert (lags["lag_oil"].start, lags["lag_oil"].sd) == (40.0, 0.25)
    assert lags["lag_bearing_1"].sd > 0.5
    floor = dict(zip(setup.channels, experiment.noise[0].floor_sd, strict=True))
    assert floor["oil"] == pytest.approx(0.5 / np.sqrt(12.0))
    assert floor["bearing_1"] == 0.02


def test_scope(prepared: tuple[InferenceSetup, Experiment]) -> None:
    """An unknown of another recording changes nothing here."""
    _, experiment = prepared
    bias = Parameter(name="bias_here", unit="K", start=0.0, sd=1.0, lower=-10.0, upper=10.0, log=False)
    readings = {}
    for scope in (frozenset({"made"}), frozenset({"another"})):
        one = replace(experiment, unknowns=(SensorBias(parameter=bias, channel="oil", scope=scope),))
        point = one.point(0, np.array([2.0]))
        readings[scope] = point.read
        assert one.columns(point, np.array([2.0])).any() == ("made" in scope)
    at = experiment.pieces[0].channels.index("oil")
    apart = np.subtract(*readings.values())
    np.testing.assert_allclose(apart[:, at], 2.0)
    assert not np.delete(apart, at, axis=1).any()


def test_what_is_there_is_found_and_fitted(fit: Fit, hypotheses: list[Hypothesis]) -> None:
    found = scan(fit, hypotheses)
    given = found.gram.given(found.unknowns)
    # A fit ends within a twentieth of a prior sd of the best; the Gram matrix goes the rest of the way.
    assert 0.0 <= given.log_evidence - fit.log_evidence < 1.0
    best = int(np.argmax(found.log_bayes))
    # Windage and pocketing go with the speed alike: at three speeds nobody can tell them apart.
    assert found.candidates[best].label in ("windage@oil", "pocketing@oil")
    best = [c.label for c in found.candidates].index("windage@oil")
    assert found.log_bayes[best] > found.log_bayes.max() - 3.0
    strength = float(found.singles(given).value[best])
    again = refit(fit, found.candidates[best], found.best[best], strength)
    values = {u.parameter.name: u.value(z) for u, z in zip(again.experiment.unknowns, again.z, strict=True)}
    name = again.experiment.unknowns[len(fit.z)].parameter.name
    sd = float(np.sqrt(again.covariance[len(fit.z), len(fit.z)])) * again.experiment.unknowns[len(fit.z)].parameter.sd
    assert values[name] == pytest.approx(WINDAGE_W, abs=3.0 * sd)
    assert again.log_evidence - fit.log_evidence > 5.0


def test_a_prior_scales_the_column(prepared: tuple[InferenceSetup, Experiment]) -> None:
    _, experiment = prepared
    bias = Parameter(name="bias_here", unit="K", start=0.0, sd=1.0, lower=-10.0, upper=10.0, log=False)
    wide, narrow = (SensorBias(parameter=replace(bias, sd=sd), channel="oil") for sd in (1.0, 0.1))
    assert (wide.value(2.0), narrow.value(2.0)) == pytest.approx((2.0, 0.2))
    assert narrow.z_of(narrow.value(1.5)) == pytest.approx(1.5)
    point = experiment.point(0, np.zeros(len(experiment.unknowns)))
    columns = point.responses([wide.column(point, 0.0), narrow.column(point, 0.0)])
    np.testing.assert_allclose(columns[:, :, 1], 0.1 * columns[:, :, 0])
