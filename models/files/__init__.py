"""Tables, TOML and cycles as files."""
