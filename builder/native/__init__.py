"""The native FMU: generated C, compilation, packaging."""
