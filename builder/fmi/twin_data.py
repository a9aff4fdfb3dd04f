"""Data of an FMU for :class:`fmu_src.python.twin.Twin`: signals, network and losses as plain numbers and strings."""

from __future__ import annotations

import hashlib
import json
import sys
from typing import Any

from builder.fmi.signals import Signal, SignalTable
from fmu_src.python.twin import LISTS
from models.network.compiled import compile_laws, law_source
from models.portable.surrogate import SurrogateLosses
from models.simulation.thermal_network import ThermalNetwork


def twin_data(
    table: SignalTable, network: ThermalNetwork, losses: SurrogateLosses, *, definition: str
) -> dict[str, Any]:
    """Everything that :class:`fmu_src.python.twin.Twin` needs in addition to the law functions."""
    laws = compile_laws(network, vector=False)
    arrays = ("laplacian", "to_boundary", "injection")
    data: dict[str, Any] = {
        "signals": [_slot(signal) for signal in table],
        "network": {
            **{name: list(getattr(laws, name)) for name in LISTS},
            **{name: getattr(laws, name).tolist() for name in arrays},
            "updates": laws.updates,
            "state_starts": [float(state.start) for state in network.states],
        },
        "losses": losses.to_dict(),
        "definition": definition,
    }
    return data | {"identity": hashlib.sha256(to_json(data) + to_json(law_source(network, vector=False))).hexdigest()}


def _slot(signal: Signal) -> dict[str, Any]:
    """One signal for :class:`fmu_src.python.twin.Slot`."""
    settable = {"input": "input", "parameter": signal.variability}.get(signal.causality, "")
    scale, offset = signal.to_inner
    return {
        "name": signal.name,
        "role": signal.role,
        "of": signal.of,
        "unit": signal.unit or "",
        "boolean": signal.is_boolean,
        "settable": settable,
        "start": 0.0 if signal.start is None else float(signal.start),
        "minimum": max(signal.minimum, -sys.float_info.max),
        "maximum": min(signal.maximum, sys.float_info.max),
        "scale": scale,
        "offset": offset,
    }


def to_json(data: Any) -> bytes:
    """Encode plain data as JSON."""
    return json.dumps(data, indent=1, allow_nan=False).encode()
