"""elm beside the stores that a user would pick instead: the same events, the same questions, the same answers."""
