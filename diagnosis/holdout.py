"""What held-out recordings say of an explanation: how well it predicts them, with and without what it is unsure of."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from diagnosis.case import Case, with_floor
from diagnosis.explain import Explanation
from diagnosis.observation import LOSS
from diagnosis.posterior import Problem
from diagnosis.predict import predict
from diagnosis.trajectory import ROUNDS
from diagnosis.whitening import Whitening


def at_holdout(case: Case, explanation: Explanation) -> Problem:
    """The held-out recordings with everything that an explanation found; its terms, its model, its noise."""
    problem = explanation.problem
    return case.holdout.changed(model=problem.model, unknowns=problem.unknowns, terms=problem.terms)


class Judge:
    """Held-out recordings that compare explanations with one another.

    Parameters
    ----------
    case : Case
    base : Explanation
        With what the others are compared; its noise filters judge them all
    floor : float
        Structural floor of `base`, in multiples of the least
    """

    def __init__(self, case: Case, base: Explanation, floor: float) -> None:
        self.case, self.base, self.floor = case, base, floor
        self._whitenings: Sequence[Whitening] | None = None
        self._own = self.log_predictive(base) if case.holdout.pieces else 0.0
        self.rmse = cache(self._rmse)

    def log_predictive(self, explanation: Explanation) -> float:
        """Log density of the held-out readings, predicted with the uncertainty that the training left.

        What an explanation is unsure of widens its prediction: being a little off then costs little, and being
        right where the rival is off counts, however small it looks in the root mean square.
        """
        problem = with_floor(at_holdout(self.case, explanation), self.floor)
        if self._whitenings is not None:
            problem = problem.with_whitenings(self._whitenings)
        z = explanation.fit.z
        parts = [problem.linearise(i, z, None, rounds=ROUNDS) for i in range(len(problem.pieces))]
        self._whitenings = [part.whitening for part in parts]
        residual = np.concatenate([part.white_residual for part in parts])
        J = np.concatenate([part.white_columns for part in parts])
        # The posterior of the training is the prior here: r ~ N(0, 1 + J C J^T).
        root = np.linalg.cholesky(explanation.fit.covariance)
        X = J @ root
        inner = np.eye(X.shape[1]) + X.T @ X
        along = X.T @ residual
        quadratic = float(residual @ residual - along @ np.linalg.solve(inner, along))
        return -0.5 * quadratic - 0.5 * float(np.linalg.slogdet(inner)[1])

    def gain(self, explanation: Explanation) -> float:
        """Log predictive density of the held-out readings over that of the base."""
        try:
            return self.log_predictive(explanation) - self._own
        except (ArithmeticError, np.linalg.LinAlgError):
            return -np.inf  # no prediction at all

    def _rmse(self, explanation: Explanation) -> float:
        """Root mean square error of the held-out temperatures, free-running, [K]; NaN without held-out recordings."""
        problem = at_holdout(self.case, explanation)
        temperatures = [i for i, name in enumerate(self.case.channels) if name != LOSS]
        residuals = [
            predict(problem, i, explanation.fit.z).residual[:, temperatures] for i in range(len(problem.pieces))
        ]
        return float(np.sqrt(np.nanmean(np.concatenate(residuals) ** 2))) if residuals else float("nan")
