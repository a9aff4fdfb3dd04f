"""Sizes and priors of candidates follow from the gearbox and from the recording."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import hypothesis_of
from models.assembly.gearbox import Gearbox, load_gearbox
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import CHANNELS


def test_oil_that_thickens_costs_more_in_bearings_and_less_in_the_mesh(fzg: Gearbox) -> None:
    """Exponents of viscosity as the loss model has them, against the literature and against their definition."""
    scale = Scale.of(fzg, speed=2600.0, torque=150.0)
    exponents = scale.viscosity_exponents
    assert all(0.2 < exponents[f"bearing_{k}"] < 0.6 for k in (1, 2, 3, 4))  # SKF: M_rr ~ nu^0.6, less with starvation
    assert -0.4 < exponents["mesh_sliding"] < 0.0  # a thicker film carries more of the load
    assert 0.5 < exponents["mesh_rolling"] < 0.8  # ~ film thickness, nu^0.67 to 0.7
    assert exponents["churning"] == pytest.approx(0.0)  # Niemann's formula has no viscosity
    (placed,) = CATALOGUE["oil_ageing"].placed(fzg.network(), scale)
    weights = dict(placed.weighted)
    assert "churning" not in weights and weights["mesh_sliding"] == pytest.approx(exponents["mesh_sliding"], abs=0.005)
    farm = load_gearbox("la_haute_borne")
    stated = Scale.of(farm).viscosity_exponents
    assert stated["gears_no_load"] == pytest.approx(0.2) and stated["bearing_1_no_load"] == pytest.approx(0.4)
    assert stated["gears_load"] == pytest.approx(0.0)


def test_clocks_of_slow_rows_may_differ_by_more(fzg: Gearbox) -> None:
    network = fzg.network()
    sizes = [CATALOGUE["clock_offset"].placed(network, Scale.of(fzg, interval=step), CHANNELS)[0].strength.sd
             for step in (1.0, 10.0, 600.0)]  # fmt: skip
    assert sizes == [60.0, 60.0, 1800.0]
    variants = hypothesis_of(CATALOGUE["clock_offset"].placed(network, Scale.of(fzg), CHANNELS)[0]).variants
    assert set(np.sign(variants[:, 0])) == {-1.0, 1.0} and len(set(np.abs(variants[:, 0]))) > 1
