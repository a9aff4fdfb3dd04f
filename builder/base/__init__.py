"""Terminal output and the options that verbs share."""
