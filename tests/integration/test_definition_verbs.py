"""The verbs new, check and schema as users meet them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import RunCli


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_new_definition_is_checked_and_builds(
    home: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli("new", "mine.toml", "--like", "heated_rod") == 0
    assert run_cli("check", "mine.toml", "--output", "network.svg") == 0
    shown = capsys.readouterr().out
    assert "mine.toml is valid: mine (without geometry)" in shown
    assert "23 links; conductances in W/K" in shown and "total                     10   50    100" in shown
    assert (home / "network.svg").read_text(encoding="utf-8").lstrip().startswith("<?xml")
    assert run_cli("build-fmu", "--gearbox", "mine.toml", "--target", "python", "--output", "fmu") == 0
    assert (home / "fmu/mine.fmu").is_file()


def test_the_losses_that_check_prints_are_the_models(
    home: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli("check", "la_haute_borne", "--output", "network.png") == 0
    shown = capsys.readouterr().out
    assert "200 to the surroundings in all" in shown  # 30 of pipes, 150 and 20 of the casing
    lines = {line.split("  ")[0]: line.split() for line in shown.splitlines() if "  " in line}
    # At the reference every loss is what the definition states: 8000 + 20000 + 2 (1500 + 800) W.
    assert lines["total"][-1] == "32600"
    assert lines["viscosity, mm2/s"][-1] == "24"
    assert (home / "network.png").read_bytes().startswith(b"\x89PNG")


def test_typical_values_are_marked(home: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli("new", "mine.toml", "--like", "conveyor") == 0
    text = (home / "mine.toml").read_text(encoding="utf-8")
    (home / "mine.toml").write_text(text.replace('named = "P150"', 'named = "ISO_VG_150"'), encoding="utf-8")
    assert run_cli("check", "mine.toml") == 0
    shown = capsys.readouterr().out
    assert "oil: density_kg_m3 890.0 (typical: data sheet" in shown
    assert (home / "out/mine/network.svg").is_file()


def test_the_schema_is_json_on_the_terminal_and_in_a_file(
    home: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli("schema") == 0
    printed = capsys.readouterr().out
    assert run_cli("schema", "--output", "s.json") == 0
    assert (home / "s.json").read_text(encoding="utf-8") == printed
    assert json.loads(printed)["$schema"].startswith("http://json-schema.org/")


def test_what_can_be_named_is_listed(run_cli: RunCli, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli("check", "--known") == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in ("ISO_VG_220", "204 to 220", "la_haute_borne"))
