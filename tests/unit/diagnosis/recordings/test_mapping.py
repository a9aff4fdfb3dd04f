"""Mapping files of folders whose recordings differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError


def test_an_optional_column_may_be_missing_in_some_files_of_a_folder(tmp_path: Path, fzg: Gearbox) -> None:
    time = np.arange(0.0, 3600.0, 10.0)
    made = pd.DataFrame({"time_s": time, "speed_rpm": 1500.0, "torque_Nm": 94.0, "T_ambient_degC": 22.0,
                         "sump": 40.0 + time / 200.0, "loss": 0.3 + time / 1e5})  # fmt: skip
    made.to_csv(tmp_path / "with.csv", index=False)
    made.drop(columns="loss").to_csv(tmp_path / "without.csv", index=False)
    mapping = 'schema = 1\n[columns.sump]\nquantity = "T_oil"\n[columns.loss]\nquantity = "P_loss"\nunit = "kW"\n'
    (tmp_path / "mapping.toml").write_text(f"{mapping}optional = true\n")
    both = read_recordings([tmp_path / "with.csv", tmp_path / "without.csv"], fzg.network())
    assert [[channel.name for channel in one.channels] for one in both] == [["oil", "P_loss"], ["oil"]]
    (tmp_path / "mapping.toml").write_text(mapping)
    with pytest.raises(
        InputError,
        match=r"column loss of its mapping file is missing.*; if only some of the files have it, state optional",
    ):
        read_recordings([tmp_path / "without.csv"], fzg.network())
