"""Simulated robots, queries about their lives, and the measurements made with both (section VI of the ELM paper)."""
