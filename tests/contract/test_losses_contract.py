"""ONE suite over every loss and every named option: what any loss model must do, and that every number is read."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.assembly.gearbox import Gearbox, load_gearbox
from models.definition.bearing_section import Bearing
from models.definition.sections import Churning, Friction, Rolling, Seal, Section, Stage

FZG = load_gearbox("fzg")
OTHERS = {name: load_gearbox(name) for name in ("conveyor", "helical")}
EVERY_BEARING = range(len(FZG.bearing))
PLACES: dict[type[Section], list[str]] = {
    Stage: ["stage.0"],
    Friction: ["stage.0.friction"],
    Rolling: ["stage.0.rolling"],
    Churning: ["stage.0.churning"],
    Seal: [f"seal.{i}" for i in range(len(FZG.seal))],
    Bearing: [f"bearing.{i}" for i in EVERY_BEARING],
}
PRINTED = "Churning.model niemann_printed"
# With gears that push along the shafts, and the bearings that take it; those of the rig's file let the shafts move.
HELICAL: dict[str, Any] = {
    "stage.0.helix_angle_deg": 2.0,
    **{f"bearing.{i}.{key}": value for i in (0, 2) for key, value in (("designation", "NJ 406"), ("locating", True))},
}
TAPERS: dict[str, Any] = {f"bearing.{i}.designation": "30206" for i in EVERY_BEARING}
BALLS: dict[str, Any] = {f"bearing.{i}.designation": "6406" for i in EVERY_BEARING}
WRITTEN_OUT = "of_the_law"  # the rig's file names the roughness that this is
# Every choice that a definition offers and the rig's file does not make.
OPTIONS: dict[str, Mapping[str, Any]] = {
    "default": {},
    **{name: {} for name in OTHERS},
    "roelands": {"oil.pressure_viscosity": "roelands"},
    "ball bearings": BALLS,  # another type has other constants
    "taper bearings": TAPERS,
    **{
        f"{section.__name__}.{key} {choice}": {f"{place}.{key}": choice for place in places}
        for section, places in PLACES.items()
        for key, field in section.model_fields.items()
        if get_origin(field.annotation) is Literal and key != "type"
        for choice in get_args(field.annotation)
        if choice not in (FZG.leaves[f"{places[0]}.{key}"], WRITTEN_OUT)
    },
}


@cache
def gearbox_with(option: str) -> Gearbox:
    return OTHERS[option] if option in OTHERS else FZG.with_values(OPTIONS[option])


@cache
def losses_with(option: str) -> Any:
    return gearbox_with(option).losses()


def points(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signed speeds and torques over the training range, and temperatures far beyond it."""
    rng = np.random.default_rng(seed)
    n = np.exp(rng.uniform(np.log(1e-3), np.log(6500.0), count)) * rng.choice([-1.0, 1.0], count)
    torque = np.exp(rng.uniform(np.log(1e-3), np.log(350.0), count)) * rng.choice([-1.0, 1.0], count)
    return n, torque, rng.uniform(-60.0, 300.0, (count, 7))


@pytest.mark.parametrize("option", OPTIONS)
class TestEveryOption:
    def test_finite_and_not_negative(self, option: str) -> None:
        power = losses_with(option).power(*points(2000))
        assert np.all(np.isfinite(power))
        assert np.all(power >= 0.0)

    def test_plausible_size(self, option: str) -> None:
        """In the range of the paper's design of experiments no loss exceeds 1 % to 20 % of 350 N m at 6500 rpm."""
        rng = np.random.default_rng(1)
        n, torque = rng.uniform(50.0, 6500.0, 500), rng.uniform(1.0, 350.0, 500)
        losses = losses_with(option)
        power = losses.power(n, torque, rng.uniform(20.0, 120.0, (500, 7)))
        for name, largest in zip(losses.components, power.max(axis=0), strict=True):
            if option != PRINTED or name != "churning":
                assert 1.0 < largest < (4000.0 if name.startswith("mesh") else 1500.0)

    def test_symmetric_in_the_signs(self, option: str) -> None:
        n, torque, T = points(50)
        losses = losses_with(option)
        for signed in ((-n, torque), (n, -torque), (-n, -torque)):
            assert np.array_equal(losses.power(*signed, T), losses.power(n, torque, T))

    def test_scalar_is_array(self, option: str) -> None:
        n, torque, T = points(20)
        losses = losses_with(option)
        together = losses.power(n, torque, T)
        for i in range(20):
            assert losses.power(n[i], torque[i], T[i]) == pytest.approx(together[i], rel=1e-12, abs=1e-15)

    def test_broadcasts(self, option: str) -> None:
        losses = losses_with(option)
        n, torque, T = np.array([[100.0], [2000.0]]), np.array([1.0, 50.0, 300.0]), np.full((4, 1, 1, 7), 55.0)
        power = losses.power(n, torque, T)
        assert power.shape == (4, 2, 3, len(losses.components))
        assert power[3, 1, 2] == pytest.approx(losses.power(2000.0, 300.0, np.full(7, 55.0)), rel=1e-12)

    def test_nothing_is_lost_at_rest(self, option: str) -> None:
        _, torque, T = points(20)
        assert np.all(losses_with(option).power(0.0, torque, T) == 0.0)

    def test_goes_to_nothing_with_speed(self, option: str) -> None:
        n = np.geomspace(1e-9, 1.0, 40)
        power = losses_with(option).power(n, 100.0, np.full(7, 60.0))
        assert np.all(np.diff(power, axis=0) >= 0.0)
        assert np.all(power[0] <= 2e-9 * np.maximum(power[-1], 1e-9))

    def test_continuous_through_zero_torque_and_the_floors(self, option: str) -> None:
        losses, T = losses_with(option), np.full(7, 60.0)
        for n, torque in ((2000.0, 0.0), (2000.0, 1.0), (1.0, 50.0), (0.0, 50.0)):
            around = losses.power(n + np.array([-1e-7, 0.0, 1e-7]), torque + np.array([-1e-7, 0.0, 1e-7]), T)
            # skf_outlet and the film temperature end within 0.005 K of their root, not on it.
            assert np.ptp(around, axis=0) == pytest.approx(0.0, abs=1e-5 * float(around.max()) + 1e-6)


