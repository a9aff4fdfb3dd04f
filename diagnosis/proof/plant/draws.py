"""Where an effect of the plant sits and how strong it is: the words in which the tables of effects are written."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from diagnosis.proof.plant.effect import Draw, Places
from diagnosis.proof.plant.plant import Plant

TEMPERATURES, DIFFERENCES = {"T", "T_on", "T_off", "T_melt"}, {"band", "dT"}

# ---------------------------------------------------------------------- places


def at(*places: str) -> Places:
    """Always these places."""
    return lambda _plant, _rng: places


def of(names: Callable[[Plant], tuple[str, ...]]) -> Places:
    """Always those places of a gearbox."""
    return lambda plant, _rng: names(plant)


def one_of(names: Callable[[Plant], tuple[str, ...]]) -> Places:
    """One of those places of a gearbox."""

    def draw(plant: Plant, rng: np.random.Generator) -> tuple[str, ...]:
        known = names(plant)
        return (known[int(rng.integers(len(known)))],)

    return draw


lowest_part = of(lambda plant: plant.anatomy.parts[:1])  # the part of the housing that stands
highest_part = of(lambda plant: plant.anatomy.parts[-1:])
all_parts = of(lambda plant: plant.anatomy.parts)
gears = of(lambda plant: plant.anatomy.gears)
shafts = of(lambda plant: plant.anatomy.shafts)
input_shaft = of(lambda plant: (plant.gearbox.stage[0].driver,))
output_shaft = of(lambda plant: (plant.gearbox.stage[0].driven,))
bearing = one_of(lambda plant: plant.anatomy.bearings)
all_bearings = of(lambda plant: plant.anatomy.bearings)
bearings_of_input = of(
    lambda plant: tuple(b.name for b in plant.gearbox.bearing if b.shaft == plant.gearbox.stage[0].driver)
)

# ---------------------------------------------------------------------- parameters


def drawn(plant: Plant, rng: np.random.Generator, ranges: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Parameters drawn evenly; temperatures are those of the FZG rig and move with how warm another gearbox gets."""
    values = {name: float(rng.uniform(*bounds)) for name, bounds in ranges.items()}
    values |= {name: plant.as_warm(values[name]) for name in values.keys() & TEMPERATURES}
    return values | {name: values[name] * plant.warmth for name in values.keys() & DIFFERENCES}


def relative(nominal: float, highest: float = np.inf, **others: tuple[float, float]) -> Draw:
    """Strength ``a`` in the unit of `nominal`, held at `highest`, others drawn evenly."""
    return lambda plant, rng, strength: {"a": min(nominal * strength, highest)} | drawn(plant, rng, others)


def either(nominal: float) -> Draw:
    """Strength ``a`` of either sign."""
    return lambda _plant, rng, strength: {"a": nominal * strength * (1.0 if rng.random() < 0.5 else -1.0)}


def share_of_loss(nominal: float, **others: tuple[float, float]) -> Draw:
    """Strength ``a`` [W] as a share of the plant's reference loss (330 W on the FZG rig), others drawn evenly."""
    return lambda plant, rng, strength: {"a": nominal * plant.loss_ref * strength} | drawn(plant, rng, others)


def share_of_shed(nominal: float, **others: tuple[float, float]) -> Draw:
    """Strength ``a`` [W/K] as a share of what the housing sheds (7 W/K on the FZG rig), others drawn evenly."""
    return lambda plant, rng, strength: {"a": nominal * plant.shed_ref * strength} | drawn(plant, rng, others)
