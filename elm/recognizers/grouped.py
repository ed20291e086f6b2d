"""What ready-made recognizers share: definitions by groups of events, and processes that hold each until a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, Self, TypeVar

from elm.cues.algebra import Cue
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.features import Feature
from elm.recognizers.base import Emission, Fed, Judge, check_count, check_identity
from elm.recognizers.durations import check_duration
from elm.recognizers.elements import MOST_TAKEN
from elm.recognizers.measures import Measure, checked_measures
from elm.recognizers.naming import ordered_names, parents_of
from elm.recognizers.partition import Key, keys_of
from elm.recognizers.purity import check_pure
from elm.recognizers.spelling import plain
from elm.taxonomy import EventType
from elm.text import check_short_name

MOST_GROUPS = 10_000
"""Groups that one process holds, unless its definition says otherwise."""
MOST_PARTS = MOST_TAKEN
"""Events that one result is made of, unless its definition says otherwise."""
EVENT = "event"
"""The step of parts that all play the same role."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grouped:
    """A recognizer that looks at groups of events, each by itself: those with the same values of some features.

    `type` is the event type of its results, `parents` what that is a kind of; `partition` names the features.
    """

    STEPS: ClassVar[tuple[str, ...]] = (EVENT,)

    name: str
    version: int
    type: str
    parents: Sequence[str] = ()
    partition: Sequence[str] = ()
    across_agents: bool = False
    measures: Mapping[str, Measure] = field(default_factory=dict)
    most_groups: int = MOST_GROUPS

    def __post_init__(self) -> None:
        check_identity(self.name, self.version)
        self._check_types(self.type)
        object.__setattr__(self, "partition", ordered_names(self.partition, what=f"the partition of {self.title}"))
        object.__setattr__(self, "parents", parents_of(self.type, self.parents))
        object.__setattr__(self, "measures", checked_measures(self.measures, self.STEPS, what=self.title))
        self._check_count("most_groups")

    @property
    def title(self) -> str:
        """How messages name it."""
        return f"{type(self).__name__} {self.name!r}"

    @property
    def definition(self) -> Any:
        """All that its results depend on, as plain JSON."""
        return plain(self)

    @property
    def outputs(self) -> tuple[EventType, ...]:
        """The types of its results."""
        return self._types()

    def measured(self, parts: Sequence[tuple[str, StoredEvent]]) -> tuple[Feature, ...]:
        """The features of a result of these parts, by name."""
        found = []
        for name, measure in sorted(self.measures.items()):
            value = measure.of([part for step, part in parts if measure.step in (None, step)])
            if value is not None:
                found.append((name, value))
        return tuple(found)

    def _types(self, *names: str | None) -> tuple[EventType, ...]:
        found = dict.fromkeys(name for name in (self.type, *names) if name is not None)
        return tuple(EventType(name=name, parents=tuple(self.parents)) for name in found)

    def _check_types(self, *names: str | None) -> None:
        for name in names:
            if name is not None:
                check_short_name(name, what=f"a type of {self.title}")

    def _check_cues(self, *cues: Cue) -> None:
        for cue in cues:
            check_pure(cue, what=self.title)

    def _check_durations(self, *fields: str) -> None:
        for name in fields:
            check_duration(getattr(self, name), what=f"{name!r} of {self.title}")

    def _check_count(self, name: str, *, least: int = 1) -> None:
        check_count(getattr(self, name), what=f"{name!r} of {self.title}", least=least)

    def _reserve(self, feature: str) -> None:
        if feature in self.measures:
            raise InvalidValue(f"the feature {feature!r} of {self.title} is no measure: give the measure another name")


@dataclass(slots=True)
class HeldGroup:
    """Events that one key holds until a moment; `tag` tells apart what a process holds under one key."""

    key: Key
    tag: tuple[str, ...]
    deadline: int
    held: list[Fed]
    _bounds: tuple[int, int] | None = None

    @property
    def span(self) -> int:
        """From the least begin to the greatest end of its events, in microseconds."""
        if self._bounds is None:
            ends = [fed.event.interval.micros[1] for fed in self.held]
            self._bounds = min(fed.begin for fed in self.held), max(ends)
        return self._bounds[1] - self._bounds[0]

    def add(self, fed: Fed, deadline: int) -> None:
        """Hold one more event, until another moment."""
        if self._bounds is not None:
            begin, end = self._bounds
            self._bounds = min(begin, fed.begin), max(end, fed.event.interval.micros[1])
        self.held.append(fed)
        self.deadline = deadline


