"""What long work shows: on a terminal a line that changes, in a pipe a line now and then, of short work nothing."""

from __future__ import annotations

import io
import re
import time

import pytest
from rich.console import Console

import builder.base.progress
from builder.base.progress import Work, progress


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """Text that a pipe gets, with a minute and half a minute as 0.2 s and 0.1 s."""
    text = io.StringIO()
    monkeypatch.setattr(builder.base.progress, "err", Console(file=text, width=120))
    monkeypatch.setattr(builder.base.progress, "PIPE_AFTER_S", 0.2)
    monkeypatch.setattr(builder.base.progress, "PIPE_EVERY_S", 0.1)
    return text


def test_in_a_pipe_long_work_gives_lines_and_short_work_none(shown: io.StringIO) -> None:
    with progress("waiting"):
        time.sleep(0.05)
    assert shown.getvalue() == ""
    with progress("reading") as told:
        told("training", 1, 4)
        time.sleep(0.5)
    lines = shown.getvalue().splitlines()
    assert 2 <= len(lines) <= 4
    assert lines[0].startswith("training: 1 of 4, 0 s")


def test_on_a_terminal_the_line_has_step_count_and_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    text = io.StringIO()
    monkeypatch.setattr(builder.base.progress, "err", Console(file=text, force_terminal=True, width=120))
    monkeypatch.setattr(builder.base.progress, "TERMINAL_AFTER_S", 0.0)
    with progress("reading") as told:
        told("training", 0, 4)
        time.sleep(0.2)
        told("training", 2, 4)
        time.sleep(0.5)
    assert re.search(r"training: 2 of 4, \d s, about \d s left", text.getvalue())


def test_the_line_ends_with_the_work_even_if_it_fails(shown: io.StringIO) -> None:
    with pytest.raises(ZeroDivisionError), progress("dividing"):
        raise ZeroDivisionError
    time.sleep(0.3)
    assert shown.getvalue() == ""


def test_the_time_left_is_by_the_pace_of_the_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    work = Work("reading")
    assert work.left_s is None
    work("training", 2, 10)  # two were there before
    now[0] += 30.0
    work("training", 5, 10)
    assert work.left_s == pytest.approx(50.0)
    now[0] += 20.0
    assert work.left_s == pytest.approx(30.0)
    work("judging", 0, 3)  # another sum: its own pace
    assert work.left_s is None
