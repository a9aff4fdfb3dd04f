"""Preparation of a diagnosis: plausibility of the recordings, data and noise of the inference."""
