"""What the verbs do with options and files that cannot be used: status 2, one message that says what, nothing left."""

from __future__ import annotations

import os
import re
import sys
import zipfile
from pathlib import Path

import pandas as pd
import pytest

from builder.__main__ import main
from models.correction import Correction, Estimate, Finding, correction_text
from models.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale

ROWS = "0,0,0,20\n20,1500,80,20\n60,1500,-20,20\n"
FAR = "No such file or directory"


@pytest.fixture(scope="module")
def correction(fzg: Gearbox) -> str:
    """One finding and one calibrated parameter."""
    placed = CATALOGUE["windage"].placed(fzg.network(), Scale.of(fzg))[0]
    finding = Finding.of(placed, {p.name: (p.start + 0.5, 0.1) for p in placed.parameters}, mechanism="windage")
    known = fzg.network().parameters[0]
    estimate = Estimate(name=known.name, value=known.start, stderr=0.1, unit=known.unit)
    return correction_text(
        Correction(gearbox=fzg.name, gearbox_sha256=fzg.hash, findings=(finding,), calibration=(estimate,))
    )


@pytest.fixture
def home(correction: str, tmp_path: Path) -> Path:
    """A folder with files of every kind, sound and spoiled."""
    texts = {
        "file": "x",
        "empty.csv": "",
        "cycle.csv": f"time_s,speed_rpm,torque_Nm,T_ambient_degC\n{ROWS}",
        "plot.svg": "kept",
        "slip.csv": f"time_s,speed_rpm,torque_Nm,T_amb_degC\n{ROWS}",
        "gap.csv": f"time_s,speed_rpm,torque_Nm,T_ambient_degC\n{ROWS.replace('0,0,0,20', '0,0,0,', 1)}",
        "back.csv": "time_s,speed_rpm,torque_Nm\n10,0,0\n5,0,0\n",
        "T_none.csv": "time_s,speed_rpm\n0,0\n",
        "T_some.csv": "time_s,T_oil_degC\n0,20\n1,21\n",
        "T_missing.csv": "time_s,T_oil_degC\n0,20\n1,\n",
        "T_text.csv": "time_s,T_oil_degC\n0,20\n1,warm\n",
        "T_kelvin.csv": "time_s,T_oil_degC\n0,290\n1,300\n",
        "T_header.csv": "time_s,T_oil_degC\n",
        "no.toml": "schema = = 1",
        "empty.toml": "",
        "schema.toml": "schema = 9\n",
        "box.toml": 'schema = 1\nname = "x"\n',
        "found.toml": correction,
        "cut.toml": correction[: correction.index("[[finding.parameter]]") + 30],
        "law.toml": correction.replace('law = "', 'law = "nonsense * ', 1),
        "code.toml": correction.replace('law = "', 'law = "__import__(1) * ', 1),
        "nan.toml": re.sub(r"value = [-+0-9.e]+", "value = nan", correction, count=1),
        "other.toml": re.sub(r'sha256 = "[0-9a-f]{64}"', f'sha256 = "{"0" * 64}"', correction, count=1),
        "parameter.toml": re.sub(r'(\[\[calibrated\]\]\nname = )"\w+"', r'\1"mush"', correction),
        "raises.py": "1 / 0",
        "ends.py": "import sys; sys.exit(0)",
        "syntax.py": "def (",
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
    with zipfile.ZipFile(tmp_path / "xml.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", "<a/>")
    time = [30.0 * i for i in range(200)]
    pd.DataFrame({
        "time_s": time, "speed_rpm": 1500.0, "torque_Nm": 80.0, "T_ambient_degC": 20.0,
        "T_oil_degC": [20.0 + t / 200.0 + i % 2 * 0.1 for i, t in enumerate(time)],
    }).to_csv(tmp_path / "train.csv", index=False)  # fmt: skip
    return tmp_path


DIAGNOSE = {
    "missing.csv": "missing.csv: cannot be read (missing.csv: no such file)",
    "folder": "folder: is not a file but a folder; name a file in it",
    "folder.csv": "folder.csv: is not a file",
    "cycle.csv": "cycle.csv: no temperature was measured: a column T_<node>_degC is needed",
    "train.csv --output file": "'file' is a file",
    "train.csv --output file/out": "file/out: cannot be written",
    "train.csv --mapping missing.toml": f"missing.toml: cannot be read ({FAR})",
    "train.csv --mapping folder": "'folder' is a directory",
    "train.csv --mapping no.toml": "no.toml: is not valid TOML",
    "train.csv --mapping bytes.toml": "bytes.toml: is not UTF-8 text",
    "train.csv --mapping empty.toml": "empty.toml: has no 'schema = 1'",
    "train.csv --mapping found.toml": "found.toml: gearbox is not a known key",
    "train.csv --mechanisms missing.toml": f"missing.toml: cannot be read ({FAR})",
    "train.csv --mechanisms missing.py": "missing.py: cannot be read as a Python file",
    "train.csv --mechanisms no.toml": "no.toml: is not valid TOML",
    "train.csv --mechanisms bytes.toml": "bytes.toml: is not UTF-8 text",
    "train.csv --mechanisms empty.toml": "empty.toml: schema is None",
    "train.csv --mechanisms raises.py": "raises.py: fails with ZeroDivisionError",
    "train.csv --mechanisms ends.py": "ends.py: fails with SystemExit",
    "train.csv --mechanisms syntax.py": "syntax.py: fails with SyntaxError",
    "train.csv --mechanisms nothing.py": "nothing.py: needs a list MECHANISMS",
    "train.csv --holdout train.csv": "train.csv: is held out, but has the rows of 0 ... 5970 s in common with",
    "train.csv train.csv": "name every row once",
    "train.csv --holdout missing.csv": "missing.csv: no such file",
    "train.csv --gearbox missing.toml": f"missing.toml: cannot be read ({FAR})",
    "train.csv --gearbox fgz": "no gearbox named 'fgz'; did you mean 'fzg'?",
    "train.csv --gearbox box.toml": "box.toml: source is missing",
    "train.csv --gearbox bytes.toml": "bytes.toml: is not UTF-8 text",
    "train.csv --false-alarm-rate 2": "2.0 is not in the range",
    "train.csv --jobs 0": "0 is not in the range",
    "": "diagnose has no RECORDING to learn from",
    "--holdout train.csv": "no RECORDING to learn from; --holdout takes all up to the next option",
}
SIMULATE = {
    "folder.csv": "folder.csv: is not a file",
    "folder": "folder: is not a file but a folder; name a file",
    "cycle.csv --output cycle.csv": "cycle.csv: is read as well and would be replaced; choose another output",
    "cycle.csv --initial T_some.csv --output T_some.csv": "T_some.csv: is read as well and would be replaced",
    "cycle.csv --output ./folder/../cycle.csv": "is read as well and would be replaced",
    "slip.csv": "slip.csv: column T_amb_degC is not known; is T_ambient_degC meant? rename it, or remove it",
    "cycle.csv --output r.csv --output-interval 0": "an output interval of 0 s is not possible",
    "cycle.csv --output r.csv --output-interval nan": "an output interval of nan s is not possible",
    "cycle.csv --output r.csv --output-interval fast": "'fast' is not a valid float",
    "cycle.csv --output r.csv --output-interval 1e-5": "gives 6e+06 rows over 60 s; up to 5000000 are possible: choose",
    "cycle.csv --initial recorded": "cycle.csv: --initial recorded needs a column T_<node>_degC with a temperature",
    "cycle.csv --initial folder": "folder: is not a file but a folder; name a file",
    "empty.csv": "empty.csv: is empty",
    "gap.csv": "gap.csv: T_ambient_degC is nan at row 1",
    "back.csv": "back.csv: time_s",
    "cycle.csv --output folder.csv": "folder.csv: is a folder; name a file",
    "cycle.csv --output file/r.csv": "file/r.csv: cannot be written",
    "cycle.csv --output r.txt": "r.txt: unknown file ending",
    "cycle.csv --plot file/p.png": "file/p.png: cannot be written",
    "cycle.csv --plot p.png --output file/r.csv": "file/r.csv: cannot be written",
    "cycle.csv --initial missing.csv": "missing.csv: no such file",
    "cycle.csv@0..9": "cycle.csv: has 1 rows in the part that is named; a recording has 3 or more",
    "cycle.csv@9..0": "cycle.csv@9..0: '9..0' ends before it starts",
    "train.csv@0..900 --output train.csv": "train.csv: is read as well and would be replaced",
    "train.csv@2020-01-01..": "train.csv: a part is named by date, but column time_s tells seconds; name seconds",
    "train.csv --mapping missing.toml": f"missing.toml: cannot be read ({FAR})",
    "train.csv --mapping no.toml": "no.toml: is not valid TOML",
    "train.csv --mapping found.toml": "found.toml: gearbox is not a known key",
    "cycle.mf4": "cycle.mf4: no such file",
    "cycle.csv --initial T_none.csv": "T_none.csv: has no T_<node>_degC columns",
    "cycle.csv --initial T_some.csv": "initial temperatures are missing for: housing_lower",
    "cycle.csv --initial ./T_some.csv": "one temperature for all (--initial 20), or --initial recorded",
    "cycle.csv --initial T_missing.csv": "T_missing.csv: T_oil_degC is nan in the last row, row 2",
    "cycle.csv --initial T_text.csv": "T_text.csv: T_oil_degC is warm in the last row, row 2",
    "cycle.csv --initial T_kelvin.csv": "T_kelvin.csv: T_oil_degC is 300 in the last row",
    "cycle.csv --initial T_header.csv": "T_header.csv: has no T_<node>_degC columns with values",
    "cycle.csv --correction missing.toml": f"missing.toml: cannot be read ({FAR})",
    "cycle.csv --correction folder": "'folder' is a directory",
    "cycle.csv --correction no.toml": "no.toml: is not valid TOML",
    "cycle.csv --correction bytes.toml": "bytes.toml: is not UTF-8 text",
    "cycle.csv --correction empty.toml": "empty.toml: schema is None",
    "cycle.csv --correction schema.toml": "schema.toml: schema is 9",
    "cycle.csv --correction cut.toml": "cut.toml: ",
    "cycle.csv --correction law.toml": "law.toml: finding 'windage_oil'.law: 'nonsense' is not a signal",
    "cycle.csv --correction code.toml": "code.toml: finding 'windage_oil'.law",
    "cycle.csv --correction nan.toml": "nan.toml: calibrated 'mesh'.value: must be finite",
    "cycle.csv --correction other.toml": "other.toml: the correction was made for",
    "cycle.csv --correction parameter.toml": "the correction calibrates 'mush'",
    "cycle.csv --correction found.toml --gearbox conveyor": "found.toml: the correction was made for",
}
DRIVE = {
    "fake.fmu cycle.csv": "fake.fmu: is not an FMU",
    "zip.fmu cycle.csv": "zip.fmu: is not an FMU",
    "xml.fmu cycle.csv": "xml.fmu: is not an FMU",
    "folder cycle.csv": "folder: is not a file but a folder; name an FMU",
    "fake.fmu cycle.csv --output cycle.csv": "cycle.csv: is read as well and would be replaced",
    "cycle.csv cycle.csv --output r.csv --plot plot.svg --initial plot.svg": "plot.svg: is read as well and would be",
    "FMU cycle.csv --initial T_some.csv": "initial temperatures are missing for: housing_lower",
    "FMU cycle.csv --initial T_text.csv": "T_text.csv: T_oil_degC is warm in the last row",
    "FMU cycle.csv --correction found.toml": "--correction goes with --gearbox",
    "FMU train.csv --mapping empty.toml": "--mapping goes with --gearbox; an FMU takes plain cycles",
    "FMU gap.csv": "gap.csv: T_ambient_degC is nan at row 1",
}
BUILD = {
    "--correction missing.toml": f"missing.toml: cannot be read ({FAR})",
    "--correction no.toml": "no.toml: is not valid TOML",
    "--correction law.toml": "law.toml: finding 'windage_oil'.law",
    "--correction found.toml --gearbox conveyor": "found.toml: the correction was made for",
    "--correction parameter.toml": "the correction calibrates 'mush'",
    "--gearbox box.toml": "box.toml: source is missing",
    "--gearbox missing.toml": f"missing.toml: cannot be read ({FAR})",
    "--target native --platforms vax": "platform 'vax' is not known",
    "--target both --platforms ,": "no platform is named",
    "--platforms host": "--platforms is about native FMUs",
    "--output file": "'file' is a file",
    "--output file/out": "file/out: cannot be written",
    "--dask nonsense": "no dask scheduler answers at nonsense",
    "--preset best": "'best' is not one of",
}
CONCEAL = {
    "--effect windge --seed 1": "'windge' is not an effect that can be concealed; did you mean 'windage'?",
    "--seed 1": "either --effect NAME or --random",
    "--effect windage --random --seed 1": "either --effect NAME or --random",
    "--effect windage": "Missing option '--seed'",
    "--effect windage --seed 1 --output file": "'file' is a file",
    "--effect windage --seed 1 --output file/out": "file/out/recordings: cannot be written",
    "--effect windage --seed 1 --truth out/recordings": "the truth must not lie among the recordings",
    "--effect windage --seed 1 --truth file/truth": "file/truth: cannot be written",
    "--effect windage --seed 1 --strength 100": "100.0 is not in the range",
    "--random --seed 1 --strength 1": "--strength goes with --effect",
    "--random --seed 1 --cases 0": "0 is not in the range",
    "--random --seed 1 --gearbox box.toml": "box.toml: source is missing",
}
REPRODUCE = {
    "--output file": "'file' is a file",
    "--output file/out": "file/out: cannot be written",
    "--jobs 0": "0 is not in the range",
    "--seed -1": "-1 is not in the range",
}


def cases() -> list[tuple[str, str]]:
    """Command lines and what their message says; the output is ``out`` or ``r.csv`` where none is named."""
    every = []
    for verb, output, wrong in (
        ("diagnose", "out", DIAGNOSE), ("simulate --gearbox fzg", "r.csv", SIMULATE), ("simulate", "r.csv", DRIVE),
        ("build-fmu", "out", BUILD), ("conceal", "out", CONCEAL), ("reproduce", "out", REPRODUCE),
    ):  # fmt: skip
        for line, message in wrong.items():
            named = line if "--output" in line else f"{line} --output {output}"
            every.append((f"{verb} {named}", message))
    return every


@pytest.mark.parametrize(("line", "message"), cases(), ids=[line for line, _ in cases()])
def test_bad_input_of_a_verb_ends_with_status_2_and_leaves_nothing(
    line: str, message: str, home: Path, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    if "FMU" in line:
        line = line.replace("FMU", str(request.getfixturevalue("fzg_fmu")))
    monkeypatch.chdir(home)
    monkeypatch.setattr(sys, "argv", ["builder", *line.split()])
    before = {path: path.stat().st_mtime_ns for path in home.rglob("*") if path.is_file()}
    with pytest.raises(SystemExit) as end:
        main()
    shown = capsys.readouterr()
    assert end.value.code == 2, shown.err
    assert message in " ".join(shown.err.split())
    assert "Traceback" not in shown.err
    assert {path: path.stat().st_mtime_ns for path in home.rglob("*") if path.is_file()} == before
    assert sorted(path.name for path in home.iterdir() if path.is_dir()) == ["folder", "folder.csv"]


@pytest.mark.parametrize("line", ["diagnose train.csv --output out", "simulate --gearbox fzg train.csv --output r.csv"])
def test_a_file_that_may_not_be_read(
    line: str, home: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (home / "train.csv").chmod(0)
    if os.access(home / "train.csv", os.R_OK):
        pytest.skip("root reads every file")
    monkeypatch.chdir(home)
    monkeypatch.setattr(sys, "argv", ["builder", *line.split()])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    shown = capsys.readouterr().err
    assert "train.csv" in shown
    assert "Permission denied" in shown or "is not readable" in shown
    assert not (home / "out").exists()
    assert not (home / "r.csv").exists()
