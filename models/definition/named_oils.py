"""Oils by name, with the source of every constant, and their way into the formulas of :mod:`models.formulas.oil`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from models.base.errors import InputError, did_you_mean
from models.definition.messages import validate_section
from models.definition.sections import Fluid
from models.definition.values_with_source import Annotations, strip
from models.files.toml_file import known_names, packaged, parse, read_text
from models.formulas.oil import Oil, d341_constants, modulus_scale

FOLDER = "oils"


def known_oils() -> tuple[str, ...]:
    """Return the names that ``[oil] named`` may have.

    Examples
    --------
    >>> "M100" in known_oils()
    True
    """
    return known_names(FOLDER)


def read_oil(name: str) -> tuple[dict[str, Any], Annotations]:
    """Return the plain values of a named oil, not validated yet, and their annotations.

    Raises
    ------
    InputError
        If there is no such oil.
    """
    if name not in known_oils():
        raise InputError(f"there is no oil named '{name}'{did_you_mean(name, known_oils())}")
    notes = Annotations()
    values = strip(parse(read_text(packaged(FOLDER, name)), file=f"{name}.toml"), notes)
    return values, notes


def named_oil(name: str) -> Fluid:
    """Return the properties of a named oil.

    Raises
    ------
    InputError
        If there is no such oil.

    Examples
    --------
    >>> named_oil("M100").limiting_shear_coefficient
    0.047
    """
    return validate_section(Fluid, read_oil(name)[0], file=f"{name}.toml")


def lubricant(fluid: Fluid) -> Oil:
    """Return an oil as the loss formulas use it, from its definition.

    Examples
    --------
    >>> round(float(lubricant(named_oil("MINR")).kinematic_viscosity(60.0)), 2)
    103.25
    """
    if fluid.d341 is not None:
        m, n = fluid.d341.m, fluid.d341.n
    else:
        assert fluid.viscosity_points is not None  # noqa: S101 - Fluid has exactly one of the two
        (T_1, nu_1), (T_2, nu_2) = fluid.viscosity_points
        m, n = d341_constants(T_1, nu_1, T_2, nu_2)
    oil = Oil(
        name=fluid.name,
        m=m,
        n=n,
        rho_ref=fluid.density_kg_m3,
        T_ref=fluid.density_temperature_degC,
        expansion=fluid.thermal_expansion_1_K,
        limiting_shear_coefficient=fluid.limiting_shear_coefficient,
        pressure_viscosity=fluid.pressure_viscosity,
        specific_heat_constant=fluid.specific_heat_J_kgK,
        conductivity_constant=fluid.conductivity_W_mK,
        schlenk_X_L=fluid.schlenk_X_L,
    )
    if fluid.gold is not None:
        oil = replace(oil, gold_s=fluid.gold.s, gold_t=fluid.gold.t)
    if fluid.modulus is not None:
        measured = fluid.modulus
        scale = modulus_scale(measured.nu_40_mm2_s, oil.nu_40)
        oil = replace(
            oil, a1=measured.a1_Pa * scale, a2=measured.a2_Pa_per_K * scale, b1=measured.b1, b2=measured.b2_per_K
        )
    return oil
