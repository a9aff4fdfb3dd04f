"""From recordings of a real gearbox to the physics that its model left out.

The way of a diagnosis, which is also an order to read the code in (:func:`diagnosis.diagnose_recordings.diagnose` walks
it from top to bottom):

1. ``recordings``: files become a :class:`~diagnosis.recordings.recording.Recording`: channels, inputs, gaps, units.
2. ``forward.grid``: gap-free pieces on a working grid; ``setup``: noise, start temperatures, plausible recordings.
3. ``forward``: a piece is simulated (``trajectory``), read by its sensors (``observation``), freed of the noise's
   memory (``whitening``).
4. ``engine.unknown``, ``point``, ``slopes``: what is unknown, and what each of it does to the readings (its column).
5. ``engine.fit``, ``metric``, ``model_error``, ``calibration``: unknowns are fitted; what formulas and lumped nodes
   cannot know is integrated over, in classes between which the recordings choose.
6. ``candidates``, ``engine.families``: everything that may be missing, wrong or changed, with its prior.
7. ``engine.scan``, ``gram``: all candidates at once by a straight line; ``refit``: the best of them fitted.
8. ``decision.draughts``: in still air, in draughts, or both; ``infer``: scan, race, refit, second scan; ``posterior``:
   probabilities; ``answer``: claim, likely, a tie.
9. ``results.assemble``: predictions, places, findings, advice as a :class:`~diagnosis.results.result.Diagnosis`;
   ``report``: the page and the files.

Words that the code has in one sense only:

- A *piece* is a gap-free part of a recording on the grid (K intervals, K + 1 grid points). Simulated with some values
  of the unknowns it is a *point*, and its temperatures are a *trajectory*.
- An *unknown* is a number ``z`` with the prior N(0, 1). Its *column* is the derivative of the readings by ``z``;
  *whitened* columns and residuals have passed the noise filter.
- The *metric* is the inner product of whitened readings with *model error* and deviations between *sessions*
  marginalised. Model error has groups of unknowns; a *class* states the amplitude of each group.
- *Healthy* recordings are the baselines; all others that are learnt from are *tested*.
- A :class:`~diagnosis.candidates.hypotheses.Hypothesis` is a *candidate* until it is in an explanation, then an
  *effect*. Its *law* is its name at any place and course in time; its *variants* are the shapes that are tried.
- *Judged* is one explanation at its places, with its evidence; an *explanation* is all those of the same laws. An
  *answer* is an effect that is reported; a *finding* is an answer with its numbers.

``proof`` is apart: plants that hide a known effect, and the scores of any diagnosis of them. Nothing above imports it.
"""
