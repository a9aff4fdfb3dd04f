"""Start temperatures of a piece, before anything is simulated: what they may be, and how well that is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.recordings.cold_start import is_isothermal
from models.base.types import Array
from models.quantities.quantities import is_total_loss, node_of_channel

MEASURED_K, UNMEASURED_K, UNMEASURED_SHARE = 2.0, 2.0, 0.15  # the share is of what the hottest is above the air
LEAST_W_K = 1e-6  # of a part to the mean of the readings: one without a link is there
# A machine that stood still has one temperature, up to a share of what it is above the air. On 8 machines of a stranger
# 0.5 K has 7 to 32 nat more evidence than starts that follow the thermometers, and 0.2 to 0.3 K some nat more yet; but
# simulated plants start more evenly than real ones.
ISOTHERMAL_K, ISOTHERMAL_SHARE = 0.3, 0.1


def start_guess(model: NetworkOnGrid, piece: Piece) -> Array:
    """Start temperatures, shape (parts,), [degC]: the median if all agree; else as measured, or between neighbours.

    A part without a reading is where its links hold it between its neighbours and the surroundings, losses left out.
    """
    first, ambient = first_readings(model, piece), ambient_at_start(model, piece)
    if is_isothermal([*first.values()], ambient):
        return np.full(model.n, float(np.median([*first.values()])))
    middle = float(np.mean([*first.values()])) if first else ambient
    T = np.array([first.get(name, middle) for name in model.parts])
    unknown = np.array([name not in first for name in model.parts])
    if not first or not unknown.any():
        return T
    begin = piece.until(float(piece.time[1]))
    memory = np.zeros((len(begin.steps), len(model.network.states)))
    signals = model.signals(begin, np.broadcast_to(T, (len(memory), model.n)), model.start, memory)
    conductances = model.conductances(signals, model.start, (len(memory),))[0]
    boundaries = [float(np.ravel(value)[0]) for value in model.laws.boundary(*signals)]
    links = model.incidence.T @ (conductances[:, None] * model.incidence)
    own = links[: model.n, : model.n][np.ix_(unknown, unknown)] + LEAST_W_K * np.eye(int(unknown.sum()))
    known = np.append(np.where(unknown, 0.0, T), boundaries)
    T[unknown] = np.linalg.solve(own, LEAST_W_K * middle - (links[: model.n] @ known)[unknown])
    return T


def start_covariance(model: NetworkOnGrid, piece: Piece) -> Array:
    """Covariance of the start temperatures about :func:`start_guess`, shape (parts, parts), [K^2]."""
    first, ambient = first_readings(model, piece), ambient_at_start(model, piece)
    if is_isothermal([*first.values()], ambient):
        apart = ISOTHERMAL_K + ISOTHERMAL_SHARE * abs(float(np.median([*first.values()])) - ambient)
        return np.asarray(apart**2 * np.eye(model.n) + MEASURED_K**2)
    unmeasured = UNMEASURED_K + UNMEASURED_SHARE * abs(max(first.values(), default=50.0) - ambient)
    return np.diag([(MEASURED_K if name in first else unmeasured) ** 2 for name in model.parts])


def first_readings(model: NetworkOnGrid, piece: Piece) -> Mapping[str, float]:
    """The first reading of every part that is measured, [degC]."""
    first: dict[str, float] = {}
    for index, name in enumerate(piece.channels):
        seen = piece.measured[:, index]
        seen = seen[np.isfinite(seen)]
        if not is_total_loss(name) and len(seen):
            first.setdefault(node_of_channel(name, model.parts), float(seen[0]))
    return first


def ambient_at_start(model: NetworkOnGrid, piece: Piece) -> float:
    """Temperature of the air in the first interval; 20 degC where no input is that, [degC]."""
    inputs = model.laws.inputs
    return float(piece.inputs[0, inputs.index("T_ambient")]) if "T_ambient" in inputs else 20.0
