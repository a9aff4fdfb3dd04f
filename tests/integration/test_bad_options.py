"""What the verbs do with options and files that cannot be used: status 2, one message that says what, nothing left."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pandas as pd
import pytest

from models.assembly.gearbox import Gearbox
from models.correction.correction import Correction, Estimate, Finding, correction_text
from models.mechanisms import CATALOGUE, Scale
from tests.conftest import RunCli

ROWS = "0,0,0,20\n20,1500,80,20\n60,1500,-20,20\n"
FAR = "No such file or directory"


@pytest.fixture(scope="module")
def correction(fzg: Gearbox) -> str:
    """One finding and one calibrated parameter."""
    placed = CATALOGUE["windage"].placed(fzg.network(), Scale.of(fzg))[0]
    finding = Finding.of(placed, {p.name: (p.start + 0.5, 0.1) for p in placed.parameters}, mechanism="windage")
    known = fzg.network().parameters[0]
    estimate = Estimate(name=known.name, value=known.start, stderr=0.1, unit=known.unit)
    return correction_text(Correction.of(fzg, findings=(finding,), calibration=(estimate,)))


@pytest.fixture
def home(correction: str, tmp_path: Path) -> Path:
    """A folder with files of every kind, sound and spoiled."""
    texts = {
        "file": "x",
        "cycle.csv": f"time_s,speed_rpm,torque_Nm,T_ambient_degC\n{ROWS}",
        "slip.csv": f"time_s,speed_rpm,torque_Nm,T_amb_degC\n{ROWS}",
        "gap.csv": f"time_s,speed_rpm,torque_Nm,T_ambient_degC\n{ROWS.replace('0,0,0,20', '0,0,0,', 1)}",
        "T_none.csv": "time_s,speed_rpm\n0,0\n",
        "T_some.csv": "time_s,T_oil_degC\n0,20\n1,21\n",
        "T_missing.csv": "time_s,T_oil_degC\n0,20\n1,\n",
        "T_text.csv": "time_s,T_oil_degC\n0,20\n1,warm\n",
        "box.toml": 'schema = 1\nname = "x"\n',
        "found.toml": correction,
        "law.toml": correction.replace('law = "', 'law = "nonsense * ', 1),
        "parameter.toml": re.sub(r'(calibrated\W+name = )"\w+"', r'\1"mush"', correction),
        "raises.py": "1 / 0",
        "ends.py": "import sys; sys.exit(0)",
        "nothing.py": "x = 1",
        "fake.fmu": "nothing",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "bytes.toml").write_bytes(bytes(range(256)))
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "folder").mkdir()
    with zipfile.ZipFile(tmp_path / "zip.fmu", "w") as archive:
        archive.writestr("a", "b")
    time = [30.0 * i for i in range(200)]
    pd.DataFrame({
        "time_s": time, "speed_rpm": 1500.0, "torque_Nm": 80.0, "T_ambient_degC": 20.0,
        "T_oil_degC": [20.0 + t / 200.0 + i % 2 * 0.1 for i, t in enumerate(time)],
    }).to_csv(tmp_path / "train.csv", index=False)  # fmt: skip
    return tmp_path


# What the verbs check themselves; unknown options, choices and ranges are click's, and the contents of files have
# their own tests at the functions that read them.
WRONG = {
    "diagnose": {
        "missing.csv": "missing.csv: no such file",
        "folder": "folder: is not a file but a folder",
        "train.csv --output file/out": "file/out: cannot be written",
        "train.csv --mapping missing.toml": f"missing.toml: cannot be read ({FAR})",
        "train.csv --mechanisms raises.py": "raises.py: fails with ZeroDivisionError",
        "train.csv --mechanisms ends.py": "ends.py: fails with SystemExit",
        "train.csv --mechanisms nothing.py": "nothing.py: needs a list MECHANISMS",
        "train.csv --holdout train.csv": "train.csv: is held out",
        "train.csv train.csv": "name every row once",
        "train.csv --gearbox fgz": "no gearbox named 'fgz'; did you mean 'fzg'?",
        "": "Missing argument 'RECORDING",
    },
    "simulate --gearbox fzg": {
        "folder.csv": "folder.csv: is not a file",
        "slip.csv": "is T_ambient_degC meant?",
        "cycle.csv --output cycle.csv": "cycle.csv: is read as well and would be replaced",
        "cycle.csv --output ./folder/../cycle.csv": "is read as well and would be replaced",
        "cycle.csv --initial T_some.csv --output T_some.csv": "T_some.csv: is read as well and would be replaced",
        "train.csv@0..900 --output train.csv": "train.csv: is read as well and would be replaced",
        "cycle.csv --output r.csv --output-interval 0": "an output interval of 0 s is not possible",
        "cycle.csv --output r.csv --output-interval 1e-5": "gives 6e+06 rows over 60 s",
        "cycle.csv --output folder.csv": "folder.csv: is a folder",
        "cycle.csv --output r.xls": "r.xls: unknown file ending",
        "cycle.csv --plot p.txt": "p.txt: plots are written",
        "cycle.csv --plot p.png --output file/r.csv": "file/r.csv: cannot be written",
        "cycle.csv --initial -300": "above -273.15",
        "cycle.csv --initial 293": "if kelvin are meant, give 19.85",
        "cycle.csv --initial recorded": "--initial recorded needs a column T_<node>_degC",
        "cycle.csv --initial T_none.csv": "T_none.csv: has no T_<node>_degC columns",
        "cycle.csv --initial T_some.csv": "start temperatures are missing for: housing_lower",
        "cycle.csv --initial T_missing.csv": "T_missing.csv: start temperatures are missing for: housing_lower",
        "cycle.csv --initial T_text.csv": "T_oil_degC is 'warm' in the last row",
        "cycle.csv --correction bytes.toml": "bytes.toml: is not UTF-8 text",
        "cycle.csv --correction law.toml": "law.toml: finding 'windage_oil'",
        "cycle.csv --correction found.toml --gearbox conveyor": "found.toml: the correction was made for",
    },
    "simulate": {
        "cycle.csv": "simulate takes FMU CYCLE",
        "fake.fmu cycle.csv": "fake.fmu: is not an FMU",
        "zip.fmu cycle.csv": "zip.fmu: is not an FMU",
        "FMU cycle.csv --claims-only": "--claims-only is about --correction",
        "FMU cycle.csv --initial warm": "warm: is no start; a temperature in degC, 'recorded', or a table",
        "FMU cycle.csv --initial 293": "if kelvin are meant, give 19.85",
        "FMU cycle.csv --initial T_some.csv": "start temperatures are missing for: housing_lower",
        "FMU cycle.csv --correction found.toml": "was not built with found.toml, which changes the physics",
        "FMU gap.csv": "gap.csv: T_ambient_degC is nan at row 1",
    },
    "build-fmu": {
        "--correction parameter.toml": "the correction calibrates 'mush'",
        "--gearbox box.toml": "box.toml: source is missing",
        "--platforms win46": "platform 'win46' is not known; did you mean 'win64'?",
        "--target python --platforms host": "--platforms is about native FMUs",
        "--target python --fmi 3": "--fmi is about native FMUs, the Python FMU is FMI 2.0",
        "--claims-only": "--claims-only is about --correction",
        "--gearbox heated_rod --samples 300": "heated_rod.toml: has no geometry, so its FMU holds laws and no networks",
        "--gearbox heated_rod --preset paper": "leave out samples, preset and retrain",
        "--gearbox heated_rod --retrain": "leave out samples, preset and retrain",
        "--couple fram": "'fram' is not a boundary of this network; did you mean 'frame'?",
        "--output file/out": "file/out: cannot be written",
        "--dask nonsense": "no dask scheduler answers at nonsense",
    },
    "conceal": {
        "--gearbox two_stage --effect windage --seed 1": "two_stage.toml: has 2 stages; concealed cases are made of",
        "--effect windge --seed 1": "did you mean 'windage'?",
        "--effect windage --random --seed 1": "either --effect NAME or --random",
        "--effect windage --seed 1 --truth out/recordings": "the truth must not lie among the recordings",
    },
    "new": {
        "box.toml": "box.toml: exists already; choose another name, or give --replace",
        "box.txt": "box.txt: a definition ends in .toml",
        "file/box.toml": "file/box.toml: cannot be written",
        "mine.toml --like fgz": "'fgz' is not one of",
    },
    "check": {
        "missing.toml": f"missing.toml: cannot be read ({FAR})",
        "fgz": "no gearbox named 'fgz'; did you mean 'fzg'?",
        "box.toml": "box.toml: source is missing",
        "bytes.toml": "bytes.toml: is not UTF-8 text",
        "fzg --output net.txt": "net.txt: drawings are written as .svg, .png, .pdf",
        "fzg --output folder.csv": "folder.csv: drawings are written as",
        "fzg --output file/net.svg": "file/net.svg: cannot be written",
    },
    "schema": {"--output file/s.json": "file/s.json: cannot be written"},
    "reproduce": {"--output file/out": "file/out: cannot be written"},
}
OUTPUT = {"simulate": " --output r.csv", "new": "", "check": " --output net.svg"}
CASES = [
    (
        f"{verb} {line}" + ("" if "--output" in line else OUTPUT.get(verb.split()[0], " --output out")),
        message,
    )
    for verb, lines in WRONG.items()
    for line, message in lines.items()
]


@pytest.mark.parametrize(("line", "message"), CASES, ids=[line for line, _ in CASES])
def test_bad_input_of_a_verb_ends_with_status_2_and_leaves_nothing(
    line: str, message: str, home: Path, run_cli: RunCli, request: pytest.FixtureRequest,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    if "FMU" in line:
        line = line.replace("FMU", str(request.getfixturevalue("fzg_fmu")))
    monkeypatch.chdir(home)
    before = {path: path.stat().st_mtime_ns for path in home.rglob("*")}
    assert run_cli(*line.split()) == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert message in shown and "Traceback" not in shown
    assert {path: path.stat().st_mtime_ns for path in home.rglob("*")} == before
