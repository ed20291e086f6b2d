"""What the tests of long-term memory share: elm memories of every kind, servers in front of them, and faults."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from armem_bridge.aron.arrays import from_numpy
from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.long_term import Consolidation, LongTermMemory
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import EntityUpdate, MemoryServer, Snapshot
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance
from elm.app import Memory
from elm.storage.memory import MemoryStore
from elm.store import Arrival, BatchReport, Committed
from tests.armem.working.scenes import CUP, NOW, object_memory

QUICK = Consolidation(least_pause=0.001, most_pause=0.01, wait=0.2, patience=0.0)
"""Settings under which nothing waits long."""


def in_process() -> Memory:
    """An empty elm memory in this process."""
    return Memory(MemoryStore())


@contextmanager
def behind(archive: LongTermMemory, **options: Any) -> Iterator[MemoryServer]:
    """A memory server with this archive behind it; the archive is closed after it."""
    with archive, object_memory(archive=archive, **options) as server:
        archive.serve(server)
        yield server


def matrix(x: float, y: float, yaw: float = 0.0, kind: str = "float32") -> np.ndarray[Any, Any]:
    """A pose in the plane as a matrix of 4 x 4."""
    pose = np.eye(4, dtype=kind)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:2, 3] = x, y
    return pose


def posed(
    moment: int, x: float, y: float, *, entity: MemoryID = CUP, sent: int = -1, yaw: float = 0.0, key: str = "pose"
) -> EntityUpdate:
    """An update whose data have a pose in millimetres."""
    data = Dict({key: from_numpy(matrix(x, y, yaw))})
    return EntityUpdate(entity=entity, instances=(data,), referenced=moment, sent=sent)


def snapshot_with(data: Dict | None, moment: int = 10, *, entity: MemoryID = CUP) -> Snapshot:
    """A snapshot with one instance."""
    metadata = Metadata(referenced=moment, arrived=NOW)
    return Snapshot(id=entity.with_timestamp(moment), instances=(Instance(data=data, metadata=metadata),))


def as_dict(value: dict[str, Any]) -> Dict:
    """A Python dict as ARON has it."""
    found = to_aron(value)
    assert isinstance(found, Dict)
    return found


class FailingStore(MemoryStore):
    """A store in this process whose writes fail as they are told to."""

    def __init__(self) -> None:
        super().__init__()
        self.errors: list[Exception] = []
        """The next writes fail with these, the last one first."""
        self.poison: dict[str, Exception] = {}
        """Whatever is written together with a snapshot of one of these entities fails."""
        self.after = False
        """Whether the write is made before it fails, as when the connection breaks while it is acknowledged."""

    def load(self, arrivals: Sequence[Arrival]) -> BatchReport:
        self._fail(arrivals, lambda: super(FailingStore, self).load(arrivals))
        return super().load(arrivals)

    def commit(self, arrival: Arrival) -> Committed:
        return self.commit_all([arrival])[0]

    def commit_all(self, arrivals: Sequence[Arrival]) -> list[Committed]:
        self._fail(arrivals, lambda: super(FailingStore, self).commit_all(arrivals))
        return super().commit_all(arrivals)

    def _fail(self, arrivals: Sequence[Arrival], write: Any) -> None:
        for arrival in arrivals:
            error = self.poison.get(str(arrival.event.value("armem.entity")))
            if error is not None:
                raise error
        if self.errors:
            if self.after:
                write()
            raise self.errors.pop()
