"""Columns of the file contract in memory: as a data frame, and drawn with one colour per part."""
