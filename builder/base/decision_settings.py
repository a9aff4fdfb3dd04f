"""The numbers of a diagnosis that a user sets, as command-line options."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

from builder.base.finite_range import FiniteRange
from diagnosis.decision.settings import LIMITS, Settings

DEFAULT = Settings()
OPTIONS = {
    "false_alarm_rate": ("--false-alarm-rate", "P", "How often a healthy machine may be called inconsistent: an aim."),
    "matters_K": ("--matters-K", "K", "Change of a temperature from which an effect matters."),
    "matters_W": ("--matters-W", "W", "The same of a heat; 0: by temperatures alone."),
    "claim_from": ("--claim-from", "P", "Probability from which a name is a claim."),
    "odds_unknown": ("--odds-unknown", "X", "Prior odds of a cause that is in no catalogue."),
}


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of :class:`~diagnosis.decision.settings.Settings`; it gets them as `settings`."""

    @wraps(command)
    def with_settings(*args: Any, **given: Any) -> Any:
        settings = Settings(**{name: given.pop(name) for name in OPTIONS})
        return command(*args, settings=settings, **given)

    for name, (option, metavar, text) in reversed(OPTIONS.items()):
        low, high = LIMITS[name]
        with_settings = click.option(
            option, name, type=FiniteRange(low, high), metavar=metavar, default=getattr(DEFAULT, name),
            show_default=True, help=text,
        )(with_settings)  # fmt: skip
    return with_settings
