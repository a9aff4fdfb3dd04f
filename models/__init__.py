"""Physics: what a gearbox is, what it loses, how its heat flows.

The way from a definition file to temperatures, which is also an order to read the code in:

1. ``files.toml_file``, ``definition``: the tables of a file become sections, every value checked once.
2. ``assembly.gearbox``: a :class:`~models.assembly.gearbox.Gearbox` is a definition with what follows from it:
   ``losses`` (:mod:`~models.losses.loss_model`) and thermal network (``assembly.gearbox_network``; without geometry
   ``assembly.parametric``; what both may add, ``assembly.table_builder``). ``formulas`` holds the correlations of both,
   each with its source.
3. ``network``: a network is nodes, parameters and symbolic laws (``structure``, ``laws``); ``compiled`` makes numpy
   functions of them.
4. ``simulation``: :class:`~models.simulation.thermal_network.ThermalNetwork` simulates a cycle or finds a steady
   state; ``portable.solver`` integrates.
5. ``portable``: solver, evaluation of a network and surrogate in numpy alone; the Python FMU contains this folder.
6. ``terms``, ``mechanisms``, ``correction``: what extends a network, the catalogue of such physics, and the file with
   what a diagnosis found.

Results are columns (``columns``) with names and units of ``quantities``.

Four pieces of code integrate a network, because each has another task: ``portable.solver`` simulates, here and in the
Python FMU; ``fmu_src/native`` is the same method in C; ``diagnosis.forward.trajectory`` simulates on the grid of a
recording together with all derivatives; the plants of ``diagnosis.proof`` have integrators that share nothing with
these, or a fault in one would not show.
"""
