"""The file of a proof: one line of JSON per diagnosis, written as it ends, so that a proof is continued where it stood.

The first line holds the settings and the hash of the code that decides. Every other one holds the answer to one task,
the SHA-256 of its ``diagnosis.json`` and of the recordings, and the time. A failed diagnosis is an answer too.
"""

from __future__ import annotations

import gzip
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from diagnosis.proof.cases.case_files import DEFINITION, MAPPING, OF_AIR
from models.base.errors import InputError
from models.base.version import project_version

SCHEMA = 1
ENDINGS = (".csv.gz", ".csv", ".parquet")
TEXTS, GZIP = ENDINGS[:2], b"\x1f\x8b"
DIGITS = 6

Plant = Literal["own", "zoo", "given"]
Sensors = Literal["rich", "lean", "poor"]
Data = Literal["full", "2 h", "600 s"]
SENSORS: tuple[Sensors, ...] = ("rich", "lean", "poor")  # all channels; oil, one housing part and the loss; oil alone
DATA: tuple[Data, ...] = ("full", "2 h", "600 s")  # all recordings; train_2 alone; its first ten minutes
SHORT = "train_2"


@dataclass(frozen=True, kw_only=True)
class ProofSettings:
    """Options of a proof.

    Attributes
    ----------
    plant : str
        ``own`` or ``zoo``: cases are made from `seed`; ``given``: recordings that exist
    seed, cases : int
    gearbox : str
        Name or file of the nominal definition; empty: drawn with each plant of the zoo
    cells_every : int
        Every n-th case is also diagnosed with fewer sensors and shorter recordings; 0: none
    families : str
        Families of the zoo, separated by commas; empty: all
    baselines : int
        How many baselines of a case a diagnosis of everything gets
    removed : bool
        True to diagnose every mechanism that is alone in a case once more with its entry removed from the catalogue
    """

    plant: Plant
    seed: int = 0
    cases: int = 0
    gearbox: str = "fzg"
    families: str = ""
    cells_every: int = 0
    baselines: int = 0
    removed: bool = False


@dataclass(frozen=True, kw_only=True)
class Task:
    """One diagnosis of the recordings of a case.

    Attributes
    ----------
    sensors, data : str
        Of :data:`SENSORS` and :data:`DATA`
    removed : str
        Mechanism that is removed from the catalogue, or empty
    """

    case: str
    sensors: Sensors = "rich"
    data: Data = "full"
    removed: str = ""

    @property
    def cell(self) -> str:
        """How it differs from a diagnosis of everything; empty if it does not."""
        if self.removed:
            return "entry removed"
        return "" if (self.sensors, self.data) == (SENSORS[0], DATA[0]) else f"{self.sensors}, {self.data}"


# ---------------------------------------------------------------------- what a diagnosis gets


def tasks_of(settings: ProofSettings, cases: Sequence[str], alone: Mapping[str, str]) -> list[Task]:
    """All diagnoses of a proof, those of everything first.

    Parameters
    ----------
    alone : mapping of case to str
        The only mechanism of a case, of those that have one
    """
    tasks = [Task(case=case) for case in cases]
    if settings.removed:
        first = {mechanism: case for case, mechanism in reversed(list(alone.items()))}
        tasks += [Task(case=case, removed=mechanism) for mechanism, case in first.items()]
    if settings.cells_every:
        cells = [(s, d) for s in SENSORS for d in DATA][1:]
        tasks += [Task(case=case, sensors=s, data=d) for case in cases[:: settings.cells_every] for s, d in cells]
    return tasks


