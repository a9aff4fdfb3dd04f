"""Correlations of tribology, gear geometry and heat transfer, each with its source."""
