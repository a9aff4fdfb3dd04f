"""The truth of a case as scoring reads it: from a plant of the own kind, of the zoo, or of somebody else."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from diagnosis.proof.zoo.setting import Changed, What
from models.base.errors import InputError, did_you_mean
from models.mechanisms import CATALOGUE

CONTROL, MESSY, OUTSIDE = "control", "messy", "outside"
NONE = "none"  # catalogue of an effect that is in none
MEASUREMENT = ("sensor", "input", "clock")
# Names that others gave to mechanisms of the catalogue.
ALIASES = {
    "load_churning": "churning_load", "cooling_air_degradation": "air_cooling_change", "external_fan": "fan_thermostat",
    "oil_heater": "heater_thermostat", "oil_level_loss": "oil_loss", "radiation": "radiation_error",
    "shaft_ends_air": "shaft_ends_to_air",
}  # fmt: skip
# Of truths that do not name what was changed: their sign where a positive strength means less, or neither.
LESS = ("oil_loss", "bearing_additive", "aeration", "air_cooling_change", "bearing_seat_contact", "torque_decay",
        "drying", "worn_film", "torque_offset", "torque_gain", "speed_gain", "ambient_probe_offset",
        "ambient_probe_heated")  # fmt: skip
NEITHER = ("oil_mist", "oil_housing_speed", "ambient_swing", "oil_added", "phase_change", "day_and_night_wall",
           "sensor_stuck", "swapped_channels", "melting wax in a hollow mounting block")  # fmt: skip
LESS_OF_OTHERS = ("radiation change",)
# Sources of the own plant and of others outside the catalogue whose heat is no mechanical loss.
NO_LOSS = ("limit_cycle_pump", "phase_change", "drying", "melting wax in a hollow mounting block")


@dataclass(frozen=True, kw_only=True)
class TrueEffect:
    """A concealed effect.

    Attributes
    ----------
    label : str
        Name for people
    name : str
        Mechanism of the catalogue, or empty
    heat_W : float
        Mean magnitude over the training recordings; NaN if unknown
    course : str
        ``always``, ``step``, ``ramp``, ``from_to`` ..., or empty
    nats : (float, float)
        Evidence that the recordings hold for it if only the plant's own parameters are unknown, and with the model
        error of a lumped model; NaN if unknown
    """

    label: str
    name: str
    changed: tuple[Changed, ...]
    heat_W: float = math.nan
    course: str = ""
    nats: tuple[float, float] = (math.nan, math.nan)

    @property
    def nodes(self) -> frozenset[str]:
        """All nominal nodes."""
        return frozenset(node for one in self.changed for node in one.nodes)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The truth of a case.

    Attributes
    ----------
    plant : str
        ``own``, ``zoo: <family>`` or ``stranger``
    group : str
        ``control``, ``single``, ``double``, ``messy``, ``outside``, ``sensor`` ...
    effects : tuple of TrueEffect
        That must be found; minor effects of messy cases are not among them
    verdicts : tuple of str
        That are right
    far : str
        Parameter that is far outside its prior, or empty
    machine : str
        Name of the nominal definition, or empty if it is that of the set
    channels : tuple of str
        Measured temperatures
    """

    plant: str
    group: str
    effects: tuple[TrueEffect, ...]
    verdicts: tuple[str, ...]
    far: str = ""
    machine: str = ""
    channels: tuple[str, ...] = ()

    def seen_with(self, channels: Sequence[str]) -> Truth:
        """Truth where only some temperatures are recorded: a fault of another sensor cannot be found."""
        kept = tuple(
            e for e in self.effects if not all(c.what == "sensor" and not {*c.nodes} & {*channels} for c in e.changed)
        )
        if kept == self.effects:
            return self
        return replace(self, effects=kept, group=self.group if kept else CONTROL, verdicts=_verdicts(kept, ""))

    def without_entry(self) -> Truth:
        """Truth where the entry of its mechanism is removed from the catalogue."""
        effects = tuple(replace(effect, name="") for effect in self.effects)
        return replace(self, group=OUTSIDE, effects=effects, verdicts=_verdicts(effects, ""))


def read_truths(path: Path) -> dict[str, Truth]:
    """Truths of a set by case.

    Parameters
    ----------
    path : Path
        Folder of ``<case>.json``, or a file with an object per case. If a file ``oracle.json`` lies next to the latter,
        the evidence that the recordings hold is read from it.

    Raises
    ------
    InputError
        If a file cannot be read or is no truth.
    """
    try:
        if path.is_dir():
            raw = {f.stem: json.loads(f.read_text(encoding="utf-8")) for f in sorted(path.glob("*.json"))}
            oracle: dict[str, Any] = {}
        else:
            raw = json.loads(path.read_text(encoding="utf-8"))
            evidence = path.with_name("oracle.json")
            oracle = json.loads(evidence.read_text(encoding="utf-8")) if evidence.exists() else {}
        if not raw:
            raise InputError("holds no truth (<case>.json)")
        return {case: truth_of(one, oracle.get(case, {})) for case, one in raw.items()}
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: is no truth of a set of cases ({error!r}); see docs/how_to/benchmark.md") from error


