"""Tables 1, 2 and 5: the paper's numbers beside the definition's, one by one; and its equations as printed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from builder.reproduce.item import Check, Item, Table, judged
from builder.reproduce.study import MIDDLE, OUTPUT_TORQUE, PITCH_VELOCITY, TABLE_6_RPM, Study
from models.churning import churning_niemann, churning_niemann_printed
from models.gearbox import Gearbox
from models.runtime import RPM
from models.seal import seal_loss_linke

# What the paper prints: (what, value, path in the definition).
Row = tuple[str, object, str]
TABLE_1: tuple[Row, ...] = (
    ("Center distance in mm", 91.5, "stage.0.center_distance_mm"),
    ("Number of teeth, pinion", 16, "stage.0.z.0"),
    ("Number of teeth, wheel", 24, "stage.0.z.1"),
    ("Normal module in mm", 4.5, "stage.0.module_mm"),
    ("Normal pressure angle in °", 20.0, "stage.0.pressure_angle_deg"),
    ("Helix angle in °", 0.0, "stage.0.helix_angle_deg"),
    ("Face width in mm", 14.0, "stage.0.face_width_mm"),
    ("Addendum modification, pinion", 0.182, "stage.0.profile_shift.0"),
    ("Addendum modification, wheel", 0.172, "stage.0.profile_shift.1"),
    ("Flank roughness, pinion, in µm", 0.174, "stage.0.roughness_Ra_um.0"),
    ("Flank roughness, wheel, in µm", 0.157, "stage.0.roughness_Ra_um.1"),
    ("Bearings", "NU 406", "bearing.0.designation"),
    ("Seal, input shaft, in mm", 24.0, "seal.0.diameter_mm"),
    ("Seal, output shaft, in mm", 54.0, "seal.1.diameter_mm"),
    ("Kin. viscosity at 40 °C in mm²/s", 32.63, "oil.viscosity_points.0.1"),
    ("Kin. viscosity at 100 °C in mm²/s", 5.45, "oil.viscosity_points.1.1"),
    ("Density at 15 °C in kg/m³", 876.8, "oil.density_kg_m3"),
)
TABLE_2: tuple[Row, ...] = (
    ("Gear sliding: partial EHL, Arana et al.", "arana", "stage.0.friction.model"),
    ("Gear rolling: Anderson", "anderson_loewenthal", "stage.0.rolling.model"),
    ("Gear churning: Niemann", "niemann", "stage.0.churning.model"),
    ("Bearings: SKF", "skf", "bearing.0.model"),
    ("Seals: Simmering model", "linke", "seal.0.model"),
)
TABLE_5: tuple[Row, ...] = (
    ("Gearbox outside surface in m²", 0.214, "housing.outside_area_m2"),
    ("Gearbox inside surface in m²", 0.149, "housing.inside_area_m2"),
    ("Gearbox height in m", 0.215, "housing.height_m"),
    ("Wall thickness in m", 0.024, "housing.wall_thickness_m"),
    ("Heat transfer oil to housing in W/(m² K)", 950.0, "housing.oil_heat_transfer_W_m2K"),
    ("Conductivity of the housing in W/(m K)", 40.0, "housing.conductivity_W_mK"),
    ("Velocity of cooling air in m/s", 2.0, "ambient.air_speed_m_s"),
    ("Temperature of cooling air in °C", (25.0, 29.0), "ambient.temperature_degC"),
    ("Contact surface of forced air in m²", 0.214, "housing.outside_area_m2"),
    ("Length of pinion shaft in m", 0.223, "shaft.0.length_mm"),
    ("Diameter of pinion shaft in m", 0.024, "shaft.0.diameter_mm"),
    ("Length of wheel shaft in m", 0.090, "shaft.1.length_mm"),
    ("Diameter of wheel shaft in m", 0.055, "shaft.1.diameter_mm"),
    ("Conductivity of shafts in W/(m K)", 46.0, "shaft.0.conductivity_W_mK"),
)
ROUNDING = 1e-9


def definition_tables(study: Study) -> list[Item]:
    """Tables 1, 2 and 5 beside the definition."""
    return [
        _item(study.gearbox, "Table 1", "Characteristics of the rig", TABLE_1),
        _item(study.gearbox, "Table 2", "Model of each loss", TABLE_2),
        _item(study.gearbox, "Table 5", "Parameters of the thermal resistances", TABLE_5),
    ]


def values_equal_the_print(gearbox: Gearbox, rows: Sequence[Row]) -> Check:
    """Every printed value against the definition's."""
    wrong = [what for what, printed, path in rows if not _equal(printed, _ours(gearbox, what, path))]
    return judged(
        "values_equal_the_print",
        f"{len(rows)} printed values.",
        f"{len(rows) - len(wrong)} of them are those of the definition"
        + (f"; not: {', '.join(wrong)}." if wrong else "."),
        not wrong,
        numbers={"printed": len(rows), "equal": len(rows) - len(wrong)},
        otherwise="The definition departs from the print; its file says why.",
    )