@settings(max_examples=150, deadline=None)
@given(
    n=st.floats(-7000.0, 7000.0),
    torque=st.floats(-400.0, 400.0),
    T=st.lists(st.floats(-60.0, 300.0), min_size=7, max_size=7),
    option=st.sampled_from(sorted(OPTIONS)),
)
def test_any_point_of_any_option(n: float, torque: float, T: list[float], option: str) -> None:
    """Finite, not negative, and a step of one part in 1e7 moves no loss by more than one in 1e3."""
    losses = losses_with(option)
    power = losses.power(n, torque, np.array(T))
    assert np.all(np.isfinite(power))
    assert np.all(power >= 0.0)
    near = losses.power(n * (1 + 1e-7) + 1e-9, torque * (1 + 1e-7) + 1e-9, np.array(T))
    assert near == pytest.approx(power, rel=1e-3, abs=1e-3)


# ---------------------------------------------------------------------------------------------- every number is read

SPEEDS, TORQUES = np.array([30.0, 1500.0, 5000.0]), np.array([0.0, 50.0, 300.0])


def outputs(gearbox: Gearbox) -> np.ndarray:
    """Losses at nine points and the warm-up of all nodes: what a parameter may move."""
    losses, network = gearbox.losses(), gearbox.network()
    n, torque = (a.ravel() for a in np.meshgrid(SPEEDS, TORQUES))
    T = np.column_stack([np.full(9, 45.0), np.full(9, 70.0), np.full(9, 65.0), *[np.full(9, 55.0)] * 4])
    steady = [steady_temperature(network, losses, n[4], torque[4])]
    capacities = [float(c) for c in network_capacities(network)]
    return np.concatenate([losses.power(n, torque, T).ravel(), *steady, capacities])


def steady_temperature(network: Any, losses: Any, n: float, torque: float) -> np.ndarray:
    result = network.steady_state(losses=losses, speed=n, torque=torque)
    return np.array([*result.temperatures.values()])


def network_capacities(network: Any) -> list[Any]:
    ones = {parameter.name: parameter.start for parameter in network.parameters}
    return [part.capacity.subs({s: ones[s.name] for s in part.capacity.free_symbols}) for part in network.parts]


