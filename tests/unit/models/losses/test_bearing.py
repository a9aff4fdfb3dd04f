"""SKF's friction model: the worked NU 406, its parts by hand, its limits, and the oil temperature of eq. (8)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox
from models.losses.bearing import OIL_FLOW_HEAT, SkfBearing, oil_flow_max

GEARBOX = load_gearbox("fzg")
OIL = GEARBOX.lubricant()
NU_406 = GEARBOX.losses().term("bearing_1").law.bearing


def watts(bearing: SkfBearing, n: float, F_r: float, T_oil: float, T_bearing: float) -> float:
    one = np.ones(1)
    loss = bearing.loss(n_rpm=n * one, F_r=F_r * one, T_oil=T_oil * one, T_bearing=T_bearing * one, oil=OIL)
    return float(loss[0])


def test_rolling_and_sliding_moment_by_hand() -> None:
    n, F_r, nu = 1000.0, 2000.0, 30.0
    starvation = 1 / (1 + 1.84e-9 * (n * 60) ** 1.28 * nu**0.64)
    replenishment = np.exp(-3e-8 * nu * n * 120 * np.sqrt(5.1 / 120))
    mixed = np.exp(-2.6e-8 * (n * nu) ** 1.4 * 60)
    M_rr, M_sl, _ = NU_406.friction_moments(n_rpm=n, F_r=F_r, nu=nu)
    assert M_rr == pytest.approx(starvation * replenishment * 1e-6 * 60**2.41 * F_r**0.31 * (nu * n) ** 0.6, rel=1e-12)
    assert M_sl == pytest.approx(0.0015 * 60 * F_r * (0.12 * mixed + 0.02 * (1 - mixed)), rel=1e-12)


def test_sliding_friction_goes_from_boundary_to_full_film() -> None:
    slow = NU_406.friction_moments(n_rpm=1e-3, F_r=1000.0, nu=15.0)[1]
    fast = NU_406.friction_moments(n_rpm=1e5, F_r=1000.0, nu=15.0)[1]
    assert slow == pytest.approx(0.0015 * 60 * 1000 * 0.12, rel=1e-4)
    assert fast == pytest.approx(0.0015 * 60 * 1000 * 0.02, rel=1e-9)


def drag(bearing: SkfBearing, n: float = 2000.0, nu: float = 15.0) -> float:
    return float(bearing.friction_moments(n_rpm=n, F_r=1000.0, nu=nu)[2])


def test_drag_grows_no_more_once_the_bearing_is_under_oil() -> None:
    assert drag(replace(NU_406, H=500.0)) == drag(replace(NU_406, H=72.0)) > drag(replace(NU_406, H=36.0))


def test_drag_of_the_older_edition_is_its_one_term() -> None:
    """``10 V_M K_roll B d_m^4 n^2`` with V_M = 4.29e-4 and K_roll = 6.63e-12; no viscosity."""
    old = replace(NU_406, drag="2008")
    assert drag(old, 2165.7) == pytest.approx(10 * 4.29e-4 * 6.63e-12 * 23 * 60**4 * 2165.7**2, rel=2e-3)
    assert drag(old, nu=15.0) == drag(old, nu=150.0)


def test_drag_viscosity_is_held_where_the_formula_ends() -> None:
    assert drag(NU_406, nu=500.0) > drag(NU_406, nu=400.0)
    assert drag(NU_406, nu=5000.0) == drag(NU_406, nu=500.0)
    deep = replace(NU_406, H=50.0)
    assert drag(deep, nu=5000.0) == drag(deep, nu=250.0)


@pytest.mark.parametrize("n", [100.0, 1500.0, 3000.0, 6500.0])
def test_oil_beyond_the_limit_starves_a_bearing_no_further(n: float) -> None:
    """Its rolling moment grows with nu^0.6 from there on; below, the catalogue's formula to the letter."""

    def rolling(nu: float, **changed: float) -> float:
        return float(replace(NU_406, **changed).friction_moments(n_rpm=n, F_r=4463.0, nu=nu)[0])

    assert rolling(5000.0) / rolling(500.0) == pytest.approx(10.0**0.6, rel=1e-12)
    assert rolling(499.0) < rolling(499.0, K_rs=0.0)
    replenished = np.exp(-3e-8 * 400.0 * n * 120.0 * np.sqrt(5.1 / 120.0))
    assert rolling(400.0) / rolling(400.0, K_rs=0.0) == pytest.approx(replenished, rel=1e-12)


BALL_6208 = SkfBearing(
    type="deep_groove_ball", d=40, D=80, B=18, H=20, mass=0.37, R1=3.9e-7, S=3.23e-3, K_rs=3e-8, K_Z=3.1, K_L=0.0,
    mu_bl=0.12, mu_EHL=0.05,
)  # fmt: skip


