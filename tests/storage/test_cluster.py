"""The private cluster in real runs: its life, its deaths, several at once, and what it says when it cannot run."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import psycopg
import pytest

from elm.errors import ClusterError
from elm.storage.cluster import Cluster
from elm.storage.installation import find_installations
from elm.storage.server_account import ServerAccount

AS_ROOT = os.geteuid() == 0
QUICK = {"fsync": "off"}
"""For clusters that need not outlive the machine."""
needs_root = pytest.mark.skipif(not AS_ROOT, reason="only root can become another user")

ENTER = """
import os, pwd, sys
import psycopg
from psycopg import pq, sql
from elm.storage.cluster import Cluster
"""
BECOME_NOBODY = """
other = pwd.getpwnam("nobody")
os.setgroups([]); os.setgid(other.pw_gid); os.setuid(other.pw_uid)
"""
UP = """
cluster = Cluster(home=sys.argv[1], settings={"fsync": "off"})
cluster.up()
print(cluster.status().pid, cluster.dsn())
"""


def run_python(script: str, *arguments: object, under: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    command = [*under, sys.executable, "-c", script, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def ask(cluster: Cluster, query: str, dbname: str = "elm") -> Any:
    with psycopg.connect(cluster.dsn(dbname), autocommit=True) as connection:
        cursor = connection.execute(query.encode())
        row = cursor.fetchone() if cursor.description else None
        return row and row[0]


def kill_server(cluster: Cluster) -> int:
    pid = cluster.status().pid
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    return pid


@pytest.fixture(scope="module")
def place() -> Iterator[Path]:
    """A directory that every user may enter, other than pytest's own; whatever still runs there is stopped."""
    directory = Path(tempfile.mkdtemp(prefix="elm-test-")).resolve()
    directory.chmod(0o755)
    yield directory
    for data in directory.glob("**/data"):
        cluster = Cluster(home=data.parent)
        cluster.down()
        if (cluster.home / "run").is_symlink():
            shutil.rmtree(cluster.status().socket_directory)
    shutil.rmtree(directory)


@pytest.fixture(scope="module")
def cluster(place: Path) -> Cluster:
    """A durable cluster that this module's tests share; they leave it as they like."""
    return Cluster(home=place / "shared")


@pytest.fixture
def home(place: Path) -> Iterator[Callable[[str], Path]]:
    """Makes homes whose servers go with the test."""
    made: list[Path] = []

    def make(name: str) -> Path:
        made.append(place / name)
        return made[-1]

    yield make
    for each in made:
        Cluster(home=each).down()


def test_up_makes_a_server_with_the_extensions(cluster: Cluster) -> None:
    before = cluster.status()
    assert (before.running, before.pid, before.version, before.data_bytes) == (False, None, None, None)
    assert not cluster.home.exists()

    cluster.up()

    status = cluster.status()
    assert status.running
    assert status.pid is not None
    assert status.version == ask(cluster, "SHOW server_version").split()[0]
    assert status.data_bytes is not None
    assert status.data_bytes > 20_000_000
    assert status.log_file.stat().st_size > 0
    assert (status.socket_directory / f".s.PGSQL.{status.port}").is_socket()
    assert status.socket_directory.stat().st_mode & 0o777 == 0o700
    assert ask(cluster, "SELECT ST_Area('POLYGON((0 0, 2 0, 2 3, 0 3, 0 0))'::geometry)") == 6
    assert ask(cluster, "SELECT count(*) FROM pg_extension WHERE extname = 'btree_gist'") == 1


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("listen_addresses", ""),
        ("fsync", "on"),
        ("synchronous_commit", "on"),
        ("max_wal_size", "4GB"),
        ("autovacuum_naptime", "10s"),
        ("max_connections", "100"),
        ("TimeZone", "UTC"),
        ("jit", "off"),
        ("server_encoding", "UTF8"),
    ],
)
def test_the_server_is_set_up_for_durable_ingestion(cluster: Cluster, setting: str, value: str) -> None:
    cluster.up()
    assert ask(cluster, f"SHOW {setting}") == value


