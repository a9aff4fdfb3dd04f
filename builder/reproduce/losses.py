"""Section 3: losses over speed (fig. 3), their breakdown over torque (fig. 4), and a loss map."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from builder.reproduce.figure import BLACK, Curve, Figure, Map, Plot
from builder.reproduce.item import Check, Item, Table, Verdict, judged, silent
from builder.reproduce.steady import steady_oil
from builder.reproduce.study import (
    BEARING_ABOVE_OIL,
    GEAR_ABOVE_OIL,
    MIDDLE,
    OUTPUT_TORQUE,
    PITCH_VELOCITY,
    T_OIL,
    TABLE_6_RPM,
    Study,
)
from models.runtime import RPM
from models.types import Array

CHURNING = {"niemann": "Niemann (as in the paper)", "mauz": "Mauz", "changenet_velex": "Changenet-Velex"}
WARM_OIL = 90.0  # degC
STATED = (
    f"The paper gives no temperatures for this figure, and no numbers. Taken here: oil {T_OIL:g} °C, bearings "
    f"{BEARING_ABOVE_OIL:g} K above it, gears {GEAR_ABOVE_OIL[0]:g}, {GEAR_ABOVE_OIL[1]:g} and {GEAR_ABOVE_OIL[2]:g} K "
    f"above it at {OUTPUT_TORQUE[0]:g}, {OUTPUT_TORQUE[1]:g} and {OUTPUT_TORQUE[2]:g} N m (linear between). The speeds "
    "of Table 6 are read as the wheel's."
)


def losses_over_speed(study: Study) -> Item:
    """Fig. 3: total loss against pitch velocity at three torques, with the spread of churning formulas."""
    total = {name: _totals(study, name, T_OIL) for name in CHURNING}
    fine = np.union1d(np.linspace(PITCH_VELOCITY[0], PITCH_VELOCITY[-1], 39), PITCH_VELOCITY)
    smooth = {name: _totals(study, name, T_OIL, fine) for name in CHURNING}
    warm = _totals(study, "niemann", WARM_OIL, fine)
    spread = np.array([*smooth.values()])
    names = [f"T₂ = {torque:g} N m" for torque in OUTPUT_TORQUE]
    overview = Plot(
        title=f"Total loss, oil {T_OIL:g} °C",
        x_label="Pitch line velocity in m/s",
        y_label="Total power loss in W",
        curves=tuple(
            Curve(label=name, x=PITCH_VELOCITY, y=total["niemann"][i], names=_speeds(study, PITCH_VELOCITY))
            for i, name in enumerate(names)
        ),
    )
    spreads = tuple(
        Plot(
            title=f"{name}: which churning formula",
            x_label="Pitch line velocity in m/s",
            y_label="Total power loss in W",
            curves=(
                Curve(
                    label="between the formulas",
                    kind="band",
                    colour="#D3DBE0",
                    x=fine,
                    y=spread[:, i].max(axis=0),
                    low=spread[:, i].min(axis=0),
                ),
                *(
                    Curve(label=CHURNING[f], x=fine, y=smooth[f][i], names=_speeds(study, fine), colour=colour)
                    for f, colour in zip(CHURNING, (BLACK, "#CC79A7", "#56B4E9"), strict=True)
                ),
                Curve(label=f"Niemann, oil {WARM_OIL:g} °C", x=fine, y=warm[i], dashed=True, colour="#6B6B6B"),
            ),
        )
        for i, name in enumerate(names)
    )
    settled = _settled(study)
    return Item(
        key="Fig. 3",
        title="Total power loss against pitch velocity",
        reading=STATED,
        checks=(
            underestimates_at_high_speed_and_low_torque(total),
            underestimation_stays_constant_over_torque(total),
            trend_changes_with_torque(total["niemann"]),
            silent(
                "agrees_with_measurement_at_high_torque",
                "Good correlation with the measurement at high torque.",
                "The measured values are drawn, not printed.",
            ),
        ),
        tables=(_table(study, total, settled),),
        figures=(
            Figure(
                name="fig_03",
                title="Fig. 3: total loss against pitch velocity",
                panels=(overview, *spreads),
                caption="Shaded: between the lowest and the highest of three churning formulas.",
            ),
        ),
    )


def underestimates_at_high_speed_and_low_torque(total: Mapping[str, Array]) -> Check:
    """Niemann's churning against two other formulas, at the highest speed."""
    missing = np.array([total[f][:, -1] - total["niemann"][:, -1] for f in ("mauz", "changenet_velex")])
    share = missing.mean(axis=0) / total["niemann"][:, -1]
    return judged(
        "underestimates_at_high_speed_and_low_torque",
        "At low to medium torque the model underestimates the loss at high speed; Niemann's formula is a rough"
        " estimate.",
        f"At 20 m/s Mauz and Changenet-Velex give {missing[0, 0]:.0f} and {missing[1, 0]:.0f} W more than Niemann: "
        f"{share[0]:.0%} of the total without load, {share[1]:.0%} at {OUTPUT_TORQUE[1]:g} N m, {share[2]:.0%} at "
        f"{OUTPUT_TORQUE[2]:g} N m.",
        bool((missing > 0.0).all() and share[0] > share[1] > share[2]),
        numbers={
            "mauz_W": missing[0, 0],
            "changenet_velex_W": missing[1, 0],
            "share_0": share[0],
            "share_453": share[2],
        },
        otherwise="The other churning formulas do not give more than Niemann's here.",
    )


