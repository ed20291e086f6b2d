"""The command line `elm`: its start, quick because nothing heavy is imported before a command needs it."""

from __future__ import annotations

import logging
import sys


def main() -> None:
    """Run the command line of this process and exit with its code."""
    # A command that ends tells its own reason: what the driver says of connections that it drops is no news.
    logging.getLogger("psycopg").addHandler(logging.NullHandler())
    try:
        from elm.cli.program import app

        # What a narrow encoding lacks is shown by its code: an answer must not fail for a character.
        for stream in (sys.stdout, sys.stderr):
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
        app(prog_name="elm")
    except KeyboardInterrupt:
        # Ctrl-C before any command began.
        sys.exit(130)
