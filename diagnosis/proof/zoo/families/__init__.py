"""Families of plants by name."""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.proof.zoo.families.family import Family
from diagnosis.proof.zoo.families.gearbox_families import GEARBOX_FAMILIES
from diagnosis.proof.zoo.families.parametric import PARAMETRIC_FAMILIES

FAMILIES: Mapping[str, Family] = {family.name: family for family in (*GEARBOX_FAMILIES, *PARAMETRIC_FAMILIES)}