def underestimation_stays_constant_over_torque(total: Mapping[str, Array]) -> Check:
    """The gap between the formulas, at every speed, over the three torques."""
    gaps = np.array([total[f] - total["niemann"] for f in ("mauz", "changenet_velex")])
    spread = float(np.max(np.ptp(gaps, axis=1)))
    return judged(
        "underestimation_stays_constant_over_torque",
        "The error remains approximately constant as the torque increases.",
        f"The gap between the formulas varies by {spread:.1f} W at most over the three torques, of up to "
        f"{gaps.max():.0f} W (no churning formula knows the torque, so at equal oil temperature it must be constant).",
        spread < 0.01 * gaps.max(),
        numbers={"spread_W": spread, "largest_gap_W": gaps.max()},
        otherwise="The gap depends on the torque.",
    )


def trend_changes_with_torque(total: Array) -> Check:
    """Exponent of the loss over speed in the upper half of the speeds."""
    exponent = np.log(total[:, -1] / total[:, MIDDLE]) / np.log(PITCH_VELOCITY[-1] / PITCH_VELOCITY[MIDDLE])
    return judged(
        "trend_changes_with_torque",
        "A different trend distinguishes the total loss at high torque from that at lower torque.",
        f"From 8.3 to 20 m/s the loss goes with the speed to the power {exponent[0]:.2f}, {exponent[1]:.2f} and "
        f"{exponent[2]:.2f} at {OUTPUT_TORQUE[0]:g}, {OUTPUT_TORQUE[1]:g} and {OUTPUT_TORQUE[2]:g} N m: "
        "steeper than linear without load, flatter with it.",
        bool(exponent[0] > 1.0 > exponent[2]),
        numbers={f"exponent_{t:g}": e for t, e in zip(OUTPUT_TORQUE, exponent, strict=True)},
        otherwise="The trends do not differ in this way.",
    )


def breakdown_over_torque(study: Study) -> Item:
    """Fig. 4: the components at 8.3 m/s over torque."""
    torque = np.linspace(0.0, OUTPUT_TORQUE[-1], 61)
    speed = study.pinion_speed[MIDDLE]
    parts = _components(study, speed, torque)
    stacked = Plot(
        title="Stacked components",
        x_label="Output torque T₂ in N m",
        y_label="Power loss in W",
        curves=tuple(Curve(label=name, x=torque, y=loss, kind="area") for name, loss in parts.items()),
    )
    share = Plot(
        title="Share of the total",
        x_label="Output torque T₂ in N m",
        y_label="Share of the total loss in %",
        curves=tuple(
            Curve(label=name, x=torque, y=100.0 * loss / _sum(parts), kind="area") for name, loss in parts.items()
        ),
    )
    at = _components(study, speed, OUTPUT_TORQUE)
    rows = tuple((name, *(f"{value:.1f}" for value in loss)) for name, loss in at.items())
    rows += (("total", *(f"{value:.1f}" for value in _sum(at))),)
    return Item(
        key="Fig. 4",
        title="Loss breakdown at 8.3 m/s over torque",
        reading=STATED + " The bearings' loss without torque is their no-load loss; what is above it, load-dependent.",
        checks=(no_load_losses_constant_over_torque(at), sliding_and_bearings_dominate_at_high_torque(at)),
        tables=(
            Table(
                title=f"Loss in W at 8.3 m/s (pinion {speed:.0f}, wheel {TABLE_6_RPM[MIDDLE]:.0f} 1/min)",
                header=("component", *(f"T₂ = {t:g} N m" for t in OUTPUT_TORQUE)),
                rows=rows,
            ),
        ),
        figures=(
            Figure(
                name="fig_04",
                title="Fig. 4: loss breakdown at 8.3 m/s",
                panels=(stacked, share),
                caption="Pinion torque is T₂ / 1.5.",
            ),
        ),
    )


