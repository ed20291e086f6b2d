"""How the time of a commit and of a recall grows with the memory."""
