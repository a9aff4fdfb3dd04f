"""The worked changes of CONTRIBUTING.md fit the code and do what they promise."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("gearbox_twin", "models", "tests/contract")
TRY = """
from gearbox_twin import CATALOGUE, load_gearbox
from models.quantities.quantities import named_input
fzg = load_gearbox("fzg").with_values({"seal.0.model": "constant_torque", "seal.0.friction_torque_Nm": 0.2})
print(round(fzg.losses_at(speed=1500.0, torque=94.0, temperatures=60.0)["seal_1"], 2))
print(CATALOGUE["hose_to_air"].kind, named_input("oil_level", "level", unit="mm").quantity.unit)
"""


@pytest.mark.skipif(shutil.which("git") is None, reason="git applies the patches")
def test_the_patches_apply_and_work(tmp_path: Path) -> None:
    patches = re.findall(r"```diff\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(patches) == 3
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for patch in patches:
        subprocess.run(["git", "apply", "-"], cwd=tmp_path, input=patch, text=True, check=True)
    done = subprocess.run(
        [sys.executable, "-c", TRY], cwd=tmp_path, env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["31.42", "link", "mm"], done.stderr
