"""One look for one more effect: what was scored and fitted, and how probable each of it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from diagnosis.candidates.explain import Explanation
from diagnosis.candidates.hypotheses import Hypothesis, Scored
from models.base.types import Array

# Log evidences are divided by a temperature before they become probabilities, because no model is exactly true: a
# constant, and a share of the whole evidence, since the form of an effect is known no better than that.
TEMPER, TEMPER_SHARE = 3.0, 0.03
OPEN_PENALTY = 10.0  # log evidence by which an open form has to beat the catalogue
LEAST_RIVAL = 0.01  # probability of what is told as a rival
LEAST_SHARE = 0.5  # of the best probability, of what may stand although something is more probable
# Log odds of what is rarer than a piece of missing physics or a biased sensor.
RARITY = {
    "sensor_gain": -2.0,
    "speed_gain": -3.0,
    "clock_offset": -1.0,
    "swapped_channels": -2.0,
    "water_jacket": -1.0,
    # Like what formulas of mesh and bearings leave in consistent recordings; the first has no published law either.
    "churning_load": -5.0,
    "misalignment": -4.0,
    "bearing_seat_contact": -4.0,
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One look for one more effect.

    Attributes
    ----------
    scored : tuple of Scored
        Everything, best first
    log_e_value : float
        Log of the mean Bayes factor over everything known that was scored, or of the best open form less its handicap
    fits : tuple of Explanation
        The best few, fitted in earnest, best first
    gains : tuple of float
        Their log evidence over the explanation before
    fitted : mapping of str to float
        The same of everything that was fitted, by label, whatever became of it
    accepted : Explanation or None
    tentative : bool
        Whether what was accepted stands only if a further effect is found with which the held-out error does not grow
    otherwise : Stage or None
        The same look with what else is accepted then
    matters : bool
        Whether what was accepted, or else anything that would explain the data, is large enough to matter in practice
    note : str
        Why nothing was accepted, if so
    """

    scored: tuple[Scored, ...]
    log_e_value: float
    fits: tuple[Explanation, ...] = ()
    gains: tuple[float, ...] = ()
    fitted: Mapping[str, float] = field(default_factory=dict)
    accepted: Explanation | None = None
    tentative: bool = False
    otherwise: Stage | None = None
    matters: bool = False
    note: str = ""

    def probabilities(self) -> Array:
        """Of the fits, among each other, shape (fits,)."""
        weights = np.array(self.gains) / (TEMPER + TEMPER_SHARE * max(0.0, *self.gains))
        weights += np.array([RARITY.get(fit.found[-1].name, 0.0) for fit in self.fits])
        weights = np.exp(weights - weights.max())
        return np.asarray(weights / weights.sum())

    def probability_of(self, name: str) -> float:
        """Of a physics, among the fits; its places are no rivals of one another."""
        named = [fit.found[-1].name == name for fit in self.fits]
        return float(self.probabilities()[named].sum())

    def ranked(self) -> Stage:
        """The same, the most probable fit first."""
        order = np.argsort(-self.probabilities())
        return replace(self, fits=tuple(self.fits[i] for i in order), gains=tuple(self.gains[i] for i in order))


def log_weights(scored: Sequence[Scored]) -> Array:
    """Logarithms of what everything weighs in the mean Bayes factor, together 1, shape (scored,).

    All names weigh the same, but for their rarity, and share it among their places; every instrument may fail for
    itself, and every parameter be off.

    Parameters
    ----------
    scored : sequence of Scored
        Everything that competes, without open forms
    """

    def shares(h: Hypothesis) -> str:
        return h.label if h.term is None or h.term.of_measurement else h.name

    places = Counter(shares(s.hypothesis) for s in scored)
    weights = np.array([RARITY.get(s.hypothesis.name, 0.0) - np.log(places[shares(s.hypothesis)]) for s in scored])
    return np.asarray(weights - np.logaddexp.reduce(weights))


def log_e_value(scored: Sequence[Scored]) -> float:
    """Log of the mean Bayes factor, see :func:`log_weights`."""
    return float(np.logaddexp.reduce(np.array([s.log_bayes for s in scored]) + log_weights(scored)))


def penalised(fit: Explanation) -> float:
    """Log evidence of a fit, less what an open form has to be ahead of the catalogue."""
    return fit.log_evidence - (OPEN_PENALTY if fit.found[-1].is_open else 0.0)
