"""Readings of the sensors along a trajectory."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.engine.fit import Experiment
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import Sensors, readings


def test_sensors_read_nodes_and_the_total_loss(experiment: Experiment, model: NetworkOnGrid) -> None:
    point = experiment.point(0, np.zeros(len(experiment.unknowns)))
    nothing = np.zeros(len(point.sensors.channels))
    ideal = Sensors(channels=point.sensors.channels, lag=nothing, bias=nothing)
    read = readings(model, point.trajectory, ideal)
    oil = point.trajectory.T[:, list(model.parts).index("oil")]
    np.testing.assert_array_equal(read[:, 1], oil)
    assert read[:, 3].mean() == pytest.approx(point.balance.sources.sum(axis=-1).mean(), rel=0.01)
