"""What held-out recordings say of an explanation: how well it predicts them, with and without what it is unsure of."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property

import numpy as np

from diagnosis.candidates.explain import Explanation
from diagnosis.forward.trajectory import ROUNDS
from diagnosis.inference.posterior import Linearised, Problem
from diagnosis.inference.predict import overall_rmse, predict
from diagnosis.inference.whitening import Whitening
from diagnosis.setup.inference_setup import InferenceSetup
from models.base.types import Array
from models.quantities.quantities import is_total_loss


def at_holdout(case: InferenceSetup, explanation: Explanation) -> Problem:
    """The held-out recordings with everything that an explanation found; its terms, its model, its floor."""
    problem = explanation.problem
    return case.holdout.changed(
        model=problem.model, unknowns=problem.unknowns, terms=problem.terms, floor=problem.floor
    )


class Judge:
    """Held-out recordings that compare explanations with one another.

    Parameters
    ----------
    case : InferenceSetup
    base : Explanation
        With what the others are compared; its noise filters judge them all
    """

    def __init__(self, case: InferenceSetup, base: Explanation) -> None:
        self.case, self.base = case, base
        self.rmse, self.gain = cache(self._rmse), cache(self._gain)

    @cached_property
    def misfit(self) -> float:
        """How large the residuals of the base are, as switches that follow what was measured leave them.

        Mean square, in multiples of what noise, structural floor and what the training left unsure make of it; 0
        without held-out recordings, infinite without a prediction.
        """
        if not self.case.holdout.pieces:
            return 0.0
        try:
            _, _, misfit = self._of_base
        except (ArithmeticError, np.linalg.LinAlgError):
            return np.inf
        return misfit

    @cached_property
    def _of_base(self) -> tuple[list[Whitening], float, float]:
        """Noise filters of the base, its own log density and its misfit."""
        problem = at_holdout(self.case, self.base)
        parts = _linearised(problem, self.base, self._courses)
        quadratic, log_determinant = _spread(parts, self.base)
        rows = sum(int(np.isfinite(part.residual).sum()) for part in parts)
        return [part.whitening for part in parts], -0.5 * (quadratic + log_determinant), quadratic / max(rows, 1)

    @cached_property
    def _courses(self) -> list[Array | None]:
        """Temperatures that the base predicts, free-running, for others to start from; None without a prediction."""
        problem = at_holdout(self.case, self.base)
        try:
            return [predict(problem, i, self.base.fit.z).trajectory.T for i in range(len(problem.pieces))]
        except (ArithmeticError, np.linalg.LinAlgError):
            return [None] * len(problem.pieces)

    def _gain(self, explanation: Explanation) -> float:
        """Log density of the held-out readings over that of the base, predicted with what the training left unsure.

        What an explanation is unsure of widens its prediction: being a little off then costs little, and being
        right where the rival is off counts, however small it looks in the root mean square. Switches follow what was
        measured, as in learning; the root mean square error is that of a free run. Minus infinity without a prediction.
        """
        try:
            whitenings, own, _ = self._of_base
            problem = at_holdout(self.case, explanation).with_whitenings(whitenings)
            parts = _linearised(problem, explanation, self._courses)
            quadratic, log_determinant = _spread(parts, explanation)
            return -0.5 * (quadratic + log_determinant) - own
        except (ArithmeticError, np.linalg.LinAlgError):
            return -np.inf

    def _rmse(self, explanation: Explanation) -> float:
        """Root mean square error of the held-out temperatures, free-running, [K]; infinite without a prediction."""
        problem = at_holdout(self.case, explanation)
        temperatures = [i for i, name in enumerate(self.case.channels) if not is_total_loss(name)]
        try:
            predictions = [predict(problem, i, explanation.fit.z, guess=course)
                           for i, course in enumerate(self._courses)]  # fmt: skip
        except (ArithmeticError, np.linalg.LinAlgError):
            return np.inf
        return overall_rmse(predictions, temperatures)


def _linearised(problem: Problem, explanation: Explanation, courses: Sequence[Array | None]) -> list[Linearised]:
    return [problem.linearise(i, explanation.fit.z, course, rounds=ROUNDS) for i, course in enumerate(courses)]


def _spread(parts: Sequence[Linearised], explanation: Explanation) -> tuple[float, float]:
    """Of the whitened residuals: the posterior of the training is the prior here, ``r ~ N(0, 1 + J C J^T)``."""
    residual = np.concatenate([part.white_residual for part in parts])
    X = np.concatenate([part.white_columns for part in parts]) @ np.linalg.cholesky(explanation.fit.covariance)
    inner, along = np.eye(X.shape[1]) + X.T @ X, X.T @ residual
    quadratic = float(residual @ residual - along @ np.linalg.solve(inner, along))
    return quadratic, float(np.linalg.slogdet(inner)[1])
