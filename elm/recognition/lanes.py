"""Lanes: strands that are at one position of the log go on together, and slow ones by themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future

from elm.log import Consumer, LogEntry, LoggedStore
from elm.recognition import checkpoint
from elm.recognition.fold import Fold, Harvest

SLOW = 1.0
"""Seconds in one call from which a strand goes on in a thread of its own: others need not wait for it."""
LARGE = 256 * 1024
"""Bytes from which a checkpoint is not taken with every batch but with every `LARGE_EVERY`-th."""
LARGE_EVERY = 16


class Lane:
    """Strands that are at one position of the log and go on together."""

    def __init__(self, fold: Fold, position: int) -> None:
        self.fold = fold
        self.position = position
        self.checkpoint_bytes: dict[str, int] = {}
        self.batches = 0
        self.at_once: int | None = None
        """Entries of a batch, where a slow strand goes by itself: few, to be stopped and heard of soon."""
        self.at_work: Future[tuple[list[LogEntry], Harvest]] | None = None

    @property
    def is_slow(self) -> bool:
        """Whether the others do not wait for it."""
        return self.at_once is not None

    @property
    def is_busy(self) -> bool:
        """Whether a thread is at it."""
        return self.at_work is not None and not self.at_work.done()

    def checkpoint(self, strand: str) -> bytes | None:
        """What is to be kept of a strand with this batch; None where it is large and was kept not long ago."""
        if self.checkpoint_bytes.get(strand, 0) >= LARGE and self.batches % LARGE_EVERY != 0:
            return None
        state = checkpoint.taken(self.fold, strand)
        self.checkpoint_bytes[strand] = len(state)
        return state

    def slow_strands(self) -> list[str]:
        """The strands that took too long in one call since this was asked last."""
        return [name for name, work in self.fold.works.items() if work.tally.longest_call() > SLOW]


def lane_as_left(
    store: LoggedStore, fold: Fold, strand: str, consumer: Consumer, *, batch: int, lost: Callable[[int], None]
) -> Lane:
    """A lane with the one strand of a fold as its consumer was left: its checkpoint, and what the log held since.

    `lost` is told how many events that the checkpoint refers to were forgotten meanwhile. A strand that cannot be
    restored, or fails when it is fed again, raises `RecognizerFailure`.
    """
    at = consumer.checkpoint
    if consumer.state is not None and (forgotten := checkpoint.restored(fold, strand, consumer.state, store.get)):
        lost(forgotten)
    while at < consumer.position:
        entries = store.log.read(at, min(batch, consumer.position - at))
        harvest = fold.take(entries)
        if harvest.failures:
            _, failure = harvest.failures[0]
            raise failure
        at = entries[-1].position
    return Lane(fold, at)


def joined(lanes: Sequence[Lane]) -> list[Lane]:
    """The lanes after those that have come to one position, and know the same, became one, but for slow ones."""
    found: list[Lane] = []
    first: dict[int, list[Lane]] = {}
    for lane in lanes:
        if lane.is_slow or lane.at_work is not None:
            found.append(lane)
            continue
        here = first.setdefault(lane.position, [])
        known = next((each for each in here if each.fold.may_adopt(lane.fold)), None)
        if known is None:
            here.append(lane)
            found.append(lane)
            continue
        known.fold.adopt(lane.fold)
        known.checkpoint_bytes |= lane.checkpoint_bytes
    return found
