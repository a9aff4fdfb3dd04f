"""README and docs agree with the code: commands, options, files. Sphinx checks the links of the docs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from builder.commands.cli import commands

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in PAGES).replace("\\\n", "")


def test_every_verb_exists() -> None:
    verbs = set(re.findall(r"python -m builder ([a-z-]+)", TEXT))
    assert {"build-fmu", "simulate", "reproduce"} <= verbs <= set(commands.commands)


def test_every_option_exists() -> None:
    known = {name for command in commands.commands.values() for p in command.params
             for name in (*p.opts, *p.secondary_opts)}  # fmt: skip
    named = {o for line in TEXT.splitlines() if "-m builder" in line for o in re.findall(r" (--[a-z-]+)", line)}
    assert named - {"--quiet"} <= known


def test_every_file_exists() -> None:
    paths = re.findall(r"(?:examples|models|docs|benchmarks)/[\w./-]+\.(?:py|toml|csv(?:\.gz)?|png)", TEXT)
    assert paths
    assert [path for path in paths if not (ROOT / path).is_file()] == []


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken_links(page: Path) -> Iterator[str]:
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" in link:
            continue
        file, _, anchor = link.partition("#")
        target = page.parent / file if file else page
        if not target.is_file() or (anchor and anchor not in anchors(target)):
            yield f"{page.name}: {link}"


def test_every_link_resolves() -> None:
    assert [link for name in ("README.md", "CHANGELOG.md") for link in broken_links(ROOT / name)] == []


def test_a_broken_link_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A title, here\n[a](#a-title-here) [b](#other) [c](none.md) [d](https://example.org/x)\n")
    assert list(broken_links(page)) == ["page.md: #other", "page.md: none.md"]
