"""Kept files: whole or not there, and no trouble if they cannot be kept."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from platformdirs import user_cache_path

from builder.base.cache import CACHE_VARIABLE, cached_path, keep, recall


def test_the_folder_is_the_users_or_the_named_one_or_none(monkeypatch: pytest.MonkeyPatch) -> None:
    assert cached_path("a") not in (None, user_cache_path("gearbox-thermal-twin", appauthor=False) / "a")  # of the run
    monkeypatch.delenv(CACHE_VARIABLE)
    assert cached_path("a") == user_cache_path("gearbox-thermal-twin", appauthor=False) / "a"
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    assert cached_path("a") is None
    assert recall(None) is None and not keep(None, b"content")


def test_what_is_kept_comes_back_and_what_cannot_be_kept_is_no_error(tmp_path: Path) -> None:
    path = tmp_path / "new" / "file"
    assert recall(path) is None
    assert keep(path, b"one") and keep(path, b"two")
    assert recall(path) == b"two"
    assert [file.name for file in path.parent.iterdir()] == ["file"]
    assert not keep(path / "below a file", b"content") and recall(path / "below a file") is None
    assert not keep(path.parent, b"in place of a folder") and recall(path.parent) is None


def test_a_reader_sees_a_whole_file_whoever_writes(tmp_path: Path) -> None:
    path, contents = tmp_path / "file", [bytes([digit]) * 200_000 for digit in b"abcd"]

    def write_often(content: bytes) -> bool:
        return all(keep(path, content) for _ in range(50))

    with ThreadPoolExecutor() as pool:
        written = [pool.submit(write_often, content) for content in contents]
        seen = []
        while not all(one.done() for one in written):
            seen.append(recall(path))
        assert all(one.result() for one in written)
    assert {content for content in seen if content is not None} <= set(contents)
    assert recall(path) in contents and [file.name for file in tmp_path.iterdir()] == ["file"]
