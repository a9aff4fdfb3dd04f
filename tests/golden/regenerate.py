"""Our own numbers, kept to see any change: losses of the full model, and one cycle of the rig.

``python -m tests.golden.regenerate`` writes the file again. Do that when the physics changes on purpose, and say so in
the changelog; never to turn a red test green.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from models.assembly.gearbox import load_gearbox

FILE = Path(__file__).with_name("rig.json")
CYCLE: dict[str, list[float]] = {
    "time_s": [0.0, 60.0, 120.0, 180.0, 300.0, 302.0, 420.0, 480.0, 600.0],
    "speed_rpm": [0.0, 1500.0, 3000.0, 3000.0, 3000.0, 3000.0, -2000.0, 5000.0, 0.0],
    "torque_Nm": [0.0, 50.0, 300.0, 300.0, 300.0, 30.0, 30.0, -100.0, 0.0],
    "T_ambient_degC": [20.0, 20.0, 21.0, 22.0, 23.0, 23.0, 24.0, 25.0, 25.0],
}


def points() -> dict[str, list[Any]]:
    """Forty operating points over the training range, with corners and the floors."""
    rng = np.random.default_rng(2024)
    speed = np.exp(rng.uniform(0.0, np.log(6500.0), 40)) * rng.choice([-1.0, 1.0], 40)
    torque = rng.uniform(-350.0, 350.0, 40)
    speed[:5], torque[:5] = [0.0, 0.3, 1.0, 6500.0, 6500.0], [100.0, 0.0, 0.4, 350.0, 0.0]
    return {
        "speed_rpm": speed.round(3).tolist(),
        "torque_Nm": torque.round(3).tolist(),
        "temperatures_degC": rng.uniform(-20.0, 200.0, (40, 7)).round(2).tolist(),
    }


def golden() -> dict[str, Any]:
    """Everything that the file holds, computed again."""
    gearbox = load_gearbox("fzg")
    losses, at = gearbox.losses(), points()
    power = losses.power(at["speed_rpm"], at["torque_Nm"], at["temperatures_degC"])
    result = gearbox.network().simulate(CYCLE, losses=losses, initial=20.0)
    columns = {name: values.tolist() for name, values in result.columns().items() if name != "in_domain"}
    return {
        "points": at,
        "losses_W": dict(zip(losses.components, power.T.tolist(), strict=True)),
        "cycle": columns,
        "heat_J": {name: getattr(result, name).tolist() for name in ("heat_in", "heat_out", "heat_stored")},
    }


if __name__ == "__main__":
    FILE.write_text(json.dumps(golden(), indent=1) + "\n", encoding="utf-8")
