"""The verb ``prove``: --real stands alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import RunCli


@pytest.mark.parametrize("other", [
    ["--plant", "own"], ["--seed", "1"], ["--recordings", "."], ["--truth", "."], ["--baselines", "2"],
    ["--gearbox", "fzg"], ["--jobs", "2"],
])  # fmt: skip
def test_real_goes_with_nothing_about_cases(
    other: list[str], run_cli: RunCli, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli("prove", "--real", "rod", *other, "--output", tmp_path / "out") == 2
    assert f"{other[0]} does not go with --real" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_real_does_not_continue(run_cli: RunCli, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answers = tmp_path / "a.jsonl"
    answers.write_text("")
    assert run_cli("prove", "--real", "rod", "--continue", answers, "--output", tmp_path / "out") == 2
    assert "--continue does not go with --real" in capsys.readouterr().err


def test_only_known_plants_are_real(run_cli: RunCli, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli("prove", "--real", "bar") == 2
    assert "rod" in capsys.readouterr().err
