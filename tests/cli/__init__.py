"""The command line as people run it: real processes, a real database."""
