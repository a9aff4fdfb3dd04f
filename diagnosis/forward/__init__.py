"""Fast simulation of a network on the time grid of a recording, with derivatives."""
