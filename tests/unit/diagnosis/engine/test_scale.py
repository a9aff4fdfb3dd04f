"""The common factor of all sizes, which temperatures do not know."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.engine.fit import Fit
from diagnosis.engine.scale import all_sizes_are_unknown, at_stated_size, scale_direction
from diagnosis.engine.unknown import NetworkParameter
from models.assembly.gearbox import load_gearbox


def unknowns_of(name: str) -> list[NetworkParameter]:
    return [NetworkParameter(parameter=p) for p in load_gearbox(name).network().parameters if p.sd > 0.0]


@pytest.mark.parametrize(("name", "free"), [("reducer", True), ("la_haute_borne", True), ("fzg", False)])
def test_sizes_are_all_unknown_without_geometry(name: str, free: bool) -> None:
    network, unknowns = load_gearbox(name).network(), unknowns_of(name)
    assert all_sizes_are_unknown(network, unknowns) is free
    known = [one for one in unknowns if one.parameter.name != "C_oil"]
    assert not all_sizes_are_unknown(network, known)  # one capacity that is known fixes all


@pytest.mark.parametrize(("channels", "moved"), [(("oil",), True), (("oil", "P_loss"), False)])
def test_estimates_keep_the_stated_size_unless_a_loss_is_measured(channels: tuple[str, ...], moved: bool) -> None:
    """All sizes at a third: ratios stay as they are, and the mean as the priors weigh it comes back."""
    network, unknowns = load_gearbox("reducer").network(), unknowns_of("reducer")
    direction = scale_direction(network, unknowns)
    ratios = np.linspace(-1.0, 1.0, len(unknowns))
    ratios -= direction * (ratios @ direction) / (direction @ direction)
    experiment = SimpleNamespace(network=network, unknowns=unknowns,
                                 pieces=[SimpleNamespace(channels=channels)])  # fmt: skip
    small = ratios + direction * np.log(1.0 / 3.0)
    assert [one.value(z) for one, z in zip(unknowns, small - ratios, strict=True)][:2] == pytest.approx([1.0 / 3.0] * 2)
    fit = Fit(experiment=cast(Any, experiment), z=small, linearised=cast(Any, None))
    np.testing.assert_allclose(at_stated_size(fit).z, ratios if moved else small, atol=1e-12)
