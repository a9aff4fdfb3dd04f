"""Load-independent losses of dipping gears: the independent evaluation's table for the FZG rig at 60 degC."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.formulas.geometry import GearPair, gear_pair
from models.losses.churning import ChurningLaw, churning_changenet_2011, churning_changenet_velex

GEARBOX = load_gearbox("fzg").with_values({"oil.volume_l": 1.0})
PAIR = GEARBOX.stage[0].pair()
V_T = np.array([1.0, 2.0, 5.0, 8.3, 15.0, 20.0])
SPEED = V_T / PAIR.r_w[0] * 30.0 / np.pi


@pytest.mark.parametrize(
    ("model", "watts", "half_digit"),
    [
        ("niemann", [0.3, 0.9, 3.6, 7.7, 18.7, 28.7], 0.05),
        ("mauz", [8.0, 17.0, 45.0, 82.0, 178.0, 272.0], 0.55),
    ],
)
def test_table_of_the_rig(model: str, watts: list[float], half_digit: float) -> None:
    losses = GEARBOX.with_values({"stage.0.churning.model": model}).losses()
    loss = losses.breakdown(speed=SPEED, torque=94.0, temperatures=60.0)["churning"]
    assert loss == pytest.approx(watts, abs=half_digit)


@pytest.mark.parametrize(
    ("model", "watts"),
    [
        ("changenet_velex", [0.49, 1.47, 6.31, 21.1, 57.8, 82.6]),
        ("changenet_2011", [0.49, 1.47, 6.47, 16.1, 55.1, 82.6]),
    ],
)
def test_changenet_on_the_rig(model: str, watts: list[float]) -> None:
    """A second evaluation of the formulas, by other hands: 0.9 l at 60 degC."""
    losses = GEARBOX.with_values({"stage.0.churning.model": model, "oil.volume_l": 0.9}).losses()
    loss = losses.breakdown(speed=SPEED, torque=94.0, temperatures=60.0)["churning"]
    assert loss == pytest.approx(watts, rel=0.01)


def test_the_regimes_of_2011_meet_on_a_wheel_on_which_those_of_2007_do_not() -> None:
    """The conveyor at 1500 1/min, where Re of its wheel reaches 6000 to 9000 in hot oil."""
    oil = np.arange(60.0, 131.0, 5.0)
    worst = {}
    for model in ("changenet_velex", "changenet_2011"):
        losses = load_gearbox("conveyor").with_values({"stage.0.churning.model": model}).losses()
        churning = losses.breakdown(speed=1500.0, torque=100.0, temperatures=oil)["churning"]
        worst[model] = float(np.max(churning[1:] / churning[:-1]))
    assert worst["changenet_velex"] > 1.5 and worst["changenet_2011"] <= 1.0


MODELS = ("niemann", "niemann_printed", "mauz", "changenet_velex", "changenet_2011")


def churning(pair: GearPair, model: str, speed: float, level_below_axis: float) -> float:
    """Loss in W at a speed in 1/min of the first gear."""
    law = ChurningLaw(
        pair=pair,
        oil=GEARBOX.lubricant(),
        model=model,
        level_below_axis=(level_below_axis, level_below_axis),
        oil_volume=1e-3,
    )
    return float(law.power(np.array([[speed, 60.0]]))[0, 0])


@pytest.mark.parametrize("model", MODELS)
def test_which_gear_drives_does_not_matter(model: str) -> None:
    turned = gear_pair(z=PAIR.z[::-1], m_n=PAIR.m_n, alpha_n=PAIR.alpha_n, b=PAIR.b, a=PAIR.a, x=PAIR.x[::-1])
    here = churning(PAIR, model, 2000.0, 0.02)
    assert churning(turned, model, 2000.0 / PAIR.u, 0.02) == pytest.approx(here, rel=1e-12) and here > 1.0


@pytest.mark.parametrize("model", MODELS)
def test_a_gear_under_oil_is_under_oil(model: str) -> None:
    """Above the tip circles a level changes nothing."""
    full = -2.0 * max(PAIR.r_a)
    assert churning(PAIR, model, 2000.0, full) == churning(PAIR, model, 2000.0, 1.5 * full)
    assert churning(PAIR, model, 2000.0, full) > churning(PAIR, model, 2000.0, 0.0)


def test_mauz_is_refused_for_wide_gears() -> None:
    with pytest.raises(InputError, match="cube of the face width and is refused beyond 60 mm; take 'changenet_2011'"):
        GEARBOX.with_values({"stage.0.churning.model": "mauz", "stage.0.face_width_mm": 61.0})


def test_flanks_of_helical_teeth_are_longer() -> None:
    """Of the wetted area they alone go with the helix angle: ``2 z H theta b / (pi cos(alpha_t) cos(beta))``."""
    at: dict[str, Any] = {"h": 0.02, "r_p": 0.05, "b": 0.014, "z": 24, "alpha": 0.35, "V_oil": 1e-3}
    at |= {"omega": 20.0, "nu": 15.41, "rho": 848.0}
    for churning in (churning_changenet_velex, partial(churning_changenet_2011, module=4.5e-3)):
        bare, spur, helical = (
            float(churning(**at, tooth_height=height, beta=beta))
            for height, beta in ((0.0, 0.0), (0.01, 0.0), (0.01, 0.5))
        )
        assert (helical - bare) / (spur - bare) == pytest.approx(1.0 / np.cos(0.5), rel=1e-9)
