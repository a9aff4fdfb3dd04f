"""From a gearbox definition to an FMU, and the command line."""
