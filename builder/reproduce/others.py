"""Items that the paper does not have: numbers that others publish, and the sensitivity to uncertain numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from SALib.analyze import morris as morris_analyze
from SALib.sample import morris as morris_sample

from builder.reproduce.figure import Bars, Figure
from builder.reproduce.printed import (
    ARANA_OILS,
    GEARPIE,
    LOAD_STAGES,
    OUTPUT_TORQUE,
    PORTO_BEARINGS,
    PORTO_OILS,
    GearpieCase,
)
from builder.reproduce.report import Check, Part, Table, Verdict, item
from builder.reproduce.study import MEDIUM, MIDDLE, T_OIL, Study, steady_oil
from models.assembly.gearbox import Gearbox
from models.base.parallel import run_parallel
from models.base.types import Array
from models.definition.named_oils import lubricant, named_oil
from models.formulas.ehl import hertz_line, reduced_modulus
from models.formulas.load_sharing import contact_points, load_sharing_loss_factor
from models.losses.friction import friction_schlenk
from models.portable.evaluation import RPM
from models.quantities.definition_units import UNITS

LEVELS = 4
REACH = 2.0  # standard deviations to either side
SHOWN = 12
SMALLEST = 0.005  # K
# Heat capacities do nothing in a steady state; the others are read by models that the definition does not choose.
WITHOUT_EFFECT = ("factors.C_", "housing.density", "housing.specific_heat", "oil.volume", "oil.schlenk")
INPUTS = {"ambient.temperature_degC": "T_ambient", "ambient.air_speed_m_s": "air_speed"}
FACTOR = "factors."
SIGNS = {"m2": "m²", "m3": "m³", "deg": "°", "um": "µm"}  # as figures show units


@item("Sensitivity", "What the final oil temperature hangs on", unchecked=Verdict.OURS)
def sensitivity(study: Study) -> Iterator[Part]:
    """Morris study of the steady oil temperature at 20 m/s and the three torques of Table 6."""
    groups = uncertain_groups(study.gearbox)
    problem = {"num_vars": len(groups), "names": [*groups], "bounds": [[-REACH, REACH]] * len(groups)}
    seed, trajectories = study.settings.seed, study.settings.trajectories
    z = morris_sample.sample(problem, trajectories, num_levels=LEVELS, seed=seed)
    oil = _final_oil(study, [*groups.values()], z)
    indices = [morris_analyze.analyze(problem, z, T, num_levels=LEVELS, seed=seed) for T in oil.T]
    # An elementary effect is a change over the whole reach; shown per standard deviation.
    effect, spread, mean = (
        np.array([np.asarray(one[key], dtype=float) for one in indices]) / (2.0 * REACH)
        for key in ("mu_star", "sigma", "mu")
    )
    labels = [_label(study, name) for name in groups]
    by_size = np.argsort(-effect.max(axis=0))
    rest = effect[:, by_size[SHOWN:]]
    order = by_size[:SHOWN][np.argsort(-effect[MEDIUM, by_size[:SHOWN]])]
    torques = [f"T₂ = {torque:g} N m" for torque in OUTPUT_TORQUE]
    first = [f"{labels[int(np.argmax(row))]} at {T2:g} N m" for row, T2 in zip(effect, OUTPUT_TORQUE, strict=True)]
    yield (
        f"Morris' elementary effects (SALib), {trajectories} trajectories over the {len(groups)} groups of uncertain"
        f" numbers of the definition, {REACH:g} standard deviations of their priors to either side; steady state at"
        " 20 m/s with the full model. Equal numbers of the bearings, the shafts and the flanks move together."
        f" Largest: {'; '.join(first)}."
    )
    names, title = [labels[i] for i in order], "What the final oil temperature hangs on"
    bars = Bars(
        "Effect on the oil at 20 m/s",
        "K per standard deviation",
        names,
        dict(zip(torques, effect[:, order], strict=True)),
    )
    yield Figure("sensitivity", title, "Mean absolute elementary effect.", [bars])
    rows = []
    for i in order:
        signed = np.where(effect[:, i] < SMALLEST, 0.0, np.sign(mean[:, i]) * effect[:, i])
        cells = (f"{e:+.2f} ({s:.2f})" if e else f"0 ({s:.2f})" for e, s in zip(signed, spread[:, i], strict=True))
        rows.append((labels[i], *cells))
    yield Table(
        "Change of the oil temperature in K per standard deviation (spread of the effects)",
        ("number of the definition", *torques),
        rows,
        f"The other {rest.shape[1]} are below {rest.max(initial=0.0):.1f} K. A spread as large as the effect indicates"
        " curvature or interplay with others.",
    )


def uncertain_groups(gearbox: Gearbox) -> dict[str, list[str]]:
    """Paths of the definition that have a prior, by group: those of several bearings, shafts or flanks move together.

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> uncertain_groups(load_gearbox("fzg"))["bearing.mu_bl"]
    ['bearing.0.mu_bl', 'bearing.1.mu_bl', 'bearing.2.mu_bl', 'bearing.3.mu_bl']
    """
    groups: dict[str, list[str]] = {}
    for path, sd in gearbox.priors.items():
        if sd > 0.0 and not path.startswith(WITHOUT_EFFECT):
            groups.setdefault(re.sub(r"\.\d+", "", path), []).append(path)
    return groups


def _final_oil(study: Study, groups: Sequence[Sequence[str]], z: Array) -> Array:
    """Steady oil temperature of variants [degC], shape (variants, 3 torques); `z` in standard deviations."""
    gearbox = study.gearbox
    # Variants that share the definition and differ in factors or inputs only are solved at once.
    shared: dict[tuple[tuple[str, float], ...], list[tuple[int, dict[str, float], dict[str, float]]]] = {}
    for index, row in enumerate(z):
        definition, factors, inputs = {}, {}, {}
        for paths, deviation in zip(groups, row.tolist(), strict=True):
            for path in paths:
                value, sd = float(gearbox.leaves[path]), gearbox.priors[path]
                if path.startswith(FACTOR):
                    factors[path.removeprefix(FACTOR)] = value * float(np.exp(deviation * sd))
                elif path in INPUTS:
                    inputs[INPUTS[path]] = value + deviation * sd
                else:
                    definition[path] = max(value + deviation * sd, 0.0)
        shared.setdefault(tuple(definition.items()), []).append((index, factors, inputs))
    point = float(study.pinion_speed[-1]), study.pinion_torque
    calls = [
        (gearbox, dict(definition), [v[1] for v in variants], [v[2] for v in variants], *point)
        for definition, variants in shared.items()
    ]
    parts = run_parallel(_settle, calls, jobs=study.settings.jobs)
    oil = np.empty((len(z), len(OUTPUT_TORQUE)))
    for variants, part in zip(shared.values(), parts, strict=True):
        oil[[v[0] for v in variants]] = part
    return oil


def _settle(
    gearbox: Gearbox,
    definition: Mapping[str, float],
    factors: Sequence[Mapping[str, float]],
    inputs: Sequence[Mapping[str, float]],
    speed: float,
    torque: Array,
) -> Array:
    """Oil temperature of variants of one definition [degC], shape (variants, torques)."""
    changed = gearbox.with_values(definition)
    each = np.repeat(np.arange(len(factors)), len(torque))
    parameters, given = (
        {name: np.array([row[name] for row in rows])[each] for name in rows[0]} for rows in (factors, inputs)
    )
    n, T = np.full(len(each), speed), np.tile(torque, len(factors))
    oil, _ = steady_oil(changed.network(), changed.losses(), speed=n, torque=T, inputs=given, parameters=parameters)
    return oil.reshape(len(factors), len(torque))


def _label(study: Study, name: str) -> str:
    """Path of the definition in words and its unit; for a factor, its description."""
    if name.startswith(FACTOR):
        return next(p.description for p in study.network.parameters if p.name == name.removeprefix(FACTOR))
    ending = max((ending for ending in UNITS if name.endswith(ending)), key=len)
    words = name.removeprefix("stage.").removesuffix(ending).replace("_", " ").replace(".", ", ")
    unit = UNITS[ending].symbol
    for plain, sign in SIGNS.items():
        unit = unit.replace(plain, sign)
    return f"{words} in {unit}" if unit else words


@dataclass(frozen=True)
class Comparison:
    """A published number and ours; `tolerance` is absolute and the source's own."""

    quantity: str
    source: str
    published: float
    ours: float
    tolerance: float
    decimals: int

    @property
    def met(self) -> bool:
        """True if ours is the published number within the source's tolerance."""
        return abs(self.published - self.ours) <= self.tolerance


