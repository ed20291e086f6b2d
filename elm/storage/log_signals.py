"""What processes tell each other of a log outside its tables: that there is news, and who works under which name."""

from __future__ import annotations

import hashlib
import select
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import psycopg
from psycopg import sql

from elm.log import consumer_busy
from elm.storage import log_statements, prepared
from elm.storage.connections import Connection, open_connection, translated

NEWS_APART = 0.01
"""Seconds between two notifications of one store: one for every commit would halve the rate of its writers."""

# A holder whose machine is gone lets go of the name after half a minute, not after the two hours of TCP.
_HOLDING = {"tcp_keepalives_idle": "15", "tcp_keepalives_interval": "5", "tcp_keepalives_count": "3"}


class News:
    """The channel on which writers of a memory wake those who wait for its log."""

    def __init__(self, memory: str) -> None:
        self._channel = f"elm_{memory}"
        self._told = -NEWS_APART

    def tell(self, connection: Connection) -> None:
        """Wake who listens, unless that was done just now."""
        now = time.monotonic()
        if now - self._told < NEWS_APART:
            return
        self._told = now
        # What is told of is committed already: the writer must not hear that it failed.
        with suppress(psycopg.Error):
            prepared.run(connection, "elm_notify", log_statements.NOTIFY, (self._channel.encode(),))

    @contextmanager
    def heard_by(self, connection: Connection) -> Iterator[Ear]:
        """Have a connection listen; not longer than it is read from, or the server would keep news for it for ever."""
        channel = sql.Identifier(self._channel)
        ear = Ear(connection)
        connection.add_notify_handler(ear.hear)
        try:
            connection.execute(sql.SQL("LISTEN {}").format(channel))
            yield ear
            connection.execute(sql.SQL("UNLISTEN {}").format(channel))
        except BaseException:
            connection.close()
            raise
        finally:
            connection.remove_notify_handler(ear.hear)


class Ear:
    """Hears the news that come to one connection, between its statements and with their answers."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._has_news = False

    def hear(self, news: psycopg.Notify) -> None:
        """Remember that there was some."""
        self._has_news = True

    def wait(self, seconds: float) -> None:
        """Return when there is news since the last time, or after `seconds`.

        By libpq: the driver's own way of waiting takes several times what the looks for entries in between take.
        """
        libpq = self._connection.pgconn
        if not self._has_news:
            poll = select.poll()
            poll.register(libpq.socket, select.POLLIN)
            poll.poll(seconds * 1000)
        libpq.consume_input()
        while libpq.notifies():
            pass
        self._has_news = False


@contextmanager
def exclusive(dsn: str, memory: str, name: str) -> Iterator[None]:
    """Hold a consumer's name, by a connection of its own, as long as the context and that connection are open."""
    connection = open_connection(dsn, _HOLDING, memory=memory)
    number = _lock_number(memory, name)
    try:
        with translated(memory):
            row = connection.execute(log_statements.TRY_LOCK, [number]).fetchone()
        if row != (True,):
            raise consumer_busy(name)
        try:
            yield
        finally:
            # A server lets go of what a closed connection held only when it has noticed.
            with suppress(psycopg.Error):
                connection.execute(log_statements.UNLOCK, [number])
    finally:
        connection.close()


def _lock_number(memory: str, name: str) -> int:
    digest = hashlib.sha256(f"elm consumer\0{memory}\0{name}".encode()).digest()
    return int.from_bytes(digest[:8], byteorder="big", signed=True)
