"""Plants that are built differently from the model: other nodes, other paths, other laws."""
