"""Design of experiments: operating points for training and for judging, and their losses from the full model.

Points depend on their seed only, losses on the points only: the work is cut into the same blocks for one process,
several (``jobs``) or a Dask cluster (``dask``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from models.base.parallel import run_parallel
from models.base.types import Array
from models.portable.surrogate import Feature, feature_values

Losses = Callable[[Array], Array]
"""Input rows, shape (N, inputs), to losses, shape (N, outputs); must be picklable for several processes."""

BLOCK_ROWS = 256  # operating points per task, fixed: the blocks must not depend on the number of processes
EDGE = 0.03  # share of the dense points that is moved up to the lower edge
GRID = 4001  # support points of the inverse of a spacing


def latin_hypercube(count: int, lower: ArrayLike, upper: ArrayLike, *, seed: int) -> Array:
    """Latin hypercube [1]_, uniform between the bounds.

    Parameters
    ----------
    count : int
        Number of points
    lower, upper : ArrayLike, shape (inputs,)
        Bounds, each in its own unit
    seed : int

    Returns
    -------
    Array, shape (count, inputs)

    References
    ----------
    .. [1] M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245; section 4 of the paper.

    Examples
    --------
    >>> points = latin_hypercube(400, [50.0, 1.0], [6500.0, 350.0], seed=0)
    >>> sorted(((points[:, 1] - 1.0) / 349.0 * 400).astype(int)) == list(range(400))
    True
    """
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    return np.asarray(low + _unit_hypercube(count, len(low), seed) * (high - low))


def mixed_hypercube(
    count: int,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    dense: Sequence[Feature],
    viscosity: tuple[float, float],
    seed: int,
) -> Array:
    """Latin hypercube of equal parts: speed, load and temperatures are each uniform, or denser at the low end.

    Uniform points alone leave the slow, light, cold corner empty, where every cold start begins; dense points alone
    leave the largest losses thin. All combinations are equally frequent: slow and cold, fast and cold, fast and
    unloaded. Temperatures are dense together. Dense points reach a little below the lowest speed and load and are moved
    up to it, so that this edge, which everything below is held at, is well known.

    Parameters
    ----------
    count : int
        Number of points
    lower, upper : ArrayLike, shape (inputs,)
        Bounds, each in its own unit
    dense : sequence of Feature, shape (inputs,)
        In which feature the dense half is uniform: ``"log"`` for speeds and loads, ``"viscosity"`` for temperatures
    viscosity : (float, float)
        ASTM D341 constants m, n of the oil
    seed : int

    Returns
    -------
    Array, shape (count, inputs)
    """
    low_high = np.stack([np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)], axis=-1)
    unit = _unit_hypercube(count, len(low_high), seed)
    part = np.arange(count)
    switches = [column for column, kind in enumerate(dense) if kind == "log"]
    points = np.empty_like(unit)
    for column, (kind, (low, high)) in enumerate(zip(dense, low_high, strict=True)):
        switch = switches.index(column) if kind == "log" else len(switches)
        below = low * (low / high) ** EDGE if kind == "log" else low
        spaced = np.maximum(_place_in_range(kind, unit[:, column], below, high, viscosity), low)
        uniform = low + unit[:, column] * (high - low)
        points[:, column] = np.where(part >> switch & 1 == 0, spaced, uniform)
    return points


def random_points(count: int, lower: ArrayLike, upper: ArrayLike, *, seed: int) -> Array:
    """Independent, uniformly distributed points for judging, shape (count, inputs)."""
    low, high = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    return np.random.default_rng([seed, 1]).uniform(low, high, (count, len(low)))


def sample_losses(losses: Losses, points: Array, *, jobs: int | None = 1, dask: str | None = None) -> Array:
    """Losses at many points, in blocks that may be computed by several processes or machines.

    Parameters
    ----------
    losses : callable, (N, inputs) -> (N, outputs)
        For example one of :mod:`builder.surrogate.networks`; picklable
    points : Array, shape (N, inputs)
    jobs : int or None
        Processes on this machine; None for one per core
    dask : str, optional
        Address of a dask scheduler (``"tcp://host:8786"``) that does the work instead

    Returns
    -------
    Array, shape (N, outputs)
        Numbers do not depend on `jobs` and `dask`

    Raises
    ------
    InputError
        If dask is not installed or the scheduler cannot be reached.
    """
    blocks = [(points[start : start + BLOCK_ROWS],) for start in range(0, len(points), BLOCK_ROWS)]
    return np.concatenate(run_parallel(losses, blocks, jobs=jobs, dask=dask))


def _unit_hypercube(count: int, inputs: int, seed: int) -> Array:
    return np.asarray(qmc.LatinHypercube(inputs, rng=np.random.default_rng([seed, 0])).random(count))


def _place_in_range(kind: Feature, unit: Array, low: float, high: float, viscosity: tuple[float, float]) -> Array:
    """Points between the bounds that are uniform in a feature that is monotonous there."""
    grid = np.linspace(low, high, GRID) if kind != "log" else np.geomspace(low, high, GRID)
    value = feature_values(kind, grid, viscosity)
    share = (value - value[0]) / (value[-1] - value[0])
    return np.interp(unit, share, grid)
