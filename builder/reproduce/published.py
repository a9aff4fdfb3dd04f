"""Numbers that others publish for this rig, its oils and bearings, beside ours (the paper prints none of the results).

Sources: GEARpie and its gear library (cfernandesFEUP, University of Porto), load stages of the FZG test (ISO 14635-1 as
FEUP codes carry them), Arana et al. 2019 (Table 2), SKF 2016 and Fernandes et al. for bearing friction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from builder.reproduce.item import Check, Item, Table, Verdict, judged
from builder.reproduce.study import MIDDLE, OUTPUT_TORQUE, T_OIL, Study
from models.ehl import hertz_line, reduced_modulus
from models.friction import friction_schlenk
from models.gearbox import Gearbox
from models.load_sharing import contact_points, load_sharing_loss_factor
from models.named_oils import lubricant, named_oil
from models.runtime import RPM

LOAD_STAGES = {5: 94.1, 9: 302.0}  # pinion torque [N m], 0.5 m arm
OIL_TEMPERATURES = (40.0, 60.0, 80.0, 90.0, 100.0)  # degC
# mm^2/s, ASTM D341 with 0.7; printed with two decimals.
PORTO_OILS = {
    "MINR": (316.0, 103.25, 43.68, 30.56, 22.23),
    "MINE": (325.88, 134.76, 66.17, 48.77, 36.98),
    "PAOR": (311.56, 124.98, 60.18, 44.06, 33.23),
    "ESTF": (321.84, 129.9, 62.77, 46.01, 34.72),
    "ESTR": (299.64, 117.6, 55.86, 40.71, 30.59),
    "PAGD": (287.34, 141.46, 78.55, 60.72, 47.92),
    "P150": (148.94, 64.52, 33.15, 24.97, 19.33),
    "FVA3": (99.39, 39.35, 19.28, 14.33, 10.99),
}
ARANA_OILS = {"N100": (97.9, 8.61), "M100": (96.0, 10.6), "PAO100": (94.1, 14.0)}  # at 40 and 100 degC
# Coefficients of roller bearings in a mineral gear oil (MINR), measured by Fernandes et al.
PORTO_BEARINGS = {"mu_bl": 0.0354, "mu_EHL": 0.0177}


@dataclass(frozen=True)
class Comparison:
    """A published number beside ours; `tolerance` is absolute and the source's own."""

    what: str
    source: str
    published: float
    ours: float
    tolerance: float
    decimals: int

    @property
    def met(self) -> bool:
        """Whether ours is the published number within the source's tolerance."""
        return abs(self.published - self.ours) <= self.tolerance


@dataclass(frozen=True)
class Case:
    """A case of GEARpie, in its units; both roughnesses in um."""

    name: str
    b_mm: float
    X_L: float
    eta_mPas: float
    T_1: float
    n_1: float
    HVL: float
    mu: float
    P_VZP: float
    tip_shortening: bool = False
    Ra_um: tuple[float, float] = (0.4, 0.31)


CASES = (
    Case("C14", 14.0, 0.846, 13.28, 200.0, 1500.0, 0.1946, 0.0449, 274.37),
    Case("C40", 40.0, 0.65, 49.85, 215.5, 1800.0, 0.1984, 0.0256, 206.31),
    # Its roughness is not published; both speeds imply 0.24 um.
    Case("REP", 14.0, 0.65, 11.83, 171.6, 300.0, 0.1914, 0.0421, 43.40, True, (0.24, 0.24)),
    Case("REP2", 14.0, 0.65, 11.83, 171.6, 1875.0, 0.1914, 0.0292, 188.02, True, (0.24, 0.24)),
)


def published(study: Study) -> Item:
    """All comparisons in one table."""
    rows = [*_stages(study), *_gearpie(study.gearbox), *_oils()]
    missed = [row for row in rows if not row.met]
    return Item(
        key="Published numbers",
        title="Validation against numbers that are published",
        reading=(
            "The paper prints no results that could be compared one by one; these sources do. tests/validation holds"
            " them as tests. Tolerances are those of the sources: half a unit of the last printed digit unless the"
            " table says more."
        ),
        checks=(ours_are_the_published_numbers(rows, missed),),
        tables=(
            Table(
                title="Published and ours",
                header=("quantity", "source", "published", "ours", "tolerance", "within"),
                rows=tuple(
                    (
                        row.what,
                        row.source,
                        f"{row.published:.{row.decimals}f}",
                        f"{row.ours:.{row.decimals + 1}f}",
                        f"{row.tolerance:.2g}",
                        "yes" if row.met else "no",
                    )
                    for row in rows
                ),
            ),
            _bearings(study),
        ),
        without_checks=Verdict.OURS,
    )


def ours_are_the_published_numbers(rows: list[Comparison], missed: list[Comparison]) -> Check:
    """How many are within tolerance."""
    return judged(
        "ours_are_the_published_numbers",
        f"{len(rows)} published numbers.",
        f"{len(rows) - len(missed)} of them are met within the source's tolerance.",
        not missed,
        numbers={"published": len(rows), "met": len(rows) - len(missed)},
        otherwise="Not met: " + ", ".join(row.what for row in missed) + ".",
    )


