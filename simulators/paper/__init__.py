"""The experiments of the paper's section VI, run again."""
