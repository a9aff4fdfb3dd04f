"""The verb ``simulate``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from builder.base import console
from builder.base.options import GEARBOX_HELP, CorrectionFile, correction_options, example, gearbox_option
from builder.base.progress import progress
from models.assembly.gearbox import load_gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.base.types import Array
from models.correction.correction import Correction
from models.definition.sections import Training
from models.files.cycle import Cycle
from models.files.output_files import refuse_to_replace, write_table
from models.files.paths import kind_of
from models.quantities.quantities import MEMORY, Input, node_columns
from models.simulation.start_temperatures import start_temperatures

if TYPE_CHECKING:
    from diagnosis.recordings.machine import RecordedMachine
    from models.files.cycle_file import RecordedStart

RECORDED = "recorded"  # --initial: as the cycle's own file says
PLOTS = (".png", ".pdf", ".svg")
HOTTEST_DEGC = 250.0  # of a part
COLD_START_K = 5.0  # that a start differs from what was recorded, and a warning says so

Initial = float | Mapping[str, float] | None
Count = Callable[[int, int], None]  # takes done, of


@dataclass(frozen=True)
class Model:
    """Model that a cycle is simulated with.

    Attributes
    ----------
    title : str
        Its name, for a plot
    machine : RecordedMachine
        Its inputs, and its parts, which have a start temperature
    domain : str
        What ``in_domain`` is about, for a warning
    run : callable
        From cycle, start temperatures and a function that takes the progress, to the columns of the result
    groups : mapping of str to tuple of str
        Nodes that are drawn together
    correction : Correction or None
        Whose physics it holds
    memories : mapping of str to float
        Of its laws, as wear or the switch of a fan, with their start values
    """

    title: str
    machine: RecordedMachine
    domain: str
    run: Callable[[Cycle, Initial, Count], dict[str, Array]]
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    correction: Correction | None = None
    memories: Mapping[str, float] = field(default_factory=dict)


def _full_model(name_or_file: str, correction: CorrectionFile | None) -> Model:
    gearbox = load_gearbox(name_or_file)
    network, found = gearbox.network(), None
    if correction is not None:
        found = correction.read(gearbox)
        network = found.network(gearbox)
    trained = None if gearbox.is_parametric else gearbox.training

    def run(cycle: Cycle, initial: Initial, told: Count) -> dict[str, Array]:
        result = network.simulate(cycle, losses=gearbox.loss_laws(), initial=initial, trained=trained, progress=told)
        return result.columns()

    return Model(
        title=f"{gearbox.name}, full model",
        machine=network,
        domain="the domain of the losses" if trained is None else _range_of(trained),
        run=run,
        groups=network.groups,
        correction=found,
        memories={state.name: state.start for state in network.states},
    )


def _range_of(trained: Training) -> str:
    low, high = trained.temperature_degC
    return (
        f"the range that the definition names (speed to {trained.speed_rpm[1]:g} 1/min, torque to "
        f"{trained.torque_Nm[1]:g} N m, temperatures {low:g} to {high:g} degC)"
    )


def _fmu(path: Path, correction: CorrectionFile | None) -> Model:
    from builder.drive.driver import drive_fmu  # imports fmpy; the full model need not wait for it
    from builder.drive.machine_of_fmu import fmu_machine

    machine, found = fmu_machine(path), None
    if correction is not None:
        found = correction.parse()
        machine.refuse_other_correction(found, source=str(correction.path))
        try:
            found.check_instruments(machine.nodes, machine.inputs)
        except InputError as error:
            raise InputError("\n".join(f"{correction.path}: {line}" for line in str(error).splitlines())) from error

    def run(cycle: Cycle, initial: Initial, told: Count) -> dict[str, Array]:
        return drive_fmu(path, cycle, initial=initial, progress=told)

    return Model(
        title=path.name,
        machine=machine,
        domain="the surrogate's training domain",
        run=run,
        correction=found,
        memories=machine.memories,
    )


def _without_biases(start: RecordedStart, correction: Correction | None) -> RecordedStart:
    if correction is None:
        return start
    from diagnosis.forward.recorder import true_start

    return true_start(start, correction)


def _simulated(model: Model, cycle: Cycle, start: Initial, *, is_recording: bool) -> dict[str, Array]:
    """Simulate; with a correction, from the inputs as they were, and with readings of the recorder's sensors."""

    def run(driven: Cycle) -> dict[str, Array]:
        with progress("simulating") as told:
            return model.run(driven, start, partial(told, "simulating"))

    if model.correction is None:
        return run(cycle)
    from diagnosis.forward.recorder import read_as_recorded, simulated_as_recorded

    if is_recording:
        return simulated_as_recorded(cycle, model.correction, run)
    columns = run(cycle)
    return columns | read_as_recorded(columns, model.correction)