def files_of(recordings: Path, task: Task, baselines: int = 0) -> tuple[dict[str, bytes], list[str]]:
    """Files that a diagnosis gets, and its arguments.

    Parameters
    ----------
    recordings : Path
        Folder with one folder per case: ``train_*`` to learn from, ``hold_*`` held out, ``baseline_*``
    baselines : int
        How many of the baselines, in the order of their names, unless recordings are cut short

    Returns
    -------
    files : dict of name to bytes
        Recordings with the channels of the task, the mapping file and definition of the case if there are; nothing else
    arguments : list of str

    Raises
    ------
    InputError
        If the folder has no recording to learn from, or too few baselines.
    """
    folder = recordings / task.case
    paths = sorted(path for path in folder.glob("*") if path.name.endswith(ENDINGS))
    train = [p for p in paths if p.name.startswith("train" if task.data == "full" else SHORT)]
    hold = [p for p in paths if p.name.startswith("hold") and task.data == "full"]
    if not train:
        raise InputError(f"{folder}: holds no recording named train_* ({', '.join(ENDINGS)})")
    healthy = [p for p in paths if p.name.startswith("baseline")][:baselines] if task.data == "full" else []
    if task.data == "full" and len(healthy) < baselines:
        raise InputError(f"{folder}: holds {len(healthy)} recordings named baseline_*, but {baselines} are asked for")
    files = {path.name: _with_sensors(path, task.sensors) for path in (*train, *hold, *healthy)}
    part = "@0..600" if task.data == "600 s" else ""
    arguments = [f"{path.name}{part}" for path in train]
    for path in hold:
        arguments += ["--holdout", path.name]
    for path in healthy:
        arguments += ["--baseline", path.name]
    if (folder / MAPPING).exists():
        text = (folder / MAPPING).read_text(encoding="utf-8")
        files[MAPPING] = (text if task.sensors == SENSORS[0] else _of_columns(text, files[train[0].name])).encode()
    if (folder / DEFINITION).exists():
        files[DEFINITION] = (folder / DEFINITION).read_bytes()
    return files, [*arguments, *(["--without-mechanism", task.removed] if task.removed else [])]


def kept_columns(columns: Sequence[str], sensors: Sensors) -> list[str]:
    """Columns of a set of sensors; inputs are always recorded.

    Examples
    --------
    >>> kept_columns(["time_s", "T_ambient_degC", "T_oil_degC", "T_housing_lower_degC", "T_pinion_degC"], "lean")
    ['time_s', 'T_ambient_degC', 'T_oil_degC', 'T_housing_lower_degC']
    """
    of_air = {f"{name}_degC" for name in OF_AIR}
    measured = [c for c in columns if (c.startswith("T_") and c not in of_air) or c == "P_loss_W"]
    housing = [c for c in measured if c.startswith("T_housing")][:1]
    kept = {"rich": measured, "lean": ["T_oil_degC", *housing, "P_loss_W"], "poor": ["T_oil_degC"]}[sensors]
    return [c for c in columns if c in kept or c not in measured]


def _with_sensors(path: Path, sensors: Sensors) -> bytes:
    content = path.read_bytes()
    if sensors == SENSORS[0]:
        return content
    if not path.name.endswith(TEXTS):
        raise InputError(f"{path}: sensors can be left out of text ({', '.join(TEXTS)}) only")
    zipped = path.name.endswith(".gz")
    rows = [line.split(",") for line in _text(content).splitlines()]
    at = [rows[0].index(c) for c in kept_columns(rows[0], sensors)]
    kept = "".join(",".join(row[i] for i in at) + "\n" for row in rows).encode()
    return gzip.compress(kept, mtime=0) if zipped else kept


def _text(content: bytes) -> str:
    return (gzip.decompress(content) if content.startswith(GZIP) else content).decode()


def _of_columns(mapping: str, recording: bytes) -> str:
    columns = _text(recording).partition("\n")[0].split(",")
    head, *blocks = mapping.rstrip("\n").split("\n\n")
    kept = [block for block in blocks if block.partition("]")[0].removeprefix("[columns.") in columns]
    return "\n\n".join([head, *kept]) + "\n"


# ---------------------------------------------------------------------- lines


