"""The executable, a database for it to work on, and a private cluster for it to run."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass, field, replace
from pathlib import Path
from uuid import uuid4

import pytest
from typer.testing import CliRunner

import elm
from elm.cli.program import app
from elm.storage.cluster import Cluster
from tests.cli.samples import EVENTS, TYPES
from tests.servers import Server

SOURCES = Path(elm.__file__).parents[1]


@dataclass(frozen=True, kw_only=True)
class Program:
    """`elm` in a directory, with an environment that nothing of the caller's settings reaches."""

    directory: Path
    settings: Mapping[str, str] = field(default_factory=dict)

    @property
    def command(self) -> list[str]:
        return [sys.executable, "-m", "elm"]

    @property
    def environment(self) -> dict[str, str]:
        inherited = {name: value for name, value in os.environ.items() if not name.startswith(("ELM_", "PG"))}
        path = os.pathsep.join([str(SOURCES), *filter(None, [inherited.get("PYTHONPATH")])])
        return {**inherited, "PYTHONPATH": path, "TERM": "xterm", "COLUMNS": "120", **self.settings}

    def having(self, **settings: str) -> Program:
        return replace(self, settings={**self.settings, **settings})

    def __call__(self, *arguments: object, stdin: bytes = b"") -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [*self.command, *map(str, arguments)],
            cwd=self.directory,
            env=self.environment,
            input=stdin,
            capture_output=True,
            timeout=120,
            check=False,
        )
        return subprocess.CompletedProcess(done.args, done.returncode, done.stdout.decode(), done.stderr.decode())

    def start(self, *arguments: object, **streams: int) -> subprocess.Popen[bytes]:
        stdin, stdout, stderr = (streams.get(name) for name in ("stdin", "stdout", "stderr"))
        command = [*self.command, *map(str, arguments)]
        return subprocess.Popen(
            command, cwd=self.directory, env=self.environment, stdin=stdin, stdout=stdout, stderr=stderr
        )

    def here(self, *arguments: object, stdin: bytes = b"") -> subprocess.CompletedProcess[str]:
        """The same in this process, for what needs no process of its own; `args` is all that was printed, in turn."""
        absent = {name: None for name in os.environ if name.startswith(("ELM_", "PG"))}
        runner = CliRunner(env={**absent, **self.settings})
        with chdir(self.directory):
            done = runner.invoke(app, [*map(str, arguments)], input=stdin, prog_name="elm")
        return subprocess.CompletedProcess(done.output, done.exit_code, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def database(postgres_server: Server) -> Iterator[str]:
    """The address of a database for all tests of this folder."""
    with postgres_server.database() as dsn:
        yield dsn


@pytest.fixture
def program(database: str, tmp_path: Path) -> Program:
    """`elm` with a memory of the test's own, which does not exist yet."""
    return _program(database, tmp_path)


@pytest.fixture(scope="module")
def filled(database: str, tmp_path_factory: pytest.TempPathFactory) -> Program:
    """`elm` with a memory that holds the samples; tests leave it as it is."""
    program = _program(database, tmp_path_factory.mktemp("filled"))
    assert program.here("types", "load", "-", stdin=told(TYPES)).returncode == 0
    assert program.here("load", "-", stdin=told(EVENTS)).returncode == 0
    return program


@pytest.fixture(scope="session")
def home() -> Iterator[Path]:
    """The home of a private cluster that commands make, start and stop."""
    # Not below pytest's directories: the account that runs the server for root must get through.
    directory = Path(tempfile.mkdtemp(prefix="elm-cli-")).resolve()
    directory.chmod(0o755)
    cluster = Cluster(home=directory / "home")
    try:
        yield cluster.home
    finally:
        cluster.down()
        shutil.rmtree(cluster.status().socket_directory, ignore_errors=True)
        shutil.rmtree(directory, ignore_errors=True)


def told(lines: Sequence[object]) -> bytes:
    """Lines as they stand in a file."""
    return "".join(f"{line}\n" for line in lines).encode()


def _program(dsn: str, directory: Path) -> Program:
    # A home that nobody makes: a command that forgets the DSN fails, and does not reach somebody's own cluster.
    settings = {"ELM_DSN": dsn, "ELM_HOME": str(directory / "no-home"), "ELM_MEMORY": f"m{uuid4().hex[:12]}"}
    return Program(directory=directory, settings=settings)
