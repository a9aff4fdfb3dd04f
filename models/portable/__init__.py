"""Code that also runs inside the Python FMU: solver, evaluation of a network, surrogate; numpy only."""
