"""Calibration: unknowns, noise, whitening, posterior, evidence."""
