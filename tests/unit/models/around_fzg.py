"""The FZG file with a flange, a water jacket, a bed and heat of the motor around it."""

from __future__ import annotations

from models.assembly.gearbox import Gearbox, read_gearbox
from tests.unit.models.fzg_file import FZG

TABLES = """
[[input]]
name = "coolant_flow"
quantity = "volume flow"
unit = "l/min"
range = [0.0, 20.0]
default = 0.0

[[parameter]]
name = "share"
start = { value = 0.02, sd = "50 %" }

[[boundary]]
name = "flange"
input = "T_flange"
temperature_degC = 40.0

[[boundary]]
name = "coolant"
input = "T_coolant"
temperature_degC = 50.0

[[part]]
name = "bed"
heat_capacity_J_K = { value = 40000.0, sd = "30 %", source = "weighed" }
group = "housing"

[[link]]
between = ["housing_upper", "flange"]
conductance_W_K = { value = 12.0, sd = "40 %" }

[[link]]
between = ["housing_upper", "coolant"]
conductance_W_K = 60.0
factor = "coolant_flow / 8"

[[link]]
between = ["housing_lower", "bed"]
conductance_W_K = 15.0

[[link]]
between = ["bed", "air"]
conductance_W_K = 2.0

[[heat]]
name = "motor"
part = "shaft_1"
heat_W = "share * abs(speed * torque) * 0.1047"
"""


def around_fzg(*changes: tuple[str, str]) -> Gearbox:
    """Return that gearbox, texts of the tables exchanged (their first occurrence)."""
    text = TABLES
    for old, new in changes:
        assert old in text, f"the tables have no {old!r}"
        text = text.replace(old, new, 1)
    return read_gearbox(FZG + text, file="around.toml")
