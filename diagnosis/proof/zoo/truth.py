"""The truth of a zoo case: concealed effects, their heat, the kelvin they cause, and the evidence for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagnosis.proof.cases.truth import SCHEMA, SETS, facts_of_fault, facts_of_heat, facts_of_noise, sizes_of
from diagnosis.proof.zoo.case import ZooCase
from diagnosis.proof.zoo.effects import ZooEffect
from diagnosis.proof.zoo.faults import Fault, spoiled
from diagnosis.proof.zoo.recorder import measure
from diagnosis.proof.zoo.setting import Changed
from diagnosis.proof.zoo.structure import ZooChange, ZooOutcome, ZooPlant
from models.base.types import Array

NO_NATS = {"D_plant_nats": None, "D_tool_nats": None}  # evidence where nothing is concealed


def truth_of(case: ZooCase, gearbox_hash: str, columns: Mapping[str, str]) -> dict[str, Any]:
    """The truth of a case, ready for JSON.

    Parameters
    ----------
    case : ZooCase
        With its runs
    gearbox_hash : str
        Of the nominal definition
    columns : mapping of str to str
        Column of every input

    Returns
    -------
    dict
        Keys as in the truth of a plant of the own kind. ``K`` of an effect compares the run with this effect alone
        (the noise-free readings, for faults of measurement) with the run without any. ``heat_W`` is by nominal node.
        ``changed`` lists everything that was changed, for the scorer; ``from_s`` and ``to_s`` count from the first row
        of ``recording`` and may lie beyond its end
    """
    facts = [_effect(case, k, columns) for k in range(len(case.effects))]
    instruments = case.instruments
    return {
        "schema": SCHEMA,
        "case": case.name,
        "seed": [case.plan.seed],
        "plant": "zoo",
        "family": case.plant.family,
        "machine": case.plan.machine,
        "gearbox": gearbox_hash,
        "group": case.plan.group,
        "control": case.plan.kind,
        "sensors": list(instruments.channels),
        "effects": facts,
        "changed": [one for fact in facts for one in fact["changed"]],
        "visible": case.visible,
        "oracle": {**(NO_NATS if case.nats is None else case.nats.facts), "distance_K": round(case.distance_K, 4)},
        "rejected_plants": case.rejected,
        "K_all": _kelvin(case, 0),
        "base_parameters": {name: float(f"{value:.6g}") for name, value in case.plant.parameters.items()},
        "sessions": {
            "deviation": case.session_deviation,
            "parameters": {
                recording: {name: float(f"{value:.6g}") for name, value in values.items()}
                for recording, values in case.sessions.items()
            },
        },
        "noise": {
            **facts_of_noise(instruments, {p.channel: p.lag_s for p in case.plant.probes}, case.programmes),
            "sensor_mix": {
                probe.channel: {name: round(weight, 4) for name, weight in probe.mix.items()}
                for probe in case.plant.probes
            },
            "input_gain": {name: round(value, 5) for name, value in instruments.input_gain.items()},
            "input_offset": {name: round(value, 3) for name, value in instruments.input_offset.items()},
            "clock_s": round(instruments.clock_s, 2),
        },
        "begins_h": {p.name: round(p.begins_h, 3) for p in case.programmes},
    }


def _effect(case: ZooCase, k: int, columns: Mapping[str, str]) -> dict[str, Any]:
    effect = case.effects[k]
    facts: dict[str, Any] = {
        "name": effect.name,
        "catalogue": effect.catalogue,
        "family": effect.family,
        "kind": effect.kind,
        "nodes": list(effect.nodes),
        "dominant": k == 0,
        "law": effect.law,
        "unit": effect.unit,
        "strength": round(effect.strength, 6),
        "cap": round(effect.cap, 6),
        "parameters": {"a": round(effect.strength, 6)} | {n: round(v, 6) for n, v in effect.parameters.items()},
        "oracle": case.nats_of_effects[k].facts,
        "changed": [_changed(case, effect, one) for one in effect.changed],
    }
    if effect.fault is not None:
        facts["parameters"]["a"] = round(effect.fault.sign * effect.strength, 6)
        return facts | _measured(case, effect.fault, columns)
    run = 0 if len(case.effects) == 1 else 2 + k
    changes = [change for k in case.runs.sets[run] for change in case.effects[k].changes]
    outcomes = {p.name: case.runs.outcomes[p.name] for p in case.recordings(*SETS)}
    heat = {name: _heat_of(case.plant, outcome, run, case.runs.none, changes) for name, outcome in outcomes.items()}
    rows = {name: outcome.P_loss.shape[1] for name, outcome in outcomes.items()}
    return facts | {"K": _kelvin(case, run)} | facts_of_heat(heat, rows)


def _changed(case: ZooCase, effect: ZooEffect, changed: Changed) -> dict[str, Any]:
    """One thing that was changed, with its course in seconds of the recording in which it begins."""
    course = effect.course
    facts: dict[str, Any] = {
        "what": changed.what,
        "of": changed.of,
        "nodes": list(changed.nodes),
        "sign": changed.sign,
        "is_loss": changed.is_loss,
        "course": course.kind,
        "from_s": None,
        "to_s": None,
        "recording": None,
    }
    to_h = course.ends
    if effect.fault is not None and effect.fault.kind == "stuck":
        facts["course"], to_h = "from_to", course.begins + effect.strength
    if course.kind == "always":
        return facts
    began = [p for p in case.recordings(*SETS) if p.begins_h <= course.begins]
    recording = max(began, key=lambda p: p.begins_h)
    facts |= {"recording": recording.name, "from_s": round(3600.0 * (course.begins - recording.begins_h), 1)}
    if np.isfinite(to_h):
        facts["to_s"] = round(3600.0 * (to_h - recording.begins_h), 1)
    return facts


def _kelvin(case: ZooCase, run: int) -> dict[str, Any]:
    """Difference of the readings, without faults of measurement, of a run and that without effects."""
    changes: dict[str, dict[str, Array]] = {}
    for p in case.recordings(*SETS):
        readings = case.runs.outcomes[p.name].readings
        changes[p.name] = {n: readings[n][run] - readings[n][case.runs.none] for n in case.instruments.channels}
    return sizes_of(changes)


def _heat_of(
    plant: ZooPlant, outcome: ZooOutcome, run: int, none: int, changes: Sequence[ZooChange]
) -> dict[str, Array]:
    """Heat by nominal node, [W]; of a changed input what the losses differ by, at the node ``losses``."""
    home = {body.name: body.part_of.split("+")[0] for body in plant.bodies}
    ends = {path.name: path.ends for path in plant.paths}
    spread = {source.name: source.spread for source in plant.sources}
    found: dict[str, Array] = {}
    for i, change in enumerate(changes):
        if change.kind == "input":
            found["losses"] = outcome.P_loss[run] - outcome.P_loss[none]
            continue
        if change.kind == "source":
            shares = dict(spread[change.target])
        elif change.kind in ("path", "bridge"):
            first, second = ends[change.target] if change.kind == "path" else (change.target, change.other)
            shares = {first: -1.0, second: 1.0}
        else:
            shares = {change.target: 1.0, change.other: -1.0}
        for body, share in shares.items():
            node = home.get(body, "")
            if node:
                found[node] = found.get(node, 0.0) + share * outcome.heat[run][i]
    return found


def _measured(case: ZooCase, fault: Fault, columns: Mapping[str, str]) -> dict[str, Any]:
    changes: dict[str, dict[str, Array]] = {}
    for p in case.recordings(*SETS):
        sound = measure(case.plant, p, case.runs.outcomes[p.name], case.runs.none)
        faulty = spoiled(sound, fault)
        changes[p.name] = {
            **{columns[name]: faulty.inputs[name] - sound.inputs[name] for name in sound.inputs},
            **{f"T_{name}_degC": faulty.readings[name] - sound.readings[name] for name in case.instruments.channels},
        }
    return facts_of_fault(changes, case.instruments.channels)
