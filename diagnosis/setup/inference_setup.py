"""Everything that is known before anything is explained: the gearbox, its recordings on the grid, noise and priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.whitening import Noise
from diagnosis.recordings.recording import Recording
from diagnosis.setup.noise import noise_of
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.correction.corrected_gearbox import CorrectedGearbox
from models.correction.correction import Correction
from models.mechanisms import Mechanism, Scale
from models.quantities.quantities import GEARBOX_INPUTS, is_total_loss
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Term

STANDSTILL_RPM = 10.0
HELD_OUT_SHARE = 0.25  # of every recording, if none is held out as a whole
START_S = 600.0  # readings that only serve to find the start temperatures of a prediction


@dataclass(frozen=True, kw_only=True, eq=False)
class InferenceSetup:
    """A gearbox, its recordings, and what may be missing.

    Attributes
    ----------
    gearbox : Gearbox
        With what is known of the machine before
    recordings, holdout, baseline : tuple of Recording
        To learn from, to judge by, and those in which the effect that is looked for cannot act
    switched_off : tuple of str
        The only mechanisms that are known to be off in the baselines; empty: all are
    catalogue : mapping of str to Mechanism
        What is looked for
    nominal : ThermalNetwork
        As the definition has it
    model : NetworkOnGrid
        The nominal network with the tilts of its laws
    shapes : tuple of Term
        Tilts of the laws, which the nominal network lacks
    scale : Scale
        Typical sizes in these recordings
    learnt, held_out : tuple of Piece
        To learn from and to judge by
    loss_W : float
        Typical total loss, [W]
    white_K : mapping of channel to float
        White noise of one row of every temperature, [K]
    white_loss : (float, float)
        White noise of one row of the total loss: a constant part [W] and one relative to the loss [-]
    display : Array, shape (channels,)
        What rounding leaves in a mean of many rows, [K] or [W]; 0 if the step of the display is not known
    """

    gearbox: Gearbox
    recordings: tuple[Recording, ...]
    holdout: tuple[Recording, ...]
    baseline: tuple[Recording, ...]
    switched_off: tuple[str, ...]
    catalogue: Mapping[str, Mechanism]
    nominal: ThermalNetwork
    model: NetworkOnGrid
    shapes: tuple[Term, ...]
    scale: Scale
    channels: tuple[str, ...]
    learnt: tuple[Piece, ...]
    held_out: tuple[Piece, ...]
    loss_W: float
    white_K: Mapping[str, float]
    white_loss: tuple[float, float]
    display: Array

    @property
    def known(self) -> Correction:
        """Physics of the machine that its definition lacks."""
        return self.gearbox.correction if isinstance(self.gearbox, CorrectedGearbox) else Correction()

    @property
    def noise_K(self) -> float:
        """Median white noise of a temperature row, [K]."""
        return float(np.median(list(self.white_K.values()))) if self.white_K else 0.0

    def noise_in(self, piece: Piece) -> Noise:
        """Noise of one piece."""
        return noise_of(
            self.model, piece, self.white_K, self.loss_W, loss_noise=self.white_loss, display=self.display,
            parametric=self.gearbox.is_parametric,
        )  # fmt: skip


def first_part(piece: Piece) -> Piece:
    """A piece with the readings to learn from: all but the last part."""
    return replace(piece, measured=np.where(_late(piece)[:, None], np.nan, piece.measured))


def last_part(piece: Piece) -> Piece:
    """A piece with the readings to judge by: the last part, and the first minutes for the start temperatures."""
    early = piece.time <= piece.time[0] + min(START_S, 0.2 * (piece.time[-1] - piece.time[0]))
    return replace(piece, measured=np.where((_late(piece) | early)[:, None], piece.measured, np.nan))


def _late(piece: Piece) -> Array:
    begin, end = piece.time[0], piece.time[-1]
    return np.asarray(piece.time > begin + (1.0 - HELD_OUT_SHARE) * (end - begin))


def scale_of(gearbox: Gearbox, recordings: Sequence[Recording]) -> Scale:
    """Typical sizes of the operation in recordings."""
    speed = np.concatenate([np.abs(r.inputs["speed"]) for r in recordings])
    torque = np.concatenate([np.abs(r.inputs["torque"]) for r in recordings])
    ambient = [np.median(r.inputs["T_ambient"]) for r in recordings if "T_ambient" in r.inputs]
    running = speed > STANDSTILL_RPM
    duration = max(float(r.time[-1]) for r in recordings)
    interval = float(np.median(np.concatenate([np.diff(r.time) for r in recordings])))
    named = [name for name in recordings[0].inputs if name not in GEARBOX_INPUTS]
    typical = {name: float(np.mean(np.concatenate([r.inputs[name] for r in recordings]))) for name in named}
    if not running.any():
        return Scale.of(gearbox, inputs=typical, duration=duration, interval=interval)
    # Without geometry the nominal steady state is a guess; how hot it gets was measured.
    oil = np.concatenate([c.values for r in recordings for c in r.channels if c.name == "oil"] or [np.zeros(0)])
    hot = float(np.nanpercentile(oil, 95)) if gearbox.is_parametric and np.isfinite(oil).any() else None
    return Scale.of(
        gearbox, temperature=hot, speed=float(np.percentile(speed[running], 90)),
        torque=max(float(np.percentile(torque[running], 75)), 1.0),
        ambient=float(np.median(ambient)) if ambient else None, inputs=typical, duration=duration, interval=interval,
    )  # fmt: skip


def typical_loss(model: NetworkOnGrid, recordings: Sequence[Recording]) -> float:
    """Median total loss while running, by the loss model at what the oil, or else anything, was measured at, [W]."""
    values = []
    for recording in recordings:
        rows = slice(None, None, max(1, len(recording.time) // 500))
        speed, torque = recording.inputs["speed"][rows], recording.inputs["torque"][rows]
        known = {c.name: c.values[rows] for c in recording.channels if not is_total_loss(c.name)}
        T = np.nan_to_num(known.get("oil", next(iter(known.values()), np.full(len(speed), 60.0))), nan=60.0)
        power = model.losses.power(speed, torque, np.repeat(T[:, None], len(model.loss_nodes), axis=1)).sum(axis=-1)
        values.append(power[np.abs(speed) > STANDSTILL_RPM])
    found = np.concatenate(values) if values else np.zeros(0)
    return float(np.median(found)) if len(found) else 1.0