def _stages(study: Study) -> Iterator[Comparison]:
    for (stage, torque), T2 in zip(LOAD_STAGES.items(), OUTPUT_TORQUE[1:], strict=True):
        # T2 is printed in whole N m.
        yield Comparison(
            f"T₁ in N m at T₂ = {T2:g} N m", f"FZG load stage {stage}", torque, T2 / study.ratio, 0.5 / study.ratio, 1
        )


def _gearpie(gearbox: Gearbox) -> Iterator[Comparison]:
    for case in CASES:
        changed = gearbox.with_values(
            {
                "stage.0.face_width_mm": case.b_mm,
                "stage.0.profile_shift": (0.1817, 0.1715),
                "stage.0.tip_shortening": case.tip_shortening,
            }
        )
        stage = changed.stage[0]
        pair = stage.pair()
        if case.name == "C14":
            yield Comparison("C14, base pitch in mm", "GEARpie", 13.285, 1e3 * pair.p_b, 5e-4, 3)
            yield Comparison("C14, T₁T₂ in mm", "GEARpie", 34.93, 1e3 * pair.T1T2, 5e-3, 2)
            yield Comparison("C14, contact ratio", "GEARpie", 1.46, pair.epsilon_alpha, 5e-3, 2)
            yield Comparison("C14, H_V (Ohlendorf)", "GEARpie", 0.1986, pair.H_V, 5e-5, 4)
            E_red = reduced_modulus(206e9, 0.3, 206e9, 0.3)
            b_H, p_H = hertz_line(case.T_1 / pair.r_b[0] / pair.b, pair.rho_red_C, E_red)
            yield Comparison("C14, Hertz pressure at C in MPa", "GEARpie", 1347.3, float(p_H) / 1e6, 0.3, 1)
            yield Comparison("C14, contact half-width in µm", "GEARpie", 199.6, float(b_H) * 1e6, 0.1, 1)
            points = contact_points(pair, model="potential_energy", r_bore=stage.bore_radius)
            yield Comparison(
                "C14, H_VL (load sharing)", "GEARpie", case.HVL, load_sharing_loss_factor(pair, points), 5.1e-5, 4
            )
        mu = float(
            friction_schlenk(
                F_bt_per_b=case.T_1 / pair.r_b[0] / pair.b,
                v_sum_C=2.0 * case.n_1 * RPM * pair.T1C,
                rho_red_C=pair.rho_red_C,
                eta_oil=case.eta_mPas * 1e-3,
                Ra=0.5e-6 * sum(case.Ra_um),
                X_L=case.X_L,
            )
        )
        loss = case.T_1 * case.n_1 * RPM * case.HVL * mu
        yield Comparison(f"{case.name}, friction (Schlenk)", "GEARpie", case.mu, mu, 5.1e-5, 4)
        # Half a unit of the printed loss factor.
        yield Comparison(
            f"{case.name}, mesh loss in W", "GEARpie", case.P_VZP, loss, case.P_VZP * (5e-5 / case.HVL + 5e-4), 1
        )
    pair = gearbox.stage[0].pair()
    for name, radius, diameter in (("pinion", pair.r_a[0], 82.46), ("wheel", pair.r_a[1], 118.36)):
        # The shifts are rounded: 0.012 mm.
        yield Comparison(f"Type C, tip diameter of the {name} in mm", "FZG type C", diameter, 2e3 * radius, 0.012, 2)


def _oils() -> Iterator[Comparison]:
    for name, values in PORTO_OILS.items():
        ours = lubricant(named_oil(name)).kinematic_viscosity(np.array(OIL_TEMPERATURES))
        for T, value, own in zip(OIL_TEMPERATURES, values, ours.tolist(), strict=True):
            yield Comparison(f"{name}, viscosity at {T:g} °C in mm²/s", "University of Porto", value, own, 5.1e-3, 2)
    for name, pair in ARANA_OILS.items():
        ours = lubricant(named_oil(name)).kinematic_viscosity(np.array([40.0, 100.0]))
        for T, value, own in zip((40.0, 100.0), pair, ours.tolist(), strict=True):
            yield Comparison(f"{name}, viscosity at {T:g} °C in mm²/s", "Arana et al. 2019", value, own, 0.005, 2)


def _bearings(study: Study) -> Table:
    """What the coefficients of Porto would change."""
    torque = OUTPUT_TORQUE
    at = study.stated_temperatures(torque)
    columns = [study.full.components.index(b.name) for b in study.gearbox.bearing]

    def loss(gearbox: Gearbox) -> list[str]:
        power = gearbox.losses().power(study.pinion_speed[MIDDLE], torque / study.ratio, at)[:, columns].sum(axis=-1)
        return [f"{value:.1f}" for value in power.tolist()]

    changes = {f"bearing.{i}.{key}": value for i in range(len(columns)) for key, value in PORTO_BEARINGS.items()}
    own = study.gearbox.bearing[0]
    return Table(
        title=f"Bearing losses in W at 8.3 m/s, oil {T_OIL:g} °C, with published friction coefficients",
        header=("coefficients", *(f"T₂ = {t:g} N m" for t in torque)),
        rows=(
            (f"SKF 2016: μ_bl {own.mu_bl:g}, μ_EHL {own.mu_EHL:g} (ours)", *loss(study.gearbox)),
            (
                f"Porto, mineral gear oil: μ_bl {PORTO_BEARINGS['mu_bl']:g}, μ_EHL {PORTO_BEARINGS['mu_EHL']:g}",
                *loss(study.gearbox.with_values(changes)),
            ),
        ),
    )