def truth_of(raw: Mapping[str, Any], oracle: Mapping[str, Any]) -> Truth:
    """The truth of one case.

    Parameters
    ----------
    raw : mapping
        As it was written with the recordings
    oracle : mapping
        Evidence by effect, of sets that keep it in a file apart
    """
    group = {"uncatalogued": OUTSIDE}.get(raw["group"], raw["group"])
    plant = f"zoo: {raw['family']}" if "family" in raw else "own" if "friction_reading" in raw else "stranger"
    kept = raw["effects"][:1] if group == MESSY else raw["effects"]
    effects = tuple(_effect(one, raw, oracle.get("effects", {})) for one in kept)
    far = raw.get("far_parameter") or ""
    return Truth(
        plant=plant,
        group=group,
        effects=effects,
        verdicts=tuple(raw.get("verdict_ok") or _verdicts(effects, far)),
        far=far,
        machine=raw.get("machine", ""),
        channels=tuple(raw.get("K_all", {}).get("train", {})),
    )


def _verdicts(effects: Sequence[TrueEffect], far: str) -> tuple[str, ...]:
    """Verdicts that are right; a wrong input may be in the recorder or in the machine."""
    if far:
        return ("parameter_error",)
    if not effects:
        return ("consistent", "parameter_error")
    what = {one.what for effect in effects for one in effect.changed}
    right = ["missing_physics"] if what - {"sensor", "clock"} else []
    right += ["sensor_fault"] if what <= {*MEASUREMENT} else []
    return (*right, *(["unexplained"] if not all(effect.name for effect in effects) else []))


def _effect(raw: Mapping[str, Any], case: Mapping[str, Any], oracle: Mapping[str, Any]) -> TrueEffect:
    if len(case["effects"]) == 1 and "changed" in case:  # of an injection
        raw = {"changed": case["changed"], **raw}
    changed = changed_of(raw)
    nats = raw.get("oracle") or (case.get("oracle") if len(case["effects"]) == 1 else None) or {}
    given = oracle.get(raw["name"], {}).get("nats", {})
    return TrueEffect(
        label=raw["name"],
        name=_mechanism(raw),
        changed=changed,
        heat_W=_heat(raw),
        course=next((one.get("course", "") for one in raw.get("changed", [])), ""),
        nats=(
            float(nats.get("D_plant_nats", given.get("plant|0.1|T", math.nan))),
            float(nats.get("D_tool_nats", given.get("lumped|0.1|T", math.nan))),
        ),
    )


def _mechanism(effect: Mapping[str, Any]) -> str:
    """Mechanism of the catalogue that an effect is, or empty."""
    given = effect.get("catalogue") or NONE
    name = ALIASES.get(given, given)
    if name != NONE and name not in CATALOGUE:
        hint = did_you_mean(name, [*CATALOGUE, NONE])
        raise InputError(f"effect {effect['name']!r}: its catalogue is {given!r}, which is no mechanism{hint}")
    return "" if name == NONE else name


def changed_of(effect: Mapping[str, Any]) -> tuple[Changed, ...]:
    """List what an effect changed: as its truth names it, else by kind, nodes, family and sign of its strength."""
    if "changed" in effect:
        # The truth of the zoo gives a fault of a recorded input the sign of the recorder's error.
        flip = -1 if effect.get("family") == "measurement" else 1
        return tuple(
            Changed(what="loss" if one["what"] == "heat" and one.get("is_loss") else one["what"], of=one["of"],
                    nodes=tuple(part for node in one["nodes"] for part in node.split("+")),
                    sign=one["sign"] * (flip if one["what"] == "input" else 1))
            for one in effect["changed"]
        )  # fmt: skip
    name = _mechanism(effect) or effect["name"]
    kind = effect["kind"]
    what: What
    if kind == "sensor":
        what = "clock" if name == "clock_offset" else "sensor"
    elif kind == "signal" or (name in CATALOGUE and CATALOGUE[name].kind == "signal"):
        what = "input"
    elif kind.startswith("link"):
        what = "link"
    elif kind == "loss_factor":
        what = "loss"
    else:
        known = CATALOGUE.get(name)
        lost = known.is_loss if known else effect["name"] not in NO_LOSS
        what = "loss" if lost or (known and known.kind == "loss_factor") else "heat"
    strength = next(iter(effect["parameters"].values()), 1.0)
    sign = 0 if name in NEITHER else int(math.copysign(1, strength))
    less = name in LESS or effect["name"] in LESS_OF_OTHERS
    nodes = tuple(node for node in effect["nodes"] if what == "link" or node != "air")
    return tuple(Changed(what=what, of=node, nodes=(node,), sign=-sign if less else sign) for node in nodes)


def _heat(effect: Mapping[str, Any]) -> float:
    if "heat_magnitude_W" in effect:
        return float(effect["heat_magnitude_W"]["train"])
    places = effect.get("heat_W", {}).get("train", {})
    return sum(abs(place["mean"]) for place in places.values()) if places else math.nan
