"""Measurements of what writing costs: commits, loads, type hierarchies."""
