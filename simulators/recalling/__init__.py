"""Measurements of what recalling costs, class by class and row by row."""
