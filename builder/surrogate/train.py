"""Training of a gearbox's surrogate: sample the full model, fit networks, report their errors on separate points."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from sklearn.model_selection import train_test_split

from builder.surrogate.doe import latin_hypercube, mixed_hypercube, random_points, sample_losses
from builder.surrogate.fit import fit_network, joined_network
from builder.surrogate.levenberg_marquardt import LevenbergMarquardtRegressor
from builder.surrogate.networks import OTHER_HIDDEN, PRESETS, NetworkSpec, Preset, above_floors, network_specs
from models.base.errors import InputError, did_you_mean
from models.base.parallel import run_parallel
from models.base.progress import Progress, silent
from models.base.types import Array
from models.losses.loss_model import LossModel
from models.portable.surrogate import Network, SurrogateLosses

if TYPE_CHECKING:
    from models.assembly.gearbox import Gearbox

TEST_SHARE = 0.1
VALIDATION_SHARE = 0.1
CORNER = 0.1  # the cold, slow, light corner: the lowest tenth of every input's range
LEAST_SAMPLES = 50
MARGIN = 0.03  # of an input's range
NO_LOSS_W = 1e-9  # a smaller loss is none: errors are not related to it


@dataclass(frozen=True)
class ErrorReport:
    """Errors of one loss component on random points, over the range and in its cold, slow, light corner.

    Attributes
    ----------
    component : str
    r_squared, corner_r_squared : float
        Eq. (11) of the paper, [-]
    median, percentile_95, corner_median, corner_percentile_95 : float
        Of the relative error, [-]
    """

    component: str
    r_squared: float
    median: float
    percentile_95: float
    corner_r_squared: float
    corner_median: float
    corner_percentile_95: float


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    """A trained surrogate and how good it is.

    Attributes
    ----------
    losses : SurrogateLosses
    report : tuple of ErrorReport
    preset : Preset
    seed : int
    definition_hash, gearbox : str
    seconds : float
        That the training took, [s]
    seconds_by_network : mapping of str to float
        That every network took, [s]; empty if it was trained in an earlier build
    origin : str
        In words, where the networks are from
    """

    losses: SurrogateLosses
    report: tuple[ErrorReport, ...]
    preset: Preset
    seed: int
    definition_hash: str
    gearbox: str
    seconds: float
    seconds_by_network: Mapping[str, float] = field(default_factory=dict)
    origin: str = "trained now"

    def report_of(self, network: str) -> tuple[ErrorReport, ...]:
        """Return the errors of the components that one network serves."""
        served = {name for use in self.losses.uses if use.network == network for name in use.components}
        return tuple(row for row in self.report if row.component in served)

    def as_dict(self) -> dict[str, Any]:
        """Return report and provenance as plain numbers and strings (JSON)."""
        return {
            "gearbox": self.gearbox,
            "definition_hash": self.definition_hash,
            "preset": self.preset.name,
            "samples_per_network": self.preset.samples,
            "judged_points": self.preset.judged,
            "seed": self.seed,
            "errors": [asdict(row) for row in self.report],
        }


def train_surrogate(
    gearbox: Gearbox,
    *,
    preset: str | Preset = "default",
    samples: int | None = None,
    seed: int = 0,
    jobs: int | None = 1,
    dask: str | None = None,
    progress: Progress = silent,
) -> TrainingResult:
    """Train the reduced loss model of a gearbox.

    Parameters
    ----------
    gearbox : Gearbox
    preset : str or Preset
        ``"default"``, or ``"paper"`` for the networks and bounds that the paper prints
    samples : int, optional
        Points per network, in place of the preset's
    seed : int
        On one machine the same seed gives the same networks to the last bit, for any `jobs`
    jobs : int or None
        Processes; None for one per core
    dask : str, optional
        Scheduler that evaluates the full model; the networks are trained here
    progress : callable
        Told what is being done

    Returns
    -------
    TrainingResult

    Raises
    ------
    InputError
        If the preset is not known, there are too few samples, or the scheduler cannot be reached.
    """
    begin = time.perf_counter()
    chosen = chosen_preset(preset, samples)
    domain = chosen.domain or above_floors(gearbox.training)
    model = gearbox.losses()
    viscosity = gearbox.viscosity_constants
    specs = network_specs(model, domain)

    tables = []
    for number, spec in enumerate(specs):
        progress(f"full model at {chosen.samples} points for each network", number, len(specs))
        points = _training_points(spec, chosen, viscosity, seed + number)
        tables.append((points, sample_losses(spec.losses, points, jobs=jobs, dask=dask)))

    training = f"training the networks {', '.join(spec.name for spec in specs)}"
    progress(training, 0, len(specs))
    items = [(spec, chosen, viscosity, *table, seed) for spec, table in zip(specs, tables, strict=True)]
    networks, seconds = zip(*run_parallel(_train, items, jobs=jobs, progress=partial(progress, training)), strict=True)
    losses = SurrogateLosses(
        components=model.components,
        temperature_nodes=model.temperature_nodes,
        networks=networks,
        uses=tuple(use for spec in specs for use in spec.uses),
        speed_bounds=domain.speed_rpm,
        torque_bounds=domain.torque_Nm,
        temperature_bounds=domain.temperature_degC,
        torque_driven=tuple(name for term in model.terms for name in term.torque_driven),
    )
    progress(f"judging on {chosen.judged} random points")
    return TrainingResult(
        losses=losses,
        report=judge(losses, model, count=chosen.judged, seed=seed),
        preset=chosen,
        seed=seed,
        definition_hash=gearbox.hash,
        gearbox=gearbox.name,
        seconds=time.perf_counter() - begin,
        seconds_by_network={spec.name: took for spec, took in zip(specs, seconds, strict=True)},
    )


def chosen_preset(preset: str | Preset, samples: int | None = None) -> Preset:
    """Return a preset, by its name or as it is, with another number of samples if one is given.

    Raises
    ------
    InputError
        If the preset is not known or there are too few samples.
    """
    if isinstance(preset, str):
        if preset not in PRESETS:
            raise InputError(f"there is no training preset {preset!r}{did_you_mean(preset, PRESETS)}")
        preset = PRESETS[preset]
    chosen = preset if samples is None else replace(preset, samples=samples)
    if chosen.samples < LEAST_SAMPLES:
        raise InputError(f"{chosen.samples} samples per network are too few; give at least {LEAST_SAMPLES}")
    return chosen


def judge(surrogate: SurrogateLosses, model: LossModel, *, count: int, seed: int) -> tuple[ErrorReport, ...]:
    """Compare surrogate and full model on random operating points, over the range of training and in its corner.

    Parameters
    ----------
    surrogate : SurrogateLosses
    model : LossModel
    count : int
        Points, over the range and again in the corner
    seed : int

    Returns
    -------
    tuple of ErrorReport
        One per component
    """
    temperatures = len(surrogate.temperature_nodes)
    bounds = [surrogate.speed_bounds, surrogate.torque_bounds, *[surrogate.temperature_bounds] * temperatures]
    low, high = (np.array(side) for side in zip(*bounds, strict=True))

    def errors(upper: Array, offset: int) -> tuple[Array, Array, Array]:
        x = random_points(count, low, upper, seed=seed + offset)
        y, y_hat = (losses.power(x[:, 0], x[:, 1], x[:, 2:]) for losses in (model, surrogate))
        relative = np.abs(y_hat - y) / np.maximum(y, NO_LOSS_W)
        return r_squared(y, y_hat), np.median(relative, axis=0), np.quantile(relative, 0.95, axis=0)

    columns = np.stack([*errors(high, 0), *errors(low + CORNER * (high - low), 1)], axis=-1)
    return tuple(ErrorReport(name, *map(float, row)) for name, row in zip(surrogate.components, columns, strict=True))


def r_squared(y: Array, y_hat: Array) -> Array:
    """Coefficient of determination, eq. (11) of the paper, of every column, shape (outputs,).

    Examples
    --------
    >>> r_squared(np.array([[1.0], [2.0], [3.0]]), np.array([[1.0], [2.0], [2.0]])).tolist()
    [0.5]
    """
    residual = ((y - y_hat) ** 2).sum(axis=0)
    total = ((y - y.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(1.0 - residual / np.maximum(total, len(y) * NO_LOSS_W**2))


def _training_points(spec: NetworkSpec, preset: Preset, viscosity: tuple[float, float], seed: int) -> Array:
    if not preset.transforms:
        return latin_hypercube(preset.samples, spec.lower, spec.upper, seed=seed)
    # Reaching a little beyond the bounds, no point of the range is an extrapolation. Not below the lowest speed and
    # load: there the full model changes its law.
    margin = MARGIN * (np.array(spec.upper) - np.array(spec.lower))
    lower = spec.lower - np.where([kind == "log" for kind in spec.dense], 0.0, margin)
    return mixed_hypercube(preset.samples, lower, spec.upper + margin, dense=spec.dense, viscosity=viscosity, seed=seed)


def _train(
    spec: NetworkSpec, preset: Preset, viscosity: tuple[float, float], points: Array, losses: Array, seed: int
) -> tuple[Network, float]:
    """Train a network; return it, and the time that this took, [s]."""
    begin = time.perf_counter()
    # Nobody reads the rest: errors are judged on other points. To train on all points would change every network.
    x, _, y, _ = train_test_split(points, losses, test_size=TEST_SHARE, random_state=seed)
    apart = all(role in preset.hidden for role in spec.roles)
    parts = [[column] for column in range(len(spec.outputs))] if apart else [list(range(len(spec.outputs)))]
    networks = []
    for columns in parts:
        outputs = [spec.outputs[column] for column in columns]
        powers = spec.powers[columns] if preset.transforms else None
        regressor = LevenbergMarquardtRegressor(
            preset.hidden.get(spec.roles[columns[0]] if apart else spec.kind, OTHER_HIDDEN),
            max_iter=preset.max_iter,
            starts=preset.starts,
            start_iterations=preset.start_iterations,
            validation_fraction=VALIDATION_SHARE / (1.0 - TEST_SHARE),
            patience=preset.patience,
            tolerance=preset.tolerance,
            random_state=seed,
        )
        networks.append(
            fit_network(regressor, x, y[:, columns], spec=spec, outputs=outputs, powers=powers, viscosity=viscosity)
        )
    return joined_network(networks), time.perf_counter() - begin
