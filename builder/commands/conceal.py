"""The verb ``conceal``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import click

from builder.base import console
from builder.base.example import example
from builder.base.progress import LOADING, progress
from builder.commands.conceal_in_zoo import conceal_in_zoo
from builder.commands.conceal_into import conceal_into
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError


def _list_effects(context: click.Context, _: click.Parameter, asked: bool) -> None:
    """List the effects that can be concealed, and exit."""
    if asked:
        if context.params.get("plant") == "zoo":
            from diagnosis.proof.zoo.draw import list_effects

            console.table(
                "Effects of the zoo", ["name", "in the catalogue", "what it is"], list_effects(), text_columns=3
            )
            context.exit()
        from diagnosis.proof.cases.conceal import EFFECTS
        from diagnosis.proof.injection.inject import DESCRIPTIONS

        rows = [[name, "yes" if effect.catalogue else "no", effect.law] for name, effect in sorted(EFFECTS.items())]
        console.table("Effects that can be concealed", ["name", "in the catalogue", "law"], rows, text_columns=3)
        injected = [list(item) for item in DESCRIPTIONS.items()]
        console.table("Effects that can be injected (--into)", ["name", "what it is"], injected, text_columns=2)
        context.exit()


@click.command("conceal", epilog=example("conceal --effect windage --seed 1 --output out/concealed"))
@click.option("--plant", type=click.Choice(["own", "zoo"]), default="own", show_default=True, is_eager=True,
              help="own: finer, with other formulas, of any gearbox; zoo: of random structure.")  # fmt: skip
@click.option("--effect", default=None, metavar="NAME", help="Effect to conceal; --list shows the names.")
@click.option(
    "--list", is_flag=True, is_eager=True, expose_value=False, callback=_list_effects, help="Show the effects."
)
@click.option("--random", "random", is_flag=True, help="Draw the effects to conceal; there may be none.")
@click.option("--strength", type=click.FloatRange(min=0.01, max=10.0), default=None, metavar="X",
              help="Strength relative to the usual one.  [default: drawn from 0.25 to 2]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0, max=2**32 - 1), required=True, metavar="N",
              help="The same seed gives the same bytes.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), required=True, metavar="DIR",
              help="Folder 'recordings' in it gets the recordings, with --cases one folder per case.")  # fmt: skip
@click.option("--truth", type=click.Path(path_type=Path, file_okay=False), default=None, metavar="DIR",
              help="Folder for the truth.  [default: 'truth' in --output]")  # fmt: skip
@click.option("--cases", type=click.IntRange(min=1, max=10_000), default=None, metavar="N", help="How many cases.")
@click.option("--gearbox", default="fzg", show_default=True, metavar="NAME|FILE",
              help="Name or definition file (TOML), of the own plant.")  # fmt: skip
@click.option("--machine", default=None, metavar="NAME|FILE",
              help="Zoo: name or definition file (TOML).  [default: drawn]")  # fmt: skip
@click.option(
    "--families", default=None, metavar="NAME,...", help="Zoo: families of plants to draw from.  [default: all]"
)
@click.option("--group", default=None, metavar="NAME",
              help="Zoo: control, single, date, sensor, pair, outside or messy.  [default: drawn]")  # fmt: skip
@click.option("--baselines", type=click.IntRange(min=0, max=20), default=0, show_default=True, metavar="N",
              help="Zoo: healthy recordings of the same plant as well.")  # fmt: skip
@click.option("--session-deviation", type=click.FloatRange(min=0.0, max=0.2), default=None, metavar="X",
              help="Zoo: relative deviation of the plant's parameters between sessions.  [default: 0, 0.01 or 0.03]"
              )  # fmt: skip
@click.option("--into", default=None, metavar="FILE[@FROM..TO]", help="Recording of a real machine to inject into.")
@click.option("--place", default=None, metavar="NAME", help="With --into: link, loss, node, sensor or input.")
@click.option("--date", default=None, metavar="MOMENT", help="With --into: date or seconds at which it begins.")
@click.option("--control", is_flag=True, help="With --into: inject nothing.")
def conceal(
    plant: str,
    effect: str | None,
    random: bool,
    strength: float | None,
    seed: int,
    output: Path,
    truth: Path | None,
    cases: int | None,
    gearbox: str,
    machine: str | None,
    families: str | None,
    group: str | None,
    baselines: int,
    session_deviation: float | None,
    into: str | None,
    place: str | None,
    date: str | None,
    control: bool,
) -> None:
    """Make recordings that hide a known effect, to test a diagnosis.

    The truth goes into another folder. The recordings come from a separate plant, not from the model: about 22 h to
    learn from (train_1 to train_3) and 6 h to hold out (hold_1, hold_2). Plants of the zoo are built of other
    nodes, paths and laws than the model; strengths are drawn by the evidence that the recordings hold. With --into
    an effect is put into a recording of a real machine instead.
    """
    of_zoo = {"--machine": machine, "--families": families, "--group": group, "--baselines": baselines or None,
              "--session-deviation": session_deviation}  # fmt: skip
    of_injection = {"--into": into, "--place": place, "--date": date, "--control": control or None}
    if plant == "zoo":
        own = {"--effect": effect, "--random": random or None, "--strength": strength}
        _refuse({**own, **of_injection}, "do not go with --plant zoo, where effects are drawn; see --group")
        conceal_in_zoo(seed=seed, output=output, truth=truth, cases=cases, machine=machine, families=families,
                       group=group, baselines=baselines, session_deviation=session_deviation)  # fmt: skip
        return
    _refuse(of_zoo, "go with --plant zoo only; the own plant takes --gearbox and records no baselines")
    if into is not None:
        if random or strength is not None:
            raise InputError("--into draws effect and size; leave out --random and --strength")
        conceal_into(into, gearbox, effect=effect, place=place, date=date, control=control, cases=cases, seed=seed,
                     output=output, truth=truth)  # fmt: skip
        return
    if control or place is not None or date is not None:
        raise InputError("--control, --place and --date go with --into")
    with progress(LOADING):
        from diagnosis.proof.cases.case_files import staged_folders
        from diagnosis.proof.cases.conceal import conceal_set, random_plans  # imports scipy.signal
        from diagnosis.proof.cases.concealed_case import Plan

    if (effect is None) == (not random):
        raise InputError("conceal takes either --effect NAME or --random")
    if random and strength is not None:
        raise InputError("--strength goes with --effect; --random draws it")
    number = 1 if cases is None else cases
    if effect is None:
        plans = random_plans(seed, number)
    else:
        plans = [Plan(group="single", effects=(effect,), strength=strength)] * number
    definition = load_gearbox(gearbox)
    recordings, truth = output / "recordings", truth or output / "truth"
    with (
        staged_folders(recordings, truth) as (stage, truth_stage),
        progress("concealing") as told,
    ):
        names = conceal_set(
            definition, plans, seed=seed, recordings=stage, truth=truth_stage, flat=cases is None,
            progress=partial(told, "simulating the recordings, percent"),
        )  # fmt: skip
    for name in names:
        console.out.print(f"wrote {recordings / ('' if cases is None else name)}, {truth / name}.json")


def _refuse(options: Mapping[str, object], why: str) -> None:
    given = [option for option, value in options.items() if value is not None]
    if given:
        raise InputError(f"{' and '.join(given)}: {why}")
