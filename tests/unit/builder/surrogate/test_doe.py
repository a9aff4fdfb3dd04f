"""Sampling plans, and samples of the full model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from builder.surrogate.doe import BLOCK_ROWS, latin_hypercube, mixed_hypercube, random_points, sample_losses
from builder.surrogate.networks import PRESETS, network_specs
from models.assembly.gearbox import load_gearbox

LOWER, UPPER = [1.0, 1.0, -20.0], [6500.0, 350.0, 200.0]
MIXED = {"dense": ("log", "log", "viscosity"), "viscosity": (9.5468, 3.7520)}


@given(count=st.integers(1, 60), seed=st.integers(0, 50))
@settings(max_examples=30, deadline=None)
def test_latin_hypercube_fills_every_row_and_column_once(count, seed):
    points = latin_hypercube(count, LOWER, UPPER, seed=seed)
    cell = np.floor((points - LOWER) / np.subtract(UPPER, LOWER) * count)
    assert np.array_equal(np.sort(cell, axis=0), np.repeat(np.arange(count)[:, None], 3, axis=1))


@given(count=st.integers(1, 300), seed=st.integers(0, 50))
@settings(max_examples=30, deadline=None)
def test_mixed_points_stay_between_the_bounds(count, seed):
    points = mixed_hypercube(count, LOWER, UPPER, seed=seed, **MIXED)
    assert points.shape == (count, 3)
    assert (points >= np.array(LOWER) * (1.0 - 1e-12 * np.sign(LOWER))).all()
    assert (points <= np.array(UPPER) * (1.0 + 1e-12)).all()


def test_mixed_points_are_dense_at_slow_light_and_cold():
    points = mixed_hypercube(4000, LOWER, UPPER, seed=0, **MIXED)
    low = points < np.array(LOWER) + 0.1 * np.subtract(UPPER, LOWER)
    # half uniform (10 %); half uniform in the logarithm: ln(651)/ln(6500) = 74 %, ln(36)/ln(350) = 61 %,
    # and in ln(nu + 0.7): 21 % of its range lie between -20 and 2 degC
    ln_nu = np.log(10.0) * 10.0 ** (9.5468 - 3.7520 * np.log10(np.array([-20.0, 2.0, 200.0]) + 273.15))
    expected = [0.42, 0.36, 0.05 + 0.5 * (ln_nu[0] - ln_nu[1]) / (ln_nu[0] - ln_nu[2])]
    np.testing.assert_allclose(low.mean(axis=0), expected, atol=0.01)
    # speed, load and temperature are mixed independently
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert np.mean(low[:, one] & low[:, other]) == pytest.approx(expected[one] * expected[other], rel=0.15)
    # 3 % of the dense half were moved up to the edge
    assert np.mean(points[:, 1] == 1.0) == pytest.approx(0.015, abs=0.002)


@pytest.mark.parametrize(
    "plan", [latin_hypercube, random_points, lambda *a, seed: mixed_hypercube(*a, seed=seed, **MIXED)]
)
def test_points_depend_on_the_seed_only(plan):
    first, again, other = (plan(50, LOWER, UPPER, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_losses_do_not_depend_on_the_number_of_processes():
    gearbox = load_gearbox("fzg")
    specs = network_specs(gearbox.losses(), PRESETS["paper"].domain)
    for spec in specs:
        points = latin_hypercube(BLOCK_ROWS + 20, spec.lower, spec.upper, seed=0)
        alone = sample_losses(spec.losses, points, jobs=1)
        assert alone.shape == (len(points), len(spec.outputs))
        assert np.array_equal(alone, sample_losses(spec.losses, points, jobs=2))


def test_network_samples_are_the_full_model():
    """Each network learns what the full model gives for its components."""
    model = load_gearbox("fzg").losses()
    for spec in network_specs(model, PRESETS["paper"].domain):
        for use in spec.uses:
            operating = random_points(20, [50.0, 1.0] + [20.0] * 7, [6500.0, 350.0] + [120.0] * 7, seed=1)
            operating[:3, 0] = 1.0, 1.2, 1.5  # just above the full model's lowest speed, below it on the slow shaft
            names = ("speed", "torque", *model.temperature_nodes)
            rows = np.stack(
                [f * operating[:, names.index(s)] for s, f in zip(use.sources, use.factors, strict=True)], axis=1
            )
            full = model.power(operating[:, 0], operating[:, 1], operating[:, 2:])
            columns = [model.components.index(name) for name in use.components]
            np.testing.assert_allclose(spec.losses(rows), full[:, columns], rtol=1e-12)
            assert (rows[3:, 0] >= spec.lower[0]).all()
            assert (rows[3:, 0] <= spec.upper[0]).all()
