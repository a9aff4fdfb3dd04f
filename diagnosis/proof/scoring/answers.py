"""Answers of a diagnosis as scoring reads them from ``diagnosis.json``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from diagnosis.proof.zoo.setting import What
from diagnosis.results.result import Verdict
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, OPEN_FORM

ALARMS = ("missing_physics", "sensor_fault", "unexplained")
MOST_TIED, LEAST_TIED = 3, 0.05  # names that a tie may hold; probability from which a rival belongs to it
CERTAIN = 0.9  # a claim
PARAMETER = "parameter"  # a parameter of the definition outside its prior


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One finding, with its rivals.

    Attributes
    ----------
    odds : mapping of (mechanism, parameter or empty) to float
        Probability of the finding and of its rivals, summed over the places of each mechanism
    tied : tuple of str
        Tie set: at most three names, the most probable first
    open_form, acts_like : bool
        True if it gives no name: a form found by regression; the catalogue's nearest name
    what : str
        Kind of thing that it reports as changed, see :class:`diagnosis.proof.zoo.setting.Changed`
    nodes : frozenset of str
        Nodes, channels or input of it, both ends of a link
    sign : int
        1: more, -1: less, 0: not given
    """

    mechanism: str
    place: str
    probability: float
    odds: Mapping[tuple[str, str], float]
    tied: tuple[str, ...]
    open_form: bool
    acts_like: bool
    what: What
    nodes: frozenset[str]
    sign: int
    heat_W: float

    @property
    def name(self) -> str:
        """Name of the catalogue that it gives, or empty."""
        return "" if self.open_form or self.acts_like else self.mechanism


@dataclass(frozen=True, kw_only=True)
class ReadAnswer:
    """Answer to one case.

    Attributes
    ----------
    verdict : str
        ``refused`` if the recordings were not accepted, ``failed`` if there is no answer
    node : str
        Most probable place, or empty
    holdout_K : (float, float)
        Held-out error calibrated and with the findings; NaN if unknown
    """

    verdict: str
    claims: tuple[Claim, ...] = ()
    node: str = ""
    holdout_K: tuple[float, float] = field(default=(math.nan, math.nan))

    @property
    def alarm(self) -> bool:
        """True if a fault is reported that no parameter explains."""
        return self.verdict in ALARMS

    @property
    def answered(self) -> bool:
        """True if there is a verdict."""
        return self.verdict not in ("failed", "refused")


def read_answer(result: Mapping[str, Any] | None, gearbox: Gearbox, *, otherwise: str = "failed") -> ReadAnswer:
    """Read the content of ``diagnosis.json``, whole or compact.

    Parameters
    ----------
    gearbox : Gearbox
        Definition that the diagnosis was given
    otherwise : str
        Verdict where there is no result
    """
    if result is None:
        return ReadAnswer(verdict=otherwise)
    errors = result.get("fit", {}).get("holdout") or {}
    after = [errors.get(f"rmse_{stage}_K") for stage in ("calibrated", "after")]
    location = max(result.get("location") or [{}], key=lambda place: place.get("probability") or 0.0)
    if result["verdict"] not in (*get_args(Verdict), "failed", "refused"):
        raise ValueError(f"there is no verdict {result['verdict']!r}")
    return ReadAnswer(
        verdict=result["verdict"],
        claims=tuple(_claim(finding, gearbox) for finding in result.get("findings") or []),
        node=str(location.get("node") or ""),
        holdout_K=(_number(after[0]), _number(after[1])),
    )


def _claim(finding: Mapping[str, Any], gearbox: Gearbox) -> Claim:
    name = finding["mechanism"]
    odds: dict[tuple[str, str], float] = {}
    for one in (finding, *(finding.get("confusable_with") or [])):
        key = (one["mechanism"], one.get("place") or "" if one["mechanism"] == PARAMETER else "")
        odds[key] = odds.get(key, 0.0) + _number(one.get("probability"), 0.0)
    rivals = [m for (m, _), p in sorted(odds.items(), key=lambda pair: -pair[1]) if m != name and p >= LEAST_TIED]
    parameters = finding.get("parameters") or []
    strength = _number(parameters[0].get("value"), 0.0) if parameters else 0.0
    if finding.get("kind") == PARAMETER:
        strength -= next((p.start for p in gearbox.network().parameters if p.name == finding.get("place")), strength)
    what = _what(finding, gearbox)
    return Claim(
        mechanism=name,
        place=finding.get("place") or "",
        probability=_number(finding.get("probability"), 0.0),
        odds=odds,
        tied=tuple(finding.get("tie_set") or (name, *dict.fromkeys(rivals)))[:MOST_TIED],
        open_form=finding.get("family") == OPEN_FORM,
        acts_like=bool(finding.get("acts_like")),
        what=what,
        nodes=_nodes(finding, gearbox),
        sign=(strength > 0.0) - (strength < 0.0),
        heat_W=_number((finding.get("heat_W") or {}).get("mean")),
    )


def _what(finding: Mapping[str, Any], gearbox: Gearbox) -> What:
    kind, name = finding.get("kind") or "", finding["mechanism"]
    known = CATALOGUE.get(name)
    if name == "clock_offset" or (known and known.form == "clock"):
        return "clock"
    if kind == "sensor":
        return "input" if known and known.kind == "signal" else "sensor"
    if kind in ("signal", "input"):
        return "input"
    if kind.startswith("link"):
        return "link"
    if kind == "loss_factor":
        return "loss"
    if kind == PARAMETER:
        network, place = gearbox.network(), finding.get("place") or ""
        if any(place in {s.name for s in link.conductance.free_symbols} for link in network.links):
            return "link"
        return "capacity" if place.startswith("C_") else "loss"
    is_loss = known.is_loss if known else finding.get("family") == OPEN_FORM and name.endswith("_loss")
    return "loss" if is_loss else "heat"


def _nodes(finding: Mapping[str, Any], gearbox: Gearbox) -> frozenset[str]:
    """Nodes, channels and inputs that a finding names: its node, and every node, group and loss in its place.

    A parameter names all nodes whose losses or links depend on it.
    """
    network = gearbox.network()
    if finding.get("kind") == PARAMETER:
        laws: list[tuple[Any, tuple[str, ...]]] = [(link.conductance, link.nodes) for link in network.links]
        laws += [(source.heat, (source.node,)) for source in network.sources]
        named = {
            node for law, nodes in laws if finding.get("place") in {s.name for s in law.free_symbols} for node in nodes
        }
        return frozenset(named | ({finding.get("node") or ""} - {""}))
    known = {name: {name} for name in (*network.node_names, *network.inputs)}
    known |= {name: set(members) for name, members in network.groups.items()}
    known |= {source.name: {source.node} for source in network.sources if source.name not in known}
    found = {finding.get("node") or ""} - {""}
    left = f"_{re.sub('[^A-Za-z0-9]', '_', finding.get('place') or '')}_"
    for name in sorted(known, key=len, reverse=True):  # housing_upper before housing
        if f"_{name}_" in left:
            found |= known[name]
            left = left.replace(f"_{name}_", "__")
    return frozenset(found)


def _number(value: Any, otherwise: float = math.nan) -> float:
    return float(value) if isinstance(value, int | float) else otherwise
