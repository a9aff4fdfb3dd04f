"""The help: all verbs on one screen, and an example of each that the program takes."""

from __future__ import annotations

import shlex
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from builder.base.options import PROGRAM
from builder.commands.cli import GROUPS, commands

LINES, WIDTH = 23, 80  # of a terminal, less the line of the prompt


def test_all_verbs_fit_a_screen_with_their_whole_first_sentences() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", str(WIDTH))
        text = CliRunner().invoke(commands, ["--help"], terminal_width=WIDTH).output
    lines = text.splitlines()
    assert len(lines) <= LINES and max(map(len, lines)) <= WIDTH
    assert "..." not in text.partition("\n")[2]
    for verb in commands.commands.values():
        first = (verb.help or "").partition("\n\n")[0]
        assert first.endswith(".") and first in text


def test_every_verb_is_in_one_group() -> None:
    names = [name for group in GROUPS.values() for name in group]
    assert sorted(names) == sorted(commands.commands)


def examples(verb: click.Command) -> list[str]:
    found = [line.strip() for line in (verb.epilog or "").splitlines() if line.strip().startswith(PROGRAM)]
    assert found, f"{verb.name} has no example"
    return found


@pytest.mark.parametrize("name", sorted(commands.commands))
def test_the_example_of_a_verb_is_accepted(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Options exist, and values are in their ranges; paths that must exist are made."""
    monkeypatch.chdir(tmp_path)
    for folder in ("out/diagnoses", "out/concealed/truth"):
        (tmp_path / folder).mkdir(parents=True)
    verb = commands.commands[name]
    for line in examples(verb):
        _, _, _, named, *words = shlex.split(line)
        assert named == name
        context = verb.make_context(name, words)
        assert not context.args
    root = Path(__file__).parents[4]
    files = [word.partition("@")[0] for line in examples(verb) for word in shlex.split(line) if "examples/" in word]
    assert all((root / file).is_file() for file in files), files
