"""Drive a gearbox FMU through a cycle of your own with FMPy, as a script would.

    python examples/drive_cycle.py out/fzg/fzg.fmu

Needs nothing of this project but the FMU: fmpy, numpy, and what runs inside the FMU (onnxruntime).
"""

from __future__ import annotations

import sys

import numpy as np
from fmpy import read_model_description, simulate_fmu

if len(sys.argv) != 2:
    sys.exit("usage: python examples/drive_cycle.py FMU")

# Start, stop and coast: columns of the FMU's inputs in SI units (rad/s, N m, K, m/s).
t = np.arange(0.0, 1801.0)
rpm = np.interp(t, [0, 20, 600, 620, 900, 960, 1800], [0, 1500, 1500, 4000, 4000, 0, 0])
torque = np.interp(t, [0, 20, 600, 620, 890, 900, 960, 1800], [0, 120, 120, 60, 60, -20, 0, 0])
inputs = np.empty(
    len(t),
    dtype=[("time", float), ("speed", float), ("torque", float), ("T_ambient", float), ("air_speed", float)],
)
inputs["time"], inputs["speed"], inputs["torque"] = t, rpm * np.pi / 30.0, torque
inputs["T_ambient"], inputs["air_speed"] = 10.0 + 273.15, 2.0

outputs = {v.name for v in read_model_description(sys.argv[1]).modelVariables if v.causality == "output"}
# Boundaries (the air, a coolant) take heat up; all others are parts of the machine.
nodes = sorted(one for one in outputs if one.endswith(".T") and f"{one.removesuffix('.T')}.heat_flow" not in outputs)
result = simulate_fmu(
    sys.argv[1],
    start_time=0.0,
    stop_time=1800.0,
    output_interval=1.0,
    input=inputs,
    start_values={"initial.T": 10.0 + 273.15, "factor.h_air": 1.2},
    output=[*nodes, "loss.total", "torque_loss", "efficiency", "in_domain"],
)
hottest = max(nodes, key=lambda name: result[name].max())
print(f"time/s  oil/degC  {hottest}/degC  loss/W  efficiency")
for row in result[::180]:
    print(
        f"{row['time']:6.0f} {row['oil.T'] - 273.15:9.1f} {row[hottest] - 273.15:{len(hottest) + 6}.1f} "
        f"{row['loss.total']:7.1f} {row['efficiency']:11.4f}"
    )
