"""A proof from beginning to end: cases, diagnoses in separate processes, hashes, truth, scores."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from builder.workflows.proof_cases import add_evidence, keep_to_one_set, make_cases
from diagnosis.proof.cases.case_files import DEFINITION
from diagnosis.proof.scoring import lines
from diagnosis.proof.scoring.lines import Task
from models.assembly.gearbox import load_gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.base.parallel import iterate_parallel
from models.base.progress import Progress, silent
from models.files.toml_file import names_a_file

# Start of a diagnosis: an import of the plant, or of anything else of the proof, is an ImportError there.
BLIND = "import sys; sys.modules['diagnosis.proof'] = None; from builder.__main__ import main; main()"
HASHES = "answers.sha256"
CASES = "cases.json"  # of which seed the recordings in an output folder are
REFUSED = 2  # exit status of a diagnosis that does not accept its recordings
INTERRUPTED = (130, -signal.SIGINT, -signal.SIGTERM)  # no answer: it is diagnosed when the proof is continued
LONGEST_S = 4 * 3600.0  # wall time, of machines that have other work as well
MESSAGE_LENGTH = 2000  # characters that are kept


def prove(
    file: Path, output: Path, *, recordings: Path | None = None, truth: Path | None = None, jobs: int = 1,
    progress: Progress = silent,
) -> dict[str, Any]:  # fmt: skip
    """Run the proof of a file of answers, or what is missing of it.

    The truth lies in its folder while the tool runs, in processes that get the recordings of one case only. It is read
    after the list of hashes of all answers is written.

    Parameters
    ----------
    file : Path
        Begun by :func:`diagnosis.proof.scoring.lines.begin_lines`
    output : Path
        Gets recordings and truth of cases that are made from a seed, and the list of hashes
    recordings, truth : Path, optional
        Folder with a folder per case and truth (folder of ``<case>.json``, or one file), of recordings that are given
    jobs : int
        Processes
    progress : callable
        Called with the step, the amount of work done and the amount in all

    Returns
    -------
    dict
        See :func:`diagnosis.proof.scoring.outcome.outcome`

    Raises
    ------
    InputError
        If the file was begun with other code or other recordings, or something cannot be read.
    """
    from diagnosis.proof.scoring.outcome import outcome
    from diagnosis.proof.scoring.truth import read_truths

    settings, code, records = lines.read_lines(file)
    lines.refuse_other_code(file, code)
    if settings.plant == "given":
        if recordings is None or truth is None:
            raise InputError(f"{file}: is about given recordings; name them with --recordings and --truth")
    else:
        recordings, truth = output / "recordings", output / "truth"
        keep_to_one_set(settings, output / CASES)
    alone = make_cases(settings, recordings, truth, jobs, progress)
    cases = sorted(path.name for path in recordings.iterdir() if path.is_dir())
    tasks = lines.tasks_of(settings, cases, alone)
    if not tasks:
        raise InputError(f"{recordings}: holds no folder per case; conceal --cases N writes such folders")
    for task, record in records.items():
        if task not in tasks or record["recordings"] != hash_of(
            with_definition(lines.files_of(recordings, task, settings.baselines)[0], settings.gearbox)
        ):
            raise InputError(
                f"{file}: {task.case} was answered from other recordings than those in {recordings}, or with another "
                "definition"
            )
    missing = [task for task in tasks if task not in records]
    work = ((task, *lines.files_of(recordings, task, settings.baselines), settings.gearbox) for task in missing)
    progress("diagnosing", len(records), len(tasks))
    for task, record in iterate_parallel(diagnose, work, jobs=jobs):
        lines.refuse_other_code(file, code)
        lines.append_line(file, task, record)
        records[task] = record
        progress("diagnosing", len(records), len(tasks))
    with atomic_file(output / HASHES) as partial:
        partial.write_text(lines.hash_list(records), encoding="utf-8")
    if settings.plant == "own":
        add_evidence(settings, truth, jobs, progress)
    return outcome(read_truths(truth), records, load_gearbox(settings.gearbox or "fzg"), settings=settings, code=code)


def diagnose(
    task: Task, files: Mapping[str, bytes], arguments: Sequence[str], gearbox: str
) -> tuple[Task, dict[str, Any]]:
    """Diagnose in a separate process, in a temporary folder that holds only the files of the task.

    Parameters
    ----------
    task : Task
    files : mapping of name to bytes
    arguments : sequence of str
        Of the verb ``diagnose``
    gearbox : str
        Name or file of the definition, unless one is among the files

    Returns
    -------
    Task
    dict
        ``status`` (``answered``, ``refused``, ``failed``), ``seconds``, ``processor_s``, ``sha256`` of
        ``diagnosis.json``, ``recordings`` (SHA-256 of the files, a definition file among them), ``answer`` (see
        :func:`diagnosis.proof.scoring.lines.compact`, or None), ``message``
    """
    content = with_definition(files, gearbox)
    definition = DEFINITION if DEFINITION in content else gearbox
    command = [sys.executable, "-c", BLIND, "diagnose", *arguments, "--gearbox", definition,
               "--output", "out"]  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        room, begin, used = Path(folder), time.perf_counter(), os.times()
        for name, data in content.items():
            (room / name).write_bytes(data)
        try:
            process = subprocess.run(  # noqa: S603 - our own program
                command, cwd=room, env=environment(), text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                check=False, timeout=LONGEST_S,
            )  # fmt: skip
            status, message = process.returncode, process.stderr
        except subprocess.TimeoutExpired:
            status, message = None, f"no answer within {LONGEST_S:.0f} s"
        if status in INTERRUPTED:
            raise KeyboardInterrupt
        written = (room / "out" / "diagnosis.json").read_bytes() if status == 0 else b""
    return task, {
        "status": "answered" if status == 0 else "refused" if status == REFUSED else "failed",
        "seconds": round(time.perf_counter() - begin, 1),
        "processor_s": round(sum(os.times()[2:4]) - sum(used[2:4]), 1),
        "sha256": hashlib.sha256(written).hexdigest() if status == 0 else "",
        "recordings": hash_of(content),
        "answer": lines.compact(json.loads(written)) if status == 0 else None,
        "message": "" if status == 0 else message[-MESSAGE_LENGTH:],
    }


def with_definition(files: Mapping[str, bytes], gearbox: str) -> dict[str, bytes]:
    """The files of a task, and the definition if it is a file of the user."""
    given = {DEFINITION: Path(gearbox).read_bytes()} if names_a_file(gearbox) else {}
    return given | dict(files)


def hash_of(files: Mapping[str, bytes]) -> str:
    """SHA-256 over names and contents."""
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(name.encode() + b"\0" + hashlib.sha256(content).digest())
    return digest.hexdigest()


def environment() -> dict[str, str]:
    """Environment of a diagnosis: that of this process, our packages on PYTHONPATH, one thread per process."""
    root = str(Path(str(resources.files("builder"))).parent)
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": path}
