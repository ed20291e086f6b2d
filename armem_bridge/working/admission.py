"""Admission: what updates and segments must be like for a memory to take them, and the words for those that are not."""

from __future__ import annotations

import math
from collections.abc import Sequence

from armem_bridge.aron.data import Data, Dict, List, NDArray, String
from armem_bridge.aron.inheritance import faults
from armem_bridge.aron.realization import realizes
from armem_bridge.memory_id import InvalidMemoryID, MemoryID
from armem_bridge.moments import GREATEST, INVALID
from armem_bridge.working.commit import Commit, EntityUpdate
from armem_bridge.working.refusals import InvalidCommit
from armem_bridge.working.segments import AddSegment, why_no_segment_type
from armem_bridge.working.working_memory import WorkingMemory


def check_commit(commit: Commit) -> None:
    """Raise `InvalidCommit` for what is no commit; what is wrong with single updates is told by `why_refused`."""
    if not isinstance(commit, Commit):
        raise InvalidCommit(
            f"what is committed is a Commit, not a {type(commit).__name__}: make one with Commit(updates=[...])"
        )


def check_wishes(wishes: Sequence[AddSegment]) -> None:
    """Raise `InvalidCommit` for what are no wishes for segments."""
    if not isinstance(wishes, Sequence) or not all(isinstance(wish, AddSegment) for wish in wishes):
        raise InvalidCommit(
            f"segments are wished for by a list of AddSegment, not by {wishes!r:.80}: put each wish into one list"
        )


def why_malformed(update: EntityUpdate) -> str:
    """Why no memory whatever takes an update, and what to do about it; empty when some may.

    That the referenced time is not set is no fault here, for some memories then take that of the arrival.
    """
    return _about_kind(update) or _about_times(update, INVALID) or _about_form(update)


def why_refused(update: EntityUpdate, memory: WorkingMemory, size_limit: int) -> str:
    """Why `memory` does not take an update, and what to do about it; empty when it does."""
    return (
        _about_kind(update)
        or _about_place(update.entity, memory)
        or _about_times(update, 0)
        or _about_form(update)
        or _about_size(update, size_limit)
        or _about_type(update, memory)
    )


def _about_kind(update: EntityUpdate) -> str:
    if not isinstance(update, EntityUpdate):
        return f"the updates of a commit are EntityUpdates, and this is a {type(update).__name__}: {update!r:.80}"
    if not isinstance(update.entity, MemoryID):
        return (
            f"an update is of an entity, named by a MemoryID, not by a {type(update.entity).__name__}: "
            f"make text one with MemoryID.parse"
        )
    return ""


def _about_place(entity: MemoryID, memory: WorkingMemory) -> str:
    if entity.memory != memory.id.memory:
        return f"the update of {entity} is for the memory {entity.memory!r:.80}; this is {memory.id.memory!r:.80}"
    if not (entity.core_segment and entity.provider_segment and entity.entity):
        return (
            f"the update of {entity} names no entity (core segment {entity.core_segment!r:.80}, "
            f"provider segment {entity.provider_segment!r:.80}, entity {entity.entity!r:.80}): name all three"
        )
    if memory.core(entity.core_segment) is None:
        return (
            f"the memory {entity.memory!r:.80} has no core segment {entity.core_segment!r:.80}: "
            f"it has {', '.join(memory.names(memory.id)) or 'none'}. Core segments are defined with the memory server"
        )
    provider = memory.provider(entity.core_segment, entity.provider_segment)
    if provider is not None and provider.read_only:
        return (
            f"the provider segment {entity.provider_segment!r:.80} of {entity.core_segment!r:.80} holds prior "
            f"knowledge, which is read only: commit to a provider segment of your own"
        )
    return ""


def _about_times(update: EntityUpdate, least: int) -> str:
    if type(update.referenced) is not int or not least <= update.referenced <= GREATEST:
        return (
            f"the update of {update.entity} has no valid referenced time ({update.referenced!r:.80}): give the time "
            f"that the data are about, in microseconds since 1970 or as a datetime with its zone"
        )
    if type(update.sent) is not int or update.sent > GREATEST:
        return (
            f"the sent time of the update of {update.entity} is an integer of 64 bits, "
            f"not {update.sent!r:.80}: -1 is none"
        )
    return ""


def _about_form(update: EntityUpdate) -> str:
    confidence = update.confidence
    if isinstance(confidence, bool) or not isinstance(confidence, float | int) or not _is_finite(confidence):
        return f"the confidence of the update of {update.entity} is a finite number, not {confidence!r:.80}"
    if type(update.instances) is not tuple:
        return (
            f"the instances of the update of {update.entity} are a tuple of ARON Dicts, "
            f"not a {type(update.instances).__name__}"
        )
    for index, data in enumerate(update.instances):
        if data is not None and type(data) is not Dict:
            return (
                f"instance {index} of the update of {update.entity} is a {type(data).__name__}, "
                f"and the data of an instance are an ARON Dict or null"
            )
    return ""


def _about_size(update: EntityUpdate, limit: int) -> str:
    size = sum(map(size_of, update.instances))
    if size > limit:
        return (
            f"the update of {update.entity} has {size:,} bytes of data, over the limit of {limit:,}: "
            f"send less at once, or raise the memory server's limit"
        )
    return ""


def _about_type(update: EntityUpdate, memory: WorkingMemory) -> str:
    wanted = memory.type_for(update.entity.core_segment, update.entity.provider_segment)
    if wanted is None:
        return ""
    for index, data in enumerate(update.instances):
        realization = realizes(data, wanted)
        if not realization:
            return (
                f"instance {index} of the update of {update.entity} is not of the type of its segment: "
                f"{realization.explain()}"
            )
    return ""


def _is_finite(number: float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:
        return False


def why_no_segment(wish: AddSegment, memory: WorkingMemory) -> str:
    """Why `memory` does not add a segment, and what to do about it; empty when it does. Called under its lock."""
    what = f"the provider segment {wish.provider_segment!r:.80} of {wish.core_segment!r:.80}"
    core = memory.core(wish.core_segment)
    if core is None:
        return (
            f"the memory {memory.id.memory!r:.80} has no core segment {wish.core_segment!r:.80}, and clients add none"
        )
    if not wish.provider_segment:
        return f"{what} has no name: give it one"
    try:
        memory.id.with_provider_segment(wish.provider_segment)
    except InvalidMemoryID as error:
        return f"{what} cannot have this name: {error}"
    no_type = why_no_segment_type(wish.aron_type)
    if no_type:
        return f"{what} {no_type}"
    wrong = faults(core.aron_type, wish.aron_type) if core.aron_type and wish.aron_type else ()
    if wrong:
        return f"the type of {what} does not extend the core segment's: {'; '.join(wrong)}"
    known = memory.provider(wish.core_segment, wish.provider_segment)
    if known is None:
        return ""
    if known.read_only and (wish.clear_when_exists or wish.aron_type not in (None, known.aron_type)):
        return f"{what} holds prior knowledge, which is read only: take another name"
    if wish.aron_type not in (None, known.aron_type) and known.entities and not wish.clear_when_exists:
        return f"{what} has entities and another type: clear it, or take another name"
    return ""


def size_of(data: Data | None) -> int:
    """About how many bytes a data object takes: its arrays and texts, the names in it, and eight for all else."""
    if type(data) is NDArray:
        return len(data.data)
    if type(data) is Dict:
        return sum(len(name) + size_of(element) for name, element in data.elements.items())
    if type(data) is List:
        return sum(map(size_of, data.elements))
    if type(data) is String:
        return len(data.value)
    return 8
