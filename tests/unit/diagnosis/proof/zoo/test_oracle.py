"""The oracle's algebra against dense matrices, and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.proof.zoo.oracle import FLOOR_TAU_S, LOSS, OracleDesign, RecordingColumns, whitened
from models.base.types import Array

CHANNELS = ("oil", "housing", LOSS)
FLOOR = np.array([0.1, 0.1, 1.5])


def columns(rng: np.random.Generator, means: int, *, local: int = 4, plant: int = 3, tool: int = 5) -> RecordingColumns:
    shape = (len(CHANNELS), means)
    return RecordingColumns(
        channels=CHANNELS, rows=means, rows_per_mean=1, step_s=120.0,
        white=rng.uniform(0.02, 0.2, shape), local=rng.standard_normal((local, *shape)),
        plant=rng.standard_normal((plant, *shape)), tool=rng.standard_normal((tool, *shape)),
    )  # fmt: skip


def by_channel(x: Array) -> dict[str, Array]:
    return dict(zip(CHANNELS, x, strict=True))


def dense_noise(columns: RecordingColumns) -> Array:
    """Covariance of all means of a recording, without its shared unknowns."""
    k = columns.white.shape[1]
    apart = 120.0 * np.abs(np.subtract.outer(np.arange(k), np.arange(k)))
    colour = np.mean([np.exp(-apart / tau) for tau in FLOOR_TAU_S], axis=0)
    noise = np.zeros((3 * k, 3 * k))
    for i in range(3):
        noise[i * k : (i + 1) * k, i * k : (i + 1) * k] = np.diag(columns.white[i] ** 2) + FLOOR[i] ** 2 * colour
    local = columns.local.reshape(len(columns.local), -1)
    return np.asarray(noise + local.T @ local)


def test_equals_the_dense_quadratic_form() -> None:
    rng = np.random.default_rng(1)
    parts = [columns(rng, 30), columns(rng, 12, local=2)]
    x = [rng.standard_normal((3, 30)), rng.standard_normal((3, 12))]
    noise = np.zeros((126, 126))
    noise[:90, :90], noise[90:, 90:] = dense_noise(parts[0]), dense_noise(parts[1])
    plant, tool = (np.concatenate([getattr(p, kind).reshape(n, -1) for p in parts], axis=1)
                   for kind, n in (("plant", 3), ("tool", 5)))  # fmt: skip
    whole = np.concatenate([values.ravel() for values in x])
    nats = OracleDesign(parts).nats_of([by_channel(values) for values in x])
    assert nats.plant == pytest.approx(0.5 * whole @ np.linalg.solve(noise + plant.T @ plant, whole), rel=1e-9)
    both = noise + plant.T @ plant + tool.T @ tool
    assert nats.tool == pytest.approx(0.5 * whole @ np.linalg.solve(both, whole), rel=1e-9)
    assert 0.0 < nats.tool < nats.plant


def test_white_noise_alone_gives_the_sum_of_squares() -> None:
    rng = np.random.default_rng(2)
    values, white = rng.standard_normal((1, 2, 50)), rng.uniform(0.1, 1.0, (2, 50))
    found = whitened(values, white, np.zeros(2), 120.0)
    np.testing.assert_allclose(found, values / white, rtol=1e-14)


def test_an_effect_that_an_unknown_can_mimic_has_no_evidence() -> None:
    rng = np.random.default_rng(3)
    part = columns(rng, 40)
    x = rng.standard_normal((3, 40))
    free = OracleDesign([part]).nats_of([by_channel(x)])
    mimic = RecordingColumns(**{**vars(part), "tool": 1e4 * x[None]})
    nats = OracleDesign([mimic]).nats_of([by_channel(x)])
    assert nats.plant == pytest.approx(free.plant, rel=1e-12)
    assert nats.tool == pytest.approx(0.5e-8, rel=1e-2)  # what is left is the prior of the unknown: (1 / 1e4)^2 / 2


def test_means_leave_out_an_unfinished_one_and_a_silent_channel_is_zero() -> None:
    rng = np.random.default_rng(4)
    part = RecordingColumns(**{**vars(columns(rng, 10)), "rows": 123, "rows_per_mean": 12})
    x = rng.standard_normal(123)
    whole = OracleDesign([part]).nats_of([{"oil": x, "housing": np.zeros(123)}])
    assert OracleDesign([part]).nats_of([{"oil": np.concatenate([x[:120], [9.0, 9.0, 9.0]])}]) == whole
