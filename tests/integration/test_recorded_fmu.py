"""An FMU takes recordings as the full model does: mapping, parts, joined files, recorded start, faulty sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from builder.fmi.package import gearbox_identity
from diagnosis.forward.recurrence import lagged
from models.assembly.gearbox import Gearbox, load_gearbox
from models.correction.correction import Correction, Estimate, Finding, write_correction
from models.correction.instruments import InputCorrection, Mix, SensorCorrection
from models.files.cycle import Cycle
from models.mechanisms import CATALOGUE
from models.mechanisms.scale import Scale

RunCli = Callable[..., int]
BY_NAME: dict[str, Any] = {"columns": {"n": {"quantity": "speed"}, "Sumpf": {"quantity": "T_oil", "unit": "K"}}}
MAPPING = 'schema = 1\ncolumns.n = { quantity = "speed" }\ncolumns.Sumpf = { quantity = "T_oil", unit = "K" }\n'
TIME = 20.0 * np.arange(30)


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    path = tmp_path / "plain.csv"
    pd.DataFrame({
        "time_s": TIME, "speed_rpm": 1500.0 + TIME, "torque_Nm": 80.0, "T_ambient_degC": 20.0, "air_speed_m_s": 2.0,
        "T_oil_degC": 60.0 + TIME / 100.0,
    }).to_csv(path, index=False)  # fmt: skip
    return path


@pytest.fixture
def mapped(plain: Path) -> Path:
    """The same rows under other names; needs a mapping."""
    table = pd.read_csv(plain).rename(columns={"speed_rpm": "n", "T_oil_degC": "Sumpf"})
    table["Sumpf"] += 273.15
    path = plain.parent / "folder" / "mapped.csv"
    path.parent.mkdir()
    table.to_csv(path, index=False)
    table[:12].to_csv(path.parent / "first.csv", index=False)
    table[12:].to_csv(path.parent / "second.csv", index=False)
    return path


def test_a_recording_gives_what_the_plain_cycle_gives(
    run_cli: RunCli, fzg_native: Path, plain: Path, mapped: Path, tmp_path: Path
) -> None:
    out, mapping = tmp_path / "out.csv", tmp_path / "mine.toml"
    mapping.write_text(MAPPING)

    def simulated(*arguments: object) -> pd.DataFrame:
        assert run_cli("simulate", fzg_native, *arguments, "--output", out, "--initial", "recorded") == 0
        return pd.read_csv(out)

    expected = simulated(plain)
    assert expected["T_oil_degC"][0] == 60.0
    joined = f"{mapped.parent / 'first.csv'}+{mapped.parent / 'second.csv'}"
    for recording in (mapped, joined, f"{joined}@0.."):
        pd.testing.assert_frame_equal(simulated(recording, "--mapping", mapping), expected, rtol=0.0, atol=2e-6)
    part = simulated(f"{mapped}@0..300", "--mapping", mapping)
    pd.testing.assert_frame_equal(part, expected[: len(part)], rtol=0.0, atol=2e-6)
    assert len(part) == 15
    (mapped.parent / "mapping.toml").write_text(MAPPING)
    pd.testing.assert_frame_equal(simulated(mapped), expected, rtol=0.0, atol=2e-6)


@pytest.mark.parametrize("kind", ["build_fmu", "build_native"])
def test_the_mapping_of_the_definition_travels_in_the_fmu(
    run_cli: RunCli, kind: str, request: pytest.FixtureRequest, fzg: Gearbox, mapped: Path, tmp_path: Path
) -> None:
    network = replace(fzg.network(), recording=BY_NAME)
    fmu = request.getfixturevalue(kind)(tmp_path / "named.fmu", network)
    assert run_cli("simulate", fmu, mapped, "--output", tmp_path / "out.csv", "--initial", "recorded") == 0
    result = pd.read_csv(tmp_path / "out.csv")
    assert result["speed_rpm"].tolist() == (1500.0 + TIME).tolist()
    assert result["T_oil_degC"][0] == 60.0


def test_a_faulty_sensor_is_shown_next_to_the_truth_by_fmu_and_full_model(
    run_cli: RunCli, fzg: Gearbox, fzg_native: Path, plain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, file = tmp_path / "out.csv", tmp_path / "correction.toml"
    spots = CATALOGUE["sensor_bias"].placed(fzg.network(), Scale.of(fzg, speed=3000.0, torque=94.0))
    bias = next(term for term in spots if term.target == ("oil",))
    finding = Finding.of(bias, {bias.strength.name: (2.5, 0.1)}, mechanism="sensor_bias")
    write_correction(Correction.of(fzg, findings=[finding]), file)
    for driver in ((fzg_native,), ("--gearbox", "fzg")):
        assert run_cli("simulate", *driver, plain, "--output", out, "--correction", file) == 0
        result = pd.read_csv(out)
        np.testing.assert_allclose(result["T_oil_degC_as_recorded"], result["T_oil_degC"] + 2.5, atol=2e-6)
        assert [name for name in result if name.endswith("_as_recorded")] == ["T_oil_degC_as_recorded"]
    mixed = SensorCorrection(channel="oil", mix=(Mix(node="frame", share=0.1),))
    nominal = Correction.of(fzg, sensors=[mixed])
    assert "corrected" not in gearbox_identity(fzg, Path("fzg.fmu"), nominal).description  # its instruments are
    write_correction(nominal, file)
    for driver in ((fzg_native,), ("--gearbox", "fzg")):
        assert run_cli("simulate", *driver, plain, "--output", out, "--correction", file) == 0
        result = pd.read_csv(out)
        expected = 0.9 * result["T_oil_degC"] + 0.1 * result["T_frame_degC"]
        np.testing.assert_allclose(result["T_oil_degC_as_recorded"], expected, atol=2e-6)
    write_correction(Correction.of(load_gearbox("conveyor"), sensors=[SensorCorrection(channel="oil", bias=1.0)]), file)
    for driver in ((fzg_native,), ("--gearbox", "fzg")):
        assert run_cli("simulate", *driver, plain, "--output", tmp_path / "no.csv", "--correction", file) == 2
        assert "was made for" in " ".join(capsys.readouterr().err.split())
    calibrated = Correction.of(fzg, findings=[finding], calibration=[Estimate(name="churning", value=1.2, stderr=0.1)])
    write_correction(calibrated, file)
    assert run_cli("simulate", fzg_native, plain, "--output", tmp_path / "no.csv", "--correction", file) == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert "fzg.fmu: was not built with" in shown and "build it again with build-fmu --correction" in shown


def test_a_recording_with_known_instruments_is_what_the_corrected_model_reads(
    run_cli: RunCli, fzg: Gearbox, fzg_native: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ambient probe 1.5 K too high, oil probe 0.8 K too high and slow: within the noise for the full model."""
    rng, time, noise = np.random.default_rng(0), 10.0 * np.arange(720), 0.1
    true = {"time_s": time, "speed_rpm": np.where(time % 2400.0 < 1200.0, 1200.0, 2600.0),
            "torque_Nm": np.full(len(time), 100.0), "T_ambient_degC": 21.0 + np.sin(time / 900.0),
            "air_speed_m_s": np.full(len(time), 2.0)}  # fmt: skip
    made = fzg.network().simulate(Cycle.from_columns(true), losses=fzg.losses(), initial=30.0).columns()
    slow = lagged(made["T_oil_degC"], np.diff(time), 40.0)
    recorded = true | {
        "T_ambient_degC": true["T_ambient_degC"] + 1.5,
        "T_oil_degC": slow + 0.8 + noise * rng.standard_normal(len(time)),
        "T_pinion_degC": made["T_pinion_degC"] + noise * rng.standard_normal(len(time)),
    }
    recording, out, file = tmp_path / "run.csv", tmp_path / "out.csv", tmp_path / "correction.toml"
    pd.DataFrame(recorded).to_csv(recording, index=False)
    inputs = [InputCorrection(name="T_ambient", offset=-1.5)]
    sensors = [SensorCorrection(channel="oil", bias=0.8, lag=40.0), SensorCorrection(channel="pinion")]
    write_correction(Correction.of(fzg, sensors=sensors, inputs=inputs), file)
    worst = {}
    for name, driver in {"full": ("--gearbox", "fzg"), "fmu": (fzg_native,)}.items():
        assert run_cli("simulate", *driver, recording, "--output", out, "--correction", file, "--initial", "30") == 0
        result = pd.read_csv(out)
        errors = [result[f"T_{n}_degC_as_recorded"] - recorded[f"T_{n}_degC"] for n in ("oil", "pinion")]
        worst[name] = max(float(np.sqrt(np.mean(error**2))) for error in errors)
        np.testing.assert_allclose(result["T_ambient_degC"], true["T_ambient_degC"], atol=2e-6)
        np.testing.assert_allclose(result["T_ambient_degC_as_recorded"], recorded["T_ambient_degC"], atol=2e-6)
    assert worst["full"] < 1.1 * noise
    assert worst["fmu"] < 1.0  # its networks were trained for half a second
    pd.DataFrame(recorded).drop(columns=["T_oil_degC", "T_pinion_degC"]).to_csv(recording, index=False)
    assert run_cli("simulate", fzg_native, recording, "--output", out, "--correction", file) == 0
    np.testing.assert_allclose(pd.read_csv(out)["T_ambient_degC"], recorded["T_ambient_degC"], atol=2e-6)
    file.write_text(file.read_text().replace('"T_ambient"', '"T_ambiant"'))
    for driver in ((fzg_native,), ("--gearbox", "fzg")):
        assert run_cli("simulate", *driver, recording, "--output", tmp_path / "no.csv", "--correction", file) == 2
        shown = " ".join(capsys.readouterr().err.split())
        assert "correction.toml: [[input]] 'T_ambiant' is no input; did you mean 'T_ambient'?" in shown


@pytest.mark.parametrize(
    ("change", "mapping", "message"),
    [
        ({"torque_Nm": "M"}, MAPPING, "column torque_Nm is missing; it has: M, Sumpf"),
        ({}, MAPPING.replace('"K"', '"bar"'), "unit 'bar' is no unit of temperature"),
        ({"torque_Nm": "M"}, f'{MAPPING}columns.M = {{ quantity = "torqe" }}\n', "did you mean 'torque'?"),
        ({}, MAPPING.replace('"speed"', '"speed", scale = 1e6'), "lie outside -200000 ... 200000 1/min"),
    ],
)
def test_a_recording_that_cannot_be_used_is_refused_and_nothing_is_written(
    run_cli: RunCli, fzg_native: Path, mapped: Path, change: dict[str, str], mapping: str, message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    pd.read_csv(mapped).rename(columns=change).to_csv(mapped, index=False)
    (mapped.parent / "mapped.toml").write_text(mapping)
    before = sorted(mapped.parent.iterdir())
    assert run_cli("simulate", fzg_native, mapped, "--output", mapped.parent / "out.csv") == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert message in shown and "mapped" in shown and "Traceback" not in shown
    assert sorted(mapped.parent.iterdir()) == before
