"""`python -m elm`: the command line where its script is not on the path."""

from __future__ import annotations

from elm.cli import main

main()
