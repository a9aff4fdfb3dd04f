"""Cases: recordings with a concealed effect in one folder, the truth in another.

A case is drawn from its seed alone, so the same seed gives the same bytes. The clock of effects that age or set in
starts with each recording, as if each were the first after the gearbox was set up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from diagnosis.proof.cases.case_files import CaseFiles, case_names, files_of_recordings, staged_folders, write_cases
from diagnosis.proof.cases.concealed_case import CONTROLS, FAULTS, ConcealedCase, Plan
from diagnosis.proof.cases.truth import truth_of
from diagnosis.proof.plant.cycles import Programme, ambient, ornstein_uhlenbeck, programmes
from diagnosis.proof.plant.effect import Concealed, Effect
from diagnosis.proof.plant.effects_heat import HEAT_EFFECTS
from diagnosis.proof.plant.effects_losses import LOSS_EFFECTS
from diagnosis.proof.plant.effects_outside import OUTSIDE_EFFECTS
from diagnosis.proof.plant.instruments import SENSOR_EFFECTS, Instruments, default_channels, record
from diagnosis.proof.plant.plant import READINGS, Plant
from diagnosis.proof.plant.plant_run import EXPONENTS, ORDINARY_SPREAD, Individual, PlantRun, factor_sd, run_plant
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError, did_you_mean

EFFECTS: Mapping[str, Effect] = {**LOSS_EFFECTS, **HEAT_EFFECTS, **SENSOR_EFFECTS, **OUTSIDE_EFFECTS}
PHYSICS, OUTSIDE = (*LOSS_EFFECTS, *HEAT_EFFECTS), tuple(OUTSIDE_EFFECTS)
MIX = {"control": 0.24, "single": 0.44, "double": 0.10, "sensor": 0.08, "outside": 0.10, "messy": 0.04}
# The whole proof: every mechanism of the catalogue twice as a single.
PROOF_MIX = {"control": 60, "single": 2 * len(PHYSICS), "double": 30, "messy": 30, "outside": 30, "sensor": 15}
WHOLE = sum(PROOF_MIX.values())
MINOR = ("windage", "shaft_ends_to_air", "oil_level_thermal", "pump_heat", "radiation_error", "hot_neighbour",
         "bearing_additive", "oil_mist", "misalignment", "ambient_swing", "run_in_seals", "motor_flange")  # fmt: skip
# At usual strength these cause a kelvin or more, so that they stand out among minor ones.
DOMINANT = ("churning_swirl", "splash_starvation", "run_in_flanks", "gear_wear", "torque_decay", "aeration", "oil_jet",
            "air_cooling_change", "foundation_conduction", "cooler_thermostat", "cooler_proportional", "oil_tank",
            "cooler_constant", "cooler_shaft_driven", "water_jacket", "fan_thermostat", "fan_on_shaft",
            "fan_speed_switch", "rain_on_housing", "solar_soak", "bearing_preload", "bearing_damage")  # fmt: skip
MINOR_STRENGTH = (0.15, 0.4)
STRENGTH = (0.25, 2.0)  # drawn evenly in its logarithm
LEAST_STRENGTH = {"double": 0.5, "messy": 0.8}  # of effects that must be found next to others
FAR = 5.0  # standard deviations
# Parameters that may be far off, and to which side: the other one of the first two would overheat the box.
FAR_FACTORS = (("mesh", -1.0), ("h_air", 1.0), ("seal", 1.0), ("seal", -1.0), ("bearing", 1.0), ("C_oil", 1.0))
TOGETHER = 40  # cases that are simulated at once, a gigabyte at most
DATA_SHEET = {"noise": 0.2, "resolution": 0.1, "lag_s": 15.0, "lag_sd_s": 5.0}
NOISY_K, SLOW_LAG_S = (0.4, 0.7), (30.0, 55.0)


def mix_of(cases: int, mix: Mapping[str, int] = PROOF_MIX) -> dict[str, int]:
    """Number of cases of each group, in the proportions of a mix, at least one of each.

    Raises
    ------
    InputError
        If there are fewer cases than groups.

    Examples
    --------
    >>> mix_of(60)
    {'control': 14, 'single': 21, 'double': 7, 'messy': 7, 'outside': 7, 'sensor': 4}
    >>> mix_of(WHOLE) == PROOF_MIX
    True
    """
    if cases < len(mix):
        raise InputError(f"{cases} cases are too few: {len(mix)} groups ({', '.join(mix)}) need one each")
    shares = {group: cases * number / sum(mix.values()) for group, number in mix.items()}
    counts = {group: max(1, int(share)) for group, share in shares.items()}
    while sum(counts.values()) > cases:
        counts[max((g for g in counts if counts[g] > 1), key=lambda group: counts[group] - shares[group])] -= 1
    while sum(counts.values()) < cases:
        counts[max(shares, key=lambda group: shares[group] - counts[group])] += 1
    return counts


def mixed_plans(seed: int, counts: Mapping[str, int]) -> list[Plan]:
    """Plans of a set, in random order.

    Parameters
    ----------
    counts : mapping of group to int
        How many of each group; singles take every mechanism of the catalogue in turn before one comes twice
    """
    turns, pairs, mess, order = (np.random.default_rng([seed, 1, stream]) for stream in range(4))
    makers: Mapping[str, Callable[[int], Plan]] = {
        "control": lambda i: Plan(group="control", kind=CONTROLS[i % len(CONTROLS)]),
        "single": _in_turn("single", PHYSICS, turns),
        "sensor": _in_turn("sensor", FAULTS, turns),
        "outside": _in_turn("outside", OUTSIDE, turns),
        "double": lambda _: Plan(group="double", effects=tuple(map(str, pairs.choice(PHYSICS, 2, replace=False)))),
        "messy": lambda _: _messy(mess),
    }
    plans = [makers[group](i) for group, number in counts.items() for i in range(number)]
    return [plans[i] for i in order.permutation(len(plans))]


def random_plans(seed: int, number: int) -> list[Plan]:
    """Plans drawn in the proportions of :data:`MIX`."""
    return mixed_plans(seed, drawn_counts(seed, number, MIX))


def drawn_counts(seed: int, number: int, mix: Mapping[str, float]) -> dict[str, int]:
    """How many cases of each group, drawn in the proportions of a mix."""
    groups = np.random.default_rng([seed, 0]).choice(list(mix), number, p=list(mix.values()))
    return {group: int(np.sum(groups == group)) for group in mix}


def _in_turn(group: str, names: Sequence[str], rng: np.random.Generator) -> Callable[[int], Plan]:
    order = [str(name) for name in rng.permutation(names)]
    return lambda i: Plan(group=group, effects=(order[i % len(order)],))


def _messy(rng: np.random.Generator) -> Plan:
    """One dominant effect and six minor ones."""
    return Plan(group="messy", effects=(str(rng.choice(DOMINANT)), *map(str, rng.choice(MINOR, 6, replace=False))))


def conceal(
    effect: str,
    folder: str | Path,
    *,
    gearbox: Gearbox | str | Path = "fzg",
    strength: float | None = None,
    seed: int = 0,
) -> tuple[Path, ...]:
    """Make recordings of a plant that hides one effect.

    Parameters
    ----------
    effect : str
        Key of :data:`EFFECTS`
    folder : str or Path
        Its folder ``recordings`` gets the recordings, ``truth`` the concealed effect
    gearbox : Gearbox, name or path
    strength : float or None
        Relative to the usual one; by default drawn
    seed : int
        The same seed gives the same bytes

    Returns
    -------
    tuple of Path
        Recordings: ``hold_*`` to judge by, ``train_*`` to learn from

    Raises
    ------
    InputError
        If the effect is not known, files of another case would be lost, or the folder cannot be written to.
    """
    gearbox = gearbox if isinstance(gearbox, Gearbox) else load_gearbox(gearbox)
    recordings, truth = Path(folder, "recordings"), Path(folder, "truth")
    plan = Plan(group="single", effects=(effect,), strength=strength)
    with staged_folders(recordings, truth) as (stage, truth_stage):
        write_cases(conceal_set(gearbox, [plan], seed=seed), stage, truth_stage, flat=True)
    return tuple(sorted(recordings.glob("*.csv.gz")))


def conceal_set(
    gearbox: Gearbox, plans: Sequence[Plan], *, seed: int, progress: Callable[[int, int], None] | None = None
) -> Iterator[CaseFiles]:
    """Draw, simulate and record cases, :data:`TOGETHER` at once.

    Parameters
    ----------
    progress : callable or None
        Called with the amounts of work done and in all

    Raises
    ------
    InputError
        If an effect is not known.
    """
    plant = Plant(gearbox)
    cases = [draw_case(plant, plan, seed=(seed, i), name=name)
             for i, (plan, name) in enumerate(zip(plans, case_names(len(plans)), strict=True))]  # fmt: skip
    for first in range(0, len(cases), TOGETHER):
        batch = cases[first : first + TOGETHER]
        runs = [replace(run, effects=tuple(case.physics[i] for i in kept))
                for case in batch for kept in twins(case) for run in case.runs]  # fmt: skip
        total, done = sum(map(len, runs)), 0

        def report(rows: int, first: int = first, count: int = len(batch), total: int = total) -> None:
            nonlocal done
            done += rows
            if progress is not None:
                progress(round(100 * (first + count * min(done, total) / total)), 100 * len(plans))

        outcomes = iter(run_plant(plant, runs, report))
        for case in batch:
            by_twin = {kept: [next(outcomes) for _ in case.runs] for kept in twins(case)}
            columns = {
                run.programme.name: record(
                    plant, run, outcome, case.instruments, case.faults, np.random.default_rng([*case.seed, 7, k])
                )
                for k, (run, outcome) in enumerate(zip(case.runs, by_twin[twins(case)[0]], strict=True))
            }
            files = files_of_recordings(columns, case.instruments.stated)
            yield CaseFiles(name=case.name, files=files, truth=truth_of(plant, case, by_twin))


def twins(case: ConcealedCase) -> list[tuple[int, ...]]:
    """Which effects of the plant to simulate: all, none, and all but one of one or two, or but the first of more."""
    everything = tuple(range(len(case.physics)))
    left_out = everything if len(everything) <= 2 else everything[:1]
    without = [tuple(i for i in everything if i != k) for k in left_out]
    return list(dict.fromkeys([everything, (), *without]))


# ---------------------------------------------------------------------- drawing


def draw_case(plant: Plant, plan: Plan, *, seed: tuple[int, ...], name: str) -> ConcealedCase:
    """Draw the gearbox, strengths, programmes and instruments of a plan.

    Raises
    ------
    InputError
        If an effect is not known.
    """
    unknown = [effect for effect in plan.effects if effect not in EFFECTS]
    if unknown:
        raise InputError(f"{unknown[0]!r} is not an effect that can be concealed{did_you_mean(unknown[0], EFFECTS)}")
    rng = np.random.default_rng([*seed, 3])
    individual = _individual(plant, plan, rng)
    effects = tuple(_specimen(plant, plan, k, rng) for k in range(len(plan.effects)))
    runs = tuple(_run(plant, individual, p, rng) for p in programmes(plant.gearbox, rng))
    instruments = _instruments(plant, plan, rng)
    return ConcealedCase(name=name, plan=plan, seed=seed, individual=individual, effects=effects,
                         instruments=instruments, runs=runs)  # fmt: skip


def _specimen(plant: Plant, plan: Plan, k: int, rng: np.random.Generator) -> Concealed:
    effect = EFFECTS[plan.effects[k]]
    if k > 0 and plan.group == "messy":
        strength = float(rng.uniform(*MINOR_STRENGTH))
    elif k == 0 and plan.strength is not None:
        strength = plan.strength
    else:
        weakest = LEAST_STRENGTH.get(plan.group, STRENGTH[0])
        strength = float(np.exp(rng.uniform(np.log(weakest), np.log(STRENGTH[1]))))
    return Concealed(
        effect=effect, places=effect.places(plant, rng), parameters=effect.draw(plant, rng, strength), strength=strength
    )


def _individual(plant: Plant, plan: Plan, rng: np.random.Generator) -> Individual:
    gearbox = plant.gearbox
    factors = {}
    for name, start in gearbox.factors.items():
        z = float(np.clip(rng.standard_normal(), -2.0, 2.0)) * ORDINARY_SPREAD
        if plan.kind == "parameters_off":
            z = float(rng.uniform(1.0, 2.0)) * (1.0 if rng.random() < 0.5 else -1.0)
        factors[name] = start * float(np.exp(z * factor_sd(gearbox, name)))
    if plan.kind == "parameter_far":
        name, side = FAR_FACTORS[int(rng.integers(len(FAR_FACTORS)))]
        factors[name] = gearbox.factors[name] * float(np.exp(side * FAR * factor_sd(gearbox, name)))
    return Individual(
        factors=factors,
        reading=int(rng.integers(len(READINGS))),
        **{name: float(rng.normal(*mean_and_sd)) for name, mean_and_sd in EXPONENTS.items()},
    )


def _run(plant: Plant, individual: Individual, programme: Programme, rng: np.random.Generator) -> PlantRun:
    rows = len(programme)
    air = ambient(rows, rng)
    restless = rng.choice(plant.anatomy.coarse, int(rng.integers(2, 4)), replace=False)
    random_heat = {
        str(place): ornstein_uhlenbeck(rows, rng, sd=rng.uniform(1.0, 2.0), tau_s=rng.uniform(600.0, 1800.0))
        for place in restless
    }
    inputs = {**programme.inputs, "T_ambient": air, "air_speed": np.full(rows, plant.gearbox.ambient.air_speed_m_s)}
    start = dict.fromkeys(plant.anatomy.nodes, float(air[0] + rng.normal(0.0, 0.5)))
    driven = replace(programme, inputs=inputs, random_heat=random_heat, start=start)
    return PlantRun(individual=individual, programme=driven)


def _instruments(plant: Plant, plan: Plan, rng: np.random.Generator) -> Instruments:
    channels = default_channels(plant)
    lag = SLOW_LAG_S if plan.kind == "lag_wrong" else (10.0, 20.0)
    noisy = plan.kind == "noise_misstated"
    # Half of all cases come with a data sheet, so that its presence reveals nothing.
    stated = plan.kind in ("noise_misstated", "lag_wrong") or rng.random() < 0.5
    return Instruments(
        channels=channels,
        lag_s={place: float(rng.uniform(*lag)) for place in channels},
        noise_K=float(rng.uniform(*NOISY_K)) if noisy else 0.2,
        input_offset={"T_ambient": float(rng.normal(0.0, 0.2))},
        input_gain={"torque": float(rng.normal(0.0, 0.008))},
        loss_gain=float(rng.normal(0.0, 0.015)),
        loss_offset_W=float(rng.normal(0.0, 1.5)),
        stated=DATA_SHEET if stated else None,
        dropouts=int(rng.integers(1, 6)) if rng.random() < 0.3 else 0,
    )
