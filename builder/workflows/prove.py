"""A proof from beginning to end: cases, diagnoses in separate processes, hashes, truth, score, page."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from diagnosis.proof.scoring import protocol
from diagnosis.proof.scoring.protocol import BLIND, Settings, Task
from models.assembly.gearbox import load_gearbox, names_a_file
from models.base.atomic_write import atomic_folder
from models.base.parallel import iterate_parallel

PAGE, NUMBERS = "proof.html", "proof.json"
REFUSED = 2  # exit status of a diagnosis that does not accept its recordings
INTERRUPTED = (130, -signal.SIGINT, -signal.SIGTERM)  # no answer: it is diagnosed when the proof is continued
LONGEST_S = 3600.0
MESSAGE_LENGTH = 2000  # characters that are kept

Progress = Callable[[str, int, int], None]


def prove(
    settings: Settings,
    output: Path,
    *,
    jobs: int = 1,
    dask: str | None = None,
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """Run a proof, or the rest of one that was interrupted.

    Parameters
    ----------
    settings : Settings
    output : Path
        Gets recordings, answers, their hashes, the truth, ``proof.json`` and ``proof.html``
    jobs : int
        Processes on this machine
    dask : str, optional
        Address of a Dask scheduler that does the work instead
    progress : callable
        Called with the step, the amount of work done and the amount in all

    Returns
    -------
    dict
        See :func:`diagnosis.proof.scoring.outcome.outcome`

    Raises
    ------
    InputError
        If the folder cannot be used, or answers or code are changed on the way.
    """
    from diagnosis.proof.scoring.outcome import outcome
    from diagnosis.proof.scoring.proof_report import page

    gearbox = load_gearbox(settings.gearbox)
    protocol.begin(settings, gearbox, output, lambda done, of: progress("making recordings", done, of))
    tasks = protocol.tasks_of(settings, protocol.plans_of(settings))
    missing = protocol.open_tasks(output, tasks)
    done = len(tasks) - len(missing)
    progress("diagnosing", done, len(tasks))
    work = ((task, *work_of(output / protocol.RECORDINGS, task, settings.gearbox)) for task in missing)
    for task, record in iterate_parallel(run_task, work, jobs=jobs, dask=dask):
        protocol.write_text(protocol.answer_file(output, task), json.dumps(record, indent=1) + "\n")
        done += 1
        progress("diagnosing", done, len(tasks))
    protocol.fix_answers(output, tasks)
    truths = protocol.open_truth(settings, gearbox, output, lambda done, of: progress("opening the truth", done, of))
    records = {t: json.loads(protocol.answer_file(output, t).read_text(encoding="utf-8")) for t in tasks}
    hashes = hashlib.sha256((output / protocol.HASHES).read_bytes()).hexdigest()
    result = outcome(settings, gearbox, truths, records, code=protocol.code_hash(), hashes=hashes)
    with atomic_folder(output) as stage:
        (stage / NUMBERS).write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        (stage / PAGE).write_text(page(result), encoding="utf-8", newline="\n")
    return result


def work_of(recordings: Path, task: Task, gearbox: str) -> tuple[dict[str, bytes], list[str]]:
    """Files of a task and arguments of its diagnosis; a definition file is one of the files.

    Parameters
    ----------
    recordings : Path
    task : Task
    gearbox : str
        Name or file of the definition
    """
    files, arguments = protocol.files_of(recordings, task)
    if names_a_file(gearbox):
        files["gearbox.toml"] = Path(gearbox).read_bytes()
        gearbox = "gearbox.toml"
    return files, [*arguments, "--gearbox", gearbox]


def run_task(task: Task, files: Mapping[str, bytes], arguments: Sequence[str]) -> tuple[Task, dict[str, Any]]:
    """Diagnose in a separate process, in a temporary folder that holds only the files of the task.

    Returns
    -------
    Task
    dict
        ``status`` (``answered``, ``refused``, ``failed``), ``seconds``, ``answer`` (content of ``diagnosis.json``, or
        None), ``message``
    """
    command = [sys.executable, "-c", BLIND, "diagnose", *arguments, "--jobs", "1", "--output", "out"]
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        room, begin = Path(folder), time.perf_counter()
        for name, content in files.items():
            (room / name).write_bytes(content)
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
        file = room / "out" / "diagnosis.json"
        answer = json.loads(file.read_text(encoding="utf-8")) if status == 0 else None
    return task, {
        "status": "answered" if status == 0 else "refused" if status == REFUSED else "failed",
        "seconds": round(time.perf_counter() - begin, 1),
        "answer": answer,
        "message": "" if status == 0 else message[-MESSAGE_LENGTH:],
    }


def environment() -> dict[str, str]:
    """Environment of a diagnosis: that of this process, our packages on PYTHONPATH, one thread per process."""
    root = str(Path(str(resources.files("builder"))).parent)
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": path}
