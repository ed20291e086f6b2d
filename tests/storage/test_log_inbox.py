"""What the inbox of the log receives: one row for each new event and for each close, in an order with parts first."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID, uuid4

import psycopg
import pytest

from elm.errors import ElmError
from elm.event import Event
from elm.storage.postgres import PostgresStore
from elm.storage.tables import LOG_CLOSE, LOG_COMMIT, LOG_OPEN
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.servers import MEMORY
from tests.stories import story


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A row of the inbox, with the uid of its event."""

    uid: UUID
    kind: int
    agent: str | None


_ROWS = """
SELECT e.uid, kind, l.agent, deadline, at FROM log_inbox l LEFT JOIN event e ON e.id = event_id ORDER BY n
"""


class Inbox:
    """One memory, and what stands in the inbox of its log."""

    def __init__(self, dsn: str) -> None:
        self.store = PostgresStore(dsn, MEMORY)
        self.store.add_types([EventType(name="Thing")])
        self._watch = psycopg.connect(dsn, autocommit=True, options=f"-c search_path={MEMORY}")

    def commit(self, *events: Event) -> None:
        self.store.commit_all([Arrival(event=event) for event in events])

    def entries(self) -> list[Entry]:
        """All rows, in order."""
        return [Entry(uid=uid, kind=kind, agent=agent) for uid, kind, agent, *_ in self.rows()]

    def rows(self) -> list[tuple[Any, ...]]:
        """Of each row, in order: the event's uid, the kind, the agent, the deadline, and when it was written."""
        return self._watch.execute(_ROWS).fetchall()

    def close(self) -> None:
        self.store.close()
        self._watch.close()


@pytest.fixture
def inbox(dsn: str) -> Iterator[Inbox]:
    found = Inbox(dsn)
    yield found
    found.close()


def thing(*parts: Event, agent: str | None = None, end: float | None = 1) -> Event:
    """An event, complex when it is given parts."""
    if parts:
        return Event(type="Thing", parts=[part.uid for part in parts], agent=agent)
    return Event(type="Thing", interval=span(0, end), agent=agent)


def committed(*events: Event) -> list[Entry]:
    """The entries of events that had ended, or that are atomic and still go on."""
    return [Entry(uid=event.uid, kind=_kind(event), agent=event.agent) for event in events]


def _kind(event: Event) -> int:
    return LOG_OPEN if event.interval is not None and event.interval.is_open else LOG_COMMIT


Write = Callable[[PostgresStore, Sequence[Event]], object]
WRITES: dict[str, Write] = {
    "commit": lambda store, events: [store.commit(Arrival(event=event)) for event in events],
    "commit_all": lambda store, events: store.commit_all([Arrival(event=event) for event in events]),
    "load": lambda store, events: store.load([Arrival(event=event) for event in events]),
}


@pytest.fixture(params=WRITES)
def write(request: pytest.FixtureRequest) -> Write:
    return WRITES[request.param]


def test_types_leave_no_entry(inbox: Inbox) -> None:
    assert inbox.entries() == []


def test_each_new_event_has_one_entry(inbox: Inbox, write: Write) -> None:
    events = [thing(), thing(agent="armar6"), thing(end=None, agent="armar7"), thing(agent="ärger 'n")]
    write(inbox.store, events)
    assert inbox.entries() == committed(*events)
    assert [row[3] for row in inbox.rows()] == [None] * 4


def test_complex_event_has_one_entry_after_its_parts(inbox: Inbox, write: Write) -> None:
    parts = [thing(agent="armar6"), thing()]
    over = thing(*parts, agent="armar7")
    top = thing(over, parts[0], agent="armar7")
    write(inbox.store, [*parts, over, top])
    entries = inbox.entries()
    assert sorted(entries, key=lambda each: each.uid) == sorted(committed(*parts, over, top), key=lambda each: each.uid)
    assert [each.uid for each in entries][2:] == [over.uid, top.uid]


