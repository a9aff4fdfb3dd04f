"""Parameters and shapes that the laws of the catalogue share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

from models.mechanisms.mechanism import Memory
from models.mechanisms.scale import Scale
from models.network.laws import Parameter

LARGEST = 100.0  # strength, in standard deviations of its prior
SMALLEST_FACTOR = -0.95  # of a relative change: a loss or conductance never turns round
MOMENTS = ("moment", "noon", "onset")  # names of moments
DURING = (0.01, 0.03, 0.08, 0.2, 0.4, 0.55, 0.7, 0.85)  # of a recording: where a search for a moment starts
RUNNING = 20.0  # sharpness of what begins with the shafts: from about a tenth of the reference speed it is all there
ONCE = 6.0  # durations of a recording, after which what happened once would come again
SOFT_K = 0.3  # width of a switch that is seen in means over minutes
EDGE_S = 120.0  # half of the time that damage or an oil change takes to come
# Of shapes by name and unit. Speeds, torques and viscosities in the laws are relative to those of reference.
MEANINGS = {
    ("above", "K"): "air at the gearbox above the outdoor air",
    ("band", "K"): "between switching on and off, or from closed to open",
    ("colder", "K"): "water below the air",
    ("coolant", "degC"): "temperature of the coolant",
    ("delay", "s"): "time constant of the valve",
    ("drying", "s"): "time constant of drying",
    ("every", "s"): "time after which it comes again",
    ("exponent", "1"): "exponent of the speed, or of the law's other driver",
    ("fade", "1"): "relative speed times viscosity at which half of it is left",
    ("feet", "1"): "conductance of the feet over that from the foundation to the air",
    ("film", "1"): "how fast it falls with the speed, which makes the film",
    ("lag", "s"): "time constant",
    ("leak", "1"): "heat flow of the tank to the air over that of the oil",
    ("length", "s"): "how long it lasts",
    ("life", "s"): "time constant of the change",
    ("load_share", "1"): "share that grows with the torque",
    ("moment", "s"): "time since the start of the recording",
    ("neighbour", "degC"): "temperature of the neighbour",
    ("noon", "h"): "hour of the day (UTC) at which it is at its height",
    ("noon", "s"): "time of the most sun, since the start of the recording",
    ("onset", "1"): "relative speed at which it begins",
    ("onset", "s"): "time of the first one, since the start of the recording",
    ("period", "s"): "duration of one swing",
    ("phase", "rad"): "phase at the start of the recording",
    ("rise", "K"): "rise of the motor above the air at the reference torque",
    ("running", "1"): "share of its power while the gearbox turns",
    ("set_point", "degC"): "middle of the band",
    ("speed_exponent", "1"): "exponent of the speed",
    ("standstill", "1"): "share of the flow at standstill",
    ("still", "1"): "conductance at standstill, in that at the reference speed",
    ("supply", "degC"): "temperature of the injected oil",
    ("switch", "1"): "relative speed, or speed over viscosity, at which half of it is there",
    ("threshold", "K"): "shaft above housing from which the clearance is used up",
    ("water", "degC"): "temperature of the water",
}


def strength(sd: float, unit: str = "1", description: str = "") -> Parameter:
    """The parameter that a law is linear in; 0 is absence, `sd` the size that the effect typically has."""
    lower = SMALLEST_FACTOR if unit == "1" else -LARGEST * sd
    return Parameter(
        name="strength", unit=unit, start=0.0, lower=lower, upper=LARGEST * sd, sd=sd, log=False,
        description=description,
    )  # fmt: skip


def positive(name: str, start: float, *, sd: float, unit: str = "1", grid: Sequence[float] = ()) -> Parameter:
    """A positive shape parameter; `sd` of its logarithm."""
    return Parameter(
        name=name, unit=unit, start=start, lower=start / 50.0, upper=start * 50.0, sd=sd, log=True, grid=tuple(grid),
        description=MEANINGS.get((name, unit), ""),
    )  # fmt: skip


def plain(
    name: str, start: float, *, sd: float, lower: float, upper: float, unit: str = "1", grid: Sequence[float] = ()
) -> Parameter:
    """A shape parameter that is no factor: an exponent, a temperature."""
    return Parameter(
        name=name, unit=unit, start=start, lower=lower, upper=upper, sd=sd, log=False, grid=tuple(grid),
        description=MEANINGS.get((name, unit), ""),
    )  # fmt: skip


def temperature(
    name: str, start: float, *, sd: float, lower: float = -60.0, upper: float = 250.0, grid: Sequence[float] = ()
) -> Parameter:
    """A temperature [degC] as a shape parameter."""
    return plain(name, start, sd=sd, lower=lower, upper=upper, unit="degC", grid=grid)


def moment(scale: Scale, name: str = MOMENTS[0]) -> Parameter:
    """A moment within a recording, [s] since its start; by one of the names :data:`MOMENTS`."""
    d = scale.duration
    grid = [share * d for share in DURING]
    return plain(name, 0.4 * d, sd=0.3 * d, lower=-d, upper=3.0 * d, unit="s", grid=grid)


def length(scale: Scale, *shares: float) -> Parameter:
    """How long something lasts, [s]; `shares` of the duration to start from."""
    grid = [share * scale.duration for share in shares]
    return positive("length", grid[len(grid) // 2], sd=0.8, unit="s", grid=grid)


def period(scale: Scale) -> Parameter:
    """After which time something comes again, [s]; by default not within a recording."""
    d = scale.duration
    return Parameter(
        name="every", unit="s", start=ONCE * d, lower=0.05 * d, upper=2.0 * ONCE * d, sd=1.5, log=True,
        sweep=(0.12 * d, 0.6 * d), description=MEANINGS["every", "s"],
    )  # fmt: skip


def rises(value: Any, *, at: Any, power: float) -> sp.Expr:
    """A switch of a value >= 0, from 0 through 1/2 `at` to 1; the higher the `power` the sharper."""
    return value**power / (value**power + at**power)


def steps(value: Any, *, at: Any, width: float) -> sp.Expr:
    """A switch from 0 through 1/2 `at` to 1 within about four `width`."""
    return (1.0 + sp.tanh((value - at) / width)) / 2.0


def hysteresis(value: Any, state: Any, *, at: Any, band: Any, above: float) -> sp.Expr:
    """A two-point switch around `at`: `above` (0 or 1) beyond the band, ``1 - above`` below it, between as it was."""
    # All on one side: with terms on both, sympy 1.14 turns some conditions round and round without end.
    return sp.Piecewise((above, value - at - band / 2 > 0), (1.0 - above, value - at + band / 2 < 0), (state, True))


def soft_hysteresis(value: Any, state: Any, *, at: Any, band: Any, above: float, width: float) -> sp.Expr:
    """A two-point switch around `at` that does not switch at a point but within about four `width` of it.

    For means over minutes, in which the moment of switching is not seen.
    """
    high = (1.0 + sp.tanh((value - at - band / 2) / width)) / 2.0
    low = (1.0 - sp.tanh((value - at + band / 2) / width)) / 2.0
    on, off = (high, low) if above else (low, high)
    return state + (1.0 - state) * on - state * off


def two_point(name: str, *, reads: str = "T_oil", above: float = 1.0) -> Memory:
    """Return the memory of a two-point control around `set_point`: `above` beyond its `band`, else ``1 - above``."""

    def control(s: Any) -> dict[str, Any]:
        return {"value": getattr(s, reads), "state": getattr(s, name), "at": s.set_point, "band": s.band,
                "above": above}  # fmt: skip

    return Memory(
        name=name,
        update=lambda s: hysteresis(**control(s)),
        averaged_update=lambda s: soft_hysteresis(**control(s), width=SOFT_K),
    )


def share_between(scale: Scale, share: float) -> float:
    """A temperature [degC] at a share of the way from ambient to the hot oil."""
    return scale.ambient + share * (scale.temperature - scale.ambient)


def share(description: str) -> Parameter:
    """A strength from 0 to 1, where 1 is the usual case."""
    return Parameter(name="strength", start=0.0, lower=0.0, upper=1.0, sd=1.0, log=False, description=description)
