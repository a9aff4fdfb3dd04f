"""What the README says of the FMU's variables, commands and files is what the code says."""

from __future__ import annotations

import re
from pathlib import Path

from builder.cli import commands
from builder.signals import signal_table
from models.gearbox import Gearbox

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_nomenclature_is_the_signal_table(fzg: Gearbox) -> None:
    assert signal_table(fzg).markdown().strip() in README


def test_every_verb_that_is_named_exists() -> None:
    verbs = set(re.findall(r"python -m builder ([a-z-]+)", README))
    assert {"build-fmu", "simulate", "reproduce"} <= verbs <= set(commands.commands)


def test_every_option_that_is_named_exists() -> None:
    known = {name for command in commands.commands.values() for p in command.params
             for name in (*p.opts, *p.secondary_opts)}  # fmt: skip
    named = {o for line in README.splitlines() if "-m builder" in line for o in re.findall(r" (--[a-z-]+)", line)}
    assert named - {"--quiet"} <= known


def test_every_file_that_is_linked_exists() -> None:
    paths = re.findall(r"(?:examples|models|docs|benchmarks)/[\w./-]+\.(?:py|toml|csv|png)", README)
    assert paths
    assert [path for path in paths if not (ROOT / path).is_file()] == []