@click.command("simulate", epilog=example("simulate --gearbox fzg examples/drive_cycle_600s.csv --output result.csv"))
@click.argument("files", nargs=-1, required=True, metavar="[FMU] CYCLE", type=click.Path(path_type=Path))
@gearbox_option(f"Drive the full model instead. {GEARBOX_HELP}", default=None)
@click.option("--output", required=True, type=click.Path(path_type=Path), metavar="FILE",
              help="Result: .csv, .csv.gz or .parquet.")  # fmt: skip
@click.option("--output-interval", type=float, default=None, metavar="S",
              help="Rows of the result also every S seconds.  [default: the cycle's rows only]")  # fmt: skip
@click.option("--initial", default=None, metavar="T|recorded|FILE",
              help="Start temperature of all nodes in degC; 'recorded': the first ones in the cycle's own "
                   "T_<node>_degC columns, their mean for nodes without a column; or a file with such columns of all "
                   "nodes, whose last row counts (a result to be continued).  [default: first ambient temperature]",
              )  # fmt: skip
@click.option("--mapping", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="What the columns of a recording mean.  [default: <stem>.toml or mapping.toml next to it, else as "
                   "the definition states]")  # fmt: skip
@correction_options("Result of diagnose: the full model carries it, an FMU was built with it. A recording (with "
                    "measured temperatures) drives the model with its inputs as they probably were; "
                    "<column>_as_recorded are those that it has, and the readings of the sensors of the correction, to "
                    "compare with it.")  # fmt: skip
@click.option("--plot", type=click.Path(path_type=Path), default=None, metavar="FILE", help="Plot: .png, .pdf or .svg.")
def simulate(
    files: tuple[Path, ...],
    gearbox: str | None,
    output: Path,
    output_interval: float | None,
    initial: str | None,
    mapping: Path | None,
    correction: CorrectionFile | None,
    plot: Path | None,
) -> None:
    """Drive a cycle with an FMU or with the full model.

    The full model is that of --gearbox. CYCLE is a table (.csv, .csv.gz, .parquet) with the columns time_s, speed_rpm,
    torque_Nm and, where known, T_ambient_degC and air_speed_m_s; or the inputs that the definition names. It may be
    a recording that diagnose reads as well, or a part of one (FILE@FROM..TO), or files that follow each other in
    time (FILE+FILE).
    """
    named = [
        Path(name)
        for name in (gearbox, initial, mapping, None if correction is None else correction.path)
        if name is not None
    ]
    _check_outputs(output, plot, inputs=[*_read_as_files(files, gearbox), *named])
    from diagnosis.recordings.as_cycle import read_cycle_or_recording
    from models.files.cycle_file import read_initial

    given = None if initial in (None, RECORDED) else read_initial(str(initial))
    model_of = partial(_fmu, files[0]) if gearbox is None else partial(_full_model, gearbox)
    model = model_of(correction)
    inputs, nodes = model.machine.inputs, tuple(part.name for part in model.machine.parts)
    cycle, recorded, notes = read_cycle_or_recording(files[-1], model.machine, mapping=mapping)
    for note in notes:
        console.err.print(f"note: {files[-1]}: {note}")
    recorded = _without_biases(recorded, model.correction)
    start = recorded.of(nodes) if initial == RECORDED else given
    if start is not None:
        memories = {}
        if isinstance(start, Mapping):  # a result also has temperatures of boundaries
            memories = {MEMORY + name: start.get(MEMORY + name, value) for name, value in model.memories.items()}
            if initial != RECORDED and (fresh := [name for name in memories if name not in start]):
                console.err.print(f"note: {initial}: has no {', '.join(fresh)}; they start from their beginning")
            start = {name: T for name, T in start.items() if name in nodes}
        source = str(recorded.path) if initial == RECORDED else f"--initial {initial}"
        start = start_temperatures(start, nodes, source=source) | memories
    if output_interval is not None:
        cycle = cycle.refined(output_interval)
    columns = _simulated(model, cycle, start, is_recording=bool(recorded.temperatures))
    with nullcontext() if plot is None else atomic_file(plot) as picture:
        if picture is not None:
            from builder.drive.plots import plot_cycle

            title = f"{model.title}: {files[-1].name}"
            plot_cycle(picture, columns, title=title, groups=model.groups, inputs=inputs)
        write_table(output, columns)
    _show(columns, inputs)
    _print_assumed_inputs(columns, cycle, inputs)
    _warn_of_domain(columns, model.domain)
    _warn_of_heat(columns)
    if initial is None:
        _warn_of_start(columns, recorded, nodes)
    for file in (output, plot):
        if file is not None:
            console.out.print(f"wrote {file}")
    sys.stdout.flush()


