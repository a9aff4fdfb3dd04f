"""The diagnosis as an object: findings, places, identifiability."""
