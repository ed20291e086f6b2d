"""The tables of the naive schema: one for each concept, mapped to objects, as a first sketch of the domain has them."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, DateTime, Float, ForeignKey, LargeBinary, Text, Uuid
from sqlalchemy.orm import DeclarativeBase, Mapped, MappedAsDataclass, mapped_column, relationship


class Base(MappedAsDataclass, DeclarativeBase, kw_only=True):
    """What all tables are registered at."""


class Type(Base):
    """A type of events."""

    __tablename__ = "type"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(Text, unique=True)


class TypeParent(Base):
    """That one type is a kind of another, directly."""

    __tablename__ = "type_parent"
    type_id: Mapped[int] = mapped_column(ForeignKey("type.id"), primary_key=True)
    parent_id: Mapped[int] = mapped_column(ForeignKey("type.id"), primary_key=True, index=True)


class Agent(Base):
    """Whose perspective an event has."""

    __tablename__ = "agent"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(Text, unique=True)


class Place(Base):
    """Where an event was: a polygon as text, and its box in metres."""

    __tablename__ = "place"
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), primary_key=True, init=False)
    polygon: Mapped[str] = mapped_column(Text)
    min_x: Mapped[float] = mapped_column(Float, index=True)
    max_x: Mapped[float] = mapped_column(Float, index=True)
    min_y: Mapped[float] = mapped_column(Float, index=True)
    max_y: Mapped[float] = mapped_column(Float, index=True)


class Feature(Base):
    """One name and value of an event, the value as JSON text."""

    __tablename__ = "feature"
    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, init=False)
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True, init=False)
    name: Mapped[str] = mapped_column(Text, index=True)
    value: Mapped[str] = mapped_column(Text)


class Payload(Base):
    """The bytes of an event."""

    __tablename__ = "payload"
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), primary_key=True, init=False)
    media_type: Mapped[str | None] = mapped_column(Text)
    data: Mapped[bytes] = mapped_column(LargeBinary)


class Part(Base):
    """That one event is part of another, and the how manieth."""

    __tablename__ = "part"
    whole_id: Mapped[int] = mapped_column(ForeignKey("event.id"), primary_key=True, init=False)
    part_id: Mapped[int] = mapped_column(ForeignKey("event.id"), primary_key=True, index=True)
    ordinal: Mapped[int]


class Event(Base):
    """What happened."""

    __tablename__ = "event"
    id: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    uid: Mapped[UUID] = mapped_column(Uuid, unique=True)
    type_id: Mapped[int] = mapped_column(ForeignKey("type.id"), index=True)
    agent_id: Mapped[int] = mapped_column(ForeignKey("agent.id"), index=True)
    begin: Mapped[datetime] = mapped_column(DateTime(timezone=True), index=True)
    end: Mapped[datetime] = mapped_column(DateTime(timezone=True), index=True)
    type: Mapped[Type] = relationship(init=False)
    agent: Mapped[Agent] = relationship(init=False)
    place: Mapped[Place | None] = relationship()
    payload: Mapped[Payload] = relationship()
    features: Mapped[list[Feature]] = relationship(order_by=Feature.id)
    parts: Mapped[list[Part]] = relationship(foreign_keys=[Part.whole_id], order_by=Part.ordinal)
