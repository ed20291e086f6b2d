"""How many pages a first look touches where nearly all events are alike, read from the plans that the server ran."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any, assert_never
from uuid import UUID

import pytest
from psycopg.errors import Diagnostic

from elm import cues
from elm.cues.algebra import Cue
from elm.cues.relations import Place, SetRelation
from elm.event import Event, Payload
from elm.geometry import Region, SpatialRelation
from elm.interval import AllenRelation, Interval
from elm.query import Cursor, Nearest, Order, Query
from elm.storage import first_look, hints, recall_statements
from elm.storage.connections import Connection
from elm.storage.first_look import Look
from elm.storage.memory import MemoryStore
from elm.storage.planning import Planning
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.servers import MEMORY, Server

EVENTS, RARE = 20_000, 10
"""Of so many events so many are unlike the others in one thing, and as many in all things."""
_SECOND = timedelta(seconds=1)
_START = datetime(2026, 3, 1, tzinfo=UTC)
_NEVER = _START - timedelta(days=900)


# Events of which nearly all have this, a few have that, and none has the third


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """A value for each thing that a cue may ask about."""

    type: str
    interval: Interval
    region: Region
    subject: Region
    features: tuple[tuple[str, Any], ...]
    agent: str
    payload: bytes
    recorded_at: datetime


COMMON = Said(
    type="Common",
    interval=Interval(begin=_START, end=_START + _SECOND),
    region=Region.box(0, 0, 2, 2),
    subject=Region.box(10, 0, 12, 2),
    features=(("object", "cup"), ("speed", 0.5)),
    agent="robot",
    payload=b"common",
    recorded_at=_START + timedelta(days=9),
)
RARELY = Said(
    type="Rare",
    interval=Interval(begin=_START + timedelta(days=1), end=_START + timedelta(days=1) + _SECOND),
    region=Region.box(0, 0, 2, 2, frame="annex"),
    subject=Region.box(10, 0, 12, 2, frame="annex"),
    features=(("object", "pot"), ("weight", 3)),
    agent="rover",
    payload=b"rare",
    recorded_at=_START + timedelta(days=10),
)
ABSENT = Said(
    type="Absent",
    interval=Interval(begin=_NEVER, end=_NEVER + _SECOND),
    region=Region.box(0, 0, 2, 2, frame="attic"),
    subject=Region.box(10, 0, 12, 2, frame="attic"),
    features=(("smell", "none"),),
    agent="nobody",
    payload=b"absent",
    recorded_at=_NEVER,
)
SAID: Mapping[str, Said] = {"common": COMMON, "rare": RARELY, "absent": ABSENT}
FAR, WIDE, INNER = Region.box(500, 500, 501, 501), Region.box(-99, -99, 9_999, 99), Region.box(0.5, 0.5, 1, 1)
"""Polygons in the frame that nearly all events are in: away from them, around them all, within the common one."""
LONG = Interval(begin=_START - timedelta(days=99), end=_START + timedelta(days=99))

_COMPONENTS: Mapping[str, Callable[[Said], Mapping[str, Any]]] = {
    "type": lambda said: {"type": said.type},
    "time": lambda said: {"interval": said.interval},
    "region": lambda said: {"region": said.region},
    "subject": lambda said: {"subject": said.subject},
    "features": lambda said: {"features": said.features},
    "agent": lambda said: {"agent": said.agent},
    "payload": lambda said: {"payload": Payload(data=said.payload)},
}


def _like(said: Said) -> dict[str, Any]:
    return {name: value for of in _COMPONENTS.values() for name, value in of(said).items()}


def _uid(number: int) -> UUID:
    return UUID(int=(7 << 76) | (2 << 62) | number)


def _alike(number: int) -> dict[str, Any]:
    """All the same."""
    return _like(COMMON)


def _lacking(number: int) -> dict[str, Any]:
    """A type and one of two periods, and nothing else."""
    period = Interval(begin=_START + number % 2 * _SECOND, end=_START + 2 * _SECOND)
    return {"type": "Common", "interval": period if number % 2 else COMMON.interval}


def _spread(number: int) -> dict[str, Any]:
    """One after the other, along a path; half of them never end, and half have an agent."""
    begin = _START + number * _SECOND
    return {
        "type": "Third" if number % 33 == 0 else "Common",
        "interval": Interval.since(begin) if number % 2 else Interval(begin=begin, end=begin + _SECOND / 2),
        "region": Region.box(number / 10, 0, number / 10 + 1, 1),
        "subject": Region.box(number / 10, 5, number / 10 + 1, 6) if number % 3 else None,
        "features": (("object", f"thing {number % 50}"), ("speed", number % 7 / 2)),
        "agent": "robot" if number % 2 else None,
        "payload": None if number % 3 else Payload(data=b"common"),
    }


def _life(usual: Callable[[int], dict[str, Any]]) -> Iterator[Arrival]:
    """The usual, and in the midst of it the rare, each in one thing only, then in all; one lasts, some never end."""
    middle = EVENTS // 2
    rare: dict[int, Mapping[str, Any]] = {}
    for place, of in enumerate([*_COMPONENTS.values(), _like]):
        rare |= {middle + place * RARE + each: of(RARELY) for each in range(RARE)}
    rare |= {middle + 500 + each: {"interval": Interval.since(_START)} for each in range(RARE)}
    rare[middle + 600] = {"interval": LONG}
    for number in range(EVENTS):
        event = Event(**{**usual(number), **rare.get(number, {})}, uid=_uid(number))
        late = middle + 700 <= number < middle + 700 + RARE
        yield Arrival(event=event, recorded_at=RARELY.recorded_at if late else COMMON.recorded_at)


# Memories of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Skewed:
    """A memory, one in this process with the same events, and the plans that were run."""

    store: PostgresStore
    same: MemoryStore
    plans: list[dict[str, Any]] = field(default_factory=list)
    _watched: set[int] = field(default_factory=set)
    _matching: dict[Cue, list[int]] = field(default_factory=dict)

    def matching(self, query: Query) -> list[int]:
        """The ids of the answer, by the meaning of the cue in Python."""
        if isinstance(query.order, Nearest) or query.after is not None:
            return [*self.same.ids(query)]
        if query.cue not in self._matching:
            self._matching[query.cue] = [*self.same.ids(Query(cue=query.cue))]
        ids = self._matching[query.cue]
        if query.order is Order.ID:
            return sorted(ids)[: query.limit]
        return (ids[::-1] if query.order is Order.BEGIN_REVERSED else ids)[: query.limit]

    @contextmanager
    def recalling(self, planning: Planning) -> Iterator[Connection]:
        """A connection of the store itself; it tells the plan of each statement that it runs."""
        with self.store._connections.recalling(planning) as connection:
            if id(connection) not in self._watched:
                self._watched.add(id(connection))
                connection.execute(_TELL_PLANS)
                connection.add_notice_handler(self._keep)
            yield connection

    def _keep(self, said: Diagnostic) -> None:
        message = said.message_primary or ""
        if "plan:" in message:
            self.plans.append(json.loads(message[message.index("{") :])["Plan"])


_TEXTS = recall_statements.StatementCache()
"""The statements of all these memories: their tables are the same, so each is built once."""
_TEXTS.MOST = 100_000
_TELL_PLANS = """
LOAD 'auto_explain'; SET auto_explain.log_min_duration = 0; SET auto_explain.log_analyze = on;
SET auto_explain.log_buffers = on; SET auto_explain.log_timing = off; SET auto_explain.log_format = 'json';
SET log_min_messages = 'panic'; SET client_min_messages = 'log'
"""

_TYPES = [
    EventType(name="Thing"),
    EventType(name="Common", parents=("Thing",)),
    EventType(name="Third", parents=("Thing",)),
    EventType(name="Rarity", parents=("Thing",)),
    EventType(name="Rare", parents=("Rarity",)),
    EventType(name="Nothing"),
    EventType(name="Absent", parents=("Nothing",)),
]


@contextmanager
def _remembered(server: Server, usual: Callable[[int], dict[str, Any]], *, young: bool = False) -> Iterator[Skewed]:
    with server.database() as dsn:
        store, same = PostgresStore(dsn, MEMORY), MemoryStore()
        store._session.statements = _TEXTS
        skewed = Skewed(store=store, same=same)
        for each in (store, same):
            each.add_types(_TYPES)
        if young:
            with store._connections.writing() as connection:
                connection.execute("ALTER TABLE event SET (autovacuum_enabled = off)")
            # Asked of an empty memory: those plans stay while nobody tells the server what came in.
            for cue in [*_simple(COMMON).values()]:
                for limit in (None, 10):
                    assert [*store.ids(Query(cue=cue, limit=limit))] == []
        arrivals = [*_life(usual)]
        for first in range(0, EVENTS, 10_000):
            store.load(arrivals[first : first + 10_000])
            same.load(arrivals[first : first + 10_000])
        if not young:
            with store._connections.writing() as connection:
                connection.execute("VACUUM (ANALYZE) event, part")
        assert [*store.ids(Query(order=Order.ID))] == [*same.ids(Query(order=Order.ID))]
        yield skewed
        store.close()
        same.close()


@pytest.fixture(scope="module")
def alike(postgres_server: Server) -> Iterator[Skewed]:
    with _remembered(postgres_server, _alike) as skewed:
        yield skewed


@pytest.fixture(scope="module")
def lacking(postgres_server: Server) -> Iterator[Skewed]:
    with _remembered(postgres_server, _lacking) as skewed:
        yield skewed


@pytest.fixture(scope="module")
def spread(postgres_server: Server) -> Iterator[Skewed]:
    with _remembered(postgres_server, _spread) as skewed:
        yield skewed


@pytest.fixture(scope="module")
def young(postgres_server: Server) -> Iterator[Skewed]:
    """Of which the server has no statistics at all."""
    with _remembered(postgres_server, _alike, young=True) as skewed:
        yield skewed


MEMORIES = ("alike", "lacking", "spread", "young")


# What is asked


_SETS = (SetRelation.EQUAL, SetRelation.SUBSET, SetRelation.SUPERSET, SetRelation.INTERSECTS)
_LITTLE = timedelta(milliseconds=1)


def _simple(said: Said) -> dict[str, Cue]:
    """One cue for each thing."""
    return {
        "type": cues.exactly(said.type),
        "time": cues.time("intersects", said.interval),
        "time equal": cues.time("equal", said.interval),
        "region": cues.region("intersects", said.region),
        "subject": cues.subject("intersects", said.subject),
        "features": cues.features("equal", said.features),
        "feature": cues.feature(said.features[0][0], "=", said.features[0][1]),
        "agent": cues.agent(said.agent),
        "payload": cues.payload(said.payload),
        "recorded": cues.recorded("subset", said.recorded_at, said.recorded_at + _SECOND),
    }


def _each() -> dict[str, Cue]:
    return {f"{how} {name}": cue for how, said in SAID.items() for name, cue in _simple(said).items()}


_WINDOWS: Mapping[str, tuple[datetime | None, datetime | None]] = {
    "all": (LONG.begin, LONG.end),
    "until": (None, COMMON.interval.end),
    "since": (COMMON.interval.begin, None),
    "inside": (_START + _LITTLE, _START + _SECOND - _LITTLE),
    "common begin": (_START, _START),
    **{how: (said.interval.begin, said.interval.end) for how, said in SAID.items()},
}


def _by(name: str, ask: Callable[..., Cue], relations: Iterable[str], values: Mapping[str, Any]) -> dict[str, Cue]:
    """Cues of several relations to several values."""
    return {f"{name} {relation} {how}": ask(relation, value) for relation in relations for how, value in values.items()}


def _times(relations: Iterable[str]) -> dict[str, Cue]:
    return _by("time", lambda relation, window: cues.time(relation, *window), relations, _WINDOWS)


def _recorded() -> dict[str, Cue]:
    windows: dict[str, tuple[datetime | None, datetime | None]] = {}
    for how, said in SAID.items():
        at = said.recorded_at
        windows |= {f"both {how}": (at, at), f"since {how}": (at, None), f"until {how}": (None, at)}
    windows["both around"] = COMMON.recorded_at - _SECOND, COMMON.recorded_at + _SECOND
    relations = [*_SETS, AllenRelation.BEFORE, AllenRelation.MEETS, AllenRelation.DURING, AllenRelation.FINISHES]
    return _by("recorded", lambda relation, window: cues.recorded(relation, *window), relations, windows)


def _places() -> dict[str, Cue]:
    relations = [each for each in SpatialRelation if each is not SpatialRelation.WITHIN_DISTANCE]
    regions = {how: said.region for how, said in SAID.items()}
    subjects = {how: said.subject for how, said in SAID.items()}
    return {
        **_by("region", cues.region, relations, {"far": FAR, "wide": WIDE, "inner": INNER, **regions}),
        **_by("subject", cues.subject, relations, subjects),
        **{f"region within {how}": cues.within(0.1, place) for how, place in regions.items()},
        **{f"subject within {how}": cues.subject_within(0.1, place) for how, place in subjects.items()},
    }


def _sets() -> dict[str, Cue]:
    given = {how: said.features for how, said in SAID.items()} | {"none": ()}
    names = {how: [name for name, _ in features] for how, features in given.items()}
    return {**_by("features", cues.features, _SETS, given), **_by("names", cues.feature_names, _SETS, names)}


def _types() -> dict[str, Cue]:
    asked = {f"exactly {name}": cues.exactly(name) for name in ("Common", "Third", "Rare", "Absent")}
    names = ("Thing", "Common", "Third", "Rarity", "Rare", "Nothing", "Absent")
    return {**asked, **{f"is_a {name}": cues.is_a(name) for name in names}}


def _together() -> dict[str, Cue]:
    """Two conditions, the first common and the last rare or absent, and the other way round; some of three."""
    asked: dict[str, Cue] = {}
    common = _simple(COMMON)
    names = [*common]
    for how in ("rare", "absent"):
        rare = _simple(SAID[how])
        for place, last in enumerate(names):
            first, second, third = (names[place - back] for back in (1, 3, 4))
            asked[f"common {first} & {how} {last}"] = common[first] & rare[last]
            asked[f"{how} {last} & common {second}"] = rare[last] & common[second]
            asked[f"common {first} & {third} & {how} {last}"] = common[first] & common[third] & rare[last]
    named = cues.uid(*(_uid(number) for number in range(0, EVENTS, EVENTS // 20)))
    asked |= {f"uid & {name}": named & cue for name, cue in _each().items()}
    asked["all of common"] = cues.all_of(*common.values())
    asked["agent & duration"] = common["agent"] & cues.lasting(">", timedelta(days=9))
    asked["agent & is_a"] = common["agent"] & cues.is_a("Rarity")
    asked["agent & not"] = common["agent"] & ~common["time"]
    return asked


_ALL = ((Order.BEGIN, 1), (Order.BEGIN, 100), (Order.BEGIN, None), (Order.BEGIN_REVERSED, 10))
_SOME = ((Order.BEGIN, None), (Order.BEGIN_REVERSED, 100))
ASKED: Mapping[str, tuple[Callable[[], Mapping[str, Cue]], tuple[tuple[Order, int | None], ...]]] = {
    "each": (_each, _ALL),
    "types": (_types, _ALL),
    "time, sets": (lambda: _times(_SETS), _SOME),
    "time, Allen": (lambda: _times(AllenRelation), _SOME),
    "recorded": (_recorded, _SOME),
    "places": (_places, _SOME),
    "sets": (_sets, _SOME),
    "together": (_together, _SOME),
}


# What it costs


@dataclass(frozen=True, slots=True, kw_only=True)
class Looked:
    """What a look touched, and the ids that it gave if it answered."""

    look: Look
    pages: int
    answer: list[int] | None
    plan: dict[str, Any]


def _looked(skewed: Skewed, query: Query) -> Iterator[Looked]:
    """The looks that a query has, as the session takes them; also those after one that answers."""
    session = skewed.store._session
    compiled = session.compiled(query.cue)
    pinned, near = hints.of_query(query)
    values = {**compiled.values, **recall_statements.parameters(query, near=near), **first_look.parameters(query)}
    seen = 0
    for look in first_look.looks(compiled, query):
        if not first_look.is_worth(look, seen):
            continue
        shape = (first_look.is_small(query), recall_statements.shape(query, pinned=pinned, near=near))
        key = ("look", look, compiled.key, shape)
        build = partial(first_look.look_for, look, compiled, query, recall_statements.columns, near=near)
        text = session.statements.text(key, build)
        with skewed.recalling(look.planning) as connection:
            skewed.plans.clear()
            rows = connection.execute(text, values, prepare=look.planning.prepare, binary=True).fetchall()
            (plan,) = skewed.plans
        answer = [row[0] for row in rows if row[0] is not None] if not rows or rows[0][-1] is None else None
        seen = len(answer) if answer is not None else rows[0][-1]
        yield Looked(look=look, pages=plan["Shared Hit Blocks"] + plan["Shared Read Blocks"], answer=answer, plan=plan)


def _indexes(plan: dict[str, Any]) -> set[str]:
    """By what indexes and tables it was found, for a test to say."""
    own = {plan[key] for key in ("Index Name", "Relation Name") if key in plan}
    return own.union(*map(_indexes, plan.get("Plans", ())))


def _most(look: Look, query: Query, conditions: int) -> int:
    match look:
        case Look.AT_FEW:
            return 700 * conditions
        case Look.IN_ORDER:
            return 6_000 if query.limit == first_look.FEW else 2_000
        case Look.ALONG_INDEX | Look.BY_PLAN | Look.BY_LISTS:
            return 700
        case unknown:
            assert_never(unknown)


_BRIEFLY = ("each", "types")
_CASES = [
    *(("alike", asked) for asked in ASKED),
    *((memory, asked) for memory in MEMORIES[1:] for asked in _BRIEFLY),
    ("young", "time, Allen"),
]


@pytest.mark.parametrize(("memory", "asked"), _CASES)
def test_looks_are_bounded_and_right(request: pytest.FixtureRequest, memory: str, asked: str) -> None:
    skewed: Skewed = request.getfixturevalue(memory)
    ask, ways = ASKED[asked]
    excesses, wrong = [], []
    for name, cue in ask().items():
        for order, limit in ways:
            query = Query(cue=cue, order=order, limit=limit)
            conditions = len(skewed.store._session.compiled(cue).looks)
            for looked in _looked(skewed, query):
                said = f"{name}, {order} {limit}: {looked.look.value}"
                if looked.pages > _most(looked.look, query, conditions):
                    excesses.append(f"{said}: {looked.pages} pages by {sorted(_indexes(looked.plan))}")
                if looked.answer is not None and looked.answer != skewed.matching(query):
                    wrong.append(f"{said}: {len(looked.answer)} {looked.answer[:5]} {skewed.matching(query)[:5]}")
    assert (excesses, wrong) == ([], [])


@pytest.mark.parametrize("asked", ["each", "types"])
@pytest.mark.parametrize("memory", MEMORIES)
def test_answers_are_those_in_process(request: pytest.FixtureRequest, memory: str, asked: str) -> None:
    skewed: Skewed = request.getfixturevalue(memory)
    ask, ways = ASKED[asked]
    wrong = []
    for name, cue in ask().items():
        for order, limit in ways:
            query = Query(cue=cue, order=order, limit=limit)
            if [*skewed.store.ids(query)] != skewed.matching(query):
                wrong.append(f"{name}, {order} {limit}")
    assert wrong == []


@pytest.mark.parametrize("order", [*Order, Nearest(to=FAR), Nearest(to=RARELY.subject, place=Place.SUBJECT)], ids=str)
def test_looks_go_on_after_a_cursor_and_from_the_nearest(alike: Skewed, order: Order | Nearest) -> None:
    (event,) = alike.same.find(Query(cue=cues.uid(_uid(EVENTS * 3 // 4))))
    after = None if isinstance(order, Nearest) else Cursor.after(event)
    wrong = []
    for how in ("rare", "absent"):
        query = Query(cue=cues.agent(SAID[how].agent), order=order, limit=10, after=after)
        expected = alike.matching(query)
        wrong += [
            f"{how}: {looked.look.value}, {looked.pages} pages, {looked.answer}"
            for looked in _looked(alike, query)
            if looked.pages > _most(looked.look, query, 1) or looked.answer not in (None, expected)
        ]
        if [*alike.store.ids(query)] != expected:
            wrong.append(how)
    assert wrong == []
