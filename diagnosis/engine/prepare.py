"""From recordings to an experiment: the usual unknowns of a network, its sensors and its inputs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from diagnosis.engine.fit import Experiment
from diagnosis.engine.point import Machine
from diagnosis.engine.unknown import (
    ClockOffset,
    InputGain,
    InputOffset,
    LossDelay,
    LossGain,
    NetworkParameter,
    SensorBias,
    SensorLag,
    Unknown,
)
from diagnosis.forward.grid import slow_rows
from diagnosis.recordings.recording import Recording
from diagnosis.setup.inference_setup import InferenceSetup, prepare
from diagnosis.setup.sessions import hour_of_start, session_by_recording, start_times
from diagnosis.setup.shaft import torque_gain
from diagnosis.setup.start import start_guess
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Mechanism
from models.network.laws import Parameter
from models.quantities.quantities import TOTAL_LOSS, is_total_loss
from models.simulation.thermal_network import ThermalNetwork

BIAS_SD_K, LOSS_OFFSET_SD_W, LOSS_GAIN_SD = 0.3, 2.0, 0.02
ROWS_LATE = 0.5  # a row may be the mean of the time before its stamp, of that after it, or a moment
LAG_S, LAG_SD = 15.0, 0.8  # of its logarithm: a sensor's lag is that of its seat, not of its data sheet
SHORTEST_LAG_S = 3.0
TORQUE_GAIN_SD, AMBIENT_SD_K = 0.01, 0.3
AMBIENT_ASSUMED_SD_K = 4.0  # of a hall whose temperature nobody recorded
CAPACITY_SD = 0.3  # at least: one temperature represents a body that has many
WIDEST = 1e6


def prepare_experiment(
    gearbox: Gearbox,
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    baseline: Sequence[Recording] = (),
    *,
    switched_off: Collection[str] = (),
    catalogue: Mapping[str, Mechanism] = CATALOGUE,
    even: bool = False,
) -> tuple[InferenceSetup, Experiment]:
    """Set up an experiment with the recordings to learn from; see :func:`diagnosis.setup.inference_setup.prepare`."""
    setup = prepare(gearbox, recordings, holdout, baseline, switched_off=switched_off, catalogue=catalogue, even=even)
    starts_at = start_times([*recordings, *holdout])
    unknowns = usual_unknowns(
        setup.model.network, (*recordings, *baseline), setup.channels, interval=setup.scale.interval,
        gain_of_torque=torque_gain(gearbox.network()),
    )  # fmt: skip
    return setup, Experiment(
        machine=Machine(setup.model),
        pieces=setup.learnt,
        unknowns=tuple(unknowns),
        noise=tuple(setup.noise_in(piece) for piece in setup.learnt),
        starts=tuple(start_guess(setup.model, piece) for piece in setup.learnt),
        session_of=session_by_recording(recordings, holdout, baseline),
        healthy=frozenset(r.name for r in baseline),
        switched_off=frozenset(switched_off),
        starts_at=starts_at,
        hour=hour_of_start([*recordings, *holdout]),
        until=max(starts_at[r.name] + float(r.time[-1]) for r in (*recordings, *holdout)),
    )


def held_out_experiment(setup: InferenceSetup, experiment: Experiment) -> Experiment:
    """The held-out pieces with the machine and the unknowns of an experiment.

    Parameters
    ----------
    setup : InferenceSetup
        Of the same recordings, see :func:`prepare_experiment`
    """
    pieces = setup.held_out
    return replace(
        experiment,
        pieces=pieces,
        noise=tuple(setup.noise_in(piece) for piece in pieces),
        starts=tuple(start_guess(setup.model, piece) for piece in pieces),
        filters=None,
        healthy=frozenset(),
    )


def usual_unknowns(
    network: ThermalNetwork, recordings: Sequence[Recording], channels: Sequence[str], *, interval: float,
    gain_of_torque: Parameter | None = None,
) -> list[Unknown]:  # fmt: skip
    """Parameters of the network that may vary, sensors and inputs.

    Parameters
    ----------
    recordings : sequence of Recording
        What the mapping of the first one states of an instrument is its prior: lag, its standard deviation, tolerances
    interval : float
        Between rows, [s]
    gain_of_torque : Parameter or None
        Prior of the gain of a torque that follows from a power
    """
    stated, slow = {c.name: c for r in reversed(recordings) for c in r.channels}, slow_rows(recordings)
    of_inputs = {name: sd for r in reversed(recordings) for name, sd in r.tolerances.items()}
    found: list[Unknown] = []
    for p in network.parameters:
        if p.sd > 0.0:
            wider = replace(p, sd=max(p.sd, CAPACITY_SD)) if p.name.startswith("C_") else p
            found.append(NetworkParameter(parameter=wider))
    for name in channels:
        sensor = stated.get(name)
        tolerance = sensor.bias_sd if sensor is not None else None
        if is_total_loss(name):
            gain_sd = LOSS_GAIN_SD if sensor is None or sensor.gain_sd is None else sensor.gain_sd
            gain = Parameter(name="loss_gain", start=1.0, sd=gain_sd, lower=0.5, upper=2.0, log=False)
            zero = _normal("bias_P_loss", "W", LOSS_OFFSET_SD_W if tolerance is None else tolerance)
            found += [LossGain(parameter=gain), SensorBias(parameter=zero, channel=TOTAL_LOSS)]
            if not slow:
                delay = _normal("delay_P_loss", "s", ROWS_LATE * interval)
                found.append(LossDelay(parameter=delay))
            continue
        bias = _normal(f"bias_{name}", "K", BIAS_SD_K if tolerance is None else tolerance)
        found.append(SensorBias(parameter=bias, channel=name))
        if not slow:
            start = max((sensor.lag_s if sensor else None) or LAG_S, SHORTEST_LAG_S)
            sd = sensor.lag_sd_s / start if sensor is not None and sensor.lag_sd_s is not None else LAG_SD
            lag = Parameter(name=f"lag_{name}", unit="s", start=start, sd=sd, lower=0.01, upper=1e4, log=True,
                            description=f"time constant of the sensor at {name}")  # fmt: skip
            found.append(SensorLag(parameter=lag, channel=name))
    if slow:
        found.append(ClockOffset(parameter=_normal("clock_offset", "s", ROWS_LATE * interval)))
    if network.components:
        torque = Parameter(name="torque_gain", start=1.0, sd=of_inputs.get("torque", TORQUE_GAIN_SD), lower=0.5,
                           upper=2.0, log=False, description="true over recorded torque")  # fmt: skip
        found.append(InputGain(parameter=gain_of_torque or torque, input="torque"))
    if "T_ambient" in network.inputs:
        assumed = any("T_ambient" in r.assumed for r in recordings)
        usual = AMBIENT_ASSUMED_SD_K if assumed else AMBIENT_SD_K
        offset = _normal("ambient_offset", "K", of_inputs.get("T_ambient", usual))
        found.append(InputOffset(parameter=offset, input="T_ambient"))
    return found


def _normal(name: str, unit: str, sd: float) -> Parameter:
    return Parameter(name=name, unit=unit, start=0.0, sd=sd, lower=-WIDEST, upper=WIDEST, log=False)
