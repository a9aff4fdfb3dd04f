"""Recordings with concealed effects, and their truth."""
