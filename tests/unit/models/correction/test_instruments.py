"""Tables of sensors and inputs of a correction: round trip, and what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.correction.correction import Correction, parse_correction, read_correction, write_correction
from models.correction.instruments import InputCorrection, Mix, SensorCorrection

SENSORS = (
    SensorCorrection(channel="oil", bias=0.8, bias_stderr=0.1, lag=25.0, lag_stderr=4.0,
                     mix=(Mix(node="housing_lower", share=0.05, stderr=0.02), Mix(node="air", share=0.01))),
    SensorCorrection(channel="pinion__probe", bias=-0.2),
    SensorCorrection(channel="P_loss", gain=1.02, delay=-3.0, bias=4.0),
)  # fmt: skip
INPUTS = (
    InputCorrection(name="T_ambient", offset=-1.5, offset_stderr=0.2),
    InputCorrection(name="torque", gain=1.01, gain_stderr=0.01, clock=12.0),
)


def test_the_file_holds_every_number(fzg: Gearbox, tmp_path: Path) -> None:
    correction, path = Correction.of(fzg, sensors=SENSORS, inputs=INPUTS), tmp_path / "correction.toml"
    write_correction(correction, path)
    assert read_correction(path, fzg) == correction
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    assert [table["channel"] for table in tables["sensor"]] == ["oil", "pinion__probe", "P_loss"]
    assert tables["input"][1] == {"name": "torque", "gain": 1.01, "gain_stderr": 0.01, "clock": 12.0}
    assert not correction.has_physics
    assert correction.network(fzg).parameters == fzg.network().parameters


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[sensor]]\nchannel = "oli"\nbias = 1.0', "[[sensor]] 'oli' is at no node; did you mean 'oil'?"),
        ('[[sensor]]\nchannel = "oil"\nmix = [{ node = "housing", share = 0.1 }]', "mixes in 'housing', no node"),
        ('[[sensor]]\nchannel = "oil"\nmix = [{ node = "pinion", share = 1.1 }]', "1"),
        ('[[sensor]]\nchannel = "oil"\nlag = -2', "lag"),
        ('[[sensor]]\nchannel = "oil"\ngain = 1.1', "gain and delay are those of P_loss"),
        ('[[sensor]]\nchannel = "P_loss"\nlag = 3.0', "lag and mix are those of a temperature"),
        ('[[sensor]]\nchannel = "oil"\n[[sensor]]\nchannel = "oil"', "2 tables [[sensor]] are about 'oil'; keep one"),
        ('[[sensor]]\nchannel = "oil"\nbais = 1.0', "bais"),
        ('[[input]]\nname = "T_ambiant"\noffset = 1.0', "[[input]] 'T_ambiant' is no input; did you mean 'T_ambient'?"),
        ('[[input]]\nname = "torque"\ngain = 0.0', "gain"),
    ],
)
def test_faults_are_named_with_their_file(text: str, message: str, fzg: Gearbox, tmp_path: Path) -> None:
    path = tmp_path / "correction.toml"
    path.write_text(f"schema = 1\n{text}\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_correction(path, fzg)
    assert message in str(caught.value) and str(path) in str(caught.value)


def test_an_fmu_knows_its_nodes_and_inputs_only(tmp_path: Path) -> None:
    path = tmp_path / "correction.toml"
    path.write_text('schema = 1\n[[sensor]]\nchannel = "oil"\nbias = 1.0\n', encoding="utf-8")
    correction = parse_correction(path)
    correction.check_instruments(["oil"], ["speed"])
    with pytest.raises(InputError, match="'oil' is at no node"):
        correction.check_instruments(["pinion"], ["speed"])
