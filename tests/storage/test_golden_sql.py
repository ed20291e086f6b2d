"""The SQL of every kind of cue and question as it was last looked at; ELM_UPDATE_GOLDEN=1 writes it anew."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import Select

from elm import cues
from elm.cues.algebra import Cue
from elm.cues.match import match
from elm.cues.relations import Comparison, Kin, Place, SetRelation
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.features import FeatureValue
from elm.geometry import Region, SpatialRelation
from elm.interval import AllenRelation
from elm.query import ByFeature, Cursor, Grouping, Join, JoinRelation, Nearest, Order, Query
from elm.storage import recall_statements
from elm.storage.cue_compiler import compile_cue
from elm.storage.first_look import Look, Wanted, look_for, looks
from elm.storage.hints import begins_within, is_pinned, is_planned_once
from elm.storage.postgres import PostgresStore
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.model import Model
from tests.servers import MEMORY, Server
from tests.strategies import PAPER_CLASSES, TYPE_NAMES, combined_cues, regions

GOLDEN = Path(__file__).parents[1] / "golden"
UPDATE = os.environ.get("ELM_UPDATE_GOLDEN") == "1"

_ONE, _TWO = UUID(int=1), UUID(int=2)
_PLACE = Region.box(0, 0, 4, 4)
_SPATIAL = tuple(relation for relation in SpatialRelation if relation is not SpatialRelation.WITHIN_DISTANCE)
_WORDS = {"=": "eq", "!=": "ne", "<": "lt", "<=": "le", ">": "gt", ">=": "ge", "like": "like"}
_OF_KIND: Mapping[str, FeatureValue] = {"text": "a", "number": 1, "truth": True}


class Numbers:
    """Types and frames numbered as they are asked for, as a memory would."""

    def __init__(self) -> None:
        self._known: dict[str, int] = {}

    def type_id(self, name: str) -> int:
        return self._known.setdefault(f"type {name}", len(self._known))

    def frame_id(self, name: str) -> int:
        return self._known.setdefault(f"frame {name}", len(self._known))


def shown(build: Callable[..., Select[Any]], query: Query) -> str:
    """The SQL text of a question."""
    compiled = compile_cue(query.cue, Numbers())
    statement = build(compiled, query, pinned=is_pinned(query.cue), near=begins_within(query.cue))
    return str(statement.compile(dialect=recall_statements.DIALECT))


def looks_at(query: Query) -> list[Look]:
    """The first looks at what a question asks for."""
    return looks(compile_cue(query.cue, Numbers()), query)


def look_at(look: Look, query: Query, wanted: Wanted = recall_statements.only_id) -> str:
    """The SQL text of a look at the ids, or at other columns."""
    statement = look_for(look, compile_cue(query.cue, Numbers()), query, wanted, near=begins_within(query.cue))
    return str(statement.compile(dialect=recall_statements.DIALECT))


def sql_of(cue: Cue) -> str:
    """The SQL text that finds the ids of all events matching a cue."""
    return shown(recall_statements.find_ids, Query(cue=cue))


# One condition each


def _feature_cues() -> Iterator[tuple[str, Cue]]:
    for compare in Comparison:
        for kind, value in _OF_KIND.items():
            try:
                yield f"feature.{_WORDS[compare]}.{kind}", cues.feature("force", compare, value)
            except InvalidValue:
                assert (kind, compare) != ("text", compare)


def _kin_cues() -> Iterator[tuple[str, Cue]]:
    for name, build in (("parts", cues.parts), ("wholes", cues.wholes)):
        for transitive, suffix in ((False, ""), (True, ".transitive")):
            for relation in SetRelation:
                yield f"{name}.{relation}{suffix}", build(relation, [_ONE, _TWO], transitive=transitive)
            # The relations that an empty set makes another question.
            for relation in (SetRelation.EQUAL, SetRelation.SUPERSET):
                yield f"{name}.{relation}.empty{suffix}", build(relation, [], transitive=transitive)


CONDITIONS: Mapping[str, Cue] = {
    "type.exactly": cues.exactly("Grasp"),
    "type.is_a": cues.is_a("Grasp"),
    "payload.equal": cues.payload(b"a"),
    **{
        f"{name}.{relation}": build(relation, at(0), at(1))
        for name, build in (("time", cues.time), ("recorded_at", cues.recorded))
        for relation in (*SetRelation, *AllenRelation)
    },
    **{
        f"{name}.{relation}": build(relation, _PLACE)
        for name, build in (("region", cues.region), ("subject", cues.subject))
        for relation in _SPATIAL
    },
    "region.within_distance": cues.within(1, _PLACE),
    "subject.within_distance": cues.subject_within(1, _PLACE),
    **{f"features.{relation}": cues.features(relation, {"a": 1}) for relation in SetRelation},
    **{f"feature_names.{relation}": cues.feature_names(relation, ["a"]) for relation in SetRelation},
    "feature_names.superset.several": cues.feature_names("superset", ["a", "b"]),
    **dict(_feature_cues()),
    "agent": cues.agent("armar7"),
    **{
        f"duration.{_WORDS[compare]}": cues.lasting(compare, timedelta(seconds=1))
        for compare in Comparison
        if compare is not Comparison.LIKE
    },
    **dict(_kin_cues()),
    "uid": cues.uid(_ONE),
    "everything": cues.everything(),
    "nothing": cues.any_of(),
}
"""Every kind of condition, by the name of its file."""

UNBOUNDED: Mapping[str, Cue] = {
    f"{name}.{relation}.{bound}": build(relation, begin, end)
    for name, build in (("time", cues.time), ("recorded_at", cues.recorded))
    for relation in (*SetRelation, *AllenRelation)
    for bound, begin, end in (("since", at(0), None), ("until", None, at(1)), ("always", None, None))
}
"""The windows without begin or end, whose infinities stand in the SQL."""

SAME_MEANING: tuple[set[str], ...] = (
    {"time.equal", "time.equals"},
    # To learn of an event takes no time.
    {"recorded_at.equal", "recorded_at.superset", "recorded_at.equals"},
    {"recorded_at.subset", "recorded_at.intersects"},
    # An instant never overlaps or contains anything.
    {"recorded_at.overlaps", "recorded_at.overlapped_by", "recorded_at.contains", "nothing"},
    # Some value is this one, whatever its kind: the pair is in the set.
    {"features.superset", "feature.eq.text", "feature.eq.number", "feature.eq.truth"},
    # Whatever there is has at least no parts and no wholes.
    {"everything", *(f"{kin}.superset.empty{suffix}" for kin in Kin for suffix in ("", ".transitive"))},
    # Who has no direct kin has none further off.
    {"parts.equal.empty", "parts.equal.empty.transitive"},
    {"wholes.equal.empty", "wholes.equal.empty.transitive"},
)
"""Conditions that may have the same SQL, for they mean the same."""

COMPOSED: Mapping[str, Cue] = {
    "and": cues.exactly("Grasp") & cues.agent("armar7"),
    "or": cues.exactly("Grasp") | cues.agent("armar7"),
    "not": ~cues.agent("armar7"),
    "and.or.not": ~(cues.exactly("Grasp") & (cues.agent("armar7") | ~cues.agent("armar6"))),
    "and.kin.transitive": cues.parts("equal", [_ONE], transitive=True)
    & ~cues.wholes("subset", [_TWO], transitive=True),
}


# The questions


_CUE = cues.time("subset", at(0), at(1)) & cues.is_a("Grasp")
_CURSOR = Cursor(begin=at(0), id=1)
_NEAREST = Nearest(to=_PLACE)

QUERIES: Mapping[str, Query] = {
    **{f"order.{order}": Query(cue=_CUE, order=order) for order in Order},
    **{f"order.{order}.limit": Query(cue=_CUE, order=order, limit=10) for order in Order},
    **{f"order.{order}.after": Query(cue=_CUE, order=order, after=_CURSOR) for order in Order},
    **{f"order.{order}.limit.after": Query(cue=_CUE, order=order, limit=10, after=_CURSOR) for order in Order},
    "order.begin.limit.unbounded": Query(cue=cues.agent("armar7"), limit=10),
    "order.begin.limit.until": Query(cue=cues.time("intersects", at(0), at(1)), limit=10),
    "order.begin.limit.pinned": Query(cue=cues.uid(_ONE), limit=10),
    "order.begin.limit.large": Query(cue=_CUE, limit=recall_statements.WALK_MOST),
    "order.begin.limit.features": Query(cue=cues.feature("force", "<", 1), limit=10),
    "order.begin.limit.exactly": Query(cue=cues.exactly("Grasp"), limit=10),
    "order.begin.limit.region": Query(cue=cues.region("intersects", _PLACE) | cues.region("touches", _PLACE), limit=10),
    "order.begin.limit.kin": Query(cue=cues.parts("subset", [_ONE], transitive=True), limit=10),
    "nearest": Query(cue=_CUE, order=_NEAREST),
    "nearest.limit": Query(cue=_CUE, order=_NEAREST, limit=10),
    "nearest.limit.everything": Query(order=_NEAREST, limit=10),
    "nearest.subject.limit": Query(cue=_CUE, order=Nearest(to=_PLACE, place=Place.SUBJECT), limit=10),
}


def _questions() -> dict[str, str]:
    names = Numbers()
    cue, other = compile_cue(_CUE, names), compile_cue(cues.agent("armar7"), names, prefix="n")
    dialect = recall_statements.DIALECT
    built: dict[str, Select[Any]] = {
        "count": recall_statements.count(cue),
        "exists": recall_statements.any_match(cue),
        "get": recall_statements.by_ids(),
        "explain.conditions": recall_statements.removed([cue, other]),
        **{f"groups.{by}": recall_statements.groups(cue, by) for by in Grouping},
        "groups.feature": recall_statements.groups(cue, ByFeature(name="force")),
    }
    for relation in JoinRelation:
        for same_region in (False, True):
            for limit in (None, 10):
                anchors = Query(cue=_CUE, limit=limit)
                wanted = Join(anchors=anchors, relation=relation, cue=cues.agent("x"), same_region=same_region)
                suffix = ".same_region" * same_region + ".limit" * (limit is not None)
                built[f"join.{relation}{suffix}"] = recall_statements.join(
                    cue, other, wanted, pinned=False, near=begins_within(_CUE)
                )
    return {name: str(statement.compile(dialect=dialect)) for name, statement in built.items()}


def golden() -> dict[str, str]:
    """The SQL text for every file."""
    texts = {name: sql_of(cue) for name, cue in (*CONDITIONS.items(), *COMPOSED.items())}
    texts |= {name: shown(recall_statements.find, query) for name, query in QUERIES.items()}
    texts |= {f"{name}.ids": shown(recall_statements.find_ids, query) for name, query in QUERIES.items()}
    for name, query in (*QUERIES.items(), *((name, Query(cue=cue)) for name, cue in CONDITIONS.items())):
        for look in looks_at(query):
            texts[f"{name}.look_{look.value.replace(' ', '_')}"] = look_at(look, query)
    return texts | _questions()


TEXTS = golden()


@pytest.mark.parametrize("name", TEXTS)
def test_sql_is_the_one_last_looked_at(name: str) -> None:
    file = GOLDEN / f"{name}.sql"
    text = "\n".join(line.rstrip() for line in TEXTS[name].splitlines()) + "\n"
    if UPDATE:
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    assert file.read_text() == text, "if the change is meant: ELM_UPDATE_GOLDEN=1, and look at the difference"


def test_no_file_is_left_over() -> None:
    found = {file.name.removesuffix(".sql"): file for file in GOLDEN.glob("*.sql")}
    for name in found.keys() - TEXTS.keys():
        if UPDATE:
            found[name].unlink()
    assert {file.name.removesuffix(".sql") for file in GOLDEN.glob("*.sql")} == set(TEXTS)


def test_every_class_of_the_paper_has_a_file() -> None:
    assert len(PAPER_CLASSES) == 27
    assert set(PAPER_CLASSES) <= set(CONDITIONS)


def test_conditions_with_the_same_sql_mean_the_same() -> None:
    same: dict[str, set[str]] = defaultdict(set)
    for name in CONDITIONS:
        same[TEXTS[name]].add(name)
    shared = [names for names in same.values() if len(names) > 1]
    assert [sorted(names) for names in shared if not any(names <= meaning for meaning in SAME_MEANING)] == []


_MOMENTS = (-1, 0, 0.5, 1, 2)
_EVENTS = tuple(
    StoredEvent(id=1, uid=_ONE, type="Grasp", interval=span(begin, end), recorded_at=at(learned))
    for begin in _MOMENTS
    for end in (*_MOMENTS, None)
    for learned in _MOMENTS
    if end is None or begin <= end
)


@pytest.mark.parametrize("bound", ["since", "until", "always"])
def test_unbounded_windows_with_the_same_sql_mean_the_same(bound: str) -> None:
    """Where two relations share the SQL of an unbounded window, no event tells them apart."""
    around = Model(types=[])
    same: dict[str, dict[str, list[bool]]] = defaultdict(dict)
    for name, cue in UNBOUNDED.items():
        if name.endswith(bound):
            same[sql_of(cue)][name] = [match(cue, event, around) for event in _EVENTS]
    assert len(same) > 10
    for answers in same.values():
        assert all(answer == next(iter(answers.values())) for answer in answers.values()), list(answers)


# What the user writes


def _grouped(name: str) -> str:
    groups = recall_statements.groups(compile_cue(_CUE, Numbers()), ByFeature(name=name))
    return str(groups.compile(dialect=recall_statements.DIALECT))


def _framed(frame: str) -> Region:
    return Region.box(0, 0, 1, 1, frame=frame)


FIELDS: Mapping[str, Callable[[str], str]] = {
    "type": lambda text: sql_of(cues.exactly(text)),
    "type above": lambda text: sql_of(cues.is_a(text)),
    "agent": lambda text: sql_of(cues.agent(text)),
    "payload": lambda text: sql_of(cues.payload(text.encode())),
    "frame": lambda text: sql_of(cues.region("subset", _framed(text))),
    "subject's frame": lambda text: sql_of(cues.subject_within(1, _framed(text))),
    "feature": lambda text: sql_of(cues.features("subset", {text: text})),
    "feature names": lambda text: sql_of(cues.feature_names("equal", [text])),
    "feature name": lambda text: sql_of(cues.feature(text, ">", 1)),
    "feature value": lambda text: sql_of(cues.feature("a", ">=", text)),
    "feature value, equal": lambda text: sql_of(cues.feature("a", "=", text)),
    "pattern": lambda text: sql_of(cues.feature("a", "like", text.replace("\\", "\\\\"))),
    "nearest": lambda text: shown(recall_statements.find, Query(order=Nearest(to=_framed(text)), limit=1)),
    "groups": _grouped,
    "deep down": lambda text: sql_of(~(cues.agent(text) | cues.exactly(text)) & cues.feature(text, "!=", text)),
}
"""The SQL text by each field that takes a text."""

_NASTY = (
    "'",
    '"',
    "%",
    "%s",
    "%(p0)s",
    ":p0",
    "$1",
    "--",
    "/*",
    ";",
    "\\",
    "\\'",
    "'; DROP TABLE event; --",
    "x" * 300,
)


@pytest.mark.parametrize("field", FIELDS)
@given(text=st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\x00\x1f"), min_size=1, max_size=30))
def test_no_text_of_the_user_becomes_sql(field: str, text: str) -> None:
    assert FIELDS[field](text) == FIELDS[field]("x")


@pytest.mark.parametrize("text", _NASTY)
def test_no_nasty_text_becomes_sql(text: str) -> None:
    assert {field for field, sql in FIELDS.items() if sql(text) != sql("x")} == set()


# What is kept


_SEEN: dict[Any, str] = {}


@given(
    cue=combined_cues(TYPE_NAMES),
    order=st.sampled_from(Order) | regions().map(lambda region: Nearest(to=region)),
    limit=st.none() | st.sampled_from([0, 1, 10, 1_999, 2_000]),
    paged=st.booleans(),
)
def test_equal_shapes_have_equal_sql(cue: Cue, order: Order | Nearest, limit: int | None, paged: bool) -> None:
    """What the kept texts are found by tells all that the text depends on, and every parameter has a value."""
    after = _CURSOR if paged and isinstance(order, Order) else None
    query = Query(cue=cue, order=order, limit=limit, after=after)
    pinned, near = is_pinned(cue), begins_within(cue)
    compiled = compile_cue(cue, Numbers())
    for build in (recall_statements.find, recall_statements.find_ids):
        text = shown(build, query)
        key = (build.__name__, compiled.key, recall_statements.shape(query, pinned=pinned, near=near))
        assert _SEEN.setdefault(key, text) == text
        given_values = {**compiled.values, **recall_statements.parameters(query, near=near)}
        assert set(re.findall(r"%\((\w+)\)s", text)) <= given_values.keys()
    assert "%" not in re.sub(r"%\(\w+\)s", "", text)


@pytest.fixture(scope="module")
def store(postgres_server: Server) -> Iterator[PostgresStore]:
    with postgres_server.database() as dsn:
        opened = PostgresStore(dsn, MEMORY)
        opened.add_types([EventType(name="Grasp")])
        yield opened
        opened.close()


@pytest.mark.parametrize(
    "query", [*QUERIES.values(), *(Query(cue=cue) for cue in (*CONDITIONS.values(), *COMPOSED.values()))]
)
def test_the_store_runs_this_sql(store: PostgresStore, query: Query) -> None:
    assert store.explain(query).sql == _answering(query)


def _answering(query: Query) -> str:
    """What answers a question in an empty memory: the first look that can tell that nothing matches."""
    if is_planned_once(query):
        return shown(recall_statements.find, query)
    telling = [look for look in looks_at(query) if look is not Look.IN_ORDER]
    if telling:
        return look_at(telling[0], query, recall_statements.columns)
    return shown(partial(recall_statements.find, looked=bool(looks_at(query))), query)
