"""A role that only reads, as docs/cli.md grants it: what it may ask for, and that all else is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator

import psycopg
import pytest
from psycopg.conninfo import make_conninfo

import elm
from elm.errors import DatabaseUnfit
from tests.cli.conftest import Program, told
from tests.cli.samples import EVENTS, TYPES
from tests.pages import Page

PAGE = Page("docs/cli.md")

pytestmark = pytest.mark.skipif(not PAGE.exists, reason="the documents are not beside the installed package")


@pytest.fixture
def visitor(program: Program) -> Iterator[Program]:
    """`elm` as the role of the page, in a memory with the samples."""
    owner = program.having(ELM_MEMORY="kitchen")
    dsn = owner.settings["ELM_DSN"]
    assert owner.here("types", "load", "-", stdin=told(TYPES)).returncode == 0
    assert owner.here("load", "-", stdin=told(EVENTS)).returncode == 0
    with psycopg.connect(dsn, autocommit=True) as connection:
        (grants,) = PAGE.blocks("sql", "A role that only reads")
        connection.execute(grants.encode())
        try:
            yield owner.having(ELM_DSN=make_conninfo(dsn, user="visitor"))
        finally:
            connection.execute("DROP OWNED BY visitor")
            connection.execute("DROP ROLE visitor")
            connection.execute("DROP SCHEMA kitchen CASCADE")


def test_it_may_do_all_that_changes_nothing(visitor: Program) -> None:
    for command in (
        ("recall",),
        ("count",),
        ("show", "1"),
        ("tree", "1"),
        ("stats",),
        ("types", "tree"),
        ("export",),
        ("forget", "--dry-run", "--type", "Drive"),
        ("recognize", "status"),
    ):
        done = visitor.here(*command)
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert json.loads(visitor.here("count").stdout) == len(EVENTS)


def test_all_else_is_refused(visitor: Program) -> None:
    (visitor.directory / "sessions.py").write_text(
        "from datetime import timedelta\nfrom elm import cues\nfrom elm.recognizers import Session\n"
        "each = Session(name='s', version=1, type='S', cue=cues.everything(), gap=timedelta(1))\n"
    )
    for command in (
        ("types", "add", "Other"),
        ("load", "-"),
        ("forget", "--yes", "--type", "Drive"),
        ("recognize", "run", "--once", "--from", "sessions.py"),
    ):
        done = visitor.here(*command, stdin=told(EVENTS))
        assert done.returncode == 1, command
        assert "lacks rights for memory 'kitchen'" in done.stderr, command


def test_its_subscriptions_see_what_has_entered_the_log(visitor: Program, program: Program) -> None:
    with (
        elm.connect(visitor.settings["ELM_DSN"], "kitchen") as memory,
        elm.connect(program.settings["ELM_DSN"], "kitchen") as owner,
    ):
        assert list(memory.subscribe(since=0, timeout=0)) == []
        assert owner.log.head() == len(EVENTS)
        assert {event.uid for event in memory.subscribe(since=0, timeout=0)} == {event.uid for event in memory.recall()}
        with pytest.raises(DatabaseUnfit, match="lacks rights for memory 'kitchen'"):
            memory.subscribe(name="visitor")
