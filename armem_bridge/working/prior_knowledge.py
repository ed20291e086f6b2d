"""Prior knowledge: what the programmer knows already, read from files when a memory server starts (section 4.4).

A file is JSON in UTF-8 and fills one provider segment, which nobody can commit to:

    {"core_segment": "Class", "provider_segment": "PriorKnowledge", "type": {...},
     "entities": {"cup": [{"referenced": 0, "confidence": 1.0, "instances": [{"mass": 0.2}]}]}}

`type` is a type object as `armem_bridge.aron.textual` writes it, and may be missing. So may `referenced`
(0, for what was always so) and `confidence` (1). The instances are plain JSON, converted as the type of the
segment says; what plain JSON cannot say (arrays without a type, 64-bit integers ...) stands under `aron`
in place of `instances`, in the JSON form of ARON data objects.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Data
from armem_bridge.aron.inheritance import faults
from armem_bridge.aron.textual import from_json, type_from_json
from armem_bridge.errors import ArmemError
from armem_bridge.moments import GREATEST
from armem_bridge.working.admission import why_refused
from armem_bridge.working.commit import EntityUpdate
from armem_bridge.working.refusals import InvalidPriorKnowledge
from armem_bridge.working.segments import why_no_segment_type
from armem_bridge.working.versions import snapshot_of
from armem_bridge.working.working_memory import Provider, WorkingMemory


class _Snapshot(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    referenced: int = 0
    confidence: float = 1.0
    instances: list[dict[str, Any] | None] | None = None
    aron: list[Any] | None = None


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    core_segment: str
    provider_segment: str
    entities: dict[str, list[_Snapshot]]
    type: Any = None


def load_prior_knowledge(path: Path, memory: WorkingMemory, *, arrived: int) -> None:
    """Fill a provider segment of `memory` with the prior knowledge of a file, for reading only.

    Raises `InvalidPriorKnowledge`, naming the file and the place in it, when it cannot be read, the memory
    has no such core segment or has that provider segment already, or the data are not of its type.
    """
    try:
        file = msgspec.json.decode(path.read_bytes(), type=_File)
    except (OSError, msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise InvalidPriorKnowledge(f"the prior knowledge in {path} cannot be read: {error}") from error
    provider = _provider(path, file, memory)
    with memory.lock:
        memory.put_provider(file.core_segment, file.provider_segment, provider)
    segment = memory.id.with_core_segment(file.core_segment).with_provider_segment(file.provider_segment)
    for name, snapshots in file.entities.items():
        for number, given in enumerate(snapshots):
            where = f"entity {name!r:.80}, snapshot {number} in {path}"
            try:
                update = EntityUpdate(
                    entity=segment.with_entity(name),
                    instances=_instances(given, memory, file),  # type: ignore[arg-type]
                    referenced=given.referenced,
                    confidence=given.confidence,
                )
            except ArmemError as error:
                raise InvalidPriorKnowledge(f"{where}: {error}") from error
            why = why_refused(update, memory, GREATEST)
            if why:
                raise InvalidPriorKnowledge(f"{where}: {why}")
            with memory.lock:
                left = memory.put(snapshot_of(update, arrived=arrived))
            if left:
                raise InvalidPriorKnowledge(
                    f"{where}: there is no room for it: two snapshots have one referenced time, "
                    f"or there are more than the history limit of the segment"
                )
    provider.read_only = True


def _provider(path: Path, file: _File, memory: WorkingMemory) -> Provider:
    core = memory.core(file.core_segment)
    if core is None:
        raise InvalidPriorKnowledge(
            f"the prior knowledge in {path} is for the core segment {file.core_segment!r:.80}, "
            f"which the memory {memory.id} does not have: define it, or correct the file"
        )
    if memory.provider(file.core_segment, file.provider_segment) is not None:
        raise InvalidPriorKnowledge(
            f"the prior knowledge in {path} is for the provider segment {file.provider_segment!r:.80}, "
            f"which another file filled: join the two files, or give the segments two names"
        )
    if file.type is None:
        return Provider(None)
    try:
        own = type_from_json(file.type)
    except ArmemError as error:
        raise InvalidPriorKnowledge(f"the type in {path} cannot be read: {error}") from error
    no_type = why_no_segment_type(own)
    if no_type:
        raise InvalidPriorKnowledge(f"the provider segment {file.provider_segment!r:.80} in {path} {no_type}")
    wrong = faults(core.aron_type, own) if core.aron_type is not None else ()
    if wrong:
        raise InvalidPriorKnowledge(f"the type in {path} does not extend its core segment's: {'; '.join(wrong)}")
    return Provider(own)


def _instances(given: _Snapshot, memory: WorkingMemory, file: _File) -> tuple[Data | None, ...]:
    if (given.instances is None) == (given.aron is None):
        raise InvalidPriorKnowledge("a snapshot has either instances (plain JSON) or aron (ARON data objects)")
    if given.aron is not None:
        return tuple(map(from_json, given.aron))
    wanted = memory.type_for(file.core_segment, file.provider_segment)
    return tuple(to_aron(instance, wanted) for instance in given.instances or ())
