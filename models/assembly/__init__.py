"""From a definition to a gearbox with its losses and thermal network."""
