"""Units of definition files and of the FMI interface, names of columns."""
