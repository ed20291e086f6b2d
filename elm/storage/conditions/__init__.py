"""The SQL of single conditions: one room each for when, where, what, and the links between events."""
