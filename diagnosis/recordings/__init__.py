"""From files to recordings: mapping, time axis, units, plausible ranges, cleaning."""
