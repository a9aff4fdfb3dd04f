"""From a gearbox definition to an FMU, and the command line.

``commands.cli`` lists the verbs; each module of ``commands`` reads the options of one or two and calls one function:

- ``build-fmu``: ``workflows.build`` trains (``surrogate``), describes (``fmi``), generates and compiles C (``native``),
  and packages the Python FMU (``python``). An order to read it in: ``workflows.build``, ``surrogate.train``,
  ``fmi.signals`` (the table of variables, from which all else follows), ``fmi.package``, ``native.native_fmu``,
  ``python.python_fmu``. What runs inside an FMU is in ``fmu_src``.
- ``simulate``: the full model, or an FMU by FMPy (``drive``).
- ``diagnose``: :mod:`diagnosis`; many machines at once by ``workflows.fleet``.
- ``conceal``, ``prove``, ``score``: :mod:`diagnosis.proof`, with each case in a process that cannot see the truth
  (``workflows.prove``).
- ``reproduce``: tables and figures of the paper (``reproduce``).
"""
