"""A schema as a first sketch has it, on the same server: one table a concept, objects mapped to them, plain B-trees.

What somebody writes who knows an ORM well and spatio-temporal databases not at all: indexes on foreign keys,
times, names and the edges of boxes; sub-types found by a recursive query; polygons as text, of which those
whose boxes fit are read and tested by shapely. It shows what elm's tables and indexes are worth.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any
from uuid import UUID

import psycopg
import shapely
from sqlalchemy import ColumnElement, create_engine, exists, func, insert, select, text, tuple_
from sqlalchemy.orm import Session, joinedload, selectinload

from simulators.opponents.protocol import Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.naive_tables import Agent, Base, Event, Feature, Part, Payload, Place, Type, TypeParent
from simulators.opponents.sides.spelling import canonical

_BATCH = 1_000
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_PLACES = ("region.equal", "region.subset", "region.superset", "region.intersects", "near", "near.lately", "near.type")
_WHOLE_OBJECT = (
    joinedload(Event.type),
    joinedload(Event.agent),
    joinedload(Event.place),
    joinedload(Event.payload),
    selectinload(Event.features),
    selectinload(Event.parts),
)


class NaiveOrm:
    """Tables of a database of its own, written and asked through SQLAlchemy's sessions."""

    name = "naive_orm"
    title = "naive ORM schema"
    why = (
        "The same server without elm's design: an event is rows in five tables, put together by six statements, "
        "sub-types are looked up anew each time, and polygons are text that Python parses."
    )
    durability: Mapping[str, str] = MappingProxyType(
        {
            "durable": "PostgreSQL, synchronous_commit=on: a commit waits for the disk",
            "relaxed": "PostgreSQL, synchronous_commit=off",
        }
    )
    abilities = everything_but({}, filtered=(*_PLACES, "nearest"))

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        if dsn is None:
            raise ValueError("the naive schema is given the DSN of a database of its own")
        setting = "on" if mode == "durable" else "off"
        self._engine = create_engine(
            "postgresql+psycopg://",
            creator=lambda: psycopg.connect(dsn, options=f"-c synchronous_commit={setting} -c TimeZone=UTC"),
        )
        Base.metadata.create_all(self._engine)
        self._types = {name: number for number, (name, _) in enumerate(workload.types, start=1)}
        self._agents = {name: number for number, name in enumerate(sorted({r.agent for r in workload.records}), 1)}
        parents = [
            {"type_id": self._types[name], "parent_id": self._types[parent]}
            for name, above in workload.types
            for parent in above
        ]
        with Session(self._engine) as session:
            session.execute(insert(Type), [{"id": number, "name": name} for name, number in self._types.items()])
            session.execute(insert(Agent), [{"id": number, "name": name} for name, number in self._agents.items()])
            session.execute(insert(TypeParent), parents)
            session.execute(text("ANALYZE"))
            session.commit()

    def version(self) -> str:
        """Those of SQLAlchemy and PostgreSQL."""
        with self._engine.connect() as connection:
            server = connection.execute(text("SHOW server_version")).scalar_one()
        return f"SQLAlchemy {version('sqlalchemy')}, PostgreSQL {server}"

    def commit(self, record: Record) -> None:
        """One session, which commits."""
        with Session(self._engine) as session:
            session.add(self._event(session, record))
            session.commit()

    def load(self, records: Sequence[Record]) -> object:
        """A session for every thousand events, which SQLAlchemy inserts many rows at a time; then statistics."""
        rest = iter(records)
        while batch := list(islice(rest, _BATCH)):
            with Session(self._engine) as session:
                for record in batch:
                    session.add(self._event(session, record))
                session.commit()
        with self._engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            return connection.execute(text("VACUUM ANALYZE"))

    def ask(self, question: Question) -> Sequence[Event]:
        """Objects with all that belongs to them, let go of by their session."""
        kind, asked = question.kind, question.value
        with Session(self._engine) as session:
            if kind == "nearest":
                return self._nearest(session, asked, question.limit)
            if kind not in _PLACES:
                found = _ordered(select(Event).where(self._condition(kind, asked)), question)
                return list(session.scalars(found.options(*_WHOLE_OBJECT)))
            box, test = _place(kind, asked)
            candidates = select(Event).join(Event.place).where(*box)
            if kind == "near.lately":
                candidates = candidates.where(self._condition("window", asked))
            if kind == "near.type":
                candidates = candidates.where(self._condition("type.is_a", asked["type"]))
            if question.limit is not None:
                candidates = candidates.order_by(Event.begin, Event.id)
            events = session.scalars(candidates.options(*_WHOLE_OBJECT))
            return list(islice((event for event in events if test(_polygon(event))), question.limit))

    def uid_of(self, row: Event) -> str:
        """Its uid."""
        return row.uid.hex

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def _event(self, session: Session, record: Record) -> Event:
        parts: list[Part] = []
        if record.parts:
            uids = {UUID(hex=uid): ordinal for ordinal, uid in enumerate(record.parts)}
            known = session.execute(select(Event.id, Event.uid).where(Event.uid.in_(uids)))
            parts = [Part(part_id=number, ordinal=uids[uid]) for number, uid in known]
        return Event(
            id=record.number,
            uid=UUID(hex=record.uid),
            type_id=self._types[record.type],
            agent_id=self._agents[record.agent],
            begin=_time(record.begin),
            end=_time(record.end),
            place=_place_of(record),
            payload=Payload(media_type=record.media_type, data=record.payload),
            features=[Feature(name=name, value=_text(value)) for name, value in record.features],
            parts=parts,
        )

    def _condition(self, kind: str, asked: Any) -> ColumnElement[bool]:
        field, _, relation = kind.partition(".")
        match field:
            case "type" if relation in ("exactly", "latest"):
                return Event.type_id == select(Type.id).where(Type.name == asked).scalar_subquery()
            case "type":
                return Event.type_id.in_(_kinds_of(asked))
            case "payload":
                return Event.payload.has(Payload.data == bytes.fromhex(asked))
            case "time" | "window":
                return _when(relation or "intersects", _time(asked["begin"]), _time(asked["end"]))
            case "features":
                wanted = sorted({(name, _text(value)) for name, value in asked})
                return _set(relation, tuple_(Feature.name, Feature.value), wanted, Feature.event_id)
            case "feature_names":
                return _set(relation, Feature.name, sorted(set(asked)), Feature.event_id)
            case "parts":
                return _set(relation, Part.part_id, _ids(asked), Part.whole_id, len(set(asked)))
            case "wholes":
                return _set(relation, Part.whole_id, _ids(asked), Part.part_id, len(set(asked)))
            case _:
                raise ValueError(f"the naive schema is not told how to ask for {kind!r}")

    def _nearest(self, session: Session, asked: Any, limit: int | None) -> Sequence[Event]:
        """There is no order by distance here: every polygon is read."""
        numbers, polygons = zip(*session.execute(select(Place.event_id, Place.polygon)).tuples(), strict=True)
        distances = shapely.distance(shapely.from_wkt(polygons), shapely.Point(asked["x"], asked["y"])).tolist()
        chosen = [number for _, number in sorted(zip(distances, numbers, strict=True))[:limit]]
        found = session.scalars(select(Event).where(Event.id.in_(chosen)).options(*_WHOLE_OBJECT))
        return sorted(found, key=lambda event: chosen.index(event.id))