# Which option makes a number count; all others count as the rig comes.
NEEDS: dict[str, Mapping[str, Any]] = {
    "oil.volume_l": {},
    "oil.gold.": {"oil.pressure_viscosity": "roelands"},
    "oil.schlenk_X_L": {"stage.0.friction.model": "schlenk"},
    "stage.0.churning.C_Sp": {"stage.0.churning.model": "mauz"},
    **{
        f"bearing.{i}.heat_dissipation_W_K": {f"bearing.{j}.temperature": "skf_outlet" for j in EVERY_BEARING}
        for i in EVERY_BEARING
    },
}
# Numbers that describe and do not compute.
DESCRIBE = {
    "schema": "version of the file",
    "training.": "range of the surrogate's training points",
}
# Numbers that cannot be moved alone, with the change that is valid.
TOGETHER: dict[str, Mapping[str, Any]] = {
    "housing.part.0.area_fraction": {"housing.part.0.area_fraction": 0.5, "housing.part.1.area_fraction": 0.5},
    "housing.part.1.area_fraction": {"housing.part.0.area_fraction": 0.4, "housing.part.1.area_fraction": 0.6},
    "stage.0.z.0": {"stage.0.z": (17, 24), "stage.0.profile_shift": (0.0, 0.0), "stage.0.center_distance_mm": 92.25},
    "stage.0.z.1": {"stage.0.z": (16, 25), "stage.0.profile_shift": (0.0, 0.0), "stage.0.center_distance_mm": 92.25},
    "stage.0.module_mm": {"stage.0.module_mm": 4.5 * 1.001, "stage.0.center_distance_mm": 91.5 * 1.001},
    "stage.0.helix_angle_deg": HELICAL | {"stage.0.helix_angle_deg": 1.0},
    "housing.foundation_conductance_W_K": {"housing.foundation_conductance_W_K": 3.0},
    **{
        f"bearing.{i}.load_share": {f"bearing.{i - i % 2}.load_share": 0.6, f"bearing.{i - i % 2 + 1}.load_share": 0.4}
        for i in EVERY_BEARING
    },
}
# What the rig's file leaves out, and switches.
OPTIONAL: list[Mapping[str, Any]] = [
    HELICAL | {"bearing.0.S1": 0.2},
    HELICAL | {"bearing.1.designation": "NJ 406", "bearing.0.locating": False, "bearing.1.locating": True},
    HELICAL | BALLS | {"bearing.2.S2": 100.0},
    HELICAL | TAPERS | {"bearing.2.Y": 1.7},
    HELICAL | BALLS | {"bearing.2.static_load_kN": 20.0},
    {"shaft.0.heat_capacity_J_K": 400.0},
    {"shaft.0.surface_to_air": True},
    {"shaft.0.surface_to_air": True, "shaft.0.length_in_air_mm": 50.0},
    {"bearing.0.oil_level_mm": 20.0},
    {"stage.0.tip_diameter_mm": (82.0, 118.0)},
    {"stage.0.tip_shortening": False},
    {"oil.specific_heat_J_kgK": 2100.0},
    {"oil.conductivity_W_mK": 0.14},
    {"oil.density_temperature_degC": 20.0},
    *({"housing.convection": name} for name in ("flat_plate", "iso_14179_free", "churchill_chu")),
    *(dict(changes) for name, changes in OPTIONS.items() if changes and name != PRINTED),
]


def leaves() -> list[str]:
    numbers = [
        path for path, value in FZG.leaves.items() if isinstance(value, int | float) and not isinstance(value, bool)
    ]
    return [path for path in numbers if not any(path.startswith(known) for known in DESCRIBE)]


def change_of(path: str) -> Mapping[str, Any]:
    if path in TOGETHER:
        return TOGETHER[path]
    return {path: FZG.leaves[path] * 1.002}


@cache
def base_outputs(needs: tuple[tuple[str, Any], ...]) -> np.ndarray:
    return outputs(FZG.with_values(dict(needs)))


@pytest.mark.parametrize("path", leaves())
def test_every_number_moves_something(path: str) -> None:
    needs = next((option for known, option in NEEDS.items() if path.startswith(known)), {})
    before = base_outputs(tuple(needs.items()))
    after = outputs(FZG.with_values({**needs, **change_of(path)}))
    assert np.abs(after / np.where(before == 0.0, 1.0, before) - (before != 0.0)).max() > 1e-7


@pytest.mark.parametrize(
    "changes", OPTIONAL, ids=lambda changes: next(iter(changes)) + f"={next(iter(changes.values()))}"
)
def test_every_option_moves_something(changes: Mapping[str, Any]) -> None:
    after = outputs(FZG.with_values(changes))
    assert np.abs(after - base_outputs(())).max() > 1e-3


def test_every_uncertain_number_is_among_them() -> None:
    """Whatever has a standard deviation may be calibrated, so it must be read."""
    uncertain = {path for path in FZG.priors if not path.startswith("factors.")}
    assert uncertain <= set(leaves())


@pytest.mark.parametrize("factor", FZG.factors)
def test_every_factor_moves_something(factor: str) -> None:
    network, losses = FZG.network(), FZG.losses()
    cycle = {"time_s": [0.0, 60.0, 300.0], "speed_rpm": [1000.0, 3000.0, 3000.0], "torque_Nm": [50.0, 100.0, 100.0]}
    base = network.simulate(cycle, losses=losses, initial=20.0)
    changed = network.simulate(cycle, losses=losses, initial=20.0, parameters={factor: 1.3})
    assert max(np.abs(changed.temperatures[n] - base.temperatures[n]).max() for n in network.node_names) > 1e-3
