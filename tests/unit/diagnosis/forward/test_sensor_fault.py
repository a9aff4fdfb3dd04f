"""Readings of faulty sensors along a simulated cycle: every form against its formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from diagnosis.forward.recorder import read_as_recorded
from models.correction.correction import Correction, Finding
from models.network.laws import Parameter
from models.terms.term import Form, Term

TIME = np.arange(0.0, 1000.0, 10.0)
OIL, PINION = 40.0 + TIME / 50.0, 60.0 + 5.0 * np.sin(TIME / 100.0)
COLUMNS = {"time_s": TIME, "T_ambient_degC": np.full(100, 20.0), "T_oil_degC": OIL, "T_pinion_degC": PINION}
OIL_READ, PINION_READ = "T_oil_degC_as_recorded", "T_pinion_degC_as_recorded"


def fault(form: Form, *target: str, law: str, size: float) -> Term:
    strength = Parameter(name="size", unit="K", start=size, lower=-100.0, upper=100.0, sd=1.0, log=False)
    return Term(
        label="fault", kind="sensor", target=target, expression=sp.sympify(law), parameters=(strength,), form=form,
        of_measurement=True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("terms", "expected"),
    [
        ([fault("shift", "oil", law="size*time/1000", size=3.0)], {OIL_READ: OIL + 3e-3 * TIME}),
        ([fault("shift", "oil", law="size*(T_oil - T_ambient)", size=0.1)], {OIL_READ: OIL + 0.1 * (OIL - 20.0)}),
        ([fault("lag", "oil", law="size", size=50.0)], {OIL_READ: OIL - (1.0 - np.exp(-TIME / 50.0))}),
        ([fault("clock", "oil", law="size", size=25.0)], {OIL_READ: np.interp(TIME - 25.0, TIME, OIL)}),
        (
            [fault("stuck", "oil", law="Piecewise((size, time >= 495), (0, True))", size=1.0)],
            {OIL_READ: np.where(TIME < 495.0, OIL, OIL[50])},
        ),
        (  # from 95 to 295 s and from 495 s on, each time as it was at the beginning
            [
                fault(
                    "stuck",
                    "oil",
                    law="Piecewise((0, time < 95), (size, time < 295), (0, time < 495), (size, True))",
                    size=1.0,
                )
            ],
            {
                OIL_READ: np.where(
                    TIME < 95.0, OIL, np.where(TIME < 295.0, OIL[10], np.where(TIME < 495.0, OIL, OIL[50]))
                )
            },
        ),
        ([fault("swapped", "oil", "pinion", law="size", size=1.0)], {OIL_READ: PINION, PINION_READ: OIL}),
        (
            [fault("shift", "oil", law="size", size=2.0), fault("stuck", "oil", law="size", size=1.0)],
            {OIL_READ: np.full(100, OIL[0] + 2.0)},
        ),
        ([fault("shift", "oil__sump", law="size", size=2.0)], {"T_oil__sump_degC_as_recorded": OIL + 2.0}),
        ([fault("shift", "bearing_1", law="size", size=2.0)], {}),
    ],
)
def test_readings_of_a_faulty_sensor(terms: list[Term], expected: dict[str, np.ndarray]) -> None:
    findings = [Finding.of(replace(term, label=f"fault_{i}"), {"size": (term.strength.start, 0.0)}, mechanism="fault")
                for i, term in enumerate(terms)]  # fmt: skip
    found = read_as_recorded(COLUMNS, Correction(finding=tuple(findings)))
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, atol=1e-9)
