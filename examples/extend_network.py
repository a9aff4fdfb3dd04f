"""Add physics of your own to a gearbox's thermal network and compare, with the full loss model.

python examples/extend_network.py
"""

from __future__ import annotations

from pathlib import Path

from gearbox_twin import load_gearbox, read_cycle

gearbox = load_gearbox("fzg")
nominal = gearbox.network()
extended = nominal.with_source("oil", lambda s: 8.0 * (s.speed / 3000.0) ** 3, name="extra", is_loss=True).with_link(
    "housing", "frame", lambda s: 3.0, name="foot"
)

cycle = read_cycle(Path(__file__).with_name("drive_cycle_600s.csv"))
for name, network in (("nominal", nominal), ("extended", extended)):
    result = gearbox.simulate(cycle, initial=20.0, network=network)
    print(f"{name:9s} oil {result.temperatures['oil'][-1]:.2f} degC, loss {result.loss[-1]:.1f} W")
