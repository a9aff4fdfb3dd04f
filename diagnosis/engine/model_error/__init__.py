"""Structured model error: further unknowns with small prior amplitudes for what a lumped model cannot know."""

from __future__ import annotations

from diagnosis.engine.model_error.error_columns import ModelError

__all__ = ["ModelError"]