def _read_as_files(files: tuple[Path, ...], gearbox: str | None) -> tuple[Path, ...]:
    """Return the files that are read; a part of a recording counts as its file."""
    if len(files) > 2 or (len(files) == 2) == (gearbox is not None):
        raise InputError("simulate takes FMU CYCLE, or --gearbox NAME|FILE and CYCLE")
    from diagnosis.recordings.names import split_path

    return (*(files[:-1] if gearbox is None else ()), *split_path(files[-1])[0])


def _check_outputs(output: Path, plot: Path | None, inputs: list[Path]) -> None:
    """Refuse outputs that cannot be written, before the work and not after it."""
    if plot is not None and plot.suffix.lower() not in PLOTS:
        raise InputError(f"{plot}: plots are written as .png, .pdf or .svg")
    outputs = [output] if plot is None else [output, plot]
    refuse_to_replace(inputs, outputs)
    kind_of(output)


def _show(columns: Mapping[str, Array], inputs: Mapping[str, Input]) -> None:
    given = [known.column for known in inputs.values()]
    temperatures = {node: columns[name] for node, name in node_columns(columns).items() if name not in given}
    rows = [[n, f"{v[0]:.1f}", f"{v.max():.1f}", f"{v[-1]:.1f}"] for n, v in temperatures.items()]
    console.table("Temperatures in degC", ["node", "first", "highest", "last"], rows)
    losses = {n: v for n, v in columns.items() if n.startswith("P_loss")}
    rows = [
        [
            n.removeprefix("P_loss_").removesuffix("_W") if n != "P_loss_W" else "total",
            f"{_mean_over_time(columns['time_s'], v):.1f}",
            f"{v.max():.1f}",
        ]
        for n, v in losses.items()
    ]
    if rows:
        console.table("Losses in W", ["loss", "mean over time", "highest"], rows)


def _mean_over_time(time: Array, values: Array) -> float:
    """Of straight lines between the rows; they may be unevenly far apart."""
    span = time[-1] - time[0]
    return float(np.trapezoid(values, time) / span if span > 0.0 else values[0])


def _print_assumed_inputs(columns: Mapping[str, Array], cycle: Cycle, inputs: Mapping[str, Input]) -> None:
    for name, column in ((name, given.column) for name, given in inputs.items()):
        if name not in cycle.inputs:
            console.err.print(f"note: the cycle has no column {column}; {columns[column][0]:g} is assumed")


def _warn_of_domain(columns: Mapping[str, Array], domain: str) -> None:
    outside = int((~columns["in_domain"].astype(bool)).sum()) if "in_domain" in columns else 0
    if outside:
        _warn(f"{outside} of {len(columns['time_s'])} rows are outside {domain}; in_domain shows which")


def _warn_of_heat(columns: Mapping[str, Array]) -> None:
    """Warn of a temperature that no gearbox survives: more likely an input has another unit."""
    highest = {name: float(values.max()) for name, values in columns.items() if name.startswith("T_")}
    hottest = max(highest, key=lambda name: highest[name])
    if highest[hottest] > HOTTEST_DEGC:
        _warn(f"{hottest} reaches {highest[hottest]:.0f}, which no gearbox survives; check the units of the cycle")


def _warn_of_start(columns: Mapping[str, Array], recorded: RecordedStart, nodes: tuple[str, ...]) -> None:
    """Warn if no start is given and the recording starts warm: the cold start would look like a model error."""
    off = {name: abs(T - columns[f"T_{name}_degC"][0]) for name, T in recorded.temperatures.items() if name in nodes}
    worst = max(off, key=lambda name: off[name], default=None)
    if worst is None or off[worst] <= COLD_START_K:
        return
    T, row, start = recorded.temperatures[worst], recorded.rows[worst], columns[f"T_{worst}_degC"][0]
    _warn(
        f"{recorded.path}: {recorded.columns[worst]} is {T:.1f} at row {row}, but all nodes start at the first ambient "
        f"temperature, {start:.1f} degC; --initial {RECORDED} starts as recorded"
    )


def _warn(text: str) -> None:
    console.err.print(f"warning: {text}", style="yellow")
