"""What holds for every law: it is finite, not negative and monotone, and its exponents are the printed ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from models.base.types import Array
from models.formulas import ehl, heat_transfer
from models.losses import churning, seal
from tests.validation.test_published_points import CONTACT, DISK, E_RED, GEAR, NU_406, OIL, PAIR, F, disk_speed

Law = Callable[[float], Any]
L = np.geomspace(1e-3, 10.0, 20)
FILMS = np.concatenate(([0.0], np.geomspace(1e-10, 1e-5, 50)))
ROUGH, WALL = 2e-7, {"T_a": 27.0, "length": 0.215}
LEVELS = np.array([-5.0, 0.0, 1e-12, 1e-3, 1.0, 10.0, 17.0, 30.0, 36.0, 50.0, 72.0, 500.0])


def drag(n: float = 2000.0, nu: float = 15.0, **changed: Any) -> float:
    return float(replace(NU_406, **changed).friction_moments(n_rpm=n, F_r=1000.0, nu=nu)[2])


RISING: dict[str, tuple[Law, Array]] = {
    "ISO 14179 with air speed": (lambda v: heat_transfer.convection_iso_14179(v_air=v, T=60.0, **WALL), np.arange(9.0)),
    "plate with air speed": (lambda v: heat_transfer.convection_flat_plate(v_air=v, T=60.0, **WALL), np.arange(9.0)),
    "ISO free with rise": (lambda d: heat_transfer.convection_iso_14179_free(T=27.0 + d, **WALL), np.arange(99.0)),
    "radiation": (lambda T: heat_transfer.radiation(T=T, T_a=20.0, emissivity=0.9), np.linspace(-60.0, 300.0, 50)),
    "disk": (lambda w: heat_transfer.rotating_disk(omega=w, **DISK), np.linspace(0.0, disk_speed(1e6), 50)),
    "drag with oil level": (lambda H: drag(H=H), LEVELS),
    "drag with viscosity": (lambda nu: drag(nu=nu), np.geomspace(5.0, 5000.0, 20)),
    "Changenet and Velex": (lambda w: churning.churning_changenet_velex(**GEAR, omega=w), np.linspace(0.1, 1e3, 99)),
    "Changenet, 2011": (
        lambda w: churning.churning_changenet_2011(**GEAR, module=4e-3, omega=w),
        np.arange(1.0, 400.0),
    ),
    "Niemann": (lambda v: churning.churning_niemann(e=0.02, b=0.014, v_t=v), np.linspace(0.0, 40.0, 50)),
}
FALLING: dict[str, tuple[Law, Array]] = {
    "Gupta": (lambda x: ehl.thermal_reduction_gupta(p_H=1e9, E_red=E_RED, L=x, slide_roll_ratio=0.3), L),
    "Gupta, simple": (lambda x: ehl.thermal_reduction_gupta_simple(L=x, slide_roll_ratio=0.3), L),
    "Gupta with sliding": (lambda s: ehl.thermal_reduction_gupta_simple(L=1.0, slide_roll_ratio=s), L),
    "Murch and Wilson": (lambda x: ehl.thermal_reduction_murch_wilson(L=x), L),
    "Doleschel": (lambda h: ehl.asperity_share_doleschel(h, ROUGH), FILMS),
    "erf": (lambda h: ehl.asperity_share_erf(h, ROUGH), FILMS),
    "Diab": (lambda h: 4.0 * ehl.asperity_share_diab(h, ROUGH), FILMS),
    "Matsumoto": (lambda h: ehl.asperity_share_matsumoto(h, ROUGH), FILMS),
    "Linke": (lambda T: seal.seal_loss_linke(d_mm=24.0, n_rpm=1e3, T_oil=T, nu_40=32.0), np.linspace(-60.0, 300.0, 99)),
    "viscosity": (OIL.kinematic_viscosity, np.linspace(-60.0, 300.0, 99)),
    "density": (OIL.density, np.linspace(-60.0, 300.0, 99)),
}  # fmt: skip


@pytest.mark.parametrize("name", [*RISING, *FALLING])
def test_laws_are_monotone_and_not_negative(name: str) -> None:
    (law, x), sign = (RISING[name], 1.0) if name in RISING else (FALLING[name], -1.0)
    values = np.array([float(law(value)) for value in x.tolist()])
    assert np.all(np.isfinite(values)) and np.all(values >= 0.0)
    assert np.all(sign * np.diff(values) >= 0.0) and values[0] != values[-1]


@pytest.mark.parametrize("name", ["Doleschel", "erf", "Diab", "Matsumoto"])
def test_asperities_carry_everything_when_dry_and_nothing_in_a_thick_film(name: str) -> None:
    """Diab's share is scaled by four here: it starts at a quarter."""
    law, films = FALLING[name]
    assert [float(law(h)) for h in films[[0, -1]]] == pytest.approx([1.0, 0.0], abs=1e-12)


