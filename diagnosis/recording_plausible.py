"""Whether recordings can be of this gearbox at all, in these units: judged by the nominal model, where certain.

Physics that was left out, worn parts and wrong parameters move a temperature by some kelvin; a slip of the unit, or
another gearbox, by far more. Only the latter is refused here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, pi

import numpy as np

from diagnosis.grid import Piece
from diagnosis.mapping import LOSS
from diagnosis.network_on_grid import NetworkOnGrid
from diagnosis.recording import Recording
from diagnosis.trajectory import simulate
from models.errors import InputError
from models.network import Losses, ThermalNetwork
from models.types import Array

ROWS = 200  # of the thinned recording that is simulated
FEWEST_ROWS = 10
# Deviation of the temperatures [K] and share of their rise, and factor of the total loss, ...
SUSPECT_K, SUSPECT_SHARE, SUSPECT_LOSS = 15.0, 0.25, 2.0  # ... from which on units are questioned
GROSS_K, GROSS_SHARE, GROSS_LOSS = 30.0, 0.5, 4.0  # ... that only another machine explains
CURED = 0.35  # of the deviation that may be left when the right unit is found
ENDLESS_K = 1000.0  # deviation where the model runs away
WARM_FOR_DEGC = 45.0  # degC; temperatures that never fall below may be degF


@dataclass(frozen=True, kw_only=True)
class Slip:
    """A unit that may have been mistaken: what it changes, from which value on it can be, and how it is told.

    A torque a thousand times too large makes the model miss by hundreds of kelvin: `grossly` asks for that. Else a
    recording without much load looks as if any misfit were the torque's.
    """

    signal: str
    factor: float
    offset: float = 0.0
    lowest: float = -np.inf
    grossly: bool = False
    says: str


SLIPS = (
    Slip(signal="speed", factor=30.0 / pi, says="speed seems to be in rad/s, not 1/min"),
    Slip(signal="speed", factor=60.0, says="speed seems to be in revolutions per second, not 1/min"),
    Slip(signal="torque", factor=1e3, says="torque seems to be in kN m, not N m"),
    Slip(signal="torque", factor=1e-3, grossly=True, says="torque seems to be in N mm, not N m"),
    Slip(signal="time", factor=60.0, grossly=True, says="time seems to be in minutes, not s"),
    Slip(signal="time", factor=3600.0, grossly=True, says="time seems to be in hours, not s"),
    Slip(signal="time", factor=1e-3, grossly=True, says="time seems to be in milliseconds, not s"),
    Slip(
        signal="T",
        factor=5.0 / 9.0,
        offset=-160.0 / 9.0,
        lowest=WARM_FOR_DEGC,
        says="temperatures seem to be in degF, not degC",
    ),
    Slip(
        signal="T_ambient",
        factor=5.0 / 9.0,
        offset=-160.0 / 9.0,
        lowest=WARM_FOR_DEGC,
        says="T_ambient seems to be in degF, not degC",
    ),
    Slip(signal=LOSS, factor=1e3, says="P_loss seems to be in kW, not W"),
    Slip(signal=LOSS, factor=1e-3, says="P_loss seems to be in mW, not W"),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Thin:
    """Means over stretches of one gap-free piece, shape (rows,) each."""

    time: Array
    inputs: Mapping[str, Array]
    measured: Mapping[str, Array]


@dataclass(frozen=True, kw_only=True)
class _Misfit:
    """How far a model is from a recording: of temperatures [K] and over their rise, of the loss the factor."""

    kelvin: float
    share: float
    factor: float

    def beyond(self, kelvin: float, share: float, factor: float) -> bool:
        """Whether it is larger than these limits: temperatures by both of theirs, or the loss."""
        return (self.kelvin > kelvin and self.share > share) or abs(log(self.factor)) > log(factor)

    @property
    def size(self) -> float:
        """One number for comparison, 1 at the limits of suspicion."""
        return max(self.kelvin / SUSPECT_K, abs(log(self.factor)) / log(SUSPECT_LOSS))


def check_plausible(recordings: Sequence[Recording], network: ThermalNetwork, losses: Losses) -> None:
    """Refuse recordings that the nominal model misses by so much that a unit or the gearbox must be another.

    Parameters
    ----------
    recordings : sequence of Recording
    network : ThermalNetwork
    losses : Losses

    Raises
    ------
    InputError
        With the unit that would cure it, where there is one.
    """
    model = NetworkOnGrid(network, losses)
    faults = [fault for recording in recordings if (fault := _fault(recording, model))]
    if faults:
        raise InputError("\n".join(faults))


def _fault(recording: Recording, model: NetworkOnGrid) -> str:
    thin = _thinned(recording)
    if len(thin.time) < FEWEST_ROWS:
        return ""
    given = _misfit(thin, model)
    if not given.beyond(SUSPECT_K, SUSPECT_SHARE, SUSPECT_LOSS):
        return ""
    seen = [f"temperatures are {given.kelvin:.0f} K off"] if given.kelvin > SUSPECT_K else []
    if abs(log(given.factor)) > log(SUSPECT_LOSS):
        seen.append(f"P_loss is {given.factor:.3g} times the model's")
    where = f"{recording.path}: over the rows of {thin.time[0]:.0f} ... {thin.time[-1]:.0f} s {' and '.join(seen)}"
    gross = given.beyond(GROSS_K, GROSS_SHARE, GROSS_LOSS)
    possible = [slip for slip in SLIPS if _lowest(thin, slip) >= slip.lowest and (gross or not slip.grossly)]
    size, best = min(((_misfit(_slipped(thin, slip), model).size, slip) for slip in possible), key=lambda pair: pair[0])
    if size < CURED * given.size and size < 1.0:
        return f"{where}; {best.says}: convert it, or give its unit in a mapping file"
    if not gross:
        return ""
    return (
        f"{where}, more than missing physics explains; is it of another gearbox, or are speed and torque those of "
        "another shaft?"
    )


def _thinned(recording: Recording) -> _Thin:
    piece = max(recording.segments, key=lambda rows: recording.time[rows][-1] - recording.time[rows][0])
    time = recording.time[piece]
    stretches = [part for part in np.array_split(np.arange(len(time)), min(ROWS, len(time))) if len(part)]

    def means(values: Array) -> Array:
        own = values[piece]
        known = [own[part][np.isfinite(own[part])] for part in stretches]
        return np.array([part.mean() if len(part) else np.nan for part in known])

    return _Thin(
        time=means(recording.time),
        inputs={name: means(values) for name, values in recording.inputs.items()},
        measured={channel.name: means(channel.values) for channel in recording.channels},
    )


def _touched(thin: _Thin, slip: Slip) -> set[str]:
    if slip.signal == "T":
        return {"T_ambient", *thin.measured} - {LOSS}
    return {slip.signal}


def _lowest(thin: _Thin, slip: Slip) -> float:
    values = [v for name, v in {**thin.inputs, **thin.measured}.items() if name in _touched(thin, slip)]
    return min((float(np.nanmin(v)) for v in values if np.isfinite(v).any()), default=-np.inf)


def _slipped(thin: _Thin, slip: Slip) -> _Thin:
    touched = _touched(thin, slip)

    def mended(arrays: Mapping[str, Array]) -> Mapping[str, Array]:
        return {name: v * slip.factor + slip.offset if name in touched else v for name, v in arrays.items()}

    time = thin.time * slip.factor if slip.signal == "time" else thin.time
    return replace(thin, time=time, inputs=mended(thin.inputs), measured=mended(thin.measured))


def _misfit(thin: _Thin, model: NetworkOnGrid) -> _Misfit:
    temperatures = {n: values for n, values in thin.measured.items() if n != LOSS and np.isfinite(values).any()}
    first = {name: float(values[np.isfinite(values)][0]) for name, values in temperatures.items()}
    ambient = thin.inputs["T_ambient"]
    middle = float(np.mean(list(first.values()))) if first else float(ambient[0])
    inputs = np.stack([thin.inputs[name] for name in model.laws.inputs], axis=-1)
    piece = Piece(
        recording="",
        time=thin.time,
        samples=0.5 * (inputs[1:] + inputs[:-1])[:, None, :],
        channels=(),
        measured=np.empty((len(thin.time), 0)),
        counts=np.empty((len(thin.time), 0)),
    )
    start = np.array([first.get(name, middle) for name in model.parts])
    try:
        with np.errstate(all="ignore"):
            trajectory = simulate(model, piece, model.start, start)
    except ArithmeticError:  # temperatures without end: nothing that runs is like that
        return _Misfit(kelvin=ENDLESS_K, share=1.0, factor=1.0)
    kelvin, share = 0.0, 0.0
    if temperatures:
        simulated = {name: trajectory.T[:, model.parts.index(name)] for name in temperatures}
        square = [np.nanmean((simulated[name] - values) ** 2) for name, values in temperatures.items()]
        rise = [
            max(np.nanmax(np.abs(values - ambient)), np.max(np.abs(simulated[name] - ambient)), 1.0)
            for name, values in temperatures.items()
        ]
        kelvin = float(np.sqrt(np.mean(square)))
        share = kelvin / float(np.mean(rise))
    return _Misfit(kelvin=kelvin, share=share, factor=_loss_factor(thin, trajectory.balance.sources[:, model.is_loss]))


def _loss_factor(thin: _Thin, sources: Array) -> float:
    """Measured over simulated total loss where that is high; 1 where it was not measured."""
    if LOSS not in thin.measured:
        return 1.0
    total = sources.sum(axis=-1)
    measured = 0.5 * (thin.measured[LOSS][1:] + thin.measured[LOSS][:-1])
    high = np.isfinite(measured) & (total > 0.5 * np.max(total))
    if not high.any():
        return 1.0
    return max(abs(float(np.median(measured[high]))), 1e-9) / max(float(np.median(total[high])), 1e-9)