def test_entry_has_the_agent_that_derives(inbox: Inbox, write: Write) -> None:
    parts = [thing(agent="armar6"), thing(agent="armar6")]
    over = thing(*parts)
    write(inbox.store, [*parts, over])
    assert inbox.entries()[-1] == Entry(uid=over.uid, kind=LOG_COMMIT, agent="armar6")


def test_entry_says_whether_the_event_was_open_when_it_came(inbox: Inbox, write: Write) -> None:
    """Of a complex event that derives; what it has become since makes no difference."""
    ended, going_on = thing(), thing(end=None)
    over, above, closed = thing(ended, going_on), thing(), thing(ended)
    top = thing(over, closed)
    events = [ended, going_on, over, above, closed, top]
    write(inbox.store, events)
    inbox.store.close_event(going_on.uid, at(5))
    kinds = {(each.uid, each.kind) for each in inbox.entries()}
    opened = {going_on.uid, over.uid, top.uid}
    assert kinds == {(event.uid, LOG_OPEN if event.uid in opened else LOG_COMMIT) for event in events} | {
        (uid, LOG_CLOSE) for uid in opened
    }


def test_whole_that_is_committed_after_its_part_closed_was_never_open(inbox: Inbox, write: Write) -> None:
    part = thing(end=None)
    inbox.commit(part)
    inbox.store.close_event(part.uid, at(5))
    write(inbox.store, [thing(part)])
    assert [each.kind for each in inbox.entries()] == [LOG_OPEN, LOG_CLOSE, LOG_COMMIT]


def test_repeated_commit_leaves_no_entry(inbox: Inbox, write: Write) -> None:
    parts = [thing(), thing(end=None)]
    events = [*parts, thing(*parts)]
    inbox.commit(*events)
    before = inbox.entries()
    for again in WRITES.values():
        again(inbox.store, events)
    write(inbox.store, [events[0], events[0]])
    assert inbox.entries() == before
    assert len(before) == 3


def test_only_the_new_events_of_a_call_have_entries(inbox: Inbox, write: Write) -> None:
    old, new = thing(), thing()
    inbox.commit(old)
    write(inbox.store, [old, new, thing(old, new)])
    assert len(inbox.entries()) == 3
    assert inbox.entries()[:2] == committed(old, new)


def test_refused_events_leave_no_entry(inbox: Inbox, write: Write) -> None:
    kept = thing()
    inbox.commit(kept)
    other = Event(type="Thing", interval=span(0, 2), uid=kept.uid)
    orphan = Event(type="Thing", parts=[uuid4()])
    untyped = Event(type="Nothing", interval=span(0, 1))
    for event in (other, orphan, untyped):
        with suppress(ElmError):
            write(inbox.store, [event])
    assert inbox.entries() == committed(kept)


def test_refused_call_leaves_nothing(inbox: Inbox) -> None:
    with pytest.raises(ElmError):
        inbox.commit(thing(), Event(type="Thing", parts=[uuid4()]))
    assert inbox.entries() == []


def test_load_leaves_entries_for_what_it_keeps(inbox: Inbox) -> None:
    kept = [thing(), thing()]
    untyped = Event(type="Nothing", interval=span(0, 1))
    report = inbox.store.load([Arrival(event=event) for event in (kept[0], untyped, kept[1])])
    assert (report.new, len(report.refused)) == (2, 1)
    assert inbox.entries() == committed(*kept)


def test_entry_is_dated_when_it_is_written(inbox: Inbox, write: Write) -> None:
    event = thing()
    before = datetime.now(UTC)
    write(inbox.store, [event])
    inbox.store.load([Arrival(event=thing(), recorded_at=at(0))])
    inbox.store.commit(Arrival(event=thing(), recorded_at=at(0)))
    open_event = thing(end=None)
    inbox.commit(open_event)
    inbox.store.close_event(open_event.uid, at(5))
    times = [row[4] for row in inbox.rows()]
    assert len(times) == 5
    assert all(before - timedelta(seconds=1) <= moment <= datetime.now(UTC) for moment in times)
    assert times == sorted(times)


