"""Forces on the bearings of every shaft: from the tooth forces of one mesh, or of two on a shaft between two stages.

The hand of helical gears and the sense of the torque are not asked for. With them a load differs by what the couple of
the axial force, and the angle between two tooth forces, add or take; loads are root mean squares over both senses and
hands. Two helical gears on one shaft are of the same hand, as usual, so that their axial forces oppose each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from models.definition.bearing_section import Bearing
from models.definition.sections import Stage
from models.formulas.geometry import GearPair
from models.losses.loss_term import GearboxData

IN_ONE_PLANE = 180.0  # deg, between the centre lines of two stages of which one goes on from the other


@dataclass(frozen=True, kw_only=True)
class BearingLoad:
    """Load of a bearing.

    Attributes
    ----------
    radial : float
        Radial load per torque of the input shaft, [N/(N m)]
    axial_share : float
        Axial over radial load, [-]; of a bearing without radial load over the transverse tooth force
    """

    radial: float
    axial_share: float


@dataclass(frozen=True, kw_only=True)
class _Mesh:
    """A mesh as one of its shafts carries it.

    Attributes
    ----------
    force : float
        Transverse tooth force over that of the first mesh of the shaft, [-]
    tilt : float
        Axial over transverse tooth force, [-]
    position : float or None
        Of the gear along the shaft, [m]
    """

    stage: Stage
    pair: GearPair
    force: float
    tilt: float
    r_w: float
    position: float | None


def bearing_loads(gearbox: GearboxData) -> dict[str, BearingLoad]:
    r"""Loads of all bearings by name.

    A bearing carries its share of the transverse tooth force :math:`F_{bt} = M / r_b`: ``load_share``, or that of a
    beam on two supports at ``position_mm``, whose bearings also carry the couple of the axial force at the pitch
    circle. Where a shaft has two gears, the forces add as vectors; the angle between them is that of the centre lines,
    ``angle_deg``, less both working pressure angles.

    Parameters
    ----------
    gearbox : GearboxData

    Returns
    -------
    dict of str to BearingLoad
        Root mean squares over both senses of the torque and both hands of the helix

    References
    ----------
    Balance of forces and moments, as in every textbook of machine elements.

    Examples
    --------
    The rig's bearings each carry half of the tooth force, 29.6 N per N m:

    >>> from models.assembly.gearbox import load_gearbox
    >>> load = bearing_loads(load_gearbox("fzg").geometry)["bearing_1"]
    >>> round(load.radial, 2), load.axial_share
    (14.78, 0.0)
    """
    return {name: load for shaft in gearbox.torque_ratio for name, load in _of_shaft(gearbox, shaft)}


def _of_shaft(gearbox: GearboxData, shaft: str) -> Iterator[tuple[str, BearingLoad]]:
    meshes = list(_meshes(gearbox, shaft))
    stage, pair = meshes[0].stage, meshes[0].pair
    push = abs(meshes[0].tilt - sum(mesh.force * mesh.tilt for mesh in meshes[1:]))
    bearings = [bearing for bearing in gearbox.bearing if bearing.shaft == shaft]
    radial = {bearing.name: _radial(bearing, bearings, meshes) for bearing in bearings}
    for bearing in bearings:
        axial = push if bearing.locating else 0.0
        if bearing.type == "tapered_roller":
            axial = _axial_of_taper(bearing, bearings, radial, push)
        own = radial[bearing.name]
        force = own * gearbox.torque_ratio[stage.driver] / pair.r_b[0]
        yield bearing.name, BearingLoad(radial=force, axial_share=axial / (own or 1.0))


def _meshes(gearbox: GearboxData, shaft: str) -> Iterator[_Mesh]:
    """Meshes of a shaft in the order of the stages: at most one that drives it, and one that it drives."""
    first = None
    for stage in gearbox.stage:
        if shaft in stage.shafts:
            gear, pair = stage.shafts.index(shaft), stage.pair()
            force = gearbox.torque_ratio[stage.driver] / pair.r_b[0]
            first = force if first is None else first
            yield _Mesh(
                stage=stage, pair=pair, force=force / first, tilt=float(np.tan(pair.beta_b)), r_w=pair.r_w[gear],
                position=None if stage.position_mm is None else 1e-3 * stage.position_mm[gear],
            )  # fmt: skip


def _radial(bearing: Bearing, bearings: list[Bearing], meshes: list[_Mesh]) -> float:
    """Radial load of a bearing over the transverse tooth force of the first mesh, [-]."""
    if bearing.load_share is not None:
        shares, couples = [bearing.load_share * mesh.force for mesh in meshes], [0.0 for _ in meshes]
    else:
        other = next(one for one in bearings if one.name != bearing.name)
        here, there = (1e-3 * float(one.position_mm or 0.0) for one in (bearing, other))
        shares = [mesh.force * (there - float(mesh.position or 0.0)) / (there - here) for mesh in meshes]
        couples = [mesh.force * mesh.tilt * mesh.r_w / (there - here) for mesh in meshes]
    square = sum(share * share for share in shares) + sum(couple * couple for couple in couples)
    if len(meshes) == 2:
        angle = meshes[1].stage.angle_deg
        apart = np.cos(np.radians(IN_ONE_PLANE if angle is None else angle))
        alpha = sum(mesh.pair.alpha_wt for mesh in meshes)
        square -= 2.0 * apart * (shares[0] * shares[1] * np.cos(alpha) + couples[0] * couples[1])
    return float(np.sqrt(square))


def _axial_of_taper(bearing: Bearing, bearings: list[Bearing], radial: dict[str, float], push: float) -> float:
    r"""Axial load of a taper bearing over the transverse tooth force, [-].

    Under a radial load it pushes its partner with :math:`F_r / 2Y`. Of a pair without preload each carries its own
    push, or that of the other one with what the gears add to it or take from it, whichever is more.

    References
    ----------
    SKF "Rolling bearings", 2016, section on taper roller bearings; from memory, its six cases in one formula.
    """
    other = next(b for b in bearings if b.type == bearing.type and b.name != bearing.name)
    own, from_other = (0.5 * radial[one.name] / float(one.Y or 1.0) for one in (bearing, other))
    here, there = (push if one.locating else 0.0 for one in (bearing, other))
    return max(own, from_other + here - there)
