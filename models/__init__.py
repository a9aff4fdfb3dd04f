"""Physics: what a gearbox is, what it loses, how its heat flows."""
