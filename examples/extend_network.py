"""Add physics of your own to a gearbox's thermal network and compare, with the full loss model.

python examples/extend_network.py
"""

from __future__ import annotations

from pathlib import Path

from models.assembly.gearbox import load_gearbox
from models.files.cycle_file import read_cycle

gearbox = load_gearbox("fzg")
losses = gearbox.losses()
nominal = gearbox.network()
extended = nominal.with_source("oil", lambda s: 8.0 * (s.speed / 3000.0) ** 3, name="extra", is_loss=True).with_link(
    "housing", "frame", lambda s: 3.0, name="foot"
)

cycle = read_cycle(Path(__file__).with_name("drive_cycle_600s.csv"))
for name, network in (("nominal", nominal), ("extended", extended)):
    result = network.simulate(cycle, losses=losses, initial=20.0)
    print(f"{name:9s} oil {result.temperatures['oil'][-1]:.2f} degC, loss {result.loss[-1]:.1f} W")
