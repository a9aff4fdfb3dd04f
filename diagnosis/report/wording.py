"""How units, names and terms of art are put to a reader."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from diagnosis.results.number_format import SUPERSCRIPTS
from diagnosis.results.result_parts import PARAMETER, Finding
from models.quantities.quantities import TOTAL_LOSS

DAY, HOUR, MINUTE = 86_400.0, 3600.0, 60.0
KEYS = ("T_ambient_degC", "bias_sd")  # that advice tells to write into a file
WEEKS_S, LONG_S, SHORT_S = 14.0 * DAY, 2.0 * HOUR, 5.0 * MINUTE  # above: in days, in hours; below: in seconds
UNITS = {"1": "", "degC": "°C", "W/degC": "W/K", "N.m": "N m", "rpm": "1/min"}
COURSES = {"step": "from a date on", "for_a_while": "for a while", "over_hours": "over the hours"}
MOST_WINDOWS = 12  # of a recording that are told
# Shown when hovering a term, and all together at the end of the page.
WORDS: Mapping[str, str] = {
    "as delivered": "The model as its definition has it, before any recording was seen.",
    "calibrated": "The same model with its existing parameters fitted to the recordings and to their priors. What a "
    "correction is worth counts against this, not against the model as delivered.",
    "corrected": "The model with the found physics, and with what was learnt of model error where a model can hold it.",
    "held out": "Recordings that nothing was fitted to: their error is that of a model that got their inputs and no "
    "measured temperature beyond the first minutes, which do not count. They did not choose the findings; what "
    "they contradict is no claim.",
    "log score": "Logarithm of the probability density that held-out readings had before they were seen, with noise "
    "and all that a fit is unsure of. Other than the RMSE it weighs slow errors less than quick ones, and the measured "
    "loss counts too.",
    "free-running": "Simulated from the start temperatures on with the recorded inputs alone, never corrected by a "
    "measurement on the way.",
    "RMSE": "Root mean square of simulated less measured: the typical size of the error. Readings are means over 20 to "
    "100 s where rows lie closer; what a recording begins with, to find its start temperatures, does not count.",
    "probability": "Share of the belief among all explanations that were compared, weighed before by how usual each "
    "is; not the chance that a thing of this name is in the gearbox if the true cause is not among them.",
    "evidence": "Natural logarithm of how many times better the data are predicted with the effect than without it, "
    "averaged over all values of all parameters (log Bayes factor), in nat: 1 nat is a factor of 2.7, 5 nat are 150, "
    "10 nat are 22 000.",
    "claim": "A name that is certain enough: its probability reached the limit that was asked for.",
    "likely": "Less than a claim: one of at most three names that these data cannot separate, or a law and a place "
    "whose cause was not found (acts like ...). It improves the prediction all the same.",
    "cannot be seen": "At the size that matters the effect would not reach the threshold in these recordings, with its "
    "prior: whether it is there or not, the answer is the same.",
    "model error": "What formulas, load sharings and lumped nodes cannot know: further small unknowns with priors, in "
    "classes between which the data choose. What they can explain is not called missing physics.",
    "threshold": "Evidence that has to be reached before anything is claimed: by the class of model error, at least "
    "10 nat, moved by the false-alarm rate asked for, and at least what a healthy baseline brings.",
    "false-alarm rate": "In how many of 100 healthy cases a mismatch may be reported, as asked for. It moves the "
    "threshold; the thresholds were set on healthy machines of simulated plants, so on a real machine it is an aim.",
    "standard error": "68 % of such estimates lie within ± this of the truth, if the form of the law is right.",
    "prior": "What the definition states about a parameter before any recording: a value, and how far off it may be.",
    "shift": "How far the calibration moved a parameter, in standard deviations of its prior. Beyond ±2 "
    "something else probably pulls at it.",
    "noise": "Scatter of a temperature reading from row to row; no model can be closer to single rows than this, but "
    "to means over several.",
    "floor": "Random heat that even a model without faults is granted, because a real gearbox is finer than any "
    "network of few nodes; mismatches below it are not claimed.",
    "not ruled out": "Explanations that these data leave possible, with their probabilities.",
}


def unit(symbol: str) -> str:
    """A unit as printed; empty for a plain number.

    Examples
    --------
    >>> unit("degC"), unit("mm^2/s"), unit("1")
    ('°C', 'mm²/s', '')
    """
    return re.sub(r"\^([-\d]*)", lambda power: power[1].translate(SUPERSCRIPTS), UNITS.get(symbol, symbol))


def name(identifier: str) -> str:
    """A name of the network for a reader.

    Examples
    --------
    >>> name("housing_lower"), name("P_loss"), name("torque_gain_step")
    ('housing lower', 'total loss', 'torque gain from a date on')
    """
    return "total loss" if identifier == TOTAL_LOSS else _spelled(identifier)


def headline(mechanism: str, place: str) -> str:
    """An explanation and its place.

    Examples
    --------
    >>> headline("pump_heat", "oil"), headline("parameter", "h_air")
    ('pump heat at oil', 'parameter h air')
    """
    return f"{name(mechanism)}{' ' if mechanism == PARAMETER else ' at '}{name(place)}"


def short_title(finding: Finding) -> str:
    """The names of a finding without their places."""
    like = "acts like " if finding.acts_like else ""
    return like + " or ".join(map(name, finding.tie_set or (finding.law,)))


def plain(text: str) -> str:
    """A text of the terminal for a page: names in words, units as printed, no full stop.

    Examples
    --------
    >>> plain("windage at housing_lower: on at 60 degC."), plain("state bias_sd of T_oil")
    ('windage at housing lower: on at 60 °C', 'state bias_sd of T oil')
    """
    return clause(_spelled(text))


def _spelled(text: str) -> str:
    """Names in words; the course of an effect in time, which is the end of its name, too."""
    for ending, words in COURSES.items():
        text = re.sub(rf"_{ending}\b", f" {words}", text)
    text = re.sub(r"\bT_ambient\b", "ambient temperature", text)
    return re.sub(rf"\b({'|'.join(KEYS)})\b|__?", lambda found: found[1] or " ", text)  # keys are typed as they are


def clause(text: str) -> str:
    """A text with units as printed and no full stop.

    Examples
    --------
    >>> clause("temperature of oil above 60 degC.")
    'temperature of oil above 60 °C'
    """
    return re.sub(r"\bdegC\b", "°C", text).strip().removesuffix(".")


def sentence(text: str) -> str:
    """A text as a sentence.

    Examples
    --------
    >>> sentence("hold three speeds without load"), sentence("")
    ('Hold three speeds without load.', '')
    """
    text = clause(text)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def time_scale(end_s: float) -> tuple[float, str]:
    """Seconds of the unit that times up to an end are shown in, and that unit.

    Examples
    --------
    >>> time_scale(64800.0), time_scale(600.0), time_scale(5e6)
    ((3600.0, 'h'), (60.0, 'min'), (86400.0, 'd'))
    """
    if end_s > WEEKS_S:
        return DAY, "d"
    if end_s > LONG_S:
        return HOUR, "h"
    return (MINUTE, "min") if end_s > SHORT_S else (1.0, "s")


def windows(when: Sequence[tuple[str, float, float]]) -> list[tuple[str, str]]:
    """Recordings, and their stretches of time in words.

    Examples
    --------
    >>> windows([("a", 0.0, 3600.0), ("a", 32400.0, 64800.0), ("b", 0.0, 90.0)])
    [('a', '0.0 to 1.0, 9.0 to 18.0 h'), ('b', '0 to 90 s')]

    Of many the longest are given.
    """
    told = []
    for recording in dict.fromkeys(name for name, _, _ in when):
        every = [(begin, end) for name, begin, end in when if name == recording]
        own = sorted(sorted(every, key=lambda span: span[0] - span[1])[:MOST_WINDOWS])
        seconds, symbol = time_scale(max(end for _, end in own))
        decimals = 1 if symbol in ("d", "h") else 0
        spans = ", ".join(f"{a / seconds:.{decimals}f} to {b / seconds:.{decimals}f}" for a, b in own)
        more = f" and {len(every) - len(own)} shorter ones" if len(every) > len(own) else ""
        told.append((recording, f"{spans} {symbol}{more}"))
    return told
