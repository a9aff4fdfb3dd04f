"""Tests of the sentences of findings."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.results.findings import _says, switching_of
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale


@pytest.mark.parametrize(("value", "stated", "slip"), [
    (976.0, 1.0, True), (0.001, 1.0, True), (3.1, 1.0, False), (0.4, 0.0, False),
])  # fmt: skip
def test_a_parameter_that_is_off_by_a_unit_asks_for_the_unit(value: float, stated: float, slip: bool) -> None:
    effect = Hypothesis(name="parameter", place="gears_load", family="parameter", unknown=0,
                        law="parameter gears_load", variants=np.ones((1, 1)), how="parameter")  # fmt: skip
    answer = cast(Any, SimpleNamespace(effect=effect, acts_like=False, one_event=False, tied=()))
    says = _says(answer, {"gears_load": value}, {"gears_load": stated})
    assert says.startswith(f"The parameter gears_load is {value:.3g}, far from what the definition allows.")
    assert ("It has 1: look first for a wrong unit" in says) is slip


def test_switch_temperatures_are_on_and_off(fzg: Gearbox) -> None:
    for name, on, off in (("cooler_thermostat", 73.0, 67.0), ("heater_thermostat", 67.0, 73.0)):
        term, *_ = CATALOGUE[name].placed(fzg.network(), Scale.of(fzg))
        values = {p.name: (p.start, 0.0) for p in term.parameters}
        values |= {f"{term.label}_set_point": (70.0, 1.0), f"{term.label}_band": (6.0, 1.0)}
        found = switching_of(values, hypothesis_of(term))
        assert found is not None and (found.on_degC, found.off_degC) == (on, off), name
