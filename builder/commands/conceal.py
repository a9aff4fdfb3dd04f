"""The verb ``conceal``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from builder.base import console
from builder.base.options import FiniteRange, example, gearbox_option
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError

if TYPE_CHECKING:
    from diagnosis.proof.cases.case_files import CaseFiles

Make = Callable[..., "Iterator[CaseFiles]"]  # of whom progress is reported to


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
        from diagnosis.proof.injection.kinds import KINDS

        rows = [[name, "yes" if effect.catalogue else "no", effect.law] for name, effect in sorted(EFFECTS.items())]
        console.table("Effects that can be concealed", ["name", "in the catalogue", "law"], rows, text_columns=3)
        injected = [[name, kind.law] for name, kind in KINDS.items()]
        console.table("Effects that can be injected (--into)", ["name", "what it is"], injected, text_columns=2)
        context.exit()


@click.command("conceal", epilog=example("conceal --effect windage --seed 1 --output out/concealed"))
@click.option("--plant", type=click.Choice(["own", "zoo"]), default="own", show_default=True, is_eager=True,
              help="own: finer, other formulas, of any gearbox with geometry; zoo: of random structure.")  # fmt: skip
@click.option("--effect", default=None, metavar="NAME", help="Effect to conceal; --list shows the names.")
@click.option(
    "--list", is_flag=True, is_eager=True, expose_value=False, callback=_list_effects, help="Show the effects."
)
@click.option("--random", "random", is_flag=True, help="Draw the effects to conceal; there may be none.")
@click.option("--strength", type=FiniteRange(min=0.01, max=10.0), default=None, metavar="X",
              help="Strength relative to the usual one.  [default: drawn from 0.25 to 2]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0, max=2**32 - 1), required=True, metavar="N",
              help="The same seed gives the same bytes.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), required=True, metavar="DIR",
              help="Folder 'recordings' in it gets the recordings, with --cases one folder per case.")  # fmt: skip
@click.option("--truth", type=click.Path(path_type=Path, file_okay=False), default=None, metavar="DIR",
              help="Folder for the truth.  [default: 'truth' in --output]")  # fmt: skip
@click.option("--cases", type=click.IntRange(min=1, max=10_000), default=None, metavar="N", help="How many cases.")
@gearbox_option("Name or definition file (TOML), of the own plant and of --into.  [default: fzg]", default=None)
@click.option("--machine", default=None, metavar="NAME|FILE",
              help="Zoo: name or definition file (TOML).  [default: drawn]")  # fmt: skip
@click.option(
    "--families", default=None, metavar="NAME,...", help="Zoo: families of plants to draw from.  [default: all]"
)
@click.option("--group", default=None, metavar="NAME",
              help="Zoo: control, single, date, sensor, pair, outside or messy.  [default: drawn]")  # fmt: skip
@click.option("--baselines", type=click.IntRange(min=0, max=20), default=0, show_default=True, metavar="N",
              help="Zoo: healthy recordings of the same plant as well.")  # fmt: skip
@click.option("--session-deviation", type=FiniteRange(min=0.0, max=0.2), default=None, metavar="X",
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
    gearbox: str | None,
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
    recordings, truth, number = output / "recordings", truth or output / "truth", cases or 1
    if plant == "zoo":
        own = {"--effect": effect, "--random": random or None, "--strength": strength, "--gearbox": gearbox}
        _refuse({**own, **of_injection}, "do not go with --plant zoo: see --group, --machine")
        what, make = "concealing", _in_zoo(seed, number, machine=machine, families=families, group=group)
        make = partial(make, baselines=baselines, session_deviation=session_deviation)
    else:
        gearbox = gearbox or "fzg"
        _refuse(of_zoo, "go with --plant zoo only; the own plant takes --gearbox and records no baselines")
        if into is not None:
            if random or strength is not None:
                raise InputError("--into draws effect and size; leave out --random and --strength")
            make = _into(into, gearbox, recordings, effect=effect, place=place, date=date, control=control)
            what, make = "injecting", partial(make, number=number, seed=seed)
        else:
            if control or place is not None or date is not None:
                raise InputError("--control, --place and --date go with --into")
            what = "simulating the recordings, percent"
            make = _in_own_plant(gearbox, seed, number, effect=effect, random=random, strength=strength)

    from diagnosis.proof.cases.case_files import staged_folders, write_cases

    with staged_folders(recordings, truth) as (stage, truth_stage), progress(what) as told:
        names = write_cases(make(progress=partial(told, what)), stage, truth_stage, flat=cases is None)
    for name in names:
        console.out.print(f"wrote {recordings / ('' if cases is None else name)}, {truth / name}.json")


def _in_own_plant(
    gearbox: str, seed: int, number: int, *, effect: str | None, random: bool, strength: float | None
) -> Make:
    with progress(LOADING):
        from diagnosis.proof.cases.conceal import conceal_set, random_plans  # imports scipy.signal
        from diagnosis.proof.cases.concealed_case import Plan

    if (effect is None) == (not random):
        raise InputError("conceal takes either --effect NAME or --random")
    if random and strength is not None:
        raise InputError("--strength goes with --effect; --random draws it")
    if effect is None:
        plans = random_plans(seed, number)
    else:
        plans = [Plan(group="single", effects=(effect,), strength=strength)] * number
    return partial(conceal_set, load_gearbox(gearbox), plans, seed=seed)


def _in_zoo(seed: int, number: int, *, machine: str | None, families: str | None, group: str | None) -> Make:
    with progress(LOADING):
        from diagnosis.proof.zoo.conceal_zoo import conceal_zoo, random_zoo_plans, zoo_plans

    names = None if families is None else [name.strip() for name in families.split(",")]
    if group is None:
        return partial(conceal_zoo, random_zoo_plans(seed, number, families=names, machine=machine))
    return partial(conceal_zoo, zoo_plans(seed, {group: number}, families=names, machine=machine))


def _into(
    recording: str, gearbox: str, recordings: Path, *, effect: str | None, place: str | None, date: str | None,
    control: bool,
) -> Make:  # fmt: skip
    with progress(LOADING):
        from diagnosis.proof.injection.inject import Injector, Wish, inject_set  # imports scipy

    if control and (effect is not None or place is not None or date is not None):
        raise InputError("--control injects nothing; leave out --effect, --place and --date")
    with progress("reading the recording"):
        injector = Injector(load_gearbox(gearbox), recording)
    # A mapping file among the cases would change their meaning.
    for file in sorted(path for path in recordings.rglob("*") if path.is_file()):
        if file.name not in injector.written:
            raise InputError(f"{recordings}: holds other files ({file.name}); choose another output")
    return partial(inject_set, injector, Wish(kind=effect, place=place, date=date, control=control))


def _refuse(options: Mapping[str, object], why: str) -> None:
    given = [option for option, value in options.items() if value is not None]
    if given:
        raise InputError(f"{' and '.join(given)}: {why}")
