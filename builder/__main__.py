"""``python -m builder VERB``: the command line of the gearbox thermal twin.

Exit status 0: done. 2: the input is at fault, one message on stderr names the fault and what to do. 1: our own fault.
"""

from __future__ import annotations

import sys

import click

from builder.base.console import err
from builder.base.progress import progress
from models.base.errors import InputError

INTERRUPTED = 130  # what shells give for a program stopped by the keyboard


def main() -> None:
    """Run one verb."""
    try:
        with progress("loading the program"):
            from builder.commands.cli import commands  # seconds, on a machine that has other work

        sys.exit(commands(standalone_mode=False) or 0)
    except InputError as error:
        err.print(str(error), style="red")
        sys.exit(2)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        err.print("interrupted; unfinished files are removed", style="red")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
