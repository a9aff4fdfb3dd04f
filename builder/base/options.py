"""Options that verbs share, and the example in the help of every verb."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click
from click.core import ParameterSource

from diagnosis.decision.settings import LIMITS, Settings
from models.assembly.gearbox import Gearbox, known_gearboxes
from models.correction.correction import Correction, parse_correction, read_correction

Command = TypeVar("Command", bound=Callable[..., Any])

PROGRAM = "python -m builder"
GEARBOX_HELP = f"Name ({', '.join(known_gearboxes())}) or definition file (TOML)."
JOBS_HELP = "Processes on this machine."
DASK_HELP = "Scheduler of a Dask cluster to work on instead, e.g. tcp://host:8786."
SETTINGS = {
    "false_alarm_rate": ("--false-alarm-rate", "P", "How often a healthy machine may be called inconsistent: an aim."),
    "matters_K": ("--matters-K", "K", "Change of a temperature from which an effect matters."),
    "matters_W": ("--matters-W", "W", "The same of a heat; 0: by temperatures alone."),
    "claim_from": ("--claim-from", "P", "Probability from which a name is a claim."),
    "odds_unknown": ("--odds-unknown", "X", "Prior odds of a cause that is in no catalogue."),
}


def example(*commands: str) -> str:
    r"""Return the last lines of a verb's help: commands as they are typed, without the program's name.

    Examples
    --------
    >>> example("check mine.toml")
    '\x08\nExample:\n  python -m builder check mine.toml'
    """
    word = "Example" if len(commands) == 1 else "Examples"
    return "\n".join(["\b", f"{word}:", *(f"  {PROGRAM} {command}" for command in commands)])


def gearbox_option(help_text: str = GEARBOX_HELP, default: str | None = "fzg") -> Callable[[Command], Command]:
    """Give a command the option ``--gearbox`` (str)."""
    return click.option("--gearbox", default=default, show_default=True, metavar="NAME|FILE", help=help_text)


@dataclass(frozen=True)
class CorrectionFile:
    """A correction that a verb is to use.

    Attributes
    ----------
    claims_only : bool
        Without what is only likely
    """

    path: Path
    claims_only: bool

    def read(self, gearbox: Gearbox) -> Correction:
        """The correction of a gearbox; :func:`models.correction.correction.read_correction` names what it raises."""
        return self._as_asked(read_correction(self.path, gearbox))

    def parse(self) -> Correction:
        """The correction of any gearbox; :func:`models.correction.correction.parse_correction` names what it raises."""
        return self._as_asked(parse_correction(self.path))

    def _as_asked(self, found: Correction) -> Correction:
        return found.claims_only() if self.claims_only else found


def correction_options(help_text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command ``--correction`` and ``--claims-only``, as `correction` (CorrectionFile or None)."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def with_correction(*args: Any, correction: Path | None, claims_only: bool, **given: Any) -> Any:
            if claims_only and correction is None:
                raise click.UsageError("--claims-only is about --correction; give both")
            named = None if correction is None else CorrectionFile(correction, claims_only)
            return command(*args, correction=named, **given)

        claims = click.option("--claims-only", is_flag=True, help="Of --correction without what is only likely.")
        file = click.option("--correction", type=click.Path(path_type=Path, dir_okay=False), default=None,
                            metavar="FILE", help=help_text)  # fmt: skip
        return file(claims(with_correction))

    return decorate


def settings_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of :class:`~diagnosis.decision.settings.Settings`; it gets them as `settings`."""

    @wraps(command)
    def with_settings(*args: Any, **given: Any) -> Any:
        settings = Settings(**{name: given.pop(name) for name in SETTINGS})
        return command(*args, settings=settings, **given)

    for name, (option, metavar, text) in reversed(SETTINGS.items()):
        low, high = LIMITS[name]
        with_settings = click.option(
            option, name, type=FiniteRange(low, high), metavar=metavar, default=getattr(Settings(), name),
            show_default=True, help=text,
        )(with_settings)  # fmt: skip
    return with_settings


class FiniteRange(click.FloatRange):
    """A number between two limits; NaN, which compares with neither, is refused as well."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number of a text."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is no finite number.", param, ctx)
        return number


def worker_options(*, jobs_help: str = JOBS_HELP, dask_help: str = DASK_HELP) -> Callable[[Command], Command]:
    """Give a command the options ``--jobs`` (int, by default one per core) and ``--dask`` (str or None); one of them.

    Parameters
    ----------
    jobs_help, dask_help : str
    """

    def decorate(command: Command) -> Command:
        dask = click.option("--dask", default=None, metavar="ADDRESS", callback=_without_jobs, help=dask_help)
        return jobs_option(jobs_help)(dask(command))

    return decorate


def jobs_option(help_text: str = JOBS_HELP) -> Callable[[Command], Command]:
    """Give a command the option ``--jobs`` (int, by default one per core)."""
    return click.option(
        "--jobs", type=click.IntRange(min=1), default=_cores, show_default="all cores", metavar="N", is_eager=True,
        help=help_text,
    )  # fmt: skip


def _without_jobs(context: click.Context, _: click.Parameter, address: str | None) -> str | None:
    if address is not None and context.get_parameter_source("jobs") == ParameterSource.COMMANDLINE:
        raise click.UsageError("--jobs and --dask exclude each other: the work is done here or on the cluster", context)
    return address


def _cores() -> int:
    from joblib import cpu_count  # 0.1 s that --help need not wait for

    return int(cpu_count())