def no_load_losses_constant_over_torque(parts: Mapping[str, Array]) -> Check:
    """Churning, seals and the bearings' loss without load."""
    names = ("churning", "seals", "bearings, no load")
    spread = {name: float(np.ptp(parts[name]) / parts[name].max()) for name in names}
    return judged(
        "no_load_losses_constant_over_torque",
        "The no-load losses (churning, bearings without load, seals) remain constant varying the output torque.",
        "Largest relative change from no torque to the highest: "
        + ", ".join(f"{name} {value:.1%}" for name, value in spread.items())
        + ".",
        max(spread.values()) < 0.01,
        numbers=spread,
        otherwise="A no-load loss changes with the torque.",
    )


def sliding_and_bearings_dominate_at_high_torque(parts: Mapping[str, Array]) -> Check:
    """Share of the load-dependent losses at the highest torque."""
    total = float(_sum(parts)[-1])
    share = {name: float(parts[name][-1]) / total for name in ("sliding", "bearings, load-dependent")}
    both = sum(share.values())
    return judged(
        "sliding_and_bearings_dominate_at_high_torque",
        "At high contact pressure gear sliding and load-dependent bearing losses predominate.",
        f"At {OUTPUT_TORQUE[-1]:g} N m: sliding {share['sliding']:.0%}, load-dependent bearing losses "
        f"{share['bearings, load-dependent']:.0%} of the total; sliding alone dominates by far.",
        both > 0.5 and max(parts, key=lambda name: parts[name][-1]) == "sliding",
        numbers={"sliding": share["sliding"], "bearings": share["bearings, load-dependent"]},
        otherwise="Other losses are larger.",
    )


def loss_map(study: Study) -> Item:
    """Loss and efficiency over speed and torque, and how far the surrogate is from them."""
    speed, torque = np.linspace(50.0, 6500.0, 66), np.linspace(2.0, 350.0, 59)
    n, T1 = np.meshgrid(speed, torque)
    temperatures = study.stated_temperatures(T1 * study.ratio)
    loss = study.full.power(n, T1, temperatures).sum(axis=-1)
    reduced = study.surrogate.power(n, T1, temperatures).sum(axis=-1)
    efficiency = 100.0 * (1.0 - loss / (n * RPM * T1))
    difference = 100.0 * np.abs(reduced / loss - 1.0)
    drawn = partial(Map, x_label="Pinion speed in 1/min", y_label="Pinion torque in N m", x=speed, y=torque)
    panels = (
        drawn(
            title="Total loss, full model",
            z_label="Loss in W",
            z=loss,
            levels=(0.0, 100.0, 200.0, 400.0, 600.0, 800.0, 1000.0, 1250.0, 1500.0, 1750.0, 2000.0),
        ),
        drawn(
            title="Efficiency, full model",
            z_label="Efficiency in %",
            z=np.maximum(efficiency, 90.0),
            levels=(90.0, 95.0, 97.0, 98.0, 98.2, 98.4, 98.6, 98.7, 98.8, 98.9, 99.0),
        ),
        drawn(
            title="Networks against the full model",
            z_label="Difference of the total loss in %",
            z=difference,
            levels=(0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0),
        ),
    )
    return Item(
        key="Loss map",
        title="Loss and efficiency over speed and torque",
        reading=(
            f"Oil {T_OIL:g} °C, bearings and gears warmer as for Fig. 3. Efficiencies below 90 % are drawn as 90 %. The"
            f" networks' total loss is {np.median(difference):.2f} % off in the median, {difference.max():.2f} % at"
            " most."
        ),
        figures=(
            Figure(
                name="loss_map",
                title="Loss map of the rig",
                panels=panels,
                caption="One stage, pinion side; hover for values.",
            ),
        ),
        without_checks=Verdict.OURS,
    )


