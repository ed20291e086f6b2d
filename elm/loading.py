"""Loading events from JSON Lines: a line that cannot be kept is set aside with its reason, the rest are kept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from elm.errors import ElmError, InvalidValue
from elm.exchange import event_from_json, is_tombstone, parse_json, tombstone_from_json, type_from_json
from elm.lines import Waiting, lines_as_they_come
from elm.store import Arrival
from elm.taxonomy import EventType
from elm.tombstone import RunTombstone, Tombstone
from elm.writer import Writer

TOMBSTONES_AT_ONCE = 1_000
"""Tombstones that are kept in one transaction."""
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedLine:
    """A line that was not kept, as it stood in the file, counted from 1, and why."""

    number: int
    reason: str
    line: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class FileReport:
    """What became of a file: events read, kept as new, there already, refused, and fields passed over by name.

    `tombstones` were kept as new; those that were there already, or refused, count with the events.
    """

    read: int
    new: int
    existing: int
    refused: int
    ignored: Mapping[str, int]
    tombstones: int = 0


def load_lines(
    writer: Writer,
    lines: Iterable[bytes | Waiting],
    *,
    refused: Callable[[RefusedLine], None],
    progress: Callable[[int], None] | None = None,
) -> FileReport:
    """Keep the event, or the tombstone, on each line; blank lines are passed over.

    `refused` is told of each line that could not be kept, in the order of the lines; `progress` the bytes dealt
    with, after each batch; at a `Waiting` a batch ends. Times of recording are kept; `id` and `wholes` of a result
    are counted and passed over.
    """

    def batch_done(_: int = 0) -> None:
        for line in reading.finish_batch():
            refused(line)
        if progress is not None:
            progress(reading.bytes)

    reading = _Reading(lines, writer, pause=batch_done)
    report = writer.load(reading.arrivals(), refused=reading.refuse, progress=batch_done)
    # Lines that were refused behind the last event belong to no batch.
    batch_done()
    return FileReport(
        read=reading.events,
        new=report.new,
        existing=report.existing + reading.existing_tombstones,
        refused=reading.refused,
        ignored=dict(reading.ignored),
        tombstones=reading.tombstones,
    )


def load_stream(
    writer: Writer,
    stream: BinaryIO,
    *,
    refused_file: Path,
    refused: Callable[[RefusedLine], None],
    progress: Callable[[int], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> FileReport:
    """Keep the events of a file or pipe, to its end or until `stopped` says so, which is asked between two lines.

    What a pipe has given is kept after a second when it makes us wait. Refused lines go to `refused_file` as they
    stood, ready to be mended.

    They are written beside it, to its name with `.part` behind, and take its place at the end: until then the file
    is the one that an earlier load left. It is gone when nothing was refused, and stays as it was when the load fails
    before any line is refused. A device or a pipe of that name is written to as it is.
    """
    with _replaced_at_the_end(refused_file) as kept:

        def set_aside(line: RefusedLine) -> None:
            kept.write(line.line + b"\n")
            kept.flush()
            refused(line)

        lines = lines_as_they_come(stream, stopped=stopped)
        return load_lines(writer, lines, refused=set_aside, progress=progress)


def read_types(lines: Iterable[bytes]) -> list[EventType]:
    """The event types on these lines; the first line that is none of them refuses all, for others may stand on it."""
    types: list[EventType] = []
    for number, line in enumerate(lines, start=1):
        text = _text(number, line)
        if not text:
            continue
        try:
            types.append(type_from_json(parse_json(text, what="the line")))
        except ElmError as error:
            raise InvalidValue(f"line {number}: {error}. No type was added") from error
    return types


@contextmanager
def _replaced_at_the_end(file: Path) -> Iterator[BinaryIO]:
    """Where the new contents of `file` are written: without any it goes, and where an error left none it stays."""
    if file.exists() and not file.is_file():
        with file.open("wb") as stream:
            yield stream
        return
    # Behind a link is the file that is meant.
    file = file.resolve()
    part = file.with_name(f"{file.name}.part")
    with part.open("wb") as stream:
        try:
            yield stream
        finally:
            is_written = stream.tell() > 0
            if is_written:
                part.replace(file)
            else:
                part.unlink()
    if not is_written:
        file.unlink(missing_ok=True)


class _Reading:
    """The lines of one load as arrivals, remembering for a batch which line each came from."""

    def __init__(self, lines: Iterable[bytes | Waiting], writer: Writer, *, pause: Callable[[], None]) -> None:
        self._lines = lines
        self._writer = writer
        self._pause = pause
        self._tombstones: list[tuple[int, bytes, Tombstone | RunTombstone]] = []
        self._origins: dict[int, tuple[int, bytes]] = {}
        self._refused: list[RefusedLine] = []
        self.bytes = self.events = self.refused = self.tombstones = self.existing_tombstones = 0
        self.ignored: Counter[str] = Counter()

    def arrivals(self) -> Iterator[Arrival | Waiting]:
        number = 0
        for line in self._lines:
            if not isinstance(line, Waiting):
                number += 1
                self.bytes += len(line)
                text = _text(number, line)
                if text and (arrival := self._arrival(number, text)) is not None:
                    yield arrival
                continue
            self._keep_tombstones()
            if self._origins:
                yield line
            else:
                # There is no batch to end, but refused lines may be waiting to be told of.
                self._pause()
        self._keep_tombstones()

    def _arrival(self, number: int, line: bytes) -> Arrival | None:
        self.events += 1
        try:
            given = parse_json(line, what="the line")
            if is_tombstone(given):
                self._tombstones.append((number, line, tombstone_from_json(given)))
                if len(self._tombstones) == TOMBSTONES_AT_ONCE:
                    self._keep_tombstones()
                return None
            read = event_from_json(given)
        except ElmError as error:
            self._refused.append(RefusedLine(number=number, reason=str(error), line=line))
            return None
        self.ignored.update(read.ignored)
        if read.event.parts:
            # Some of them may be tombstones.
            self._keep_tombstones()
        arrival = Arrival(event=read.event, recorded_at=read.recorded_at)
        # By identity: two lines may hold equal events. The batch keeps its arrivals alive until it is done.
        self._origins[id(arrival)] = number, line
        return arrival

    def _keep_tombstones(self) -> None:
        if not self._tombstones:
            return
        report = self._writer.keep_tombstones([tombstone for _, _, tombstone in self._tombstones])
        self.tombstones += report.new
        self.existing_tombstones += report.existing
        for refusal in report.refused:
            number, line, _ = self._tombstones[refusal.index]
            self._refused.append(RefusedLine(number=number, reason=refusal.reason, line=line))
        self._tombstones.clear()

    def refuse(self, arrival: Arrival, reason: str) -> None:
        number, line = self._origins[id(arrival)]
        self._refused.append(RefusedLine(number=number, reason=reason, line=line))

    def finish_batch(self) -> list[RefusedLine]:
        found = sorted(self._refused, key=lambda line: line.number)
        self.refused += len(found)
        self._refused.clear()
        self._origins.clear()
        return found


def _text(number: int, line: bytes) -> bytes:
    """What stands on the line; nothing where it is blank."""
    text = line.removeprefix(_BYTE_ORDER_MARK) if number == 1 else line
    return text.removesuffix(b"\n") if text.strip() else b""
