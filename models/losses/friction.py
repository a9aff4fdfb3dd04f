"""Sliding and rolling loss of one gear mesh: Arana's partial-EHL friction point by point, or Schlenk's mean one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.base.root_finding import decreasing_root
from models.base.types import Array, Numeric
from models.definition.sections import Stage
from models.formulas import ehl
from models.formulas.load_sharing import contact_points
from models.formulas.oil import Oil
from models.losses.loss_term import MESH as MESH_NODE
from models.losses.loss_term import (
    SPEED,
    TORQUE,
    TORQUE_FLOOR_NM,
    GearboxData,
    LossKind,
    LossTerm,
    TermInput,
    of_stages,
)
from models.portable.evaluation import RPM

FILM_TEMPERATURE_TOL = 5e-3  # K, residual of the film temperature
SCHLENK_LOWEST_LOAD = 150e3  # N/m, ISO/TR 14179-2

AsperityShare = Literal["doleschel", "erf", "diab", "matsumoto"]
Film = Literal["hamrock_dowson", "dowson_toyoda", "grubin"]
ThermalReduction = Literal["gupta", "gupta_simple", "murch_wilson"]
Roughness = Literal["of_the_law", "mean", "composite", "composite_rms"]


def friction_schlenk(
    *,
    F_bt_per_b: Numeric,
    v_sum_C: Numeric,
    rho_red_C: float,
    eta_oil: Numeric,
    Ra: float,
    X_L: float,
    lowest_load: float = SCHLENK_LOWEST_LOAD,
) -> Array:
    r"""Mean friction coefficient of a mesh after Schlenk (ISO/TR 14179-2).

    .. math:: \mu_{mZ} = 0.048\left(\frac{F_{bt}/b}{v_{\Sigma C}\,\rho_{redC}}\right)^{0.2}
              \eta_{oil}^{-0.05} Ra^{0.25} X_L

    with the units of the standard (N/mm, m/s, mm, mPa s, um); ``F_bt / b`` counts as 150 N/mm at least. WTplus knows
    no such floor: its map of an e-axle is reproduced without one (tests/validation).

    Parameters
    ----------
    F_bt_per_b : Numeric, shape (...)
        Normal force per face width, [N/m]
    v_sum_C : Numeric, shape (...)
        Sum of the rolling speeds at the pitch point, [m/s], > 0
    rho_red_C : float
        Reduced radius of curvature at the pitch point, [m]
    eta_oil : Numeric, shape (...)
        Dynamic viscosity at oil temperature, [Pa s]
    Ra : float
        Mean arithmetic roughness of both flanks, [m]
    X_L : float
        Lubricant factor, [-]; 1 for mineral oil
    lowest_load : float
        Least force per face width that counts, [N/m]

    Returns
    -------
    Array, shape (...)
        [-]

    References
    ----------
    ISO/TR 14179-2:2001; Schlenk, thesis, TU Munich 1994.

    Examples
    --------
    The FZG pair at 8.3 m/s, 94 N m, 60 degC:

    >>> F_bt_per_b, v_sum_C = 94.0 / 33.83e-3 / 14e-3, 2.0 * 8.3 * np.sin(np.radians(22.4388))
    >>> round(float(friction_schlenk(F_bt_per_b=F_bt_per_b, v_sum_C=v_sum_C, rho_red_C=8.382e-3, eta_oil=0.01307,
    ...                              Ra=0.1655e-6, X_L=1.0)), 4)
    0.035
    """
    load = np.maximum(F_bt_per_b, lowest_load) * 1e-3 / (np.asarray(v_sum_C) * rho_red_C * 1e3)
    return np.asarray(0.048 * load**0.2 * (np.asarray(eta_oil) * 1e3) ** -0.05 * (Ra * 1e6) ** 0.25 * X_L)


def rolling_loss_anderson(*, h: Numeric, v_r: Numeric, b: float, constant: float) -> Array:
    """Hydrodynamic rolling loss of one contact after Anderson and Loewenthal, ``C h v_r b``.

    Parameters
    ----------
    h : Numeric, shape (...)
        Central film thickness, thermal reduction included, [m]
    v_r : Numeric, shape (...)
        Sum of the surface speeds, [m/s]
    b : float
        Face width, [m]
    constant : float
        9.0e7 in SI, [N/m^2]

    Returns
    -------
    Array, shape (...)
        [W]

    References
    ----------
    Anderson, Loewenthal, NASA TP-1622, 1980, from Crook's rolling traction; constant from memory, verified by its
    dimension and by 1.3e4 psi = 9.0e7 N/m^2.

    Examples
    --------
    A film of 0.163 um between teeth of 14 mm, whose speeds sum to 4.39 m/s:

    >>> round(float(rolling_loss_anderson(h=0.163e-6, v_r=4.39, b=14e-3, constant=9.0e7)), 3)
    0.902
    """
    return np.asarray(constant * np.asarray(h) * v_r * b)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshContact:
    """A gear mesh as a row of contact points along the path of contact, of helical gears on their lines of contact.

    Attributes
    ----------
    weight : Array, shape (n_points,)
        Quadrature weight over the length that the loss is averaged by (base pitch), times the length of the line of
        contact over the face width, [-]
    share : Array, shape (n_points,)
        Share of the normal force on this pair of teeth, [-]
    rho_1, rho_2, R : Array, shape (n_points,)
        Curvature radii of pinion and wheel in the transverse plane, and the reduced one, [m]
    cos_beta_b : float
        Cosine of the helix angle at the base circle, [-]
    r_b1 : float
        Base radius of the pinion, [m]
    u : float
        Gear ratio z2 / z1, [-]
    v_sum_C_per_omega, rho_red_C : float
        Sum of the rolling speeds at the pitch point per pinion speed [m], reduced radius there [m]
    b, E_red, k_steel, chi_steel : float
        Face width [m], reduced modulus [Pa], conductivity [W/(m K)] and diffusivity [m^2/s] of the steel
    Ra : (float, float)
        Arithmetic roughness of both flanks, [m]
    """

    oil: Oil
    weight: Array
    share: Array
    rho_1: Array
    rho_2: Array
    R: Array
    cos_beta_b: float
    r_b1: float
    u: float
    v_sum_C_per_omega: float
    rho_red_C: float
    b: float
    E_red: float
    k_steel: float
    chi_steel: float
    Ra: tuple[float, float]
    mu_solid: float
    friction: Literal["arana", "schlenk"] = "arana"
    asperity_share: AsperityShare = "doleschel"
    roughness: Roughness = "of_the_law"
    film: Film = "hamrock_dowson"
    thermal_reduction: ThermalReduction = "gupta"
    rolling_constant: float = 9.0e7
    lowest_torque: float = TORQUE_FLOOR_NM
    lowest_load: float = SCHLENK_LOWEST_LOAD

    def power(self, x: Array) -> Array:
        """Sliding and rolling loss [W], (N, 2), at speed [1/min], torque [N m], gear temperatures [degC], (N, 4).

        The contact is evaluated at `lowest_torque` at least: that of its pinion at 1 N m of the input shaft.
        """
        torque = np.maximum(x[:, 1], self.lowest_torque)
        losses = self.loss(omega_1=x[:, 0] * RPM, torque=torque, T_1=x[:, 2], T_2=x[:, 3])
        return np.stack(losses, axis=-1)

    def solve(self, *, omega_1: Array, torque: Array, T_1: Array, T_2: Array) -> ContactState:
        """Film, temperature and friction at every contact point.

        Parameters
        ----------
        omega_1 : Array, shape (N,)
            Pinion speed, [rad/s], > 0
        torque : Array, shape (N,)
            Pinion torque, [N m], > 0
        T_1, T_2 : Array, shape (N,)
            Bulk temperatures of pinion and wheel, [degC]

        Returns
        -------
        ContactState
            Fields of shape (N, n_points)

        Raises
        ------
        ArithmeticError
            If a film temperature is not found (never seen over the design space).
        """
        inlet = self._inlet(omega_1=omega_1, torque=torque, T_1=T_1, T_2=T_2)
        p_mean, T_in, V_s, h = 0.25 * np.pi * inlet.p_H, inlet.T_in, inlet.V_s, inlet.h
        xi = self._asperity_share(h)

        # Film temperature = inlet + rise per heat flux * mu * p * V_s (Arana eqs. 26-28).
        flash = ehl.heat_partition(inlet.u_1, inlet.u_2) * ehl.band_source_resistance(
            b_H=inlet.b_H, u=inlet.u_1, k=self.k_steel, chi=self.chi_steel
        )
        rise = (flash + h / (8.0 * inlet.k_oil)) * p_mean * V_s
        limit = self.oil.limiting_shear_coefficient

        pressures = np.stack((p_mean, inlet.p_H))

        def friction(T_film: Array) -> Array:
            # Viscosity at the mean pressure, the local coefficient at the Hertz pressure (Bair, Winer 1989).
            alpha_mean, alpha_H = self.oil.pressure_viscosity_coefficient(T_film, pressures)
            mu_fluid = ehl.fluid_friction(
                p_mean=p_mean,
                eta=self.oil.dynamic_viscosity(T_film) * np.exp(alpha_mean * p_mean),
                alpha=alpha_H,
                V_s=V_s,
                h=h,
                shear_limit=limit,
            )
            return np.asarray(xi * self.mu_solid + (1.0 - xi) * mu_fluid)

        # mu <= xi mu_solid + (1 - xi) limit brackets the root whatever the oil does in between.
        highest = T_in + rise * (xi * self.mu_solid + (1.0 - xi) * limit)
        T_film = decreasing_root(lambda T: T_in + rise * friction(T) - T, T_in, highest, f_tol=FILM_TEMPERATURE_TOL)
        mu = friction(T_film)
        return ContactState(**vars(inlet), asperity_share=xi, T_film=T_film, residual=T_in + rise * mu - T_film, mu=mu)

    def loss(self, *, omega_1: Array, torque: Array, T_1: Array, T_2: Array) -> tuple[Array, Array]:
        """Mean sliding and rolling loss of the mesh; parameters as :meth:`solve`.

        Returns
        -------
        sliding, rolling : Array, shape (N,)
            [W]
        """
        state: Inlet
        if self.friction == "schlenk":  # needs no film temperature
            state = self._inlet(omega_1=omega_1, torque=torque, T_1=T_1, T_2=T_2)
            # ISO/TR 14179-2 takes the oil sump's viscosity; the network knows the nearer one of the contact's inlet.
            mu = friction_schlenk(
                F_bt_per_b=torque / self.r_b1 / self.b,
                v_sum_C=omega_1 * self.v_sum_C_per_omega,
                rho_red_C=self.rho_red_C,
                eta_oil=self.oil.dynamic_viscosity(0.5 * (T_1 + T_2)),
                Ra=0.5 * (self.Ra[0] + self.Ra[1]),
                X_L=self.oil.schlenk_X_L,
                lowest_load=self.lowest_load,
            )[:, None]
        else:
            state = self.solve(omega_1=omega_1, torque=torque, T_1=T_1, T_2=T_2)
            mu = state.mu
        sliding = (mu * state.F * state.V_s) @ self.weight
        rolling = rolling_loss_anderson(h=state.h, v_r=state.V_r, b=self.b, constant=self.rolling_constant)
        return np.asarray(sliding), np.asarray(rolling @ self.weight)

    def _inlet(self, *, omega_1: Array, torque: Array, T_1: Array, T_2: Array) -> Inlet:
        """Loads, speeds and film at every contact point, which follow from the inlet alone."""
        u_1, u_2 = omega_1[:, None] * self.rho_1, (omega_1 / self.u)[:, None] * self.rho_2
        # Flanks slide along the profile; what they carry into the film is across the line of contact.
        V_s, u_1, u_2 = np.abs(u_1 - u_2), u_1 * self.cos_beta_b, u_2 * self.cos_beta_b
        V_e = 0.5 * (u_1 + u_2)
        F = (torque / self.r_b1)[:, None] * self.share
        b_H, p_H = ehl.hertz_line(F / self.b, self.R, self.E_red)
        # The bulk temperatures are known, so the surfaces enter the contact with them (Arana eqs. 15-18, M = 0);
        # the ratio of the surface speeds, hence T_in, varies along the path but not with speed.
        weight_1 = self.rho_1 / (self.rho_1 + self.rho_2 / self.u)
        T_in = T_1[:, None] * weight_1 + T_2[:, None] * (1.0 - weight_1)
        eta_in, k_oil = self.oil.dynamic_viscosity(T_in), self.oil.conductivity(T_in)
        L = ehl.thermal_loading(eta=eta_in, beta=self.oil.thermoviscosity(T_in), V_e=V_e, k_oil=k_oil)
        film = self._film(F, eta_in, self.oil.film_pressure_viscosity_coefficient(T_in), V_e)
        h = self._reduction(p_H, L, V_s / V_e) * film
        return Inlet(u_1=u_1, u_2=u_2, F=F, b_H=b_H, p_H=p_H, V_s=V_s, V_r=2.0 * V_e, h=h, T_in=T_in,
                     k_oil=k_oil)  # fmt: skip

    def _film(self, F: Array, eta: Array, alpha: Array, V_e: Array) -> Array:
        if self.film == "hamrock_dowson":
            return ehl.film_hamrock_dowson(F=F, R=self.R, E_red=self.E_red, eta=eta, alpha=alpha, V_e=V_e)
        line = ehl.film_dowson_toyoda if self.film == "dowson_toyoda" else ehl.film_grubin
        return line(w=F / self.b, R=self.R, E_red=self.E_red, eta=eta, alpha=alpha, V_e=V_e)

    def _reduction(self, p_H: Array, L: Array, slide_roll_ratio: Array) -> Array:
        if self.thermal_reduction == "gupta":
            return ehl.thermal_reduction_gupta(p_H=p_H, E_red=self.E_red, L=L, slide_roll_ratio=slide_roll_ratio)
        if self.thermal_reduction == "gupta_simple":
            return ehl.thermal_reduction_gupta_simple(L=L, slide_roll_ratio=slide_roll_ratio)
        return ehl.thermal_reduction_murch_wilson(L=L)

    def _asperity_share(self, h: Array) -> Array:
        if self.asperity_share == "matsumoto":
            return ehl.asperity_share_matsumoto(h, RZ_OVER_RA * (self.Ra[0] + self.Ra[1]))
        mean, composite = 0.5 * (self.Ra[0] + self.Ra[1]), float(np.hypot(*self.Ra))
        roughness = {"mean": mean, "composite": composite, "composite_rms": RQ_OVER_RA * composite}
        law, own = {
            "doleschel": (ehl.asperity_share_doleschel, "mean"),
            "erf": (ehl.asperity_share_erf, "composite_rms"),
            "diab": (ehl.asperity_share_diab, "composite_rms"),
        }[self.asperity_share]
        return law(h, roughness[own if self.roughness == "of_the_law" else self.roughness])


RQ_OVER_RA = 1.25  # of heights in a normal distribution: sqrt(pi / 2) = 1.253
RZ_OVER_RA = 6.0  # customary for ground flanks; the paper gives Ra only


@dataclass(frozen=True, kw_only=True)
class Inlet:
    """State of the contact points without their friction; every field of shape (N, n_points).

    Attributes
    ----------
    u_1, u_2, V_s, V_r : Array
        Surface speeds across the line of contact, sliding speed and sum, [m/s]
    F, b_H, p_H : Array
        Load per length of the line of contact times face width, of spur gears the normal force [N]; half width [m] and
        pressure [Pa] of Hertz
    h : Array
        Film thickness, thermal reduction included, [m]
    T_in, k_oil : Array
        Temperature [degC] and conductivity [W/(m K)] of the oil at the inlet
    """

    u_1: Array
    u_2: Array
    F: Array
    b_H: Array
    p_H: Array
    V_s: Array
    V_r: Array
    h: Array
    T_in: Array
    k_oil: Array


@dataclass(frozen=True, kw_only=True)
class ContactState(Inlet):
    """State of the contact points; every field of shape (N, n_points).

    Attributes
    ----------
    asperity_share, mu : Array
        Share of the load on asperities, friction coefficient, [-]
    T_film, residual : Array
        Film temperature [degC], residual of its equation [K]
    """

    asperity_share: Array
    T_film: Array
    residual: Array
    mu: Array


def mesh_contact(gearbox: GearboxData, stage: Stage) -> MeshContact:
    """Return the contact of a stage of the gearbox."""
    pair, friction, material = stage.pair(), stage.friction, stage.material
    E, nu = (material.youngs_modulus,) * 2, (material.poisson,) * 2
    t, dx, share = contact_points(pair, model=stage.load_sharing, r_bore=stage.bore_radius, E=E, nu=nu)
    rho_1, rho_2, R = pair.curvature_radii(t)
    averaged_over = pair.p_b if friction.average == "base_pitch" else pair.T1E - pair.T1A
    _, rho_2_C, _ = pair.curvature_radii(np.asarray(pair.T1C))
    return MeshContact(
        oil=gearbox.lubricant(),
        weight=dx / averaged_over / np.cos(pair.beta_b),
        share=share,
        rho_1=rho_1,
        rho_2=rho_2,
        R=R,
        cos_beta_b=float(np.cos(pair.beta_b)),
        r_b1=pair.r_b[0],
        u=pair.u,
        v_sum_C_per_omega=float(pair.T1C + rho_2_C / pair.u),
        rho_red_C=pair.rho_red_C,
        b=pair.b,
        E_red=ehl.reduced_modulus(E[0], nu[0], E[1], nu[1]),
        k_steel=material.conductivity_W_mK,
        chi_steel=material.conductivity_W_mK / (material.density_kg_m3 * material.specific_heat_J_kgK),
        Ra=stage.roughness_Ra,
        mu_solid=friction.mu_solid,
        friction=friction.model,
        asperity_share=friction.asperity_load_share,
        roughness=friction.roughness,
        film=friction.film,
        thermal_reduction=friction.thermal_reduction,
        rolling_constant=stage.rolling.constant_N_m2,
        lowest_torque=gearbox.torque_ratio[stage.driver] * TORQUE_FLOOR_NM,
        lowest_load=0.0 if friction.load_floor is False else SCHLENK_LOWEST_LOAD,
    )


def mesh_terms(gearbox: GearboxData) -> Iterator[LossTerm]:
    """Yield the loss of every stage's mesh; it reads the bulk temperatures of both gears."""
    count = len(gearbox.stage)
    components = zip(*(of_stages(component, count) for component in MESH.components), strict=True)
    for stage, name, own in zip(gearbox.stage, of_stages(MESH_NODE, count), components, strict=True):
        inputs = (
            TermInput("speed_rpm", SPEED, gearbox.speed_ratio[stage.driver]),
            TermInput("torque_Nm", TORQUE, gearbox.torque_ratio[stage.driver]),
            *(TermInput(f"T_{gear}_degC", gear) for gear in stage.names),
        )
        law = mesh_contact(gearbox, stage)
        yield LossTerm(kind=MESH, name=name, components=own, node=name, inputs=inputs, law=law)


MESH = LossKind(
    name="mesh",
    components=("mesh_sliding", "mesh_rolling"),
    factors={"mesh": "sliding loss of the mesh", "rolling": "rolling loss of the mesh"},
    torque_driven=(True, False),
    network="mesh",
    # Sliding goes with power; rolling with film thickness times speed, n^0.67 n.
    powers=((1.0, 1.0, 0.0, 0.0), (1.67, 0.0, 0.0, 0.0)),
    law_error={
        "speed": 0.08,
        "torque": 0.08,
        "viscosity": 0.08,
        "speed speed": 0.03,
        "speed torque": 0.03,
        "torque torque": 0.03,
    },
    terms=mesh_terms,
)
