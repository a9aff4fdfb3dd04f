"""The truth of a case: concealed effects, their heat, and the kelvin that they cause."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagnosis.proof.cases.concealed_case import ConcealedCase
from diagnosis.proof.plant.cycles import HOLD, TRAIN, Programme
from diagnosis.proof.plant.effect import Concealed
from diagnosis.proof.plant.instruments import Instruments, record
from diagnosis.proof.plant.plant import Plant
from diagnosis.proof.plant.plant_run import PlantOutcome, factor_sd
from models.base.types import Array

SCHEMA = 1
SETS = (TRAIN, HOLD)
FAR_CONTROL = "parameter_far"


def truth_of(
    plant: Plant, case: ConcealedCase, by_twin: Mapping[tuple[int, ...], Sequence[PlantOutcome]]
) -> dict[str, Any]:
    """The truth of a case, ready for JSON.

    Parameters
    ----------
    by_twin : mapping of tuple of int to sequence of PlantOutcome
        Outcome of every recording by which effects act (see :func:`diagnosis.proof.cases.conceal.twins`)

    Returns
    -------
    dict
        ``K`` are differences of the true temperatures with and without (of the readings, for faults of measurement),
        ``heat_W`` the heat that an effect made in a place, for paths and factors the difference that it made to it
    """
    physics, all_of_them = case.physics, tuple(range(len(case.physics)))
    everything, without_any = by_twin[all_of_them], by_twin[()]
    names = [run.programme.name for run in case.runs]
    rows = {name: len(outcome.T) for name, outcome in zip(names, everything, strict=True)}
    facts = []
    for effect in case.effects:
        if effect in physics:
            k = physics.index(effect)
            twin = by_twin.get(tuple(i for i in all_of_them if i != k))
            K = None if twin is None else _kelvin(plant, case, everything, twin)
            triples = zip(names, everything, twin or without_any, strict=True)
            heat = facts_of_heat({name: _heat_of(effect, k, a, b) for name, a, b in triples}, rows)
            facts.append(_effect(effect, case) | {"K": K} | heat)
        else:
            facts.append(_effect(effect, case) | _measured(plant, case, everything, effect))
    instruments = case.instruments
    return {
        "schema": SCHEMA,
        "case": case.name,
        "seed": list(case.seed),
        "gearbox": plant.gearbox.hash,
        "group": case.plan.group,
        "control": case.plan.kind if case.plan.group == "control" else None,
        "effects": facts,
        "far_parameter": _farthest(plant, case) if case.plan.kind == FAR_CONTROL else None,
        "K_all": _kelvin(plant, case, everything, without_any),
        "base_parameters": {name: round(value, 5) for name, value in case.individual.factors.items()},
        "friction_reading": case.individual.reading,
        "noise": {
            **facts_of_noise(instruments, instruments.lag_s, [run.programme for run in case.runs]),
            "ambient_offset_K": round(instruments.input_offset["T_ambient"], 3),
            "torque_gain": round(instruments.input_gain["torque"], 5),
        },
    }


def facts_of_noise(
    instruments: Instruments, lag_s: Mapping[str, float], programmes: Sequence[Programme]
) -> dict[str, Any]:
    """Noise of a case of any kind of plant: of its instruments and of heat that no law describes."""
    return {
        "white_K": round(instruments.noise_K, 3),
        "quantum_K": instruments.quantum_K,
        "sensor_lag_s": {name: round(value, 2) for name, value in lag_s.items()},
        "loss_gain": round(instruments.loss_gain, 5),
        "loss_offset_W": round(instruments.loss_offset_W, 3),
        "stated": None if instruments.stated is None else dict(instruments.stated),
        "dropouts": instruments.dropouts,
        "random_heat": {
            p.name: {place: round(float(np.std(watts)), 2) for place, watts in p.random_heat.items()}
            for p in programmes
        },
    }


def _farthest(plant: Plant, case: ConcealedCase) -> str:
    """The parameter that is farthest from its nominal value, in standard deviations of its prior."""

    def distance(name: str) -> float:
        off = math.log(case.individual.factors[name] / plant.gearbox.factors[name])
        return abs(off) / factor_sd(plant.gearbox, name)

    return max(case.individual.factors, key=distance)


def _effect(effect: Concealed, case: ConcealedCase) -> dict[str, Any]:
    kind = effect.effect
    return {
        "name": kind.name,
        "catalogue": kind.name if kind.catalogue else None,
        "family": kind.family,
        "kind": kind.kind,
        "nodes": list(effect.places),
        "dominant": effect is case.effects[0],
        "law": kind.law,
        "strength": round(effect.strength, 4),
        "parameters": {name: round(float(value), 6) for name, value in effect.parameters.items()},
    }


def _at(plant: Plant, outcome: PlantOutcome, place: str) -> Array:
    return outcome.T[:, plant.anatomy.coarse.index(place)]


def joined(parts: Mapping[str, Mapping[str, Array]], kind: str) -> dict[str, Array]:
    """Values by name, those of all recordings of a set one after the other.

    Parameters
    ----------
    parts : mapping of recording to mapping of str to Array, shape (rows,)
    kind : str
        One of :data:`SETS`
    """
    members = [values for recording, values in parts.items() if recording.startswith(kind)]
    return {name: np.concatenate([values[name] for values in members]) for name in members[0]}


def sizes_of(changes: Mapping[str, Mapping[str, Array]]) -> dict[str, dict[str, dict[str, float]]]:
    """Sizes by set and name of changes by recording and name."""
    return {kind: {name: size_of(values) for name, values in joined(changes, kind).items()} for kind in SETS}


def size_of(values: Array) -> dict[str, float]:
    """Root mean square and greatest magnitude of what is not missing, rounded for the truth."""
    return {
        "rms": round(float(np.sqrt(np.nanmean(values**2))), 3),
        "max": round(float(np.nanmax(np.abs(values), initial=0.0)), 3),
    }


def size_of_heat(watts: Array) -> dict[str, float]:
    """Mean and greatest heat, rounded for the truth."""
    return {
        "mean": round(float(watts.mean()), 3),
        "max": round(float(watts[np.abs(watts).argmax()]), 3),
    }


def _kelvin(
    plant: Plant, case: ConcealedCase, with_it: Sequence[PlantOutcome], without: Sequence[PlantOutcome]
) -> dict[str, Any]:
    changes = {
        run.programme.name: {p: _at(plant, a, p) - _at(plant, b, p) for p in case.instruments.channels}
        for run, a, b in zip(case.runs, with_it, without, strict=True)
    }
    return sizes_of(changes)


def _heat_of(effect: Concealed, k: int, with_it: PlantOutcome, without: PlantOutcome) -> Mapping[str, Array]:
    """Heat that an effect made; where it acts on inputs of the losses, by what they lose more than without it."""
    if effect.effect.before is None:
        return with_it.heat[k]
    return {place: with_it.losses[place] - without.losses[place] for place in with_it.losses}


def facts_of_heat(heat: Mapping[str, Mapping[str, Array]], rows: Mapping[str, int]) -> dict[str, Any]:
    """Mean and greatest heat by place, and its mean magnitude over all places.

    Parameters
    ----------
    heat : mapping of recording to mapping of place to Array, shape (rows,)
        [W]
    rows : mapping of recording to int
    """
    places = dict.fromkeys(place for made in heat.values() for place in made)
    total = {name: sum(map(np.abs, made.values()), np.zeros(rows[name])) for name, made in heat.items()}
    sets = {kind: [name for name in heat if name.startswith(kind)] for kind in SETS}
    return {
        "heat_W": {
            kind: {p: size_of_heat(np.concatenate([heat[n].get(p, 0.0 * total[n]) for n in names])) for p in places}
            for kind, names in sets.items()
        },
        "heat_magnitude_W": {
            kind: round(float(np.concatenate([total[name] for name in names]).mean()), 3)
            for kind, names in sets.items()
        },
    }


def facts_of_fault(changes: Mapping[str, Mapping[str, Array]], channels: Sequence[str]) -> dict[str, Any]:
    """Facts of a fault of measurement, from its changes of the columns, without noise.

    Parameters
    ----------
    changes : mapping of recording to mapping of column to Array, shape (rows,)
    """
    shifts = {kind: {c: size_of(v) for c, v in joined(changes, kind).items() if np.any(v != 0.0)} for kind in SETS}
    nothing = {"rms": 0.0, "max": 0.0}
    K = {kind: {place: found.get(f"T_{place}_degC", nothing) for place in channels} for kind, found in shifts.items()}
    return {"K": K, "column_shift": shifts, "heat_W": {}}


def _measured(plant: Plant, case: ConcealedCase, outcomes: Sequence[PlantOutcome], effect: Concealed) -> dict[str, Any]:
    changes = {}
    for run, outcome in zip(case.runs, outcomes, strict=True):
        faulty, sound = (record(plant, run, outcome, case.instruments, faults, None) for faults in ((effect,), ()))
        changes[run.programme.name] = {column: faulty[column] - sound[column] for column in faulty}
    return facts_of_fault(changes, case.instruments.channels)
