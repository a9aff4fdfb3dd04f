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
from diagnosis.forward.grid import pieces, slow_rows
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.recordings.recording import Recording
from diagnosis.setup.inference_setup import InferenceSetup, first_part, last_part, scale_of, typical_loss
from diagnosis.setup.noise import channel_noise, display_noise, loss_noise
from diagnosis.setup.sessions import hour_of_start, session_by_recording, start_times
from diagnosis.setup.shaft import shafts, torque_gain, with_shaft
from diagnosis.setup.shapes import shape_terms
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
    """Set up the inference and an experiment with the recordings to learn from.

    Parameters
    ----------
    holdout : sequence of Recording
        Without any the last quarter of every stretch without a gap is held out
    baseline : sequence of Recording
        To learn from as well, as a whole; they do not decide on the scale
    switched_off : collection of str
        See :class:`~diagnosis.setup.inference_setup.InferenceSetup`
    even : bool
        True for intervals of one length, see :func:`diagnosis.forward.grid.pieces`
    """
    as_defined = gearbox.network()
    nominal = with_shaft(as_defined)
    train, held, healthy = (shafts(given, as_defined) for given in (recordings, holdout, baseline))
    everything = (*train, *healthy)
    scale = scale_of(gearbox, train)
    shapes = shape_terms(nominal, scale)
    network = nominal
    for term in shapes:
        network = term.apply(network)
    model = NetworkOnGrid(network, gearbox.loss_laws())
    measured = {c.name for r in everything for c in r.channels}
    temperatures = sorted((c for c in measured if not is_total_loss(c)), key=lambda c: (model.part_index(c), c))
    channels = (*temperatures, *([TOTAL_LOSS] if TOTAL_LOSS in measured else []))
    learnt, held_out, of_baselines = (
        pieces(given, model.laws.inputs, channels, even=even) for given in (train, held, healthy)
    )
    if not holdout:
        learnt, held_out = tuple(map(first_part, learnt)), tuple(map(last_part, learnt))
    white_K = channel_noise(everything, channels)
    white_loss = loss_noise(everything) if TOTAL_LOSS in channels else (0.0, 0.0)
    setup = InferenceSetup(
        gearbox=gearbox, recordings=tuple(recordings), holdout=tuple(holdout), baseline=tuple(baseline),
        switched_off=tuple(switched_off), catalogue=catalogue,
        nominal=nominal, model=model, shapes=shapes, scale=scale, channels=channels,
        learnt=(*learnt, *of_baselines), held_out=held_out, loss_W=typical_loss(model, train),
        white_K=white_K, white_loss=white_loss,
        display=display_noise(everything, channels, white_K, white_loss[0]),
    )  # fmt: skip
    starts_at = start_times([*recordings, *holdout])
    unknowns = usual_unknowns(
        network, (*recordings, *baseline), channels, interval=scale.interval, gain_of_torque=torque_gain(as_defined)
    )
    return setup, Experiment(
        machine=Machine(model),
        pieces=setup.learnt,
        unknowns=tuple(unknowns),
        noise=tuple(setup.noise_in(piece) for piece in setup.learnt),
        starts=tuple(start_guess(model, piece) for piece in setup.learnt),
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
    held_out = setup.held_out
    return replace(
        experiment,
        pieces=held_out,
        noise=tuple(setup.noise_in(piece) for piece in held_out),
        starts=tuple(start_guess(setup.model, piece) for piece in held_out),
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
