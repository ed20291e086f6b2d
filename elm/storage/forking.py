"""What a forked process does with the stores it inherits: it lets go of the other's connections and locks, unheard."""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from threading import Condition, Lock
from typing import TYPE_CHECKING, Any, Protocol
from weakref import WeakSet

if TYPE_CHECKING:
    import psycopg


class Heir(Protocol):
    """What cannot go on in a forked process with what it has."""

    def begin_anew(self) -> None:
        """Have no connection, and no lock that may be held by a thread of the other process."""


_connections: WeakSet[psycopg.Connection[Any]] = WeakSet()
_heirs: WeakSet[Heir] = WeakSet()
_conditions: WeakSet[Condition] = WeakSet()
_held: list[Condition] = []
_alone = Lock()
"""Held by a fork, and by who adds a condition: none may appear between taking them and letting them go."""


def lost_by_children(connection: psycopg.Connection[Any]) -> None:
    """Have a forked process find that the server has hung up this connection, which the server does not notice."""
    _connections.add(connection)


def renewed_in_children(heir: Heir) -> None:
    """Have `heir` begin anew in a forked process."""
    _heirs.add(heir)


def awaited_by_forks(condition: Condition) -> None:
    """Have a fork wait for whoever holds this lock: the copy of what it guards is whole then, and nobody's."""
    with _alone:
        _conditions.add(condition)


def _before() -> None:
    _alone.acquire()
    _held.extend(_conditions)
    for condition in _held:
        condition.acquire()


def _after() -> None:
    while _held:
        _held.pop().release()
    _alone.release()


def _after_in_child() -> None:
    _after()
    try:
        if _connections:
            _hang_up()
    finally:
        for heir in _heirs:
            heir.begin_anew()


def _hang_up() -> None:
    # Imported here: a store in the process needs no driver.
    from psycopg import Error

    dead, peer = socket.socketpair()
    peer.close()
    with dead:
        for connection in _connections:
            # Of a socket, processes share what it leads to: to close the connection, or to shut the socket down, would
            # end the other's. In its place comes one whose peer is gone, and the driver finds that out for itself.
            # So a result that the other reads on with is not cancelled either when this process lets go of it.
            with suppress(Error):
                os.dup2(dead.fileno(), connection.fileno(), inheritable=False)
                connection.pgconn.consume_input()


os.register_at_fork(before=_before, after_in_parent=_after, after_in_child=_after_in_child)
