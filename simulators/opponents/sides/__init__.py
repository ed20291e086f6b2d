"""The sides, one module each, run as a process of its own: elm, and the stores that a user would pick instead."""
