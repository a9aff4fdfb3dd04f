"""``python -m builder VERB``: the command line of the gearbox thermal twin.

Exit status 0: done. 2: the input is at fault, one message on stderr says what and what to do. 1: our own fault.
"""

from __future__ import annotations

import sys

from builder.cli import commands
from builder.console import err
from models.errors import InputError


def main() -> None:
    """Run one verb."""
    try:
        commands(standalone_mode=True)
    except InputError as error:
        err.print(str(error), style="red", markup=False)
        sys.exit(2)


if __name__ == "__main__":
    main()
