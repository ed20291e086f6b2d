"""What all tests share: how random tests run, and the stores that keep the contract."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import chain, count

import pytest
from hypothesis import HealthCheck, settings

from elm.log import LoggedStore
from tests.servers import MEMORY, Server, run_container, run_private_cluster

settings.register_profile(
    "elm",
    deadline=None,
    max_examples=50,
    # The same examples at every run where a failure would stop others; new ones at every run by hand.
    derandomize=bool(os.environ.get("CI")),
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
settings.load_profile("elm")


class StoreFactory:
    """Opens an empty memory at every call; of those it opened the last few stay open, for a test may open hundreds."""

    LAST_FEW = 4

    def __init__(self, open_store: Callable[[], LoggedStore]) -> None:
        self._open_store = open_store
        self._opened: deque[LoggedStore] = deque()

    def __call__(self) -> LoggedStore:
        self.close(keep=self.LAST_FEW - 1)
        self._opened.append(self._open_store())
        return self._opened[-1]

    def close(self, *, keep: int = 0) -> None:
        """Close all but the last ones."""
        while len(self._opened) > keep:
            self._opened.popleft().close()


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[Server]:
    """The private cluster of this test run."""
    with run_private_cluster() as server:
        yield server


@pytest.fixture(scope="session")
def container_server() -> Iterator[Server]:
    """The container of this test run."""
    with run_container() as server:
        yield server


def _in_process() -> LoggedStore:
    from elm.storage.memory import MemoryStore

    return MemoryStore()


def _in_database(dsn: str) -> Callable[[], LoggedStore]:
    """The first memory is the database's own; each further one is made beside it by its first write."""
    names = chain([MEMORY], (f"{MEMORY}_{number}" for number in count(2)))

    def open_store() -> LoggedStore:
        from elm.storage.postgres import PostgresStore

        return PostgresStore(dsn, next(names))

    return open_store


@pytest.fixture(params=["memory", "postgres", pytest.param("container", marks=pytest.mark.container)])
def store_factory(request: pytest.FixtureRequest) -> Iterator[StoreFactory]:
    """Every kind of store in turn; random memories are told to the private cluster, not to the container too."""
    if request.param == "container" and hasattr(request.function, "hypothesis"):
        pytest.skip("random memories: the same store answers them on the private cluster")
    with ExitStack() as stack:
        if request.param == "memory":
            open_store = _in_process
        else:
            server: Server = request.getfixturevalue(f"{request.param}_server")
            open_store = _in_database(stack.enter_context(server.database()))
        factory = StoreFactory(open_store)
        stack.callback(factory.close)
        yield factory


@pytest.fixture
def store(store_factory: StoreFactory) -> LoggedStore:
    """One empty memory."""
    return store_factory()
