"""Families of plants kept for proof: nobody opens this folder before the proof, its specification included."""
