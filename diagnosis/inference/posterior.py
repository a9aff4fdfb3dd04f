"""The most probable explanation of recordings by one network: maximum a posteriori, with its Laplace evidence.

Gauss-Newton in the whitened residuals, over all pieces of all recordings together. Every iteration simulates each piece
once (:mod:`diagnosis.forward.trajectory`) and gets all derivatives from the same linearisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import TORQUE_STEP, Balance, NetworkOnGrid
from diagnosis.forward.observation import Sensors, delay_column, lag_column, reading_columns, readings, total_at_points
from diagnosis.forward.term_on_grid import TermOnGrid, moved_heat
from diagnosis.forward.trajectory import ROUNDS, Trajectory, parameter_heats, settled_balance, simulate
from diagnosis.inference.unknowns import Unknown, Unknowns, shifted
from diagnosis.inference.whitening import Noise, Whitening
from models.base.errors import InputError
from models.base.types import Array
from models.quantities.quantities import TOTAL_LOSS
from models.terms.term import Term

ITERATIONS = 8
SETTLED = 0.05  # of a prior standard deviation
PARAMETER_STEP = 0.02  # of its prior standard deviation, for derivatives
FARTHEST_STEP = 3.0  # of the z numbers in one iteration
PASSES = 3  # each leaves about a twentieth of what an input was off by
SLOW_PATIENCE = 3  # times as many iterations where switches follow slow measurements: steps are small there


@dataclass(frozen=True, kw_only=True, eq=False)
class Linearised:
    """One piece, linearised at some values of the unknowns.

    Attributes
    ----------
    trajectory : Trajectory
    sensors : Sensors
    residual : Array, shape (K + 1, channels)
        Measured minus read, [K] or [W]; NaN where nothing was measured
    columns : Array, shape (K + 1, channels, unknowns)
        Derivatives of the readings with respect to z
    whitening : Whitening
    white_residual : Array, shape (M,)
    white_columns : Array, shape (M, unknowns)
    faults : tuple of (TermOnGrid, Array)
        Faults of sensors, with the values of their parameters
    """

    trajectory: Trajectory
    sensors: Sensors
    residual: Array
    columns: Array
    whitening: Whitening
    white_residual: Array
    white_columns: Array
    faults: tuple[tuple[TermOnGrid, Array], ...] = ()

    def shown(self, changes: Array) -> Array:
        """What faulty sensors show of changes of the readings, shape (K + 1, channels, ...)."""
        for fault, values in self.faults:
            changes = fault.passed_on(self.trajectory, self.sensors, changes, values)
        return changes


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The most probable values of the unknowns.

    Attributes
    ----------
    unknowns : Unknowns
    z : Array, shape (unknowns,)
    covariance : Array, shape (unknowns, unknowns)
        Of z, from the curvature there
    log_evidence : float
        Laplace approximation; the constant of the noise is left out, so compare fits of the same data and noise only
    parts : tuple of Linearised
        Empty where they were left out
    courses : tuple of Array, shape (K + 1, parts)
        Temperatures of every piece where `parts` were left out
    """

    unknowns: Unknowns
    z: Array
    covariance: Array
    log_evidence: float
    parts: tuple[Linearised, ...]
    courses: tuple[Array, ...] = ()

    def without_parts(self) -> Fit:
        """The same without its linearisation, which is a hundred times larger; :meth:`Problem.at` brings it back."""
        return replace(self, parts=(), courses=tuple(part.trajectory.T for part in self.parts)) if self.parts else self

    @property
    def white_residual(self) -> Array:
        """Whitened residual of all pieces, shape (M,)."""
        return np.concatenate([part.white_residual for part in self.parts])

    @property
    def white_columns(self) -> Array:
        """Whitened derivatives of all pieces, shape (M, unknowns)."""
        return np.concatenate([part.white_columns for part in self.parts])