def test_ball_bearing_of_a_worked_case() -> None:
    """6208 at 1500 1/min, 1500 N and 32 mm^2/s, worked by hand from the catalogue's table: N mm."""
    moments = BALL_6208.friction_moments(n_rpm=1500.0, F_r=1500.0, nu=32.0)
    assert [float(M) for M in moments] == pytest.approx([37.109, 11.006, 5.979], rel=5e-4)


def test_balls_roll_and_slide_by_other_powers_of_the_load() -> None:
    light, heavy = (BALL_6208.friction_moments(n_rpm=1500.0, F_r=F, nu=32.0) for F in (1000.0, 2000.0))
    assert heavy[0] / light[0] == pytest.approx(2.0**0.54, rel=1e-12)
    assert heavy[1] / light[1] == pytest.approx(2.0 ** (5.0 / 3.0), rel=1e-12)


def test_drag_of_balls_in_the_older_edition_is_its_one_term() -> None:
    """``V_M K_ball d_m^5 n^2`` with V_M = 4.144e-4 at H = d_m / 3 and K_ball = 3.1 * 120 / 40 * 1e-12."""
    old = replace(BALL_6208, drag="2008")
    assert drag(old) == pytest.approx(4.144e-4 * 9.3e-12 * 60**5 * 2000.0**2, rel=1e-3)
    assert drag(replace(old, H=0.0)) == 0.0


def test_own_weight_is_the_least_load() -> None:
    assert watts(NU_406, 1000.0, 0.0, 60.0, 60.0) == watts(NU_406, 1000.0, 2 * 0.75 * 9.80665, 60.0, 60.0) > 0.0


def test_mean_temperature_mode_reads_the_mean() -> None:
    assert watts(NU_406, 1000.0, 3000.0, 40.0, 80.0) == pytest.approx(watts(NU_406, 1000.0, 3000.0, 60.0, 60.0))


OUTLET = replace(NU_406, temperature="skf_outlet")


@pytest.mark.parametrize(
    ("n", "T_oil", "T_bearing"), [(2166.0, 40.0, 45.0), (5214.0, 60.0, 65.0), (5214.0, 90.0, 80.0)]
)
def test_outlet_mode_solves_the_printed_equation(n: float, T_oil: float, T_bearing: float) -> None:
    """Eq. (8): the oil leaves by what the bearing heats it, and the mean of in and out gives the viscosity."""
    loss = watts(OUTLET, n, 4463.0, T_oil, T_bearing)
    outlet = T_oil + (loss - 2.775 * (T_bearing - 27.0)) / (OIL_FLOW_HEAT * oil_flow_max(90.0, 23.0))
    T_mean = 0.5 * (T_oil + outlet)
    assert min(T_oil, T_bearing) - 10.0 < outlet < max(T_oil, T_bearing) + 60.0  # not held
    assert loss == pytest.approx(watts(NU_406, n, 4463.0, T_mean, T_mean), rel=5e-4)


def test_outlet_mode_is_held_off_equilibrium() -> None:
    """A bearing of 120 degC in oil of 20 degC: the print gives -14 degC out and 111 W; held at 10 degC out."""
    held = watts(OUTLET, 2166.0, 4463.0, 20.0, 120.0)
    assert held == pytest.approx(watts(NU_406, 2166.0, 4463.0, 15.0, 15.0), rel=1e-3)


def test_outlet_mode_is_finite_everywhere() -> None:
    T_oil, T_bearing, n, F = (a.ravel() for a in np.meshgrid([-60, 0, 100, 300], [-60, 50, 300], [1, 6500], [0, 5e3]))
    loss = OUTLET.loss(n_rpm=n, F_r=F, T_oil=T_oil, T_bearing=T_bearing, oil=OIL)
    assert np.all(np.isfinite(loss))
    assert np.all(loss > 0.0)


BALLS = SkfBearing(type="deep_groove_ball", d=40, D=80, B=18, H=0, mass=0.37, R1=3.9e-7, S=3.23e-3, K_rs=3e-8, K_Z=3.1,
                   K_L=0.0, mu_bl=0.12, mu_EHL=0.05, axial=500.0 / 1500.0, S_axial=36.5, C_0=19e3)  # fmt: skip
ROLLERS = SkfBearing(type="cylindrical_roller", d=50, D=90, B=23, H=0, mass=0.56, R1=1.4e-6, S=1.5e-3, K_rs=3e-8,
                     K_Z=5.1, K_L=0.65, mu_bl=0.12, mu_EHL=0.02, axial=1000.0 / 6000.0, S_axial=0.16)  # fmt: skip