Definition = TypeVar("Definition", bound=Grouped)


class GroupedProcess(ABC, Generic[Definition]):
    """A `Process` that holds groups of events in the order of their deadlines.

    Subclasses say what an event does to the groups of a key and what the end of a group's time brings. A group
    is put behind all others: its deadline must not be before theirs, as is so when it lies a constant time after
    the moment at hand.
    """

    def __init__(self, definition: Definition, around: Judge) -> None:
        self._definition = definition
        self._around = around
        self._partition = tuple(definition.partition)
        self._groups: dict[tuple[Key, tuple[str, ...]], HeldGroup] = {}
        self._telling: dict[tuple[Key, tuple[str, ...]], HeldGroup] = {}
        """Those of the groups, in their order, of which something is told when their time is over."""
        self._dropped = 0
        self._split = 0

    @classmethod
    def resumed(cls, definition: Definition, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Self:
        """The process of which `snapshot` was taken."""
        process = cls(definition, around)
        process._dropped, process._split = snapshot["dropped"], snapshot["split"]
        for told in snapshot["groups"]:
            key = tuple((kind, value) for kind, value in told["key"])
            process._put(HeldGroup(key, tuple(told["tag"]), told["deadline"], [held[uid] for uid in told["held"]]))
        return process

    def feed(self, fed: Fed) -> Sequence[Emission]:
        """Take in an event, in each of its groups."""
        self._forget(fed.moment)
        found: list[Emission] = []
        for key in keys_of(fed.event, self._partition):
            found += self._take(key, fed)
        return found or ()

    def deadline(self) -> int | None:
        """The moment at which the time of the first group is over of which something is told then."""
        for group in self._telling.values():
            return group.deadline
        return None

    def expire(self, moment: int) -> Sequence[Emission]:
        """Time has passed beyond `moment`: the groups whose time is over, first ones first."""
        found: list[Emission] = []
        while (deadline := self.deadline()) is not None and deadline <= moment:
            group = next(iter(self._telling.values()))
            self._remove(group)
            found += self._over(group)
        self._forget(moment + 1)
        return found

    def _forget(self, moment: int) -> None:
        """Let go of groups whose time was over before a moment, and of which nothing is told."""
        while self._groups:
            group = next(iter(self._groups.values()))
            if group.deadline >= moment or (group.key, group.tag) in self._telling:
                return
            self._remove(group)

    def snapshot(self) -> Any:
        """The state as plain JSON."""
        groups = [
            {
                "key": [list(pair) for pair in group.key],
                "tag": list(group.tag),
                "deadline": group.deadline,
                "held": [str(fed.event.uid) for fed in group.held],
            }
            for group in self._groups.values()
        ]
        return {"groups": groups, "dropped": self._dropped, "split": self._split}

    def held(self) -> Sequence[Fed]:
        """The events of all groups, each once."""
        return list({fed.event.uid: fed for group in self._groups.values() for fed in group.held}.values())

    def counts(self) -> Mapping[str, int]:
        """Groups that hold events, what was dropped, and how often an episode was cut in two at its bound."""
        partial = sum(1 for group in self._groups.values() if group.held)
        return {"partial": partial, "dropped": self._dropped, "split": self._split}

    @abstractmethod
    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        """What an event does to the groups of a key."""

    @abstractmethod
    def _tells(self, group: HeldGroup) -> bool:
        """Whether anything follows when the time of a group is over; else nobody need wait for that."""

    @abstractmethod
    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        """What follows when the time of a group, which is no longer held, is over."""

    def _find(self, key: Key, *tag: str) -> HeldGroup | None:
        return self._groups.get((key, tag))

    def _put(self, group: HeldGroup) -> None:
        """Hold a group, behind all others; beyond the bound the one whose time is over first is dropped."""
        name = (group.key, group.tag)
        self._groups.pop(name, None)
        self._telling.pop(name, None)
        self._groups[name] = group
        if self._tells(group):
            self._telling[name] = group
        if len(self._groups) > self._definition.most_groups:
            self._remove(next(iter(self._groups.values())))
            self._dropped += 1

    def _remove(self, group: HeldGroup) -> None:
        name = (group.key, group.tag)
        del self._groups[name]
        self._telling.pop(name, None)


def alike(held: Sequence[Fed]) -> tuple[tuple[str, StoredEvent], ...]:
    """Events as parts that all play the same role."""
    return tuple((EVENT, fed.event) for fed in held)
