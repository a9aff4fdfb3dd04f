"""House rules that no linter knows: plain technical English in docstrings, messages and docs, and files of 500 lines.

``python .ci/check_style.py`` prints every breach and ends with status 1 if there is one.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("gearbox_twin", "models", "diagnosis", "builder", "fmu_src")
SIZED = (*PACKAGES, "tests", "benchmarks", "examples")
MOST_LINES = 500
FEWEST_WORDS = 3  # shorter texts are names and keys

# Phrase, and what to write instead.
PHRASES = {
    r"\b(?:told|tells?|telling)\b": "gives, shows, reports, states",
    r"\banew\b": "again",
    r"\bbeside\b": "next to, with, given",
    r"\bby all appearance\b": "apparently, or the evidence",
    r"^\s*The same\b": "say the whole; the reader has not read the neighbour",
    r"^\s*Whether\b": "True if ...",
    r"^\s*What\b(?!.*\?)": "name the thing",
    r"^\s*Of (?:the|a|an|all|this|that)\b": "start with a noun or a verb",
    r"\b[Nn]one where\b": "None if",
    r"\bof (?:its|their) own\b": "own, separate",
    r"\b(?:stands?|stood) for\b": "represents, replaces",
    r"\bspeaks? (?:for|against)\b": "supports, contradicts",
    r"\bas far as\b": "if, up to",
    r"\bin earnest\b": "really (or nothing)",
    r"(?<!there )\bis none\b": "is not a",
    r"\b(?:hears?|heard)\b": "receives, logs",
    r"\b(?:says|said)\b": "shows, contains, states",
    r"\bwhat (?:was|is|were|has|had) (?:found|told|said|shown|seen|left|meant)\b": "name the thing",
    r"\bin distress\b": "far outside its prior",
    r"\bof the house\b": "of this project",
}
# In pages of docs these phrases and those for the start of a text are common English.
NOT_IN_DOCS = (r"\b(?:says|said)\b", r"\bwhat (?:was|is|were|has|had) (?:found|told|said|shown|seen|left|meant)\b")


def texts(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Docstrings, messages and other texts of several words, with their lines; f-strings as one text."""
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = [str(p.value) if isinstance(p, ast.Constant) else "{}" for p in node.values]
            text = "".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            text = node.value
        else:
            continue
        if len(text.split()) >= FEWEST_WORDS:
            yield node.lineno, text


def summary_lines(tree: ast.Module) -> set[int]:
    """Lines at which a docstring starts: only there the patterns for the start of a text apply."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    return {
        node.body[0].lineno
        for node in ast.walk(tree)
        if isinstance(node, documented) and ast.get_docstring(node, clean=False) is not None
    }


def phrase_faults(path: Path, name: str) -> Iterator[str]:
    """Phrases of the list in one file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    summaries = summary_lines(tree)
    for line, text in texts(tree):
        for pattern, better in PHRASES.items():
            if pattern.startswith("^") and line not in summaries:
                continue
            found = re.search(pattern, text)
            if found:
                at = line + text[: found.start()].count("\n")
                yield f"{name}:{at}: {found[0].strip()!r}: better: {better}"


def docs_faults(path: Path) -> Iterator[str]:
    """Phrases of the list in one page of docs."""
    patterns = {p: better for p, better in PHRASES.items() if not p.startswith("^") and p not in NOT_IN_DOCS}
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        text = "\n".join("".join(c["source"]) for c in json.loads(text)["cells"] if c["cell_type"] == "markdown")
    for number, line in enumerate(text.splitlines(), 1):
        for pattern, better in patterns.items():
            if found := re.search(pattern, line):
                yield f"{path.relative_to(ROOT).as_posix()}:{number}: {found[0]!r}: better: {better}"


def notebook_faults(path: Path) -> Iterator[str]:
    """Outputs in a notebook, figures without a text for people who do not see them, claims that nothing checks."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    codes = [cell for cell in cells if cell["cell_type"] == "code"]
    for cell in codes:
        where, source = f"{path.relative_to(ROOT).as_posix()}, cell {cell['id']}", "".join(cell["source"])
        if cell["outputs"] or cell["execution_count"]:
            yield f"{where}: has outputs; commit notebooks without: jupyter nbconvert --clear-output --inplace FILE"
        draws = "subplots(" in source or "SVG(" in source
        if draws and not cell["metadata"].get("mystnb", {}).get("image", {}).get("alt"):
            yield f"{where}: a figure needs a text: metadata mystnb.image.alt"
    if not codes or "assert " not in "".join(codes[-1]["source"]):
        yield f"{path.relative_to(ROOT).as_posix()}: the last cell must assert what the page claims"


def main() -> int:
    """Check all files; the exit status."""
    faults = []
    for folder in SIZED:
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            lines = path.read_text(encoding="utf-8").count("\n")
            if lines > MOST_LINES:
                faults.append(f"{name}: {lines} lines; split it, at most {MOST_LINES} are allowed")
            if folder in PACKAGES:
                faults += phrase_faults(path, name)
    for path in sorted((ROOT / "docs").rglob("*.md")):
        faults += docs_faults(path)
    for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        faults += [*docs_faults(path), *notebook_faults(path)]
    print("\n".join(faults) or "style: no faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
