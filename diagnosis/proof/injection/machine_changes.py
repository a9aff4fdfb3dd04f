"""Changes of the machine: the difference of two runs of the calibrated model, with the change and without."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import sympy as sp

from diagnosis.proof.cases.time_course import TimeCourse
from diagnosis.proof.injection.calibrated_model import AMPLITUDE, SEEN, SIZE_AND_COURSE, CalibratedMachine, Differences
from diagnosis.proof.injection.trial import Trial, ladder
from models.base.types import Array
from models.formulas.extremes import Max, Min
from models.network.laws import symbol

FACTOR = (-0.6, 1.5)  # relative change of a loss, a heat source or a conductance
CAPACITY = (-0.5, 1.0)
HEAT_SHARE = (-0.3, 0.5)  # of the mean heat of all sources
PATH_SHARE = 0.5  # of that heat, which a new path carries at the mean temperature difference of its ends
LEAST_DIFFERENCE_K = 5.0
VALVE_OPENS_K = 5.0  # from closed to open
VALVE_QUANTILES = (0.5, 0.9)  # of the node's temperature; there the valve is open by a share that is drawn
RUNNING_QUANTILE = 95.0  # of the speed at which a heat that goes with the speed has its full size

APPROXIMATE = (
    "difference of two runs of the calibrated model, added to the readings: the laws of the model are evaluated at its "
    "temperatures, not at the machine's"
)
NO_CONTROL = "; a control of the machine that the recording does not show would have reacted to the change"
CONTROLLED = (
    "; the two-point control of {channel} ({low:.1f} to {high:.1f} degC) holds its temperature where the recording "
    "shows it at work: the heat is taken from {node}, without a limit of its power, and its cycles keep their times"
)
BY_VALVE = "; the injected valve follows the reading plus the change"


def loss_factor(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Loss or heat source times ``1 + size``."""
    source = next(s for s in model.nominal.sources if s.name == name)
    changed = model.prepared().with_loss_factor(name, SIZE_AND_COURSE)
    d = model.differences(changed, ladder(*FACTOR, rng), course)
    made = d.result.losses[name] if name in d.result.losses else d.result.extra_heat[name]
    heat = made[1:] * _share(model, d, course)
    return _trial(
        model, d, course, what="loss" if source.is_loss else "heat", of=name,
        nodes=(source.node,), unit="1", heat={source.node: heat},
    )  # fmt: skip


