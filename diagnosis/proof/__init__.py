"""Proof of the diagnosis: plants apart from the model make recordings in which an effect is concealed.

Three ways to a case, each with an order to read it in:

- A plant of the own kind (``plant``, ``cases``), finer than the model: ``plant.anatomy`` (nodes and paths),
  ``plant.laws``, ``plant.effects_*`` (what may be concealed, in the words of ``plant.draws``), ``plant.plant_run``
  (many runs at once), ``plant.instruments`` (what is recorded of them); ``cases.conceal`` draws cases and calls all of
  these.
- A plant of the zoo (``zoo``), of another structure: ``zoo.structure`` (what a plant is), ``zoo.families`` (who draws
  one), ``zoo.laws`` and ``zoo.run`` (its heat balance in time), ``zoo.setting`` and ``zoo.effects_*`` (what may be
  concealed), ``zoo.oracle`` (evidence that recordings hold), ``zoo.recorder``; ``zoo.draw`` draws a case with these,
  ``zoo.conceal_zoo`` a set.
- A recording of a real machine (``injection``): ``injection.calibrated_model`` shows what a change would do,
  ``machine_changes`` and ``instrument_faults`` are the changes, ``injection.kinds`` their table, ``injection.inject``
  draws them.

All plants share programmes (``plant.cycles``), sizes (``plant.sizes``), the time step (``plant.integrator``), what
instruments have in common, and the files and facts of a case (``cases.case_files``, ``cases.truth``).

``scoring`` reads answers (``answers``) and truths (``truth``) of any of them, applies one table of rules (``rules``)
and counts (``outcome``); ``lines`` is the file of a proof.
"""
