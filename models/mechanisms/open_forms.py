"""Forms for what is in no catalogue: a heat in any part, or a conductance to the air, as a function of the signals.

They are scored with the catalogue and have to beat it clearly: a law that an engineer knows is worth more than a form.
None is physics; each shows which signal the heat varies with, so that someone may recognise it: monomials and hinges as
in sparse regression, peaks, and responses that follow a change or fade, which no function of the present can describe.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from models.mechanisms.forms import plain, positive, share_between, strength
from models.mechanisms.mechanism import Mechanism, Memory
from models.mechanisms.scale import TYPICAL_RISE, Scale
from models.network.laws import LawLike, Parameter

OPEN_FORM = "open form"  # their family
PLACES = ("each parts",)
TYPICAL_SHARE = 0.1  # of the typical loss or conductance
STANDING = 0.02  # of the reference speed
LATER_S = (300.0, 1200.0, 4800.0)  # after which a change is forgotten
DAY_S = 86400.0
DAYTIMES = (0.0, 0.125, 0.25, 0.375)  # of a day; half a day later is the other sign

Shapes = Callable[[Scale], tuple[Parameter, ...]]


def _nothing(_: Scale) -> tuple[Parameter, ...]:
    return ()


def _ratio(name: str, *grid: float) -> Shapes:
    """A speed or torque in ratio to the reference."""
    middle = grid[len(grid) // 2]
    return lambda _: (plain(name, middle, sd=0.3, lower=STANDING, upper=2.0, grid=grid),)


def _temperature(name: str, *shares: float) -> Shapes:
    """A temperature, at shares of the way from ambient to the hot oil."""

    def shapes(scale: Scale) -> tuple[Parameter, ...]:
        grid = tuple(share_between(scale, share) for share in shares)
        sd = share_between(scale, 0.3) - scale.ambient
        return (plain(name, grid[len(grid) // 2], sd=sd, lower=-60.0, upper=250.0, unit="degC", grid=grid),)

    return shapes


def _width(kelvin: bool) -> Shapes:
    start, unit = (5.0, "K") if kelvin else (0.08, "1")
    return lambda _: (positive("width", start, sd=0.7, unit=unit, grid=() if kelvin else (0.04, 0.12)),)


def _later(_: Scale) -> tuple[Parameter, ...]:
    return (positive("forgets", LATER_S[1], sd=1.0, unit="s", grid=LATER_S),)


def _life(scale: Scale) -> tuple[Parameter, ...]:
    grid = tuple(share * scale.duration for share in (0.05, 0.15, 0.5))
    return (positive("life", grid[1], sd=0.8, unit="s", grid=grid),)


def _day(_: Scale) -> tuple[Parameter, ...]:
    return (plain("daytime", 0.25, sd=0.3, lower=-1.0, upper=2.0, grid=DAYTIMES),)


def _all(*several: Shapes) -> Shapes:
    return lambda scale: tuple(p for shapes in several for p in shapes(scale))


def _peak(value: Any, at: Any, width: Any) -> sp.Expr:
    return sp.exp(-(((value - at) / width) ** 2))


def _rise(s: Any) -> sp.Expr:
    """Temperature rise above the surroundings, as a ratio to a typical one."""
    return (s.T_here - s.ambient_ref) / TYPICAL_RISE


def _running(s: Any) -> sp.Expr:
    return s.n / (s.n + STANDING)


def _recent(of: Callable[[Any], sp.Expr]) -> tuple[Memory, ...]:
    """The mean of a signal over the recent past, the older the less it counts."""
    return (Memory(name="recent", rate=lambda s: (of(s) - s.recent) / s.forgets),)


def _form(
    name: str, goes_with: str, law: Callable[[Any], Any], shapes: Shapes = _nothing, states: tuple[Memory, ...] = (),
) -> tuple[Mechanism, Mechanism]:  # fmt: skip
    """A form as heat from elsewhere, and as mechanical loss, which a gearbox that stands does not have."""

    def lost(s: Any) -> sp.Expr:
        return law(s) * _running(s)

    def heat(*, is_loss: bool) -> Mechanism:
        return _open(
            name=f"open_{name}_loss" if is_loss else f"open_{name}", kind="source", is_loss=is_loss,
            law=lost if is_loss else law,
            size=lambda scale: strength(TYPICAL_SHARE * scale.loss, "W"), shapes=shapes, states=states,
            says=f"{'A loss' if is_loss else 'A heat'} in {{place}} goes with {goes_with}; no known mechanism.",
        )  # fmt: skip

    return heat(is_loss=False), heat(is_loss=True)


def _conductance(name: str, goes_with: str, law: Callable[[Any], Any]) -> Mechanism:
    return _open(
        name=f"open_conductance_{name}", kind="link", law=law, other="air", shapes=_nothing,
        size=lambda scale: strength(TYPICAL_SHARE * scale.conductance, "W/K"),
        says=f"A conductance from {{place}} to the air goes with {goes_with}; no known mechanism.",
    )  # fmt: skip


def _open(*, law: Callable[[Any], Any], size: Callable[[Scale], Parameter], shapes: Shapes, **given: Any) -> Mechanism:
    def whole(s: Any) -> LawLike:
        return s.strength * law(s)

    return Mechanism(
        family=OPEN_FORM, places=PLACES, sign=0, law=whole, parameters=lambda scale: (size(scale), *shapes(scale)),
        reference="none: a form, not physics",
        experiment="repeat the operation in which it acts, one input changed at a time", **given,
    )  # fmt: skip


HEATS = (
    _form("constant", "nothing", lambda _: sp.Integer(1)),
    _form("speed", "the speed", lambda s: s.n),
    _form("speed_squared", "the speed squared", lambda s: s.n**2),
    _form("torque", "the torque", lambda s: s.m),
    _form("power", "the power", lambda s: s.n * s.m),
    _form("temperature", "the temperature", _rise),
    _form("time", "the time", lambda s: s.x),
    _form("speed_above", "the speed above a limit", lambda s: sp.Max(s.n - s.limit, 0),
          _ratio("limit", 0.25, 0.5, 0.75)),
    _form("speed_below", "the speed below a limit", lambda s: sp.Max(1 - s.n / s.limit, 0) * _running(s),
          _ratio("limit", 0.15, 0.3, 0.6)),
    _form("temperature_above", "the temperature above a limit", lambda s: sp.Max(s.T_here - s.limit, 0) / TYPICAL_RISE,
          _temperature("limit", 0.25, 0.5, 0.75)),
    _form("speed_near", "one speed", lambda s: _peak(s.n, s.centre, s.width),
          _all(_ratio("centre", 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.05), _width(kelvin=False))),
    _form("temperature_near", "one temperature", lambda s: _peak(s.T_here, s.centre, s.width),
          _all(_temperature("centre", 0.2, 0.4, 0.6, 0.8), _width(kelvin=True))),
    _form("standstill", "standstill", lambda s: sp.Max(1 - s.n / STANDING, 0)),
    _form("after_faster", "a rise of the speed, for a while", lambda s: sp.Max(s.n - s.recent, 0), _later,
          _recent(lambda s: s.n)),
    _form("after_slower", "a fall of the speed, for a while", lambda s: sp.Max(s.recent - s.n, 0), _later,
          _recent(lambda s: s.n)),
    _form("after_torque", "a change of the torque, for a while", lambda s: sp.Abs(s.m - s.recent), _later,
          _recent(lambda s: s.m)),
    _form("fading", "the time since the start, and fades", lambda s: sp.exp(-s.time / s.life), _life),
    _form("fading_temperature", "the temperature, and fades", lambda s: _rise(s) * sp.exp(-s.time / s.life),
          _life),
    _form("day", "the time of day", lambda s: sp.sin(2 * sp.pi * (s.time / DAY_S + s.daytime)), _day),
)  # fmt: skip
CONDUCTANCES = (
    _conductance("speed", "the speed", lambda s: s.n),
    _conductance("temperature", "the temperature", _rise),
)
# A loss at standstill is none; one that goes with the power is the mesh's own, whose formula is never exactly right.
NO_FORMS = ("open_standstill_loss", "open_power_loss")
OPEN_FORMS = (*(form for both in HEATS for form in both if form.name not in NO_FORMS), *CONDUCTANCES)
