"""Machines without recorded torque or without a shaft in the inference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.read import read_recording
from diagnosis.setup.shaft import shafts, torque_gain, with_shaft
from models.assembly.gearbox import load_gearbox, read_gearbox
from models.mechanisms import CATALOGUE

ROOT = Path(__file__).parents[4]


def test_a_machine_without_shaft_is_set_up_with_zeros() -> None:
    rod = load_gearbox("heated_rod")
    recording = read_recording(ROOT / "examples" / "data" / "heated_rod.csv.gz@0..3600", rod.network())
    case, experiment = prepare_experiment(rod, [recording])
    assert tuple(case.nominal.inputs)[:2] == ("speed", "torque")
    assert not case.learnt[0].inputs[:, :2].any()
    assert "torque_gain" not in {u.parameter.name for u in experiment.unknowns}
    assert case.channels[5:7] == ("cell_6__NTC6", "cell_6__NTC7")
    assert case.scale.duration == pytest.approx(3600.0, abs=20.0)
    catalogue = CATALOGUE.values()
    placed = [p for mechanism in catalogue for p in mechanism.placed(case.nominal, case.scale, case.channels)]
    # Heats of the catalogue are sized by losses, heat paths by groups: a rod has none.
    assert {p.kind for p in placed} == {"sensor", "signal"}


def test_a_torque_from_a_power_is_an_input_whose_gain_is_the_efficiency() -> None:
    text = (ROOT / "models" / "gearboxes" / "la_haute_borne.toml").read_text(encoding="utf-8")
    table = (
        '[torque]\npower = "P"\nefficiency = { value = 0.9, sd = 0.018 }\n\n[[input]]\nname = "P"\nquantity = "power"\n'
        'unit = "kW"\nrange = [-100.0, 2500.0]\n\n'
        '[recording.columns.P_avg]\nquantity = "P"\nunit = "kW"\n\n[[boundary]]'
    )
    text = text.replace('quantity = "torque"', 'quantity = "auxiliary"', 1).replace("[[boundary]]", table, 1)
    machine = read_gearbox(text, file="power.toml")
    network = machine.network()
    file = ROOT / "examples" / "data" / "la_haute_borne_R80736.csv.gz@2017-10-02..2017-10-03"
    (recording,) = shafts([read_recording(file, network)], network)
    omega = np.maximum(np.abs(recording.inputs["speed"]), 1.0) * np.pi / 30.0
    np.testing.assert_allclose(recording.inputs["torque"], 0.9e3 * recording.inputs["P"] / omega)
    gain = torque_gain(network)
    assert gain is not None and gain.sd == pytest.approx(0.02)
    shaft = with_shaft(network)
    assert not shaft.derived and "efficiency" not in {p.name for p in shaft.parameters}