def link_factor(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Conductance times ``1 + size``."""
    link = next(k for k in model.nominal.links if k.name == name)
    changed = model.prepared().with_link_factor(name, SIZE_AND_COURSE)
    d = model.differences(changed, ladder(*FACTOR, rng), course)
    return _trial(
        model, d, course, what="link", of=name, nodes=link.nodes, unit="1",
        heat=_flow(model, d, name, _share(model, d, course)),
    )  # fmt: skip


def new_link(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """A further path of `size` [W/K] between two nodes."""
    a, b = name.split("-")
    changed = model.prepared().with_link(a, b, SIZE_AND_COURSE, name="injected")
    difference = np.mean(model.base.temperatures[a] - model.base.temperatures[b])
    cap = PATH_SHARE * model.heat_W / max(abs(float(difference)), LEAST_DIFFERENCE_K)
    d = model.differences(changed, ladder(0.0, cap, rng), course)
    return _trial(
        model, d, course, what="link", of=name, nodes=(a, b), unit="W/K",
        heat=_flow(model, d, "injected", 1.0),
    )  # fmt: skip


def thermostat(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """A cooler with a thermostat valve: a path of up to `size` [W/K] from a node to the surroundings.

    The valve opens over a few kelvin, by the temperature that the injected recording shows: measured plus changed.
    """
    node, boundary = name.split("-")
    T, seen = model.base.temperatures[node], model.seen(node)
    opens = float(np.quantile(T + seen, rng.uniform(*VALVE_QUANTILES))) - rng.uniform() * VALVE_OPENS_K
    network = model.prepared().with_input(SEEN, 0.0)
    opening = Min(Max((symbol(f"T_{node}") + symbol(SEEN) - opens) / VALVE_OPENS_K, 0.0), 1.0)
    changed = network.with_link(node, boundary, SIZE_AND_COURSE * opening, name="injected")
    difference = abs(float(np.mean(T - model.base.temperatures[boundary])))
    cap = 2.0 * PATH_SHARE * model.heat_W / max(difference, LEAST_DIFFERENCE_K)
    d = model.differences(changed, ladder(0.0, cap, rng), course, {SEEN: seen})
    return _trial(
        model, d, course, what="link", of=name, nodes=(node, boundary), unit="W/K",
        heat=_flow(model, d, "injected", 1.0), further_reason=BY_VALVE,
        facts={"opens_degC": round(opens, 2), "open_degC": round(opens + VALVE_OPENS_K, 2)},
    )  # fmt: skip


def heat(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Heat of `size` [W] into a node: steady, or going with the speed."""
    speed = model.cycle.inputs["speed"]
    full = float(np.percentile(np.abs(speed), RUNNING_QUANTILE))
    with_speed = bool(rng.integers(2)) and full > 0.0
    law = SIZE_AND_COURSE * (sp.Abs(symbol("speed")) / full if with_speed else 1.0)
    changed = model.prepared().with_source(name, law, name="injected")
    sizes = ladder(HEAT_SHARE[0] * model.heat_W, HEAT_SHARE[1] * model.heat_W, rng)
    d = model.differences(changed, sizes, course)
    return _trial(
        model, d, course, what="heat", of=name, nodes=(name,), unit="W",
        heat={name: d.result.extra_heat["injected"][1:]},
        facts={"law": f"size * |speed| / {full:.5g}" if with_speed else "size"},
    )  # fmt: skip


def capacity(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Heat capacity times ``1 + size``, from a date on."""
    network = model.prepared()
    factor = 1 + symbol(AMPLITUDE)
    nodes = tuple(
        replace(n, capacity=n.capacity * factor) if n.name == name and n.capacity is not None else n
        for n in network.nodes
    )
    d = model.differences(replace(network, nodes=nodes), ladder(*CAPACITY, rng), course)
    return _trial(model, d, course, what="capacity", of=name, nodes=(name,), unit="1", heat={})


def input_shift(
    model: CalibratedMachine, name: str, law: sp.Expr, sizes: Array, course: TimeCourse
) -> Mapping[str, Array]:  # fmt: skip
    """Return the change of the model's temperatures if an input were `law` times size more, (B, rows), [K]."""
    changed = model.prepared().with_signal_shift(name, SIZE_AND_COURSE * law)
    return _temperatures(model.differences(changed, sizes, course))


# ---------------------------------------------------------------------- runs


def _temperatures(d: Differences) -> dict[str, Array]:
    return {quantity[2:]: values for quantity, values in d.readings.items() if quantity.startswith("T_")}


def _trial(
    model: CalibratedMachine, d: Differences, course: TimeCourse, *, what: str, of: str, nodes: tuple[str, ...],
    unit: str, heat: Mapping[str, Array], facts: Mapping[str, object] | None = None, further_reason: str = "",
) -> Trial:  # fmt: skip
    known: dict[str, object] = {
        "calibration": {
            "misfit_K": {name: round(size, 3) for name, size in model.misfit_K.items()},
            "sensors_left_out": list(model.left_out),
        }
    }
    reason, control = APPROXIMATE, model.control
    if control is None:
        reason += NO_CONTROL
    else:
        reason += CONTROLLED.format(**vars(control))
        known["control"] = {
            "sensor": control.channel,
            "acts_at": control.acts_at,
            "levels_degC": [round(control.low, 2), round(control.high, 2)],
            "active_share": round(float(control.active.mean()), 3),
        }
    return Trial(
        what=what, of=of, nodes=nodes, course=course, sizes=d.sizes[1:], unit=unit, columns=d.readings,
        K=_temperatures(d), heat=heat, approximate=reason + further_reason, facts={**known, **(facts or {})},
    )  # fmt: skip


def _share(model: CalibratedMachine, d: Differences, course: TimeCourse) -> Array:
    """Share of a changed value that the change is, shape (B, blocks)."""
    change = d.sizes[1:, None] * course.share(model.cycle.time)[d.first :]
    return np.asarray(change / (1.0 + change))


def _flow(model: CalibratedMachine, d: Differences, name: str, share: Array | float) -> dict[str, Array]:
    """Return the heat that a path takes from its first end and brings to its second, (B, blocks), [W]."""
    link = next(k for k in d.network.links if k.name == name)
    law = link.conductance.xreplace({symbol(key): value for key, value in d.network.derived.items()})
    known: dict[str, object] = {"time": d.result.time, **d.result.inputs}
    known |= {f"T_{node}": T[1:] for node, T in d.result.temperatures.items()}
    known |= {p.name: model.parameters.get(p.name, p.start) for p in d.network.parameters}
    known[AMPLITUDE] = d.sizes[1:, None]
    names = sorted(s.name for s in law.free_symbols)
    conductance = sp.lambdify(names, law, "numpy")(*(known[key] for key in names))
    a, b = (d.result.temperatures[node][1:] for node in link.nodes)
    flow = conductance * (a - b) * share
    ends = zip(link.nodes, (-flow, flow), strict=True)
    return {node: heat for node, heat in ends if node not in d.network.boundaries}
