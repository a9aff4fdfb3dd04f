"""What the pages of the site show is what a user sees: every ``console`` block is typed in, and must answer so.

Files that a page has the reader save are saved first, and what it has changed by hand is changed.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.conftest import RunCli

ROOT = Path(__file__).resolve().parents[2]
STEP = re.compile(
    r"[Ss]ave this as `(?P<file>[^`]+)`[^\n]*:\n\n```\w+\n(?P<content>.*?)^```$"
    r"|^<!-- edit (?P<edited>\S+): (?P<pattern>[^\n]+) -> (?P<text>[^\n]+) -->$"
    r"|^```console\n(?P<typed>.*?)^```$",
    re.DOTALL | re.MULTILINE,
)
PROGRAM = ["python", "-m", "builder"]
COMMANDS = re.compile(r"^```(bash|console)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
EVERYWHERE = re.compile(
    r"(python|dask|my_method) (?!.*(\\$|<<|[&|;`<>]|\$\(| #))"
)  # in bash, PowerShell, Command Prompt
OF_A_SHELL = {"python3 -m venv .venv", ". .venv/bin/activate"}  # shown next to those of Windows
PAGES = [page for page in sorted((ROOT / "docs").rglob("*.md")) if "```console" in page.read_text(encoding="utf-8")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_messages_of_a_page(
    page: Path,
    run_cli: RunCli,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for step in STEP.finditer(page.read_text(encoding="utf-8")):
        if step["file"]:
            Path(step["file"]).write_text(step["content"], encoding="utf-8")
        elif step["edited"]:
            edited = Path(step["edited"])
            text, count = re.subn(step["pattern"], step["text"], edited.read_text(encoding="utf-8"), flags=re.MULTILINE)
            assert count, step[0]
            edited.write_text(text, encoding="utf-8")
        else:
            type_in(step["typed"], run_cli, capsys)


def type_in(block: str, run_cli: RunCli, capsys: pytest.CaptureFixture[str]) -> None:
    """Run every command of a block; the message below it is what comes, none if the page shows none."""
    for entry in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, _, message = entry.partition("\n")
        words = shlex.split(command)
        assert words[:3] == PROGRAM
        capsys.readouterr()
        status = run_cli(*words[3:])
        assert status == (2 if message else 0), command
        if message:
            assert capsys.readouterr().err.split() == message.split(), command


def test_pages_show_messages() -> None:
    assert len(PAGES) >= 4


def test_commands_are_the_same_in_every_shell() -> None:
    text = "".join(
        p.read_text(encoding="utf-8") for f in ("tutorials", "how_to") for p in (ROOT / "docs" / f).glob("*.md")
    )
    lines = {
        line.removeprefix("$ ") for kind, block in COMMANDS.findall(text) for line in block.splitlines()
        if kind == "bash" or line.startswith("$ ")
    }  # fmt: skip
    assert len(lines) > 30
    assert {line for line in lines if not EVERYWHERE.match(line)} == OF_A_SHELL


@pytest.mark.parametrize(
    "command",
    ["python a.py \\", "python - <<END", "python a.py && b", "python a.py  # first", "cat a", "A=1 python a.py"],
)
def test_what_only_one_shell_knows_is_found(command: str) -> None:
    assert EVERYWHERE.match("python a.py b_*.csv --to c") and not EVERYWHERE.match(command)