def test_the_server_takes_at_most_a_quarter_of_the_memory_and_a_gigabyte(cluster: Cluster) -> None:
    cluster.up()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    taken = ask(cluster, "SELECT setting::bigint * 8192 FROM pg_settings WHERE name = 'shared_buffers'")
    assert min(1 << 30, memory // 4) - 8192 < taken <= min(1 << 30, memory // 4)


def test_up_and_down_can_be_repeated(cluster: Cluster) -> None:
    cluster.up()
    pid = cluster.status().pid
    ask(cluster, "CREATE TABLE kept AS SELECT 42 AS answer")
    cluster.up()
    assert cluster.status().pid == pid

    cluster.down()
    cluster.down()
    assert not cluster.status().running
    assert cluster.status().version is not None
    with pytest.raises(psycopg.OperationalError):
        psycopg.connect(cluster.dsn())

    cluster.up()
    assert cluster.status().pid != pid
    assert ask(cluster, "SELECT answer FROM kept") == 42


def test_down_of_a_cluster_that_never_was_leaves_nothing(place: Path) -> None:
    Cluster(home=place / "never").down()
    assert not (place / "never").exists()


def test_a_missing_database_is_created_once(cluster: Cluster) -> None:
    cluster.up()
    for _ in range(2):
        cluster.create_database_if_missing('robot "7"; drop')
    assert ask(cluster, "SELECT ST_X('POINT(1 2)'::geometry)", 'robot "7"; drop') == 1


def test_a_killed_server_comes_back_with_all_that_was_committed(cluster: Cluster) -> None:
    cluster.up()
    ask(cluster, "CREATE TABLE committed AS SELECT 7 AS answer")
    with contextlib.closing(psycopg.connect(cluster.dsn())) as busy:
        # A backend in the middle of its work outlives its server, and the data are in use until it ends.
        busy.pgconn.send_query(b"SELECT count(*) FROM generate_series(1, 10000) a, generate_series(1, 4000) b")
        killed = kill_server(cluster)
        cluster.up()
    assert "is still in use" in cluster.status().log_file.read_text()
    assert cluster.status().pid not in (None, killed)
    assert ask(cluster, "SELECT answer FROM committed") == 7


def test_a_lock_file_that_names_another_program_does_not_stop_up(cluster: Cluster) -> None:
    cluster.up()
    kill_server(cluster)
    owner = (cluster.home / "data").stat()
    as_owner: dict[str, Any] = {"user": owner.st_uid, "group": owner.st_gid, "extra_groups": []} if AS_ROOT else {}
    with subprocess.Popen(["sleep", "60"], cwd="/", **as_owner) as bystander:
        for lock in (cluster.home / "data" / "postmaster.pid", cluster.home / "run" / ".s.PGSQL.5432.lock"):
            lines = lock.read_text().splitlines(keepends=True)
            lock.write_text("".join([f"{bystander.pid}\n", *lines[1:]]))
        try:
            assert not cluster.status().running
            cluster.up()
            assert cluster.status().pid != bystander.pid
            assert ask(cluster, "SELECT 1") == 1
            assert bystander.poll() is None
        finally:
            bystander.kill()


def test_a_removed_socket_comes_back(cluster: Cluster) -> None:
    cluster.up()
    (cluster.status().socket_directory / ".s.PGSQL.5432").unlink()
    cluster.up()
    assert ask(cluster, "SELECT 1") == 1


def test_two_clusters_run_side_by_side(cluster: Cluster, home: Callable[[str], Path]) -> None:
    cluster.up()
    other = Cluster(home=home("other"), settings={**QUICK, "cluster_name": "it's \\ other"})
    other.up()
    ask(cluster, "CREATE TABLE here (n int)")
    assert ask(other, "SELECT to_regclass('here')") is None
    assert ask(other, "SHOW cluster_name") == "it's \\ other"
    assert (ask(cluster, "SHOW fsync"), ask(other, "SHOW fsync")) == ("on", "off")
    other.down()
    assert ask(cluster, "SELECT 1") == 1


def test_processes_that_start_it_at_once_get_the_same_server(home: Callable[[str], Path]) -> None:
    fresh = home("raced")
    starters = [
        subprocess.Popen([sys.executable, "-c", ENTER + UP, fresh], stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]
    answers = {starter.communicate(timeout=60)[0] for starter in starters}
    assert [starter.returncode for starter in starters] == [0, 0, 0]
    assert answers == {f"{Cluster(home=fresh).status().pid} {Cluster(home=fresh).dsn()}\n"}


def test_a_starter_killed_on_the_way_does_not_harm_the_next(home: Callable[[str], Path]) -> None:
    fresh = home("interrupted")
    with subprocess.Popen([sys.executable, "-c", ENTER + UP, fresh]) as starter:
        deadline = time.monotonic() + 30
        while not list(fresh.glob("initdb-*/base")):
            assert time.monotonic() < deadline
            time.sleep(0.005)
        starter.kill()
    assert not (fresh / "data").exists()
    cluster = Cluster(home=fresh, settings=QUICK)
    cluster.up()
    assert ask(cluster, "SELECT 1") == 1
    # Its initdb, orphaned, may have written on for a moment: the next start finds what it left.
    cluster.down()
    cluster.up()
    assert sorted(entry.name for entry in fresh.iterdir()) == ["data", "lock", "log", "run"]


def test_a_server_left_by_a_killed_starter_is_completed(home: Callable[[str], Path]) -> None:
    fresh = home("half")
    cluster = Cluster(home=fresh, settings=QUICK)
    with subprocess.Popen([sys.executable, "-c", ENTER + UP, fresh]) as starter:
        deadline = time.monotonic() + 30
        while not cluster.status().running:
            assert time.monotonic() < deadline
            time.sleep(0.005)
        starter.kill()
    cluster.up()
    assert ask(cluster, "SELECT ST_X('POINT(1 2)'::geometry)") == 1


@pytest.mark.parametrize("name", ["a" * 120, "comma, home"])
def test_a_home_unfit_for_a_socket_gets_one_elsewhere(home: Callable[[str], Path], name: str) -> None:
    cluster = Cluster(home=home(name) / "elm", settings=QUICK)
    cluster.up()
    dsn = cluster.dsn()
    assert len(os.fsencode(cluster.status().socket_directory)) <= 93
    assert cluster.status().socket_directory.stat().st_mode & 0o777 == 0o700
    assert ask(cluster, "SELECT 1") == 1
    cluster.down()
    cluster.up()
    assert cluster.dsn() == dsn
    assert ask(cluster, "SELECT 1") == 1
    cluster.down()


def test_a_home_with_spaces_and_quotes_holds_its_socket(home: Callable[[str], Path]) -> None:
    cluster = Cluster(home=home("the robot's & mine; (100%)"), settings=QUICK)
    cluster.up()
    cluster.up()
    assert cluster.status().running
    assert cluster.status().socket_directory.parent == cluster.home
    assert ask(cluster, "SELECT 1") == 1


@pytest.mark.parametrize("character", ["$", "`", '"', "\\", "\n"])
def test_a_home_that_a_shell_would_misread_is_refused(place: Path, character: str) -> None:
    with pytest.raises(ClusterError, match="set ELM_HOME to one without"):
        Cluster(home=place / f"odd{character}home")


def test_the_end_of_the_log_is_shown_when_the_server_does_not_start(cluster: Cluster) -> None:
    cluster.down()
    with pytest.raises(ClusterError, match='unrecognized configuration parameter "no_such_setting"'):
        Cluster(home=cluster.home, settings={"no_such_setting": "1"}).up()
    cluster.up()
    assert ask(cluster, "SELECT 1") == 1


def test_a_long_log_makes_room(cluster: Cluster) -> None:
    cluster.down()
    log = cluster.status().log_file
    os.truncate(log, 10_000_001)
    cluster.up()
    assert log.stat().st_size < 10_000
    assert log.with_name("server.log.1").stat().st_size == 10_000_001


def test_data_of_a_version_that_is_not_installed_are_named(place: Path) -> None:
    data = place / "future" / "data"
    data.mkdir(parents=True)
    (data / "PG_VERSION").write_text("99\n")
    cluster = Cluster(home=data.parent)
    with pytest.raises(ClusterError, match=r"made by PostgreSQL 99, which is not installed"):
        cluster.up()
    assert cluster.status().version == "99"


def test_the_home_is_the_users_choice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ELM_HOME", str(tmp_path / "mine"))
    assert Cluster.default().home == tmp_path / "mine"
    monkeypatch.delenv("ELM_HOME")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    assert Cluster.default().home == (Path("/var/lib/elm") if AS_ROOT else tmp_path / "share" / "elm")


def test_importing_it_does_not_load_the_driver() -> None:
    done = run_python("import sys, elm.storage.cluster; print('psycopg' in sys.modules)")
    assert (done.stdout, done.stderr) == ("False\n", "")


@needs_root
def test_root_steps_down(cluster: Cluster) -> None:
    cluster.up()
    pid = cluster.status().pid
    assert Path(f"/proc/{pid}").stat().st_uid == ServerAccount.unprivileged().uid != 0


@needs_root
def test_an_ordinary_user_runs_a_cluster_of_its_own(home: Callable[[str], Path]) -> None:
    mine = home("nobodys")
    mine.mkdir()
    shutil.chown(mine, "nobody")
    life = UP + "cluster.down(); cluster.up(); print(oct(os.stat(sys.argv[1] + '/data').st_mode))"
    done = run_python(ENTER + BECOME_NOBODY + life, mine)
    assert (done.stderr, done.returncode) == ("", 0)
    assert done.stdout.endswith("0o40700\n")
    assert {entry.owner() for entry in mine.iterdir()} == {"nobody"}
    # Root keeps it that user's.
    cluster = Cluster(home=mine, settings=QUICK)
    cluster.down()
    cluster.up()
    assert ask(cluster, "SELECT 1") == 1
    assert Path(f"/proc/{cluster.status().pid}").owner() == "nobody"


def fails_as_nobody(home: Path) -> str:
    script = "Cluster(home=sys.argv[1]).up()"
    done = run_python(ENTER + BECOME_NOBODY + script, home)
    assert done.returncode == 1
    return done.stderr.splitlines()[-1]


@needs_root
def test_a_cluster_of_somebody_else_is_refused(cluster: Cluster) -> None:
    cluster.up()
    owner = ServerAccount.unprivileged().name
    said = fails_as_nobody(cluster.home)
    assert f"belongs to user `{owner}`. Run elm as that user or as root, or set ELM_HOME" in said


@needs_root
def test_a_home_that_cannot_be_written_is_named(place: Path) -> None:
    said = fails_as_nobody(place / "denied")
    assert f"The cluster's directory {place / 'denied'} cannot be used: [Errno 13] Permission denied" in said
    assert "Set ELM_HOME to a directory that you can write" in said


@needs_root
def test_a_home_that_the_server_cannot_enter_is_named(place: Path) -> None:
    closed = place / "closed"
    closed.mkdir(mode=0o700)
    with pytest.raises(ClusterError, match=rf"may not enter {closed} .*chmod o\+x {closed}"):
        Cluster(home=closed / "deep" / "home").up()
    assert list(closed.iterdir()) == []


@needs_root
def test_a_home_made_by_root_with_a_strict_umask_can_be_entered(home: Callable[[str], Path]) -> None:
    strict = home("strict") / "home"
    done = run_python("import os\nos.umask(0o077)\n" + ENTER + UP, strict)
    assert (done.stderr, done.returncode) == ("", 0)
    Cluster(home=strict).down()


@needs_root
def test_a_root_without_rights_is_told(place: Path) -> None:
    setpriv = shutil.which("setpriv") or pytest.skip("setpriv is not installed")
    script = ENTER + "Cluster(home=sys.argv[1]).up()"
    done = run_python(script, place / "bounded", under=[setpriv, "--bounding-set", "-setuid,-setgid"])
    assert done.returncode == 1
    assert "this root may not switch to user" in done.stderr.splitlines()[-1]


def up_without(directory: Path, home: Path) -> str:
    """What `up` says where this directory is empty: in a mount namespace of its own."""
    hide = ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs none "$0" && exec "$@"', str(directory)]
    if not shutil.which("unshare") or subprocess.run([*hide, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this machine does not allow mount namespaces")
    done = run_python(ENTER + "Cluster(home=sys.argv[1]).up()", home, under=hide)
    assert done.returncode == 1
    assert not home.exists()
    return done.stderr.splitlines()[-1]


@needs_root
def test_missing_programs_are_named_with_the_command_that_installs_them(place: Path) -> None:
    programs = {each.programs for each in find_installations(ServerAccount.unprivileged())}
    if {each.parent.parent for each in programs} != {Path("/usr/lib/postgresql")}:
        pytest.skip("PostgreSQL is not where Debian has it")
    said = up_without(Path("/usr/lib/postgresql"), place / "bare")
    assert "No PostgreSQL server with PostGIS is installed on this machine." in said
    assert "apt-get install postgresql-" in said
    assert "ELM_DSN" in said


@needs_root
def test_missing_postgis_is_named_with_the_command_that_installs_it(place: Path) -> None:
    installations = find_installations(ServerAccount.unprivileged())
    if len(installations) != 1 or not shutil.which("apt-get"):
        pytest.skip("for a Debian machine with one PostgreSQL")
    (only,) = installations
    said = up_without(only.share / "extension", place / "plain")
    assert f"PostgreSQL {only.version} in {only.programs} lacks the extensions postgis and btree_gist." in said
    assert f"`apt-get install postgresql-{only.major}-postgis-3`" in said
