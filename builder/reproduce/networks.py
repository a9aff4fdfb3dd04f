"""Section 4: the networks as printed and ours, against the full model on separate points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from builder.doe import random_points
from builder.networks import PRESETS
from builder.reproduce.figure import BLACK, Curve, Figure, Plot
from builder.reproduce.item import Check, Item, Table, Verdict, judged, target
from builder.reproduce.study import Study
from builder.train import NO_LOSS_W, TrainingResult, r_squared
from models.network import Losses
from models.surrogate import SurrogateLosses
from models.types import Array

CORNER = 0.1  # lowest tenth of every input's range: where cold starts begin
PRINTED, OURS = "as printed", "ours"
COLOUR = {PRINTED: "#D55E00", OURS: "#0072B2"}
GOOD_R2 = 0.99
SMALL_ERROR, LARGE_ERROR = 0.10, 0.25  # of the loss, for 95 % of the points
# Table 3 of the paper.
TABLE_3 = (
    ("Hidden layers", "2"),
    ("Nodes per layer", "5"),
    ("Batch size", "64"),
    ("Epochs", "1000"),
    ("Activation", "sigmoid"),
    ("Training", "Levenberg-Marquardt"),
    ("Samples per network", "400"),
)
TABLE_4 = {"n in 1/min": (50.0, 6500.0), "T in N m": (1.0, 350.0), "all temperatures in °C": (20.0, 120.0)}


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """Networks on the separate points, over the paper's range and in its cold, slow, light corner.

    Attributes
    ----------
    calculated, predicted, corner_calculated, corner_predicted : Array, shape (points, components)
        [W]
    """

    calculated: Array
    predicted: Array
    corner_calculated: Array
    corner_predicted: Array

    @property
    def r_squared(self) -> Array:
        """Eq. (11) per component."""
        return r_squared(self.calculated, self.predicted)

    def errors(self, *, corner: bool) -> Array:
        """Relative errors, shape (points, components)."""
        y, y_hat = (self.corner_calculated, self.corner_predicted) if corner else (self.calculated, self.predicted)
        return np.abs(y_hat - y) / np.maximum(y, NO_LOSS_W)


def judge_networks(study: Study) -> dict[str, Judgement]:
    """Judge both sets of networks on the same points: the paper's box, another seed than training."""
    bounds = [*TABLE_4.values()]
    low, high = (
        np.array([bounds[0][i], bounds[1][i], *[bounds[2][i]] * len(study.full.temperature_nodes)]) for i in (0, 1)
    )
    box = random_points(study.settings.judged, low, high, seed=study.settings.seed + 100)
    corner = random_points(study.settings.judged, low, low + CORNER * (high - low), seed=study.settings.seed + 101)

    def power(losses: Losses, x: Array) -> Array:
        return losses.power(x[:, 0], x[:, 1], x[:, 2:])

    return {
        name: Judgement(
            calculated=power(study.full, box),
            predicted=power(trained.losses, box),
            corner_calculated=power(study.full, corner),
            corner_predicted=power(trained.losses, corner),
        )
        for name, trained in ((PRINTED, study.printed), (OURS, study.ours))
    }


def predictors(study: Study) -> list[Item]:
    """Tables 3 and 4, figs. 5 to 8, and the corner that R^2 hides."""
    judgements = judge_networks(study)
    return [
        hyperparameters(study),
        bounds(study),
        layout(study),
        predictions(study, judgements),
        corner(study, judgements),
    ]


def hyperparameters(study: Study) -> Item:
    """Table 3."""
    paper, ours = PRESETS["paper"], study.ours.preset
    widths = ", ".join(f"{kind.replace('_', ' ')} {' x '.join(map(str, w))}" for kind, w in ours.hidden.items())
    run = (
        str(len(next(iter(paper.hidden.values())))),
        ", ".join(sorted({str(w) for widths in paper.hidden.values() for w in widths})),
        "all (full batch)",
        str(paper.max_iter),
        "sigmoid",
        "Levenberg-Marquardt",
        str(study.printed.preset.samples),
    )
    own = (
        "2",
        widths,
        "all (full batch)",
        f"{ours.max_iter} at most",
        "sigmoid",
        "Levenberg-Marquardt",
        str(ours.samples),
    )
    differing = [what for (what, printed), value in zip(TABLE_3, run, strict=True) if printed != value]
    check = judged(
        "printed_set_up_is_run_as_printed",
        "Table 3 and 400 samples.",
        f"{len(TABLE_3) - len(differing)} of {len(TABLE_3)} entries as printed; different: {', '.join(differing)}.",
        not differing,
        numbers={"entries": len(TABLE_3), "as_printed": len(TABLE_3) - len(differing)},
        otherwise="Levenberg-Marquardt uses all points in every step; a batch size has no counterpart.",
    )
    return Item(
        key="Table 3",
        title="Hyperparameters of the networks",
        reading=(
            "'As printed' starts from 6 random starts and keeps the best on the validation points. Ours sees logarithms"
            " of speed, load and loss, the viscosity in place of the temperature, and points that are denser at low"
            " values."
        ),
        checks=(check,),
        tables=(
            Table(
                title="Hyperparameters",
                texts=True,
                header=("", "printed", "run as printed", "ours"),
                rows=tuple((what, p, r, o) for (what, p), r, o in zip(TABLE_3, run, own, strict=True)),
            ),
        ),
    )


