"""The protocol of an honest proof.

1. Cases are drawn from a seed and simulated. Only their recordings are written: the truth is on no disk while anything
   is diagnosed.
2. Every diagnosis is a separate process that gets the recordings and the nominal definition, and cannot import the
   plant (:data:`BLIND`).
3. When all answers are there, the list of their SHA-256 is written.
4. Only then the truth is made from the seed, and every case is counted. All this is done by one version of the code.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from diagnosis.proof.cases.case_files import MAPPING
from diagnosis.proof.cases.conceal import PHYSICS, conceal_set, mixed_plans
from diagnosis.proof.cases.concealed_case import Plan
from models.assembly.gearbox import Gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.base.version import project_version

# The whole proof: every mechanism of the catalogue twice as a single.
MIX = {"control": 60, "single": 2 * len(PHYSICS), "double": 30, "messy": 30, "outside": 30, "sensor": 15}
WHOLE = sum(MIX.values())
# Opened while the diagnosis was developed: thresholds were set on the first, open forms, the search for thermostats and
# some rules made while looking at others.
DEVELOPMENT_SEEDS = (1, *range(2026, 2038), 2039, 2041)
UNOPENED_SEED = 2042  # nobody has seen its truth; once opened it belongs above
# Start of a diagnosis: an import of the plant, or of anything else of the proof, is an ImportError there.
BLIND = "import sys; sys.modules['diagnosis.proof'] = None; from builder.__main__ import main; main()"

Sensors = Literal["rich", "lean", "poor"]
Data = Literal["full", "2 h", "600 s"]
SENSORS: Mapping[Sensors, str] = {
    "rich": "every channel",
    "lean": "oil, one housing temperature, total loss",
    "poor": "oil alone",
}
DATA: Mapping[Data, str] = {
    "full": "22 h to learn from, 6 h held out",
    "2 h": "one random cycle from cold, its last quarter held out",
    "600 s": "the first ten minutes of that cycle",
}
FIRST = ("rich", "full")
TRAIN, HOLD, SHORT = ("train_1", "train_2", "train_3"), ("hold_1", "hold_2"), "train_2"
ENDING = ".csv.gz"
RECORDINGS, ANSWERS, TRUTH = "recordings", "answers", "truth"
SETTINGS, HASHES = "settings.json", "answers.sha256"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Options of a proof.

    Attributes
    ----------
    seed : int
    cases : int
        Number of cases, in the proportions of :data:`MIX`
    gearbox : str
        Name or file of the definition
    cells_every : int
        Every n-th case of each group is also diagnosed with fewer sensors and shorter recordings; 0: none
    """

    seed: int
    cases: int = WHOLE
    gearbox: str = "fzg"
    cells_every: int = 3


@dataclass(frozen=True, kw_only=True)
class Task:
    """One diagnosis of the recordings of a case.

    Attributes
    ----------
    case : str
    sensors, data : str
        Keys of :data:`SENSORS` and :data:`DATA`
    removed : str or None
        Mechanism that is removed from the catalogue
    """

    case: str
    sensors: Sensors = "rich"
    data: Data = "full"
    removed: str | None = None

    @property
    def name(self) -> str:
        """Name of the file of its answer."""
        cell = f"{self.sensors}-{self.data.replace(' ', '')}"
        return f"{self.case}_{'removed' if self.removed else cell}"


# ---------------------------------------------------------------------- tasks


def mix_of(cases: int) -> dict[str, int]:
    """Number of cases of each group, in the proportions of :data:`MIX`, at least one of each.

    Raises
    ------
    InputError
        If there are fewer cases than groups.

    Examples
    --------
    >>> mix_of(60)
    {'control': 15, 'single': 20, 'double': 7, 'messy': 7, 'outside': 7, 'sensor': 4}
    >>> mix_of(WHOLE) == MIX
    True
    """
    if cases < len(MIX):
        raise InputError(f"{cases} cases are too few: {len(MIX)} groups ({', '.join(MIX)}) need one each")
    shares = {group: cases * number / WHOLE for group, number in MIX.items()}
    counts = {group: max(1, int(share)) for group, share in shares.items()}
    while sum(counts.values()) > cases:
        counts[max((g for g in counts if counts[g] > 1), key=lambda group: counts[group] - shares[group])] -= 1
    while sum(counts.values()) < cases:
        counts[max(shares, key=lambda group: shares[group] - counts[group])] += 1
    return counts