class Problem:
    """Recordings to be explained by a network.

    Parameters
    ----------
    model : NetworkOnGrid
    pieces : sequence of Piece
    unknowns : Unknowns
    noise : sequence of Noise
        One per piece
    starts : sequence of Array, shape (parts,)
        Best guess of the start temperatures of every piece, [degC]
    whitenings : sequence of Whitening, optional
        Filters of an earlier fit of the same pieces: with them the evidences of two fits can be compared
    terms : sequence of Term
        What shifts an input or distorts a reading; terms inside the network are in `model`
    floor : float
        Structural floor, in multiples of the random heats of `noise`
    """

    def __init__(
        self, model: NetworkOnGrid, pieces: Sequence[Piece], unknowns: Unknowns, noise: Sequence[Noise],
        starts: Sequence[Array], whitenings: Sequence[Whitening] | None = None, terms: Sequence[Term] = (),
        floor: float = 1.0,
    ) -> None:  # fmt: skip
        self.model, self.pieces, self.unknowns, self.noise, self.starts = model, pieces, unknowns, noise, starts
        self.whitenings, self.terms, self.floor = whitenings, tuple(terms), floor
        self._shifts = [TermOnGrid(model, term) for term in terms if term.kind == "signal"]
        self._distortions = [TermOnGrid(model, term) for term in terms if term.kind == "sensor"]
        self.inputs = model.laws.inputs

    @property
    def slow(self) -> bool:
        """Whether the rows of any piece lie minutes apart."""
        return any(piece.slow for piece in self.pieces)

    @property
    def passes(self) -> int:
        """How often a piece is simulated where no trajectory tells yet what its inputs follow."""
        return PASSES if any(shift.follows for shift in self._shifts) else 1

    def changed(self, **changes: Any) -> Problem:
        """The same problem with another `model`, `pieces`, `unknowns`, `terms` or `floor`."""
        names = ("model", "pieces", "unknowns", "noise", "starts", "whitenings", "terms", "floor")
        given: dict[str, Any] = {name: getattr(self, name) for name in names}
        return Problem(**(given | changes))

    def with_whitenings(self, whitenings: Sequence[Whitening]) -> Problem:
        """The same problem, judged by given filters."""
        return self.changed(whitenings=whitenings)

    def linearise(self, index: int, z: Array, guess: Trajectory | Array | None, *, rounds: int = 2) -> Linearised:
        """Simulate one piece at `z` and linearise there."""
        model = self.model
        trajectory = self._simulated(index, z, guess, rounds)
        piece = trajectory.piece
        sensors = self.unknowns.sensors(piece.channels, z)
        residual = piece.measured - self.read(trajectory, sensors, z)
        columns = self._columns(trajectory, sensors, z)
        if not np.isfinite(columns).all():
            raise ArithmeticError(f"the laws of {piece.recording} have no derivative with these parameters")
        if self.whitenings is None:
            whitening = Whitening(model, trajectory, sensors, self.noise[index].with_floor(self.floor))
        else:
            whitening = self.whitenings[index]
        white = whitening(np.concatenate([residual[:, :, None], columns], axis=2))
        return Linearised(
            trajectory=trajectory, sensors=sensors, residual=residual, columns=columns, whitening=whitening,
            white_residual=white[:, 0], white_columns=white[:, 1:],
            faults=tuple((d, self._own(d, z)) for d in self._distortions),
        )  # fmt: skip

    def _simulated(self, index: int, z: Array, guess: Trajectory | Array | None, rounds: int) -> Trajectory:
        """One piece at `z`; again where an input follows temperatures that no trajectory told yet."""
        values = self.unknowns.network_values(self.model.network, z)
        known = guess if isinstance(guess, Trajectory) else None
        for _ in range(self.passes if known is None else 1):
            piece = self.adjusted(index, z, known)
            known = simulate(self.model, piece, values, self.starts[index], guess=guess, rounds=rounds, settled_K=0.01)
            guess = known
        assert known is not None  # noqa: S101 - one pass at least
        return known

    def _own(self, term: TermOnGrid, z: Array) -> Array:
        return self.unknowns.term_values([p.name for p in term.term.parameters], z)

    def adjusted(self, index: int, z: Array, trajectory: Trajectory | None) -> Piece:
        """A piece with its inputs as they probably were."""
        piece = self.unknowns.adjusted(self.pieces[index], self.inputs, z)
        for shift in self._shifts:
            piece = shift.adjusted(piece, self._own(shift, z), trajectory)
        late = [d.constant(self._own(d, z)) for d in self._distortions if d.term.form == "clock"]
        return replace(piece, late_s=sum(late)) if late else piece

    def read(self, trajectory: Trajectory, sensors: Sensors, z: Array) -> Array:
        """What the sensors read, faults included, shape (K + 1, channels)."""
        read = readings(self.model, trajectory, sensors)
        for distortion in self._distortions:
            read = distortion.distorted(trajectory, sensors, read, self._own(distortion, z))
        return read

    def _columns(self, trajectory: Trajectory, sensors: Sensors, z: Array) -> Array:
        """Derivatives of the readings with respect to z, shape (K + 1, channels, unknowns)."""
        model, items, piece = self.model, self.unknowns.items, trajectory.piece
        intervals = len(piece.steps)
        heats = np.zeros((intervals, model.n + len(model.coupled), len(items)))
        losses = np.zeros((intervals, len(items)))
        names = [p.name for p in model.network.parameters]
        here = settled_balance(model, trajectory)
        scales = np.array([item.per_z(float(value)) for item, value in zip(items, z, strict=True)])
        mine = [index for index, item in enumerate(items) if item.role == "network"]
        heats[:, :, mine], losses[:, mine] = parameter_heats(
            model, trajectory, here, [names.index(items[i].target) for i in mine], PARAMETER_STEP * scales[mine]
        )
        heats[:, :, mine] *= scales[mine]
        losses[:, mine] *= scales[mine]
        for index, item in enumerate(items):
            scale = scales[index]
            if item.role in ("torque_gain", "ambient_offset"):
                heat, loss = self._input_heat(trajectory, here, item)
            elif item.role == "term" and (shift := self._term_of(self._shifts, item)) is not None:
                heat, loss = self._shift_heat(trajectory, shift, item, z)
            else:
                continue
            heats[:, : heat.shape[1], index], losses[:, index] = heat * scale, loss * scale
        columns = reading_columns(model, trajectory, sensors, trajectory.response(heats), losses)
        self._add_sensors(columns, trajectory, sensors, z)
        for distortion in self._distortions:
            columns = distortion.passed_on(trajectory, sensors, columns, self._own(distortion, z))
        for index, item in enumerate(items):
            if item.role == "term" and (fault := self._term_of(self._distortions, item)) is not None:
                columns[:, :, index] += self._distortion(trajectory, sensors, fault, item, z) * scales[index]
        return columns

    def _add_sensors(self, columns: Array, trajectory: Trajectory, sensors: Sensors, z: Array) -> None:
        """The columns of what the network does not feel, faults apart."""
        model = self.model
        for index, item in enumerate(self.unknowns.items):
            scale = item.per_z(float(z[index]))
            if item.role == "bias":
                columns[:, sensors.channels.index(item.target), index] = scale
            elif item.role == "loss_gain":
                columns[:, sensors.channels.index(TOTAL_LOSS), index] = total_at_points(trajectory.loss) * scale
            elif item.role == "loss_delay":
                column = delay_column(trajectory, sensors.loss_delay) * sensors.loss_gain
                columns[:, sensors.channels.index(TOTAL_LOSS), index] = column * scale
            elif item.role == "lag":
                channel = sensors.channels.index(item.target)
                node = model.part_index(item.target)
                columns[:, channel, index] = lag_column(trajectory, node, sensors.lag[channel]) * scale

    @staticmethod
    def _term_of(terms: Sequence[TermOnGrid], item: Unknown) -> TermOnGrid | None:
        return next((t for t in terms if item.target in {p.name for p in t.term.parameters}), None)

    def _moved(self, term: TermOnGrid, item: Unknown, z: Array) -> tuple[Array, Array, float]:
        """A term's values, the same with one of them moved, and by how much."""
        names = [p.name for p in term.term.parameters]
        values = self._own(term, z)
        step = 0.05 * item.parameter.sd * (abs(values[names.index(item.target)]) if item.parameter.log else 1.0)
        moved = np.array(values)
        moved[names.index(item.target)] += step
        return values, moved, step

    def _shift_heat(self, trajectory: Trajectory, term: TermOnGrid, item: Unknown, z: Array) -> tuple[Array, Array]:
        values, moved, step = self._moved(term, item, z)
        # The trajectory's piece is shifted already: only the difference is added.
        there = term.adjusted(trajectory.piece, moved, trajectory).samples
        here = term.adjusted(trajectory.piece, values, trajectory).samples
        piece = replace(trajectory.piece, samples=trajectory.piece.samples + there - here)
        heat, loss = moved_heat(self.model, trajectory, piece)
        return heat / step, loss / step

    def _distortion(self, trajectory: Trajectory, sensors: Sensors, term: TermOnGrid, item: Unknown, z: Array) -> Array:
        values, moved, step = self._moved(term, item, z)
        read = readings(self.model, trajectory, sensors)
        there = term.distorted(trajectory, sensors, read, moved)
        return np.asarray((there - term.distorted(trajectory, sensors, read, values)) / step)

    def _input_heat(self, trajectory: Trajectory, here: Balance, item: Unknown) -> tuple[Array, Array]:
        """Net heat [W] and loss [W] per unit of a change of an input."""
        model, piece, T = self.model, trajectory.piece, trajectory.middle
        step = 0.5 if item.role == "ambient_offset" else TORQUE_STEP
        moved = replace(piece, samples=shifted(
            piece.samples, self.inputs, item.role, step if item.role == "ambient_offset" else 1.0 + step))  # fmt: skip
        power = trajectory.tangent.at(T[:, model.loss_nodes])
        changed = power
        if item.role == "torque_gain":
            changed = power + step * trajectory.tangent.torque_slope
        there = model.balance(moved, T, trajectory.values, changed, trajectory.memory)
        loss = (there.sources - here.sources)[:, model.is_loss].sum(axis=-1)
        return (there.heat - here.heat) / step, loss / step

    def fit(
        self, z: Array | None = None, guesses: Sequence[Trajectory | Array] | None = None, *,
        iterations: int = ITERATIONS,
    ) -> Fit:  # fmt: skip
        """The most probable unknowns.

        Parameters
        ----------
        z : Array, shape (unknowns,), optional
            Where to start; by default the priors' middles
        guesses : sequence, one per piece, optional
            Where to linearise first, see :func:`diagnosis.forward.trajectory.simulate`
        iterations : int
            At most

        Raises
        ------
        ArithmeticError
            If there is no solution where it should start.
        """
        lower, upper = self.unknowns.bounds
        z = np.zeros(len(self.unknowns)) if z is None else np.clip(z, lower, upper)
        if self.slow:
            iterations *= SLOW_PATIENCE
        parts = self._attempt(z, guesses)
        if parts is None:
            raise ArithmeticError("the simulation has no solution where the fit should start")
        objective = _objective(parts, z)
        damping, settled = 0.0, False
        for _ in range(iterations):
            step = _gauss_newton(parts, z, damping, lower, upper)
            longest = float(np.max(np.abs(step), initial=0.0))
            step *= min(1.0, FARTHEST_STEP / max(longest, 1e-12))
            tried = np.clip(z + step, lower, upper)
            trial = self._attempt(tried, [part.trajectory for part in parts])
            reached = _objective(trial, tried) if trial is not None else np.inf
            if trial is not None and reached <= objective + 1e-6:
                z, parts, gained, objective = tried, trial, objective - reached, reached
                damping, settled = 0.2 * damping, False
                if float(np.max(np.abs(step), initial=0.0)) < SETTLED or gained < 0.02:
                    break
            else:
                # The trajectory may not have settled at these values yet, and look better than it is. Where switches
                # follow means over minutes it never settles to the last.
                again = None if settled or self.slow else self._attempt(z, [part.trajectory for part in parts])
                if again is not None:
                    parts, objective = again, _objective(again, z)
                settled, damping = True, max(4.0 * damping, 1.0)
                if damping > 1e3:
                    break
        J = np.concatenate([part.white_columns for part in parts])
        curvature = np.eye(len(z)) + J.T @ J
        root = np.linalg.cholesky(curvature)
        log_evidence = -0.5 * objective - float(np.log(np.diag(root)).sum())
        inverse_root = np.linalg.inv(root)
        return Fit(
            unknowns=self.unknowns, z=z, covariance=inverse_root.T @ inverse_root, log_evidence=log_evidence,
            parts=tuple(parts),
        )  # fmt: skip

    def at(self, fit: Fit) -> Fit:
        """A fit of this problem with its linearisation."""
        return fit if fit.parts else self.fit(fit.z, fit.courses, iterations=0)

    def _attempt(self, z: Array, guesses: Sequence[Trajectory | Array] | None) -> list[Linearised] | None:
        """The linearisation at `z`; None where the simulation has no solution there."""
        try:
            return self._linearised(z, guesses)
        except (InputError, ArithmeticError, np.linalg.LinAlgError):
            return None

    def objective(self, z: Array, guesses: Sequence[Trajectory | Array]) -> float:
        """Squared whitened residuals and priors at `z`, without derivatives."""
        total = float(z @ z)
        for index, guess in enumerate(guesses):
            given = self.whitenings
            if given is None:
                raise ValueError("an objective alone needs given filters")
            try:
                trajectory = self._simulated(index, z, guess, rounds=2)
            except (InputError, ArithmeticError, np.linalg.LinAlgError):
                return np.inf
            piece = trajectory.piece
            sensors = self.unknowns.sensors(piece.channels, z)
            residual = piece.measured - self.read(trajectory, sensors, z)
            white = given[index](residual[:, :, None])
            total += float(white[:, 0] @ white[:, 0])
        return total

    def _linearised(self, z: Array, guesses: Sequence[Trajectory | Array] | None) -> list[Linearised]:
        first = guesses is None  # later, trajectory and unknowns settle together: one round per iteration
        return [
            self.linearise(i, z, None if guesses is None else guesses[i], rounds=ROUNDS if first else 1)
            for i in range(len(self.pieces))
        ]


def _objective(parts: Sequence[Linearised], z: Array) -> float:
    """Squared whitened residuals and priors."""
    return float(sum(p.white_residual @ p.white_residual for p in parts) + z @ z)


def _gauss_newton(parts: Sequence[Linearised], z: Array, damping: float, lower: Array, upper: Array) -> Array:
    """The step to the minimum of the linearised objective; what it pushes out of its bounds stays where it is."""
    count = len(z)
    normal, right = np.eye(count), -np.array(z)
    for part in parts:
        normal += part.white_columns.T @ part.white_columns
        right += part.white_columns.T @ part.white_residual
    normal += damping * np.diag(np.diag(normal))
    free = ~((z <= lower) & (right < 0.0)) & ~((z >= upper) & (right > 0.0))
    step = np.zeros(count)
    step[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
    return step
