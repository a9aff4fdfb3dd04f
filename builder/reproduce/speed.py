"""Section 6: how long the 600 s cycle and 18 h take, beside the paper's times; and what a surrogate then buys."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from builder.drive_cycle import COLD_START, reference_cycle
from builder.fmu_drive import drive_fmu, runs_here
from builder.reproduce.item import Check, Item, Table, judged, target
from builder.reproduce.study import OUTPUT_TORQUE, Study
from models.cycle import Cycle
from models.network import Losses
from models.types import Array

PAPER = {("600 s", "F-PL"): 6410.0, ("600 s", "ROM-PL"): 3.8, ("18 h", "ROM-PL"): 110.0}  # s
FULL, REDUCED, FMU = "F-PL", "ROM-PL", "ROM-PL, FMU in FMPy"
BATCH = 400
WARM_UP_S = 5.0  # a longer first run counts: what it compiles is small beside it
LIMIT_18_H = 1.0  # s, for our networks in Python


@dataclass(frozen=True)
class Timing:
    """Median and runs of one measurement, [s]."""

    median: float
    runs: int


def measured(work: Callable[[], object], *, runs: int, longest_s: float) -> Timing:
    """Time some work as often as asked and as the time allows; a short first run, which compiles, does not count."""
    seconds: list[float] = []
    begin = start = time.perf_counter()
    work()
    if (first := time.perf_counter() - start) > WARM_UP_S:
        seconds.append(first)
    while not seconds or (len(seconds) < runs and time.perf_counter() - begin + seconds[-1] < longest_s):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return Timing(statistics.median(seconds), len(seconds))


def speed(study: Study, progress: Callable[[str], None]) -> Item:
    """Time the cycle and 18 h at T2 = 141 N m with the full model, the networks and the FMU."""
    cycles = {
        "600 s": (reference_cycle(study.gearbox), COLD_START),
        "18 h": (
            study.staircase(OUTPUT_TORQUE[1], step_s=study.settings.step_s),
            study.gearbox.ambient.temperature_degC,
        ),
    }
    timings: dict[tuple[str, str], Timing] = {}
    with threadpool_limits(1):
        checks = _timed(study, cycles, timings, progress)
    rows = tuple(
        (
            f"{name}, {model}",
            f"{PAPER[name, model]:g}" if (name, model) in PAPER else "-",
            f"{t.median:.2f}",
            str(t.runs),
            f"{timings[name, FULL].median / t.median:.1f}",
        )
        for (name, model), t in timings.items()
    )
    return Item(
        key="Speed",
        title="Computation times (section 6)",
        reading=(
            f"Rows of 1 s in the cycle, of {study.settings.step_s:g} s in 18 h (T₂ = {OUTPUT_TORQUE[1]:g} N m); the"
            " solver chooses its steps. Medians in one process and thread, after a run that does not count; the FMU"
            " with loading. The machines differ: the paper's ran Matlab/Simulink, ours is this one."
        ),
        checks=checks,
        tables=(
            Table(title="Time in s", header=("", "paper", "here, median", "runs", "times faster than F-PL"), rows=rows),
        ),
    )


def _timed(
    study: Study,
    cycles: Mapping[str, tuple[Cycle, float]],
    timings: dict[tuple[str, str], Timing],
    progress: Callable[[str], None],
) -> tuple[Check, ...]:
    for name, (cycle, initial) in cycles.items():
        works: dict[str, Callable[[], object]] = {
            FULL: partial(study.network.simulate, cycle, losses=study.full, initial=initial),
            REDUCED: partial(study.network.simulate, cycle, losses=study.surrogate, initial=initial),
        }
        if runs_here(study.fmu):
            works[FMU] = partial(drive_fmu, study.fmu, cycle, initial=initial)
        for model, work in works.items():
            progress(f"timing: {name}, {model}")
            timings[name, model] = measured(work, runs=study.settings.runs, longest_s=study.settings.longest_s)
    return (
        surrogate_is_faster_than_the_full_model(timings),
        full_model_is_a_thousand_times_slower(timings),
        hours_are_simulated_in_minutes(timings),
        eighteen_hours_within_a_second(timings),
        what_the_surrogate_buys(study, timings),
    )


def _of_fmu(timings: Mapping[tuple[str, str], Timing], cycle: str) -> str:
    if (cycle, FMU) not in timings:
        return "the Python FMU has no binary for this machine and is not timed"
    return f"the FMU takes {timings[cycle, FMU].median:.2f} s with loading"


def surrogate_is_faster_than_the_full_model(timings: dict[tuple[str, str], Timing]) -> Check:
    """Time of the cycle with the full model over that with the networks."""
    ratio = timings["600 s", FULL].median / timings["600 s", REDUCED].median
    return judged(
        "surrogate_is_faster_than_the_full_model",
        "ROM-PL drastically reduces the computation time.",
        f"The cycle is {ratio:.1f} times faster with the networks, {timings['600 s', REDUCED].median:.2f} s; "
        f"{_of_fmu(timings, '600 s')}.",
        ratio > 1.0,
        numbers={"ratio": ratio, "rom_s": timings["600 s", REDUCED].median},
        otherwise="The networks are not faster.",
    )


def full_model_is_a_thousand_times_slower(timings: dict[tuple[str, str], Timing]) -> Check:
    """The paper's ratio of both models."""
    printed = PAPER["600 s", "F-PL"] / PAPER["600 s", "ROM-PL"]
    ours = timings["600 s", FULL].median / timings["600 s", REDUCED].median
    return judged(
        "full_model_is_a_thousand_times_slower",
        f"F-PL takes 6410 s for 600 s, ROM-PL 3.8 s: a factor of {printed:.0f}.",
        f"F-PL takes {timings['600 s', FULL].median:.2f} s here:"
        f" {PAPER['600 s', 'F-PL'] / timings['600 s', FULL].median:.0f} times faster than the paper's, and faster than"
        f" real time by {600.0 / timings['600 s', FULL].median:.0f}.",
        ours > 0.1 * printed,
        numbers={"ours": ours, "printed": printed, "full_s": timings["600 s", FULL].median},
        otherwise=(
            "The factor was one of the implementation: evaluated over arrays and with a stiff solver, the full model "
            "is fast itself."
        ),
    )


