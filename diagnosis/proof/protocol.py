"""The protocol of an honest proof: who sees what, and when.

1. Cases are drawn and simulated. Their recordings are kept and the SHA-256 of every salted truth; the truth itself is
   thrown away, so that while anything is diagnosed it is nowhere to be read.
2. Every diagnosis is a process of its own that gets the recordings and the nominal definition, and cannot import the
   plant (:data:`BLIND`).
3. When all verdicts are there, they are hashed, and the list of hashes is written.
4. Only then the truth is made again from the seed. It counts if the same recordings come out and the seal holds.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from diagnosis.proof.case_files import MAPPING, SEAL, seal_holds
from diagnosis.proof.conceal import PHYSICS, Plan, conceal_set, mixed_plans
from models.atomic_write import atomic_file
from models.errors import InputError
from models.gearbox import Gearbox
from models.version import project_version

# The whole proof: every mechanism of the catalogue twice as a single.
MIX = {"control": 60, "single": 2 * len(PHYSICS), "double": 30, "messy": 30, "outside": 30, "sensor": 15}
WHOLE = sum(MIX.values())
# Opened while the diagnosis was developed: thresholds were set on the first, open forms, the search for thermostats and
# some rules made while looking at others.
DEVELOPMENT_SEEDS = (1, *range(2026, 2038), 2039, 2041)
UNOPENED_SEED = 2042  # of a proof whose truth nobody has seen; once opened it belongs above
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
RECORDINGS, VERDICTS, TRUTH = "recordings", "verdicts", "truth"
SETTINGS, HASHES = "settings.json", "verdicts.sha256"
JUDGED = ("models", "diagnosis")  # packages whose code the verdicts depend on
NOT_JUDGED = ("diagnosis/proof/", "diagnosis/report/")
SCORING = ("score.py", "outcome.py")  # modules of this package that say what counts as right


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What a proof is made of.

    Attributes
    ----------
    seed : int
    cases : int
        In all, in the proportions of :data:`MIX`
    gearbox : str
        Name or file of the definition
    cells_every : int
        Of each group every n-th case is also diagnosed with fewer sensors and shorter recordings; 0: none
    baselines : bool
        Whether other methods are tried on the same recordings
    """

    seed: int
    cases: int = WHOLE
    gearbox: str = "fzg"
    cells_every: int = 3
    baselines: bool = True


@dataclass(frozen=True, kw_only=True)
class Task:
    """One thing to be found out from the recordings of one case.

    Attributes
    ----------
    case : str
    kind : {"diagnose", "baselines"}
    sensors, data : str
        Keys of :data:`SENSORS` and :data:`DATA`
    removed : str or None
        Mechanism that is taken out of the catalogue
    """

    case: str
    kind: Literal["diagnose", "baselines"] = "diagnose"
    sensors: Sensors = "rich"
    data: Data = "full"
    removed: str | None = None

    @property
    def name(self) -> str:
        """Of its verdict's file."""
        what = "removed" if self.removed else f"{self.sensors}-{self.data.replace(' ', '')}"
        return f"{self.case}_{what if self.kind == 'diagnose' else self.kind}"


# ---------------------------------------------------------------------- what is to be done


def mix_of(cases: int) -> dict[str, int]:
    """How many cases of each group, in the proportions of :data:`MIX`, at least one of each.

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
    """Everything that is to be found out, the main cell first.

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
    if settings.baselines:
        tasks += [Task(case=case, kind="baselines") for case in plans]
    return tasks + others


def files_of(recordings: Path, task: Task) -> tuple[dict[str, bytes], list[str]]:
    """What a process gets to see, and the arguments that name it.

    Parameters
    ----------
    recordings : Path
        Folder with one folder per case
    task : Task

    Returns
    -------
    files : dict of name to bytes
        Recordings with the channels of the task, and what the data sheet says of them; nothing else
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
    """Columns that a set of sensors has; inputs are always recorded.

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


# ---------------------------------------------------------------------- before


