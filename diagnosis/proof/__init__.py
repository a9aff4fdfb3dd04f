"""Proof of the diagnosis: a plant apart from the model makes recordings in which an effect is concealed."""