def plans_of(settings: Settings) -> dict[str, Plan]:
    """Plan of every case by its name."""
    plans = mixed_plans(settings.seed, mix_of(settings.cases))
    digits = max(3, len(str(len(plans))))
    return {f"case_{i:0{digits}d}": plan for i, plan in enumerate(plans, start=1)}


def tasks_of(settings: Settings, plans: Mapping[str, Plan]) -> list[Task]:
    """All diagnoses of a proof, the main cell first.

    Every case with all sensors and recordings; every mechanism that is the only one in a case once more with its entry
    removed from the catalogue; and part of the cases in the other cells.
    """
    tasks = [Task(case=case) for case in plans]
    seen: set[str] = set()
    turn: dict[str, int] = {}
    others = []
    for case, plan in plans.items():
        if plan.group == "single" and plan.effects[0] not in seen:
            seen.add(plan.effects[0])
            tasks.append(Task(case=case, removed=plan.effects[0]))
        turn[plan.group] = turn.get(plan.group, -1) + 1
        if settings.cells_every and turn[plan.group] % settings.cells_every == 0:
            others += [
                Task(case=case, sensors=s, data=d) for s in SENSORS for d in DATA if (s, d) != FIRST
            ]  # fmt: skip
    return tasks + others


def files_of(recordings: Path, task: Task) -> tuple[dict[str, bytes], list[str]]:
    """Files that a diagnosis gets, and its arguments.

    Parameters
    ----------
    recordings : Path
        Folder with one folder per case
    task : Task

    Returns
    -------
    files : dict of name to bytes
        Recordings with the channels of the task, and their data sheet; nothing else
    arguments : list of str
    """
    folder = recordings / task.case
    train, hold = (TRAIN, HOLD) if task.data == "full" else ((SHORT,), ())
    files = {}
    for name in (*train, *hold):
        text = gzip.decompress((folder / f"{name}{ENDING}").read_bytes()).decode()
        files[f"{name}{ENDING}"] = gzip.compress(_reduced(text, task.sensors).encode(), mtime=0)
    if (folder / MAPPING).exists():
        header = gzip.decompress(files[f"{train[0]}{ENDING}"]).decode().partition("\n")[0].split(",")
        files[MAPPING] = _without_columns((folder / MAPPING).read_text(encoding="utf-8"), header).encode()
    part = "@0..600" if task.data == "600 s" else ""
    arguments = [f"{name}{ENDING}{part}" for name in train]
    for name in hold:
        arguments += ["--holdout", f"{name}{ENDING}"]
    if task.removed is not None:
        arguments += ["--without-mechanism", task.removed]
    return files, arguments


def kept_columns(columns: Sequence[str], sensors: Sensors) -> list[str]:
    """Columns of a set of sensors; inputs are always recorded.

    Examples
    --------
    >>> kept_columns(["time_s", "T_ambient_degC", "T_oil_degC", "T_housing_lower_degC", "T_pinion_degC"], "lean")
    ['time_s', 'T_ambient_degC', 'T_oil_degC', 'T_housing_lower_degC']
    """
    temperatures = [c for c in columns if c.startswith("T_") and c != "T_ambient_degC"]
    housing = [c for c in temperatures if c.startswith("T_housing")][:1]
    kept = {"rich": [*temperatures, "P_loss_W"], "lean": ["T_oil_degC", *housing, "P_loss_W"], "poor": ["T_oil_degC"]}
    return [c for c in columns if c in kept[sensors] or (c not in temperatures and c != "P_loss_W")]


def _reduced(text: str, sensors: Sensors) -> str:
    header, *lines = text.splitlines()
    columns = header.split(",")
    kept = kept_columns(columns, sensors)
    at = [columns.index(c) for c in kept]
    rows = (line.split(",") for line in lines)
    return "\n".join([",".join(kept), *(",".join(row[i] for i in at) for row in rows)]) + "\n"


def _without_columns(mapping: str, columns: Sequence[str]) -> str:
    head, *blocks = mapping.rstrip("\n").split("\n\n")
    kept = [block for block in blocks if block.partition("]")[0].removeprefix("[columns.") in columns]
    return "\n\n".join([head, *kept]) + "\n"


