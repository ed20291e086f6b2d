"""Checkpoints: a strand's state as bytes, and back, with the events it refers to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from elm.event import StoredEvent
from elm.exchange import event_from_json, event_to_json
from elm.recognition.fold import Fold


def taken(fold: Fold, strand: str) -> bytes:
    """The checkpoint of one strand of a fold.

    Events of the memory are named by id. Results, whose ids are not known yet, are written out: as they were
    derived here, so that a restart sees the same digits.
    """
    state, named = fold.snapshot(strand)
    stored = [event.id for event in named if event.id]
    results = [event_to_json(event) for event in named if not event.id]
    return msgspec.json.encode({"state": state, "events": stored, "results": results})


def held_events(checkpoint: bytes) -> list[int]:
    """The ids of the events of the memory that a checkpoint refers to."""
    held: list[int] = msgspec.json.decode(checkpoint)["events"]
    return held


def restored(fold: Fold, strand: str, checkpoint: bytes, get: Callable[[Sequence[int]], Sequence[StoredEvent]]) -> int:
    """Have the one strand of a fold as it was when `checkpoint` was taken; `get` gives events by id.

    Returns how many of the events that it refers to were forgotten since: these no longer wait, and what was
    unfinished for an agent one of whose events is among them begins anew.
    """
    told = msgspec.json.decode(checkpoint)
    named = {str(event.uid): event for event in get(told["events"])}
    forgotten = len(told["events"]) - len(named)
    named |= {given["uid"]: _result(given) for given in told["results"]}
    fold.resume(strand, _without_forgotten(told["state"], named) if forgotten else told["state"], named)
    return forgotten


def _without_forgotten(state: Mapping[str, Any], named: Mapping[str, StoredEvent]) -> dict[str, Any]:
    def known(waiting: Sequence[tuple[str, int]]) -> list[tuple[str, int]]:
        return [(uid, moment) for uid, moment in waiting if uid in named]

    states, held = state["across"]
    return {
        **state,
        "queues": [(agent, known(waiting)) for agent, waiting in state["queues"]],
        "shared": known(state["shared"]),
        "benches": [each for each in state["benches"] if len(known(each[2])) == len(each[2])],
        "across": (states, held) if len(known(held)) == len(held) else ({}, []),
    }


def _result(given: dict[str, object]) -> StoredEvent:
    read = event_from_json(given)
    event = read.event
    assert event.interval is not None  # noqa: S101 - what was fed has ended
    assert read.recorded_at is not None  # noqa: S101 - written with it
    return StoredEvent(
        id=0,
        uid=event.uid,
        type=event.type,
        interval=event.interval,
        recorded_at=read.recorded_at,
        region=event.region,
        subject=event.subject,
        features=event.features,
        agent=event.agent,
        parts=event.parts,
    )
