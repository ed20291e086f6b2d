"""A server's address at which the connection breaks when a given number of messages have come from the client."""

from __future__ import annotations

import socket
import time
from pathlib import Path
from threading import Lock, Thread
from types import TracebackType
from typing import Self

import psycopg

_STARTUP, _MESSAGE = 4, 5
"""Bytes until a message's length is known: the first one has no type in front."""


class Cutter:
    """Passes on what clients and server say, message by message, until it cuts them off."""

    def __init__(self, dsn: str) -> None:
        known = psycopg.conninfo.conninfo_to_dict(dsn)
        self._server = str(Path(str(known["host"])) / f".s.PGSQL.{known.get('port') or 5432}")
        self._direct = dsn
        self._listening = socket.create_server(("127.0.0.1", 0))
        host, port = self._listening.getsockname()[:2]
        plain = {"sslmode": "disable", "gssencmode": "disable"}
        self.dsn = psycopg.conninfo.make_conninfo(dsn, host=host, port=port, application_name="cut", **plain)
        self._lock = Lock()
        self._left: int | None = None
        self._is_heard = True
        self._ends: list[socket.socket] = []
        self._threads: list[Thread] = []

    def cut(self, number: int, *, is_heard: bool) -> None:
        """Break all connections at message `number` from now on; `is_heard` tells whether the server still gets it."""
        with self._lock:
            self._left, self._is_heard = number, is_heard

    def wait_for_the_server(self) -> None:
        """Return when the server has finished what it was told through here."""
        with psycopg.connect(self._direct) as connection:
            for _ in range(5_000):
                row = connection.execute("SELECT count(*) FROM pg_stat_activity WHERE application_name = 'cut'")
                if row.fetchone() == (0,):
                    return
                connection.rollback()
                time.sleep(0.002)
        raise AssertionError("the server goes on with what it was told before the connection broke")

    def __enter__(self) -> Self:
        self._start(self._accept)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._break()
        for thread in self._threads:
            thread.join()
        for end in self._ends:
            end.close()

    def _start(self, target: object, *args: object) -> None:
        thread = Thread(target=target, args=args)  # type: ignore[arg-type]
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listening.accept()
            except OSError:
                return
            server = socket.socket(socket.AF_UNIX)
            server.connect(self._server)
            self._ends += [client, server]
            self._start(self._pass_on, client, server)
            self._start(self._answer, server, client)

    def _pass_on(self, client: socket.socket, server: socket.socket) -> None:
        head = _STARTUP
        while message := _message(client, head):
            head = _MESSAGE
            with self._lock:
                is_cut = self._left is not None and self._left <= 1
                self._left = None if self._left is None else self._left - 1
            if not is_cut or self._is_heard:
                _send(server, message)
            if is_cut:
                self._break()
                return
        _shut(server)

    def _answer(self, server: socket.socket, client: socket.socket) -> None:
        while data := _received(server, 65536):
            _send(client, data)
        _shut(client)

    def _break(self) -> None:
        for end in self._ends:
            _shut(end)


def _message(sender: socket.socket, head: int) -> bytes:
    """The next whole message; empty at the end."""
    start = _exactly(sender, head)
    return start + _exactly(sender, int.from_bytes(start[-4:], "big") - 4) if start else b""


def _exactly(sender: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = _received(sender, count - len(data))
        if not more:
            return b""
        data += more
    return data


def _received(sender: socket.socket, most: int) -> bytes:
    try:
        return sender.recv(most)
    except OSError:
        return b""


def _send(receiver: socket.socket, data: bytes) -> None:
    try:
        receiver.sendall(data)
    except OSError:
        _shut(receiver)


def _shut(end: socket.socket) -> None:
    try:
        end.shutdown(socket.SHUT_RDWR)
    except OSError:
        return
