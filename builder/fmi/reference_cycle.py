"""The 600 s drive cycle that every build is tried on, after the kind of the paper's fig. 10."""

from __future__ import annotations

import numpy as np

from models.assembly.gearbox import Gearbox
from models.files.cycle import Cycle
from models.quantities.quantities import GEARBOX_INPUTS, Input

# time [s], speed and torque as shares of the upper training bounds: cold start at low load, a phase of constant power,
# high torque, and back to the load of the start. The paper prints the curve without numbers.
KNOTS = np.array([
    [0.0, 0.08, 0.06],
    [60.0, 0.08, 0.06],
    [90.0, 0.35, 0.25],
    [300.0, 0.35, 0.25],
    [330.0, 0.25, 0.80],
    [450.0, 0.25, 0.80],
    [480.0, 0.08, 0.06],
    [600.0, 0.08, 0.06],
])  # fmt: skip
COLD_START = 20.0  # degC
WARMER = 20.0  # K, of surroundings with geometry: networks of losses have a range of temperatures
# Of inputs that the definition names, without geometry of all: time [s] and share of the way from default to level.
RAMP = np.array([[0.0, 0.0], [60.0, 0.0], [120.0, 1.0], [420.0, 1.0], [480.0, 0.0], [600.0, 0.0]])


def reference_cycle(gearbox: Gearbox, *, step_s: float = 1.0) -> Cycle:
    """The reference cycle of a gearbox: speed and torque scaled to its training bounds, 20 degC, the usual air speed.

    Inputs that a definition names go from their defaults to a level and back: one with a range of the definition
    halfway to the bound that is further away, with geometry temperatures by 20 K. Without geometry speed and torque go
    to their typical operation so.

    Parameters
    ----------
    gearbox : Gearbox
    step_s : float
        Distance of the rows, [s]; a divisor of 600

    Returns
    -------
    Cycle
        600 s at 20 degC ambient

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> cycle = reference_cycle(load_gearbox("fzg"))
    >>> len(cycle), float(cycle.inputs["torque"].max())
    (601, 280.0)
    """
    time = np.linspace(0.0, KNOTS[-1, 0], round(KNOTS[-1, 0] / step_s) + 1)
    share = np.interp(time, RAMP[:, 0], RAMP[:, 1])
    courses = {name: low + share * (level - low) for name, (low, level) in _levels(gearbox).items()}
    if gearbox.is_parametric:
        return Cycle(time, courses)
    bounds = {"speed": gearbox.training.speed_rpm[1], "torque": gearbox.training.torque_Nm[1]}
    courses |= {name: np.interp(time, KNOTS[:, 0], KNOTS[:, i]) * bounds[name] for i, name in enumerate(bounds, 1)}
    return Cycle(time, courses | {"T_ambient": np.full_like(time, COLD_START)})


def _levels(gearbox: Gearbox) -> dict[str, tuple[float, float]]:
    """Default and level of every input."""
    typical = dict(zip(("speed", "torque"), gearbox.typical_operation, strict=True))
    return {
        name: (given.default, typical[name] if name in typical else _inside(given, nearby=not gearbox.is_parametric))
        for name, given in gearbox.network().inputs.items()
    }


def _inside(given: Input, *, nearby: bool) -> float:
    """A value inside the range of an input and away from its default; the default where there is no range.

    Parameters
    ----------
    nearby : bool
        True for a temperature that is 20 K warmer at most
    """
    low, high = given.quantity.low, given.quantity.high
    if given.name in GEARBOX_INPUTS or not np.isfinite(high - low):
        return given.default
    if nearby and given.quantity.is_temperature:
        return min(given.default + WARMER, high)
    return 0.5 * (given.default + (high if high - given.default >= given.default - low else low))
