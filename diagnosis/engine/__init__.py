"""The inference engine: unknowns as objects, one linearisation, one Gram matrix from which all evidences follow."""
