"""Injections into a recording of a real machine: drawn from a seed, written with the truth apart from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from diagnosis.proof.cases.case_files import CaseFiles, case_names
from diagnosis.proof.cases.truth import size_of, size_of_heat
from diagnosis.proof.injection.calibrated_model import CalibratedMachine, calibrate
from diagnosis.proof.injection.instrument_faults import LONGEST_STUCK_S
from diagnosis.proof.injection.kinds import KINDS
from diagnosis.proof.injection.real_recording import RealRecording, read_real_recording
from diagnosis.proof.injection.trial import Trial, choose_size, draw_course
from diagnosis.recordings.time_axis import moment_text
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError, did_you_mean
from models.base.types import Array

SCHEMA = 1
# Largest change of a measured temperature, [K]: of fast recordings, and of those whose rows are means over minutes.
BOUNDS_K, SLOW_BOUNDS_K, SLOW_S = (0.3, 6.0), (1.0, 15.0), 60.0
TRIES = 6  # draws of kind, place and date, until one reaches the lower bound
SHARES = {"machine": 0.55, "instrument": 0.3, "input": 0.15}


@dataclass(frozen=True, kw_only=True)
class Wish:
    """Requests for an injection; the rest is drawn.

    Attributes
    ----------
    kind : str or None
        One of :data:`~diagnosis.proof.injection.kinds.KINDS`
    date : str or None
        When it begins: a date, or seconds as in the name of a part
    control : bool
        True to inject nothing
    """

    kind: str | None = None
    place: str | None = None
    date: str | None = None
    control: bool = False


class Injector:
    """A recording and its machine; the model is calibrated once, when it is needed.

    Parameters
    ----------
    recording : str
        ``FILE`` or ``FILE@start..end``

    Raises
    ------
    InputError
        With all problems of the recording.
    """

    def __init__(self, gearbox: Gearbox, recording: str) -> None:
        self.gearbox = gearbox
        self.real: RealRecording = read_real_recording(recording, gearbox)
        self.bounds_K = BOUNDS_K if self.real.step_s <= SLOW_S else SLOW_BOUNDS_K

    @property
    def written(self) -> frozenset[str]:
        """Names of the files of a case."""
        mapping = self.real.mapping
        return frozenset({f"{self.real.stem}.csv.gz", *([] if mapping is None else [mapping.name])})

    @cached_property
    def model(self) -> CalibratedMachine:
        """The calibrated model.

        Raises
        ------
        InputError
            If it cannot be calibrated to the recording.
        """
        return calibrate(self.gearbox, self.real)

    def places(self, kind: str) -> list[str]:
        """Return where a kind of change can be."""
        return KINDS[kind].places(self.real, self.gearbox.network())

    def check(self, wish: Wish) -> None:
        """Refuse a wish that this machine and recording cannot fulfil.

        Raises
        ------
        InputError
        """
        if wish.date is not None:
            self.real.moment(wish.date)
        if wish.kind is None:
            if wish.place is not None:
                raise InputError("--place goes with --effect; without, the place is drawn")
            return
        if wish.kind not in KINDS:
            raise InputError(f"--effect {wish.kind}: is nothing to inject{did_you_mean(wish.kind, KINDS)}")
        known = self.places(wish.kind)
        if not known:
            raise InputError(f"{self.real.path}: has no column that {wish.kind} could act on; choose another --effect")
        if wish.place is not None and wish.place not in known:
            kind = KINDS[wish.kind]
            where = self.gearbox.file if kind.group == "machine" else str(self.real.path)
            raise InputError(
                f"{where}: has no {kind.noun} {wish.place!r} for {wish.kind}{did_you_mean(wish.place, known)}"
            )

    def draw(self, wish: Wish, rng: np.random.Generator) -> tuple[Trial, int]:
        """Draw an injection, and which of its sizes; again while the largest possible one is below the bound.

        Raises
        ------
        InputError
            If the model cannot be calibrated or simulated.
        """
        best: tuple[float, Trial, int] | None = None
        for _ in range(TRIES):
            trial = self._trial(wish, rng)
            chosen = choose_size(trial.largest_K, self.bounds_K, rng)
            reached = float(trial.largest_K[chosen])
            if best is None or reached > best[0]:
                best = reached, trial, chosen
            if reached >= self.bounds_K[0]:
                break
        assert best is not None  # noqa: S101 - there is one try at least
        return best[1], best[2]

    def _trial(self, wish: Wish, rng: np.random.Generator) -> Trial:
        name = wish.kind or self._kind(rng)
        kind, known = KINDS[name], self.places(name)
        place = wish.place or known[int(rng.integers(len(known)))]
        course = draw_course(
            float(self.real.time[-1]), rng, forms=kind.forms,
            date_s=None if wish.date is None else self.real.moment(wish.date),
            longest_s=LONGEST_STUCK_S if name == "stuck" else np.inf,
        )  # fmt: skip
        made = kind.make(self.real if kind.group == "instrument" else self.model, place, course, rng)
        return replace(made, kind=name)

    def _kind(self, rng: np.random.Generator) -> str:
        """Draw a kind that this machine and recording can have."""
        possible: dict[str, list[str]] = {group: [] for group in SHARES}
        for name, kind in KINDS.items():
            if self.places(name):
                possible[kind.group].append(name)
        weights = np.array([SHARES[name] if kinds else 0.0 for name, kinds in possible.items()])
        group = list(possible)[int(rng.choice(len(weights), p=weights / weights.sum()))]
        return possible[group][int(rng.integers(len(possible[group])))]


def inject_set(
    injector: Injector, wish: Wish, number: int, *, seed: int, progress: Callable[[int, int], None] | None = None
) -> Iterator[CaseFiles]:
    """Make recordings with an injection each.

    Parameters
    ----------
    wish : Wish
        Of every case
    number : int
        Cases
    progress : callable or None
        Called with (cases done, cases in all)

    Raises
    ------
    InputError
        If the wish cannot be fulfilled.
    """
    injector.check(wish)
    real = injector.real
    for k, name in enumerate(case_names(number)):
        found = None if wish.control else injector.draw(wish, np.random.default_rng([seed, k]))
        columns = {} if found is None else {q: values[found[1]] for q, values in found[0].columns.items()}
        files = {f"{real.stem}.csv.gz": real.with_shifts(columns).compressed}
        if real.mapping is not None:
            files[real.mapping.name] = real.mapping.read_bytes()
        facts = truth_of(injector, found) | {"case": name, "seed": [seed, k]}
        yield CaseFiles(name=name, files=files, truth=facts)
        if progress is not None:
            progress(k + 1, number)


def truth_of(injector: Injector, found: tuple[Trial, int] | None) -> dict[str, Any]:
    """Return the truth of a case, ready for JSON; without an injection that of a control."""
    real = injector.real
    facts = {
        "schema": SCHEMA,
        "gearbox": injector.gearbox.hash,
        "source": {"file": real.path.name, "part": real.part, "sha256": real.recording.sha256},
        "bounds_K": list(injector.bounds_K),
        "K_all": {name: {"rms": 0.0, "max": 0.0} for name in real.channels},
    }
    if found is None:
        of_control = {"changed": [], "effects": [], "approximate": False, "approximate_because": ""}
        return facts | {"group": "control", "control": "real"} | of_control
    trial, chosen = found
    return facts | {
        "group": "injection",
        "control": None,
        "changed": [_changed(real, trial, float(trial.sizes[chosen]))],
        "effects": [_effect(injector, trial, chosen)],
        "approximate": bool(trial.approximate),
        "approximate_because": trial.approximate,
        **({} if trial.what == "input" else {"K_all": _sizes(trial.K, chosen)}),
    }


def _changed(real: RealRecording, trial: Trial, size: float) -> dict[str, Any]:
    course, clock, first = trial.course, real.found.clock, float(real.found.seconds[0])
    unsigned = trial.kind in ("stuck", "swapped")
    return {
        "what": trial.what,
        "of": trial.of,
        "nodes": list(trial.nodes),
        "sign": 0 if unsigned else int(np.sign(size)),
        "course": course.kind,
        "from_s": round(course.begins, 1),
        "to_s": round(course.ends, 1),
        "from": moment_text(first + course.begins, clock),
        "to": moment_text(first + course.ends, clock),
        "recording": real.stem,
    }


def _effect(injector: Injector, trial: Trial, chosen: int) -> dict[str, Any]:
    largest = float(trial.largest_K[chosen])
    is_input = trial.what == "input"
    units = {quantity: float(np.nanmax(np.abs(values[chosen]))) for quantity, values in trial.columns.items()}
    return {
        "name": trial.kind,
        "law": KINDS[trial.kind].law,
        "of": trial.of,
        "nodes": list(trial.nodes),
        "size": float(f"{trial.sizes[chosen]:.6g}"),
        "unit": trial.unit,
        "below_bounds": largest < injector.bounds_K[0],
        # A fault of an input changes no reading: its size is chosen by the change of the calibrated model's.
        "K": {name: {"rms": 0.0, "max": 0.0} for name in trial.K} if is_input else _sizes(trial.K, chosen),
        "K_of_model": _sizes(trial.K, chosen) if is_input else None,
        "column_shift": {injector.real.found.names[q]: round(value, 4) for q, value in units.items()},
        "heat_W": {node: size_of_heat(values[chosen]) for node, values in trial.heat.items()},
        **trial.facts,
    }


def _sizes(K: Mapping[str, Array], chosen: int) -> dict[str, dict[str, float]]:
    return {name: size_of(values[chosen]) for name, values in K.items()}
