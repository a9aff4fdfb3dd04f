"""The plant that makes test recordings: an implementation independent of `models`."""
