"""Driving an FMU gives what simulating the same networks in Python gives, and says clearly what is wrong."""

from __future__ import annotations

import logging
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from builder.drive.driver import drive_fmu, runs_here
from builder.drive.machine_of_fmu import fmu_machine
from builder.fmi.reference_cycle import reference_cycle
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle
from tests.contract.test_fmu_python import rewritten

OTHER_MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="other" guid="{1}"><CoSimulation modelIdentifier="other"/>
<ModelVariables><ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
</ModelVariables><ModelStructure/></fmiModelDescription>"""


def cycle(**columns: list[float]) -> Cycle:
    given = {
        "time_s": [0.0, 1.0, 2.0],
        "speed_rpm": [1000.0] * 3,
        "torque_Nm": [100.0] * 3,
        "T_ambient_degC": [20.0] * 3,
    }
    return Cycle.from_columns(given | columns)


@pytest.mark.parametrize(("step_s", "limit_K"), [(1.0, 0.06), (10.0, 0.08), (60.0, 0.08)])
def test_agrees_with_the_simulation_in_python(
    fzg_fmu: Path, fzg: Gearbox, fzg_training: TrainingResult, step_s: float, limit_K: float
) -> None:
    ramps = reference_cycle(fzg, step_s=step_s)
    expected = fzg.network().simulate(ramps, losses=fzg_training.losses, initial=20.0).columns()
    done: list[tuple[int, int]] = []
    driven = drive_fmu(fzg_fmu, ramps, initial=20.0, progress=lambda *counts: done.append(counts))
    assert list(driven) == list(expected)
    assert done[-1] == (len(ramps) - 1, len(ramps) - 1)
    for name, values in expected.items():
        if name.startswith("T_") and name != "T_mesh_degC":
            assert np.abs(driven[name] - values).max() < 0.015, name  # half of what a step tolerates
        elif name.startswith("P_"):
            np.testing.assert_allclose(driven[name], values, rtol=2e-4, atol=1e-3, err_msg=name)
        elif not name.startswith("T_"):
            np.testing.assert_allclose(driven[name], values, rtol=2e-4, atol=1e-6, err_msg=name)
    # The mesh has 0.1 s; it lags behind a ramp, which held inputs do not show.
    assert np.abs(driven["T_mesh_degC"] - expected["T_mesh_degC"]).max() < limit_K


def test_start_is_the_first_ambient_temperature(fzg_fmu: Path) -> None:
    driven = drive_fmu(fzg_fmu, cycle(T_ambient_degC=[5.0, 6.0, 7.0]))
    assert driven["T_oil_degC"][0] == pytest.approx(5.0)
    assert driven["T_air_degC"] == pytest.approx([5.0, 6.0, 7.0])


def test_missing_inputs_have_their_start_value(fzg_fmu: Path, fzg: Gearbox) -> None:
    driven = drive_fmu(
        fzg_fmu, Cycle.from_columns({"time_s": [0.0, 1.0], "speed_rpm": [1.0, 1.0], "torque_Nm": [1.0, 1.0]})
    )
    assert driven["T_ambient_degC"] == pytest.approx(fzg.ambient.temperature_degC)
    assert driven["air_speed_m_s"] == pytest.approx(fzg.ambient.air_speed_m_s)


def test_result_can_be_continued(fzg_fmu: Path) -> None:
    whole = drive_fmu(fzg_fmu, cycle(time_s=[0.0, 100.0, 200.0]), initial=40.0)
    first = drive_fmu(fzg_fmu, Cycle.from_columns({n: v[:2] for n, v in cycle_columns(whole).items()}), initial=40.0)
    last = {n[2:-5]: float(v[-1]) for n, v in first.items() if n.startswith("T_") and n != "T_ambient_degC"}
    second = drive_fmu(fzg_fmu, Cycle.from_columns({n: v[1:] for n, v in cycle_columns(whole).items()}), initial=last)
    for name in (n for n in whole if n.startswith("T_")):
        assert second[name][-1] == pytest.approx(whole[name][-1], abs=0.01), name


def cycle_columns(result: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {n: result[n] for n in ("time_s", "speed_rpm", "torque_Nm", "T_ambient_degC", "air_speed_m_s")}


def test_factors_can_be_given(fzg_fmu: Path) -> None:
    nominal, doubled = (drive_fmu(fzg_fmu, cycle(), parameters={"churning": f}) for f in (1.0, 2.0))
    assert doubled["P_loss_churning_W"][0] == pytest.approx(2.0 * nominal["P_loss_churning_W"][0], rel=1e-9)
    with pytest.raises(InputError, match=r"did you mean 'factor\.churning'"):
        drive_fmu(fzg_fmu, cycle(), parameters={"factor.churnin": 2.0})


def test_single_row_is_enough(fzg_fmu: Path) -> None:
    one = Cycle.from_columns({"time_s": [3.0], "speed_rpm": [1000.0], "torque_Nm": [100.0]})
    assert drive_fmu(fzg_fmu, one, initial=30.0)["T_oil_degC"] == pytest.approx([30.0])


def test_warnings_of_the_fmu_are_passed_on(fzg_fmu: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        driven = drive_fmu(fzg_fmu, cycle(speed_rpm=[1000.0, 9000.0, 9000.0]))
    (record,) = caplog.records
    assert "range that the networks were trained on" in record.getMessage()
    assert driven["in_domain"].tolist() == [True, False, False]


NESTED = """
import gc, sys
from pathlib import Path
import fmpy
from builder.drive.driver import drive_fmu, loaded
from models.files.cycle import Cycle

