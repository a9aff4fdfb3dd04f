"""All verbs. Each reads its input, calls one function of this project, and shows the result."""

from __future__ import annotations

import signal
from types import FrameType

import click

from builder.commands.add import add
from builder.commands.build_fmu import build_fmu
from builder.commands.check import check
from builder.commands.conceal import conceal
from builder.commands.definition_files import new, schema
from builder.commands.diagnose import diagnose
from builder.commands.prove import prove, score
from builder.commands.simulate import simulate
from builder.reproduce.command import reproduce
from models.base.version import DISTRIBUTION, project_version

LONGEST = 80  # characters of a first sentence, which the help of all verbs has in full
GROUPS = {
    "Your machine, and recordings of it": ("new", "check", "add", "schema", "build-fmu", "simulate", "diagnose"),
    "Trust": ("conceal", "prove", "score", "reproduce"),
}


def _stop(_number: int, _frame: FrameType | None) -> None:
    """Let a termination unwind like an interrupt, so that unfinished files are removed."""
    raise KeyboardInterrupt


class _Verbs(click.Group):
    """Verbs in the order of a user's day, each with its first sentence."""

    def format_commands(self, _: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the groups of verbs."""
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(LONGEST)) for name in names])


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(project_version(), prog_name=DISTRIBUTION)
def commands() -> None:
    """Thermal twin of gearboxes: full model, surrogate, FMU, and diagnosis."""
    signal.signal(signal.SIGTERM, _stop)


for verb in (new, check, add, schema, build_fmu, simulate, diagnose, conceal, prove, score, reproduce):
    commands.add_command(verb)
