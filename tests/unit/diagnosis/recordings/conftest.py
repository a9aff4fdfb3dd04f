"""The machine that the recordings are of."""

from __future__ import annotations

import pytest

from models.assembly.gearbox import Gearbox
from models.simulation.thermal_network import ThermalNetwork


@pytest.fixture(scope="session")
def network(fzg: Gearbox) -> ThermalNetwork:
    return fzg.network()
