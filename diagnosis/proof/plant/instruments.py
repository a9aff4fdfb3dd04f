"""From what the plant did to what was recorded: lag, noise, display steps, dropouts, and faults of measurement."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter, lfiltic

from diagnosis.proof.plant.cycles import ROW_S, reference_torque
from diagnosis.proof.plant.draws import at, either, one_of, relative
from diagnosis.proof.plant.effect import MEASUREMENT, Concealed, Draw, Effect, Kind, Places, Recorded, Spoil
from diagnosis.proof.plant.plant import Plant
from diagnosis.proof.plant.plant_run import INPUTS, PlantOutcome, PlantRun
from models.base.types import Array
from models.quantities.quantities import column_of_input


@dataclass(frozen=True, kw_only=True)
class Instruments:
    """How one case is measured, of any kind of plant.

    Attributes
    ----------
    channels : tuple of str
        Recorded temperatures
    noise_K, quantum_K : float
        White noise and step of temperature readings
    loss_noise : (float, float) or None
        White noise of the measured loss, relative [-] and absolute [W]; None: it is not measured
    loss_gain : float
        Relative error of the measured loss, [-]
    loss_offset_W : float
        While there is a loss
    dropouts : int
        Bursts of missing readings per recording
    stated : mapping of str to float, or None
        Data sheet of the temperature sensors, by the keys of a mapping file; it may be wrong
    lag_s : mapping of channel to float
        Time constants of the sensors, where the plant itself does not have them
    input_gain, input_offset : mapping of str to float
        Errors of the recorded inputs: relative [-], and in the unit of the input
    clock_s : float
        Temperatures are stamped late by so much, [s]
    """

    channels: tuple[str, ...]
    noise_K: float = 0.2
    quantum_K: float = 0.1
    loss_noise: tuple[float, float] | None = (0.02, 2.0)
    loss_gain: float = 0.0
    loss_offset_W: float = 0.0
    dropouts: int = 0
    stated: Mapping[str, float] | None = None
    lag_s: Mapping[str, float] = field(default_factory=dict)
    input_gain: Mapping[str, float] = field(default_factory=dict)
    input_offset: Mapping[str, float] = field(default_factory=dict)
    clock_s: float = 0.0

    def inputs(self, true: Mapping[str, Array]) -> dict[str, Array]:
        """Recorded inputs without noise."""
        return {
            name: values * (1.0 + self.input_gain.get(name, 0.0)) + self.input_offset.get(name, 0.0)
            for name, values in true.items()
        }

    def loss(self, true: Array) -> Array:
        """Measured loss without noise, [W]."""
        return np.asarray(true * (1.0 + self.loss_gain) + self.loss_offset_W * (true > 0.0))

    def noise_of_loss(self, loss: Array, rng: np.random.Generator) -> Array:
        """Noise of a loss that is measured, [W]."""
        assert self.loss_noise is not None  # noqa: S101 - asked only where a loss is measured
        relative, absolute = self.loss_noise
        return np.asarray(np.hypot(relative * loss, absolute) * rng.standard_normal(len(loss)))


def record(
    plant: Plant,
    run: PlantRun,
    outcome: PlantOutcome,
    instruments: Instruments,
    faults: Sequence[Concealed],
    rng: np.random.Generator | None,
) -> dict[str, Array]:
    """Columns of a recording.

    Parameters
    ----------
    outcome : PlantOutcome
        What the plant did in it
    faults : sequence of Concealed
        Faults of measurement, of :data:`SENSOR_EFFECTS`
    rng : numpy.random.Generator or None
        None for readings without noise, steps and dropouts; other columns get their steps where they become text

    Returns
    -------
    dict of column name to Array, shape (rows,)
    """
    first, rows = run.programme.unrecorded, len(outcome.T)
    places = plant.anatomy.coarse
    recorded = Recorded(
        time=np.asarray(np.arange(rows) * ROW_S, dtype=np.float64),
        housing=outcome.T[:, places.index(plant.anatomy.parts[-1])],
        inputs=instruments.inputs({name: run.programme.inputs[name][first:] for name in INPUTS}),
        readings={p: lagged(outcome.T[:, places.index(p)], instruments.lag_s[p]) for p in instruments.channels},
    )
    inputs, readings, loss = recorded.inputs, recorded.readings, instruments.loss(outcome.P_loss)
    _spoil(recorded, faults, after_noise=False)
    if rng is not None:
        inputs["T_ambient"] = inputs["T_ambient"] + 0.1 * rng.standard_normal(rows)
        for values in readings.values():
            values += instruments.noise_K * rng.standard_normal(rows)
            values[:] = np.round(values / instruments.quantum_K) * instruments.quantum_K
        loss = loss + instruments.noise_of_loss(loss, rng)
    _spoil(recorded, faults, after_noise=True)
    columns = {column_of_input(name): values for name, values in inputs.items()}
    temperatures = {f"T_{place}_degC": values for place, values in readings.items()}
    if rng is not None:
        drop_readings(temperatures, instruments.dropouts, rng)
    return {"time_s": recorded.time, **columns, **temperatures, "P_loss_W": loss}


def lagged(values: Array, tau_s: float, row_s: float = ROW_S) -> Array:
    """Reading of a sensor of first order in rows of `row_s`, settled at the start, shape (rows,)."""
    keep = np.exp(-row_s / tau_s)
    start = lfiltic([1.0 - keep], [1.0, -keep], y=[values[0]])
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, zi=start)[0])


def drop_readings(readings: Mapping[str, Array], bursts: int, rng: np.random.Generator) -> None:
    """Lose bursts of readings of sensors drawn at random, in place."""
    names = list(readings)
    for _ in range(bursts):
        name = names[int(rng.integers(len(names)))]
        start = int(rng.integers(len(readings[name])))
        readings[name][start : start + int(rng.integers(1, 30))] = np.nan


# ---------------------------------------------------------------------- faults


def _spoil(recorded: Recorded, faults: Sequence[Concealed], *, after_noise: bool) -> None:
    for fault in faults:
        if fault.effect.spoil is not None and fault.effect.after_noise == after_noise:
            fault.effect.spoil(fault, recorded)


def _column(change: Callable[[Array, float, Recorded], Array]) -> Spoil:
    """A function of the column at the place of a fault and of its strength; a clock has all temperatures."""

    def spoil(fault: Concealed, recorded: Recorded) -> None:
        columns = recorded.inputs if fault.effect.kind == "signal" else recorded.readings
        for name in tuple(columns) if fault.places == ("clock",) else fault.places:
            columns[name] = change(columns[name], fault.parameters["a"], recorded)

    return spoil


def _swap(fault: Concealed, recorded: Recorded) -> None:
    one, other = fault.places
    recorded.readings[one], recorded.readings[other] = recorded.readings[other], recorded.readings[one]


def _hold(fault: Concealed, recorded: Recorded) -> None:
    """A stuck sensor repeats its last reading, noise and all."""
    values = recorded.readings[fault.places[0]]
    start, end = (round(fault.parameters[key] * len(values)) for key in ("from", "until"))
    values[start:end] = values[start]


def default_channels(plant: Plant) -> tuple[str, ...]:
    """Default measured places: housing, oil, a bearing of every shaft, the first gear."""
    anatomy, stage = plant.anatomy, plant.gearbox.stage[0]
    first = [next(b.name for b in plant.gearbox.bearing if b.shaft == s) for s in (stage.driver, stage.driven)]
    return ("oil", *anatomy.parts, *first, anatomy.gears[0])


def two_unlike_sensors(plant: Plant, rng: np.random.Generator) -> tuple[str, ...]:
    """Two measured places that differ by some kelvin: a gear and something outside the gears."""
    gear = plant.anatomy.gears[0]
    others = [name for name in default_channels(plant) if name != gear]
    return gear, others[int(rng.integers(len(others)))]


def _torque(plant: Plant, rng: np.random.Generator, strength: float) -> Mapping[str, float]:
    return {"a": 0.05 * reference_torque(plant.gearbox) * strength * (1.0 if rng.random() < 0.5 else -1.0)}


def _stuck(_: Plant, rng: np.random.Generator, strength: float) -> Mapping[str, float]:
    start = float(rng.uniform(0.2, 0.6))
    return {"a": strength, "from": start, "until": min(1.0, start + 0.2 * strength)}


def _fault(
    name: str, places: Places, draw: Draw, law: str, spoil: Spoil, kind: Kind = "sensor", *, after_noise: bool = False
) -> Effect:
    return Effect(name, kind, places, draw, law, family=MEASUREMENT, spoil=spoil, after_noise=after_noise)


SENSOR_EFFECTS: Mapping[str, Effect] = {effect.name: effect for effect in (
    _fault("sensor_bias", one_of(default_channels), either(2.0), "reading + a K", _column(lambda T, a, _: T + a)),
    _fault("sensor_drift", one_of(default_channels), either(0.15), "reading + a t^0.9 K, t in hours",
           _column(lambda T, a, r: T + a * (r.time / 3600.0) ** 0.9)),
    _fault("sensor_gain", one_of(default_channels), either(0.05), "reading + a (reading - 20 degC)",
           _column(lambda T, a, _: T + a * (T - 20.0))),
    _fault("sensor_lag", one_of(default_channels), relative(80.0), "a first-order lag of a seconds more",
           _column(lambda T, a, _: lagged(T, a))),
    _fault("sensor_stuck", one_of(default_channels), _stuck,
           "the reading stands still from one fraction of the recording to another", _hold, after_noise=True),
    _fault("swapped_channels", two_unlike_sensors, relative(1.0), "two columns exchanged", _swap),
    _fault("clock_offset", at("clock"), either(90.0), "temperatures are stamped a seconds late",
           _column(lambda T, a, r: np.interp(r.time - a, r.time, T))),
    _fault("torque_offset", at("torque"), _torque, "recorded torque = true + a N m", _column(lambda M, a, _: M + a),
           "signal"),
    _fault("torque_gain", at("torque"), either(0.06), "recorded torque = true (1 + a)",
           _column(lambda M, a, _: M * (1.0 + a)), "signal"),
    _fault("speed_gain", at("speed"), either(0.05), "recorded speed = true (1 + a)",
           _column(lambda n, a, _: n * (1.0 + a)), "signal"),
    _fault("ambient_probe_offset", at("T_ambient"), either(2.0), "recorded ambient = true + a K",
           _column(lambda T, a, _: T + a), "signal"),
    _fault("ambient_probe_heated", at("T_ambient"), relative(0.07), "recorded ambient = true + a (housing - true)",
           _column(lambda T, a, r: T + a * lagged(r.housing - T, 300.0)), "signal"),
)}  # fmt: skip
