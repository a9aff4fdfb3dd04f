"""The posterior of all unknowns as a file for programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine.fit import calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.results.findings import estimates_of, joint_estimate_of
from diagnosis.results.joint_estimate import JointEstimate
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded


def test_it_holds_values_errors_and_correlations_of_all_unknowns(fzg: Gearbox, tmp_path: Path) -> None:
    fit = calibrate(prepare_experiment(fzg, [recorded(fzg, "made")], [])[1])
    joint_estimate_of(fit).write(tmp_path / "posterior.npz")
    with np.load(tmp_path / "posterior.npz") as file:
        stored = {name: file[name] for name in file.files}
    known = estimates_of(fit)
    assert stored["names"].tolist() == list(known) and len(known) > 10
    found = np.stack([stored["values"], stored["stderr"]], axis=1)
    np.testing.assert_allclose(found, list(known.values()), rtol=1e-5)
    units = dict(zip(stored["names"].tolist(), stored["units"].tolist(), strict=True))
    assert units["bias_oil"] == "K"
    correlation = stored["correlation"]
    np.testing.assert_array_equal(np.diag(correlation), 1.0)
    np.testing.assert_array_equal(correlation, correlation.T)
    assert np.linalg.eigvalsh(correlation).min() > -1e-4
    assert 0.1 < np.abs(correlation - np.eye(len(correlation))).max() < 1.0


@pytest.mark.parametrize("value", [1.23456789e-7, -123456.789])
def test_last_bits_do_not_change_the_file(value: float, tmp_path: Path) -> None:
    one = JointEstimate(names=("a",), units=("K",), values=np.array([value]), stderr=np.ones(1), correlation=np.eye(1))
    one.write(tmp_path / "a")
    replace(one, values=np.array([value * (1.0 + 1e-12)])).write(tmp_path / "b")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
