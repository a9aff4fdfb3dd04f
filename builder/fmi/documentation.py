"""Documentation inside an FMU: ``documentation/``, its licences, the reference run and an icon."""

from __future__ import annotations

import io
import math
from html import escape
from importlib.resources import files
from string import Template
from typing import Literal

from PIL import Image, ImageDraw

from builder.fmi.model_description import FmuIdentity
from builder.fmi.reference import STEP_S, ReferenceRun, csv
from builder.fmi.signals import SignalTable, nomenclature
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.version import DISTRIBUTION, license_text

ICON_PX, OVERSAMPLED, ICON_COLOURS = 128, 4, 64

TEMPLATE, VALIDITY, OUTSIDE = "documentation.html", "validity.html", "outside.html"
Kind = Literal["python", "native"]


def documentation(
    gearbox: Gearbox,
    table: SignalTable,
    identity: FmuIdentity,
    training: TrainingResult | None,
    reference: ReferenceRun,
    *,
    kind: Kind,
) -> dict[str, bytes]:
    """All files for people, by their path in an FMU of a kind."""
    page = _index(gearbox, table, identity, training, kind).encode()
    inside = {"documentation/licenses/pythonfmu.txt": license_text("pythonfmu").encode()} if kind == "python" else {}
    return {
        **inside,
        "documentation/index.html": page,
        "documentation/reference_in.csv": csv(reference.inputs),
        "documentation/reference_out.csv": csv(reference.outputs),
        "documentation/licenses/license.txt": license_text().encode(),
        f"documentation/licenses/{DISTRIBUTION}.txt": license_text().encode(),
        "model.png": icon(),
    }


def _index(
    gearbox: Gearbox, table: SignalTable, identity: FmuIdentity, training: TrainingResult | None, kind: Kind
) -> str:
    networks = "" if training is None else (
        f", networks: preset {training.preset.name}, {training.preset.samples} samples each, seed {training.seed}"
    )  # fmt: skip
    provenance = f"Definition {gearbox.hash[:16]}{networks}. Made by {identity.generation_tool}."
    template, of_kind = (_text(name) for name in (TEMPLATE, f"{kind}.html"))
    stepping, needs = of_kind.split("<!-- needs -->\n")
    return Template(template).substitute(
        stepping=stepping.rstrip(),
        needs=needs.rstrip(),
        title=escape(identity.model_name),
        description=escape(identity.description),
        provenance=escape(provenance),
        validity="" if training is None else _validity(training),
        outside="" if training is None else _text(OUTSIDE).rstrip(),
        step=f"{STEP_S:g}",
        variables=_table(nomenclature(table)),
    )


def _text(name: str) -> str:
    return (files("fmu_src") / name).read_text(encoding="utf-8")


def _validity(training: TrainingResult) -> str:
    """The range of training and the errors of the networks in it."""
    losses = training.losses
    bounds = {
        "speed of the input shaft": (losses.speed_bounds, "1/min"),
        "torque at the input shaft": (losses.torque_bounds, "N m"),
        "temperatures": (losses.temperature_bounds, "degC"),
    }
    validity: list[tuple[str, ...]] = [("quantity", "from", "to", "unit")]
    validity += [(name, f"{low:g}", f"{high:g}", unit) for name, ((low, high), unit) in bounds.items()]
    errors: list[tuple[str, ...]] = [("loss", "R2", "median error", "95 % of errors below")]
    errors += [
        (row.component, f"{row.r_squared:.6f}", f"{row.median:.2%}", f"{row.percentile_95:.2%}")
        for row in training.report
    ]
    return Template(_text(VALIDITY)).substitute(validity=_table(validity), errors=_table(errors)).rstrip()


def _table(rows: list[tuple[str, ...]]) -> str:
    def line(row: tuple[str, ...], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in row) + "</tr>"

    return "<table>\n" + "\n".join([line(rows[0], "th"), *(line(row, "td") for row in rows[1:])]) + "\n</table>"


def icon() -> bytes:
    """Two gears in mesh, the warmer the redder, as PNG."""
    size = ICON_PX * OVERSAMPLED
    image = Image.new("RGBA", (size, size), (255, 255, 255, 0))
    draw = ImageDraw.Draw(image)
    _gear(draw, centre=(0.30 * size, 0.36 * size), radius=0.20 * size, teeth=12, turn=0.0, colour=(200, 70, 40, 255))
    _gear(draw, centre=(0.66 * size, 0.62 * size), radius=0.27 * size, teeth=18, turn=0.1, colour=(70, 100, 140, 255))
    buffer = io.BytesIO()
    small = image.resize((ICON_PX, ICON_PX), Image.Resampling.LANCZOS)
    small.quantize(ICON_COLOURS, method=Image.Quantize.FASTOCTREE).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _gear(
    draw: ImageDraw.ImageDraw,
    *,
    centre: tuple[float, float],
    radius: float,
    teeth: int,
    turn: float,
    colour: tuple[int, int, int, int],
) -> None:
    x, y = centre
    pitch = 2.0 * math.pi / teeth
    outline = []
    for tooth in range(teeth):
        for share, height in ((-0.30, 0.90), (-0.15, 1.10), (0.15, 1.10), (0.30, 0.90)):
            angle = (tooth + share) * pitch + turn
            outline.append((x + radius * height * math.cos(angle), y + radius * height * math.sin(angle)))
    draw.polygon(outline, fill=colour)
    bore = 0.35 * radius
    draw.ellipse((x - bore, y - bore, x + bore, y + bore), fill=(255, 255, 255, 0))
