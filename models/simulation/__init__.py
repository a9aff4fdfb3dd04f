"""Simulation of a thermal network: cycles, steady states, start temperatures."""
