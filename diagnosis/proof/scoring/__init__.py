"""Scores of diagnoses against the truth."""