@item("Published numbers", "Validation against numbers that are published", unchecked=Verdict.OURS)
def published_numbers(study: Study) -> Iterator[Part]:
    """All comparisons in one table, and the effect of published bearing coefficients."""
    rows = [*_compare_torques(study)]
    for case in GEARPIE:
        rows += _compare_gearpie(study.gearbox, case)
    rows += [*_compare_tips(study.gearbox), *_compare_oils()]
    missed = [row.quantity for row in rows if not row.met]
    yield (
        "The paper prints no results that could be compared one by one; these sources do. tests/validation holds them"
        " as tests. Tolerances are those of the sources: half a unit of the last printed digit unless the table states"
        " more."
    )
    yield Check(
        "ours_are_the_published_numbers",
        f"{len(rows)} published numbers.",
        f"{len(rows) - len(missed)} of them are met within the source's tolerance.",
        not missed,
        {"published": len(rows), "met": len(rows) - len(missed)},
        f"Not met: {', '.join(missed)}.",
    )
    yield Table(
        "Published and ours",
        ("quantity", "source", "published", "ours", "tolerance", "within"),
        [
            (
                row.quantity,
                row.source,
                f"{row.published:.{row.decimals}f}",
                f"{row.ours:.{row.decimals + 1}f}",
                f"{row.tolerance:.2g}",
                "yes" if row.met else "no",
            )
            for row in rows
        ],
    )
    own, at = study.gearbox.bearing[0], study.stated_temperatures(OUTPUT_TORQUE)
    changes = {f"bearing.{i}.{k}": v for i in range(len(study.gearbox.bearing)) for k, v in PORTO_BEARINGS.items()}
    coefficients = {
        f"SKF 2016: μ_bl {own.mu_bl:g}, μ_EHL {own.mu_EHL:g} (ours)": study.gearbox,
        "Porto, mineral gear oil: μ_bl {mu_bl:g}, μ_EHL {mu_EHL:g}".format(**PORTO_BEARINGS): study.gearbox.with_values(
            changes
        ),
    }
    lost = {
        name: study.by_kind(
            gearbox.losses().breakdown(speed=study.pinion_speed[MIDDLE], torque=study.pinion_torque, temperatures=at)
        )["bearings"]
        for name, gearbox in coefficients.items()
    }
    yield Table(
        f"Bearing losses in W at 8.3 m/s, oil {T_OIL:g} °C, with published friction coefficients",
        ("coefficients", *(f"T₂ = {torque:g} N m" for torque in OUTPUT_TORQUE)),
        [(name, *(f"{value:.1f}" for value in loss)) for name, loss in lost.items()],
    )


