"""Which uncertain numbers of the definition the final oil temperature of Table 6 hangs on (Morris)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from SALib.analyze import morris as morris_analyze
from SALib.sample import morris as morris_sample
from threadpoolctl import threadpool_limits

from builder.reproduce.figure import Curve, Figure, Plot
from builder.reproduce.item import Item, Table, Verdict
from builder.reproduce.steady import steady_oil
from builder.reproduce.study import OUTPUT_TORQUE, Study
from models.gearbox import Gearbox
from models.types import Array

LEVELS = 4
REACH = 2.0  # standard deviations to either side
SHOWN = 12
SMALLEST = 0.005  # K
# Heat capacities do nothing in a steady state; the others are read by models that the definition does not choose.
WITHOUT_EFFECT = ("factors.C_", "housing.density", "housing.specific_heat", "oil.volume", "oil.schlenk")
INPUTS = {"ambient.temperature_degC": "T_ambient", "ambient.air_speed_m_s": "air_speed"}
FACTOR = "factors."
UNITS = {
    "W m2K": "W/(m² K)",
    "W mK": "W/(m K)",
    "W K": "W/K",
    "J kgK": "J/(kg K)",
    "kg m3": "kg/m³",
    "Pa per K": "Pa/K",
    "per K": "1/K",
    "1 K": "1/K",
    "m2": "m²",
    "m s": "m/s",
    "degC": "°C",
    "um": "µm",
    "mm": "mm",
    "m": "m",
    "kg": "kg",
}


@dataclass(frozen=True)
class Group:
    """Numbers of the definition that move together: equal ones of several bearings, shafts or flanks."""

    name: str
    paths: tuple[str, ...]


def uncertain_groups(gearbox: Gearbox) -> tuple[Group, ...]:
    """Everything with a prior, numbered twins together.

    Examples
    --------
    >>> from models.gearbox import load_gearbox
    >>> [group.paths for group in uncertain_groups(load_gearbox("fzg")) if group.name == "bearing.mu_bl"]
    [('bearing.0.mu_bl', 'bearing.1.mu_bl', 'bearing.2.mu_bl', 'bearing.3.mu_bl')]
    """
    groups: dict[str, list[str]] = {}
    for path, sd in gearbox.priors.items():
        if sd > 0.0 and not path.startswith(WITHOUT_EFFECT):
            groups.setdefault(re.sub(r"\.\d+", "", path), []).append(path)
    return tuple(Group(name, tuple(paths)) for name, paths in groups.items())


def sensitivity(study: Study, progress: Callable[[str], None]) -> Item:
    """Morris study of the steady oil temperature at 20 m/s and the three torques of Table 6."""
    groups = uncertain_groups(study.gearbox)
    problem = {"num_vars": len(groups), "names": [g.name for g in groups], "bounds": [[-REACH, REACH]] * len(groups)}
    z = morris_sample.sample(problem, study.settings.trajectories, num_levels=LEVELS, seed=study.settings.seed)
    progress(f"sensitivity: {len(z)} variants of the definition")
    oil = final_oil(study, groups, z)
    indices = [
        morris_analyze.analyze(problem, z, oil[:, i], num_levels=LEVELS, seed=study.settings.seed)
        for i in range(len(OUTPUT_TORQUE))
    ]
    # An elementary effect is a change over the whole reach; told per standard deviation.
    per_sd = np.array([np.asarray(one["mu_star"], dtype=float) for one in indices]) / (2.0 * REACH)
    bent = np.array([np.asarray(one["sigma"], dtype=float) for one in indices]) / (2.0 * REACH)
    sign = np.sign([np.asarray(one["mu"], dtype=float) for one in indices])
    order = np.argsort(-per_sd.max(axis=0))[:SHOWN]
    order = order[np.argsort(-per_sd[1, order])]
    labels = tuple(_label(study, groups[i].name) for i in order)
    curves = tuple(
        Curve(
            label=f"T₂ = {torque:g} N m", kind="bars", x=per_sd[k, order], y=np.arange(float(len(order))), names=labels
        )
        for k, torque in enumerate(OUTPUT_TORQUE)
    )
    rows = tuple(
        (
            _label(study, groups[i].name),
            *(f"{_signed(sign[k, i], per_sd[k, i])} ({bent[k, i]:.2f})" for k in range(len(OUTPUT_TORQUE))),
        )
        for i in order
    )
    rest = per_sd[:, np.argsort(-per_sd.max(axis=0))[SHOWN:]]
    first = [_label(study, groups[int(np.argmax(row))].name) for row in per_sd]
    return Item(
        key="Sensitivity",
        title="What the final oil temperature hangs on",
        reading=(
            f"Morris' elementary effects (SALib), {study.settings.trajectories} trajectories over the {len(groups)}"
            f" groups of uncertain numbers of the definition, {REACH:g} standard deviations of their priors to either"
            " side; steady state at 20 m/s with the full model. Equal numbers of the bearings, the shafts and the"
            " flanks move together. Largest: "
        )
        + "; ".join(f"{name} at {torque:g} N m" for name, torque in zip(first, OUTPUT_TORQUE, strict=True))
        + ".",
        tables=(
            Table(
                title="Change of the oil temperature in K per standard deviation (spread of the effects)",
                header=("number of the definition", *(f"T₂ = {torque:g} N m" for torque in OUTPUT_TORQUE)),
                rows=rows,
                note=(
                    f"The other {rest.shape[1]} are below {rest.max(initial=0.0):.1f} K. A spread as large as the"
                    " effect tells of curvature or of interplay with others."
                ),
            ),
        ),
        figures=(
            Figure(
                name="sensitivity",
                title="What the final oil temperature hangs on",
                caption="Mean absolute elementary effect.",
                panels=(
                    Plot(
                        title="Effect on the oil at 20 m/s",
                        x_label="K per standard deviation",
                        y_label="",
                        curves=curves,
                    ),
                ),
            ),
        ),
        without_checks=Verdict.OURS,
    )


def final_oil(study: Study, groups: tuple[Group, ...], z: Array) -> Array:
    """Steady oil temperature of variants [degC], shape (variants, 3 torques); `z` in standard deviations."""
    varied = [_variant(study.gearbox, groups, row) for row in z]
    # Variants that share the definition and differ in factors or inputs only are solved at once.
    shared: dict[tuple[tuple[str, float], ...], list[int]] = {}
    for index, (definition, _, _) in enumerate(varied):
        shared.setdefault(tuple(definition.items()), []).append(index)
    parts = Parallel(n_jobs=study.settings.jobs)(
        delayed(_settled)(
            study.gearbox,
            dict(definition),
            [varied[i][1] for i in rows],
            [varied[i][2] for i in rows],
            float(study.pinion_speed[-1]),
            study.pinion_torque,
        )
        for definition, rows in shared.items()
    )
    oil = np.empty((len(z), len(OUTPUT_TORQUE)))
    for rows, part in zip(shared.values(), parts, strict=True):
        oil[rows] = part
    return oil


def _variant(
    gearbox: Gearbox, groups: tuple[Group, ...], z: Array
) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Values of the definition, factors of the network, and inputs of one variant."""
    definition, factors, inputs = {}, {}, {}
    for group, deviation in zip(groups, z.tolist(), strict=True):
        for path in group.paths:
            value, sd = float(gearbox.leaves[path]), gearbox.priors[path]
            if path.startswith(FACTOR):
                factors[path.removeprefix(FACTOR)] = value * float(np.exp(deviation * sd))
            elif path in INPUTS:
                inputs[INPUTS[path]] = value + deviation * sd
            else:
                definition[path] = max(value + deviation * sd, 0.0)
    return definition, factors, inputs


