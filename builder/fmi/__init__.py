"""Parts that all FMUs share: signals, model description, documentation, packaging."""
