"""Candidate mechanisms: linear scan and nonlinear fit."""
