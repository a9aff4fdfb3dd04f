"""The page of a proof, in the look of the diagnosis' report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from diagnosis.proof.scoring.protocol import DATA, SENSORS
from diagnosis.proof.scoring.rules import FAR
from diagnosis.proof.scoring.score import NOTHING, OUTCOMES, OUTSIDE, TO_FIND
from diagnosis.report import wording
from diagnosis.report.chart import Chart, Curve, drawn
from diagnosis.results.number_format import NONE, fixed

GROUPS = {
    "control": "nothing to find",
    "single": "one effect",
    "double": "two effects",
    "messy": "one dominant, six minor",
    "outside": "outside the catalogue",
    "sensor": "fault of measurement",
    TO_FIND: "all with something to find",
}
STAGES = {"before": "as delivered", "calibrated": "calibrated", "after": "with the findings"}
WITHOUT_NAME = ("consistent", "insufficient data", "refused", "failed", "not in the catalogue", "parameter")


def page(found: Mapping[str, Any]) -> str:
    """Render the page of a proof as one HTML file.

    Parameters
    ----------
    found : mapping
        See :func:`diagnosis.proof.scoring.outcome.outcome`
    """
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(
        name=wording.name, fixed=fixed, clause=wording.clause, title=title, count=count,
        share=share, limits=limits,
    )  # fmt: skip
    asked = [rule for rule in found["rules"] if rule["met"] is not None]
    return environment.from_string(_text("diagnosis.proof", "proof.html.j2")).render(
        f=found,
        p=found["protocol"],
        style=Markup(_text("diagnosis.report", "report.css")),  # noqa: S704 - our own file
        script=Markup(_text("diagnosis.report", "report.js")),  # noqa: S704 - our own file
        asked=asked,
        met=[rule for rule in asked if rule["met"]],
        to_find=found["held_out_K"][TO_FIND],
        sensors=SENSORS,
        data=DATA,
        outcomes=OUTCOMES,
        groups=GROUPS,
        stages=STAGES,
        reliability=drawn(reliability_chart(found["reliability"]["bins"])),
        errors=drawn(error_chart(found["held_out_pairs"])),
        confusion=confusion_table(found["confusion"]),
    )  # fmt: skip


def _text(package: str, file: str) -> str:
    return (resources.files(package) / file).read_text(encoding="utf-8")


def title(text: str) -> str:
    """A text that begins with a capital letter.

    Examples
    --------
    >>> title("strength within 15 %")
    'Strength within 15 %'
    """
    return text[:1].upper() + text[1:]


def count(found: Mapping[str, Any]) -> str:
    """Hits of cases.

    Examples
    --------
    >>> count({"hits": 57, "of": 60})
    '57/60'
    """
    return f"{found['hits']}/{found['of']}" if found["of"] else NONE


def share(found: Mapping[str, Any]) -> str:
    """Share in per cent; a dash without cases."""
    return f"{100.0 * found['hits'] / found['of']:.0f} %" if found["of"] else NONE


def limits(found: Mapping[str, Any]) -> str:
    """Confidence limits of the share in per cent."""
    return f"{100.0 * found['low']:.0f} to {100.0 * found['high']:.0f} %" if found["of"] else ""


def reliability_chart(bins: Sequence[Mapping[str, Any]]) -> Chart:
    """Share of right claims over the stated probability, with its limits; equal on the diagonal."""
    known = [b for b in bins if b["right"]["of"]]
    stated = np.array([100.0 * b["mean_stated"] for b in known])
    right = np.array([100.0 * b["right"]["hits"] / b["right"]["of"] for b in known])
    low, high = (np.array([100.0 * b["right"][side] for b in known]) for side in ("low", "high"))
    diagonal = np.array([0.0, 100.0])
    curves = [Curve(label="as stated", look="calibrated", x=diagonal, y=diagonal)]
    if known:
        curves += [
            Curve(label="95 % limits", look="after", x=stated, y=high, low=low, kind="band"),
            Curve(label="right", look="after", x=stated, y=right),
            Curve(label="right", look="after", x=stated, y=right, kind="points"),
        ]
    return Chart(
        title="Are 90 % claims right 90 % of the time?", x_label="stated probability in %",
        y_label="of these right in %", curves=tuple(curves), x_range=(-2.0, 102.0), height=300, level=True,
    )  # fmt: skip


def error_chart(pairs: Sequence[Mapping[str, Any]]) -> Chart:
    """Held-out error with the findings over that of calibration alone, case by case."""
    good = [p for p in pairs if p["after"] is not None and math.isfinite(p["after"])]
    most = max((max(p["calibrated"], p["after"]) for p in good), default=1.0)
    looks = {"control": "measured", "single": "after", "double": "law", "messy": "law", "outside": "missing",
             "sensor": "before"}  # fmt: skip
    curves = [Curve(label="no change", look="calibrated", x=np.array([0.0, most]), y=np.array([0.0, most]))]
    for group, look in looks.items():
        x, y = (np.array([p[stage] for p in good if p["group"] == group]) for stage in ("calibrated", "after"))
        if len(x):
            curves.append(Curve(label=GROUPS[group], look=look, x=x, y=y, kind="points"))
    return Chart(
        title="Held-out error, case by case", x_label="calibrated, in K", y_label="with the findings, in K",
        curves=tuple(curves), height=300, level=True,
    )  # fmt: skip


def confusion_table(found: Mapping[str, Mapping[str, int]]) -> dict[str, Any]:
    """Rows (truth), columns (first name given) and cells (count, and True if right)."""
    said = {name for counts in found.values() for name in counts}
    unnamed = [name for name in WITHOUT_NAME if name in said]
    columns = [*unnamed, *sorted(said - set(unnamed))]
    rows = []
    for label in sorted(found, key=lambda label: (not label.startswith((NOTHING, OUTSIDE)), label)):
        cells = [{"n": found[label].get(name, 0), "right": _right(label, name)} for name in columns]
        rows.append({"label": label, "cells": cells, "of": sum(found[label].values())})
    return {"columns": columns, "rows": rows}


def _right(label: str, said: str) -> bool:
    if label.startswith(NOTHING):
        return said == ("parameter" if FAR.replace("_", " ") in label else "consistent")
    bare = label.removesuffix(" (small)")
    if bare != label and said in ("consistent", "insufficient data"):
        return True
    return said == ("not in the catalogue" if bare == OUTSIDE else bare)
