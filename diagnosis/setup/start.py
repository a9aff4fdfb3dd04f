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
# A machine that stood still has one temperature, up to a share of what it is above the air. On 8 machines of a stranger
# 0.5 K has 7 to 32 nat more evidence than starts that follow the thermometers, and 0.2 to 0.3 K some nat more yet; but
# simulated plants start more evenly than real ones.
ISOTHERMAL_K, ISOTHERMAL_SHARE = 0.3, 0.1


def start_guess(model: NetworkOnGrid, piece: Piece) -> Array:
    """Start temperatures, shape (parts,), [degC]: the median if all agree; else as measured, or the mean of what is."""
    first, ambient = _first_readings(model, piece), _ambient(model, piece)
    if is_isothermal([*first.values()], ambient):
        return np.full(model.n, float(np.median([*first.values()])))
    middle = float(np.mean([*first.values()])) if first else ambient
    return np.array([first.get(name, middle) for name in model.parts])


def start_covariance(model: NetworkOnGrid, piece: Piece) -> Array:
    """Covariance of the start temperatures about :func:`start_guess`, shape (parts, parts), [K^2]."""
    first, ambient = _first_readings(model, piece), _ambient(model, piece)
    if is_isothermal([*first.values()], ambient):
        apart = ISOTHERMAL_K + ISOTHERMAL_SHARE * abs(float(np.median([*first.values()])) - ambient)
        return np.asarray(apart**2 * np.eye(model.n) + MEASURED_K**2)
    unmeasured = UNMEASURED_K + UNMEASURED_SHARE * abs(max(first.values(), default=50.0) - ambient)
    return np.diag([(MEASURED_K if name in first else unmeasured) ** 2 for name in model.parts])


def _first_readings(model: NetworkOnGrid, piece: Piece) -> Mapping[str, float]:
    """The first reading of every part that is measured, [degC]."""
    first: dict[str, float] = {}
    for index, name in enumerate(piece.channels):
        seen = piece.measured[:, index]
        seen = seen[np.isfinite(seen)]
        if not is_total_loss(name) and len(seen):
            first.setdefault(node_of_channel(name, model.parts), float(seen[0]))
    return first


def _ambient(model: NetworkOnGrid, piece: Piece) -> float:
    inputs = model.laws.inputs
    return float(piece.inputs[0, inputs.index("T_ambient")]) if "T_ambient" in inputs else 20.0