# ---------------------------------------------------------------------- steps


def code_hash() -> str:
    """SHA-256 over code and tables of diagnosis, plant and scoring."""
    digest = hashlib.sha256()
    for package in ("models", "diagnosis"):
        root = Path(str(resources.files(package)))
        for path in sorted(root.rglob("*")):
            if path.suffix in (".py", ".toml"):
                digest.update(f"{package}/{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


def begin(
    settings: Settings, gearbox: Gearbox, folder: Path, progress: Callable[[int, int], None] | None = None
) -> None:
    """Make the recordings; a folder that holds them already is continued.

    Raises
    ------
    InputError
        If the settings cannot be met, or the folder holds other files, or a proof with other options or code.
    """
    plans = list(plans_of(settings).values())
    # Only a hash of the options is written, so that the folder does not contain the seed.
    options = json.dumps({**asdict(settings), "gearbox": gearbox.hash}, sort_keys=True)
    about = {"options": hashlib.sha256(options.encode()).hexdigest(), "code": code_hash(), "version": project_version()}
    file = folder / SETTINGS
    if not file.exists():
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: is not empty and holds no proof; choose another output folder")
        write_text(file, json.dumps(about, indent=1) + "\n")
    before = json.loads(file.read_text(encoding="utf-8"))
    for key, difference in (("options", "other options"), ("code", "another version of the code")):
        if before.get(key) != about[key]:
            raise InputError(f"{folder}: holds a proof with {difference}; choose another output folder")
    if not (folder / RECORDINGS).exists():
        with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=folder) as unfinished:
            made = Path(unfinished) / RECORDINGS
            conceal_set(gearbox, plans, seed=settings.seed, recordings=made, truth=None, progress=progress)
            made.replace(folder / RECORDINGS)


def open_tasks(folder: Path, tasks: Sequence[Task]) -> list[Task]:
    """Tasks without an answer.

    Raises
    ------
    InputError
        If the answers are fixed already: then none may be added.
    """
    missing = [task for task in tasks if not answer_file(folder, task).exists()]
    if missing and (folder / HASHES).exists():
        raise InputError(f"{answer_file(folder, missing[0])}: is missing, but all answers were fixed in {HASHES}; "
                         "start again in another folder")  # fmt: skip
    return missing


def answer_file(folder: Path, task: Task) -> Path:
    """File of the answer to a task."""
    return folder / ANSWERS / f"{task.name}.json"


def fix_answers(folder: Path, tasks: Sequence[Task]) -> None:
    """Write the SHA-256 of every answer; compare them if that has been done.

    Raises
    ------
    InputError
        If an answer was changed since, or the code was changed while the answers were made.
    """
    if code_hash() != json.loads((folder / SETTINGS).read_text(encoding="utf-8"))["code"]:
        raise InputError("the code was changed while the proof ran; start again in another folder")
    files = sorted(answer_file(folder, task) for task in tasks)
    lines = "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {ANSWERS}/{file.name}\n" for file in files)
    if not (folder / HASHES).exists():
        write_text(folder / HASHES, lines)
    elif (folder / HASHES).read_text(encoding="utf-8") != lines:
        raise InputError(f"{folder}: the answers are not those of {HASHES}; start again in another folder")


def open_truth(
    settings: Settings, gearbox: Gearbox, folder: Path, progress: Callable[[int, int], None] | None = None
) -> dict[str, dict[str, Any]]:
    """Truth of every case, made from the seed after the answers were fixed."""
    plans = plans_of(settings)
    if not (folder / TRUTH).exists():
        with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=folder) as unfinished:
            room = Path(unfinished)
            conceal_set(gearbox, list(plans.values()), seed=settings.seed, recordings=room / RECORDINGS,
                        truth=room / TRUTH, progress=progress)  # fmt: skip
            (room / TRUTH).replace(folder / TRUTH)
    return {case: json.loads((folder / TRUTH / f"{case}.json").read_text(encoding="utf-8")) for case in plans}


def write_text(path: Path, text: str) -> None:
    """Write a file that appears whole or not at all."""
    with atomic_file(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")
