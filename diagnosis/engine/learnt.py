"""All learnt numbers of the diagnosis, from ``diagnosis/engine/learnt.toml``; their origin stands there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from models.files.toml_file import parse_schema_1, read_text

FILE = "learnt.toml"


@dataclass(frozen=True, kw_only=True)
class ErrorClass:
    """A class of model error.

    Attributes
    ----------
    threshold : float
        Evidence from which something is missing if the readings choose this class with and without it, [nat]
    over_time : float
        How much less changes over time count in this class, [nat]
    amplitudes : mapping of group to float
        Prior standard deviations of the groups' unknowns; groups that are not named are absent
    """

    name: str
    prior: float
    threshold: float
    amplitudes: Mapping[str, float]
    over_time: float = 0.0

    @property
    def is_large(self) -> bool:
        """True if so much is unknown of the machine that effects can stand in for it."""
        return self.over_time > 0.0

    def scaled(self, factor: float) -> ErrorClass:
        """The class with all amplitudes larger or smaller by a factor."""
        return replace(self, amplitudes={group: factor * value for group, value in self.amplitudes.items()})


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Numbers of the rule of decision, see :mod:`diagnosis.decision.posterior`.

    Attributes
    ----------
    rate : float
        False-alarm rate that the thresholds of the classes are for, [-]
    temper : (float, float)
        a [nat] and b [-]
    detection : float
        Times the threshold of the class that are asked for before something is missing, [-]
    doubt : float
        Width about the threshold, [nat]
    pair : float
        Prior of two effects, to one
    refuted, alike : float
        Share of the best evidence; cosine, [-]
    much_left : (float, float)
        Of the evidence of a second effect, [nat] and [-]
    nearest : float
        How often a name was right, or its law at its place, where that much was left, [-]
    named_if_large : float
        Evidence from which a name counts where model error is large, [nat]
    confirmed : float
        Log score that held-out readings have to gain there by an effect that always acts, for a claim, [nat]
    draughts : (float, float)
        Random share of all heat to the surroundings, at most, [-]; evidence that it has to bring, [nat]
    repeats : float
        Deviation between sessions that every machine is granted, in prior standard deviations
    one_event : (float, float)
        Chance that two dates fall as close together, below which two effects are one event; cosine between two heats
        over the time, above which they are, [-]
    trusted : (int, float)
        Baselines, and their time to that of the tested recordings, that show what a wrong model makes of a change, [-]
    wider : float
        Prior of a parameter outside its prior, in its own standard deviations
    """

    rate: float
    temper: tuple[float, float]
    detection: float
    doubt: float
    pair: float
    refuted: float
    alike: float
    much_left: tuple[float, float]
    nearest: float
    named_if_large: float
    confirmed: float
    draughts: tuple[float, float]
    repeats: float
    one_event: tuple[float, float]
    trusted: tuple[int, float]
    wider: float

    def thresholds(self, nothing: ErrorClass, best: ErrorClass, rate: float) -> tuple[float, float]:
        """Evidence from which something is missing; that from which a parameter is outside, or a further effect.

        Parameters
        ----------
        nothing, best : ErrorClass
            Class of model error without any effect, and with the best one: half-way between their thresholds
        rate : float
            False-alarm rate that a user asks for

        Returns
        -------
        detection, class_threshold : float
            [nat]
        """
        of_class = 0.5 * (nothing.threshold + best.threshold)
        stricter = self.temper[0] * float(np.log(self.rate / rate))
        return self.detection * of_class + stricter, max(of_class + stricter, 0.0)


@cache
def _document() -> Mapping[str, Any]:
    return parse_schema_1(read_text(files("diagnosis.engine") / FILE), file=FILE, kind="learnt numbers")


@cache
def error_classes() -> tuple[ErrorClass, ...]:
    """Classes of model error with their priors."""
    return tuple(ErrorClass(**one) for one in _document()["class"])


@cache
def widest_class() -> ErrorClass:
    """The class with most model error."""
    return next(one for one in error_classes() if one.name == "full")


@cache
def rule() -> Rule:
    """Numbers of the rule of decision."""
    found = dict(_document()["decision"])
    return Rule(**found | {name: tuple(found[name]) for name in ("temper", "much_left", "one_event", "trusted")})


@cache
def family_priors() -> Mapping[str, float]:
    """Prior of every family of candidates."""
    return dict(_document()["prior"]["families"])


@cache
def deviation_priors() -> Mapping[float, float]:
    """Prior of the deviation between sessions, in prior standard deviations of the unknowns."""
    return {float(s): p for s, p in _document()["prior"]["deviations"].items()}
