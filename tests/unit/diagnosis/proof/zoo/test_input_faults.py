"""The fault of a recorded input as the true input's error, as strengths are drawn with it."""

from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.proof.zoo.case import _as_felt


def test_an_ambient_sensor_near_a_probe_that_sees_air_feels_its_bodies() -> None:
    plant = SimpleNamespace(
        bodies=[SimpleNamespace(name="cover"), SimpleNamespace(name="base")],
        probes=[SimpleNamespace(channel="housing", mix={"cover": 0.6, "base": 0.2, "air": 0.2})],
    )
    fault = SimpleNamespace(channels=("T_ambient",), kind="input_near", near="housing", sign=1, strength=0.5,
                            course=SimpleNamespace(share=lambda hours: np.ones_like(hours)))  # fmt: skip
    moment = SimpleNamespace(T={"cover": np.array([60.0]), "base": np.array([40.0])}, hours=np.array([1.0]),
                             inputs={"T_ambient": np.array([20.0])})  # fmt: skip
    change = _as_felt(fault, plant)  # type: ignore[arg-type]
    assert change.law(moment) == pytest.approx(-0.5 * (55.0 - 20.0))  # type: ignore[arg-type]