def _settled(
    gearbox: Gearbox,
    definition: Mapping[str, float],
    factors: list[dict[str, float]],
    inputs: list[dict[str, float]],
    speed: float,
    torque: Array,
) -> Array:
    """Oil temperature, shape (variants, torques)."""
    changed = gearbox.with_values(definition)
    network, losses = changed.network(), changed.losses()
    each = np.repeat(np.arange(len(factors)), len(torque))
    parameters, given = (
        {name: np.array([row[name] for row in rows])[each] for name in rows[0]} for rows in (factors, inputs)
    )
    with threadpool_limits(1):
        oil, _ = steady_oil(
            network,
            losses,
            speed=np.full(len(each), speed),
            torque=np.tile(torque, len(factors)),
            inputs=given,
            parameters=parameters,
        )
    return oil.reshape(len(factors), len(torque))


def _signed(sign: float, value: float) -> str:
    return f"{sign * value:+.2f}" if value >= SMALLEST else "0"


def _label(study: Study, name: str) -> str:
    """Path of the definition in words, its unit apart; a factor by what it stands for."""
    if name.startswith(FACTOR):
        texts = {p.name: p.description for p in study.network.parameters}
        return texts[name.removeprefix(FACTOR)]
    words = name.removeprefix("stage.").replace("_", " ").replace(".", ", ")
    for ending, unit in UNITS.items():
        if words.endswith(f" {ending}"):
            return f"{words.removesuffix(ending)}in {unit}"
    return words
