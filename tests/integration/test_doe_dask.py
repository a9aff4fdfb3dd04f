"""The full model sampled by a real dask cluster: worker processes, reached over TCP."""

from __future__ import annotations

import os

import numpy as np
import pytest

from builder.doe import latin_hypercube, sample_losses
from builder.networks import PRESETS, network_specs
from models.gearbox import load_gearbox

distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")


def test_a_cluster_gives_the_same_numbers_as_one_process():
    mesh = network_specs(load_gearbox("fzg").losses(), PRESETS["paper"].domain)[0]
    points = latin_hypercube(600, mesh.lower, mesh.upper, seed=0)

    def who(rows):
        return np.full((len(rows), 1), float(os.getpid()))

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, protocol="tcp", dashboard_address=None
    ) as cluster:
        assert cluster.scheduler_address.startswith("tcp://")
        from_cluster = sample_losses(mesh.losses, points, dask_address=cluster.scheduler_address)
        done_by = set(sample_losses(who, points, dask_address=cluster.scheduler_address).ravel())
    assert np.array_equal(from_cluster, sample_losses(mesh.losses, points))
    assert os.getpid() not in done_by