def pitch_velocities_are_the_wheels(study: Study) -> Item:
    """Table 6: which shaft has the printed speeds."""
    pair = study.gearbox.stage[0].pair()
    wheel, pinion = (60.0 / (2.0 * np.pi) * PITCH_VELOCITY / radius for radius in (pair.r_w[1], pair.r_w[0]))
    off_wheel, off_pinion = (float(np.max(np.abs(TABLE_6_RPM / n - 1.0))) for n in (wheel, pinion))
    check = judged(
        "pitch_velocities_belong_to_the_input_shaft",
        "Table 6 calls 174 ... 3476 1/min the speed of the input shaft; elsewhere the input shaft is the pinion's.",
        f"For the printed pitch velocities the wheel needs the printed speeds within {off_wheel:.2%}; the pinion needs "
        f"{pinion[0]:.0f} ... {pinion[-1]:.0f} 1/min, {off_pinion:.0%} away from the print.",
        off_pinion < off_wheel,
        numbers={"off_as_wheel_speed": off_wheel, "off_as_pinion_speed": off_pinion},
        otherwise=(
            "The printed speeds are the wheel shaft's, which the rig's motor drives. Our input is the pinion shaft: "
            "1.5 times the speed and T₂ / 1.5."
        ),
    )
    torque = [f"{T2:g} / {T2 / study.ratio:.0f}" for T2 in OUTPUT_TORQUE]
    rows = tuple(
        (f"{3 * i} - {3 * i + 3}", f"{v:g}", f"{n:.0f}", f"{n_wheel:.0f}", f"{n_pinion:.0f}", f"{ours:.0f}")
        for i, (v, n, n_wheel, n_pinion, ours) in enumerate(
            zip(PITCH_VELOCITY, TABLE_6_RPM, wheel, pinion, study.pinion_speed, strict=True)
        )
    )
    return Item(
        key="Table 6",
        title="Kinematic condition of the measurement",
        reading=f"T₂ / T₁ in N m: {', '.join(torque)}.",
        checks=(check,),
        tables=(
            Table(
                title="Speeds in 1/min",
                header=(
                    "time in h",
                    "v in m/s",
                    "printed, input shaft",
                    "wheel at v",
                    "pinion at v",
                    "pinion, as run here",
                ),
                rows=rows,
            ),
        ),
    )