def _ordered(found: Any, question: Question) -> Any:
    match question.kind, question.limit:
        case _, None:
            return found
        case "type.latest", _:
            return found.order_by(Event.begin.desc(), Event.id.desc()).limit(question.limit)
        case _:
            return found.order_by(Event.begin, Event.id).limit(question.limit)


def _kinds_of(name: str) -> Any:
    below = select(Type.id).where(Type.name == name).cte("below", recursive=True)
    below = below.union(select(TypeParent.type_id).join(below, TypeParent.parent_id == below.c.id))
    return select(below.c.id)


def _when(relation: str, begin: datetime, end: datetime) -> ColumnElement[bool]:
    relations: Mapping[str, ColumnElement[bool]] = {
        "equal": (Event.begin == begin) & (Event.end == end),
        "subset": (Event.begin >= begin) & (Event.end <= end),
        "superset": (Event.begin <= begin) & (Event.end >= end),
        "intersects": (Event.begin <= end) & (Event.end >= begin),
    }
    return relations[relation]


def _set(relation: str, element: Any, wanted: Any, event: Any, size: int | None = None) -> ColumnElement[bool]:
    """The rows of an event as a set against the wanted ones; two columns are one element as a tuple."""
    number = len(wanted) if size is None else size
    some = select(event).where(element.in_(wanted))
    all_of_them = some.group_by(event).having(func.count(func.distinct(element)) == number)
    others = exists().where(event == Event.id, element.not_in(wanted))
    relations: Mapping[str, ColumnElement[bool]] = {
        "equal": Event.id.in_(all_of_them) & ~others,
        "superset": Event.id.in_(all_of_them),
        "subset": ~others,
        "intersects": Event.id.in_(some),
    }
    return relations[relation]


def _ids(uids: Sequence[str]) -> Any:
    return select(Event.id).where(Event.uid.in_([UUID(hex=uid) for uid in uids]))


def _place(kind: str, asked: Any) -> tuple[list[ColumnElement[bool]], Callable[[Any], bool]]:
    """What the boxes must fulfil, and then the polygons."""
    if kind.startswith("near"):
        point, metres = shapely.Point(asked["x"], asked["y"]), asked["metres"]
        west, south, east, north = point.x - metres, point.y - metres, point.x + metres, point.y + metres
        return _meeting(west, south, east, north), lambda polygon: bool(shapely.dwithin(polygon, point, metres))
    polygon = shapely.Polygon(asked)
    west, south, east, north = polygon.bounds
    around = [Place.min_x <= west, Place.min_y <= south, Place.max_x >= east, Place.max_y >= north]
    inside = [Place.min_x >= west, Place.min_y >= south, Place.max_x <= east, Place.max_y <= north]
    relations: Mapping[str, tuple[list[ColumnElement[bool]], Callable[[Any], Any]]] = {
        "region.equal": (around, polygon.equals),
        "region.subset": (inside, polygon.covers),
        "region.superset": (around, polygon.covered_by),
        "region.intersects": (_meeting(west, south, east, north), polygon.intersects),
    }
    return relations[kind]


def _meeting(west: float, south: float, east: float, north: float) -> list[ColumnElement[bool]]:
    return [Place.min_x <= east, Place.max_x >= west, Place.min_y <= north, Place.max_y >= south]


def _polygon(event: Event) -> Any:
    return None if event.place is None else shapely.from_wkt(event.place.polygon)


def _place_of(record: Record) -> Place | None:
    if record.ring is None:
        return None
    corners = ", ".join(f"{x!r} {y!r}" for x, y in record.ring)
    xs, ys = [x for x, _ in record.ring], [y for _, y in record.ring]
    return Place(polygon=f"POLYGON (({corners}))", min_x=min(xs), max_x=max(xs), min_y=min(ys), max_y=max(ys))


def _time(micros: int) -> datetime:
    return _EPOCH + timedelta(microseconds=micros)


def _text(value: Any) -> str:
    """A value as JSON; numbers are equal by value."""
    return json.dumps(canonical(value), ensure_ascii=False)


if __name__ == "__main__":
    serve(NaiveOrm)
