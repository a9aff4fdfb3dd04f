"""From recordings to a diagnosis: the one function behind the verb ``diagnose``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from diagnosis.decision.answer import decide
from diagnosis.decision.draughts import most_probable, worth_weighing
from diagnosis.decision.infer import infer
from diagnosis.decision.scanned import scan_at
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import calibrate_in_draughts, calibrate_with_error, recalibrate
from diagnosis.engine.families import candidates_of
from diagnosis.engine.fit import calibrate
from diagnosis.engine.known_switches import start_with_switches
from diagnosis.engine.outside import outside_of
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.set_apart import calibrate_apart
from diagnosis.engine.to_predict import calibrated_to_predict
from diagnosis.forward.grid import Piece
from diagnosis.recordings.read import named_apart, read_recordings
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.shared_rows import check_shared_rows
from diagnosis.results.assemble import Others, assemble, faulty_channels
from diagnosis.results.result import Diagnosis
from diagnosis.setup.plausibility import check_plausible
from diagnosis.setup.sessions import check_baselines
from diagnosis.setup.shaft import shafts, with_shaft
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError
from models.base.parallel import one_thread
from models.base.progress import Progress, silent
from models.correction.corrected_gearbox import corrected_gearbox
from models.correction.correction import Correction
from models.mechanisms import CATALOGUE, Mechanism
from models.quantities.quantities import is_total_loss

Source = str | Path | Recording
SETTINGS = Settings()


@one_thread()
def diagnose(
    recordings: Source | Sequence[Source],
    gearbox: Gearbox | str | Path = "fzg",
    *,
    holdout: Source | Sequence[Source] = (),
    baseline: Source | Sequence[Source] = (),
    switched_off: str | Sequence[str] = (),
    correction: Correction | None = None,
    settings: Settings = SETTINGS,
    catalogue: Mapping[str, Mechanism] | None = None,
    progress: Progress = silent,
) -> Diagnosis:
    """Say whether recordings agree with the model of a gearbox, and if not, where, by what physics, and how strongly.

    Parameters
    ----------
    recordings : path, Recording, or several
        To learn from; see :func:`diagnosis.recordings.read.read_recordings` for files
    gearbox : Gearbox, name or path
    holdout : path, Recording, or several
        To judge by; without any, the last quarter of every stretch without a gap is held out
    baseline : path, Recording, or several
        The same machine in other sessions, without the effect that is looked for
    switched_off : str, or several
        Mechanisms that are known to be off in the baselines; by default all are
    correction : Correction, optional
        What is known of the machine and its definition lacks: a cooler, or what an earlier diagnosis found. Standard
        errors are the priors of its numbers; calibrated values are where those of the definition begin
    settings : Settings
        Numbers of the decision
    catalogue : mapping of str to Mechanism, optional
        By default :data:`models.mechanisms.CATALOGUE`
    progress : callable
        Told what is being done, as ``progress(what, done, of)``

    Returns
    -------
    Diagnosis
        Prints as a summary; :meth:`Diagnosis.to_dict` is ``diagnosis.json``

    Raises
    ------
    InputError
        If a recording cannot be used, with file, column and rows, or the correction was made for another gearbox.
    """
    catalogue = CATALOGUE if catalogue is None else catalogue
    gearbox = gearbox if isinstance(gearbox, Gearbox) else load_gearbox(gearbox)
    gearbox = corrected_gearbox(gearbox, Correction() if correction is None else correction.of_machine())
    train, held, healthy = named_apart(*(_read(given, gearbox) for given in (recordings, holdout, baseline)))
    off = (switched_off,) if isinstance(switched_off, str) else tuple(switched_off)
    if not train:
        raise InputError("no recording was given to learn from")
    check_shared_rows(train, held, healthy)
    _refuse_unusable([*train, *healthy])
    check_baselines(train, healthy, off, catalogue=catalogue)
    # Models without geometry have too wide priors for a check of temperatures.
    network = gearbox.network()
    check_plausible(
        shafts([*train, *held, *healthy], network), with_shaft(network), gearbox.loss_laws(),
        judge_temperatures=not gearbox.is_parametric,
    )  # fmt: skip
    progress("reading the recordings and setting up the inference")
    setup, experiment = prepare_experiment(gearbox, train, held, healthy, switched_off=off, catalogue=catalogue)
    _refuse_too_short(train, experiment.pieces)
    try:
        progress("calibrating the model")
        start = start_with_switches(setup, experiment)
        plain = calibrate(experiment, start)
        others, apart = calibrate_apart(experiment, plain, start)
        progress("calibrating with model error")
        calibration = calibrate_with_error(experiment, others, apart)
        candidates, outside = candidates_of(setup, experiment), outside_of(setup, experiment)
        weigh = partial(infer, settings=settings, progress=progress, candidates_in=partial(candidates_of, setup))
        progress(f"scanning {len(candidates)} candidates")
        both, rival = [(calibration, scan_at(calibration, candidates))], -np.inf
        if (in_draughts := calibrate_in_draughts(calibration)) is not None:
            progress("comparing still air and draughts")
            rival = in_draughts.chosen.log_evidence
            both = worth_weighing([*both, (in_draughts, scan_at(in_draughts, candidates))])
        weighed = [(one, weigh(one, found, outside=outside, rival=rival)) for one, found in both]
        calibration, posterior = most_probable(weighed)
        if posterior.elsewhere is not None:
            progress("calibrating again from a better start that was seen")
            again = recalibrate(calibration, posterior.elsewhere)
            if again is not calibration:
                calibration = again
                posterior = weigh(calibration, scan_at(calibration, candidates), outside=outside, rival=rival)
        faulty, rest = faulty_channels(posterior, apart), None
        if faulty and calibration.of_others is not None:
            progress(f"looking at the machine without {', '.join(apart)}")
            rest = weigh(calibration.of_others, scan_at(calibration.of_others, candidates))
        progress("predicting the recordings free-running")
        return assemble(
            setup, experiment, posterior, decide(posterior),
            plain=calibrated_to_predict(plain if rest is None else others, calibration.fit),
            calibration=calibration,
            others=None if rest is None else Others(posterior=rest, channels=faulty, apart=tuple(apart)),
        )  # fmt: skip
    except ArithmeticError as error:
        if type(error) is not ArithmeticError:
            raise  # a division by zero is a fault of ours
        raise InputError(f"{error}: check the recordings' units and the priors of {gearbox.file}") from error


def _read(sources: Source | Sequence[Source], gearbox: Gearbox) -> tuple[Recording, ...]:
    given = [sources] if isinstance(sources, str | Path | Recording) else list(sources)
    paths = [s for s in given if not isinstance(s, Recording)]
    read = iter(read_recordings(paths, gearbox.network()) if paths else ())
    return tuple(s if isinstance(s, Recording) else next(read) for s in given)


def _refuse_unusable(recordings: Sequence[Recording]) -> None:
    faults = [
        f"{r.path}: no temperature of the network is measured; columns T_<node>_degC are needed"
        for r in recordings if not any(not is_total_loss(c.name) and np.isfinite(c.values).any() for c in r.channels)
    ]  # fmt: skip
    if faults:
        raise InputError("\n".join(faults))


def _refuse_too_short(recordings: Sequence[Recording], pieces: Sequence[Piece]) -> None:
    if not {r.name for r in recordings} & {piece.recording for piece in pieces}:
        found = ", ".join(f"{r.path}: {len(r.time)} rows in {r.time[-1] - r.time[0]:.4g} s" for r in recordings)
        raise InputError(
            f"no piece of the recordings is long enough to simulate ({found}); a few minutes without gaps are needed. "
            "If the times are hours or minutes, give the unit of [time] in a mapping file"
        )
