"""Power losses: laws of mesh, churning, seals and bearings, and the sum of their terms."""
