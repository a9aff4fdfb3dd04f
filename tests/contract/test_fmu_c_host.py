"""A host written in C: what hosts written in Python hide, such as missing symbols or a crash at the end."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tests.contract.fmu_host import hosted

COMPILER = shutil.which("cc")
LIBPYTHON = Path(str(sysconfig.get_config_var("LIBDIR")), str(sysconfig.get_config_var("LDLIBRARY")))


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="written for Linux")
@pytest.mark.skipif(LIBPYTHON.suffix != ".so" or not LIBPYTHON.is_file(), reason="no shared libpython")
def test_simulations_in_c_end_well_and_give_the_same(fzg_fmu: Path, tmp_path: Path) -> None:
    host = tmp_path / "host"
    source = Path(__file__).with_name("host.c")
    subprocess.run([str(COMPILER), "-w", "-o", str(host), str(source), "-ldl"], check=True)
    with zipfile.ZipFile(fzg_fmu) as archive:
        archive.extractall(tmp_path / "fmu")
    with hosted(fzg_fmu) as running:
        guid, reference = running.fmu.description.guid, running.fmu.variables["oil.T"].valueReference
        running.step(1.0, count=60)
        expected = running.get("oil.T")[0]
    library = tmp_path / "fmu/binaries" / fmpy.platform / f"fzg{fmpy.sharedLibraryExtension}"
    packages = str(Path(np.__file__).parents[1])
    done = subprocess.run(
        [str(host), str(library), guid, (tmp_path / "fmu/resources").as_uri(), str(reference)],
        env={**os.environ, "LD_PRELOAD": str(LIBPYTHON), "PYTHONPATH": packages},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert [float(line) for line in done.stdout.split()] == [expected] * 3
    assert done.stderr.count("T_ambient is 20 K") == 3
