"""What the tests of forgetting share: snapshots of cups with numbers, as candidates, and a memory that forgets."""

from __future__ import annotations

from collections.abc import Sequence

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.forgetting import Candidate
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance, Snapshot

CUP = MemoryID(memory="Object", core_segment="Instance", provider_segment="ObjectLocalizer", entity="cup")
PLATE = CUP.with_entity("plate")
SECOND = 1_000_000


def snapshot(
    moment: int, *instances: object, entity: MemoryID = CUP, arrived: int = -1, sent: int = -1, confidence: float = 1.0
) -> Snapshot:
    """A snapshot at so many microseconds; each instance's data have one member, `value`."""
    metadata = Metadata(referenced=moment, arrived=arrived, sent=sent, confidence=confidence)
    made = []
    for value in instances:
        data = to_aron({"value": value})
        assert isinstance(data, Dict)
        made.append(Instance(data=data, metadata=metadata))
    return Snapshot(id=entity.with_timestamp(moment), instances=tuple(made))


def candidate(
    moment: int, value: object = 0.0, *, entity: MemoryID = CUP, used: int | None = None, size: int = 10
) -> Candidate:
    """A candidate with one instance, used last at its reference time unless said otherwise."""
    return Candidate(snapshot=snapshot(moment, value, entity=entity), used=moment if used is None else used, size=size)


class Remembering:
    """A long-term memory of IDs that can forget; those in `held` it does not let go for now."""

    def __init__(self, candidates: Sequence[Candidate]) -> None:
        self.snapshots = {each.id for each in candidates}
        self.held: set[MemoryID] = set()
        self.calls: list[int] = []

    def forget(self, snapshots: Sequence[MemoryID]) -> int:
        """Forget those that are here and not held."""
        self.calls.append(len(snapshots))
        going = self.snapshots.intersection(snapshots) - self.held
        self.snapshots -= going
        return len(going)
