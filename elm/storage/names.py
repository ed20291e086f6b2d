"""The numbers a memory gave to its types and frames, kept once seen: neither is ever renamed or removed."""

from __future__ import annotations

from collections.abc import Iterable

from elm.errors import UnknownType
from elm.storage.connections import Connection, Connections

UNKNOWN_FRAME = -1
"""A frame number that no event has."""

# With the types asked for come those that are not known yet, up to a number that takes some 30 ms: asked
# for one by one, each type would delay the first event it has.
_TYPES_BY_NAME = """
SELECT id, name FROM event_type WHERE name = ANY(%(missing)s)
UNION (SELECT id, name FROM event_type WHERE id > %(seen)s ORDER BY id LIMIT 20000)
"""
_TYPES_BY_ID = "SELECT id, name FROM event_type WHERE id = ANY(%s)"


class NameCache:
    """Types and frames of one memory by name and by number."""

    def __init__(self, connections: Connections, memory: str) -> None:
        self._connections = connections
        self._memory = memory
        self._type_ids: dict[str, int] = {}
        self._frame_ids: dict[str, int] = {}
        self.types: dict[int, str] = {}
        """Type names by number, as far as seen."""
        self.frames: dict[int, str] = {}
        """Frame names by number, as far as seen."""

    def type_id(self, name: str) -> int:
        """The number of a type; an unknown one is an error."""
        return self.type_ids([name])[name]

    def type_ids(self, names: Iterable[str]) -> dict[str, int]:
        """The numbers of several types; one that is unknown is an error."""
        known = self.known_type_ids(names)
        for name in names:
            if name not in known:
                raise UnknownType(
                    f"memory {self._memory!r} has no event type {name!r}: "
                    f"add it first (memory.add_type, or `elm types add`)"
                )
        return known

    def known_type_ids(self, names: Iterable[str]) -> dict[str, int]:
        """The numbers of those of `names` that are types."""
        missing = [name for name in names if name not in self._type_ids]
        if missing:
            with self._connections.recalling() as connection:
                self._keep(connection.execute(_TYPES_BY_NAME, {"missing": missing, "seen": max(self.types, default=0)}))
        return self._type_ids

    def frame_id(self, name: str) -> int:
        """The number of a frame; of an unknown one a number that no event has."""
        if name not in self._frame_ids:
            with self._connections.recalling() as connection:
                self._learn_frames(connection)
        return self._frame_ids.get(name, UNKNOWN_FRAME)

    def frame_ids(self, names: Iterable[str]) -> dict[str, int]:
        """The numbers of several frames; unknown ones are added, in a transaction of their own."""
        missing = sorted({name for name in names if name not in self._frame_ids})
        if missing:
            with self._connections.writing() as connection:
                connection.execute(
                    "INSERT INTO frame (name) SELECT unnest(%s::text[]) ON CONFLICT (name) DO NOTHING", [missing]
                )
                self._learn_frames(connection)
        return self._frame_ids

    def learn(self, connection: Connection, type_ids: Iterable[int], frame_ids: Iterable[int | None]) -> None:
        """Have the names of these numbers at hand."""
        if missing := [number for number in set(type_ids) if number not in self.types]:
            self._keep(connection.execute(_TYPES_BY_ID, [missing]).fetchall())
        if any(number is not None and number not in self.frames for number in set(frame_ids)):
            self._learn_frames(connection)

    def _keep(self, types: Iterable[tuple[int, str]]) -> None:
        for number, name in types:
            self._type_ids[name] = number
            self.types[number] = name

    def _learn_frames(self, connection: Connection) -> None:
        for number, name in connection.execute("SELECT id, name FROM frame").fetchall():
            self._frame_ids[name] = number
            self.frames[number] = name
