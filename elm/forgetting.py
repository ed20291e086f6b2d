"""Forgetting: events that a cue or their uids name go, and what they were parts of stays as it was."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from uuid import UUID

from uuid_utils.compat import uuid7

from elm.arguments import as_count, as_uid, check_callable
from elm.cues.algebra import Cue, UidCue
from elm.errors import InvalidValue
from elm.log import Consumer, LoggedStore
from elm.query import MOST_ID, Order, Query
from elm.recognition.checkpoint import held_events
from elm.recognition.reports import StrandReport
from elm.tombstone import Forgotten

FORGET_BATCH = 2_000
"""Events that are forgotten in one transaction."""
_UIDS_AT_ONCE = 1_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ForgettingReport:
    """What a forgetting did, or a dry run would do.

    Of the `events` that went, `tombstones` are parts of remaining ones and left tombstones of their own; the rest
    has one together, that of the forgetting run, `run`, which is None where nothing went. `dissolved` tombstones of
    earlier forgetting runs went because no remaining event has them as a part any more. Not forgotten: what is
    `still_open`, and what is `held` by recognizers, which have not finished with it. `unknown` uids name no event.
    `bytes` is how much the events took, roughly and without indexes; `types` counts them by type.
    """

    run: UUID | None
    events: int
    tombstones: int
    dissolved: int
    still_open: int
    held: int
    unknown: int
    bytes: int
    types: Mapping[str, int] = field(default_factory=dict)


def forget(
    store: LoggedStore,
    what: Cue | Iterable[UUID | str],
    *,
    dry_run: bool = False,
    batch: int = FORGET_BATCH,
    progress: Callable[[int], None] | None = None,
) -> ForgettingReport:
    """Forget the events that match a cue, or that have these uids, as of now; with `dry_run` only say what would go.

    At most `batch` events go in one transaction, wholes before their parts; stopped or killed between two, what went
    is gone, and the same call again forgets the rest. Events still going on stay, and so do those that a recognizer
    holds: it would lose what it has not finished. `progress` is told the number of events dealt with.
    """
    size = as_count(batch, what="a batch of a forgetting", least=1, most=MOST_ID)
    check_callable(progress, what="progress is a function that a forgetting tells what it does")
    ids, unknown = _selected(store, what)
    holding = _held(store.log.consumers()) if ids else set()
    going = sorted((number for number in ids if number not in holding), reverse=True)
    at, run = datetime.now(UTC), uuid7()
    told: list[Forgotten] = []
    if dry_run:
        told.append(store.would_forget(going))
    else:
        for start in range(0, len(going), size):
            told.append(store.forget(going[start : start + size], run=run, at=at))
            if progress is not None:
                progress(min(start + size, len(going)))
    return _report(told, None if dry_run else run, held=len(ids) - len(going), unknown=unknown)


def _selected(store: LoggedStore, what: Cue | Iterable[UUID | str]) -> tuple[set[int], int]:
    """The ids of the events that are meant, and how many uids name none."""
    if isinstance(what, Cue):
        return set(store.ids(Query(cue=what, order=Order.ID))), 0
    if isinstance(what, str) or not isinstance(what, Iterable):
        raise InvalidValue(f"what to forget is a cue (elm.cues) or several uids, not {what!r:.80}")
    uids = list(dict.fromkeys(as_uid(each, what="what names an event to forget") for each in what))
    found: set[int] = set()
    for start in range(0, len(uids), _UIDS_AT_ONCE):
        named = UidCue(uids=tuple(uids[start : start + _UIDS_AT_ONCE]))
        found.update(store.ids(Query(cue=named, order=Order.ID)))
    return found, len(uids) - len(found)


def _held(consumers: Iterable[Consumer]) -> set[int]:
    """The ids of the events that checkpoints of recognizers refer to."""
    held: set[int] = set()
    for consumer in consumers:
        if consumer.state is not None and StrandReport.of(consumer) is not None:
            held.update(held_events(consumer.state))
    return held


def _report(told: Iterable[Forgotten], run: UUID | None, *, held: int, unknown: int) -> ForgettingReport:
    pieces = list(told)
    types: Counter[str] = Counter()
    for piece in pieces:
        types.update(piece.types)
    events = sum(piece.events for piece in pieces)
    return ForgettingReport(
        run=run if events else None,
        events=events,
        tombstones=sum(piece.tombstones for piece in pieces),
        dissolved=sum(piece.dissolved for piece in pieces),
        still_open=sum(piece.still_open for piece in pieces),
        held=held,
        unknown=unknown,
        bytes=sum(piece.bytes for piece in pieces),
        types=dict(sorted(types.items())),
    )
