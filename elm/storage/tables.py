"""The tables of one memory: columns, constraints and indexes, as the cue compiler and the migrations know them."""

from __future__ import annotations

from typing import Any

from geoalchemy2 import Geometry
from sqlalchemy import (
    ARRAY,
    TIMESTAMP,
    BigInteger,
    CheckConstraint,
    Column,
    ColumnElement,
    ForeignKey,
    Identity,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    SmallInteger,
    Table,
    Text,
    Uuid,
    cast,
    func,
    text,
)
from sqlalchemy.dialects.postgresql import JSON, TSTZRANGE

REVISION = "0005"
"""The migration that makes the tables as they stand here."""

metadata = MetaData(
    naming_convention={
        "pk": "%(table_name)s_pkey",
        "fk": "%(table_name)s_%(column_0_name)s_fkey",
        "uq": "%(table_name)s_%(column_0_name)s_key",
        "ck": "%(table_name)s_%(constraint_name)s_check",
        "ix": "%(table_name)s_%(column_0_N_name)s_idx",
    }
)


def _c_text() -> Text:
    # Code point order, whatever the database's locale: the order in which Python compares text.
    return Text(collation="C")


def _polygon() -> Geometry:
    return Geometry("POLYGON", srid=0, spatial_index=False)


event_type = Table(
    "event_type",
    metadata,
    Column("id", Integer, Identity(always=True), primary_key=True),
    Column("name", _c_text(), nullable=False, unique=True),
)

type_parent = Table(
    "type_parent",
    metadata,
    Column("child_id", ForeignKey("event_type.id"), primary_key=True),
    Column("parent_id", ForeignKey("event_type.id"), primary_key=True),
    CheckConstraint("child_id <> parent_id", name="not_own_parent"),
)

# Derived from type_parent in the same transaction, hence without foreign keys of its own.
type_closure = Table(
    "type_closure",
    metadata,
    Column("ancestor_id", Integer, primary_key=True),
    Column("descendant_id", Integer, primary_key=True),
    Index("type_closure_descendant_id_idx", "descendant_id"),
)

frame = Table(
    "frame",
    metadata,
    Column("id", Integer, Identity(always=True), primary_key=True),
    Column("name", _c_text(), nullable=False, unique=True),
)

event = Table(
    "event",
    metadata,
    Column("id", BigInteger, Identity(always=True), primary_key=True),
    Column("uid", Uuid, nullable=False, unique=True),
    # Types and frames are only ever added, so their numbers need no foreign keys: checking three of them cost
    # a quarter of an insert and had all writers lock the same few rows (docs/adr/0003).
    Column("type_id", Integer, nullable=False),
    Column("period", TSTZRANGE, nullable=False),
    Column("frame_id", Integer),
    Column("region", _polygon()),
    Column("subject_frame_id", Integer),
    Column("subject", _polygon()),
    Column("feature_tokens", ARRAY(_c_text()), nullable=False),
    Column("feature_names", ARRAY(_c_text()), nullable=False),
    # json, not jsonb: it keeps 1.0 and 1 apart, as they were given.
    Column("features", JSON, nullable=False),
    Column("agent", _c_text()),
    Column("media_type", _c_text()),
    Column("payload", LargeBinary),
    # The parts' uids in order stand here too: reading an event needs no join, and they never change.
    Column("parts", ARRAY(Uuid), nullable=False),
    Column("recorded_at", TIMESTAMP(timezone=True), nullable=False),
    Column("content", LargeBinary, nullable=False),
    Column("feature_ends", BigInteger, nullable=False),
    # One constraint instead of four: each costs 4 us an insert to set up.
    CheckConstraint(
        "lower_inc(period) AND (upper_inc(period) OR upper_inf(period)) AND NOT lower_inf(period)"
        " AND (region IS NULL) = (frame_id IS NULL) AND (subject IS NULL) = (subject_frame_id IS NULL)"
        " AND (payload IS NULL) = (media_type IS NULL)",
        name="whole",
    ),
)

begin = func.lower(event.c.period)

Index("event_begin_id_idx", begin, event.c.id)
Index("event_type_id_begin_id_idx", event.c.type_id, begin, event.c.id)
Index("event_period_idx", event.c.period, postgresql_using="gist")
# Frames overlap around their origins: without the frame as first column a region finds all of them.
Index("event_region_idx", event.c.frame_id, event.c.region, postgresql_using="gist")
Index(
    "event_subject_idx",
    event.c.subject_frame_id,
    event.c.subject,
    postgresql_using="gist",
    postgresql_where=event.c.subject.is_not(None),
)
# A short pending list: with the default of 4 MB single inserts stall for 200 ms and recalls read all of it.
for _name in ("feature_tokens", "feature_names"):
    Index(
        f"event_{_name}_idx",
        event.c[_name],
        postgresql_using="gin",
        postgresql_with={"gin_pending_list_limit": 64},
    )
# What lies within a set has its first and last token in it: `features.ends`.
Index("event_feature_ends_idx", event.c.feature_ends)


def names_key(names: ColumnElement[Any], number: int | None = None) -> ColumnElement[int]:
    """The key of a whole set of names: 2**32 for each, and a hash from -2**31 to 2**31 - 1.

    `number` is how many names there are, if the caller knows: there is less to plan then.
    """
    # No literal columns: an index would take them for columns of the table.
    counted = cast(func.cardinality(names), BigInteger).bitwise_lshift(text("32"))
    return func.hash_array(names, type_=BigInteger) + (counted if number is None else text(str(number << 32)))


