"""The command line as users meet it: exit status, one message without a traceback, and the files that come out."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.conftest import RunCli

CYCLE = "time_s,speed_rpm,torque_Nm,T_ambient_degC\n0,0,0,20\n20,1500,80,20\n60,1500,-20,20\n"


@pytest.fixture
def cycle(tmp_path: Path) -> Path:
    path = tmp_path / "cycle.csv"
    path.write_text(CYCLE)
    return path


def test_simulate_with_the_full_model(
    run_cli: RunCli, cycle: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, plot = tmp_path / "result.csv", tmp_path / "plot.png"
    assert run_cli("simulate", "--gearbox", "fzg", cycle, "--output", out, "--plot", plot) == 0
    table = pd.read_csv(out)
    assert list(table.columns[:5]) == ["time_s", "speed_rpm", "torque_Nm", "T_ambient_degC", "air_speed_m_s"]
    assert list(table.columns[-3:]) == ["torque_loss_Nm", "efficiency", "in_domain"]
    assert table["T_oil_degC"].iloc[0] == 20.0 < table["T_oil_degC"].iloc[-1]
    losses = [c for c in table if c.startswith("P_loss_") and c != "P_loss_W"]
    np.testing.assert_allclose(table[losses].sum(axis=1), table["P_loss_W"], atol=1e-5)
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert str(out) in capsys.readouterr().out


def test_a_console_that_cannot_show_a_name_does_not_end_the_work(cycle: Path, tmp_path: Path) -> None:
    out = tmp_path / "Öl Ω.csv"
    command = [sys.executable, "-m", "builder", "simulate", "--gearbox", "fzg", str(cycle), "--output", str(out)]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    assert out.is_file() and "wrote" in done.stdout and "\\xd6l \\u03a9.csv" in done.stdout


def test_a_result_can_be_continued(run_cli: RunCli, cycle: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.parquet", tmp_path / "second.csv"
    assert run_cli("simulate", "--gearbox", "fzg", cycle, "--output", first, "--initial", "55") == 0
    assert run_cli("simulate", "--gearbox", "fzg", cycle, "--output", second, "--initial", first) == 0
    end, begin = pd.read_parquet(first).iloc[-1], pd.read_csv(second).iloc[0]
    for node in ("oil", "pinion", "mesh", "housing_upper"):
        assert begin[f"T_{node}_degC"] == pytest.approx(end[f"T_{node}_degC"], abs=1e-5)


def test_what_is_assumed_is_told_and_names_are_as_given(
    run_cli: RunCli, tmp_path: Path, fzg_fmu: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bare, warm, out = tmp_path / "bare.csv", tmp_path / "warm.csv", tmp_path / "run[v2][/b].csv"
    bare.write_text("time_s,speed_rpm,torque_Nm\n0,1500,80\n10,1500,80\n")
    assert run_cli("simulate", "--gearbox", "fzg", bare, "--output", warm, "--initial", 40) == 0
    table = pd.read_csv(warm)
    table["T_cabinet_degC"] = 31.0  # is no node, and of a start no harm
    table.to_csv(warm, index=False)
    for driver in (("--gearbox", "fzg"), (fzg_fmu,)):
        capsys.readouterr()
        assert run_cli("simulate", *driver, bare, "--initial", warm, "--output", out) == 0
        shown = capsys.readouterr()
        assert f"wrote {out}" in shown.out
        noted = [line for line in shown.err.splitlines() if line.startswith("note: ")]
        assert noted == [f"note: the cycle has no column {name}; {value} is assumed"
                        for name, value in (("T_ambient_degC", 27), ("air_speed_m_s", 2))]  # fmt: skip


def test_simulate_with_an_fmu_gives_the_same_columns(
    run_cli: RunCli, cycle: Path, tmp_path: Path, fzg_fmu: Path
) -> None:
    full, driven = tmp_path / "full.csv", tmp_path / "fmu.csv"
    assert run_cli("simulate", "--gearbox", "fzg", cycle, "--output", full) == 0
    assert run_cli("simulate", fzg_fmu, cycle, "--output", driven, "--initial", "20", "--plot", tmp_path / "p.svg") == 0
    assert list(pd.read_csv(driven).columns) == list(pd.read_csv(full).columns)
    assert (tmp_path / "p.svg").read_text().startswith("<?xml")


# ---------------------------------------------------------------------- rows, means and starts of simulate


def means(shown: str) -> dict[str, float]:
    """Mean losses of the printed table."""
    _, _, table = shown.partition("mean over time")
    rows = (line.split() for line in table.splitlines()[1:])
    return {row[0]: float(row[1]) for row in rows if len(row) == 3 and row[0] != "wrote"}


@pytest.mark.parametrize("kind", ["full", "fmu"])
def test_rows_between_those_of_the_cycle(
    run_cli: RunCli, kind: str, tmp_path: Path, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rows weigh by their time, and what peaks between rows is found: sliding, while torque comes and speed goes."""
    cycle, coarse, fine = (tmp_path / name for name in ("cycle.csv", "coarse.csv", "fine.csv"))
    cycle.write_text("time_s,speed_rpm,torque_Nm,T_ambient_degC\n0,500,20,20\n300,500,20,20\n304,3000,20,20\n"
                     "324,300,250,20\n326,500,20,20\n600,500,20,20\n")  # fmt: skip
    driver = ["--gearbox", "fzg"] if kind == "full" else [request.getfixturevalue("fzg_native")]
    assert run_cli("simulate", *driver, cycle, "--output", coarse) == 0
    first = means(capsys.readouterr().out)
    assert (
        run_cli("simulate", *driver, cycle, "--output", fine, "--output-interval", "0.5", "--plot", tmp_path / "p.png")
        == 0
    )
    second = means(capsys.readouterr().out)
    few, many = pd.read_csv(coarse), pd.read_csv(fine)
    assert len(few) == 6
    assert many["time_s"].tolist() == [0.5 * i for i in range(1201)]
    at_rows = many[many["time_s"].isin(few["time_s"])]
    for name in few.columns:
        tolerance = {"abs": 0.1} if name.startswith("T_") else {"rel": 1e-3}
        assert at_rows[name].tolist() == pytest.approx(few[name].tolist(), **tolerance), name
    assert many["P_loss_mesh_sliding_W"].max() > 1.5 * few["P_loss_mesh_sliding_W"].max()
    for shown, table in ((first, few), (second, many)):
        for name, column in (("total", "P_loss_W"), ("mesh_sliding", "P_loss_mesh_sliding_W")):
            mean = np.trapezoid(table[column], table["time_s"]) / 600.0
            assert shown[name] == pytest.approx(mean, abs=0.051), name
    assert few["P_loss_W"].mean() > 1.5 * first["total"], "rows alone would say far more"