fmu = Path(sys.argv[1])
fast = Cycle.from_columns({"time_s": [0, 1], "speed_rpm": [1000, 1e5], "torque_Nm": [50, 50]})
for _ in range(50):
    with loaded(fmu) as first:
        drive_fmu(fmu, fast)
        gc.collect()
        first.slave.setupExperiment(startTime=0.0)
        first.slave.enterInitializationMode()
        first.slave.setReal([first.variables["speed"].valueReference], [float("nan")])
        try:
            first.slave.exitInitializationMode()
        except fmpy.fmi1.FMICallException:
            pass
        ((_, text),) = first.messages
        assert "speed is nan" in text
    try:
        fmpy.simulate_fmu(str(fmu), stop_time=1.0, start_values={"factor.churning": -1.0}, validate=False)
    except fmpy.fmi1.FMICallException:
        print("refused")
"""


def test_an_fmu_may_log_after_another_one_is_gone(fzg_native: Path) -> None:
    """FMPy keeps one logger for the process: a freed one crashed the process as soon as another instance logged."""
    done = subprocess.run([sys.executable, "-c", NESTED, str(fzg_native)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("refused") == done.stdout.count("factor.churning is -1") == 50


def test_extra_inputs_and_nodes_of_an_fmu_are_known(fzg_fmu: Path, fzg: Gearbox) -> None:
    machine, network = fmu_machine(fzg_fmu), fzg.network()
    assert list(machine.inputs) == list(network.inputs)
    assert [part.name for part in machine.parts] == [part.name for part in network.parts]


@pytest.mark.parametrize("kind", ["fzg_fmu", "fzg_native"])
@pytest.mark.parametrize("interval", [20.0, 2.0, 0.3])
def test_more_rows_bring_the_old_ones_no_further_from_the_truth(
    kind: str, interval: float, request: pytest.FixtureRequest, fzg: Gearbox, fzg_training: TrainingResult,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    path = request.getfixturevalue(kind)
    ramps = reference_cycle(fzg, step_s=60.0)
    fine = ramps.refined(interval)
    own = np.isin(fine.time, ramps.time)
    assert own.sum() == len(ramps) < len(fine)
    monkeypatch.setattr("models.portable.solver.TOLERANCE_K", 1e-4)
    truth = fzg.network().simulate(ramps, losses=fzg_training.losses, initial=20.0).columns()
    coarse, dense = (drive_fmu(path, c, initial=20.0) for c in (ramps, fine))
    names = [name for name in truth if name.startswith("T_")]
    # 0.01 K: other steps of the solver, which holds 0.03 K in each, make chance differences.
    for name in names:
        before, after = np.abs(coarse[name] - truth[name]).max(), np.abs(dense[name][own] - truth[name]).max()
        assert after < before + 0.01, name
    before, after = (np.abs(d - truth["P_loss_W"]).max() for d in (coarse["P_loss_W"], dense["P_loss_W"][own]))
    assert after < before + 0.01


def test_an_fmu_of_fmi_3_gives_the_same(fzg_native: Path, fzg_native3: Path, fzg: Gearbox) -> None:
    assert runs_here(fzg_native3)
    assert list(fmu_machine(fzg_native3).inputs) == list(fzg.network().inputs)
    rows = cycle(time_s=[5.0, 65.0, 125.0])
    two, three = (drive_fmu(path, rows, parameters={"churning": 1.5}) for path in (fzg_native, fzg_native3))
    assert list(two) == list(three)
    for name, values in two.items():
        np.testing.assert_allclose(three[name], values, rtol=1e-12, err_msg=name)
    with pytest.raises(InputError, match=r"factor\.churning is -1; 0\.05 to 20 is possible"):
        drive_fmu(fzg_native3, cycle(), parameters={"churning": -1.0})


def test_slow_ramps_of_any_input_are_followed(fzg_native: Path, fzg_native3: Path) -> None:
    """FMI 2.0 has rates of inputs, FMI 3.0 is given them in pieces."""
    slow = cycle(time_s=[0.0, 3600.0, 7200.0], air_speed_m_s=[0.0, 1.0, 0.0], torque_Nm=[90.0, 94.0, 90.0])
    two, three = (drive_fmu(path, slow, initial=40.0) for path in (fzg_native, fzg_native3))
    for name in two:
        if name.startswith("T_"):
            np.testing.assert_allclose(three[name], two[name], atol=0.06, err_msg=name)  # two of the solver's


# ---------------------------------------------------------------------- what is wrong is said


def test_refused_values_end_with_the_words_of_the_fmu(fzg_fmu: Path) -> None:
    with pytest.raises(InputError, match=r"factor\.churning is -1; 0\.05 to 20 is possible"):
        drive_fmu(fzg_fmu, cycle(), parameters={"churning": -1.0})


def test_initial_temperatures_must_be_complete_and_known(fzg_fmu: Path) -> None:
    with pytest.raises(InputError, match="unknown node 'oli'; did you mean 'oil'") as raised:
        drive_fmu(fzg_fmu, cycle(), initial={"oli": 20.0})
    assert "start temperatures are missing for: housing_lower" in str(raised.value)


def test_file_must_be_an_fmu(fzg_fmu: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        drive_fmu(tmp_path / "absent.fmu", cycle())
    with pytest.raises(InputError, match="is not a file but a folder; name an FMU, as .*fzg.fmu"):
        drive_fmu(fzg_fmu.parent, cycle())
    (tmp_path / "fzg.toml").touch()
    with pytest.raises(InputError, match=r"is not an FMU; a definition is given as --gearbox .*fzg\.toml"):
        drive_fmu(tmp_path / "fzg.toml", cycle())
    (tmp_path / "text.fmu").write_text("not a zip")
    with pytest.raises(InputError, match="is not an FMU, or is damaged"):
        drive_fmu(tmp_path / "text.fmu", cycle())
    content = fzg_fmu.read_bytes()
    (tmp_path / "cut.fmu").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match="is not an FMU, or is damaged"):
        drive_fmu(tmp_path / "cut.fmu", cycle())
    with zipfile.ZipFile(tmp_path / "empty.fmu", "w") as archive:
        archive.writestr("readme.txt", "")
    with pytest.raises(InputError, match="is not an FMU, or is damaged"):
        drive_fmu(tmp_path / "empty.fmu", cycle())


def test_content_of_the_archive_must_be_whole(fzg_fmu: Path, tmp_path: Path) -> None:
    content = bytearray(fzg_fmu.read_bytes())
    with zipfile.ZipFile(fzg_fmu) as archive:
        entry = archive.getinfo("binaries/linux64/fzg.so")
    content[entry.header_offset + 5000] ^= 0xFF
    (tmp_path / "flipped.fmu").write_bytes(bytes(content))
    with pytest.raises(InputError, match="is damaged"):
        drive_fmu(tmp_path / "flipped.fmu", cycle())


def test_another_model_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "other.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", OTHER_MODEL)
    with pytest.raises(InputError, match="another model: it has no initial.uniform, initial.T"):
        drive_fmu(tmp_path / "other.fmu", cycle())


def test_model_exchange_is_refused(fzg_fmu: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(fzg_fmu) as archive:
        xml = archive.read("modelDescription.xml")
    start, end = xml.index(b"<CoSimulation"), xml.index(b"<UnitDefinitions")
    exchange = xml[:start] + b'<ModelExchange modelIdentifier="fzg"/>' + xml[end:]
    path = rewritten(fzg_fmu, tmp_path / "exchange.fmu", {"modelDescription.xml": exchange})
    with pytest.raises(InputError, match=r"FMI 2\.0 or 3\.0 for co-simulation"):
        drive_fmu(path, cycle())


def test_binary_for_this_machine_is_needed(fzg_fmu: Path, tmp_path: Path) -> None:
    path = rewritten(fzg_fmu, tmp_path / "windows.fmu", {"binaries/linux64/fzg.so": None})
    with pytest.raises(InputError, match="has no binary for"):
        drive_fmu(path, cycle())
