"""Loads the families that serve proof alone; their code is in ``benchmarks/zoo_proof`` of a checkout."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path

from diagnosis.proof.zoo.families.family import PlantFamily
from models.base.errors import InputError

PROOF_FAMILIES = ("proof_a", "proof_b")
FOLDER = Path(__file__).parents[4] / "benchmarks" / "zoo_proof"
PACKAGE = "zoo_proof"


def load_proof_family(name: str) -> PlantFamily:
    """Return a family that serves proof alone.

    Parameters
    ----------
    name : str
        One of :data:`PROOF_FAMILIES`

    Raises
    ------
    InputError
        If this is an installed package without the folder.
    """
    start = FOLDER / "__init__.py"
    if not start.is_file():
        raise InputError(
            f"the family '{name}' is in {FOLDER.parent.name}/{FOLDER.name} of the repository: use a checkout"
        )
    if PACKAGE not in sys.modules:
        spec = importlib.util.spec_from_file_location(PACKAGE, start, submodule_search_locations=[str(FOLDER)])
        if spec is None or spec.loader is None:
            raise ImportError(start)
        sys.modules[PACKAGE] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[PACKAGE])
    family: PlantFamily = importlib.import_module(f"{PACKAGE}.{name}").FAMILY
    return family
