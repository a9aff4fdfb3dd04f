"""Driving an FMU with FMPy, and plots of the results."""