def bounds(study: Study) -> Item:
    """Table 4."""

    def of(losses: SurrogateLosses) -> tuple[tuple[float, float], ...]:
        return losses.speed_bounds, losses.torque_bounds, losses.temperature_bounds

    printed, ours = of(study.printed.losses), of(study.surrogate)
    same = printed == tuple(TABLE_4.values())
    rows = tuple(
        (name, *(f"[{low:g}, {high:g}]" for low, high in (paper, run, own)))
        for (name, paper), run, own in zip(TABLE_4.items(), printed, ours, strict=True)
    )
    return Item(
        key="Table 4",
        title="Bounds of the design of experiment",
        reading="Ours reach to where a start begins and to the temperatures that Table 6 leads to.",
        checks=(
            judged(
                "bounds_as_printed",
                "Bounds of 9 inputs.",
                "The run as printed has the printed bounds; ours are wider.",
                same,
                numbers={"equal": float(same)},
                otherwise="The preset departs from Table 4.",
            ),
        ),
        tables=(Table(title="Bounds", texts=True, header=("input", "printed", "run as printed", "ours"), rows=rows),),
    )


def layout(study: Study) -> Item:
    """Fig. 5: which networks there are."""
    rows = tuple(
        (
            one.network.name.replace("_", " "),
            ", ".join(one.network.inputs),
            ", ".join(one.network.outputs),
            " x ".join(str(len(b)) for b in one.network.biases[:2]),
            str(sum(use.network == one.network.name for use in study.surrogate.uses)),
            f"{one.seconds:.1f}",
        )
        for one in study.ours.networks
    )
    return Item(
        key="Fig. 5",
        title="Scheme of the reduced model: three networks",
        reading="NN_ZP is ours 'mesh', NN_Z0 'no load', NN_B 'bearings', which serves all bearings of one kind.",
        tables=(
            Table(
                title="Our networks",
                header=("network", "inputs", "outputs", "hidden", "used", "trained in s"),
                rows=rows,
                texts=True,
            ),
        ),
        without_checks=Verdict.SCHEME,
    )


def predictions(study: Study, judgements: Mapping[str, Judgement]) -> Item:
    """Figs. 6 to 8: calculated against predicted, normalised, for every output."""
    groups: dict[str, list[int]] = {"fig_06": [], "fig_07": [], "fig_08": []}
    for i, name in enumerate(study.full.components):
        seals = {seal.name for seal in study.gearbox.seal}
        groups[
            "fig_06" if name.startswith("mesh") else "fig_07" if name == "churning" or name in seals else "fig_08"
        ].append(i)
    titles = {
        "fig_06": "Fig. 6: sliding and rolling",
        "fig_07": "Fig. 7: churning and seals",
        "fig_08": "Fig. 8: bearings",
    }
    figures = tuple(
        Figure(
            name=name,
            title=f"{titles[name]}, normalised",
            panels=tuple(_scatter(study, judgements, i) for i in columns),
            caption=(
                f"{study.settings.judged} points that no network was trained on; min-max normalised by the "
                "calculated losses. R² in the titles: as printed / ours."
            ),
        )
        for name, columns in groups.items()
    )
    return Item(
        key="Figs. 6-8",
        title="Calculated against predicted losses",
        reading=(
            f"{study.settings.judged} random points within Table 4, separate from the training; both sets of networks"
            " on the same points."
        ),
        checks=(*(high_r_squared(name, judgement) for name, judgement in judgements.items()),),
        tables=(_errors_table("Over the bounds of Table 4", study, judgements, corner=False),),
        figures=figures,
    )


def high_r_squared(name: str, judgement: Judgement) -> Check:
    """R^2 of every output."""
    worst = float(judgement.r_squared.min())
    return judged(
        f"high_r_squared_{name.replace(' ', '_')}",
        f"Excellent correlation for all networks ({name}).",
        f"R² from {worst:.6f} to {judgement.r_squared.max():.6f}.",
        worst > GOOD_R2,
        numbers={"worst_r_squared": worst},
        otherwise=f"An output has R² below {GOOD_R2:g}.",
    )


