"""Foundations of all layers: errors, types, root finding, parallel runs, atomic files, the version."""
