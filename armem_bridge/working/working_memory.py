"""Working memory: the segments of one memory and the histories in them, in main memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from threading import Lock

from sortedcontainers import SortedDict

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.access_statistics import UNUSED, Usage
from armem_bridge.working.archive import Evicted
from armem_bridge.working.history import History
from armem_bridge.working.limits import HistoryLimits
from armem_bridge.working.refusals import InvalidServer
from armem_bridge.working.segments import CoreSegmentDefinition, why_no_segment_type
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.sorted_history import SortedHistory
from armem_bridge.working.tree import Memory


class Provider:
    """A provider segment: its own type, whether clients may write to it, and its entities."""

    def __init__(self, aron_type: TypeObject | None, *, read_only: bool = False) -> None:
        self.aron_type = aron_type
        self.read_only = read_only
        self.entities: SortedDict = SortedDict()


class Core:
    """A core segment: its type and its provider segments."""

    def __init__(self, aron_type: TypeObject | None) -> None:
        self.aron_type = aron_type
        self.providers: SortedDict = SortedDict()


class WorkingMemory:
    """A `Source` in main memory, and the only place where its contents change.

    Changes happen under `lock`, taken by the caller, so that what belongs together can be done together;
    reading takes it for as long as names or references are copied. An entity is read at one moment; two
    entities of one query are read at two.
    """

    def __init__(self, name: str, cores: Iterable[CoreSegmentDefinition], limits: HistoryLimits) -> None:
        self.id = MemoryID(memory=name)
        self.lock = Lock()
        self._limits = limits
        self._cores: SortedDict = SortedDict()
        for definition in cores:
            if not isinstance(definition, CoreSegmentDefinition):
                raise InvalidServer(
                    f"a core segment of the memory {name!r:.80} is a CoreSegmentDefinition, not {definition!r:.80}: "
                    f"make a name one with CoreSegmentDefinition(name=...)"
                )
            if not definition.name:
                raise InvalidServer(f"a core segment of the memory {name!r:.80} has no name: give it one")
            if definition.name in self._cores:
                raise InvalidServer(f"the memory {name!r:.80} has two core segments {definition.name!r:.80}: drop one")
            wrong = why_no_segment_type(definition.aron_type)
            if wrong:
                raise InvalidServer(f"the core segment {definition.name!r:.80} of the memory {name!r:.80} {wrong}")
            self.id.with_core_segment(definition.name)
            self._cores[definition.name] = Core(definition.aron_type)

    # Segments

    def core(self, name: str) -> Core | None:
        """The core segment of that name."""
        found: Core | None = self._cores.get(name)
        return found

    def provider(self, core: str, name: str) -> Provider | None:
        """The provider segment of these names."""
        segment = self._cores.get(core)
        found: Provider | None = segment.providers.get(name) if segment is not None else None
        return found

    def type_for(self, core: str, provider: str) -> TypeObject | None:
        """The type that data in a provider segment have to realize: its own, or else the core segment's."""
        segment = self._cores[core]
        own = segment.providers.get(provider)
        found: TypeObject | None = own.aron_type if own is not None and own.aron_type is not None else segment.aron_type
        return found

    # Changing, under the lock

    def put_provider(self, core: str, name: str, provider: Provider) -> None:
        """Insert a provider segment, or put it in the place of the one of that name."""
        self._cores[core].providers[name] = provider

    def retype(self, provider: Provider, aron_type: TypeObject) -> None:
        """Give a provider segment another type."""
        provider.aron_type = aron_type

    def put(self, snapshot: Snapshot) -> list[Evicted]:
        """Insert a snapshot into an existing core segment, and say what left working memory for it."""
        place = snapshot.id
        providers = self._cores[place.core_segment].providers
        provider = providers.get(place.provider_segment)
        if provider is None:
            provider = providers[place.provider_segment] = Provider(None)
        history = provider.entities.get(place.entity)
        if history is None:
            history = SortedHistory(self.lock, self._limits.of(place.entity_id))
            provider.entities[place.entity] = history
        left: list[Evicted] = history.put(snapshot)
        return left

    def clear(self, core: str, provider: str) -> list[Evicted]:
        """Drop all entities of a provider segment, and say what left working memory."""
        entities = self._cores[core].providers[provider].entities
        left = [evicted for history in entities.values() for evicted in history.clear()]
        entities.clear()
        return left

    def held(self) -> list[Evicted]:
        """What clients committed and is still here, as if it left now; of each entity the oldest first."""
        with self.lock:
            providers = [provider for core in self._cores.values() for provider in core.providers.values()]
            histories = [
                history for provider in providers if not provider.read_only for history in provider.entities.values()
            ]
            return [evicted for history in histories for evicted in history.held()]

    def note_use(self, result: Memory, now: int) -> None:
        """A query returned this: count it for the snapshots that are here."""
        for entity in result.entities():
            history = self._history(entity.id)
            if history is not None:
                history.note_use(entity.history, now)

    # Reading

    def names(self, parent: MemoryID) -> Sequence[str]:
        """The names one level below `parent`, in order; none if unknown."""
        with self.lock:
            if not parent.core_segment:
                return list(self._cores)
            if not parent.provider_segment:
                core = self._cores.get(parent.core_segment)
                return list(core.providers) if core is not None else ()
            provider = self.provider(parent.core_segment, parent.provider_segment)
            return list(provider.entities) if provider is not None else ()

    def knows(self, name: MemoryID) -> bool:
        """Whether there is such a core segment, provider segment or entity."""
        if name.entity:
            if self._history(name) is not None:
                return True
            # It may be leaving just now: nobody is told that it is not here before the archive has it.
            with self.lock:
                return self._history(name) is not None
        if name.provider_segment:
            return self.provider(name.core_segment, name.provider_segment) is not None
        return name.core_segment in self._cores

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        """The type of a core or provider segment, where it has one of its own."""
        found = (
            self.provider(segment.core_segment, segment.provider_segment)
            if segment.provider_segment
            else self.core(segment.core_segment)
        )
        return found.aron_type if found is not None else None

    def history(self, entity: MemoryID) -> History:
        """The snapshots of an entity, as they are at each question; of one that is not here, none."""
        return self._history(entity) or SortedHistory(self.lock, None)

    def usage(self, snapshot: MemoryID) -> Usage:
        """How a snapshot was used; unused where it is not here."""
        history = self._history(snapshot)
        return history.usage(snapshot.timestamp) if history is not None else UNUSED

    def size(self) -> tuple[int, int, int]:
        """How many provider segments, entities and snapshots there are."""
        with self.lock:
            providers = [provider for core in self._cores.values() for provider in core.providers.values()]
            histories = [history for provider in providers for history in provider.entities.values()]
            return len(providers), len(histories), sum(map(len, histories))

    def _history(self, entity: MemoryID) -> SortedHistory | None:
        provider = self.provider(entity.core_segment, entity.provider_segment)
        found: SortedHistory | None = provider.entities.get(entity.entity) if provider is not None else None
        return found
