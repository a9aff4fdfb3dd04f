"""Which candidates are accepted: search, hold-out, acceptance rules."""
