"""Section 6: how long the 600 s cycle and 18 h take, and the paper's times; and the gain by a surrogate."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from builder.drive.driver import drive_fmu, runs_here
from builder.fmi.reference_cycle import COLD_START, reference_cycle
from builder.reproduce.printed import OUTPUT_TORQUE, TIMES
from builder.reproduce.report import Check, Part, Table, item
from builder.reproduce.study import FULL, MEDIUM, REDUCED, Study
from models.simulation.thermal_network import Losses

FMU = "ROM-PL, FMU in FMPy"
BATCH = 400
WARM_UP_S = 5.0  # a longer first run counts: the time of compiling is small in it
LIMIT_18_H = 1.0  # s, for our networks in Python


@dataclass(frozen=True)
class Timing:
    """Median and number of runs of one measurement; the median in [s]."""

    median: float
    runs: int


def measure(work: Callable[[], object], *, runs: int, longest_s: float) -> Timing:
    """Time some work at most `runs` times and no further time after `longest_s`; a short first run does not count."""
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


@item("Speed", "Computation times (section 6)")
def computation_times(study: Study) -> Iterator[Part]:
    """The cycle and 18 h at medium torque with the full model, the networks and the FMU, in one thread."""
    with threadpool_limits(1):
        timings = _timings(study)
        single, batch = _costs(study)
    full, reduced = timings["600 s", FULL].median, timings["600 s", REDUCED].median
    full_18, reduced_18 = timings["18 h", FULL].median, timings["18 h", REDUCED].median
    fmu = {
        cycle: f"the FMU takes {timings[cycle, FMU].median:.2f} s with loading"
        if (cycle, FMU) in timings
        else "the Python FMU has no binary for this machine and is not timed"
        for cycle in ("600 s", "18 h")
    }
    yield (
        f"Rows of 1 s in the cycle, of {study.settings.step_s:g} s in 18 h (T₂ = {OUTPUT_TORQUE[MEDIUM]:g} N m); the"
        " solver chooses its steps. Medians in one process and thread, after a run that does not count; the FMU with"
        " loading. The machines differ: the paper's ran Matlab/Simulink, ours is this one."
    )
    yield Check(
        "surrogate_is_faster_than_the_full_model",
        "ROM-PL drastically reduces the computation time.",
        f"The cycle is {full / reduced:.1f} times faster with the networks, {reduced:.2f} s; {fmu['600 s']}.",
        full > reduced,
        {"ratio": full / reduced, "rom_s": reduced},
        "The networks are not faster.",
    )
    paper_full, paper_reduced = TIMES["600 s", FULL], TIMES["600 s", REDUCED]
    yield Check(
        "full_model_is_a_thousand_times_slower",
        f"F-PL takes 6410 s for 600 s, ROM-PL 3.8 s: a factor of {paper_full / paper_reduced:.0f}.",
        f"F-PL takes {full:.2f} s here: {paper_full / full:.0f} times faster than the paper's, and faster than real"
        f" time by {600.0 / full:.0f}.",
        full / reduced > 0.1 * paper_full / paper_reduced,
        {"ours": full / reduced, "printed": paper_full / paper_reduced, "full_s": full},
        "The factor was one of the implementation: evaluated over arrays and with a stiff solver, the full model is"
        " fast itself.",
    )
    yield Check(
        "hours_are_simulated_in_minutes",
        "With ROM-PL only 110 s were needed for 18 h of operation.",
        f"{reduced_18:.2f} s here, {full_18:.1f} s with the full model; {fmu['18 h']}.",
        reduced_18 < TIMES["18 h", REDUCED],
        {"rom_s": reduced_18, "full_s": full_18},
        "It takes longer here.",
    )
    yield Check(
        "eighteen_hours_within_a_second",
        f"Our target: 18 h with the networks in Python within {LIMIT_18_H:g} s.",
        f"{reduced_18:.2f} s.",
        reduced_18 <= LIMIT_18_H,
        {"rom_s": reduced_18},
        "Slower than the target on this machine at this moment.",
        target=True,
    )
    ratio, batch_ratio = single[FULL] / single[REDUCED], batch[FULL] / batch[REDUCED]
    pays = study.ours.seconds / (full - reduced) if full > reduced else float("inf")
    yield Check(
        "what_the_surrogate_buys",
        "The gain by the surrogate, given a full model that is vectorised.",
        f"One operating point: {single[FULL] * 1e3:.2f} ms with the full model, {single[REDUCED] * 1e3:.3f} ms with the"
        f" networks ({ratio:.0f} times); in arrays of {BATCH}: {batch[FULL] * 1e6:.0f} and {batch[REDUCED] * 1e6:.1f}"
        f" µs per point ({batch_ratio:.0f} times). Sampling and training took {study.ours.seconds:.0f} s: as many as"
        f" {pays:.0f} cycles of 600 s have to be run before the networks have saved that. A further gain: losses as a"
        " few matrices that fit into an FMU or a controller without the full model.",
        ratio > 1.0,
        {"single": ratio, "batch": batch_ratio, "cycles_to_pay": pays},
        "The networks are not faster.",
        target=True,
    )
    yield Table(
        "Time in s",
        ("", "paper", "here, median", "runs", "times faster than F-PL"),
        [
            (
                f"{cycle}, {model}",
                f"{TIMES[cycle, model]:g}" if (cycle, model) in TIMES else "-",
                f"{timing.median:.2f}",
                str(timing.runs),
                f"{timings[cycle, FULL].median / timing.median:.1f}",
            )
            for (cycle, model), timing in timings.items()
        ],
    )


def _timings(study: Study) -> dict[tuple[str, str], Timing]:
    """Times by cycle and model."""
    settings, timings = study.settings, {}
    long_cycle = study.staircase(OUTPUT_TORQUE[MEDIUM], step_s=settings.step_s)
    cycles = (
        ("600 s", reference_cycle(study.gearbox), COLD_START),
        ("18 h", long_cycle, study.gearbox.ambient.temperature_degC),
    )
    for name, cycle, initial in cycles:
        works: dict[str, Callable[[], object]] = {
            FULL: partial(study.network.simulate, cycle, losses=study.full, initial=initial),
            REDUCED: partial(study.network.simulate, cycle, losses=study.surrogate, initial=initial),
        }
        if runs_here(study.fmu):
            works[FMU] = partial(drive_fmu, study.fmu, cycle, initial=initial)
        for model, work in works.items():
            study.progress(f"timing: {name}, {model}")
            timings[name, model] = measure(work, runs=settings.runs, longest_s=settings.longest_s)
    return timings


def _costs(study: Study) -> tuple[dict[str, float], dict[str, float]]:
    """Time per operating point [s] of both models: one by one, and in arrays."""
    rng = np.random.default_rng(study.settings.seed)
    nodes = len(study.full.temperature_nodes)
    many = rng.uniform(50, 6500, BATCH), rng.uniform(1, 350, BATCH), rng.uniform(20, 120, (BATCH, nodes))
    one = tuple(values[0] for values in many)
    models: dict[str, Losses] = {FULL: study.full, REDUCED: study.surrogate}

    def cost(losses: Losses, points: Sequence[Any], repeats: int) -> float:
        def work() -> None:
            for _ in range(repeats):
                losses.power(*points)

        return measure(work, runs=5, longest_s=5.0).median / repeats

    return (
        {name: cost(losses, one, 50) for name, losses in models.items()},
        {name: cost(losses, many, 3) / BATCH for name, losses in models.items()},
    )