def _compare_torques(study: Study) -> Iterator[Comparison]:
    for (stage, torque), T2 in zip(LOAD_STAGES.items(), OUTPUT_TORQUE[1:], strict=True):
        # T2 is printed in whole N m.
        name = f"T₁ in N m at T₂ = {T2:g} N m"
        yield Comparison(name, f"FZG load stage {stage}", torque, T2 / study.ratio, 0.5 / study.ratio, 1)


def _compare_gearpie(gearbox: Gearbox, case: GearpieCase) -> Iterator[Comparison]:
    changes = {
        "stage.0.face_width_mm": case.b_mm,
        "stage.0.profile_shift": (0.1817, 0.1715),
        "stage.0.tip_shortening": case.tip_shortening,
    }
    stage = gearbox.with_values(changes).stage[0]
    pair = stage.pair()
    F_bt_per_b = case.T_1 / pair.r_b[0] / pair.b
    if case.name == "C14":
        b_H, p_H = hertz_line(F_bt_per_b, pair.rho_red_C, reduced_modulus(206e9, 0.3, 206e9, 0.3))
        points = contact_points(pair, model="potential_energy", r_bore=stage.bore_radius)
        sharing = load_sharing_loss_factor(pair, points)
        yield Comparison("C14, base pitch in mm", "GEARpie", 13.285, 1e3 * pair.p_b, 5e-4, 3)
        yield Comparison("C14, T₁T₂ in mm", "GEARpie", 34.93, 1e3 * pair.T1T2, 5e-3, 2)
        yield Comparison("C14, contact ratio", "GEARpie", 1.46, pair.epsilon_alpha, 5e-3, 2)
        yield Comparison("C14, H_V (Ohlendorf)", "GEARpie", 0.1986, pair.H_V, 5e-5, 4)
        yield Comparison("C14, Hertz pressure at C in MPa", "GEARpie", 1347.3, float(p_H) / 1e6, 0.3, 1)
        yield Comparison("C14, contact half-width in µm", "GEARpie", 199.6, float(b_H) * 1e6, 0.1, 1)
        yield Comparison("C14, H_VL (load sharing)", "GEARpie", case.HVL, sharing, 5.1e-5, 4)
    mu = float(
        friction_schlenk(
            F_bt_per_b=F_bt_per_b,
            v_sum_C=2.0 * case.n_1 * RPM * pair.T1C,
            rho_red_C=pair.rho_red_C,
            eta_oil=case.eta_mPas * 1e-3,
            Ra=0.5e-6 * sum(case.Ra_um),
            X_L=case.X_L,
        )
    )
    loss = case.T_1 * case.n_1 * RPM * case.HVL * mu
    rounding = case.P_VZP * (5e-5 / case.HVL + 5e-4)  # half a unit of the printed loss factor
    yield Comparison(f"{case.name}, friction (Schlenk)", "GEARpie", case.mu, mu, 5.1e-5, 4)
    yield Comparison(f"{case.name}, mesh loss in W", "GEARpie", case.P_VZP, loss, rounding, 1)


def _compare_tips(gearbox: Gearbox) -> Iterator[Comparison]:
    radii = gearbox.stage[0].pair().r_a
    for name, radius, diameter in zip(("pinion", "wheel"), radii, (82.46, 118.36), strict=True):
        # The shifts are rounded: 0.012 mm.
        label = f"Type C, tip diameter of the {name} in mm"
        yield Comparison(label, "FZG type C", diameter, 2e3 * radius, 0.012, 2)


def _compare_oils() -> Iterator[Comparison]:
    porto = ("University of Porto", PORTO_OILS, (40.0, 60.0, 80.0, 90.0, 100.0), 5.1e-3)
    arana = ("Arana et al. 2019", ARANA_OILS, (40.0, 100.0), 0.005)
    for source, oils, temperatures, tolerance in (porto, arana):
        for name, values in oils.items():
            ours = lubricant(named_oil(name)).kinematic_viscosity(np.array(temperatures))
            for T, value, own in zip(temperatures, values, ours.tolist(), strict=True):
                yield Comparison(f"{name}, viscosity at {T:g} °C in mm²/s", source, value, own, tolerance, 2)
