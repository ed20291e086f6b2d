"""PostgreSQL servers for the tests: a private cluster, or a container, each with one migrated template database."""

from __future__ import annotations

import gc
import os
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import psycopg
import pytest
from psycopg import sql

from elm.storage import migrate
from elm.storage.cluster import Cluster

MEMORY = "elm"
"""The memory that the template database, and every copy of it, has."""
IMAGE = os.environ.get("ELM_TEST_IMAGE", "postgis/postgis:16-3.4")

_TEMPLATE = "elm_template"
_numbers = count(1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Server:
    """A running server; `dsn` gives the address of one of its databases."""

    dsn: Callable[[str], str]

    @contextmanager
    def database(self) -> Iterator[str]:
        """The address of a database of its own, with an empty memory."""
        name = f"elm_test_{next(_numbers)}"
        self._execute("CREATE DATABASE {} TEMPLATE {}", name, _TEMPLATE)
        try:
            yield self.dsn(name)
        finally:
            self._execute("DROP DATABASE {} WITH (FORCE)", name)

    def prepare(self) -> None:
        """Make the template."""
        self._execute("CREATE DATABASE {}", _TEMPLATE)
        migrate(self.dsn(_TEMPLATE), MEMORY)

    def _execute(self, statement: str, *names: str) -> None:
        with psycopg.connect(self.dsn("postgres"), autocommit=True) as connection:
            connection.execute(sql.SQL(statement).format(*map(sql.Identifier, names)))


@contextmanager
def run_private_cluster() -> Iterator[Server]:
    """A private cluster in a directory that its account can enter, gone afterwards."""
    directory = Path(tempfile.mkdtemp(prefix="elm-test-")).resolve()
    directory.chmod(0o755)
    quick = {"fsync": "off", "full_page_writes": "off", "synchronous_commit": "off", "shared_buffers": "128MB"}
    cluster = Cluster(home=directory / "home", settings=quick)
    try:
        cluster.up()
        server = Server(dsn=cluster.dsn)
        server.prepare()
        yield server
    finally:
        cluster.down()
        shutil.rmtree(cluster.status().socket_directory, ignore_errors=True)
        shutil.rmtree(directory, ignore_errors=True)


@contextmanager
def run_container() -> Iterator[Server]:
    """A container of the image in ELM_TEST_IMAGE; skips where no Docker engine answers."""
    from testcontainers.community.postgres import PostgresContainer

    if silence := _why_no_engine_answers():
        pytest.skip(f"no Docker engine answers: {silence}")
    with PostgresContainer(IMAGE, driver="psycopg") as container:
        address = container.get_connection_url(driver=None).rpartition("/")[0]
        server = Server(dsn=lambda database: f"{address}/{database}")
        server.prepare()
        yield server


def _why_no_engine_answers() -> str | None:
    docker = pytest.importorskip("docker", reason="containers need the package docker")
    with warnings.catch_warnings():
        # The client leaves the socket to the garbage collector when nobody answers.
        warnings.simplefilter("ignore", ResourceWarning)
        try:
            with closing(docker.from_env()) as engine:
                engine.ping()
        except (docker.errors.DockerException, OSError) as error:
            reason = str(error)
        else:
            return None
        gc.collect()
    return reason
