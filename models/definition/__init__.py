"""Tables of a gearbox definition, checked."""