def last_names_key(number: int) -> int:
    """The highest key that a set of so many names can have."""
    return (number << 32) + 2**31 - 1


# Finds whole sets of names, and so those that lie within a small one or are larger than most; names alone repeat too
# much (docs/adr/0011).
Index("event_feature_names_set_idx", names_key(event.c.feature_names))
# A hash index would be quadratic where payloads repeat; the digest also fits where a payload does not.
Index("event_payload_idx", func.sha256(event.c.payload), postgresql_where=event.c.payload.is_not(None))
# Without the begin: equal keys then share one entry, and most events of a memory have the same agent.
Index("event_agent_idx", event.c.agent, postgresql_where=event.c.agent.is_not(None))
Index("event_recorded_at_idx", event.c.recorded_at)

part = Table(
    "part",
    metadata,
    Column("whole_id", ForeignKey("event.id"), nullable=False),
    # An event or a tombstone; whoever writes links locks what they lead to.
    Column("part_id", BigInteger, nullable=False),
    Column("ordinal", Integer, nullable=False),
    Column("whole_uid", Uuid, nullable=False),
    PrimaryKeyConstraint("whole_id", "part_id"),
    CheckConstraint("part_id < whole_id", name="part_before_whole"),
    Index("part_part_id_idx", "part_id", "whole_id", postgresql_include=["whole_uid"]),
)

tombstone = Table(
    "tombstone",
    metadata,
    # The forgotten event's own, so that the links to it lead here.
    Column("id", BigInteger, primary_key=True, autoincrement=False),
    Column("uid", Uuid, nullable=False, unique=True),
    Column("period", TSTZRANGE, nullable=False),
    Column("frame_id", Integer),
    Column("region", _polygon()),
    Column("subject_frame_id", Integer),
    Column("subject", _polygon()),
    Column("agent", _c_text()),
    Column("run", Uuid, nullable=False),
    CheckConstraint(
        "lower_inc(period) AND upper_inc(period) AND NOT lower_inf(period)"
        " AND (region IS NULL) = (frame_id IS NULL) AND (subject IS NULL) = (subject_frame_id IS NULL)",
        name="whole",
    ),
)

forgetting = Table(
    "forgetting",
    metadata,
    Column("run", Uuid, primary_key=True),
    Column("at", TIMESTAMP(timezone=True), nullable=False),
    Column("events", BigInteger, nullable=False),
    Column("period", TSTZRANGE),
)

forgetting_place = Table(
    "forgetting_place",
    metadata,
    Column("run", ForeignKey("forgetting.run"), primary_key=True),
    Column("kind", SmallInteger, primary_key=True, autoincrement=False),
    Column("frame_id", Integer, primary_key=True, autoincrement=False),
    Column("hull", _polygon(), nullable=False),
)

log_inbox = Table(
    "log_inbox",
    metadata,
    Column("n", BigInteger, Identity(always=True), primary_key=True),
    Column("event_id", BigInteger),
    Column("kind", SmallInteger, nullable=False),
    Column("agent", _c_text()),
    Column("deadline", TIMESTAMP(timezone=True)),
    Column("at", TIMESTAMP(timezone=True), nullable=False),
)

log_head = Table(
    "log_head",
    metadata,
    # The one row has a number, so that an update can be replicated and moves no index entry.
    Column("id", SmallInteger, primary_key=True, autoincrement=False),
    Column("seq", BigInteger, nullable=False),
    CheckConstraint("id = 1", name="one_row"),
)

log = Table(
    "log",
    metadata,
    Column("seq", BigInteger, primary_key=True, autoincrement=False),
    Column("event_id", BigInteger),
    Column("kind", SmallInteger, nullable=False),
    Column("agent", _c_text()),
    Column("deadline", TIMESTAMP(timezone=True)),
    Column("at", TIMESTAMP(timezone=True), nullable=False),
)

consumer = Table(
    "consumer",
    metadata,
    Column("name", _c_text(), primary_key=True),
    Column("position", BigInteger, nullable=False),
    Column("checkpoint", BigInteger, nullable=False),
    Column("state", LargeBinary),
    Column("report", JSON, nullable=False),
    Column("updated_at", TIMESTAMP(timezone=True), nullable=False),
)

definition = Table(
    "definition",
    metadata,
    Column("name", _c_text(), primary_key=True),
    Column("fingerprint", _c_text(), nullable=False),
)

LOG_COMMIT = 1
"""`kind`, in the log and its inbox, of an event that had ended when it was committed."""
LOG_CLOSE = 2
"""`kind` of an open event that was closed, or of a whole that thereby closed."""
LOG_OPEN = 3
"""`kind` of an event that was still going on when it was committed."""
LOG_TICK = 4
"""`kind` of a tick: time went by, at most to `deadline`."""
LOG_PUNCTUATION = 5
"""`kind` of a promise that nothing that ended before `deadline` is to come."""

HULL_OF_REGIONS = 1
"""`kind` of the hull of where the observer was, in the place of a forgetting."""
HULL_OF_SUBJECTS = 2
"""`kind` of the hull of where the things were that the events were about."""
