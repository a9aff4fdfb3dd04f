"""A proof from beginning to end: cases, diagnoses in processes of their own, hashes, truth, score, page."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, as_completed
from contextlib import closing, contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from builder.build import staging
from diagnosis.proof import protocol
from diagnosis.proof.protocol import BLIND, Settings, Task
from models.gearbox import load_gearbox, names_a_file
from models.parallel import _dask_cluster as on_dask

PAGE, NUMBERS = "proof.html", "proof.json"
REFUSED = 2  # exit status of a diagnosis that does not accept its recordings
INTERRUPTED = (130, -signal.SIGINT, -signal.SIGTERM)
LONGEST_S = 3600.0
SAID_OF_A_FAULT = 2000  # characters that are kept

Tell = Callable[[str, int, int], None]
_running: set[subprocess.Popen[str]] = set()
_stopped = threading.Event()  # a thread that starts a process after that ends it itself


@dataclass(frozen=True, kw_only=True)
class Work:
    """What travels to whoever does a task: everything it may see.

    Attributes
    ----------
    kind : {"diagnose", "baselines"}
    files : mapping of name to bytes
    arguments : tuple of str
    """

    kind: str
    files: Mapping[str, bytes]
    arguments: tuple[str, ...]


def prove(
    settings: Settings,
    output: Path,
    *,
    jobs: int = 1,
    dask_address: str | None = None,
    tell: Tell = lambda *_: None,
) -> dict[str, Any]:
    """Run a proof, or what is left of an interrupted one.

    Parameters
    ----------
    settings : Settings
    output : Path
        Gets recordings, verdicts, their hashes, the truth, ``proof.json`` and ``proof.html``
    jobs : int
        Processes on this machine
    dask_address : str, optional
        Scheduler of a Dask cluster to work on instead
    tell : callable
        Told what is done, how much of it and of how much

    Returns
    -------
    dict
        See :func:`diagnosis.proof.outcome.outcome`

    Raises
    ------
    InputError
        If the folder cannot be used, the code changes on the way, or a seal does not hold.
    """
    from diagnosis.proof.outcome import outcome
    from diagnosis.proof.proof_report import page

    gearbox = load_gearbox(settings.gearbox)
    code = protocol.begin(settings, gearbox, output, lambda done, of: tell("making recordings", done, of))
    tasks = protocol.tasks_of(settings, protocol.plans_of(settings))
    missing = protocol.open_tasks(output, tasks)
    done = len(tasks) - len(missing)
    if missing:
        tell("diagnosing", done, len(tasks))
        with (
            _executor(jobs, dask_address) as executor,
            closing(_done(executor, output, missing, settings.gearbox)) as results,
        ):
            for task, record in results:
                protocol.write_whole(protocol.verdict_file(output, task), json.dumps(record, indent=1) + "\n")
                done += 1
                tell("diagnosing", done, len(tasks))
    protocol.seal_verdicts(output, tasks, code)
    truths = protocol.open_truth(settings, gearbox, output, lambda done, of: tell("opening the truth", done, of))
    records = {t: json.loads(protocol.verdict_file(output, t).read_text(encoding="utf-8")) for t in tasks}
    found = outcome(settings, gearbox, truths, records, code=code, hashes=protocol.hash_of_hashes(output),
                    scored_as_begun=protocol.scored_as_begun(output))  # fmt: skip
    with staging(output) as stage:
        (stage / NUMBERS).write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        (stage / PAGE).write_text(page(found), encoding="utf-8", newline="\n")
    return found


def run_task(work: Work) -> dict[str, Any]:
    """Do a task in a process of its own, in a folder with nothing but what it may see.

    Returns
    -------
    dict
        ``status`` (``answered``, ``refused``, ``failed``), ``seconds``, ``said`` (what is in ``diagnosis.json``, or
        None), ``message``
    """
    with tempfile.TemporaryDirectory(prefix="case-") as folder:
        room, begin = Path(folder), time.perf_counter()
        for name, content in work.files.items():
            (room / name).write_bytes(content)
        process = subprocess.Popen(  # noqa: S603 - our own program
            _command(work), cwd=room, env=_environment(), text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
        _running.add(process)
        if _stopped.is_set():
            process.kill()
        try:
            _, message = process.communicate(timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            message = f"no answer within {LONGEST_S:.0f} s"
        finally:
            process.kill()
            process.wait()
            _running.discard(process)
        if process.returncode in INTERRUPTED or _stopped.is_set():
            raise KeyboardInterrupt
        answer = room / ("said.json" if work.kind == "baselines" else "out/diagnosis.json")
        answered = process.returncode == 0 and answer.exists()
        failed = "refused" if process.returncode == REFUSED and work.kind == "diagnose" else "failed"
        return {
            "status": "answered" if answered else failed,
            "seconds": round(time.perf_counter() - begin, 1),
            "said": json.loads(answer.read_text(encoding="utf-8")) if answered else None,
            "message": "" if answered else message[-SAID_OF_A_FAULT:],
        }


def _command(work: Work) -> list[str]:
    if work.kind == "baselines":
        return [sys.executable, "-m", "diagnosis.proof.baselines", *work.arguments, "--output", "said.json"]
    return [sys.executable, "-c", BLIND, "diagnose", *work.arguments, "--jobs", "1", "--output", "out"]


def _environment() -> dict[str, str]:
    """Of this process, with our packages found from anywhere, and one thread per process."""
    root = str(Path(str(resources.files("builder"))).parent)
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": path}


def work_of(recordings: Path, task: Task, gearbox: str) -> Work:
    """What a task needs, and no more.

    Parameters
    ----------
    recordings : Path
    task : Task
    gearbox : str
        Name or file of the definition; a file travels along
    """
    files, arguments = protocol.files_of(recordings, task)
    if names_a_file(gearbox):
        files["gearbox.toml"] = Path(gearbox).read_bytes()
        gearbox = "gearbox.toml"
    return Work(kind=task.kind, files=files, arguments=(*arguments, "--gearbox", gearbox))


def _done(
    executor: Executor, output: Path, tasks: Sequence[Task], gearbox: str
) -> Generator[tuple[Task, dict[str, Any]]]:
    """Tasks as they are done; where this ends early, nothing is left running."""
    futures: dict[Future[dict[str, Any]], Task] = {}
    try:
        for task in tasks:
            futures[executor.submit(run_task, work_of(output / protocol.RECORDINGS, task, gearbox))] = task
        for future in as_completed(futures):
            yield futures.pop(future), future.result()
    except BaseException:
        _stopped.set()  # cleared when the threads have ended
        for future in futures:
            future.cancel()
        for process in list(_running):
            process.kill()
        raise


@contextmanager
def _executor(jobs: int, dask_address: str | None) -> Iterator[Executor]:
    """Threads, each of which waits for its process; or a Dask cluster."""
    try:
        if dask_address is None:
            with ThreadPoolExecutor(jobs) as executor:
                yield executor
        else:
            with on_dask(dask_address):
                from distributed import get_client

                yield get_client().get_executor(pure=False)
    finally:
        _stopped.clear()
