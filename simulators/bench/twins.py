"""Empty copies of a memory's tables, with equal indexes and constraints, and bare COPY of finished rows into them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from psycopg import sql

from simulators.bench.scratch import Connection, bare_schema

_COLUMNS = """
SELECT column_name FROM information_schema.columns
WHERE table_schema = %s AND table_name = %s AND is_generated = 'NEVER' ORDER BY ordinal_position
"""
_FOREIGN_KEYS = """
SELECT t.relname, c.conname, pg_get_constraintdef(c.oid) FROM pg_constraint c JOIN pg_class t ON t.oid = c.conrelid
WHERE c.contype = 'f' AND c.connamespace = %s::regnamespace AND t.relname = ANY(%s)
"""
_SEARCH_PATH = "SELECT set_config('search_path', %s, false)"


class Twins:
    """Copies of some tables of a memory, in the schema beside it; foreign keys to other tables lead into the memory."""

    def __init__(self, connection: Connection, memory: str, tables: Sequence[str]) -> None:
        self._connection = connection
        self._memory = memory
        self._schema = bare_schema(memory)
        self._columns = {table: self._column_list(table) for table in tables}
        path = f'"{memory}", public'
        # Tables that the path finds are named without schema, and the path below finds the twins first.
        connection.execute(_SEARCH_PATH, [path])
        keys = connection.execute(_FOREIGN_KEYS, [f'"{memory}"', list(tables)]).fetchall()
        connection.execute(_SEARCH_PATH, [f'"{self._schema}", {path}'])
        for table in tables:
            connection.execute(
                sql.SQL("CREATE TABLE {} (LIKE {} INCLUDING ALL)").format(self._twin(table), self._original(table))
            )
        for table, name, definition in keys:
            connection.execute(
                sql.SQL("ALTER TABLE {} ADD CONSTRAINT {} {}").format(
                    self._twin(table), sql.Identifier(name), sql.SQL(definition)
                )
            )

    def finished(self, table: str, condition: str = "true") -> bytes:
        """The rows of the memory's table as COPY takes them in."""
        statement = sql.SQL("COPY (SELECT {} FROM {} WHERE {}) TO STDOUT (FORMAT BINARY)").format(
            self._columns[table], self._original(table), sql.SQL(condition)
        )
        with self._connection.cursor().copy(statement) as copy:
            return b"".join(copy)

    def copy(self, rows: Mapping[str, bytes]) -> None:
        """Copy finished rows into the twin of each table, in this order, in one transaction."""
        with self._connection.transaction():
            for table, data in rows.items():
                statement = sql.SQL("COPY {} ({}) FROM STDIN (FORMAT BINARY)").format(
                    self._twin(table), self._columns[table]
                )
                with self._connection.cursor().copy(statement) as copy:
                    copy.write(data)

    def analyze(self) -> None:
        """Bring the planner's statistics on the twins up to date."""
        tables = sql.SQL(", ").join(map(self._twin, self._columns))
        self._connection.execute(sql.SQL("VACUUM (ANALYZE) {}").format(tables))

    def count(self, table: str) -> int:
        """How many rows the twin of a table has."""
        row = self._connection.execute(sql.SQL("SELECT count(*) FROM {}").format(self._twin(table))).fetchone()
        return int(row[0]) if row else 0

    def empty(self) -> None:
        """Take all rows out of the twins."""
        tables = sql.SQL(", ").join(map(self._twin, self._columns))
        self._connection.execute(sql.SQL("TRUNCATE {}").format(tables))

    def _column_list(self, table: str) -> sql.Composed:
        names = self._connection.execute(_COLUMNS, [self._memory, table]).fetchall()
        return sql.SQL(", ").join(sql.Identifier(name) for (name,) in names)

    def _twin(self, table: str) -> sql.Identifier:
        return sql.Identifier(self._schema, table)

    def _original(self, table: str) -> sql.Identifier:
        return sql.Identifier(self._memory, table)
