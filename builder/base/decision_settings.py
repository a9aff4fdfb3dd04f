"""The four numbers of a diagnosis as command-line options."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

from diagnosis.decision.settings import Settings

DEFAULT = Settings()


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of :class:`~diagnosis.decision.settings.Settings`; it gets them as `settings`."""

    @wraps(command)
    def with_settings(
        *args: Any, false_alarm_rate: float, matters_k: float, matters_w: float, claim_from: float, odds_unknown: float,
        **others: Any,
    ) -> Any:  # fmt: skip
        settings = Settings(false_alarm_rate=false_alarm_rate, matters_K=matters_k, matters_W=matters_w,
                            claim_from=claim_from, odds_unknown=odds_unknown)  # fmt: skip
        return command(*args, settings=settings, **others)

    options = [
        click.option("--false-alarm-rate", type=click.FloatRange(min=1e-4, max=0.5), metavar="P", show_default=True,
                     default=DEFAULT.false_alarm_rate,
                     help="How often recordings that agree may be called inconsistent."),
        click.option("--matters-K", "matters_k", type=click.FloatRange(min=0.01, max=100.0), metavar="K",
                     show_default=True, default=DEFAULT.matters_K,
                     help="Change of a temperature from which an effect matters."),
        click.option("--matters-W", "matters_w", type=click.FloatRange(min=0.0), metavar="W", default=DEFAULT.matters_W,
                     help="The same of a heat.  [default: 3 % of the typical loss]"),
        click.option("--claim-from", type=click.FloatRange(min=0.5, max=0.999), metavar="P", show_default=True,
                     default=DEFAULT.claim_from, help="Probability from which a name is a claim."),
        click.option("--odds-unknown", type=click.FloatRange(min=0.001, max=10.0), metavar="X", show_default=True,
                     default=DEFAULT.odds_unknown, help="Prior odds of a cause that is in no catalogue."),
    ]  # fmt: skip
    for option in reversed(options):
        with_settings = option(with_settings)
    return with_settings
