"""Charts of the findings: how probable each name is, when it began, and its heat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from plotly.subplots import make_subplots

from diagnosis.report.chart import DASHES, INK, Chart, curve_points, dressed, row_titles, single, thinned, wrapped
from diagnosis.report.wording import clause, name, short_title, time_scale
from diagnosis.results.first_screen import date_told
from diagnosis.results.number_format import share
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import LEAST_RIVAL, Finding
from models.base.types import Array
from models.quantities.part_colours import AMBIENT, part_colours

GRADES: Mapping[str, tuple[str, str]] = {  # colour and pattern: apart in print as well
    "claim": ("#A34700", ""),
    "likely": ("#C98A00", "/"),
    "not reported": ("#B4BAC2", ""),
    "nothing is missing": ("#4B8B6F", ""),
}
MOST_NAMES = 12
BAR_PX, HEAT_PX, TIMELINE_PX, LEGEND_PX = 30, 230, 34, 34
BINS = 12
FOLLOWS = 0.8  # share of the variance of a heat that a signal must explain to be called what drives it
SHOWN_AGAINST = 2  # findings


# ---------------------------------------------------------------------- names


def names_by_grade(diagnosis: Diagnosis) -> Chart | None:
    """Probability of every name, by grade; of a pair both names are in it."""
    found = _names(diagnosis)
    if not found:
        return None
    labels = [label for label, _, _ in found]
    figure = make_subplots()
    for grade, (colour, pattern) in GRADES.items():
        own = [(label, probability) for label, one, probability in found if one == grade]
        if own:
            figure.add_bar(
                y=[label for label, _ in own], x=[p for _, p in own], orientation="h", name=grade,
                marker={"color": colour, "pattern": {"shape": pattern, "size": 6, "fillmode": "overlay"}},
                text=[share(p) for _, p in own], textposition="outside", cliponaxis=False,
                hovertemplate="%{y}: %{x:.3f}<extra></extra>",
            )  # fmt: skip
    figure.update_xaxes(range=[0.0, 1.12], tickvals=[0.0, 0.5, diagnosis.settings.claim_from, 1.0], title="Probability")
    figure.update_yaxes(categoryorder="array", categoryarray=labels[::-1], ticksuffix=" ")
    figure.add_vline(x=diagnosis.settings.claim_from, line={"color": INK, "width": 1, "dash": "dash"})
    dressed(
        figure, 110 + BAR_PX * len(labels), barmode="overlay", bargap=0.35, margin={"l": 10, "r": 14, "t": 40, "b": 10}
    )
    told = "; ".join(f"{label.replace('<br>', ' ')} {share(p)} ({grade})" for label, grade, p in found)
    return Chart(
        name="names", title="How probable each name is", figure=figure,
        note=f"Dashed: the limit of a claim, {diagnosis.settings.claim_from:g}. A bar counts all explanations that "
             "hold the name, so bars of effects that act together overlap and need not add up to 1. Where "
             "only the nearest name is known, less is stated of all than was calculated.",
        alt=f"Probabilities of names: {told}.",
    )  # fmt: skip


def _names(diagnosis: Diagnosis) -> list[tuple[str, str, float]]:
    """Label, grade and probability of names, most probable first."""
    grades = {name_: finding.grade for finding in diagnosis.findings
              for name_ in (finding.law, *finding.tie_set)}  # fmt: skip
    reported = {finding.law: finding for finding in diagnosis.findings}
    sums: dict[str, float] = {}
    for one in diagnosis.ranking:
        for law in dict.fromkeys(one.laws):
            sums[law] = sums.get(law, 0.0) + one.probability
    # Of a nearest name less is stated than was calculated, and so it is of all names that are not reported then.
    stated = {
        law: f.probability if f.acts_like else max(sums.get(law, 0.0), f.probability) for law, f in reported.items()
    }
    factor = min((f.probability / max(sums.get(law, 0.0), f.probability) for law, f in reported.items() if f.acts_like),
                default=1.0)  # fmt: skip
    sums = {law: factor * p for law, p in sums.items()} | stated
    # Names that explain the data only together with a finding.
    companions = {rival.law for one in diagnosis.findings for rival in one.confusable_with if not rival.instead}
    idle = set() if diagnosis.further_helps else companions
    rows = [(_label(law), grades.get(law, "not reported"), p) for law, p in sums.items()
            if p >= LEAST_RIVAL and law not in idle]  # fmt: skip
    nothing = diagnosis.kinds.get("nothing", 0.0)
    if nothing >= LEAST_RIVAL:
        rows.append(("nothing", "nothing is missing", nothing))
    return sorted(rows, key=lambda row: -row[2])[:MOST_NAMES]


def _label(mechanism: str) -> str:
    """A name on at most two lines."""
    words = name(mechanism).split(" ")
    half = (len(words) + 1) // 2
    return " ".join(words) if len(words) < 3 else f"{' '.join(words[:half])}<br>{' '.join(words[half:])}"


# ---------------------------------------------------------------------- dates


def dates_with_bands(diagnosis: Diagnosis) -> Chart | None:
    """Recordings on their common clock, and when each dated finding began."""
    dated = [(finding, finding.date) for finding in diagnosis.findings if finding.date is not None]
    if not dated:
        return None
    spans = _spans(diagnosis)
    end = max(b for _, b, _ in spans.values())
    scale, symbol = time_scale(end)
    figure = make_subplots()
    for held_out, label, colour in ((False, "learned from", "#8FA3B8"), (True, "held out", "#CBD3DB")):
        own = {key: (a / scale, b / scale) for key, (a, b, held) in spans.items() if held == held_out}
        figure.add_bar(
            y=list(own), base=[a for a, _ in own.values()], x=[b - a for a, b in own.values()], orientation="h",
            name=label, marker={"color": colour}, hovertemplate="%{y}<extra></extra>",
        )  # fmt: skip
    colours = part_colours(diagnosis.network.node_names)
    for index, (finding, date) in enumerate(dated):
        colour = colours.get(finding.node, INK)
        start = diagnosis.starts_at.get(date.recording, 0.0)
        moment = (start + date.from_s) / scale
        if date.band_s is not None:
            early, late = ((start + at) / scale for at in date.band_s)
            figure.add_vrect(x0=early, x1=late, fillcolor=colour, opacity=0.3, line_width=0)
        figure.add_scatter(
            x=[moment, moment], y=[next(iter(spans)), list(spans)[-1]], mode="lines",
            line={"color": colour, "width": 2.5, "dash": DASHES[index % len(DASHES)]},
            name=wrapped(f"begin of {short_title(finding)}"), hovertemplate=f"{date_told(date)}<extra></extra>",
        )  # fmt: skip
        if date.to_s is not None:
            figure.add_vline(x=(start + date.to_s) / scale, line={"color": colour, "width": 1.5, "dash": "dot"})
    figure.update_yaxes(categoryorder="array", categoryarray=list(spans)[::-1], ticksuffix=" ")
    figure.update_xaxes(title=f"Time since the first row in {symbol}")
    dressed(figure, 130 + TIMELINE_PX * len(spans) + LEGEND_PX * len(dated), bargap=0.4, barmode="overlay",
            margin={"l": 10, "r": 14, "t": 50 + LEGEND_PX * len(dated), "b": 10})  # fmt: skip
    return Chart(
        name="dates", title="When it began", figure=figure,
        note="Line: the most probable moment. Shaded: where it lies with 95 %. Dotted: the end.",
        alt="; ".join(f"{short_title(finding)} {clause(date_told(date))}" for finding, date in dated) + ".",
    )  # fmt: skip


def _spans(diagnosis: Diagnosis) -> dict[str, tuple[float, float, bool]]:
    """Begin and end of every recording but baselines, [s] on their clock, and True if it is held out as a whole."""
    spans: dict[str, tuple[float, float, bool]] = {}
    for course in diagnosis.courses:
        if course.recording in diagnosis.starts_at:
            start = diagnosis.starts_at[course.recording]
            a, b, held = spans.get(course.recording, (np.inf, -np.inf, True))
            spans[course.recording] = (
                min(a, start + float(course.time[0])), max(b, start + float(course.time[-1])), held and course.held_out,
            )  # fmt: skip
    return dict(sorted(spans.items(), key=lambda item: item[1][0]))


# ---------------------------------------------------------------------- heat


def heat_of_findings(diagnosis: Diagnosis) -> Chart | None:
    """Heat of every finding over time, one recording after another, and over the signal that it follows most."""
    warm = [finding for finding in diagnosis.findings if finding.heat]
    if not warm:
        return None
    drivers = [
        (finding, *found) for finding in warm[:SHOWN_AGAINST] for found in [driver_of(diagnosis, finding)] if found
    ]
    rows = 1 + len(drivers)
    figure = make_subplots(rows=rows, cols=1, vertical_spacing=0.26 / max(rows - 1, 1) if rows > 1 else 0.0)
    colours = part_colours(diagnosis.network.node_names)
    offsets, total = _one_after_another(warm)
    scale, symbol = time_scale(total)
    for index, finding in enumerate(warm):
        line = {"color": colours.get(finding.node, INK), "width": 2.0, "dash": DASHES[index % len(DASHES)]}
        for number, (recording, (time, heat)) in enumerate(finding.heat.items()):
            x, y = curve_points((time + offsets[recording]) / scale, heat)
            figure.add_scatter(x=x, y=y, mode="lines", line=line, name=wrapped(short_title(finding)),
                               legendgroup=str(index), showlegend=number == 0,
                               hovertemplate=f"{recording}: %{{y:.4g}} W<extra></extra>", row=1, col=1)  # fmt: skip
    for offset in list(offsets.values())[1:]:
        figure.add_vline(x=offset / scale, line={"color": AMBIENT, "width": 1, "dash": "dot"}, row=1, col=1)
    figure.update_xaxes(title=f"Time in {symbol}, one recording after another", row=1, col=1)
    titles = ["<b>Heat over time</b>, W"]
    for row, (finding, label, x, heat) in enumerate(drivers, 2):
        order = np.argsort(x)
        few_x, few_y = thinned(x[order], heat[order])
        figure.add_scatter(x=single(few_x), y=single(few_y), mode="markers", showlegend=False,
                           marker={"color": colours.get(finding.node, INK), "size": 4, "opacity": 0.6},
                           hovertemplate="%{x:.4g}: %{y:.4g} W<extra></extra>", row=row, col=1)  # fmt: skip
        figure.update_xaxes(title=label, row=row, col=1)
        whose = f" ({name(finding.mechanism)})" if len(drivers) > 1 else ""
        titles.append(f"<b>Against the signal it follows most</b>, W{whose}")
    figure.update_yaxes(rangemode="tozero")
    height = 80 + rows * (HEAT_PX + 40) + LEGEND_PX * len(warm)
    dressed(figure, height, annotations=row_titles(titles), hovermode="closest",
            margin={"l": 10, "r": 14, "t": 50 + LEGEND_PX * len(warm), "b": 10})  # fmt: skip
    figure.update_layout(legend_y=1.0 + 24.0 / (rows * HEAT_PX))
    means = "; ".join(f"{short_title(f)}: {f.heat_mean_W:.3g} W on average, {f.heat_max_W:.3g} W at most" for f in warm)
    follows = "".join(f"; {name(f.mechanism)} follows {label} most" for f, label, _, _ in drivers)
    return Chart(
        name="heat", title="Heat of the findings", figure=figure,
        note="In the recordings learned from, by the law as fitted. Positive: the part gets warmer.",
        alt=f"Heat over time of {means}{follows}.",
    )  # fmt: skip


def driver_of(diagnosis: Diagnosis, finding: Finding) -> tuple[str, Array, Array] | None:
    """The signal that explains most of a heat's variance, with its unit, its values and the heat; None if none does.

    Signals are the inputs, the temperature of the part, and its difference to the ambient temperature.
    """
    if finding.date is not None:
        return None  # time decides
    heats, signals = [], []
    for recording, (time, heat) in finding.heat.items():
        runs = [c for c in diagnosis.courses if c.recording == recording and not c.held_out]
        if runs:
            heats.append(heat)
            signals.append(_signals_at(diagnosis, finding, runs, time))
    if not heats:
        return None
    heat, best = np.concatenate(heats), (FOLLOWS, "")
    joined = {label: np.concatenate([one[label] for one in signals]) for label in signals[0]}
    for label, values in joined.items():
        known = explained(values, heat)
        best = max(best, (known, label), key=lambda one: one[0])
    return (best[1], joined[best[1]], heat) if best[1] else None


def explained(x: Array, y: Array) -> float:
    """Share of the variance of `y` that its means over ranges of `x` explain (correlation ratio).

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 600)
    >>> explained(x, x**2) > 0.95, explained(x, np.tile([0.0, 1.0], 300)) < 0.1
    (True, True)
    """
    total = float(np.var(y))
    if not total > 0.0 or not float(np.ptp(x)) > 0.0:
        return 0.0
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    group = np.searchsorted(edges, x)
    within = sum(float(np.var(y[group == i])) * float(np.mean(group == i)) for i in np.unique(group))
    return 1.0 - within / total


def _signals_at(diagnosis: Diagnosis, finding: Finding, runs: Sequence[PredictedRun], time: Array) -> dict[str, Array]:
    """Signals at the times of a heat, by their labels with units."""
    clock = np.concatenate([run.time for run in runs])

    def at(values: Sequence[Array]) -> Array:
        return np.asarray(np.interp(time, clock, np.concatenate(values)))

    known = diagnosis.network.inputs
    found = {known[key].quantity.label: at([run.inputs[key] for run in runs]) for key in runs[0].inputs if key in known}
    node = finding.node
    if all(node in run.after for run in runs):
        temperature = at([run.after[node] for run in runs])
        found[f"Temperature of {name(node)} in °C"] = temperature
        if all("T_ambient" in run.inputs for run in runs):
            ambient = at([run.inputs["T_ambient"] for run in runs])
            found[f"{name(node).capitalize()} less ambient in K"] = temperature - ambient
    return found


def _one_after_another(findings: Sequence[Finding]) -> tuple[dict[str, float], float]:
    """Where every recording begins if they follow each other, and where the last one ends, [s]."""
    ends: dict[str, float] = {}
    for finding in findings:
        for recording, (time, _) in finding.heat.items():
            ends[recording] = max(ends.get(recording, 0.0), float(time[-1]))
    offsets, total = {}, 0.0
    for recording, end in ends.items():
        offsets[recording] = total
        total += end
    return offsets, total
