from __future__ import annotations

import numpy as np
import pytest

from builder.surrogate.doe import random_points
from builder.surrogate.train import TrainingResult
from fmu_src.python.onnx_losses import OnnxLosses


@pytest.fixture
def both(fzg_training: TrainingResult):
    losses = fzg_training.losses
    single = OnnxLosses.from_dict(losses.to_dict())
    return losses, single.with_evaluators({network.name: network for network in losses.networks})


def test_single_points_equal_the_surrogate_inside_and_outside_its_range(both) -> None:
    losses, single = both
    low = np.array([-8000.0, -500.0, *([-40.0] * len(losses.temperature_nodes))])
    high = np.array([8000.0, 500.0, *([250.0] * len(losses.temperature_nodes))])
    for row in random_points(200, low, high, seed=0):
        expected = losses.power(row[0], row[1], row[2:])
        np.testing.assert_allclose(single.power(row[0], row[1], row[2:]), expected, rtol=1e-12)
        assert single.domain_distance(row[0], row[1], row[2:]) == losses.domain_distance(row[0], row[1], row[2:])


def test_same_point_again_and_another_one_after_it(both) -> None:
    losses, single = both
    T = np.full(len(losses.temperature_nodes), 60.0)
    first = single.power(1000.0, 100.0, T).copy()
    np.testing.assert_array_equal(single.power(1000.0, 100.0, T), first)
    T[0] += 10.0
    np.testing.assert_allclose(single.power(1000.0, 100.0, T), losses.power(1000.0, 100.0, T), rtol=1e-12)
