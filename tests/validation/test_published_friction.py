"""Published friction and viscosity: GEARpie's spur reference cases, FEUP's oil tables, FZG load stages.

GEARpie (cfernandesFEUP, University of Porto) prints, for a pair, load, speed and oil, the mean friction after Schlenk,
the gear loss factor of its load sharing ("HVL_Wimmer") and the mesh loss ``Pin * HVL * mu``. Its symbols are ours with
XL = X_L, miu = eta, and the roughness as the mean of both flanks: Ra = 0.4 and 0.31 um for C14 and C40 in its gear
library, X_L = 0.846 for its mineral oils (printed as 0.85). C14 and C40 come without addendum reduction. For the pair
REP it publishes no roughness; its two cases differ in speed only, so both must give the same one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from models.assembly.gearbox import Gearbox, load_gearbox
from models.formulas.load_sharing import contact_points, load_sharing_loss_factor
from models.losses.friction import friction_schlenk


@dataclass(frozen=True)
class Case:
    """One row of GEARpie's reference cases, in its units."""

    b_mm: float
    tip_shortening: bool
    X_L: float
    eta_mPas: float
    T_1: float
    n_1: float
    P_in: float
    HVL: float
    mu: float
    P_VZP: float


CASES = {
    "C14": Case(14.0, False, 0.846, 13.28, 200.0, 1500.0, 31415.9, 0.1946, 0.0449, 274.37),
    "C40": Case(40.0, False, 0.65, 49.85, 215.5, 1800.0, 40623.2, 0.1984, 0.0256, 206.31),
    "REP": Case(14.0, True, 0.65, 11.83, 171.6, 300.0, 5390.5, 0.1914, 0.0421, 43.40),
    "REP2": Case(14.0, True, 0.65, 11.83, 171.6, 1875.0, 33690.6, 0.1914, 0.0292, 188.02),
}
RA_C = 0.5 * (0.4 + 0.31)
RA_REP = 0.24  # um, not published; see test_rep_needs_one_roughness


def gearbox_of(case: Case) -> Gearbox:
    return load_gearbox("fzg").with_values(
        {
            "stage.0.face_width_mm": case.b_mm,
            "stage.0.profile_shift": (0.1817, 0.1715),
            "stage.0.tip_shortening": case.tip_shortening,
        }
    )


def friction_of(case: Case, Ra_um: float) -> float:
    pair = gearbox_of(case).stage[0].pair()
    mu = friction_schlenk(
        F_bt_per_b=case.T_1 / pair.r_b[0] / pair.b,
        v_sum_C=2.0 * case.n_1 * np.pi / 30.0 * pair.T1C,
        rho_red_C=pair.rho_red_C,
        eta_oil=case.eta_mPas * 1e-3,
        Ra=Ra_um * 1e-6,
        X_L=case.X_L,
    )
    return float(mu)


def loss_factor_of(case: Case) -> float:
    stage = gearbox_of(case).stage[0]
    pair = stage.pair()
    points = contact_points(pair, model="potential_energy", r_bore=stage.bore_radius)
    return load_sharing_loss_factor(pair, points)


@pytest.mark.parametrize("name", ["C14", "C40"])
def test_schlenk_friction(name: str) -> None:
    """To the printed digits."""
    case = CASES[name]
    assert friction_of(case, RA_C) == pytest.approx(case.mu, abs=5.1e-5)


@pytest.mark.parametrize("name", ["C14", "C40"])
def test_mesh_loss_with_the_printed_loss_factor(name: str) -> None:
    """Half a unit of the printed loss factor's last digit."""
    case = CASES[name]
    loss = case.T_1 * case.n_1 * np.pi / 30.0 * case.HVL * friction_of(case, RA_C)
    assert loss == pytest.approx(case.P_VZP, rel=0.5e-4 / case.HVL + 1e-4)


def test_rep_needs_one_roughness() -> None:
    """The loss is printed with more digits than the friction: from it, both speeds imply Ra = 0.240 um."""
    for name in ("REP", "REP2"):
        case = CASES[name]
        implied = case.P_VZP / (case.P_in * case.HVL)
        assert (implied / friction_of(case, 1.0)) ** 4 == pytest.approx(RA_REP, rel=4 * 0.5e-4 / case.HVL + 5e-4)


@pytest.mark.parametrize("name", ["REP", "REP2"])
def test_rep_friction_with_that_roughness(name: str) -> None:
    assert friction_of(CASES[name], RA_REP) == pytest.approx(CASES[name].mu, abs=5.1e-5)


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        ("C14", 5.1e-5),
        ("REP", 3e-4),  # its profile shifts are not published
    ],
)
def test_loss_factor_of_the_load_share(name: str, tolerance: float) -> None:
    assert loss_factor_of(CASES[name]) == pytest.approx(CASES[name].HVL, abs=tolerance)


def test_loss_factor_of_wide_teeth_is_that_of_narrow_ones() -> None:
    """Unlike GEARpie's, whose C40 lies near rigid teeth: ours has one stiffness per face width, whatever the width."""
    assert loss_factor_of(CASES["C40"]) == pytest.approx(loss_factor_of(CASES["C14"]), rel=1e-6)
    assert CASES["C40"].HVL - loss_factor_of(CASES["C40"]) == pytest.approx(0.0038, abs=1e-4)


def test_whole_model_reproduces_c14() -> None:
    """The loss model with Schlenk's friction, fed the case's oil viscosity at the gears, gives GEARpie's mesh loss."""
    case = CASES["C14"]
    gearbox = gearbox_of(case).with_values(
        {"stage.0.friction.model": "schlenk", "stage.0.roughness_Ra_um": (0.4, 0.31), "oil.schlenk_X_L": 0.846}
    )
    losses = gearbox.losses()
    T = np.linspace(40.0, 90.0, 5001)
    eta = gearbox.lubricant().dynamic_viscosity(T)
    T_case = float(np.interp(-case.eta_mPas * 1e-3, -eta, T))
    sliding = losses.breakdown(speed=case.n_1, torque=case.T_1, temperatures=T_case)["mesh_sliding"]
    assert sliding == pytest.approx(case.P_VZP, rel=5e-4)
