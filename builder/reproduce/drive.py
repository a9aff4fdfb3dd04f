"""Section 6: the 600 s cycle with the full model and with both sets of networks (figs. 10 to 12)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from builder.drive_cycle import COLD_START, KNOTS, reference_cycle
from builder.plots import PALETTE
from builder.reproduce.figure import BLACK, Curve, Figure, Plot
from builder.reproduce.item import Check, Item, Table, judged, silent, target
from builder.reproduce.study import Study
from models.simulation import Result
from models.types import Array

FULL, REDUCED, PRINTED = "F-PL", "ROM-PL", "ROM-PL, networks as printed"
# Phases of the cycle [s]: the light start, constant power, high torque, and the load of the start again.
START, CONSTANT, HEAVY, END = (0.0, 60.0), (90.0, 300.0), (330.0, 450.0), (480.0, 600.0)
WARM = 60.0  # s: when the branches have begun to differ
GROUPS = ("sliding", "rolling", "churning", "seals", "bearings")
ALMOST_LOSS = 0.02  # "good agreement": of the mean total loss
ALMOST_K = 1.0  # "almost identical", [K]
NEARLY_ALWAYS = 0.95  # "is greater": of the time after the first seconds


def drive_cycle(study: Study) -> list[Item]:
    """Simulate the cycle three times and hold the paper's statements against it."""
    cycle = reference_cycle(study.gearbox)
    runs = {
        name: study.network.simulate(cycle, losses=losses, initial=COLD_START)
        for name, losses in ((FULL, study.full), (REDUCED, study.surrogate), (PRINTED, study.printed.losses))
    }
    return [_profile(study, runs[FULL]), _losses(study, runs), _temperatures(study, runs)]


def _profile(study: Study, full: Result) -> Item:
    wheel = full.inputs["speed"] / study.ratio
    time = "Time in s"
    speed = Plot(
        title="Speed",
        x_label=time,
        y_label="Speed in 1/min",
        curves=(
            Curve(label="pinion shaft (input)", x=full.time, y=full.inputs["speed"]),
            Curve(label="wheel shaft", x=full.time, y=wheel, dashed=True),
        ),
    )
    torque = Plot(
        title="Torque",
        x_label=time,
        y_label="Torque in N m",
        curves=(
            Curve(label="pinion shaft (input)", x=full.time, y=full.inputs["torque"]),
            Curve(label="wheel shaft", x=full.time, y=full.inputs["torque"] * study.ratio, dashed=True),
        ),
    )
    return Item(
        key="Fig. 10",
        title="Speed and torque of the drive cycle",
        reading=(
            "Built after the paper's words: 600 s, a cold start at 20 °C at low load, a phase of constant power, high "
            "torque, and the load of the start again at the end."
        ),
        checks=(
            silent(
                "profile_as_printed",
                "Speed and torque over 600 s.",
                "The paper draws the profile without numbers.",
                found=(
                    f"{KNOTS[-1, 0]:g} s, up to {full.inputs['speed'].max():.0f} 1/min and "
                    f"{full.inputs['torque'].max():.0f} N m at the pinion."
                ),
            ),
        ),
        figures=(Figure(name="fig_10", title="Fig. 10: drive cycle", panels=(speed, torque), caption="Our reading."),),
    )


