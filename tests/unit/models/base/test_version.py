"""The version and the licence are this program's, whatever lies next to it."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import pytest
from click.testing import CliRunner

from builder.commands.cli import commands
from models.base import version


@pytest.mark.parametrize("foreign", ['[project]\nname = "another"\nversion = "9.9.9"\n', "[tool.x]\n"])
def test_a_foreign_project_beside_the_installed_one_is_not_ours(
    foreign: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "pyproject.toml").write_text(foreign)
    (tmp_path / "LICENSE").write_text("FOREIGN")
    monkeypatch.setattr(version, "CHECKOUT", tmp_path)
    version.project_version.cache_clear()
    try:
        assert version.project_version() == metadata.version(version.DISTRIBUTION)
        assert "FOREIGN" not in version.license_text()
    finally:
        version.project_version.cache_clear()


def test_one_version_is_told_everywhere() -> None:
    shown = CliRunner().invoke(commands, ["--version"]).output
    assert shown.split() == [version.DISTRIBUTION + ",", "version", version.project_version()]