TAPERS = SkfBearing(type="tapered_roller", d=40, D=68, B=19, H=0, mass=0.27, R1=2.38e-6, S=0.014, K_rs=3e-8, K_Z=6.0,
                    K_L=0.7, mu_bl=0.12, mu_EHL=0.002, axial=0.5, Y=1.6)  # fmt: skip


@pytest.mark.parametrize(
    ("bearing", "F_r", "M_rr", "M_sl"),
    [(BALLS, 1500.0, 80.303, 21.370), (ROLLERS, 6000.0, 340.0, 160.25), (TAPERS, 4000.0, 495.75, 10.644)],
)
def test_worked_cases_with_an_axial_load(bearing: SkfBearing, F_r: float, M_rr: float, M_sl: float) -> None:
    """A 6208 with 500 N along the shaft, an NJ 2210 with 1000 N, a 32008 X with 2000 N; 1500 1/min, 32 mm2/s."""
    found = bearing.friction_moments(n_rpm=1500.0, F_r=F_r, nu=32.0)
    assert [float(moment) for moment in found[:2]] == pytest.approx([M_rr, M_sl], rel=1e-4)


@pytest.mark.parametrize("bearing", [BALLS, ROLLERS, TAPERS])
def test_an_axial_load_costs_friction(bearing: SkfBearing) -> None:
    free, loaded = (
        [float(m) for m in replace(bearing, axial=axial).friction_moments(n_rpm=1500.0, F_r=2000.0, nu=32.0)]
        for axial in (0.0, 0.2)
    )
    assert loaded[1] > 1.1 * free[1]
    assert loaded[0] >= free[0]


def test_the_locating_bearing_takes_the_axial_force() -> None:
    """F_bt tan(beta_b) over its radial load; the others of the shaft have none, and spur gears make none."""
    helical = load_gearbox("helical")
    pair = helical.stage[0].pair()
    axial = {term.name: term.law.bearing.axial for term in helical.losses().terms if term.kind.name == "bearing"}
    assert axial["input_motor_side"] == axial["output_pump_side"] == 0.0
    # T tan(beta) / r by the reference circle is the same force.
    of_reference = np.tan(pair.beta) / pair.r[0] * pair.r_b[0] / 0.5
    assert axial["input_far_side"] == axial["output_far_side"] == pytest.approx(of_reference, rel=1e-12)
    spur = GEARBOX.with_values({"bearing.0.locating": True}).losses()
    assert spur.term("bearing_1").law.bearing.axial == 0.0


def test_taper_bearings_push_each_other() -> None:
    """SKF's cases: F_r / 2 Y each; the one that the gear pushes on carries the other's push and the gear's."""
    tapers = {f"bearing.{i}.designation": name for i, name in enumerate(("30208", "30208", "30211", "30211"))}
    helical = load_gearbox("helical").with_values(tapers)
    tilt = np.tan(helical.stage[0].pair().beta_b)
    axial = {term.name: term.law.bearing.axial * 0.5 for term in helical.losses().terms if term.kind.name == "bearing"}
    assert axial == {
        "input_motor_side": pytest.approx(0.25 / 1.6), "input_far_side": pytest.approx(0.25 / 1.6 + tilt),
        "output_far_side": pytest.approx(0.25 / 1.5 + tilt), "output_pump_side": pytest.approx(0.25 / 1.5),
    }  # fmt: skip
    # Without a helix angle the one with the larger push loads both.
    spurs: dict[str, str | float] = {f"bearing.{i}.designation": "32006" for i in range(4)}
    spur = GEARBOX.with_values(spurs | {"bearing.0.load_share": 0.7, "bearing.1.load_share": 0.3}).losses()
    loads = [spur.term(f"bearing_{i}").law.bearing.axial * share for i, share in ((1, 0.7), (2, 0.3))]
    assert loads == pytest.approx([0.35 / 1.4, 0.35 / 1.4])
    # The gear takes its force from the push of the locating bearing on the other one, if that push is large enough.
    for share in (0.1, 0.9):
        changes: dict[str, float] = {"bearing.0.load_share": 1.0 - share, "bearing.1.load_share": share}
        turned = helical.with_values(changes).losses()
        near = turned.term("input_motor_side").law.bearing.axial * (1.0 - share)
        far = turned.term("input_far_side").law.bearing.axial * share
        own = [0.5 * one / 1.6 for one in (1.0 - share, share)]
        assert (near, far) == pytest.approx((max(own[0], own[1] - tilt), max(own[1], own[0] + tilt)))
        assert (near > own[0]) is (share == 0.9)