def corner(study: Study, judgements: Mapping[str, Judgement]) -> Item:
    """Errors in the cold, slow, light corner."""
    panels = []
    for title, in_corner in (("All of Table 4", False), ("Cold, slow, light corner", True)):
        curves = []
        for name, judgement in judgements.items():
            errors = np.sort(judgement.errors(corner=in_corner).ravel())
            share = 100.0 * (np.arange(len(errors)) + 0.5) / len(errors)
            shown = np.unique(np.linspace(0, len(errors) - 1, 200).astype(int))
            curves.append(
                Curve(label=name, x=100.0 * np.maximum(errors[shown], 1e-6), y=share[shown], colour=COLOUR[name])
            )
        panels.append(
            Plot(
                title=title,
                x_label="Relative error in %",
                y_label="Share of points with less in %",
                x_log=True,
                curves=tuple(curves),
            )
        )
    return Item(
        key="Cold-start corner",
        title="What R² hides: the cold, slow, light corner",
        reading=(
            f"{study.settings.judged} random points in the lowest tenth of speed, torque and every temperature, where"
            " each cold start begins. R² over the whole box hardly sees them, since the losses there are small."
        ),
        checks=(weak_at_the_lower_limits(judgements[PRINTED]), ours_is_not_weak(study.ours, judgements[OURS])),
        tables=(_errors_table("In the corner", study, judgements, corner=True),),
        figures=(
            Figure(
                name="corner_errors",
                title="Relative errors of all outputs",
                panels=tuple(panels),
                caption="Cumulative: further left is better.",
            ),
        ),
    )


def weak_at_the_lower_limits(judgement: Judgement) -> Check:
    """95 % quantile of the worst output, printed set-up."""
    quantile = np.quantile(judgement.errors(corner=True), 0.95, axis=0)
    median = np.median(judgement.errors(corner=True), axis=0)
    return judged(
        "printed_set_up_is_weak_at_the_lower_limits",
        "Around the lower limit of all parameters the networks agree less well (section 6, start of the cycle).",
        f"As printed, the worst output's median error is {median.max():.0%} there, and 5 % of the points are off by"
        f" more than {quantile.max():.0%}.",
        float(quantile.max()) > LARGE_ERROR,
        numbers={"worst_median": median.max(), "worst_95": quantile.max()},
        otherwise="The printed set-up is not weak there.",
    )


def ours_is_not_weak(trained: TrainingResult, judgement: Judgement) -> Check:
    """95 % quantile of the worst output, our networks."""
    quantile = np.quantile(judgement.errors(corner=True), 0.95, axis=0)
    return target(
        "our_networks_are_not_weak_there",
        "Our target: not weak there.",
        f"Ours: 95 % of the points are within {quantile.max():.1%} for the worst output ({trained.preset.samples}"
        " points per network).",
        float(quantile.max()) < SMALL_ERROR,
        numbers={"worst_95": quantile.max()},
        otherwise=f"More than 5 % of the points of an output are off by over {SMALL_ERROR:.0%}.",
    )


def _scatter(study: Study, judgements: Mapping[str, Judgement], column: int) -> Plot:
    calculated = judgements[OURS].calculated[:, column]
    low, width = calculated.min(), np.ptp(calculated)
    curves = [Curve(label="equal", x=np.array([0.0, 1.0]), y=np.array([0.0, 1.0]), colour=BLACK)]
    # Rings below points: neither hides the other.
    for name, judgement in reversed([*judgements.items()]):
        x, y = ((values[:, column] - low) / width for values in (judgement.calculated, judgement.predicted))
        curves.append(Curve(label=name, x=x, y=y, kind="rings" if name == OURS else "points", colour=COLOUR[name]))
    score = " / ".join(f"{judgement.r_squared[column]:.5f}" for judgement in judgements.values())
    component = study.full.components[column].replace("_", " ")
    return Plot(
        title=f"{component}, R² {score}",
        x_label="Calculated, normalised",
        y_label="Predicted, normalised",
        curves=tuple(curves),
        square=True,
    )


def _errors_table(title: str, study: Study, judgements: Mapping[str, Judgement], *, corner: bool) -> Table:
    rows = []
    for i, component in enumerate(study.full.components):
        row = [component.replace("_", " ")]
        for judgement in judgements.values():
            errors = judgement.errors(corner=corner)[:, i]
            r2 = (
                r_squared(judgement.corner_calculated, judgement.corner_predicted) if corner else judgement.r_squared
            )[i]
            row += [f"{r2:.6f}", f"{np.median(errors):.2%}", f"{np.quantile(errors, 0.95):.2%}"]
        rows.append(tuple(row))
    header = ("loss", *(f"{what}, {name}" for name in judgements for what in ("R²", "median error", "95 % below")))
    return Table(title=title, header=header, rows=tuple(rows))
