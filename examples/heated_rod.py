"""The heated rod, 16 h after the first 8 h: errors of the nominal model and of the corrected one, and a drawing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gearbox_twin import Cycle, load_gearbox, read_correction, read_recordings

HERE = Path(__file__).parent
RECORDING = HERE / "data" / "heated_rod.csv.gz@28800..86390"
SHOWN = {"cell_1": "NTC1", "cell_5": "NTC5", "cell_6": "NTC6", "cell_9": "NTC10", "cell_12": "NTC13"}
EVERY = 30  # rows

machine = load_gearbox("heated_rod")
nominal = machine.network()
corrected = read_correction(HERE / "heated_rod_correction.toml", machine).network(machine)
(recording,) = read_recordings(RECORDING, machine)
cycle = Cycle(recording.time[::EVERY], {name: values[::EVERY] for name, values in recording.inputs.items()})
channels = {c.name.partition("__")[0]: c for c in recording.channels if not c.name.endswith("NTC7")}
start = {name: float(channel.values[0]) for name, channel in channels.items()}
results = [machine.simulate(cycle, initial=start, network=network) for network in (nominal, corrected)]
for name, result in zip(("nominal", "corrected"), results, strict=True):
    errors = [result.temperatures[node] - channel.values[::EVERY] for node, channel in channels.items()]
    print(f"{name}: {np.sqrt(np.mean(np.square(errors))):.2f} K over {len(errors)} thermistors")

figure = Figure(figsize=(8.0, 5.0), layout="constrained")
axes = figure.add_subplot()
hours = cycle.time / 3600.0
for (node, sensor), colour in zip(SHOWN.items(), ("#D55E00", "#E69F00", "#009E73", "#56B4E9", "#0072B2"), strict=True):
    axes.plot(hours, channels[node].values[::EVERY], color=colour, linewidth=2.5, alpha=0.5, label=f"{sensor} measured")
    axes.plot(hours, results[0].temperatures[node], color=colour, linestyle=":")
    axes.plot(hours, results[1].temperatures[node], color=colour, linestyle="--")
axes.plot([], [], color="black", linestyle=":", label="nominal model")
axes.plot([], [], color="black", linestyle="--", label="corrected model")
axes.set(xlabel="Time in h", ylabel="Temperature in °C", title="Heated rod, 16 h that the correction has not seen")
axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
axes.grid(alpha=0.3)
output = Path(sys.argv[1] if len(sys.argv) > 1 else "heated_rod.png")
figure.savefig(output, dpi=130)
print(f"wrote {output}")
