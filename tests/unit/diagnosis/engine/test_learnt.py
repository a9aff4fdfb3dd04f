"""The file of learnt numbers: what is read from it, priors that sum to one, an origin of every number."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from importlib.resources import files
from itertools import pairwise
from typing import get_args

import pytest

from diagnosis.candidates.hypotheses import How
from diagnosis.engine.learnt import FILE, deviation_priors, error_classes, family_priors, rule

LEAST_ORIGIN = 80  # characters


def text() -> str:
    return (files("diagnosis.engine") / FILE).read_text(encoding="utf-8")


def tables() -> Iterator[tuple[str, str]]:
    """Name of every table, and the remarks before it."""
    remarks: list[str] = []
    for line in text().splitlines():
        if line.startswith("#"):
            remarks.append(line)
        elif found := re.match(r"\[+([a-z.]+)\]+$", line):
            yield found[1], " ".join(remarks)
            remarks = []


def test_priors_sum_to_one() -> None:
    assert sum(one.prior for one in error_classes()) == pytest.approx(1.0)
    assert sum(deviation_priors().values()) == pytest.approx(1.0)
    assert all(p > 0.0 for p in (*family_priors().values(), *deviation_priors().values()))


def test_a_class_may_be_scaled() -> None:
    splits = next(one for one in error_classes() if one.name == "splits")
    twice = splits.scaled(2.0)
    assert twice.amplitudes == {group: 2.0 * value for group, value in splits.amplitudes.items()}
    assert (twice.name, twice.prior, splits.scaled(1.0)) == (splits.name, splits.prior, splits)


def test_every_family_of_candidates_has_a_prior() -> None:
    assert set(family_priors()) == set(get_args(How))


def test_sessions_may_be_alike() -> None:
    deviations = list(deviation_priors())
    assert deviations[0] == 0.0 and all(a < b for a, b in pairwise(deviations))


def test_the_rule_is_read() -> None:
    found = tomllib.loads(text())["decision"]
    assert (rule().rate, rule().temper) == (found["rate"], tuple(found["temper"]))
    assert 0.0 < rule().refuted < 1.0 and 0.0 < rule().alike < 1.0 and rule().wider > 1.0


def test_every_number_has_an_origin() -> None:
    """The classes have the one of the file, all other numbers a remark before their first table."""
    document, remarks = tomllib.loads(text()), list(tables())
    assert len(document["origin"].strip()) > LEAST_ORIGIN
    names = [name for name, _ in remarks]
    for table in sorted({name.split(".")[0] for name in names} - {"class"}):
        before = remarks[next(i for i, name in enumerate(names) if name.startswith(table))][1]
        assert len(before) > LEAST_ORIGIN, table
    assert all("Origin:" in remark for name, remark in remarks if name in ("decision", "prior.families"))
    assert set(document["check"]) == {"seed", "commit", "command"}


def test_every_number_of_the_rule_has_a_meaning() -> None:
    lines = text().split("[decision]\n")[1].split("\n\n")[0].splitlines()
    assert len(lines) == len(tomllib.loads(text())["decision"])
    assert all(re.search(r"# \S+ \S+", line) for line in lines)
