"""Structure of a thermal network, its symbolic laws, and their compilation."""