def _losses(study: Study, runs: Mapping[str, Result]) -> Item:
    grouped = {name: _grouped(study, run) for name, run in runs.items()}
    total = Plot(
        title="Total",
        x_label="Time in s",
        y_label="Power loss in W",
        curves=(
            Curve(label=FULL, x=runs[FULL].time, y=runs[FULL].loss, colour=BLACK),
            Curve(label=REDUCED, x=runs[FULL].time, y=runs[REDUCED].loss, dashed=True, colour="#0072B2"),
            Curve(label=PRINTED, x=runs[FULL].time, y=runs[PRINTED].loss, dashed=True, colour="#D55E00"),
        ),
    )
    parts = tuple(
        Plot(
            title=name.capitalize(),
            x_label="Time in s",
            y_label="Power loss in W",
            curves=(
                Curve(label=FULL, x=runs[FULL].time, y=grouped[FULL][name], colour=BLACK),
                Curve(label=REDUCED, x=runs[FULL].time, y=grouped[REDUCED][name], dashed=True, colour="#0072B2"),
                Curve(label=PRINTED, x=runs[FULL].time, y=grouped[PRINTED][name], dashed=True, colour="#D55E00"),
            ),
        )
        for name in GROUPS
    )
    return Item(
        key="Fig. 11",
        title="Power loss during the drive cycle",
        reading="Same network, same cycle, the losses from the full model and from the networks.",
        checks=(
            agreement_is_good_after_the_start(runs),
            end_agrees_better_than_start(runs),
            our_start_agrees(runs),
            sliding_rises_slightly_at_constant_power(runs[FULL], grouped[FULL]),
            bearing_and_no_load_losses_fall_at_constant_power(runs[FULL], grouped[FULL]),
        ),
        figures=(
            Figure(
                name="fig_11",
                title="Fig. 11: power loss during the cycle",
                panels=(total, *parts),
                caption="Full model (F-PL), our networks, and the networks as printed.",
            ),
        ),
    )


def agreement_is_good_after_the_start(runs: Mapping[str, Result]) -> Check:
    """Mean relative difference of the total loss after the light start."""
    found = {name: _difference(runs, name, (CONSTANT[0], END[1])) for name in (REDUCED, PRINTED)}
    return judged(
        "agreement_is_good_after_the_start",
        "Good agreement between the two approaches, especially after the initial stage.",
        f"Mean difference of the total loss from {CONSTANT[0]:g} s on: {found[PRINTED]:.2%} with the networks as"
        f" printed, {found[REDUCED]:.2%} with ours.",
        max(found.values()) < ALMOST_LOSS,
        numbers={"printed": found[PRINTED], "ours": found[REDUCED]},
        otherwise="The networks are further off.",
    )


def end_agrees_better_than_start(runs: Mapping[str, Result]) -> Check:
    """Mean relative difference at the start and at the end, with the same load, networks as printed."""
    start, end = _difference(runs, PRINTED, START), _difference(runs, PRINTED, (END[0] + 60.0, END[1]))
    return judged(
        "end_agrees_better_than_start",
        "At the start the networks work around the lower limit of all parameters; in the final part, where load and"
        " speed are similar, the predictions are more appropriate because of the higher temperatures.",
        f"Networks as printed: {start:.1%} mean difference in the first {START[1]:g} s, {end:.1%} in the last 60 s.",
        end < start,
        numbers={"start": start, "end": end},
        otherwise="The end does not agree better than the start.",
    )


def our_start_agrees(runs: Mapping[str, Result]) -> Check:
    """Mean relative difference at the start, our networks."""
    start = _difference(runs, REDUCED, START)
    return target(
        "our_start_agrees",
        "Our target: the cold start agrees as well.",
        f"Our networks: {start:.2%} mean difference in the first {START[1]:g} s; it was the training, not the method.",
        start < ALMOST_LOSS,
        numbers={"start": start},
        otherwise="Our networks are off at the start as well.",
    )


def sliding_rises_slightly_at_constant_power(full: Result, losses: Mapping[str, Array]) -> Check:
    """Sliding loss at the beginning and the end of constant power."""
    first, last = _ends(full, losses["sliding"], CONSTANT)
    return judged(
        "sliding_rises_slightly_at_constant_power",
        "At constant power the sliding losses slightly increase with temperature.",
        f"From {first:.1f} to {last:.1f} W between {CONSTANT[0]:g} and {CONSTANT[1]:g} s ({last / first - 1.0:+.1%}),"
        f" while the oil warms from {_ends(full, full.temperatures['oil'], CONSTANT)[0]:.0f} to"
        f" {_ends(full, full.temperatures['oil'], CONSTANT)[1]:.0f} °C.",
        0.0 < last / first - 1.0 < 0.25,
        numbers={"first_W": first, "last_W": last},
        otherwise="Sliding does not rise slightly.",
    )


