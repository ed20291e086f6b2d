"""Judging cues about fed events: by the memory's types and the event itself, as `elm.cues.match` says."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from uuid import UUID

from elm.cues.algebra import And, Cue, FeatureNamesCue, Not, Or, TypeCue, node
from elm.cues.match import match
from elm.cues.relations import Kin, SetRelation, TypeRelation
from elm.errors import UnknownType
from elm.event import StoredEvent
from elm.taxonomy import EventType, Taxonomy


class TypeJudge:
    """A `Judge` over the types of one memory, which are read again when an unknown one is met."""

    def __init__(self, types: Callable[[], Iterable[EventType]]) -> None:
        self._types = types
        self._taxonomy = Taxonomy()

    def matches(self, cue: Cue, event: StoredEvent) -> bool:
        """Whether an event matches."""
        return match(cue, event, _Around(self, event))

    def is_a(self, name: str, ancestor: str) -> bool:
        """Whether a type is another or a sub-type of it."""
        try:
            return self._taxonomy.is_a(name, ancestor)
        except UnknownType:
            # Made ready before it is used: other threads ask meanwhile.
            taxonomy = Taxonomy()
            taxonomy.add(self._types())
            self._taxonomy = taxonomy
            return taxonomy.is_a(name, ancestor)

    def of_type(self, cue: Cue, type_name: str) -> bool | None:
        """Whether every event of this type matches, none does, or it depends: logic of three values."""
        match node(cue):
            case And(args=args):
                told = [self.of_type(arg, type_name) for arg in args]
                return False if False in told else None if None in told else True
            case Or(args=args):
                told = [self.of_type(arg, type_name) for arg in args]
                return True if True in told else None if None in told else False
            case Not(arg=arg):
                inner = self.of_type(arg, type_name)
                return None if inner is None else not inner
            case TypeCue(relation=relation, type=name):
                return type_name == name if relation is TypeRelation.EXACTLY else self.is_a(type_name, name)
            case FeatureNamesCue(relation=SetRelation.SUPERSET, names=()):
                return True
            case _:
                return None


class _Around:
    """What a pure cue may ask beyond the event itself: types, and its direct parts."""

    __slots__ = ("_event", "_judge")

    def __init__(self, judge: TypeJudge, event: StoredEvent) -> None:
        self._judge = judge
        self._event = event

    def is_a(self, name: str, ancestor: str) -> bool:
        """Whether a type is another or a sub-type of it."""
        return self._judge.is_a(name, ancestor)

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        """The direct parts; other relatives are refused when a recognizer is made."""
        assert uid == self._event.uid, "a cue is asked of one event"  # noqa: S101
        assert kin is Kin.PARTS, "recognizers do not ask for wholes"  # noqa: S101
        assert not transitive, "recognizers do not ask for parts of parts"  # noqa: S101
        return set(self._event.parts)