def _totals(study: Study, churning: str, T_oil: float, velocity: Array = PITCH_VELOCITY) -> Array:
    """Total loss [W], shape (3 torques, speeds)."""
    model = study.gearbox.with_values({"stage.0.churning.model": churning}).losses()
    n, T2 = np.meshgrid(_pinion_speed(study, velocity), OUTPUT_TORQUE)
    return np.asarray(model.power(n, T2 / study.ratio, study.stated_temperatures(T2, T_oil=T_oil)).sum(axis=-1))


def _components(study: Study, speed: float, output_torque: Array) -> dict[str, Array]:
    """Losses by kind over torque [W], each of the torques' shape."""
    temperatures = study.stated_temperatures(output_torque)
    power = study.full.power(speed, output_torque / study.ratio, temperatures)
    unloaded = study.full.power(speed, 0.0, temperatures)
    column = {name: i for i, name in enumerate(study.full.components)}
    seals = [column[seal.name] for seal in study.gearbox.seal]
    bearings = [column[bearing.name] for bearing in study.gearbox.bearing]
    no_load = unloaded[:, bearings].sum(axis=-1)
    return {
        "seals": power[:, seals].sum(axis=-1),
        "churning": power[:, column["churning"]],
        "bearings, no load": no_load,
        "bearings, load-dependent": power[:, bearings].sum(axis=-1) - no_load,
        "rolling": power[:, column["mesh_rolling"]],
        "sliding": power[:, column["mesh_sliding"]],
    }


def _sum(parts: Mapping[str, Array]) -> Array:
    return np.asarray(np.sum([*parts.values()], axis=0))


def _settled(study: Study) -> tuple[Array, Array]:
    """Total loss [W] and oil temperature [degC] at the network's own steady state, shape (3 torques, 6 speeds)."""
    n, T1 = np.meshgrid(study.pinion_speed, study.pinion_torque)
    oil, loss = steady_oil(study.network, study.full, speed=n.ravel(), torque=T1.ravel())
    return loss.reshape(n.shape), oil.reshape(n.shape)


def _table(study: Study, total: Mapping[str, Array], settled: tuple[Array, Array]) -> Table:
    rows = []
    for i, torque in enumerate(OUTPUT_TORQUE):
        for j, velocity in enumerate(PITCH_VELOCITY):
            rows.append(
                (
                    f"{torque:g}",
                    f"{velocity:g}",
                    f"{TABLE_6_RPM[j]:.0f}",
                    f"{study.pinion_speed[j]:.0f}",
                    *(f"{total[f][i, j]:.0f}" for f in CHURNING),
                    f"{settled[0][i, j]:.0f}",
                    f"{settled[1][i, j]:.0f}",
                )
            )
    return Table(
        title="Total loss in W",
        header=(
            "T₂ in N m",
            "v in m/s",
            "n wheel in 1/min",
            "n pinion in 1/min",
            "Niemann",
            "Mauz",
            "Changenet-Velex",
            "at its steady state",
            "oil there in °C",
        ),
        rows=tuple(rows),
        note=(
            "Steady state: the thermal network with the paper's boundary conditions; above about 200 °C no formula"
            " holds."
        ),
    )


def _pinion_speed(study: Study, velocity: Array) -> Array:
    """Speeds of Table 6, and between them, [1/min]."""
    return np.interp(velocity, PITCH_VELOCITY, study.pinion_speed)


def _speeds(study: Study, velocity: Array) -> tuple[str, ...]:
    speeds = _pinion_speed(study, velocity).tolist()
    return tuple(f"pinion {n:.0f}, wheel {n / study.ratio:.0f} 1/min" for n in speeds)
