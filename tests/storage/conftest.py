"""A database of a test's own, with an empty memory in it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.servers import Server


@pytest.fixture
def dsn(postgres_server: Server) -> Iterator[str]:
    """The address of a database that goes with the test."""
    with postgres_server.database() as address:
        yield address