def bearing_and_no_load_losses_fall_at_constant_power(full: Result, losses: Mapping[str, Array]) -> Check:
    """Bearing and no-load losses at the beginning and the end of constant power."""
    change = {}
    for name, values in (
        ("bearings", losses["bearings"]),
        ("seals and churning", losses["seals"] + losses["churning"]),
    ):
        first, last = _ends(full, values, CONSTANT)
        change[name] = last / first - 1.0
    first, last = _ends(full, losses["sliding"], CONSTANT)
    sliding = last / first - 1.0
    return judged(
        "bearing_and_no_load_losses_fall_at_constant_power",
        "Bearing losses show the contrary, much more noticeable; the same for no-load losses.",
        f"Bearings {change['bearings']:+.1%}, seals and churning {change['seals and churning']:+.1%}, sliding"
        f" {sliding:+.1%}.",
        max(change.values()) < 0.0 and abs(change["bearings"]) > abs(sliding),
        numbers={"bearings": change["bearings"], "no_load": change["seals and churning"], "sliding": sliding},
        otherwise="They do not fall, or less than sliding rises.",
    )


def _temperatures(study: Study, runs: Mapping[str, Result]) -> Item:
    full, reduced = runs[FULL], runs[REDUCED]
    shown = {
        "Gears, mesh and oil": (*study.network.groups["gears"], "mesh", "oil"),
        "Shafts and bearings": (*study.network.groups["shafts"], "bearing_1", "bearing_3"),
        "Housing and oil": (*study.network.groups["housing"], "oil"),
    }
    nodes_shown = list(dict.fromkeys(node for nodes in shown.values() for node in nodes))
    panels = [
        Plot(
            title=title,
            x_label="Time in s",
            y_label="Temperature in °C",
            from_zero=False,
            curves=tuple(
                curve
                for node in nodes
                for curve in (
                    Curve(
                        label=node.replace("_", " "),
                        x=full.time,
                        y=full.temperatures[node],
                        dashed=nodes_shown.index(node) >= len(PALETTE),
                    ),
                    Curve(
                        label=f"{REDUCED}",
                        x=reduced.time[::20],
                        y=reduced.temperatures[node][::20],
                        kind="points",
                        colour="#444444",
                    ),
                )
            ),
        )
        for title, nodes in shown.items()
    ]
    worst = {
        name: {
            part.name: float(np.max(np.abs(runs[name].temperatures[part.name] - full.temperatures[part.name])))
            for part in study.network.parts
        }
        for name in (REDUCED, PRINTED)
    }
    differences = (
        Plot(
            title="Worst node, difference to F-PL",
            x_label="Time in s",
            y_label="Difference in K",
            y_log=True,
            curves=tuple(
                Curve(
                    label=name,
                    x=full.time[1:],
                    y=np.maximum(_worst_over_time(study, full, runs[name])[1:], 1e-5),
                    colour=colour,
                )
                for name, colour in ((REDUCED, "#0072B2"), (PRINTED, "#D55E00"))
            ),
        ),
    )
    rows = tuple(
        (
            node.replace("_", " "),
            f"{full.temperatures[node].max():.1f}",
            f"{full.temperatures[node][-1]:.1f}",
            *(f"{worst[name][node]:.3f}" for name in (REDUCED, PRINTED)),
        )
        for node in worst[REDUCED]
    )
    return Item(
        key="Fig. 12",
        title="Component temperatures during the drive cycle",
        reading="Lines: full model; points: our networks. Bearings 1 and 2, and 3 and 4, are alike.",
        checks=(
            temperatures_almost_identical(full, worst),
            gears_hotter_when_torque_is_high(study, full),
            gears_tend_to_the_oil_when_torque_drops(study, full),
            input_branch_hotter_than_output_branch(full),
            input_bearings_lose_more(study, full),
            shafts_hotter_than_their_bearings(study, full),
        ),
        tables=(
            Table(
                title="Temperatures in °C, largest differences in K",
                header=("node", "highest", "at 600 s", f"{REDUCED} off by", "as printed off by"),
                rows=rows,
            ),
        ),
        figures=(
            Figure(
                name="fig_12",
                title="Fig. 12: component temperatures during the cycle",
                panels=tuple(panels),
                caption="Start at 20 °C.",
            ),
            Figure(
                name="fig_12_differences",
                title="Fig. 12: networks against the full model",
                panels=differences,
                caption="Largest difference of any node, at each moment.",
            ),
        ),
    )


