"""Closing a store while threads work with it: what is being written is written, and no connection is left behind."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from threading import Lock, Thread

import psycopg
import pytest

from elm import cues
from elm.errors import StoreClosed, StoreFailure
from elm.query import Query
from elm.storage.connections import Connections, open_connection
from elm.storage.planning import RECALLING
from elm.store import Arrival, Committed, Store
from tests.servers import MEMORY
from tests.storage.test_concurrency import Robots, going_on


@pytest.fixture
def robots(dsn: str) -> Iterator[Robots]:
    with ExitStack() as opened:
        yield Robots(dsn, opened)


def test_what_is_being_committed_is_committed_before_the_store_closes(robots: Robots) -> None:
    event, late = going_on(), going_on()
    second = robots.another()
    with ThreadPoolExecutor(3) as threads:
        with robots.stopped_at("log_inbox"):
            committing = threads.submit(robots.store.commit, Arrival(event=event))
            robots.wait_for_locks(committing)
            closing = threads.submit(robots.store.close)
            with pytest.raises(TimeoutError):
                closing.result(timeout=0.3)
            in_line = threads.submit(robots.store.commit, Arrival(event=late))
        assert isinstance(committing.result(), Committed)
        closing.result()
        with pytest.raises(StoreClosed):
            in_line.result()
    assert [found.uid for found in second.find(Query())] == [event.uid]


class _OthersFirst:
    """A lock before which, once, another thread runs to its end."""

    def __init__(self, other: Thread) -> None:
        self._lock = Lock()
        self._other: Thread | None = other

    def __enter__(self) -> None:
        if self._other is not None:
            other, self._other = self._other, None
            other.start()
            other.join()
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()


def test_a_connection_given_back_while_the_store_closes_is_closed(dsn: str) -> None:
    connections = Connections(dsn, MEMORY)
    with connections.recalling() as connection:
        connections._lock = _OthersFirst(Thread(target=connections.close))  # type: ignore[assignment]
    assert connection.closed
    assert not any(connections._idle.values())


def test_no_connection_is_opened_once_the_store_has_closed(dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    connections = Connections(dsn, MEMORY)
    opened: list[object] = []
    monkeypatch.setattr(connections, "_open", opened.append)
    connections._lock = _OthersFirst(Thread(target=connections.close))  # type: ignore[assignment]
    with pytest.raises(StoreClosed), connections.recalling():
        pass
    assert opened == []


def test_readers_and_a_closer_leave_nothing_open(robots: Robots) -> None:
    robots.store.commit(Arrival(event=going_on()))

    def read(store: Store) -> None:
        while True:
            store.count(cues.everything())

    for _ in range(5):
        store = robots.another()
        store.count(cues.everything())
        with ThreadPoolExecutor(4) as threads:
            reading = [threads.submit(read, store) for _ in range(4)]
            store.close()
            for each in reading:
                with pytest.raises(StoreClosed):
                    each.result()
        assert [each for each in store._session.connections._opened if not each.closed] == []


def test_a_connection_that_cannot_be_set_up_is_closed(dsn: str) -> None:
    address = psycopg.conninfo.make_conninfo(dsn, application_name="unfit")
    with pytest.raises(StoreFailure, match="no_such_setting") as error:
        open_connection(address, {**RECALLING, "no_such_setting": "1"})
    # The error still holds what it met on its way: that the collector closes the connection is not enough.
    assert error.value.__traceback__ is not None
    with psycopg.connect(dsn, autocommit=True) as watch:
        asked = "SELECT count(*) FROM pg_stat_activity WHERE application_name = 'unfit'"
        left = {watch.execute(asked).fetchone() for _ in range(200)}
    assert (0,) in left
