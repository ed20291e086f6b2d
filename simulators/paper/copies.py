"""The buffered copies of all stored events from which cues are drawn (VI-B1a), in a file instead of in memory."""

from __future__ import annotations

import pickle
import tempfile
from array import array
from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Self, overload

from elm.errors import InvalidValue
from elm.event import StoredEvent


class Copies(Sequence[StoredEvent]):
    """Grows at its end and is read anywhere; a context manager, whose end removes the file.

    A hundred thousand events as objects would be searched by the garbage collector again and again
    while the clock runs.
    """

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed by __exit__
        self._ends = array("q", [0])

    def extend(self, events: Iterable[StoredEvent]) -> None:
        """Keep copies of further events."""
        self._file.seek(self._ends[-1])
        for event in events:
            written = self._file.write(pickle.dumps(event, pickle.HIGHEST_PROTOCOL))
            self._ends.append(self._ends[-1] + written)

    def __len__(self) -> int:
        return len(self._ends) - 1

    @overload
    def __getitem__(self, index: int) -> StoredEvent: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[StoredEvent]: ...

    def __getitem__(self, index: int | slice) -> StoredEvent | Sequence[StoredEvent]:
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        if not 0 <= index < len(self):
            raise IndexError(f"no copy {index}: there are {len(self):,}, counted from 0")
        self._file.seek(self._ends[index])
        found = pickle.loads(self._file.read(self._ends[index + 1] - self._ends[index]))  # noqa: S301 - written above
        if not isinstance(found, StoredEvent):
            raise InvalidValue(f"copy {index} is no event: was the temporary directory tampered with?")
        return found

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
