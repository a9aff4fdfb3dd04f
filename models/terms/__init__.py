"""Terms that extend a network, and their form in TOML files."""
