"""Work of several steps: build, fleets of gearboxes, the proof."""
