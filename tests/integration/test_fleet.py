"""A fleet of gearboxes through the verb: one report each, one table of all, and none lost for the fault of another."""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builder.workflows import fleet
from builder.workflows.fleet import members_of
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle
from tests.conftest import RunCli

SENSORS = ("oil", "housing_lower", "bearing_1")
REPORT = {"report.html", "diagnosis.json", "correction.toml", "posterior.npz", "train.csv"}


def recorded(gearbox: Gearbox, *, seed: int, hours: float, bias: float = 0.0) -> pd.DataFrame:
    """Steps of 10 min, every 40 s, from the model itself."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 3600.0 * hours + 1.0, 40.0)
    step = (time // 600.0).astype(int)
    columns = {
        "time_s": time, "speed_rpm": rng.uniform(500.0, 3500.0, step.max() + 1)[step],
        "torque_Nm": rng.uniform(30.0, 200.0, step.max() + 1)[step], "T_ambient_degC": np.full(len(time), 23.0),
        "air_speed_m_s": np.full(len(time), 2.0),
    }  # fmt: skip
    result = gearbox.network().simulate(Cycle.from_columns(columns), losses=gearbox.losses(), initial=24.0).columns()
    for name in SENSORS:
        columns[f"T_{name}_degC"] = result[f"T_{name}_degC"] + rng.normal(0.0, 0.15, len(time))
    columns["T_oil_degC"] = columns["T_oil_degC"] + bias
    return pd.DataFrame(columns).round(3)


@pytest.fixture(scope="module")
def folder(fzg: Gearbox, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four gearboxes: sound, with a biased sensor and a held-out folder, unreadable, without recordings."""
    home = tmp_path_factory.mktemp("fleet")
    for name in ("sound", "biased/holdout", "broken", "empty"):
        (home / name).mkdir(parents=True)
    recorded(fzg, seed=1, hours=1.5).to_csv(home / "sound/train.csv", index=False)
    recorded(fzg, seed=2, hours=1.0).to_csv(home / "sound/hold_1.csv", index=False)
    recorded(fzg, seed=3, hours=1.5, bias=4.0).to_csv(home / "biased/train.csv", index=False)
    # The held-out recording has the name of the one that is learned from.
    recorded(fzg, seed=4, hours=1.0, bias=4.0).to_csv(home / "biased/holdout/train.csv", index=False)
    recorded(fzg, seed=5, hours=0.5).drop(columns="torque_Nm").to_csv(home / "broken/train.csv", index=False)
    (home / "empty/notes.txt").write_text("nothing was recorded")
    return home


@pytest.fixture(scope="module")
def diagnosed(folder: Path, tmp_path_factory: pytest.TempPathFactory, run_cli: RunCli) -> tuple[Path, int]:
    """Output and exit status."""
    out = tmp_path_factory.mktemp("out") / "fleet"
    return out, run_cli("diagnose", folder, "--fleet", "--jobs", 2, "--output", out)


