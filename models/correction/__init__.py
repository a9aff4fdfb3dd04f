"""Corrections that a diagnosis makes to a gearbox, and their files."""
