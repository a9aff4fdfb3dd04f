"""The verb ``add``."""

from __future__ import annotations

import math
from pathlib import Path

import click

from builder.base import console
from builder.base.options import example, gearbox_option
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.correction.correction import Correction, read_correction, write_correction
from models.files.toml_file import ENDING


@click.command("add", epilog=example("add known.toml fan_thermostat --set strength=7 --set set_point=55:2"))
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE")
@click.argument("mechanism", metavar="MECHANISM")
@gearbox_option()
@click.option("--place", default=None, metavar="NAME", help="Where it is.  [default: its only place]")
@click.option("--set", "given", multiple=True, metavar="NAME=VALUE[:ERROR]",
              help="A number of it, with its standard error; without one it is exact. Numbers that are not given are "
                   "typical ones.")  # fmt: skip
def add(file: Path, mechanism: str, gearbox: str, place: str | None, given: tuple[str, ...]) -> None:
    """Add physics that your machine is known to have: a fan, a cooler.

    FILE is a correction and is begun if it does not exist; simulate, build-fmu and diagnose take it as --correction.
    MECHANISM is a name of the catalogue.
    """
    with progress(LOADING):
        from builder.workflows.known_physics import known_finding
        from models.mechanisms import Scale

    if file.suffix != ENDING:
        raise InputError(f"{file}: a correction ends in {ENDING}; choose such a name")
    numbers = dict(map(_number, given))
    if len(numbers) < len(given):
        raise click.UsageError("--set gives a number twice; give each once")
    definition = load_gearbox(gearbox)
    known = read_correction(file, definition) if file.exists() else Correction.of(definition)
    finding = known_finding(definition, known.apply(definition.network()), mechanism, numbers, place=place)
    if any(other.label == finding.label for other in known.findings):
        raise InputError(f"{file}: has {mechanism} at {finding.place} already; change its numbers there")
    write_correction(known.model_copy(update={"findings": (*known.findings, finding)}), file)
    rows = []
    for p in finding.parameter:
        local = p.name.removeprefix(f"{finding.label}_")
        error = f"{p.stderr:.4g}" if p.stderr else "exact"
        rows.append([local, "given" if local in numbers else "typical", p.description, f"{p.value:.4g}", error, p.unit])
    console.table(f"{mechanism} at {finding.place}", ["number", "", "", "value", "standard error", "unit"], rows,
                  text_columns=3)  # fmt: skip
    scale = Scale.of(definition)
    console.out.print(f"the reference, which relative values go by: {scale.speed:.4g} 1/min and {scale.torque:.4g} N m "
                      "at the input shaft")  # fmt: skip
    console.out.print(f"wrote {file}; simulate, build-fmu and diagnose take it as --correction")


def _number(text: str) -> tuple[str, tuple[float, float]]:
    name, _, numbers = text.partition("=")
    value, _, error = numbers.partition(":")
    try:
        found = float(value), float(error or 0.0)
    except ValueError:
        raise click.UsageError(f"--set {text}: is not NAME=VALUE or NAME=VALUE:ERROR, with numbers") from None
    if not 0.0 <= found[1] < math.inf:
        raise click.UsageError(f"--set {text}: the standard error is {error}; it is 0 or more")
    return name, found
