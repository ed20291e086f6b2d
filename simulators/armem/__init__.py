"""Measurements of ArmarX-style memory: what the evaluation of its authors measured, done again here."""
