"""The ready-made recognizer of windows: what is measured of the events of each tumbling or sliding stretch of time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Self

from elm.cues.algebra import Cue, FeatureCue
from elm.cues.match import COMPARE
from elm.cues.relations import Comparison, named
from elm.errors import InvalidValue
from elm.features import Feature, FeatureValue, canonical, kind_of
from elm.recognizers.base import Emission, Fed, Judge, Process
from elm.recognizers.durations import later, micros_of
from elm.recognizers.grouped import MOST_PARTS, Grouped, alike
from elm.recognizers.partition import Key, keys_of, values_of

Having = tuple[str, Comparison | str, FeatureValue]
"""A measured feature, how it must compare, and with what."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Windowed(Grouped):
    """What `measures` say of the events whose moments lie in a window `[k * every, k * every + length)` since 1970.

    `every` is `length` unless given: windows then follow each other; with a smaller one they slide. A window without
    events, or of which not all of `having` holds, is no result.
    """

    cue: Cue
    length: timedelta
    every: timedelta | None = None
    having: Sequence[Having] = ()
    most_parts: int = MOST_PARTS

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.cue)
        if self.every is None:
            object.__setattr__(self, "every", self.length)
        self._check_durations("length", "every")
        for name in ("length", "every"):
            if not getattr(self, name):
                raise InvalidValue(f"{name!r} of {self.title} is longer than nothing")
        self._check_count("most_parts")
        if isinstance(self.having, str) or not isinstance(self.having, Iterable):
            raise InvalidValue(f'{self.title} has [("count", ">=", 3)] and the like, not {self.having!r:.80}')
        # In an order of its own, for all must hold: that in which they were given says nothing.
        having = sorted((self._checked(each) for each in self.having), key=_spelled)
        object.__setattr__(self, "having", tuple(having))

    def _checked(self, given: Having) -> Having:
        if not isinstance(given, tuple | list) or len(given) != 3:
            raise InvalidValue(f'{self.title} has ("count", ">=", 3) and the like, not {given!r:.80}')
        name, comparison, value = given
        if not isinstance(name, str) or name not in self.measures:
            raise InvalidValue(f"{self.title} compares {name!r:.80}, which it does not measure: add it to measures")
        how = named(comparison, Comparison, what=f"a comparison of {self.title}")
        cue = FeatureCue(name=name, compare=how, value=value)
        return cue.name, cue.compare, cue.value

    @property
    def interest(self) -> Cue:
        """What is measured."""
        return self.cue

    def holds(self, features: Sequence[Feature]) -> bool:
        """Whether what was measured compares as asked; what could not be measured does not."""
        known = dict(features)
        return all(
            name in known and kind_of(known[name]) == kind_of(value) and COMPARE[Comparison(how)](known[name], value)
            for name, how, value in self.having
        )

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _Windows(self)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _Windows.resumed(self, snapshot, held)


@dataclass(slots=True)
class _Group:
    """Events that all lie in the window to be closed next; those before `skips` were dropped."""

    skips: int
    held: list[Fed]


class _Windows:
    """Windows at work: of all groups the same one is closed next, and every event held lies in it. A `Process`."""

    def __init__(self, definition: Windowed) -> None:
        self._definition = definition
        self._partition = tuple(definition.partition)
        self._length = micros_of(definition.length)
        self._every = micros_of(definition.every or definition.length)
        self._groups: dict[Key, _Group] = {}
        self._next = 0
        self._dropped = 0

    @classmethod
    def resumed(cls, definition: Windowed, snapshot: Any, held: Mapping[str, Fed]) -> Self:
        """The process of which `snapshot` was taken."""
        process = cls(definition)
        process._next, process._dropped = snapshot["next"], snapshot["dropped"]
        for told in snapshot["groups"]:
            key = tuple((kind, value) for kind, value in told["key"])
            process._groups[key] = _Group(told["skips"], [held[uid] for uid in told["held"]])
        return process

    def feed(self, fed: Fed) -> Sequence[Emission]:
        """Take in an event, in each of its groups; results come with time only."""
        if fed.moment % self._every >= self._length:
            return ()
        if not self._groups:
            self._next = (fed.moment - self._length) // self._every + 1
        for key in keys_of(fed.event, self._partition):
            self._take(key, fed)
        return ()

    def _take(self, key: Key, fed: Fed) -> None:
        group = self._groups.setdefault(key, _Group(self._next, []))
        if fed.moment >= group.skips * self._every:
            group.held.append(fed)
        while len(group.held) > self._definition.most_parts:
            # All of them lie in the first window that is not dropped yet: it has too many, the next may not.
            group.skips = max(group.skips, self._next) + 1
            self._dropped += 1
            self._forget(group, group.skips)
        if len(self._groups) > self._definition.most_groups:
            del self._groups[next(iter(self._groups))]
            self._dropped += 1

    def _forget(self, group: _Group, window: int) -> None:
        """Let go of the events before a window."""
        del group.held[: bisect_left(group.held, window * self._every, key=lambda each: each.moment)]

    def deadline(self) -> int | None:
        """The last moment of the window to be closed next."""
        return later(self._next * self._every, self._length - 1) if self._groups else None

    def expire(self, moment: int) -> Sequence[Emission]:
        """Time has passed beyond `moment`: the windows that ended."""
        found: list[Emission] = []
        while (deadline := self.deadline()) is not None and deadline <= moment:
            for key, group in list(self._groups.items()):
                found += self._closed(key, group)
                self._forget(group, self._next + 1)
                if not group.held and group.skips <= self._next + 1:
                    del self._groups[key]
            self._next += 1
        return found

    def _closed(self, key: Key, group: _Group) -> Sequence[Emission]:
        window = self._next
        if group.skips > window or not group.held:
            return ()
        until = bisect_left(group.held, window * self._every + self._length, key=lambda each: each.moment)
        parts = alike(sorted(group.held[:until], key=_by_end))
        features = self._definition.measured(parts)
        if not self._definition.holds(features):
            return ()
        # The window tells two results apart that are made of the same events.
        values = (*values_of(key), window * self._every)
        return (Emission(type=self._definition.type, parts=parts, key=values, features=features),)

    def snapshot(self) -> Any:
        """The state as plain JSON."""
        groups = [
            {
                "key": [list(pair) for pair in key],
                "skips": group.skips,
                "held": [str(fed.event.uid) for fed in group.held],
            }
            for key, group in self._groups.items()
        ]
        return {"groups": groups, "next": self._next, "dropped": self._dropped}

    def held(self) -> Sequence[Fed]:
        """The events of all open windows, each once."""
        return list({fed.event.uid: fed for group in self._groups.values() for fed in group.held}.values())

    def counts(self) -> Mapping[str, int]:
        """Groups with an open window that may be a result, and windows that were dropped."""
        return {"partial": sum(1 for group in self._groups.values() if group.held), "dropped": self._dropped}


def _spelled(having: Having) -> tuple[str, str, str]:
    name, how, value = having
    return name, how, canonical((name, value))


def _by_end(fed: Fed) -> tuple[int, int, bytes]:
    return fed.event.interval.micros[1], fed.begin, fed.event.uid.bytes
