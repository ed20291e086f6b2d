"""Runs the migrations of one memory on the connection that elm hands over, in that memory's schema."""

from __future__ import annotations

from alembic import context

connection = context.config.attributes.get("connection")
if connection is None:
    raise SystemExit("These migrations run through elm: use `elm migrate [--dsn DSN] [--memory NAME]`.")

# The caller's transaction and search_path decide where everything goes. The version table is named with its
# schema, for a later one of the path may have one too, of another program.
context.configure(connection=connection, version_table_schema=context.config.attributes["memory"])
context.run_migrations()
