"""What the pages of the site show is what a user sees: every ``console`` block is typed in, and must answer so."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import RunCli

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```console\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PROGRAM = ["python", "-m", "builder"]
PAGES = [page for page in sorted((ROOT / "docs").rglob("*.md")) if BLOCK.search(page.read_text(encoding="utf-8"))]


def typed(page: Path) -> Iterator[tuple[str, str]]:
    """Every command of the page with the message below it, ``""`` where the page shows none."""
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        for entry in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, message = entry.partition("\n")
            yield command, message


@pytest.mark.skipif(shutil.which("bash") is None, reason="the pages write lines of a Unix shell")
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
    for command, message in typed(page):
        words = shlex.split(command)
        if words[:3] != PROGRAM:
            subprocess.run(["bash", "-c", command], check=True)
            continue
        capsys.readouterr()
        status = run_cli(*words[3:])
        assert status == (2 if message else 0), command
        if message:
            assert capsys.readouterr().err.split() == message.split(), command


def test_pages_show_messages() -> None:
    assert len(PAGES) >= 4
