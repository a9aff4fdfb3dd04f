"""Tests of the sentences of findings."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.engine.fit import Fit
from diagnosis.engine.unknown import NetworkParameter
from diagnosis.results.findings import _says, estimates_of, switching_of
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale
from models.network.laws import Parameter


@pytest.mark.parametrize(("value", "stated", "slip"), [
    (976.0, 1.0, True), (0.001, 1.0, True), (3.1, 1.0, False), (0.4, 0.0, False),
])  # fmt: skip
def test_a_parameter_that_is_off_by_a_unit_asks_for_the_unit(value: float, stated: float, slip: bool) -> None:
    effect = Hypothesis(name="parameter", place="gears_load", family="parameter", unknown=0,
                        law="parameter gears_load", variants=np.ones((1, 1)))  # fmt: skip
    answer = cast(Any, SimpleNamespace(effect=effect, acts_like=False, one_event=False, tied=()))
    says = _says(answer, {"gears_load": value}, {"gears_load": stated})
    assert says.startswith(f"The parameter gears_load is {value:.3g}, far from what the definition allows.")
    assert ("It has 1: look first for a wrong unit" in says) is slip


def test_switch_temperatures_are_on_and_off(fzg: Gearbox) -> None:
    housing = ("housing_lower", "housing_upper")
    for name, on, off, of in (("cooler_thermostat", 73.0, 67.0, ("oil",)), ("heater_thermostat", 67.0, 73.0, ("oil",)),
                              ("fan_thermostat", 73.0, 67.0, housing)):  # fmt: skip
        term, *_ = CATALOGUE[name].placed(fzg.network(), Scale.of(fzg))
        values = {p.name: (p.start, 0.0) for p in term.parameters}
        values |= {f"{term.label}_set_point": (70.0, 1.0), f"{term.label}_band": (6.0, 1.0)}
        found = switching_of(values, hypothesis_of(term))
        assert found is not None and (found.on_degC, found.off_degC, found.of) == (on, off, of), name


def test_a_value_beyond_its_bound_keeps_an_error() -> None:
    """A common factor that temperatures do not know may move a parameter beyond its bound."""
    unknown = NetworkParameter(parameter=Parameter(name="f_air", sd=0.2, upper=1.1))
    fit = SimpleNamespace(experiment=SimpleNamespace(unknowns=[unknown]), z=np.array([3.0]), covariance=np.eye(1))
    value, error = estimates_of(cast(Fit, fit))["f_air"]
    assert value == 1.1
    assert error == pytest.approx(0.2 * 1.1)
