"""Friction in the mesh: contact states, film temperature, Schlenk's mean and the rolling loss."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox
from models.formulas import ehl
from models.formulas.load_sharing import contact_points, load_sharing_loss_factor
from models.losses.friction import ContactState, MeshContact, friction_schlenk

GEARBOX = load_gearbox("fzg")
LOSSES = GEARBOX.losses()
MESH = LOSSES.term("mesh").law
RPM = np.pi / 30.0


def solved(
    n: float = 2165.7, torque: float = 94.0, T_1: float = 70.0, T_2: float = 70.0, mesh: MeshContact = MESH
) -> ContactState:
    one = np.ones(1)
    return mesh.solve(omega_1=n * RPM * one, torque=torque * one, T_1=T_1 * one, T_2=T_2 * one)


def test_film_temperature_is_found_over_the_whole_design_space() -> None:
    """20 000 points: speed 1 to 6500 rpm (log), torque 1 to 350 N m, gears -20 to 200 degC; the claim is 0.01 K."""
    rng = np.random.default_rng(1)
    count, part = 20_000, 2_000
    n = np.exp(rng.uniform(0.0, np.log(6500.0), count))
    torque = rng.uniform(1.0, 350.0, count)
    T_1, T_2 = rng.uniform(-20.0, 200.0, (2, count))
    for i in range(0, count, part):
        rows = slice(i, i + part)
        state = MESH.solve(omega_1=n[rows] * RPM, torque=torque[rows], T_1=T_1[rows], T_2=T_2[rows])
        assert np.abs(state.residual).max() <= 0.01
        assert np.all(state.T_film >= state.T_in - 0.01)
        assert np.all((state.mu >= 0.0) & (state.mu <= max(MESH.mu_solid, 0.047)))


@pytest.mark.parametrize(("law", "own"), [("doleschel", "mean"), ("erf", "composite_rms"), ("diab", "composite_rms")])
def test_a_law_of_the_asperities_has_its_own_roughness(law: Any, own: Any) -> None:
    """Arana et al. 2019, Table 1: the mean Ra for Doleschel, the composite r.m.s. for the error functions."""
    x = np.array([[1500.0, 200.0, 80.0, 80.0]])
    loss = {
        of: replace(MESH, asperity_share=law, roughness=of).power(x)[0, 0]
        for of in ("of_the_law", "mean", "composite_rms")
    }
    assert loss["of_the_law"] == loss[own]
    assert loss["composite_rms"] > 1.02 * loss["mean"]


def test_contact_state_agrees_with_the_formulas_one_by_one() -> None:
    """The equations of the contact, written out again with the state's own film temperature."""
    state, oil = solved(T_1=80.0, T_2=60.0), MESH.oil
    omega = 2165.7 * RPM
    u_1, u_2 = omega * MESH.rho_1, omega / MESH.u * MESH.rho_2
    T_in = (u_1 * 80.0 + u_2 * 60.0) / (u_1 + u_2)
    assert state.T_in[0] == pytest.approx(T_in, rel=1e-12)
    b_H, p_H = ehl.hertz_line(state.F[0] / MESH.b, MESH.R, MESH.E_red)
    p_mean = np.pi / 4.0 * p_H
    share = np.maximum(1.0 - 0.5 * state.h[0] / (0.5 * sum(MESH.Ra)), 0.0) ** 2
    assert state.asperity_share[0] == pytest.approx(share, rel=1e-12)
    T_film = state.T_film[0]
    eta = oil.dynamic_viscosity(T_film) * np.exp(oil.pressure_viscosity_coefficient(T_film, p_mean) * p_mean)
    eyring = 2.0 * 0.047 / oil.pressure_viscosity_coefficient(T_film, p_H)
    mu_fluid = np.minimum(eyring / p_mean * np.arcsinh(eta * state.V_s[0] / (eyring * state.h[0])), 0.047)
    mu = share * MESH.mu_solid + (1.0 - share) * mu_fluid
    assert state.mu[0] == pytest.approx(mu, rel=1e-9)
    heat = mu * p_mean * state.V_s[0]
    flash = 1.06 * np.sqrt(u_1) / (np.sqrt(u_1) + np.sqrt(u_2)) / 46.0 * np.sqrt(MESH.chi_steel * b_H / u_1)
    rise = heat * (flash + state.h[0] / (8.0 * oil.conductivity(T_in)))
    assert pytest.approx(T_in + rise, abs=0.01) == T_film


