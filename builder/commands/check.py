"""The verb ``check``."""

from __future__ import annotations

from pathlib import Path

import click

from builder.base import console
from builder.base.options import example
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import known_gearboxes, load_gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.definition.known_bearings import known_series
from models.definition.named_oils import known_oils, named_oil
from models.files.output_files import refuse_to_replace
from models.files.toml_file import names_a_file

PICTURES = (".svg", ".png", ".pdf")


def _show_known(context: click.Context, _: click.Parameter, asked: bool) -> None:
    """Show what can be named, and exit."""
    if asked:
        oils = [[name, named_oil(name).name] for name in known_oils()]
        console.table("Oils: [oil] named = ...", ["name", "oil"], oils, text_columns=2)
        bearings = [[*row] for row in known_series()]
        console.table("Bearings: [[bearing]] designation = ...", ["type", "series", "known"], bearings, text_columns=3)
        console.table("Machines: --gearbox, new --like", ["name", "machine"],
                      [[name, load_gearbox(name).name] for name in known_gearboxes()], text_columns=2)  # fmt: skip
        context.exit()


@click.command("check", epilog=example("check fzg --output network.svg"))
@click.argument("gearbox", metavar="NAME|FILE")
@click.option("--output", type=click.Path(path_type=Path), default=None, metavar="FILE",
              help="Drawing of the network: .svg, .png or .pdf.  [default: out/<gearbox>/network.svg]")  # fmt: skip
@click.option("--known", is_flag=True, is_eager=True, expose_value=False, callback=_show_known,
              help="Show the oils, bearings and machines that can be named.")  # fmt: skip
def check(gearbox: str, output: Path | None) -> None:
    """Check a definition, show and draw what was understood.

    Every fault is listed, with place, limit and what to do; without one: nodes, links, inputs, losses at three
    operating points, the oil, values that are only typical, and a drawing of the thermal network. Relations between
    tables are checked once every table is valid.
    """
    picture = Path("out") / Path(gearbox).stem / "network.svg" if output is None else output
    if picture.suffix.lower() not in PICTURES:
        raise InputError(f"{picture}: drawings are written as {', '.join(PICTURES)}")
    refuse_to_replace([Path(gearbox)] if names_a_file(gearbox) else [], [picture])
    definition = load_gearbox(gearbox)
    with progress(LOADING) as told:
        from builder.drive.network_picture import draw_network
        from builder.workflows.understood import conductances, typical_values, understood

        told("calculating losses and conductances")
        tables, network = understood(definition), definition.network()
        with atomic_file(picture) as partial:
            draw_network(partial, network, conductances(definition, network), title=definition.name)
    kind = "without geometry" if definition.is_parametric else "with geometry"
    console.out.print(f"{gearbox} is valid: {definition.name} ({kind})\n")
    for grid in tables:
        console.table(grid.title, grid.header, grid.rows, text_columns=grid.text_columns)
    if typical := typical_values(definition):
        console.out.print("Typical values, filled in by designation or grade; replace them where you know better:")
        for line in typical:
            console.out.print(f"  {line}")
        console.out.print()
    uncertain = len(definition.priors)
    console.out.print(f"{uncertain} of {len(definition.leaves)} values have a standard deviation")
    console.out.print(f"wrote {picture}")