def temperatures_almost_identical(full: Result, worst: Mapping[str, Mapping[str, float]]) -> Check:
    """Largest difference of any node, also as a share of its rise over the cycle."""
    rise = {node: float(np.ptp(full.temperatures[node])) for node in worst[REDUCED]}
    relative = {name: {n: nodes[n] / rise[n] for n in rise} for name, nodes in worst.items()}
    node = {name: max(shares, key=shares.__getitem__) for name, shares in relative.items()}
    share = {name: worst[name][n] / rise[n] for name, n in node.items()}
    told = "; ".join(
        f"{worst[name][n]:.2f} K of {rise[n]:.0f} K at the {n.replace('_', ' ')}, {share[name]:.1%}, {what}"
        for (name, n), what in zip(node.items(), ("ours", "as printed"), strict=True)
    )
    return judged(
        "temperatures_almost_identical",
        "The results of the two approaches are almost identical for the component temperatures.",
        f"Worst node and moment, related to that node's rise: {told}.",
        max(worst[REDUCED].values()) < ALMOST_K and max(worst[PRINTED].values()) < ALMOST_K,
        numbers={
            "ours_K": max(worst[REDUCED].values()),
            "printed_K": max(worst[PRINTED].values()),
            "ours_of_rise": share[REDUCED],
            "printed_of_rise": share[PRINTED],
        },
        otherwise=f"A node is {ALMOST_K:g} K or more off"
        + (" with the networks as printed; ours stay below." if max(worst[REDUCED].values()) < ALMOST_K else "."),
    )


def gears_hotter_when_torque_is_high(study: Study, full: Result) -> Check:
    """Pinion above oil, in the phase of high torque and in that of constant power."""
    above = full.temperatures[study.gearbox.stage[0].names[0]] - full.temperatures["oil"]
    heavy, light = float(above[_in(full, HEAVY)].mean()), float(above[_in(full, START)].mean())
    end = float(above[_in(full, END)][-1])
    return judged(
        "gears_hotter_when_torque_is_high",
        "The temperature of the gear body is higher when the torque is significant.",
        f"Pinion above oil: {heavy:.1f} K on average at high torque, {light:.1f} K at the light start, {end:.1f} K at"
        " the end.",
        heavy > max(light, end),
        numbers={"heavy_K": heavy, "start_K": light, "end_K": end},
        otherwise="It is not.",
    )


def gears_tend_to_the_oil_when_torque_drops(study: Study, full: Result) -> Check:
    """Gears above oil when the torque drops and at the end."""
    found = {}
    for gear in study.gearbox.stage[0].names:
        above = np.abs(full.temperatures[gear] - full.temperatures["oil"])
        found[gear] = (float(above[_in(full, HEAVY)][-1]), float(above[-1]))
    return judged(
        "gears_tend_to_the_oil_when_torque_drops",
        "When torque levels drop, the gear body tends to assume the temperature of the oil.",
        "Distance to the oil: "
        + "; ".join(f"{gear} from {a:.1f} to {b:.1f} K" for gear, (a, b) in found.items())
        + ".",
        all(b < 0.5 * a for a, b in found.values()),
        numbers={f"{gear}_end_K": b for gear, (_, b) in found.items()},
        otherwise="The distance does not halve within the cycle.",
    )