def test_pitch_point_pressure() -> None:
    state = solved(torque=200.0)
    at_C = int(np.argmin(np.abs(MESH.rho_1 - GEARBOX.stage[0].pair().T1C)))
    assert state.p_H[0, at_C] == pytest.approx(1347e6, rel=5e-3)


def test_sliding_loss_is_the_power_of_the_friction_forces() -> None:
    state = solved()
    sliding, rolling = MESH.loss(
        omega_1=np.full(1, 2165.7 * RPM), torque=np.full(1, 94.0), T_1=np.full(1, 70.0), T_2=np.full(1, 70.0)
    )
    assert sliding[0] == pytest.approx(float((state.mu * state.F * state.V_s)[0] @ MESH.weight), rel=1e-12)
    assert rolling[0] == pytest.approx(float((9.0e7 * state.h * state.V_r * MESH.b)[0] @ MESH.weight), rel=1e-12)


def test_quadrature_is_fine_enough() -> None:
    """Six points on each of four stretches against 60 on each: 0.1 % is claimed."""
    from models.formulas.load_sharing import contact_points

    stage = GEARBOX.stage[0]
    pair = stage.pair()
    t, dx, share = contact_points(pair, model="potential_energy", r_bore=stage.bore_radius, n=60)
    rho_1, rho_2, R = pair.curvature_radii(t)
    fine = replace(MESH, weight=dx / pair.p_b, share=share, rho_1=rho_1, rho_2=rho_2, R=R)
    n, torque = np.meshgrid([50.0, 500.0, 2000.0, 6000.0], [2.0, 50.0, 300.0])
    point = {"omega_1": n.ravel() * RPM, "torque": torque.ravel(), "T_1": np.full(12, 60.0), "T_2": np.full(12, 60.0)}
    assert MESH.loss(**point)[0] == pytest.approx(fine.loss(**point)[0], rel=1e-3)


def test_schlenk_mesh_loss_is_friction_times_loss_factor() -> None:
    """``P = P_in H_VL mu``: the loss factor of the load share, 0.1915 for type C."""
    mesh = replace(MESH, friction="schlenk")
    sliding, _ = mesh.loss(
        omega_1=np.full(1, 2165.7 * RPM), torque=np.full(1, 94.0), T_1=np.full(1, 60.0), T_2=np.full(1, 60.0)
    )
    mu = friction_schlenk(
        F_bt_per_b=94.0 / MESH.r_b1 / MESH.b,
        v_sum_C=2165.7 * RPM * MESH.v_sum_C_per_omega,
        rho_red_C=MESH.rho_red_C,
        eta_oil=float(MESH.oil.dynamic_viscosity(60.0)),
        Ra=0.1655e-6,
        X_L=1.0,
    )
    assert sliding[0] / (94.0 * 2165.7 * RPM * float(mu)) == pytest.approx(0.1915, abs=1e-4)


def test_speed_sum_at_the_pitch_point() -> None:
    """``2 v_t sin(alpha_wt)``."""
    pair = GEARBOX.stage[0].pair()
    assert MESH.v_sum_C_per_omega == pytest.approx(2.0 * pair.r_w[0] * np.sin(pair.alpha_wt), rel=1e-9)


