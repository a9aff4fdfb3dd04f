"""Blind injections: known effects put into recordings of real machines."""
