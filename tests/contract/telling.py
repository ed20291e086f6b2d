"""Telling a store and the model the same story."""

from __future__ import annotations

from collections.abc import Iterable

from hypothesis import Phase, settings

from elm.cues.algebra import And, Cue
from elm.errors import ElmError, StoreFailure
from elm.event import Event, StoredEvent
from elm.query import Order, Query
from elm.store import Arrival, Store
from elm.taxonomy import EventType
from tests.clock import at
from tests.model import Model, same_events
from tests.strategies import Story

few_memories = settings(max_examples=20, phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink])
"""For random tests: making a memory in a database takes longer than asking it, so each is asked several things."""


def tell(store: Store, story: Story) -> Model:
    """Commit a story event by event; the model then knows what the store must hold."""
    store.add_types(story.types)
    model = Model(story.types)
    for arrival in story.arrivals:
        committed = store.commit(arrival)
        assert committed.new
        assert committed.uid == arrival.event.uid
        model.commit(arrival, id=committed.id)
    return model


def numbered(types: Iterable[EventType], arrivals: Iterable[Arrival], store: Store) -> Model:
    """The model of these arrivals with the ids that the store gave them, in whatever order it did."""
    model, ids = Model(types), {event.uid: event.id for event in everything(store)}
    for arrival in arrivals:
        model.commit(arrival, id=ids[arrival.event.uid])
    return model


def story(*events: Event, types: Iterable[str] = ()) -> Story:
    """These events, learned of at second 0, and all types that they have."""
    names = dict.fromkeys([*types, *(event.type for event in events)])
    return Story(
        types=tuple(EventType(name=name) for name in names),
        arrivals=tuple(Arrival(event=event, recorded_at=at(0)) for event in events),
    )


def everything(store: Store) -> list[StoredEvent]:
    """All that the store holds, by id."""
    return list(store.find(Query(order=Order.ID)))


def holds(store: Store, model: Model) -> bool:
    """Whether the store holds exactly what the model does."""
    return same_events(list(store.find(Query())), model.scan(And()))


def found(store: Store, cue: Cue) -> list[int]:
    """The ids of what a cue recalls, by (begin, id)."""
    return [event.id for event in store.find(Query(cue=cue))]


def is_clear(error: ElmError) -> bool:
    """Whether an error is one that elm knows, with a message."""
    return bool(str(error)) and not isinstance(error, StoreFailure)
