"""Draw a case of the zoo: plant, what is concealed, its strength by the oracle, and instruments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.proof.cases.time_course import ALWAYS, TimeCourse
from diagnosis.proof.plant.cycles import BASELINE, HOLD, TRAIN
from diagnosis.proof.zoo.case import CONTROLS, NatsOf, ZooCase, ZooPlan, nats_of_case, run_case
from diagnosis.proof.zoo.distance import draw_plant
from diagnosis.proof.zoo.effects import Maker, ZooEffect
from diagnosis.proof.zoo.effects_dates import DATED_MAKERS, draw_course
from diagnosis.proof.zoo.effects_heat import HEAT_MAKERS
from diagnosis.proof.zoo.effects_losses import LOSS_MAKERS
from diagnosis.proof.zoo.effects_outside import OUTSIDE_MAKERS
from diagnosis.proof.zoo.families import find_family
from diagnosis.proof.zoo.faults import AMBIENT, INPUT_FAULTS, SENSOR_FAULTS, Fault, FaultMaker, input_of
from diagnosis.proof.zoo.oracle_columns import design_of
from diagnosis.proof.zoo.recorder import draw_instruments, with_slow_sensors
from diagnosis.proof.zoo.setting import EffectSetting, UnfitError, either, pick
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Variant
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError

CATALOGUE_MAKERS: Mapping[str, Maker] = {**LOSS_MAKERS, **HEAT_MAKERS}
FAULT_MAKERS: Mapping[str, FaultMaker] = {**SENSOR_FAULTS, **INPUT_FAULTS}
# Effects with a time of their own; a date would hide that.
AGEING = ("run_in_flanks", "run_in_seals", "oil_ageing", "oil_loss", "gear_wear", "bearing_damage", "torque_decay",
          "ambient_drift", "growing_insulation", "stiff_grease")  # fmt: skip
NATS = (3.0, 1000.0)  # D_tool / 2, log-uniform
DOMINANT_NATS, MINOR_NATS, MINORS = (30.0, 1000.0), (0.3, 5.0), (3, 5)
TRIAL = 0.05  # of the greatest strength, where the response is still linear
DEVIATIONS = (0.0, 0.01, 0.03)
FAR_SD = 1.5  # of a control with parameters far off, on top of the ordinary spread
MOST_TRIES = 200
DRIFT_K = 15.0  # greatest drift over a session


def draw_case(
    plan: ZooPlan, *, name: str = "case_001", baselines: int = 0, session_deviation: float | None = None
) -> ZooCase:
    """Draw a case and simulate its recordings.

    Parameters
    ----------
    name : str
        Of the case
    baselines : int
        Number of healthy recordings of the same plant
    session_deviation : float or None
        Standard deviation of the logarithm of every parameter between sessions; drawn if None

    Raises
    ------
    InputError
        If the family is not known, or the definition cannot be split.
    """
    drawn = draw_plant(find_family(plan.family), plan.machine, plan.seed, baselines=baselines)
    gearbox = load_gearbox(plan.machine)
    effects_rng, strength_rng, session_rng, instruments_rng = (
        np.random.default_rng([plan.seed, 7, k]) for k in range(4)
    )
    if plan.group == "control":
        plan = replace(plan, kind=plan.kind or str(effects_rng.choice(CONTROLS)))
    plant = drawn.plant
    if plan.kind == "parameters_off":
        off = {n: v * float(np.exp(FAR_SD * plant.spread[n] * either(session_rng))) for n, v in plant.parameters.items()
               if n in plant.spread}  # fmt: skip
        plant = replace(plant, parameters={**plant.parameters, **off})
    if plan.kind == "lag_wrong":
        plant = with_slow_sensors(plant, session_rng)
    instruments = draw_instruments(plant, plan.kind, has_loss=not gearbox.is_parametric, rng=instruments_rng)
    sd = float(session_rng.choice(DEVIATIONS)) if session_deviation is None else session_deviation
    spread = [n for n in plant.parameters if n in plant.spread]
    case = ZooCase(
        name=name, plan=plan, plant=plant, programmes=drawn.programmes, effects=(), instruments=instruments,
        session_deviation=sd,
        sessions={p.name: {n: plant.parameters[n] * float(np.exp(sd * session_rng.standard_normal())) for n in spread}
                  for p in drawn.programmes if p.name.startswith(BASELINE)},
        distance_K=drawn.distance_K, rejected=drawn.rejected,
    )  # fmt: skip
    if plan.group == "control":
        return replace(case, runs=run_case(case, TRAIN, HOLD, BASELINE))
    # The warmest of the training recordings shows the temperatures that effects set in at.
    warm = case.recordings(TRAIN)[-1]
    setting = EffectSetting(plant, case.programmes, simulate(plant, warm, [Variant()]), gearbox.network().groups)
    case = with_effects(case, draw_effects(plan.group, setting, effects_rng))
    nats_of = design_of(plant, drawn.programmes, instruments).nats_of
    case = with_effects(case, draw_strengths(case, nats_of, strength_rng))
    runs = run_case(case, TRAIN, HOLD, BASELINE)
    nats, of_effects = nats_of_case(case, runs, nats_of)
    return replace(case, runs=runs, nats=nats, nats_of_effects=of_effects)


def with_effects(case: ZooCase, effects: Sequence[ZooEffect]) -> ZooCase:
    """The case with effects, and its plant with what they bring along that it does not have yet."""
    plant = case.plant
    like: dict[str, str] = {}
    known = {body.name for body in plant.bodies} | {boundary.name for boundary in plant.boundaries}
    for parts in (effect.act.parts for effect in effects):
        if parts.names & known:
            continue
        plant = replace(
            plant,
            bodies=plant.bodies + parts.bodies,
            boundaries=plant.boundaries + parts.boundaries,
            paths=plant.paths + parts.paths,
        )
        like |= parts.like
    programmes = tuple(
        replace(p, start={**p.start, **{n: p.start[o] if o else float(p.inputs[AMBIENT][0]) for n, o in like.items()}})
        for p in case.programmes
    )
    return replace(case, plant=plant, programmes=programmes, effects=tuple(effects))


# ---------------------------------------------------------------------- effects


def draw_effects(group: str, setting: EffectSetting, rng: np.random.Generator) -> tuple[ZooEffect, ...]:
    """Effects of a group, still without strength."""
    kinds: tuple[str, ...]
    if group == "pair":
        kinds = ("single", str(rng.choice(("single", "date", "outside", "sensor"), p=(0.4, 0.2, 0.15, 0.25))))
    elif group == "messy":
        number = int(rng.integers(MINORS[0], MINORS[1] + 1))
        kinds = (str(rng.choice(("single", "date", "outside"), p=(0.6, 0.2, 0.2))),
                 *map(str, rng.choice(("single", "outside"), number)))  # fmt: skip
    else:
        kinds = (group,)
    chosen: list[ZooEffect] = []
    for _ in range(MOST_TRIES):
        try:
            effect = _draw_one(kinds[len(chosen)], setting, rng)
        except UnfitError:
            continue
        if not any(_clash(effect, other) for other in chosen):
            chosen.append(effect)
        if len(chosen) == len(kinds):
            return tuple(chosen)
    raise InputError(
        f"family '{setting.plant.family}' for {setting.plant.gearbox}: none of {MOST_TRIES} effects of the group "
        f"'{group}' fits this plant; draw another group or family for this machine"
    )


def _clash(one: ZooEffect, other: ZooEffect) -> bool:
    """True if two effects are of one name or bring parts of one name along."""
    return one.name == other.name or bool(one.act.parts.names & other.act.parts.names)


def _draw_one(kind: str, setting: EffectSetting, rng: np.random.Generator) -> ZooEffect:
    if kind == "sensor":
        name = str(rng.choice(list(FAULT_MAKERS)))
        return draw_fault(name, setting, rng, draw_course(setting, rng) if rng.random() < 0.4 else ALWAYS)
    course = ALWAYS
    makers: Mapping[str, Maker]
    if kind == "date":
        course = draw_course(setting, rng)
        makers = DATED_MAKERS if rng.random() < 0.6 else CATALOGUE_MAKERS
    else:
        makers = CATALOGUE_MAKERS if kind == "single" else OUTSIDE_MAKERS
    name = str(rng.choice(list(makers)))
    if course.kind != "always" and name in AGEING:
        raise UnfitError(name)
    return replace(makers[name](setting, rng), course=course)


def draw_fault(name: str, setting: EffectSetting, rng: np.random.Generator, course: TimeCourse) -> ZooEffect:
    """A fault of measurement by its name in :data:`FAULT_MAKERS`.

    Raises
    ------
    UnfitError
        If the plant has no such input, or too few sensors.
    """
    maker, plant = FAULT_MAKERS[name], setting.plant
    channels = [probe.channel for probe in plant.probes]
    cap, near, scale = maker.cap, "", 1.0
    chosen: tuple[str, ...] = (pick(channels, rng),)
    if name in INPUT_FAULTS:
        chosen = (input_of(name),)
        if chosen[0] not in plant.inputs:
            raise UnfitError(name)
        near = pick(channels, rng)
        scale = setting.reference["torque"] if name == "torque_offset" else 1.0
    elif maker.fault == "swapped":
        if len(channels) < 2:
            raise UnfitError(name)
        chosen = tuple(map(str, rng.choice(channels, 2, replace=False)))
    elif maker.fault == "clock":
        chosen = ("clock",)
    elif maker.fault == "drift":
        cap = min(cap, DRIFT_K / setting.span)
    if maker.fault == "lag":
        cap = max(cap, 3.0 * plant.row_s)
    if maker.fault == "stuck":
        course = TimeCourse(kind="step", begins=setting.date(rng, 0.1, 0.7))
    sign = either(rng) if maker.signed else 1
    nodes = tuple(channel for channel in chosen if channel in setting.nodes)
    fault = Fault(
        kind=maker.fault, channels=chosen, nodes=nodes, near=near, strength=scale * cap, sign=sign, course=course
    )
    return ZooEffect(
        name=name, catalogue=name if maker.in_catalogue else None, family="measurement",
        kind="signal" if name in INPUT_FAULTS else "sensor", law=maker.law, unit=maker.unit, least=scale * maker.least,
        cap=fault.strength, fault=fault, strength=fault.strength, course=course,
    )  # fmt: skip


def list_effects() -> list[list[str]]:
    """Name of every effect, whether it is a form of one of the catalogue, and what it is."""
    rows = [
        [name, "yes" if name in CATALOGUE_MAKERS else "no", str(maker.__doc__)]
        for name, maker in {**CATALOGUE_MAKERS, **OUTSIDE_MAKERS, **DATED_MAKERS}.items()
    ]
    faults = [[name, "yes" if maker.in_catalogue else "no", maker.law] for name, maker in FAULT_MAKERS.items()]
    return sorted(rows + faults)


# ---------------------------------------------------------------------- strengths


def draw_strengths(case: ZooCase, nats_of: NatsOf, rng: np.random.Generator) -> list[ZooEffect]:
    """Effects at strengths whose evidence is log-uniform, up to the ends of their physical ranges.

    The evidence grows with the square of the strength while the response is linear: it is computed at a small strength
    and scaled.
    """
    trial = replace(case, effects=tuple(e.with_strength(TRIAL * e.cap) for e in case.effects))
    _, found = nats_of_case(trial, run_case(trial, TRAIN), nats_of)
    chosen = []
    for k, (effect, nats) in enumerate(zip(trial.effects, found, strict=True)):
        low, high = NATS if case.plan.group != "messy" else DOMINANT_NATS if k == 0 else MINOR_NATS
        wanted = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        linear = effect.strength * np.sqrt(wanted / max(nats.tool, 1e-9))
        strength = np.clip(linear, effect.least, effect.cap)
        whole = effect.fault is not None and effect.fault.kind == "swapped"
        chosen.append(effect.with_strength(effect.cap if whole else float(strength)))
    return chosen
