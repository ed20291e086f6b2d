"""Commits, new segments, and what became of them, on the wire in both directions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from armem_bridge.ice.generation import Generation
from armem_bridge.ice.making import blank, first_member, maker
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire.aron import AronWire
from armem_bridge.ice.wire.identifiers import IdentifierWire, not_set
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET
from armem_bridge.working.admission import why_malformed
from armem_bridge.working.commit import Commit, CommitResult, EntityUpdate, UpdateResult
from armem_bridge.working.segments import AddSegment, SegmentResult

TIMES: Final = {Generation.THIRD: ("timeCreated", "timeSent"), Generation.FOURTH: ("referencedTime", "sentTime")}
"""What the generations call the referenced and the sent time of an update."""


GREATEST_FLOAT: Final = (2 - 2**-23) * 2.0**127
"""The greatest number of 32 bits, which confidences have on the wire."""


class CommitWire:
    """Commits to and from those of the loaded slice files."""

    def __init__(self, words: Vocabulary, aron: AronWire, identifiers: IdentifierWire) -> None:
        self._aron, self._ids = aron, identifiers
        data = words.data
        self._referenced, self._sent = TIMES[words.generation]
        update = words.member(data, "EntityUpdate")
        self._new_update = blank(update, "entityID", "instancesData", "confidence", self._referenced, self._sent)
        self._new_commit = blank(words.member(data, "Commit"), "updates")
        self._new_commit_result = blank(words.member(data, "CommitResult"), "results")
        self._new_update_result = blank(words.update_result, "success", "errorMessage", "snapshotID")
        self._snapshot_as_text = isinstance(words.update_result().snapshotID, str)
        self._arrived = first_member(words.update_result, "arrivedTime", "timeArrived")
        segment = words.member(data, "AddSegmentInput")
        self._segment = maker(segment, "coreSegmentName", "providerSegmentName", "clearWhenExists")
        self._segment_result = maker(words.segment_result, "success", "errorMessage", "segmentID")
        self._segment_as_text = isinstance(words.segment_result().segmentID, str)
        self._write_arrived, self._read_arrived = self._arrival(
            getattr(words.update_result(), self._arrived) if self._arrived else None
        )

    # Updates, one by one, for one that is malformed does not spoil the others

    def read_update(self, wire: Any) -> EntityUpdate:
        """The update; its referenced time is negative where the client set none.

        Raises `MalformedMessage`, `InvalidData` or `InvalidMemoryID`.
        """
        return EntityUpdate(
            entity=self._ids.read_id(wire.entityID),
            instances=tuple(map(self._aron.read, wire.instancesData)),
            referenced=getattr(wire, self._referenced).timeSinceEpoch.microSeconds,
            sent=not_set(getattr(wire, self._sent).timeSinceEpoch.microSeconds),
            confidence=wire.confidence,
        )

    def why_unsendable(self, update: EntityUpdate) -> str:
        """Why an update cannot be sent, to whatever memory, and what to do about it; empty when it can."""
        why = why_malformed(update)
        if not why and abs(update.confidence) > GREATEST_FLOAT:
            return (
                f"the confidence of the update of {update.entity} is sent in 32 bits, which {update.confidence:g} "
                f"does not fit into: give one of 0 to 1"
            )
        return why

    def write_commit(self, commit: Commit, *, sent: int = NOT_SET) -> Any:
        """The commit as the slice files have it; updates that do not say when they were sent are sent at `sent`."""
        made = self._new_commit()
        made.updates = [self._write_update(update, sent) for update in commit.updates]
        return made

    def _write_update(self, update: EntityUpdate, sent: int) -> Any:
        ids, write = self._ids, self._aron.write
        made = self._new_update()
        made.entityID = ids.write_id(update.entity)
        made.instancesData = [write(data) for data in update.instances]
        made.confidence = update.confidence
        setattr(made, self._referenced, ids.write_time(update.referenced))
        setattr(made, self._sent, ids.write_time(update.sent if update.sent >= 0 else sent))
        return made

    def write_result(self, results: Iterable[UpdateResult]) -> Any:
        """What became of a commit, one result for each update in their order."""
        made = self._new_commit_result()
        made.results = [self._write_update_result(result) for result in results]
        return made

    def read_result(self, wire: Any) -> CommitResult:
        """What became of a commit."""
        return CommitResult(results=tuple([self._read_update_result(result) for result in wire.results]))

    def _write_update_result(self, result: UpdateResult) -> Any:
        made = self._new_update_result()
        made.success, made.errorMessage = result.success, result.error
        snapshot = result.snapshot
        if snapshot is not None:
            made.snapshotID = str(snapshot) if self._snapshot_as_text else self._ids.write_id(snapshot)
        if self._arrived is not None:
            setattr(made, self._arrived, self._write_arrived(result.arrived))
        return made

    def _read_update_result(self, wire: Any) -> UpdateResult:
        return UpdateResult(
            success=wire.success,
            error=wire.errorMessage,
            snapshot=self._read_name(wire.snapshotID) if wire.success else None,
            arrived=self._read_arrived(getattr(wire, self._arrived)) if self._arrived is not None else NOT_SET,
        )

    def _arrival(self, example: Any) -> tuple[Callable[[int], Any], Callable[[Any], int]]:
        """How the arrived time is written and read: a number, a duration since 1970, or a time, by the release."""
        if hasattr(example, "timeSinceEpoch"):
            return self._ids.write_time, self._ids.read_time
        if hasattr(example, "microSeconds"):
            return self._ids.write_duration, self._ids.read_duration
        return int, int

    def _read_name(self, wire: Any) -> MemoryID:
        return MemoryID.parse(wire) if isinstance(wire, str) else self._ids.read_id(wire)

    # Segments

    def read_segment(self, wire: Any) -> AddSegment:
        """A provider's wish for a segment. Types are not read: no released client sends any."""
        return AddSegment(
            core_segment=wire.coreSegmentName,
            provider_segment=wire.providerSegmentName,
            clear_when_exists=wire.clearWhenExists,
        )

    def why_no_wish(self, wish: AddSegment) -> str:
        """Why a wish for a segment cannot be sent, and what to do about it; empty when it can."""
        what = f"the provider segment {wish.provider_segment!r:.80} of {wish.core_segment!r:.80}"
        if not isinstance(wish.core_segment, str) or not isinstance(wish.provider_segment, str):
            return f"{what} cannot have this name: the names of segments are text"
        if wish.aron_type is not None:
            return (
                f"{what} cannot get its type from here, for types of segments do not travel: leave it out, "
                f"or give the core segment the type where the memory server is defined"
            )
        return ""

    def write_segments(self, wishes: Iterable[AddSegment]) -> list[Any]:
        """Wishes for segments as the slice files have them."""
        return [
            self._segment(
                coreSegmentName=wish.core_segment,
                providerSegmentName=wish.provider_segment,
                clearWhenExists=bool(wish.clear_when_exists),
            )
            for wish in wishes
        ]

    def write_segment_results(self, results: Iterable[SegmentResult]) -> list[Any]:
        """What became of wishes for segments."""
        return [self._write_segment_result(result) for result in results]

    def read_segment_results(self, wires: Sequence[Any]) -> tuple[SegmentResult, ...]:
        """What became of wishes for segments."""
        return tuple(
            SegmentResult(
                success=wire.success,
                error=wire.errorMessage,
                segment=self._read_name(wire.segmentID) if wire.success else None,
            )
            for wire in wires
        )

    def _write_segment_result(self, result: SegmentResult) -> Any:
        members: dict[str, Any] = {}
        if result.segment is not None:
            segment = result.segment
            members["segmentID"] = str(segment) if self._segment_as_text else self._ids.write_id(segment)
        return self._segment_result(success=result.success, errorMessage=result.error, **members)