def code_hash() -> str:
    """SHA-256 over the code and the tables that a diagnosis is made of; thresholds are in it."""
    digest = hashlib.sha256()
    for package in JUDGED:
        root = Path(str(resources.files(package)))
        for path in sorted(root.rglob("*")):
            name = f"{package}/{path.relative_to(root).as_posix()}"
            if path.suffix in (".py", ".toml") and not name.startswith(NOT_JUDGED):
                digest.update(f"{name}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


def scoring_hash() -> str:
    """SHA-256 over the rules by which verdicts are judged."""
    here = Path(str(resources.files("diagnosis.proof")))
    return hashlib.sha256(b"\0".join((here / name).read_bytes() for name in SCORING)).hexdigest()


def scored_as_begun(folder: Path) -> bool:
    """Whether the rules of judging are those that stood when the cases were made."""
    return bool(json.loads((folder / SETTINGS).read_text(encoding="utf-8")).get("scoring_sha256") == scoring_hash())


def begin(
    settings: Settings, gearbox: Gearbox, folder: Path, progress: Callable[[int, int], None] | None = None
) -> str:
    """Make the recordings and seal the truth; nothing is done where that has been done.

    Returns
    -------
    str
        Hash of the code that is to be tried, see :func:`code_hash`

    Raises
    ------
    InputError
        If the settings cannot be met, or the folder holds another proof, or one of other code.
    """
    code, plans = code_hash(), list(plans_of(settings).values())
    # Of the seed only a hash is written, so that the folder does not tell what the truth can be made from.
    whole = json.dumps({**asdict(settings), "gearbox": gearbox.hash}, sort_keys=True)
    about = {"settings_sha256": hashlib.sha256(whole.encode()).hexdigest(), "code_sha256": code,
             "scoring_sha256": scoring_hash(), "version": project_version()}  # fmt: skip
    file = folder / SETTINGS
    if file.exists():
        try:
            before = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{file}: cannot be read ({error}); choose another output folder") from error
        for key, what in (("settings_sha256", "other options"), ("code_sha256", "another version of the diagnosis")):
            if before.get(key) != about[key]:
                raise InputError(f"{folder}: holds a proof with {what}; choose another output folder")
    else:
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: is not empty and holds no proof; choose another output folder")
        write_whole(file, json.dumps(about, indent=1) + "\n")
    if not (folder / RECORDINGS).exists():
        unfinished = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
        try:
            conceal_set(gearbox, plans, seed=settings.seed,
                        recordings=unfinished / RECORDINGS, truth=None, progress=progress)  # fmt: skip
            (unfinished / RECORDINGS).replace(folder / RECORDINGS)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    return code


def open_tasks(folder: Path, tasks: Sequence[Task]) -> list[Task]:
    """Tasks without a verdict.

    Raises
    ------
    InputError
        If the truth is open already: then no verdict may be added.
    """
    missing = [task for task in tasks if not verdict_file(folder, task).exists()]
    if missing and ((folder / HASHES).exists() or (folder / TRUTH).exists()):
        raise InputError(f"{folder}: the truth is open, but {verdict_file(folder, missing[0]).name} is missing; start "
                         "anew in another folder")  # fmt: skip
    return missing


def verdict_file(folder: Path, task: Task) -> Path:
    """Where the verdict of a task is kept."""
    return folder / VERDICTS / f"{task.name}.json"


def write_whole(path: Path, text: str) -> None:
    """Let a file appear whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with atomic_file(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")


# ---------------------------------------------------------------------- after


def seal_verdicts(folder: Path, tasks: Sequence[Task], code: str) -> None:
    """Write the hash of every verdict; where that has been done, compare.

    Raises
    ------
    InputError
        If a verdict was changed since, or the code while the verdicts were made.
    """
    if code_hash() != code:
        raise InputError("the code of the diagnosis was changed while the proof ran, and it is not known which verdict "
                         "is of which; start anew in another folder")  # fmt: skip
    files = sorted(verdict_file(folder, task) for task in tasks)
    lines = "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {VERDICTS}/{file.name}\n" for file in files)
    hashes = folder / HASHES
    if not hashes.exists():
        write_whole(hashes, lines)
    elif hashes.read_text(encoding="utf-8") != lines:
        raise InputError(f"{folder}: the verdicts are not those that {HASHES} tells of; start anew in another folder")


def hash_of_hashes(folder: Path) -> str:
    """SHA-256 of the list of verdict hashes: one number that stands for all verdicts."""
    return hashlib.sha256((folder / HASHES).read_bytes()).hexdigest()


def open_truth(
    settings: Settings, gearbox: Gearbox, folder: Path, progress: Callable[[int, int], None] | None = None
) -> dict[str, dict[str, Any]]:
    """The truth of every case, made again from the seed and held against the seals.

    Raises
    ------
    InputError
        If verdicts are not hashed yet, other recordings come out, or a seal does not hold.
    """
    if not (folder / HASHES).exists():
        raise InputError(f"{folder}: the verdicts must be hashed before the truth is opened")
    plans = plans_of(settings)
    if not (folder / TRUTH).exists():
        again = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
        try:
            conceal_set(gearbox, list(plans.values()), seed=settings.seed, recordings=again / RECORDINGS,
                        truth=again / TRUTH, progress=progress)  # fmt: skip
            for file in sorted((again / RECORDINGS).rglob("*")):
                kept = folder / RECORDINGS / file.relative_to(again / RECORDINGS)
                if file.is_file() and file.name != SEAL and file.read_bytes() != kept.read_bytes():
                    raise InputError(f"{kept}: the seed does not make these recordings again; they were changed, or "
                                     "the plant was")  # fmt: skip
            _check_seals(folder / RECORDINGS, again / TRUTH, plans)
            (again / TRUTH).replace(folder / TRUTH)
        finally:
            shutil.rmtree(again, ignore_errors=True)
    _check_seals(folder / RECORDINGS, folder / TRUTH, plans)
    return {case: json.loads((folder / TRUTH / f"{case}.json").read_text(encoding="utf-8")) for case in plans}


def _check_seals(recordings: Path, truth: Path, cases: Mapping[str, Plan]) -> None:
    for case in cases:
        if not seal_holds(recordings / case, truth / f"{case}.json"):
            raise InputError(f"{truth / case}.json: is not the truth that was sealed in {recordings / case / SEAL}")
