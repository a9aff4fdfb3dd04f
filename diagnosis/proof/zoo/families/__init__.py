"""Families of plants by name."""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.proof.zoo.families.family import PlantFamily
from diagnosis.proof.zoo.families.gearbox_families import GEARBOX_FAMILIES
from diagnosis.proof.zoo.families.parametric import PARAMETRIC_FAMILIES
from diagnosis.proof.zoo.families.proof import PROOF_FAMILIES, load_proof_family
from models.base.errors import InputError, did_you_mean

#: To develop and to learn on; those that serve proof alone are only drawn by name.
FAMILIES: Mapping[str, PlantFamily] = {family.name: family for family in (*GEARBOX_FAMILIES, *PARAMETRIC_FAMILIES)}


def find_family(name: str) -> PlantFamily:
    """Return a family by its name, also one that serves proof alone.

    Raises
    ------
    InputError
        If there is no such family, or its code is not installed.
    """
    if name in PROOF_FAMILIES:
        return load_proof_family(name)
    if name not in FAMILIES:
        raise InputError(f"{name!r} is not a family of the zoo{did_you_mean(name, [*FAMILIES, *PROOF_FAMILIES])}")
    return FAMILIES[name]
