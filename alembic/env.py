"""Runs the migrations of one memory on the connection that elm hands over, in that memory's schema."""

from __future__ import annotations

from alembic import context

connection = context.config.attributes.get("connection")
if connection is None:
    raise SystemExit("These migrations run through elm: use `elm migrate [--dsn DSN] [--memory NAME]`.")

# The caller's transaction and search_path decide where everything goes, the version table included.
context.configure(connection=connection)
context.run_migrations()
