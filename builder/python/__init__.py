"""The Python FMU (pythonfmu)."""