def test_helical_gears_lose_the_friction_of_their_lines_of_contact() -> None:
    """With one friction coefficient everywhere the loss is power times coefficient times loss factor."""
    helical = load_gearbox("helical").with_values({"stage.0.friction.model": "schlenk"})
    stage, mesh = helical.stage[0], helical.losses().term("mesh").law
    pair, torque, omega = stage.pair(), np.array([150.0]), np.array([150.0])
    sliding, _ = mesh.loss(omega_1=omega, torque=torque, T_1=np.array([70.0]), T_2=np.array([70.0]))
    mu = friction_schlenk(
        F_bt_per_b=torque / pair.r_b[0] / pair.b, v_sum_C=2.0 * omega * pair.T1C, rho_red_C=pair.rho_red_C,
        eta_oil=helical.lubricant().dynamic_viscosity(70.0), Ra=0.4e-6, X_L=1.0,
    )  # fmt: skip
    H = load_sharing_loss_factor(pair, contact_points(pair, r_bore=stage.bore_radius))
    assert sliding == pytest.approx(torque * omega * mu * H, rel=1e-12)


def test_flanks_of_helical_gears_slide_faster_than_they_carry_oil_in() -> None:
    """Sliding is that of the transverse plane; what draws oil in is across the line of contact."""
    helical = load_gearbox("helical")
    mesh, cosine = helical.losses().term("mesh").law, np.cos(helical.stage[0].pair().beta_b)
    state = solved(mesh=mesh)
    assert cosine < 0.99
    u_1, u_2 = 2165.7 * RPM * mesh.rho_1, 2165.7 * RPM / mesh.u * mesh.rho_2
    assert state.V_s[0] == pytest.approx(np.abs(u_1 - u_2), rel=1e-12)
    assert state.V_r[0] == pytest.approx((u_1 + u_2) * cosine, rel=1e-12)
    assert mesh.rho_1 * mesh.rho_2 / (mesh.rho_1 + mesh.rho_2) / cosine == pytest.approx(mesh.R, rel=1e-12)


def test_a_small_helix_angle_changes_no_loss() -> None:
    """The same teeth at 0.01 degrees; flanges that take a six-thousandth of the tooth force show by half a percent."""
    changes: dict[str, Any] = {"bearing.0.designation": "NJ 406", "bearing.2.designation": "NJ 406"}
    changes |= {"bearing.0.locating": True, "bearing.2.locating": True, "stage.0.helix_angle_deg": 0.01}
    at: dict[str, Any] = {"speed": [300.0, 2000.0], "torque": [50.0, 250.0], "temperatures": 60.0}
    spur, found = LOSSES.breakdown(**at), GEARBOX.with_values(changes).losses().breakdown(**at)
    for name, loss in spur.items():
        assert np.asarray(found[name]) == pytest.approx(np.asarray(loss), rel=1e-2 if "bearing" in name else 2e-3)


def test_heat_enters_helical_gears_along_their_lines_of_contact() -> None:
    """Fast band source (Blok): the line is ``b / cos(beta_b)`` long and is crossed at ``omega T1C cos(beta_b)``."""
    helical = load_gearbox("helical")
    network, pair, steel = helical.network(), helical.stage[0].pair(), helical.stage[0].material
    (link,) = (link for link in network.links if link.name == "mesh-pinion")
    at = {"speed": 1500.0, "torque": 125.0, "striction": 1.0}
    found = float(link.conductance.subs({s: at[s.name] for s in link.conductance.free_symbols}))
    cosine, b, E_red = np.cos(pair.beta_b), pair.b, ehl.reduced_modulus(206e9, 0.3, 206e9, 0.3)
    b_H, _ = ehl.hertz_line(125.0 / pair.r_b[0] / b, pair.rho_red_C, E_red)
    chi = steel.conductivity_W_mK / (steel.density_kg_m3 * steel.specific_heat_J_kgK)
    area, speed = 2.0 * b_H * b / cosine, 1500.0 * RPM * pair.T1C * cosine
    expected = area * steel.conductivity_W_mK / 1.06 * np.sqrt(speed / (chi * b_H))
    assert found == pytest.approx(float(expected), rel=1e-9)