def equations_as_printed(study: Study) -> Item:
    """Eqs. (6) and (10), computed literally."""
    gearbox, pair = study.gearbox, study.gearbox.stage[0].pair()
    v, omega_1 = 8.3, study.pinion_speed[MIDDLE] * RPM
    immersion = tuple(r_a - gearbox.oil.level_below_axis for r_a in pair.r_a)
    literal = [
        float(churning_niemann_printed(e=e, b=pair.b, v_t=v, omega=w))
        for e, w in zip(immersion, (omega_1, omega_1 / pair.u), strict=True)
    ]
    own = sum(float(churning_niemann(e=e, b=pair.b, v_t=v)) for e in immersion)
    power = omega_1 * study.pinion_torque[-1]
    seal = gearbox.seal[0]
    n = study.pinion_speed[MIDDLE]

    def seals(c_T: float, T: float) -> float:
        one = seal_loss_linke(d_mm=24.0, n_rpm=n, T_oil=T, nu_40=seal.nu_40_mm2_s or 32.0, c_T=c_T)
        two = seal_loss_linke(d_mm=54.0, n_rpm=n / pair.u, T_oil=T, nu_40=seal.nu_40_mm2_s or 32.0, c_T=c_T)
        return float(one + two)

    churning = judged(
        "eq_6_is_below_the_power_transmitted",
        "Eq. (6): P = ω e v^1.5 b / 2.72e-6.",
        f"Literally, at 8.3 m/s: {literal[0] / 1e3:.0f} kW (pinion) and {literal[1] / 1e3:.0f} kW (wheel) of churning,"
        f" with {power / 1e3:.0f} kW transmitted at the highest torque. Without ω and with 2.72e-3: {own:.1f} W.",
        sum(literal) < power,
        numbers={"printed_W": sum(literal), "taken_W": own, "transmitted_W": power},
        otherwise=(
            "As printed its dimension is wrong; Niemann's own form has no speed and gives kW from mm. That one is"
            " taken."
        ),
    )
    ratio = seals(1.0, 90.0) / seals(1.6, 90.0)
    sealing = judged(
        "eq_10_is_the_standards",
        "Eq. (10): 145 - ϑ + 350 log log (VG + 0.8).",
        f"Both seals at 8.3 m/s: as printed {seals(1.0, 60.0):.0f} W at 60 °C and {seals(1.0, 90.0):.0f} W at 90 °C;"
        f" with 1.6 ϑ {seals(1.6, 60.0):.0f} W and {seals(1.6, 90.0):.0f} W.",
        abs(ratio - 1.0) < 0.05,
        numbers={"printed_90_W": seals(1.0, 90.0), "standard_90_W": seals(1.6, 90.0)},
        otherwise="ISO/TR 14179-2 (Linke) has 1.6 ϑ, which is taken; the printed one is selectable in the definition.",
    )
    return Item(
        key="Eqs. (6), (10)",
        title="Equations as printed",
        reading="Computed literally, beside the form that is taken.",
        checks=(churning, sealing),
    )


def _item(gearbox: Gearbox, key: str, title: str, rows: Sequence[Row]) -> Item:
    shown = tuple(
        (what, _text(printed), _text(_ours(gearbox, what, path)), gearbox.source_of(path))
        for what, printed, path in rows
    )
    return Item(
        key=key,
        title=title,
        reading="The definition models/gearboxes/fzg.toml beside the print.",
        checks=(values_equal_the_print(gearbox, rows),),
        tables=(
            Table(title=key, header=("quantity", "printed", "ours", "where ours comes from"), rows=shown, texts=True),
        ),
    )


def _ours(gearbox: Gearbox, what: str, path: str) -> object:
    value = gearbox.leaves[path]
    # The table prints shafts in metres, the definition in millimetres.
    return value / 1e3 if what.endswith(" in m") and path.endswith("_mm") else value


def _equal(printed: object, ours: object) -> bool:
    if isinstance(printed, tuple):
        return isinstance(ours, float) and printed[0] <= ours <= printed[1]
    if isinstance(printed, int | float) and isinstance(ours, int | float):
        return abs(printed - ours) <= ROUNDING * abs(printed)
    return printed == ours


def _text(value: object) -> str:
    if isinstance(value, tuple):
        return " to ".join(f"{v:g}" for v in value)
    return f"{value:g}" if isinstance(value, int | float) else str(value)