RECORDED = (
    "time_s,speed_rpm,torque_Nm,T_ambient_degC,T_oil_degC,T_pinion_degC,T_air_degC,T_cover_degC,P_loss_W\n"
    + "".join(f"{t},1500,80,20,{85.5 if t else ''},{90.5 - t},20,99,400\n" for t in (0, 20, 60))
)


@pytest.mark.parametrize("kind", ["full", "fmu"])
def test_a_recording_starts_as_recorded_or_a_warning_says_that_it_does_not(
    run_cli: RunCli, kind: str, tmp_path: Path, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, out = tmp_path / "run.csv", tmp_path / "result.csv"
    recording.write_text(RECORDED)
    driver = ["--gearbox", "fzg"] if kind == "full" else [request.getfixturevalue("fzg_fmu")]
    assert run_cli("simulate", *driver, recording, "--output", out) == 0
    shown = " ".join(capsys.readouterr().err.split())
    assert "warning: " in shown
    assert (
        "run.csv: T_pinion_degC is 90.5 at row 1, but all nodes start at the first ambient temperature, 20.0 degC; "
        "--initial recorded starts as recorded" in shown
    )
    assert run_cli("simulate", *driver, recording, "--output", out, "--initial", "recorded") == 0
    assert "warning" not in capsys.readouterr().err
    first = pd.read_csv(out).iloc[0]
    assert first[["T_oil_degC", "T_pinion_degC", "T_air_degC"]].tolist() == [85.5, 90.5, 20.0]
    for name in ("mesh", "housing_upper", "bearing_4"):  # no column: the mean of those of nodes
        assert first[f"T_{name}_degC"] == pytest.approx(88.0)


def test_a_recording_that_needs_a_mapping_is_driven_as_the_plain_one(
    run_cli: RunCli, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, mapped, farm = tmp_path / "run.csv", tmp_path / "lauf.csv", tmp_path / "farm.csv"
    results = [tmp_path / name for name in ("of_plain.csv", "of_mapped.csv", "of_part.csv", "of_farm.csv")]
    plain.write_text(RECORDED)
    table = pd.read_csv(plain).drop(columns=["T_air_degC", "T_cover_degC", "P_loss_W"])
    table.rename(columns={"T_oil_degC": "Sumpf"}).to_csv(mapped, sep=";", decimal=",", index=False)
    (tmp_path / "lauf.toml").write_text(
        'schema = 1\ncsv = { separator = ";", decimal = "," }\ncolumns.Sumpf = { quantity = "T_oil" }\n'
    )
    for recording, result in zip((plain, mapped, f"{mapped}@0..100"), results, strict=False):
        assert run_cli("simulate", "--gearbox", "fzg", recording, "--output", result, "--initial", "recorded") == 0
        noted = f"note: {recording}: air_speed_m_s was not recorded" in " ".join(capsys.readouterr().err.split())
        assert noted == (recording is not plain)
    for result in results[1:3]:
        assert pd.read_csv(result).equals(pd.read_csv(results[0]))
    farm.write_text("time_utc,Ds_avg,Cm_avg,Gost_avg,Git_avg\n" + "".join(
        f"2017-09-16T0{hour}:00:00Z,1700,5000,{55 + hour},40\n2017-09-16T0{hour}:30:00Z,1700,5000,55,40\n"
        for hour in range(3)))  # fmt: skip
    assert run_cli("simulate", "--gearbox", "la_haute_borne", farm, "--output", results[3]) == 0
    shown = " ".join(capsys.readouterr().err.split())
    assert "note: " in shown and "time_utc = 2017-09-16T00:00:00Z" in shown
    assert "Gost_avg is 55.0 at row 1, but all nodes start at the first ambient temperature, 20.0 degC" in shown
    assert pd.read_csv(results[3])["time_s"].tolist() == [1800.0 * i for i in range(6)]


def test_a_start_that_is_told_or_near_needs_no_warning(
    run_cli: RunCli, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, result = tmp_path / "run.csv", tmp_path / "result.csv"
    recording.write_text(RECORDED)
    assert run_cli("simulate", "--gearbox", "fzg", recording, "--output", result, "--initial", "20") == 0
    assert run_cli("simulate", "--gearbox", "fzg", result, "--output", tmp_path / "again.csv") == 0
    assert "warning" not in capsys.readouterr().err
    assert pd.read_csv(tmp_path / "again.csv").equals(pd.read_csv(result)), "a result is a cycle as well"


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (
            "full",
            "are outside the range that the definition names (speed to 6500 1/min, torque to 350 N m, temperatures",
        ),
        ("fmu", "are outside the surrogate's training domain"),
    ],
)
def test_what_lies_outside_the_range_is_told(
    run_cli: RunCli,
    kind: str,
    words: str,
    tmp_path: Path,
    request: pytest.FixtureRequest,
    capsys: pytest.CaptureFixture[str],
) -> None:
    cycle, out = tmp_path / "cycle.csv", tmp_path / "result.csv"
    cycle.write_text("time_s,speed_rpm,torque_Nm,T_ambient_degC\n0,500,100,20\n20,500,400,20\n40,500,400,20\n")
    driver = ["--gearbox", "fzg"] if kind == "full" else [request.getfixturevalue("fzg_fmu")]
    assert run_cli("simulate", *driver, cycle, "--output", out) == 0
    assert f"2 of 3 rows {words}" in " ".join(capsys.readouterr().err.split())
    assert pd.read_csv(out)["in_domain"].tolist() == [True, False, False]


def test_a_heat_that_nothing_survives_is_told(
    run_cli: RunCli, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Torque in N mm, say: a machine without geometry has no range of training that would show it."""
    cycle = tmp_path / "cycle.csv"
    for torque, told in ((290, False), (29000, True)):
        cycle.write_text(f"time_s,speed_rpm,torque_Nm\n0,1480,{torque}\n20000,1480,{torque}\n")
        assert run_cli("simulate", "--gearbox", "reducer", cycle, "--output", tmp_path / f"{torque}.csv") == 0
        said = " ".join(capsys.readouterr().err.split())
        assert ("which no gearbox survives; check the units of the cycle" in said) is told


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interrupted_build_leaves_nothing(number: signal.Signals, tmp_path: Path) -> None:
    # A test run in the background inherits an ignored SIGINT; a user's terminal does not.
    start = (
        "import runpy, signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "runpy.run_module('builder', run_name='__main__')"
    )
    command = [sys.executable, "-c", start, "build-fmu", "--output", str(tmp_path / "out"), "--jobs", "1"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, env=environment)
    for _ in range(3000):  # until the build has begun
        if list(tmp_path.glob("out/.unfinished-*")):
            break
        time.sleep(0.1)
    else:
        process.kill()
        pytest.fail("the build did not begin within five minutes")
    time.sleep(1.0)
    process.send_signal(number)
    _, message = process.communicate(timeout=60)
    assert process.returncode != 0
    assert not (tmp_path / "out").exists()
    assert b"Traceback" not in message


def test_build_fmu_from_a_definition(run_cli: RunCli, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "box"
    arguments = ("--samples", "300", "--jobs", "1", "--seed", "3")
    assert run_cli("build-fmu", "--gearbox", "conveyor", "--output", out, *arguments) == 0
    report = json.loads((out / "report.json").read_text())
    assert report["seed"] == 3
    assert report["samples_per_network"] == 300
    assert {p.name for p in out.iterdir()} == {
        "conveyor.fmu",
        "conveyor_native.fmu",
        "networks",
        "drive_cycle.csv",
        "drive_cycle.png",
        "drive_cycle_native.csv",
        "drive_cycle_native.png",
        "report.json",
    }
    python, native = (report["reference_cycle"][f"conveyor{suffix}.fmu"] for suffix in ("", "_native"))
    assert native["loss_difference_mean"] == pytest.approx(python["loss_difference_mean"], rel=0.1)
    assert 1e-5 < python["loss_difference_mean"] < 0.02
    assert 1e-4 < max(python["largest_temperature_difference_K"].values()) < 1.0
    shown = capsys.readouterr().out
    for row in (
        "mesh_sliding",
        "worst node",
        "conveyor_native.fmu needs no other software",
        "conveyor.fmu runs on Python",
    ):
        assert row in shown
