"""Section 3: losses over speed (fig. 3), their breakdown over torque (fig. 4), and a loss map."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from builder.reproduce.figure import BLACK, Curve, Figure, Map, Plot
from builder.reproduce.printed import OUTPUT_TORQUE, PITCH_VELOCITY, TABLE_6_RPM
from builder.reproduce.report import Check, Part, Table, Verdict, item
from builder.reproduce.study import BEARING_ABOVE_OIL, GEAR_ABOVE_OIL, MIDDLE, T_OIL, Study, steady_oil
from models.base.types import Array
from models.portable.evaluation import RPM
from models.quantities.part_colours import part_colours

CHURNING = {"niemann": "Niemann (as in the paper)", "mauz": "Mauz", "changenet_velex": "Changenet-Velex"}
WARM_OIL = 90.0  # degC
ASSUMED = (
    f"The paper gives no temperatures for this figure, and no numbers. Assumed here: oil {T_OIL:g} °C, bearings "
    f"{BEARING_ABOVE_OIL:g} K above it, gears {GEAR_ABOVE_OIL[0]:g}, {GEAR_ABOVE_OIL[1]:g} and {GEAR_ABOVE_OIL[2]:g} K "
    f"above it at {OUTPUT_TORQUE[0]:g}, {OUTPUT_TORQUE[1]:g} and {OUTPUT_TORQUE[2]:g} N m (linear between). The speeds "
    "of Table 6 are read as the wheel's."
)
TORQUES = [f"T₂ = {torque:g} N m" for torque in OUTPUT_TORQUE]


@item("Fig. 3", "Total power loss against pitch velocity")
def losses_over_speed(study: Study) -> Iterator[Part]:
    """Total loss at three torques, with the spread of churning formulas."""

    def total(churning: str, velocity: Array, T_oil: float = T_OIL) -> Array:
        """Loss [W], shape (3 torques, speeds)."""
        model = study.gearbox.with_values({"stage.0.churning.model": churning}).losses()
        n, T2 = np.meshgrid(np.interp(velocity, PITCH_VELOCITY, study.pinion_speed), OUTPUT_TORQUE)
        temperatures = study.stated_temperatures(T2, T_oil=T_oil)
        return np.asarray(model.breakdown(speed=n, torque=T2 / study.ratio, temperatures=temperatures)["total"])

    niemann, mauz, changenet = (total(name, PITCH_VELOCITY) for name in CHURNING)
    yield ASSUMED
    missing = np.array([other[:, -1] - niemann[:, -1] for other in (mauz, changenet)])
    share = missing.mean(axis=0) / niemann[:, -1]
    yield Check(
        "underestimates_at_high_speed_and_low_torque",
        "At low to medium torque the model underestimates the loss at high speed; Niemann's formula is a rough"
        " estimate.",
        f"At 20 m/s Mauz and Changenet-Velex give {missing[0, 0]:.0f} and {missing[1, 0]:.0f} W more than Niemann: "
        f"{share[0]:.0%} of the total without load, {share[1]:.0%} at {OUTPUT_TORQUE[1]:g} N m, {share[2]:.0%} at "
        f"{OUTPUT_TORQUE[2]:g} N m.",
        bool((missing > 0.0).all() and share[0] > share[1] > share[2]),
        {"mauz_W": missing[0, 0], "changenet_velex_W": missing[1, 0], "share_0": share[0], "share_453": share[2]},
        "The other churning formulas do not give more than Niemann's here.",
    )
    gaps = np.array([mauz - niemann, changenet - niemann])
    spread = float(np.max(np.ptp(gaps, axis=1)))
    yield Check(
        "underestimation_stays_constant_over_torque",
        "The error remains approximately constant as the torque increases.",
        f"The gap between the formulas varies by {spread:.1f} W at most over the three torques, of up to "
        f"{gaps.max():.0f} W (no churning formula knows the torque, so at equal oil temperature it must be constant).",
        spread < 0.01 * gaps.max(),
        {"spread_W": spread, "largest_gap_W": gaps.max()},
        "The gap depends on the torque.",
    )
    exponent = np.log(niemann[:, -1] / niemann[:, MIDDLE]) / np.log(PITCH_VELOCITY[-1] / PITCH_VELOCITY[MIDDLE])
    yield Check(
        "trend_changes_with_torque",
        "A different trend distinguishes the total loss at high torque from that at lower torque.",
        f"From 8.3 to 20 m/s the loss goes with the speed to the power {exponent[0]:.2f}, {exponent[1]:.2f} and "
        f"{exponent[2]:.2f} at {OUTPUT_TORQUE[0]:g}, {OUTPUT_TORQUE[1]:g} and {OUTPUT_TORQUE[2]:g} N m: "
        "steeper than linear without load, flatter with it.",
        bool(exponent[0] > 1.0 > exponent[2]),
        {f"exponent_{torque:g}": e for torque, e in zip(OUTPUT_TORQUE, exponent, strict=True)},
        "The trends do not differ in this way.",
    )
    yield Check(
        "agrees_with_measurement_at_high_torque",
        "Good correlation with the measurement at high torque.",
        "",
        None,
        otherwise="The measured values are drawn, not printed.",
    )
    fine = np.union1d(np.linspace(PITCH_VELOCITY[0], PITCH_VELOCITY[-1], 39), PITCH_VELOCITY)
    smooth = {label: total(name, fine) for name, label in CHURNING.items()}
    warm = total("niemann", fine, WARM_OIL)
    low, high = (bound([*smooth.values()], axis=0) for bound in (np.min, np.max))
    axes = "Pitch line velocity in m/s", "Total power loss in W"
    panels = [
        Plot(
            f"Total loss, oil {T_OIL:g} °C",
            *axes,
            [Curve(name, PITCH_VELOCITY, niemann[i]) for i, name in enumerate(TORQUES)],
        )
    ]
    for i, name in enumerate(TORQUES):
        curves = [Curve("between the formulas", fine, high[i], "band", "#D3DBE0", low=low[i])]
        for (label, loss), colour in zip(smooth.items(), (BLACK, "#CC79A7", "#56B4E9"), strict=True):
            curves.append(Curve(label, fine, loss[i], colour=colour))
        curves.append(Curve(f"Niemann, oil {WARM_OIL:g} °C", fine, warm[i], "dashed", "#6B6B6B"))
        panels.append(Plot(f"{name}: which churning formula", *axes, curves))
    caption = "Shaded: between the lowest and the highest of three churning formulas."
    yield Figure("fig_03", "Fig. 3: total loss against pitch velocity", caption, panels)
    n, T1 = np.meshgrid(study.pinion_speed, study.pinion_torque)
    oil, loss = steady_oil(study.network, study.full, speed=n.ravel(), torque=T1.ravel())
    columns = [np.repeat(OUTPUT_TORQUE, 6), np.tile(PITCH_VELOCITY, 3), np.tile(TABLE_6_RPM, 3), n.ravel()]
    columns += [niemann.ravel(), mauz.ravel(), changenet.ravel(), loss, oil]
    yield Table(
        "Total loss in W",
        ("T₂ in N m", "v in m/s", "n wheel in 1/min", "n pinion in 1/min", "Niemann", "Mauz", "Changenet-Velex",
         "at its steady state", "oil there in °C"),
        [(f"{T2:g}", f"{v:g}", *(f"{value:.0f}" for value in rest)) for T2, v, *rest in zip(*columns, strict=True)],
        "Steady state: the thermal network with the paper's boundary conditions; above about 200 °C no formula holds.",
    )  # fmt: skip


@item("Fig. 4", "Loss breakdown at 8.3 m/s over torque")
def breakdown_over_torque(study: Study) -> Iterator[Part]:
    """The components over torque."""
    speed = study.pinion_speed[MIDDLE]

    def components(output_torque: Array) -> dict[str, Array]:
        given = {"speed": speed, "temperatures": study.stated_temperatures(output_torque)}
        parts = study.by_kind(study.full.breakdown(torque=output_torque / study.ratio, **given))
        no_load = study.by_kind(study.full.breakdown(torque=0.0, **given))["bearings"]
        return {
            "seals": parts["seals"],
            "churning": parts["churning"],
            "bearings, no load": no_load,
            "bearings, load-dependent": parts["bearings"] - no_load,
            "rolling": parts["rolling"],
            "sliding": parts["sliding"],
        }

    at = components(OUTPUT_TORQUE)
    total = np.sum([*at.values()], axis=0)
    yield ASSUMED + " The bearings' loss without torque is their no-load loss; what is above it, load-dependent."
    spread = {n: float(np.ptp(at[n]) / at[n].max()) for n in ("churning", "seals", "bearings, no load")}
    yield Check(
        "no_load_losses_constant_over_torque",
        "The no-load losses (churning, bearings without load, seals) remain constant varying the output torque.",
        "Largest relative change from no torque to the highest: "
        + ", ".join(f"{name} {value:.1%}" for name, value in spread.items())
        + ".",
        max(spread.values()) < 0.01,
        spread,
        "A no-load loss changes with the torque.",
    )
    sliding, bearings = (float(at[n][-1] / total[-1]) for n in ("sliding", "bearings, load-dependent"))
    yield Check(
        "sliding_and_bearings_dominate_at_high_torque",
        "At high contact pressure gear sliding and load-dependent bearing losses predominate.",
        f"At {OUTPUT_TORQUE[-1]:g} N m: sliding {sliding:.0%}, load-dependent bearing losses {bearings:.0%} of the"
        " total; sliding alone dominates by far.",
        sliding + bearings > 0.5 and max(at, key=lambda name: at[name][-1]) == "sliding",
        {"sliding": sliding, "bearings": bearings},
        "Other losses are larger.",
    )
    torque = np.linspace(0.0, OUTPUT_TORQUE[-1], 61)
    parts = components(torque)
    share = 100.0 / np.sum([*parts.values()], axis=0)
    x_label = "Output torque T₂ in N m"
    colours = part_colours(parts)
    panels = [
        Plot(title, x_label, y_label, [Curve(n, torque, loss * scale, "area", colours[n]) for n, loss in parts.items()])
        for title, y_label, scale in (
            ("Stacked components", "Power loss in W", np.ones_like(share)),
            ("Share of the total", "Share of the total loss in %", share),
        )
    ]
    yield Figure("fig_04", "Fig. 4: loss breakdown at 8.3 m/s", "Pinion torque is T₂ / 1.5.", panels)
    yield Table(
        f"Loss in W at 8.3 m/s (pinion {speed:.0f}, wheel {TABLE_6_RPM[MIDDLE]:.0f} 1/min)",
        ("component", *TORQUES),
        [(name, *(f"{value:.1f}" for value in loss)) for name, loss in (at | {"total": total}).items()],
    )


@item("Loss map", "Loss and efficiency over speed and torque", unchecked=Verdict.OURS)
def loss_map(study: Study) -> Iterator[Part]:
    """Loss and efficiency over speed and torque, and the error of the networks."""
    speed, torque = np.linspace(50.0, 6500.0, 66), np.linspace(2.0, 350.0, 59)
    n, T1 = np.meshgrid(speed, torque)
    by_node = study.stated_temperatures(T1 * study.ratio)
    temperatures = np.stack([by_node[node] for node in study.full.temperature_nodes], axis=-1)
    loss, reduced = (m.power(n, T1, temperatures).sum(axis=-1) for m in (study.full, study.surrogate))
    efficiency = 100.0 * (1.0 - loss / (n * RPM * T1))
    difference = 100.0 * np.abs(reduced / loss - 1.0)
    yield (
        f"Oil {T_OIL:g} °C, bearings and gears warmer as for Fig. 3. Efficiencies below 90 % are drawn as 90 %. The"
        f" networks' total loss is {np.median(difference):.2f} % off in the median, {difference.max():.2f} % at most."
    )
    drawn = (
        ("Total loss, full model", "Loss in W", loss, (0, 100, 200, 400, 600, 800, 1000, 1250, 1500, 1750, 2000)),
        ("Efficiency, full model", "Efficiency in %", np.maximum(efficiency, 90.0),
         (90.0, 95.0, 97.0, 98.0, 98.2, 98.4, 98.6, 98.7, 98.8, 98.9, 99.0)),
        ("Networks against the full model", "Difference of the total loss in %", difference,
         (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0)),
    )  # fmt: skip
    axes = "Pinion speed in 1/min", "Pinion torque in N m"
    panels = [Map(title, *axes, z_label, speed, torque, z, levels) for title, z_label, z, levels in drawn]
    yield Figure("loss_map", "Loss map of the rig", "One stage, pinion side.", panels)