def input_branch_hotter_than_output_branch(full: Result) -> Check:
    """Pinion, shaft 1 and bearings 1, 2 against wheel, shaft 2 and bearings 3, 4."""
    after = full.time >= WARM
    T = full.temperatures
    pairs = {
        "pinion - wheel": T["pinion"] - T["wheel"],
        "shaft 1 - shaft 2": T["shaft_1"] - T["shaft_2"],
        "bearings 1, 2 - bearings 3, 4": T["bearing_1"] - T["bearing_3"],
    }
    mean = {name: float(values[after].mean()) for name, values in pairs.items()}
    share = {name: float((values[after] > 0.0).mean()) for name, values in pairs.items()}
    return judged(
        "input_branch_hotter_than_output_branch",
        "The input branch (shaft 1, B1-B2, pinion) is hotter than the output branch.",
        f"After {WARM:g} s, on average: "
        + ", ".join(f"{name} {mean[name]:+.1f} K (hotter {share[name]:.0%} of the time)" for name in pairs)
        + ".",
        min(share.values()) >= NEARLY_ALWAYS,
        numbers={**mean, **{f"share, {name}": value for name, value in share.items()}},
        otherwise="Not nearly always: " + ", ".join(name for name in pairs if share[name] < NEARLY_ALWAYS) + ".",
    )


def input_bearings_lose_more(study: Study, full: Result) -> Check:
    """Bearing losses of both shafts, integrated over the cycle."""
    energy = {
        shaft.name: float(
            sum(np.trapezoid(full.losses[b.name], full.time) for b in study.gearbox.bearing if b.shaft == shaft.name)
        )
        for shaft in study.gearbox.shaft
    }
    first, second = energy.values()
    return judged(
        "input_bearings_lose_more",
        "... due to the higher rotational speed, which results in greater bearing losses.",
        f"Bearings of shaft 1: {first / 1e3:.1f} kJ over the cycle; of shaft 2: {second / 1e3:.1f} kJ.",
        first > second,
        numbers={"shaft_1_J": first, "shaft_2_J": second},
        otherwise="They do not lose more.",
    )


def shafts_hotter_than_their_bearings(study: Study, full: Result) -> Check:
    """Each shaft against the bearings on it."""
    after = full.time >= WARM
    T = full.temperatures
    above = {
        f"{bearing.shaft} - {bearing.name}".replace("_", " "): (T[bearing.shaft] - T[bearing.name])[after]
        for bearing in study.gearbox.bearing
    }
    share = {name: float((values > 0.0).mean()) for name, values in above.items()}
    mean = {name: float(values.mean()) for name, values in above.items()}
    return judged(
        "shafts_hotter_than_their_bearings",
        "The temperature of the shafts is greater than that of the corresponding bearings.",
        f"After {WARM:g} s, on average: "
        + ", ".join(f"{name} {mean[name]:+.1f} K (hotter {share[name]:.0%} of the time)" for name in above)
        + ". In the first minutes the bearings' own loss is ahead.",
        min(share.values()) >= NEARLY_ALWAYS,
        numbers={**mean, **{f"share, {name}": value for name, value in share.items()}},
        otherwise="Not nearly always on our reading of the cycle.",
    )


def _grouped(study: Study, run: Result) -> dict[str, Array]:
    losses = run.losses
    return {
        "sliding": losses["mesh_sliding"],
        "rolling": losses["mesh_rolling"],
        "churning": losses["churning"],
        "seals": np.asarray(sum(losses[seal.name] for seal in study.gearbox.seal)),
        "bearings": np.asarray(sum(losses[bearing.name] for bearing in study.gearbox.bearing)),
    }


def _in(run: Result, phase: tuple[float, float]) -> Array:
    return np.asarray((run.time >= phase[0]) & (run.time <= phase[1]))


def _ends(run: Result, values: Array, phase: tuple[float, float]) -> tuple[float, float]:
    inside = values[_in(run, phase)]
    return float(inside[0]), float(inside[-1])


def _difference(runs: Mapping[str, Result], name: str, phase: tuple[float, float]) -> float:
    inside = _in(runs[FULL], phase)
    return float(np.mean(np.abs(runs[name].loss[inside] / runs[FULL].loss[inside] - 1.0)))


def _worst_over_time(study: Study, full: Result, run: Result) -> Array:
    differences = [np.abs(run.temperatures[p.name] - full.temperatures[p.name]) for p in study.network.parts]
    return np.asarray(np.max(differences, axis=0))
