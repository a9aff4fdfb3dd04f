"""Section 4: the networks as printed and ours, against the full model on separate points."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from builder.reproduce.figure import BLACK, BLUE, RED, Curve, Figure, Plot
from builder.reproduce.printed import TABLE_3, TABLE_4
from builder.reproduce.report import Check, Part, Table, Verdict, item
from builder.reproduce.study import FULL, Study
from builder.surrogate.networks import PRESETS
from builder.surrogate.train import NO_LOSS_W, r_squared
from models.base.types import Array

COLOURS = {"as printed": RED, "ours": BLUE}
GOOD_R2 = 0.99
SMALL_ERROR, LARGE_ERROR = 0.10, 0.25  # of the loss, for 95 % of the points


@item("Table 3", "Hyperparameters of the networks")
def hyperparameters(study: Study) -> Iterator[Part]:
    """The printed set-up, as run, and ours."""
    paper, ours = PRESETS["paper"], study.ours.preset
    widths = ", ".join(f"{kind.replace('_', ' ')} {' x '.join(map(str, w))}" for kind, w in ours.hidden.items())
    layers = str(len(next(iter(paper.hidden.values()))))
    nodes = ", ".join(sorted({str(w) for widths in paper.hidden.values() for w in widths}))
    method = "sigmoid", "Levenberg-Marquardt"
    run = layers, nodes, "all (full batch)", str(paper.max_iter), *method, str(study.printed.preset.samples)
    own = "2", widths, "all (full batch)", f"{ours.max_iter} at most", *method, str(ours.samples)
    rows = [(name, printed, r, o) for (name, printed), r, o in zip(TABLE_3, run, own, strict=True)]
    differing = [name for name, printed, as_run, _ in rows if printed != as_run]
    equal = len(TABLE_3) - len(differing)
    yield (
        "'As printed' starts from 6 random starts and keeps the best on the validation points. Ours uses logarithms"
        " of speed, load and loss, the viscosity in place of the temperature, and points that are denser at low values."
    )
    yield Check(
        "printed_set_up_is_run_as_printed",
        "Table 3 and 400 samples.",
        f"{equal} of {len(TABLE_3)} entries as printed; different: {', '.join(differing)}.",
        not differing,
        {"entries": len(TABLE_3), "as_printed": equal},
        "Levenberg-Marquardt uses all points in every step; a batch size has no counterpart.",
    )
    yield Table("Hyperparameters", ("", "printed", "run as printed", "ours"), rows, texts=True)


@item("Table 4", "Bounds of the design of experiment")
def training_bounds(study: Study) -> Iterator[Part]:
    """Range of speed, torque and temperatures."""
    models = study.printed.losses, study.surrogate
    printed, ours = ((m.speed_bounds, m.torque_bounds, m.temperature_bounds) for m in models)
    same = printed == tuple(TABLE_4.values())
    yield "Ours reach to where a start begins and to the temperatures that Table 6 leads to."
    yield Check(
        "bounds_as_printed",
        "Bounds of 9 inputs.",
        "The run as printed has the printed bounds; ours are wider.",
        same,
        {"equal": same},
        "The preset departs from Table 4.",
    )
    rows = [
        (name, *(f"[{low:g}, {high:g}]" for low, high in bounds))
        for name, *bounds in zip(TABLE_4, TABLE_4.values(), printed, ours, strict=True)
    ]
    yield Table("Bounds", ("input", "printed", "run as printed", "ours"), rows, texts=True)


@item("Fig. 5", "Scheme of the reduced model: three networks", unchecked=Verdict.SCHEME)
def network_scheme(study: Study) -> Iterator[Part]:
    """Inputs, outputs and size of every network."""
    yield "NN_ZP is ours 'mesh', NN_Z0 'no load', NN_B 'bearings', which serves all bearings of one kind."
    rows = [
        (
            network.name.replace("_", " "),
            ", ".join(network.inputs),
            ", ".join(network.outputs),
            " x ".join(str(len(biases)) for biases in network.biases[:2]),
            str(sum(use.network == network.name for use in study.surrogate.uses)),
            f"{study.ours.seconds_by_network[network.name]:.1f}",
        )
        for network in study.ours.losses.networks
    ]
    header = ("network", "inputs", "outputs", "hidden", "used", "trained in s")
    yield Table("Our networks", header, rows, texts=True)


@item("Figs. 6-8", "Calculated against predicted losses")
def predictions(study: Study) -> Iterator[Part]:
    """Losses of both sets of networks over those of the full model, normalised, for every output."""
    calculated = study.network_points[False][FULL]
    scores = {name: r_squared(calculated, study.network_points[False][name]) for name in COLOURS}
    test_points = study.settings.test_points
    yield (
        f"{test_points} random points within Table 4, separate from the training; both sets of networks on the same"
        " points."
    )
    for name, score in scores.items():
        yield Check(
            f"high_r_squared_{name.replace(' ', '_')}",
            f"Excellent correlation for all networks ({name}).",
            f"R² from {score.min():.6f} to {score.max():.6f}.",
            bool(score.min() > GOOD_R2),
            {"worst_r_squared": score.min()},
            f"An output has R² below {GOOD_R2:g}.",
        )
    panels = {}
    for column, component in enumerate(study.full.components):
        y = calculated[:, column]
        curves = [Curve("equal", np.array([0.0, 1.0]), np.array([0.0, 1.0]), colour=BLACK)]
        # Rings below points: neither hides the other.
        for name, kind in (("ours", "rings"), ("as printed", "points")):
            x, predicted = (
                (values - y.min()) / np.ptp(y) for values in (y, study.network_points[False][name][:, column])
            )
            curves.append(Curve(name, x, predicted, kind, COLOURS[name]))  # type: ignore[arg-type]
        title = f"{component.replace('_', ' ')}, R² {' / '.join(f'{score[column]:.5f}' for score in scores.values())}"
        panels[component] = Plot(title, "Calculated, normalised", "Predicted, normalised", curves, square=True)
    caption = (
        f"{test_points} points that no network was trained on; min-max normalised by the calculated losses. R² in the"
        " titles: as printed / ours."
    )
    seals, bearings = ([one.name for one in parts] for parts in (study.gearbox.seal, study.gearbox.bearing))
    for name, title, components in (
        ("fig_06", "Fig. 6: sliding and rolling", ["mesh_sliding", "mesh_rolling"]),
        ("fig_07", "Fig. 7: churning and seals", ["churning", *seals]),
        ("fig_08", "Fig. 8: bearings", bearings),
    ):
        yield Figure(name, f"{title}, normalised", caption, [panels[component] for component in components])
    yield _error_table("Over the bounds of Table 4", study, corner=False)


@item("Cold-start corner", "What R² hides: the cold, slow, light corner")
def cold_start_corner(study: Study) -> Iterator[Part]:
    """Relative errors at the lower limits of all inputs."""
    yield (
        f"{study.settings.test_points} random points in the lowest tenth of speed, torque and every temperature, where"
        " each cold start begins. They hardly change R² over the whole box, since the losses there are small."
    )
    printed, ours = (_errors(study, name, corner=True) for name in COLOURS)
    median, worst = np.median(printed, axis=0).max(), np.quantile(printed, 0.95, axis=0).max()
    yield Check(
        "printed_set_up_is_weak_at_the_lower_limits",
        "Around the lower limit of all parameters the networks agree less well (section 6, start of the cycle).",
        f"As printed, the worst output's median error is {median:.0%} there, and 5 % of the points are off by more than"
        f" {worst:.0%}.",
        bool(worst > LARGE_ERROR),
        {"worst_median": median, "worst_95": worst},
        "The printed set-up is not weak there.",
    )
    worst = np.quantile(ours, 0.95, axis=0).max()
    yield Check(
        "our_networks_are_not_weak_there",
        "Our target: not weak there.",
        f"Ours: 95 % of the points are within {worst:.1%} for the worst output ({study.ours.preset.samples} points per"
        " network).",
        bool(worst < SMALL_ERROR),
        {"worst_95": worst},
        f"More than 5 % of the points of an output are off by over {SMALL_ERROR:.0%}.",
        target=True,
    )
    panels = []
    for title, corner in (("All of Table 4", False), ("Cold, slow, light corner", True)):
        curves = []
        for name, colour in COLOURS.items():
            errors = np.sort(_errors(study, name, corner=corner).ravel())
            share = 100.0 * (np.arange(len(errors)) + 0.5) / len(errors)
            shown = np.unique(np.linspace(0, len(errors) - 1, 200).astype(int))
            curves.append(Curve(name, 100.0 * np.maximum(errors[shown], 1e-6), share[shown], colour=colour))
        panels.append(Plot(title, "Relative error in %", "Share of points with less in %", curves, x_log=True))
    yield Figure("corner_errors", "Relative errors of all outputs", "Cumulative: further left is better.", panels)
    yield _error_table("In the corner", study, corner=True)


def _errors(study: Study, name: str, *, corner: bool) -> Array:
    """Relative errors, shape (points, components)."""
    calculated, predicted = (study.network_points[corner][model] for model in (FULL, name))
    return np.abs(predicted - calculated) / np.maximum(calculated, NO_LOSS_W)


def _error_table(title: str, study: Study, *, corner: bool) -> Table:
    columns: list[list[str]] = [[component.replace("_", " ") for component in study.full.components]]
    for name in COLOURS:
        errors = _errors(study, name, corner=corner)
        points = study.network_points[corner]
        columns.append([f"{value:.6f}" for value in r_squared(points[FULL], points[name])])
        columns.append([f"{value:.2%}" for value in np.median(errors, axis=0)])
        columns.append([f"{value:.2%}" for value in np.quantile(errors, 0.95, axis=0)])
    header = ["loss", *(f"{what}, {name}" for name in COLOURS for what in ("R²", "median error", "95 % below"))]
    return Table(title, header, [*zip(*columns, strict=True)])
