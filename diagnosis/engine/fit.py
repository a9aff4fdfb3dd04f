"""The most probable values of the unknowns: Gauss-Newton in whitened residuals, over all pieces of all recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from diagnosis.engine.metric import Metric
from diagnosis.engine.point import Column, Machine, Point, Setting
from diagnosis.engine.unknown import Scope, Unknown, in_scope
from diagnosis.forward.grid import ErrorCourse, Piece
from diagnosis.forward.trajectory import ROUNDS, Trajectory, simulate
from diagnosis.forward.whitening import AS_ASSUMED, Noise, RandomHeat, Whitening
from models.base.errors import InputError
from models.base.types import Array
from models.simulation.thermal_network import ThermalNetwork

FIRST_ITERATIONS, ITERATIONS = 4, 8
SETTLED = 0.05  # of a prior standard deviation
LEAST_GAIN = 0.02  # of the objective
NEAR = 0.5  # of a prior sd: every other time, after so short a step, the columns are kept
FARTHEST_STEP = 3.0  # of the z in one iteration
SLOW_PATIENCE = 3  # times as many iterations where switches follow slow measurements: steps are small there
NOISE_ALONE = Metric()
NO_SOLUTION = (InputError, ArithmeticError, np.linalg.LinAlgError)  # what a simulation or fit raises that has none
Guess = Trajectory | Array | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiment:
    """Recordings to be explained by a machine.

    Attributes
    ----------
    noise : tuple of Noise
        One per piece
    starts : tuple of Array, shape (parts,)
        Best guess of the start temperatures of every piece, [degC]
    filters : tuple of Whitening or None
        Noise filters of an earlier fit of the same pieces; None: those of the point itself. Evidences count their
        determinants, so those of different filters can be compared
    starts_at : mapping of str to float
        Start of every recording on the time axis that they share, [s]
    hour : float or None
        Hour of the day (UTC) at which it begins; None: the recordings have no dates
    until : float
        End of the last one on it, held-out ones too, [s]
    session_of : mapping of str to str
        Test session of every recording; between sessions the unknowns may differ a little
    healthy : frozenset of str
        Recordings in which the effect that is looked for cannot act
    switched_off : frozenset of str
        Names of the only effects that cannot act in them; empty: none can
    metric : Metric
        In which residuals are judged; of whitened readings under `filters`
    random_heat : RandomHeat
        How much of it `noise` has
    most_deviation : float
        Largest one that a session may have from the others, in prior standard deviations
    """

    machine: Machine
    pieces: tuple[Piece, ...]
    unknowns: tuple[Unknown, ...]
    noise: tuple[Noise, ...]
    starts: tuple[Array, ...]
    filters: tuple[Whitening, ...] | None = None
    starts_at: Mapping[str, float] = field(default_factory=dict)
    hour: float | None = None
    until: float = 0.0
    session_of: Mapping[str, str] = field(default_factory=dict)
    healthy: frozenset[str] = frozenset()
    switched_off: frozenset[str] = frozenset()
    metric: Metric = NOISE_ALONE
    random_heat: RandomHeat = AS_ASSUMED
    most_deviation: float = np.inf

    @property
    def network(self) -> ThermalNetwork:
        """The network of the machine."""
        return self.machine.model.network

    @property
    def slow(self) -> bool:
        """True if the rows of any piece lie minutes apart."""
        return any(piece.slow for piece in self.pieces)

    @cached_property
    def sessions(self) -> tuple[tuple[int, ...], ...]:
        """Places of the pieces of every test session."""
        names = [self.session_of.get(piece.recording, "") for piece in self.pieces]
        return tuple(tuple(i for i, name in enumerate(names) if name == one) for one in dict.fromkeys(names))

    @property
    def baselines(self) -> list[int]:
        """Places of the pieces in which the effect that is looked for cannot act."""
        return [i for i, piece in enumerate(self.pieces) if piece.recording in self.healthy]

    @property
    def tested(self) -> list[int]:
        """Places of the other pieces."""
        return [i for i, piece in enumerate(self.pieces) if piece.recording not in self.healthy]

    def part(self, at: Sequence[int]) -> Experiment:
        """Some of the pieces, with all that belongs to them."""
        some = replace(
            self, pieces=tuple(self.pieces[i] for i in at), noise=tuple(self.noise[i] for i in at),
            starts=tuple(self.starts[i] for i in at),
            filters=None if self.filters is None else tuple(self.filters[i] for i in at),
        )  # fmt: skip
        metric = self.metric
        if not metric.columns:
            return some
        return replace(some, metric=replace(
            metric, sessions=some.sessions, columns=tuple(metric.columns[i] for i in at),
            courses=tuple(metric.courses[i] for i in at if metric.courses),
        ))  # fmt: skip

    def scope_of(self, effect: str, *, dated: bool = False) -> Scope:
        """Recordings in which an effect may act, those to be predicted too; None for all.

        Parameters
        ----------
        effect : str
            Name of a mechanism, or of another addition to the machine
        dated : bool
            True for what begins at a date: baselines are from before it, whatever is switched off in them
        """
        if not self.healthy or (self.switched_off and effect not in self.switched_off and not dated):
            return None
        return frozenset({*self.session_of, *(piece.recording for piece in self.pieces)}) - self.healthy

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest ``z``, each of shape (unknowns,)."""
        lower, upper = zip(*(unknown.bounds() for unknown in self.unknowns), strict=True)
        return np.array(lower), np.array(upper)

    def setting(self, index: int, z: Array) -> Setting:
        """Values with which a piece is simulated."""
        piece = self.pieces[index]
        setting = Setting.of(self.machine, piece)
        for unknown, value in zip(self.unknowns, z.tolist(), strict=True):
            if in_scope(unknown, piece.recording):
                unknown.act(setting, value)
        return setting

    def point(
        self, index: int, z: Array, guess: Guess = None, *, rounds: int = ROUNDS, error: ErrorCourse | None = None
    ) -> Point:
        """Simulate a piece.

        Parameters
        ----------
        z : Array, shape (unknowns,)
        guess
            See :func:`diagnosis.forward.trajectory.simulate`
        error : ErrorCourse or None
            Model error that is assumed

        Raises
        ------
        ArithmeticError
            If the temperatures leave all bounds.
        """
        setting, model = self.setting(index, z), self.machine.model
        known = guess if isinstance(guess, Trajectory) else None
        for _ in range(self.machine.passes if known is None else 1):
            piece = replace(setting.piece(self.pieces[index], known), error=error)
            known = simulate(model, piece, setting.values, self.starts[index], guess=guess, rounds=rounds,
                             settled_K=0.01)  # fmt: skip
            guess = known
        assert known is not None  # noqa: S101 - one pass at least
        return Point(setting=setting, trajectory=known, read=setting.read(known))

    def columns(self, point: Point, z: Array) -> Array:
        """Derivatives of the readings of a piece, shape (K + 1, channels, unknowns); 0 outside an unknown's scope."""
        recording = point.piece.recording
        return point.responses([
            unknown.column(point, value) if in_scope(unknown, recording) else Column()
            for unknown, value in zip(self.unknowns, z.tolist(), strict=True)
        ])  # fmt: skip

    def linearise_piece(
        self, index: int, z: Array, guess: Guess, *, rounds: int = 1, kept: Linear | None = None,
        error: ErrorCourse | None = None,
    ) -> Linear:  # fmt: skip
        """Simulate a piece and whiten its residual and columns; `kept`: with the columns of that linearisation.

        With model error that is assumed, the simulation is near the readings and everything is linearised there; the
        residual is that without it all the same.
        """
        point = self.point(index, z, guess, rounds=rounds, error=error)
        if kept is not None:
            residual = kept.filter(point.residual_without_error[:, :, None])[:, 0]
            return Linear(point=point, filter=kept.filter, residual=residual, columns=kept.columns)
        with np.errstate(over="ignore", invalid="ignore"):  # what has no value is refused
            columns = self.columns(point, z)
        if not np.isfinite(columns).all():
            raise ArithmeticError(
                f"the laws of {self.pieces[index].recording} have no derivative with these parameters"
            )
        if self.filters is None:
            whiten = Whitening(self.machine.model, point.trajectory, point.sensors, self.noise[index])
        else:
            whiten = self.filters[index]
        white = whiten(np.concatenate([point.residual_without_error[:, :, None], columns], axis=2))
        return Linear(point=point, filter=whiten, residual=white[:, 0], columns=white[:, 1:])

    def fit(
        self, z: Array | None = None, guesses: Sequence[Guess] | None = None, *, iterations: int = ITERATIONS,
        at: Linearised | None = None, held: Sequence[int] = (),
    ) -> Fit:  # fmt: skip
        """The most probable unknowns.

        Parameters
        ----------
        z : Array, shape (unknowns,), optional
            Where to start; by default the middles of the priors
        guesses : sequence, one per piece, optional
            Where to linearise first, see :func:`diagnosis.forward.trajectory.simulate`
        iterations : int
            At most
        at : Linearised, optional
            Where an earlier fit ended: at `z`, in the same metric
        held : sequence of int
            Places of unknowns that stay where they are, as numbers of a switch, which scans of a grid find

        Raises
        ------
        ArithmeticError
            If there is no solution where it should start.
        """
        lower, upper = self.bounds
        z = np.zeros(len(self.unknowns)) if z is None else np.clip(z, lower, upper)
        at = at or self.linearise(z, guesses)
        if self.filters is None:  # those of the start serve on the way, those of the end afterwards
            first = self.with_filters(at.parts).fit(z, at.trajectories, iterations=iterations, held=held)
            final = self._attempt(first.z, first.trajectories)
            return Fit(experiment=self, z=first.z, linearised=final or first.linearised)
        return self._gauss_newton(z, at, iterations, list(held))

    def _gauss_newton(self, z: Array, at: Linearised, iterations: int, held: list[int]) -> Fit:
        """Damped steps to the minimum of the objective, from `z` where `at` is linearised.

        After short steps the columns are kept, every other time: `fresh` is False then.
        """
        lower, upper = (bound.copy() for bound in self.bounds)
        lower[held] = upper[held] = z[held]
        objective, damping, settled, fresh = at.objective(z), 0.0, False, True
        for _ in range(iterations * (SLOW_PATIENCE if self.slow else 1)):
            step = at.step(z, damping, lower, upper)
            longest = float(np.max(np.abs(step), initial=0.0))
            step *= min(1.0, FARTHEST_STEP / max(longest, 1e-12))
            tried = np.clip(z + step, lower, upper)
            keep = fresh and longest < NEAR
            trial = self._attempt(tried, at.trajectories, at.parts if keep else None, self._errors(at, tried - z))
            reached = np.inf if trial is None else trial.objective(tried)
            if trial is not None and reached <= objective + 1e-6:
                gained, z, at, objective = objective - reached, tried, trial, reached
                damping, settled, fresh = 0.2 * damping, False, not keep
                if float(np.max(np.abs(step), initial=0.0)) < SETTLED or gained < LEAST_GAIN:
                    break
            elif not fresh:
                at, fresh = self._attempt(z, at.trajectories) or at, True
                objective = at.objective(z)
            else:
                # The trajectory may not have settled at these values yet, and look better than it is. Where switches
                # follow means over minutes it never settles to the last.
                again = None if settled or self.slow else self._attempt(z, at.trajectories)
                if again is not None:
                    at, objective = again, again.objective(z)
                settled, damping = True, max(4.0 * damping, 1.0)
                if damping > 1e3:
                    break
        if not fresh:
            at = self._attempt(z, at.trajectories) or at
        return Fit(experiment=self, z=z, linearised=at)

    def linearise(self, z: Array, guesses: Sequence[Guess] | None = None) -> Linearised:
        """Simulate all pieces and whiten residuals and columns.

        Raises
        ------
        ArithmeticError
            If the simulation has no solution.
        """
        at = self._attempt(z, guesses)
        if at is None:
            raise ArithmeticError("the simulation has no solution where the fit should start")
        return at

    def with_filters(self, parts: Sequence[Linear]) -> Experiment:
        """Experiment that is judged by the noise filters of a linearisation."""
        return replace(self, filters=tuple(part.filter for part in parts))

    def with_random_heat(self, times: RandomHeat) -> Experiment:
        """Experiment with other random heats than it has, without filters; `times` are factors on those assumed."""
        has = self.random_heat
        further = RandomHeat(parts=tuple((times.heats / has.heats).tolist()), wander=times.wander / has.wander,
                             time=times.time / has.time, draught=times.draught)  # fmt: skip
        noise = tuple(one.with_random_heat(further) for one in self.noise)
        return replace(self, noise=noise, random_heat=times, filters=None)

    def _errors(self, at: Linearised, step: Array) -> Sequence[ErrorCourse | None] | None:
        """The most probable model error in every piece after a step of the unknowns, if the metric has any."""
        if not self.metric.courses:
            return None
        found = self.metric.explained([part.residual - part.columns @ step for part in at.parts])
        shared = self.metric.shared
        return [courses.along(values[:shared]) for courses, values in zip(self.metric.courses, found, strict=True)]

    def _attempt(
        self, z: Array, guesses: Sequence[Guess] | None, kept: Sequence[Linear] | None = None,
        errors: Sequence[ErrorCourse | None] | None = None,
    ) -> Linearised | None:  # fmt: skip
        """All pieces linearised; None if the simulation has no solution."""
        try:
            if guesses is None:
                parts = [self.linearise_piece(i, z, None, rounds=ROUNDS) for i in range(len(self.pieces))]
            else:  # trajectory and unknowns settle together: one round per iteration
                errors = errors or [self._assumed(guess) for guess in guesses]
                parts = [self.linearise_piece(i, z, guess, kept=None if kept is None else kept[i], error=error)
                         for i, (guess, error) in enumerate(zip(guesses, errors, strict=True))]  # fmt: skip
            with np.errstate(over="raise"):  # a trial that overflows has no solution
                return Linearised.of(parts, self.metric)
        except NO_SOLUTION:
            return None

    def _assumed(self, guess: Guess) -> ErrorCourse | None:
        """Model error that a guess was simulated with, if the metric has any."""
        return guess.piece.error if isinstance(guess, Trajectory) and self.metric.columns else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """A piece linearised and whitened.

    Attributes
    ----------
    residual : Array, shape (M,)
        Without model error
    columns : Array, shape (M, unknowns)
    """

    point: Point
    filter: Whitening
    residual: Array
    columns: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Linearised:
    """All pieces linearised at one point.

    Attributes
    ----------
    products : Array, shape (1 + unknowns, 1 + unknowns)
        Inner products of residual and columns in the metric of the experiment
    """

    parts: tuple[Linear, ...]
    products: Array

    @classmethod
    def of(cls, parts: Sequence[Linear], metric: Metric) -> Linearised:
        """Inner products of linearised pieces."""
        columns = [np.column_stack([part.residual, part.columns]) for part in parts]
        return cls(parts=tuple(parts), products=metric.products(columns))

    @property
    def trajectories(self) -> list[Trajectory]:
        """Of every piece: where to linearise next."""
        return [part.point.trajectory for part in self.parts]

    def objective(self, z: Array) -> float:
        """Squared residuals and priors."""
        return float(self.products[0, 0] + z @ z)

    def step(self, z: Array, damping: float, lower: Array, upper: Array) -> Array:
        """The step to the minimum of the linearised objective; what it pushes out of its bounds stays where it is."""
        normal, right = self.products[1:, 1:] + np.eye(len(z)), self.products[1:, 0] - z
        normal += damping * np.diag(np.diag(normal))
        free = ~((z <= lower) & (right < 0.0)) & ~((z >= upper) & (right > 0.0))
        step = np.zeros(len(z))
        step[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        return step


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The most probable values of the unknowns of an experiment.

    Attributes
    ----------
    z : Array, shape (unknowns,)
    """

    experiment: Experiment
    z: Array
    linearised: Linearised

    @property
    def parts(self) -> tuple[Linear, ...]:
        """Every piece, linearised and whitened."""
        return self.linearised.parts

    @property
    def trajectories(self) -> list[Trajectory]:
        """Of every piece."""
        return self.linearised.trajectories

    @property
    def objective(self) -> float:
        """Squared residuals and priors."""
        return self.linearised.objective(self.z)

    def part(self, at: Sequence[int]) -> Fit:
        """The part of the fit that is about some pieces."""
        experiment = self.experiment.part(at)
        return Fit(experiment=experiment, z=self.z,
                   linearised=Linearised.of([self.parts[i] for i in at], experiment.metric))  # fmt: skip

    @cached_property
    def covariance(self) -> Array:
        """Of ``z``, from the curvature, shape (unknowns, unknowns)."""
        root = solve_triangular(self.root, np.eye(len(self.z)), lower=True)
        return np.asarray(root.T @ root)

    @cached_property
    def log_evidence(self) -> float:
        """Laplace approximation, determinants of noise and metric included, up to ``-M/2 ln 2 pi``."""
        determinants = sum(part.filter.log_determinant for part in self.parts)
        determinants += self.experiment.metric.log_determinant
        return -0.5 * (self.objective + determinants) - float(np.log(np.diag(self.root)).sum())

    def z_in(self, experiment: Experiment) -> Array:
        """Values of the first unknowns, which an experiment has too, in the priors that they have there."""
        both = zip(experiment.unknowns, self.experiment.unknowns, self.z.tolist(), strict=False)
        return np.array([there.z_of(own.value(z)) for there, own, z in both])

    @cached_property
    def root(self) -> Array:
        """Lower Cholesky factor of the curvature of half the objective, shape (unknowns, unknowns)."""
        return np.asarray(np.linalg.cholesky(np.eye(len(self.z)) + self.linearised.products[1:, 1:]))


def calibrate(
    experiment: Experiment, z: Array | None = None, guesses: Sequence[Guess] | None = None, held: Sequence[int] = ()
) -> Fit:
    """The unknowns from a start: a first fit chooses the noise filters, a second one is judged by them.

    Parameters
    ----------
    z, guesses, held
        See :meth:`Experiment.fit`

    Raises
    ------
    ArithmeticError
        If there is no solution where it should start.
    """
    first = experiment.fit(z, guesses, iterations=FIRST_ITERATIONS, held=held)
    return experiment.with_filters(first.parts).fit(first.z, first.trajectories, held=held)