def code_hash() -> str:
    """SHA-256 over the code and tables that decide: packages ``models`` and ``diagnosis`` without the proof."""
    digest = hashlib.sha256()
    for package in ("models", "diagnosis"):
        root = Path(str(resources.files(package)))
        for path in sorted(root.rglob("*")):
            name = path.relative_to(root).as_posix()
            if path.suffix in (".py", ".toml") and not (package == "diagnosis" and name.startswith("proof/")):
                digest.update(f"{package}/{name}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


def begin_lines(file: Path, settings: ProofSettings) -> None:
    """Write the first line.

    Raises
    ------
    InputError
        If the file holds answers.
    """
    if file.exists() and read_lines(file)[2]:
        raise InputError(f"{file}: holds answers already; continue it with --continue, or name another file")
    first = {"proof": SCHEMA, "settings": asdict(settings), "code": code_hash(), "version": project_version()}
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(first) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file}: cannot be written ({error.strerror})") from error


def read_lines(file: Path) -> tuple[ProofSettings, str, dict[Task, dict[str, Any]]]:
    """Settings, hash of the code and answered tasks; a last line that is not whole is cut off.

    Raises
    ------
    InputError
        If it is not a file of a proof.
    """
    try:
        content = file.read_text(encoding="utf-8")
        whole = content[: content.rfind("\n") + 1]
        first, *lines = map(json.loads, whole.splitlines())
        settings = ProofSettings(**first["settings"])
        records = {Task(**line.pop("task")): {**line, "recordings": str(line["recordings"])} for line in lines}
        code = str(first["code"])
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{file}: is not a file of answers that prove wrote ({error})") from error
    if whole != content:
        file.write_text(whole, encoding="utf-8")
    return settings, code, records


def refuse_other_code(file: Path, code: str) -> None:
    """Compare the hash of the code with that in the first line.

    Raises
    ------
    InputError
        If they differ.
    """
    now = code_hash()
    if now != code:
        raise InputError(
            f"{file}: was begun with other code (models and diagnosis {code[:12]}, here {now[:12]}); check out that "
            "version to continue it, or begin a new file"
        )


def append_line(file: Path, task: Task, record: Mapping[str, Any]) -> None:
    """Add the answer to a task."""
    with file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps({"task": asdict(task), **record}) + "\n")


def hash_list(records: Mapping[Task, Mapping[str, Any]]) -> str:
    """The list of hashes of all answers; it is written before the truth is opened."""
    names = {t: " ".join(filter(None, (t.case, t.cell, t.removed))) for t in records}
    return "".join(
        f"{r['sha256'] or r['status']}  {names[t]}\n" for t, r in sorted(records.items(), key=lambda i: names[i[0]])
    )


def compact(answer: Mapping[str, Any]) -> dict[str, Any]:
    """The part of ``diagnosis.json`` that scoring reads, and the reasons: :data:`DIGITS` digits of each number."""
    findings = [
        {
            **{key: one.get(key) for key in (*FINDING, "heat_W")},
            "parameters": one.get("parameters", []),
            "confusable_with": [
                {k: r.get(k) for k in ("mechanism", "place", "probability")} for r in one.get("confusable_with", [])
            ],
        }
        for one in answer.get("findings", [])
    ]
    location = [{k: place.get(k) for k in ("node", "probability", "heat_W")} for place in answer.get("location", [])]
    unseen = sorted({one["mechanism"] for one in answer.get("not_visible", [])})
    kept = {
        "verdict": answer["verdict"],
        "significance": answer.get("significance", {}),
        "findings": findings,
        "location": location,
        "fit": {"holdout": answer.get("fit", {}).get("holdout", {})},
        "not_visible": unseen,
        "error_class": answer.get("model_error", {}).get("class", ""),
        "placebo": (answer.get("sessions", {}).get("placebo") or {}).get("log_e_value"),
    }
    return dict(json.loads(json.dumps(kept), parse_float=lambda text: float(f"{float(text):.{DIGITS}g}")))


FINDING = ("mechanism", "family", "place", "node", "kind", "grade", "acts_like", "tie_set", "date", "probability")
