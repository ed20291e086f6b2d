"""What kind: event types, their run-time extensible is-a hierarchy, and its transitive closure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from elm.errors import CycleRefused, InvalidValue, UnknownType
from elm.text import check_short_name


@dataclass(frozen=True, slots=True, kw_only=True)
class EventType:
    """A type and the types it is directly a kind of (Def 1); several parents are allowed."""

    name: str
    parents: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", check_short_name(self.name, what="the name of an event type"))
        if isinstance(self.parents, str) or not isinstance(self.parents, Iterable):
            raise InvalidValue(f"the parents of event type {self.name!r} are several names, not {self.parents!r:.80}")
        what = f"a parent of event type {self.name!r}"
        parents = dict.fromkeys(check_short_name(parent, what=what) for parent in self.parents)
        object.__setattr__(self, "parents", tuple(parents))


class Taxonomy:
    """An is-a hierarchy in memory, with the closure of Def 1 kept as types and parents are added.

    The closure is reflexive: every type is a kind of itself.
    """

    def __init__(self, types: Iterable[EventType] = ()) -> None:
        self._parents: dict[str, dict[str, None]] = {}
        self._ancestors: dict[str, set[str]] = {}
        self._descendants: dict[str, set[str]] = {}
        self.add(types)

    def add(self, types: Iterable[EventType]) -> list[tuple[str, str]]:
        """Add types and edges, in any order; returns the new (ancestor, descendant) pairs of the closure.

        A type that is already there gains parents. An unknown parent or a cycle refuses the whole call.
        """
        batch = list(types)
        names = {event_type.name for event_type in batch}
        for event_type in batch:
            for parent in event_type.parents:
                if parent not in names and parent not in self._parents:
                    raise UnknownType(
                        f"the parent {parent!r} of event type {event_type.name!r} is not a known type: add it first"
                    )
        self._refuse_cycles(batch)
        grown: list[tuple[str, str]] = []
        for event_type in parents_first(batch):
            grown += self._add_one(event_type)
        return grown

    def _add_one(self, event_type: EventType) -> list[tuple[str, str]]:
        name, grown = event_type.name, []
        if name not in self._parents:
            self._parents[name] = {}
            self._ancestors[name] = {name}
            self._descendants[name] = {name}
            grown.append((name, name))
        for parent in event_type.parents:
            if parent in self._parents[name]:
                continue
            self._parents[name][parent] = None
            for descendant in self._descendants[name]:
                for ancestor in self._ancestors[parent] - self._ancestors[descendant]:
                    self._ancestors[descendant].add(ancestor)
                    self._descendants[ancestor].add(descendant)
                    grown.append((ancestor, descendant))
        return grown

    def _refuse_cycles(self, batch: list[EventType]) -> None:
        edges: dict[str, list[str]] = {}
        for event_type in batch:
            edges.setdefault(event_type.name, []).extend(event_type.parents)
        done: set[str] = set()
        for start in edges:
            path: dict[str, None] = {}
            stack = [(start, False)]
            while stack:
                name, leaving = stack.pop()
                if leaving:
                    del path[name]
                    done.add(name)
                elif name in path:
                    ring = [*path][[*path].index(name) :]
                    raise CycleRefused(
                        f"a type cannot be its own ancestor: {' is a '.join(map(repr, [*ring, name]))}. "
                        f"Remove one of these links"
                    )
                elif name not in done:
                    path[name] = None
                    stack.append((name, True))
                    stack += [(parent, False) for parent in edges.get(name, ())]
                    stack += [(parent, False) for parent in self._parents.get(name, ())]

    def __contains__(self, name: object) -> bool:
        return name in self._parents

    def __len__(self) -> int:
        return len(self._parents)

    def __iter__(self) -> Iterator[EventType]:
        """The types, parents before children."""
        every = [EventType(name=name, parents=tuple(parents)) for name, parents in self._parents.items()]
        return iter(parents_first(every))

    def is_a(self, name: str, ancestor: str) -> bool:
        """Whether `name` is `ancestor` or a sub-type of it (the paper's ≺*, made reflexive)."""
        return self.check(ancestor) in self._ancestors[self.check(name)]

    def ancestors(self, name: str) -> frozenset[str]:
        """The type itself and all it is a kind of."""
        return frozenset(self._ancestors[self.check(name)])

    def descendants(self, name: str) -> frozenset[str]:
        """The type itself and all that are a kind of it."""
        return frozenset(self._descendants[self.check(name)])

    def check(self, name: str) -> str:
        """`name`, when it is a known type."""
        if name not in self._parents:
            raise UnknownType(f"unknown event type {name!r}: add it with memory.add_types or `elm types add`")
        return name


def parents_first(batch: Iterable[EventType]) -> list[EventType]:
    """The batch so ordered that a new type's parents come before it: each closure row is then found once."""
    waiting: dict[str, list[EventType]] = {}
    for event_type in batch:
        waiting.setdefault(event_type.name, []).append(event_type)
    ordered: list[EventType] = []
    for start in [*waiting]:
        stack = [start]
        while stack:
            name = stack[-1]
            later = [
                parent for event_type in waiting.get(name, ()) for parent in event_type.parents if parent in waiting
            ]
            if later:
                stack += later
            else:
                ordered += waiting.pop(stack.pop(), ())
    return ordered
