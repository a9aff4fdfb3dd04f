"""Code that runs inside the Python FMU."""
