"""Checkpoints: a strand's state as bytes, and back, with the events it refers to."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec

from elm.event import StoredEvent
from elm.exchange import event_from_json, event_to_json
from elm.interval import from_micros, to_micros
from elm.recognition.fold import Fold
from elm.recognizers.base import Fed


def taken(fold: Fold, strand: str) -> bytes:
    """The checkpoint of one strand of a fold.

    Events of the memory are named by id. Results, whose ids are not known yet, are written out: as they were
    derived here, so that a restart sees the same digits.
    """
    told, held = fold.snapshot(strand)
    stored = [[str(fed.event.uid), fed.event.id, fed.moment] for fed in held if fed.event.id]
    results = [[event_to_json(fed.event), fed.moment] for fed in held if not fed.event.id]
    return msgspec.json.encode({"state": told, "events": stored, "results": results})


def restored(fold: Fold, strand: str, checkpoint: bytes, get: Callable[[Sequence[int]], Sequence[StoredEvent]]) -> None:
    """Have the one strand of a fold as it was when `checkpoint` was taken; `get` gives events by id."""
    told = msgspec.json.decode(checkpoint)
    held: dict[str, Fed] = {}
    moments = {number: moment for _, number, moment in told["events"]}
    for event in get(list(moments)):
        held[str(event.uid)] = _fed(event, moments[event.id])
    for given, moment in told["results"]:
        held[given["uid"]] = _fed(_result(given, moment), moment)
    fold.resume(strand, told["state"], held)


def _result(given: dict[str, object], moment: int) -> StoredEvent:
    event = event_from_json(given).event
    assert event.interval is not None  # noqa: S101 - what was fed has ended
    return StoredEvent(
        id=0,
        uid=event.uid,
        type=event.type,
        interval=event.interval,
        recorded_at=from_micros(moment),
        region=event.region,
        subject=event.subject,
        features=event.features,
        agent=event.agent,
        parts=event.parts,
    )


def _fed(event: StoredEvent, moment: int) -> Fed:
    return Fed(event=event, moment=moment, begin=to_micros(event.interval.begin))