def test_close_has_one_entry_for_the_event(inbox: Inbox) -> None:
    event = thing(end=None, agent="armar6")
    inbox.commit(event)
    inbox.store.close_event(event.uid, at(2))
    assert inbox.entries()[1:] == [Entry(uid=event.uid, kind=LOG_CLOSE, agent="armar6")]


def test_repeated_or_refused_close_leaves_no_entry(inbox: Inbox) -> None:
    event = thing(end=None)
    over = thing(event)
    inbox.commit(event, over)
    inbox.store.close_event(event.uid, at(2))
    before = inbox.entries()
    assert not inbox.store.close_event(event.uid, at(2)).new
    for uid, end in ((event.uid, at(3)), (over.uid, at(2)), (uuid4(), at(2)), (event.uid, at(-1))):
        with pytest.raises(ElmError):
            inbox.store.close_event(uid, end)
    assert inbox.entries() == before


def test_close_has_one_entry_for_each_whole_that_closes_by_it(inbox: Inbox) -> None:
    first, second = thing(end=None, agent="a"), thing(end=None, agent="b")
    ended = thing()
    closes_now = thing(first, ended, agent="c")
    waits = thing(first, second)
    top = thing(closes_now)
    inbox.commit(first, second, ended, closes_now, waits, top)
    written = len(inbox.entries())
    inbox.store.close_event(first.uid, at(2))
    assert inbox.entries()[written:] == [
        Entry(uid=first.uid, kind=LOG_CLOSE, agent="a"),
        Entry(uid=closes_now.uid, kind=LOG_CLOSE, agent="c"),
        Entry(uid=top.uid, kind=LOG_CLOSE, agent="c"),
    ]
    inbox.store.close_event(second.uid, at(3))
    assert inbox.entries()[written + 3 :] == [
        Entry(uid=second.uid, kind=LOG_CLOSE, agent="b"),
        Entry(uid=waits.uid, kind=LOG_CLOSE, agent=None),
    ]


@pytest.mark.parametrize("seed", range(3))
def test_parts_stand_before_their_wholes(inbox: Inbox, seed: int) -> None:
    """Of each kind there is one entry for an event, behind those of its parts, and closes stand behind commits."""
    chance = random.Random(seed)
    events = story(chance, thing)
    for number, event in enumerate(events, start=1):
        again = chance.randrange(4)
        chance.choice(list(WRITES.values()))(inbox.store, [*events[max(0, number - 1 - again) : number - 1], event])
    going_on = {event.uid for event in events if event.interval and event.interval.is_open}
    for uid in chance.sample(sorted(going_on), len(going_on)):
        inbox.store.close_event(uid, at(9))
    for event in events:
        if going_on.intersection(event.parts):
            going_on.add(event.uid)
    kinds = [(each.uid, each.kind) for each in inbox.entries()]
    place = {known: number for number, known in enumerate(kinds)}
    assert len(place) == len(kinds)
    came = {uid: number for (uid, kind), number in place.items() if kind != LOG_CLOSE}
    assert came.keys() == {event.uid for event in events}
    assert len(came) == sum(kind != LOG_CLOSE for _, kind in kinds)
    assert {uid for uid, kind in kinds if kind == LOG_OPEN} == going_on
    assert {uid for uid, kind in kinds if kind == LOG_CLOSE} == going_on
    for event in events:
        assert all(came[part] < came[event.uid] for part in event.parts)
    for uid in going_on:
        assert came[uid] < place[uid, LOG_CLOSE]
    for event in events:
        closing = going_on.intersection(event.parts)
        assert all(place[part, LOG_CLOSE] < place[event.uid, LOG_CLOSE] for part in closing)
