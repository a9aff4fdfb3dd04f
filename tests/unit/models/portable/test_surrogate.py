"""The surrogate: floors, symmetry, range of training, and agreement with the fitted estimators."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, MinMaxScaler, StandardScaler

from builder.surrogate.fit import fit_network, reduced_target
from builder.surrogate.levenberg_marquardt import LevenbergMarquardtRegressor
from builder.surrogate.networks import PRESETS, network_specs
from builder.surrogate.train import train_surrogate
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.portable.surrogate import SurrogateLosses, feature_matrix

SMALL = {
    "samples": 300,
    "judged": 50,
    "max_iter": 15,
    "starts": 1,
    "hidden": dict.fromkeys(("mesh", "no_load", "bearing"), (4, 3)),
}
NODES = 7
WARM = np.array([60.0, 70.0, 65.0, 62.0, 63.0, 61.0, 64.0])
speeds = st.floats(-8000.0, 8000.0)
torques = st.floats(-500.0, 500.0)
temperatures = st.lists(st.floats(-60.0, 300.0), min_size=NODES, max_size=NODES)


@pytest.fixture(scope="module", params=["default", "paper"])
def trained(request):
    return train_surrogate(load_gearbox("fzg"), preset=replace(PRESETS[request.param], **SMALL))


@pytest.fixture(scope="module")
def losses(trained):
    return trained.losses


def test_components_and_nodes_are_those_of_the_full_model(losses):
    full = load_gearbox("fzg").losses()
    assert losses.components == full.components
    assert losses.temperature_nodes == full.temperature_nodes


def test_each_component_depends_on_the_nodes_that_it_reads(losses):
    T = np.full(NODES, 60.0)
    before = losses.power(2000.0, 100.0, T)
    moved = [losses.power(2000.0, 100.0, T + 15.0 * (np.arange(NODES) == node)) != before for node in range(NODES)]
    changed = [{name for name, column in zip(losses.temperature_nodes, moved, strict=True) if column[index]}
               for index in range(len(losses.components))]  # fmt: skip
    assert changed == list(losses.reads)


@settings(max_examples=50)
@given(speed=speeds, torque=torques, T=temperatures)
def test_only_magnitudes_count_and_losses_are_finite_and_never_negative(losses, speed, torque, T):
    power = losses.power(speed, torque, T)
    assert power.shape == (len(losses.components),)
    assert np.isfinite(power).all()
    assert (power >= 0.0).all()
    assert np.array_equal(power, losses.power(-speed, torque, T))
    assert np.array_equal(power, losses.power(speed, -torque, T))


def test_standstill_has_no_loss_and_no_torque_no_sliding(losses):
    assert np.array_equal(losses.power(0.0, 100.0, WARM), np.zeros(9))
    at_rest, light = losses.power(1000.0, 0.0, WARM), losses.power(1000.0, 1.0, WARM)
    assert at_rest[0] == 0.0
    assert at_rest[1] == light[1] > 0.0  # rolling is kept


@given(share=st.floats(0.0, 1.0))
def test_linear_below_the_lowest_trained_speed_and_torque(losses, share):
    n, torque = losses.speed_bounds[0], losses.torque_bounds[0]
    np.testing.assert_allclose(
        losses.power(share * n, 100.0, WARM), share * losses.power(n, 100.0, WARM), rtol=1e-12, atol=1e-300
    )
    light, floor = losses.power(1000.0, share * torque, WARM), losses.power(1000.0, torque, WARM)
    np.testing.assert_allclose(light[0], share * floor[0], rtol=1e-12, atol=1e-300)
    assert np.array_equal(light[1:5], floor[1:5])


@pytest.mark.parametrize("axis", range(2 + NODES))
def test_in_proportion_beyond_the_bounds_and_continuous_there(losses, axis):
    bounds = [losses.speed_bounds, losses.torque_bounds, *[losses.temperature_bounds] * NODES]
    point = np.array([2000.0, 100.0, *WARM])
    low, high = bounds[axis]

    def at(value):
        moved = point.copy()
        moved[axis] = value
        return losses.power(moved[0], moved[1], moved[2:])

    share = np.ones(9)
    if axis == 0:
        share[:] = (high + 50.0) / high
    if axis == 1:
        share[[name in losses.torque_driven for name in losses.components]] = (high + 50.0) / high
    np.testing.assert_allclose(at(high + 50.0), share * at(high), rtol=1e-12)
    if axis >= 2:
        assert np.array_equal(at(low), at(low - 50.0))
    for edge in (low, high):
        np.testing.assert_allclose(at(edge * (1.0 + 1e-9)), at(edge * (1.0 - 1e-9)), rtol=1e-6, atol=1e-9)


def test_broadcasts_and_a_batch_is_its_points(losses):
    n, torque = np.array([0.0, 0.5, 300.0, 2000.0, 9000.0]), np.array([0.0, 0.3, 100.0, 350.0, 400.0])
    T = np.random.default_rng(0).uniform(-40.0, 220.0, (5, NODES))
    grid = losses.power(n[:, None], torque[None, :], T)
    assert grid.shape == (5, 5, 9)
    for i in range(5):
        for j in range(5):
            np.testing.assert_allclose(grid[i, j], losses.power(n[i], torque[j], T[j]), rtol=1e-12, atol=1e-12)
    assert losses.power(1000.0, 10.0, T).shape == (5, 9)


def test_block_diagonal_form_is_the_networks_one_by_one(losses):
    random = np.random.default_rng(1)
    n, torque, T = random.uniform(-7000, 7000, 60), random.uniform(-400, 400, 60), random.uniform(-60, 250, (60, NODES))
    separate = losses.with_evaluators({network.name: network for network in losses.networks})
    np.testing.assert_allclose(separate.power(n, torque, T), losses.power(n, torque, T), rtol=1e-10, atol=1e-9)
    assert separate.power(100.0, 10.0, WARM).shape == (9,)


@pytest.mark.parametrize("transforms", [True, False])
def test_plain_networks_are_what_scikit_learn_fits(transforms):
    gearbox = load_gearbox("fzg")
    viscosity = gearbox.viscosity_constants
    for spec in network_specs(gearbox.losses(), PRESETS["paper"].domain):
        rows = np.random.default_rng(2).uniform(spec.lower, spec.upper, (200, len(spec.lower)))
        losses, powers = spec.losses(rows), spec.powers if transforms else None
        regressor = LevenbergMarquardtRegressor((4, 3), max_iter=15, starts=1)
        features = {"features": spec.features(transforms=transforms), "viscosity": viscosity}
        scaler = StandardScaler() if transforms else MinMaxScaler(feature_range=(-1.0, 1.0))
        steps = make_pipeline(FunctionTransformer(feature_matrix, kw_args=features), scaler, clone(regressor))
        pipeline = TransformedTargetRegressor(steps, transformer=clone(scaler), check_inverse=False)
        fitted = pipeline.fit(rows, reduced_target(rows, losses, powers) if transforms else losses).predict(rows)
        if transforms:
            fitted = np.exp(fitted) * np.prod(rows[:, None] ** np.where(powers, powers, 0.0), axis=-1)
        network = fit_network(regressor, rows, losses, spec=spec, outputs=spec.outputs, powers=powers,
                              viscosity=viscosity)  # fmt: skip
        np.testing.assert_allclose(network(rows), np.maximum(fitted, 0.0), rtol=1e-9, atol=1e-9)


def test_round_trip_through_json(losses):
    again = SurrogateLosses.from_dict(json.loads(json.dumps(losses.to_dict())))
    point = (1234.0, 56.0, WARM)
    assert np.array_equal(again.power(*point), losses.power(*point))
    assert again.to_dict() == losses.to_dict()


@given(n=st.floats(0.0, 6500.0), torque=st.floats(0.0, 350.0), T=st.floats(20.0, 120.0), excess=st.floats(0.001, 2.0))
def test_domain_distance_is_the_largest_excess_over_the_range(losses, n, torque, T, excess):
    T = np.full(NODES, T)
    assert losses.domain_distance(n, torque, T) == 0.0
    assert losses.domain_distance(-n, -torque, T) == 0.0
    for column, (low, high) in enumerate((losses.speed_bounds, losses.torque_bounds)):
        point = [n, torque]
        point[column] = -(high + excess * (high - low))
        assert losses.domain_distance(*point, T) == pytest.approx(excess, rel=1e-9)
    low, high = losses.temperature_bounds
    cold = T.copy()
    cold[3] = low - excess * (high - low)
    cold[4] = high + 0.5 * excess * (high - low)
    assert losses.domain_distance(n, torque, cold) == pytest.approx(excess, rel=1e-9)
    assert losses.domain_distance([n, n], torque, np.stack([T, cold])).shape == (2,)


def test_a_surrogate_of_another_version_is_refused(losses):
    with pytest.raises(InputError, match="build it again"):
        SurrogateLosses.from_dict({**losses.to_dict(), "format": 99})