def test_baselines_lie_in_the_folder_of_a_gearbox(tmp_path: Path) -> None:
    for name in ("a/baseline/train.csv", "a/baseline_1.csv", "a/hold_1.csv", "a/train.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (member,) = members_of(tmp_path, without=tmp_path / "out")
    home = tmp_path / "a"
    assert (member.train, member.holdout) == ((home / "train.csv",), (home / "hold_1.csv",))
    assert member.baseline == (home / "baseline_1.csv", home / "baseline" / "train.csv")


def test_every_gearbox_has_its_row_and_the_good_ones_their_report(diagnosed: tuple[Path, int]) -> None:
    out, status = diagnosed
    assert status == 2
    table = pd.read_csv(out / "summary.csv").set_index("gearbox")
    assert list(table.index) == ["biased", "broken", "empty", "sound"]
    assert sorted(p.name for p in out.iterdir()) == ["biased", "sound", "summary.csv"]
    assert table.loc["biased", "verdict"] == "sensor_fault"
    assert table.loc["biased", "found"].startswith("claim: sensor_bias at oil")
    assert list(table.loc[["broken", "empty"], "verdict"]) == ["error", "error"]
    assert "column torque_Nm is missing" in table.loc["broken", "error"]
    assert "no recording to learn from" in table.loc["empty", "error"]
    for name in ("sound", "biased"):
        found = json.loads((out / name / "diagnosis.json").read_text())
        assert found["verdict"] == table.loc[name, "verdict"]
        held = found["fit"]["holdout"]
        for state in ("before", "calibrated", "after"):
            assert table.loc[name, f"rmse_{state}_K"] == pytest.approx(held[f"rmse_{state}_K"], abs=1e-6)
        assert {p.name for p in (out / name).iterdir()} >= REPORT
        assert pd.isna(table.loc[name, "error"])


def test_recordings_of_one_name_get_a_prediction_each(diagnosed: tuple[Path, int], folder: Path) -> None:
    out, _ = diagnosed
    learnt, judged = (pd.read_csv(out / "biased" / name) for name in ("train.csv", "train_held_out.csv"))
    assert len(learnt) == len(pd.read_csv(folder / "biased/train.csv"))
    assert len(judged) == len(pd.read_csv(folder / "biased/holdout/train.csv"))
    assert not judged.isna().to_numpy().any()


@pytest.mark.slow
def test_one_of_a_fleet_has_the_bytes_that_it_has_alone(
    diagnosed: tuple[Path, int], folder: Path, tmp_path: Path, run_cli: RunCli
) -> None:
    learnt, held = folder / "biased/train.csv", folder / "biased/holdout"
    assert run_cli("diagnose", learnt, "--holdout", held / "train.csv", "--output", tmp_path) == 0
    ours = json.loads((diagnosed[0] / "biased/diagnosis.json").read_text())
    assert json.loads((tmp_path / "diagnosis.json").read_text()) == ours


def test_the_table_is_shown_and_the_faults_are_told(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], run_cli: RunCli
) -> None:
    for name in ("broken", "empty"):
        shutil.copytree(folder / name, tmp_path / "fleet" / name)
    assert run_cli("diagnose", tmp_path / "fleet", "--fleet", "--output", tmp_path / "out") == 2
    shown = capsys.readouterr()
    assert "verdict" in shown.out
    assert "2 of 2 gearboxes could not be diagnosed" in shown.err
    assert "torque_Nm" in shown.err
    assert "Traceback" not in shown.err
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["summary.csv"]


def test_what_no_diagnosis_wrote_is_not_replaced(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], run_cli: RunCli
) -> None:
    shutil.copytree(folder / "sound", tmp_path / "fleet/sound")
    out, report = tmp_path / "out", tmp_path / "out/sound/report.html"
    report.parent.mkdir(parents=True)
    report.write_text("my own")
    assert run_cli("diagnose", tmp_path / "fleet", "--fleet", "--output", out) == 2
    assert "report.html: exists, and no diagnosis wrote it" in capsys.readouterr().err
    assert report.read_text() == "my own" and pd.read_csv(out / "summary.csv").loc[0, "verdict"] == "error"
    assert run_cli("diagnose", tmp_path / "fleet", "--fleet", "--output", out) == 2  # its own table is replaced
    (out / "summary.csv").write_text("mine\n")
    assert run_cli("diagnose", tmp_path / "fleet", "--fleet", "--output", out) == 2
    assert "summary.csv: exists, and no fleet wrote it; choose another --output" in capsys.readouterr().err
    assert (out / "summary.csv").read_text() == "mine\n"