LINE = {"w": F / PAIR.b}
POWERS: list[tuple[str, Callable[..., Any], dict[str, Any], dict[str, float]]] = [
    ("Hamrock and Dowson", ehl.film_hamrock_dowson, CONTACT | {"F": F}, {"V_e": 0.67, "eta": 0.67, "alpha": 0.53,
                                                                         "F": -0.067}),
    ("Dowson and Toyoda", ehl.film_dowson_toyoda, CONTACT | LINE, {"V_e": 0.69, "eta": 0.69, "alpha": 0.56, "w": -0.1}),
    ("Grubin", ehl.film_grubin, CONTACT | LINE, {"V_e": 8 / 11, "eta": 8 / 11, "alpha": 8 / 11, "w": -1 / 11}),
    ("Changenet, laminar", churning.churning_changenet_velex, GEAR | {"omega": 20.0},
     {"omega": 1.59, "nu": 0.21, "rho": 1.0, "V_oil": 0.1}),
    ("Changenet, turbulent", churning.churning_changenet_velex, GEAR | {"omega": 1e3},
     {"omega": 1.24, "rho": 1.0, "V_oil": -0.35}),
    ("Linke", seal.seal_loss_linke, {"d_mm": 20.0, "n_rpm": 1e3, "T_oil": 50.0, "nu_40": 68.0},
     {"d_mm": 2.0, "n_rpm": 1.0}),
    ("Mauz", churning.churning_mauz, {"e": (0.02, 0.04), "b": 14e-3, "v_t": 8.3, "omega_2": 1.0, "C_Sp": 1.0},
     {"C_Sp": 1.0, "omega_2": 1.0}),
]  # fmt: skip


@pytest.mark.parametrize(("law", "at", "exponents"), [row[1:] for row in POWERS], ids=[row[0] for row in POWERS])
def test_exponents_are_the_printed_ones(
    law: Callable[..., Any], at: dict[str, Any], exponents: dict[str, float]
) -> None:
    for name, exponent in exponents.items():
        assert law(**at | {name: 2.0 * at[name]}) / law(**at) == pytest.approx(2.0**exponent, rel=1e-12), name


def test_laws_with_two_regimes_are_continuous() -> None:
    for law, edges in (
        (lambda w: heat_transfer.rotating_disk(omega=w, **DISK),
         [disk_speed(Re) for Re in (heat_transfer.RE_DISK_LAMINAR, heat_transfer.RE_DISK_TURBULENT)]),
        (lambda w: churning.churning_changenet_velex(**GEAR, omega=w),
         [Re * 15.41e-6 / (0.05 * 0.014) for Re in (churning.RE_LAMINAR, churning.RE_TURBULENT)]),
        (lambda w: churning.churning_changenet_2011(**GEAR, module=4e-3, omega=w),
         [churning.RE_2011 * 15.41e-6 / (0.05 * 0.014),
          *(np.sqrt(gamma / (0.05 * 0.014 * 4e-3) ** (1 / 3))
            for gamma in (churning.GAMMA_CALM, churning.GAMMA_SWIRLING))]),
    ):  # fmt: skip
        for edge in edges:
            assert law(edge * (1 - 1e-9)) == pytest.approx(law(edge * (1 + 1e-9)), rel=1e-6)


def test_what_is_dry_or_at_rest_loses_nothing() -> None:
    v, dry = np.array([1.0, 10.0]), {"b": 14e-3, "v_t": np.array([1.0, 10.0])}
    assert churning.churning_niemann(e=-1e-3, **dry).tolist() == [0.0, 0.0]
    assert churning.churning_niemann_printed(e=-1e-3, omega=v, **dry).tolist() == [0.0, 0.0]
    assert churning.churning_mauz(e=(-1e-3, -1e-3), omega_2=v, **dry).tolist() == [0.0, 0.0]
    assert churning.churning_changenet_velex(**GEAR | {"h": -1e-3, "nu": np.full(2, 15.0)}, omega=v).tolist() == [0, 0]
    assert np.isfinite(churning.churning_changenet_velex(**GEAR | {"h": 0.2}, omega=100.0))
    assert churning.churning_changenet_2011(**GEAR | {"h": -1e-3}, module=4e-3, omega=v).tolist() == [0.0, 0.0]
    assert seal.seal_loss_linke(d_mm=20.0, n_rpm=0.0, T_oil=50.0, nu_40=68.0) == 0.0
    assert seal.seal_loss_iso_simple(d_mm=10.0, n_rpm=0.0) == 0.0
    assert float(heat_transfer.rotating_disk(omega=0.0, **DISK)) == 0.0
    assert drag(H=0.0) == drag(H=-5.0) == 0.0
