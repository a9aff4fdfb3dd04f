"""Loads of bearings: against a beam in space with forces and moments written out, and against a case worked by hand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from models.assembly.gearbox import Gearbox, load_gearbox
from models.losses.shaft_loads import bearing_loads

TWO = load_gearbox("two_stage")


def forces_in_space(gearbox: Gearbox, shaft: str, sense: int, hand: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Point of attack [m] and force [N] of every mesh of a shaft, along x, at 1 N m of the input shaft.

    The first mate is at angle 0 in the plane y, z, the second at the angle between the centre lines. Of a driven gear
    the tangential force goes with the motion, of a driving one against it.
    """
    found, angle = [], 0.0
    for stage in gearbox.stage:
        if shaft not in (stage.driver, stage.driven):
            continue
        gear, pair = (stage.driver, stage.driven).index(shaft), stage.pair()
        if found:
            angle = np.radians(180.0 if stage.angle_deg is None else stage.angle_deg)
        F_t = gearbox.geometry.torque_ratio[stage.driver] / pair.r_w[0]
        F_r, beta_w = F_t * np.tan(pair.alpha_wt), np.arctan(np.tan(pair.beta) * pair.r_w[0] / pair.r[0])
        outwards = np.array([0.0, np.cos(angle), np.sin(angle)])
        forwards = np.array([0.0, -np.sin(angle), np.cos(angle)])
        role = 1.0 if gear else -1.0
        # Gears of one shaft have one hand; of a pair the hands differ, which the role of the gear stands for.
        along = np.array([role * sense * hand * F_t * np.tan(beta_w), 0.0, 0.0])
        force = role * sense * F_t * forwards - F_r * outwards + along
        found.append((np.array([1e-3 * stage.position_mm[gear], 0.0, 0.0]) + pair.r_w[gear] * outwards, force))
    return found


def reactions(gearbox: Gearbox, shaft: str, sense: int, hand: int) -> tuple[dict[str, float], float]:
    """Radial reactions [N] of both bearings from the balance of moments, and the axial force on the shaft [N]."""
    loads = forces_in_space(gearbox, shaft, sense, hand)
    a, b = (bearing for bearing in gearbox.bearing if bearing.shaft == shaft)
    found = {}
    for own, other in ((a, b), (b, a)):
        pivot = np.array([1e-3 * other.position_mm, 0.0, 0.0])
        moment = sum(np.cross(point - pivot, force) for point, force in loads)
        # The bearing's force F at (own - other) along x balances the moment: (own - other) e_x x F = -moment.
        arm = 1e-3 * (own.position_mm - other.position_mm)
        found[own.name] = float(np.hypot(moment[1], moment[2]) / abs(arm))
    return found, abs(float(sum(force[0] for _, force in loads)))


@pytest.mark.parametrize("angle", [None, 180.0, 0.0, 75.0, -120.0])
@pytest.mark.parametrize("shaft", ["input", "middle", "output"])
def test_loads_are_those_of_a_beam_in_space_over_both_senses_and_hands(shaft: str, angle: float | None) -> None:
    first, second = TWO.values["stage"]
    gearbox = TWO if angle is None else TWO.with_values({"stage": (first, {**second, "angle_deg": angle})})
    loads = bearing_loads(gearbox.geometry)
    runs = [reactions(gearbox, shaft, sense, hand) for sense, hand in product((1, -1), (1, -1))]
    for name in runs[0][0]:
        expected = np.sqrt(np.mean([run[0][name] ** 2 for run in runs]))
        assert loads[name].radial == pytest.approx(expected, rel=1e-9)
    assert len({round(axial, 9) for _, axial in runs}) == 1
    locating = next(b for b in gearbox.bearing if b.shaft == shaft and b.locating)
    partner = next(b for b in gearbox.bearing if b.shaft == shaft and not b.locating)
    of_both = [loads[b.name].radial * loads[b.name].axial_share for b in (locating, partner)]
    assert of_both[0] - of_both[1] == pytest.approx(runs[0][1], rel=1e-9)  # tapers also push each other


def test_one_helical_gear_on_two_bearings() -> None:
    """Gear at 40 of 120 mm, 2732 N tangential, 1110 N radial, 739 N axial: 1893 N or 2062 N, worked by hand."""
    stage, positions = TWO.stage[0], (0.0, 120.0)
    pair = stage.pair()
    F_t = 1.0 / pair.r_w[0]
    F_r, F_ax = F_t * np.tan(pair.alpha_wt), F_t * np.tan(pair.beta) * pair.r_w[0] / pair.r[0]
    changes = {"bearing.0.position_mm": positions[0], "bearing.1.position_mm": positions[1],
               "stage.0.position_mm": (40.0, 60.0)}  # fmt: skip
    couple = F_ax * pair.r_w[0] / 0.12
    either = [np.hypot(2.0 / 3.0 * F_t, 2.0 / 3.0 * F_r + sense * couple) for sense in (1.0, -1.0)]
    loads = bearing_loads(TWO.with_values(changes).geometry)
    assert loads["input_motor_side"].radial == pytest.approx(np.sqrt(np.mean(np.square(either))), rel=1e-12)


def test_an_overhung_gear_loads_the_near_bearing_with_more_than_its_force() -> None:
    loads = bearing_loads(TWO.with_values({"stage.0.position_mm": (260.0, 60.0)}).geometry)
    force = 1.0 / TWO.stage[0].pair().r_b[0]
    assert loads["input_far_side"].radial > force > loads["input_motor_side"].radial


def test_the_share_of_a_bearing_is_that_of_the_force() -> None:
    fzg = load_gearbox("fzg")
    force = 1.0 / fzg.stage[0].pair().r_b[0]
    assert [load.radial for load in bearing_loads(fzg.geometry).values()] == [pytest.approx(0.5 * force)] * 4
    assert all(load.axial_share == 0.0 for load in bearing_loads(fzg.geometry).values())