def hours_are_simulated_in_minutes(timings: dict[tuple[str, str], Timing]) -> Check:
    """18 h with the networks."""
    seconds = timings["18 h", REDUCED].median
    return judged(
        "hours_are_simulated_in_minutes",
        "With ROM-PL only 110 s were needed for 18 h of operation.",
        f"{seconds:.2f} s here, {timings['18 h', FULL].median:.1f} s with the full model; {_of_fmu(timings, '18 h')}.",
        seconds < PAPER["18 h", "ROM-PL"],
        numbers={"rom_s": seconds, "full_s": timings["18 h", FULL].median},
        otherwise="It takes longer here.",
    )


def eighteen_hours_within_a_second(timings: dict[tuple[str, str], Timing]) -> Check:
    """Our own target."""
    seconds = timings["18 h", REDUCED].median
    return target(
        "eighteen_hours_within_a_second",
        f"Our target: 18 h with the networks in Python within {LIMIT_18_H:g} s.",
        f"{seconds:.2f} s.",
        seconds <= LIMIT_18_H,
        numbers={"rom_s": seconds},
        otherwise="Slower than the target on this machine at this moment.",
    )


def what_the_surrogate_buys(study: Study, timings: dict[tuple[str, str], Timing]) -> Check:
    """Cost per operating point, one by one and in arrays, and how many cycles pay for the training."""
    rng = np.random.default_rng(study.settings.seed)
    nodes = len(study.full.temperature_nodes)
    many = rng.uniform(50, 6500, BATCH), rng.uniform(1, 350, BATCH), rng.uniform(20, 120, (BATCH, nodes))
    one = tuple(values[0] for values in many)

    def cost(losses: Losses, points: tuple[Array, ...], repeats: int) -> float:
        return measured(lambda: [losses.power(*points) for _ in range(repeats)], runs=5, longest_s=5.0).median / repeats

    single = {name: cost(losses, one, 50) for name, losses in ((FULL, study.full), (REDUCED, study.surrogate))}
    batch = {name: cost(losses, many, 3) / BATCH for name, losses in ((FULL, study.full), (REDUCED, study.surrogate))}
    saved = timings["600 s", FULL].median - timings["600 s", REDUCED].median
    pays = study.ours.seconds / saved if saved > 0.0 else float("inf")
    ratio = single[FULL] / single[REDUCED]
    return target(
        "what_the_surrogate_buys",
        "What the surrogate buys, given a full model that is vectorised.",
        f"One operating point: {single[FULL] * 1e3:.2f} ms with the full model, {single[REDUCED] * 1e3:.3f} ms with the"
        f" networks ({ratio:.0f} times); in arrays of {BATCH}: {batch[FULL] * 1e6:.0f} and {batch[REDUCED] * 1e6:.1f}"
        f" µs per point ({batch[FULL] / batch[REDUCED]:.0f} times). Sampling and training took {study.ours.seconds:.0f}"
        f" s: as many as {pays:.0f} cycles of 600 s have to be run before the networks have saved that. What they buy"
        " beyond: losses as a few matrices that fit into an FMU or a controller without the full model.",
        ratio > 1.0,
        numbers={"single": ratio, "batch": batch[FULL] / batch[REDUCED], "cycles_to_pay": pays},
        otherwise="The networks are not faster.",
    )