def test_our_own_fault_with_one_leaves_the_others_and_ends_with_status_1(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, run_cli: RunCli
) -> None:
    def breaks(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by chance")

    monkeypatch.setattr(fleet, "diagnose", breaks)
    assert run_cli("diagnose", folder, "--fleet", "--jobs", 1, "--output", tmp_path / "out") == 1
    assert "ZeroDivisionError: by chance" in capsys.readouterr().err
    errors = pd.read_csv(tmp_path / "out/summary.csv").set_index("gearbox")["error"]
    assert errors["sound"] == "a fault of this program: ZeroDivisionError: by chance"
    assert "torque_Nm" in errors["broken"]


@pytest.mark.slow
def test_a_cluster_gives_the_same_reports(
    diagnosed: tuple[Path, int], folder: Path, tmp_path: Path, run_cli: RunCli
) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    for name in ("broken", "biased"):
        shutil.copytree(folder / name, tmp_path / "fleet" / name)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, protocol="tcp", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        assert run_cli("diagnose", tmp_path / "fleet", "--fleet", "--dask", address, "--output", tmp_path / "out") == 2
    ours, theirs = diagnosed[0], tmp_path / "out"
    for name in sorted(p.name for p in (ours / "biased").iterdir()):
        assert (theirs / "biased" / name).read_bytes() == (ours / "biased" / name).read_bytes(), name
    assert list(pd.read_csv(theirs / "summary.csv")["verdict"]) == ["sensor_fault", "error"]


FAULTY = [
    (["FOLDER", "--fleet", "--holdout", "x.csv"], "--fleet takes one folder"),
    (["FOLDER", "FOLDER", "--fleet"], "--fleet takes one folder"),
    (["FOLDER/nothing", "--fleet"], "nothing: cannot be read (No such file or directory)"),
    (["FOLDER/sound/train.csv", "--fleet"], "train.csv: cannot be read (Not a directory)"),
    (["FOLDER/sound", "--fleet"], "it holds recordings itself: name them, without --fleet"),
    (["FOLDER/empty", "--fleet"], "has no folder of a gearbox in it"),
    (["FOLDER", "--fleet", "--jobs", "2", "--dask", "tcp://127.0.0.1:1"], "exclude each other"),
    (["FOLDER", "--fleet", "--dask", "tcp://127.0.0.1:1"], "no dask scheduler answers at tcp://127.0.0.1:1"),
    (["FOLDER/sound/train.csv", "--dask", "tcp://127.0.0.1:1"], "give --fleet with it"),
    (["FOLDER", "--fleet", "--gearbox", "fgz"], "did you mean 'fzg'?"),
]


@pytest.mark.parametrize(("arguments", "message"), FAULTY, ids=[message for _, message in FAULTY])
def test_faulty_options_end_with_status_2_and_leave_nothing(
    arguments: list[str], message: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch, run_cli: RunCli,
) -> None:  # fmt: skip
    monkeypatch.setattr("models.base.parallel.CONNECT_S", 1.0)
    given = [a.replace("FOLDER", str(folder)) for a in arguments]
    assert run_cli("diagnose", *given, "--output", tmp_path / "out") == 2
    shown = capsys.readouterr().err
    assert message in " ".join(shown.split())
    assert "Traceback" not in shown
    assert list(tmp_path.iterdir()) == []


def test_members_are_folders_with_recordings_of_every_kind(tmp_path: Path) -> None:
    for name in ("a/train.csv", "a/train.toml", "a/Holdout_2.CSV", "a/.hidden.csv", "a/holdout/x.parquet",
                 "a/other/x.csv", ".git/x.csv", "out/b/train.csv"):  # fmt: skip
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(gzip.compress(b""))
    (only,) = members_of(tmp_path, without=tmp_path / "out")
    assert only.name == "a"
    assert [p.name for p in only.train] == ["train.csv"]
    assert [p.name for p in only.holdout] == ["Holdout_2.CSV", "x.parquet"]
    with pytest.raises(InputError, match="no folder of a gearbox"):
        members_of(tmp_path / "out", without=tmp_path / "out/b")
