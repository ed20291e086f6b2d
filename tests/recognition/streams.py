"""Random patterns and streams of events to run them on, from pools so small that ties and coincidences are frequent."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any
from uuid import UUID

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from elm import cues
from elm.cues.algebra import And, Cue, Not, Or, TypeCue, node
from elm.cues.match import match
from elm.cues.relations import Comparison, Kin, Place, TypeRelation
from elm.event import Event, StoredEvent
from elm.features import FeatureValue
from elm.geometry import Region
from elm.interval import AllenRelation, Interval, from_micros
from elm.recognizers.base import Fed, Judge
from elm.recognizers.conditions import Condition, Of, allen, compare, near, same, same_region, told
from elm.recognizers.elements import MOST_TAKEN, Absent, Contiguity, Element, Step, Without
from elm.recognizers.patterns import AfterMatch, Pattern
from elm.taxonomy import EventType, Taxonomy

TYPES = Taxonomy([EventType(name="A"), EventType(name="A1", parents=("A",)), EventType(name="B"), EventType(name="C")])


class FixedTypes:
    """What cues ask beyond an event: the hierarchy `TYPES`, and no relatives."""

    def is_a(self, name: str, ancestor: str) -> bool:
        return TYPES.is_a(name, ancestor)

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        return set()


class PlainJudge:
    """Decides every cue by looking at the event."""

    def matches(self, cue: Cue, event: StoredEvent) -> bool:
        return match(cue, event, FixedTypes())

    def of_type(self, cue: Cue, type_name: str) -> bool | None:
        return None


class TypeJudge(PlainJudge):
    """Knows in advance what the type alone decides."""

    def of_type(self, cue: Cue, type_name: str) -> bool | None:
        match node(cue):
            case TypeCue(relation=relation, type=name):
                return type_name == name if relation is TypeRelation.EXACTLY else TYPES.is_a(type_name, name)
            case Not(arg=arg):
                inner = self.of_type(arg, type_name)
                return None if inner is None else not inner
            case And(args=args):
                known = {self.of_type(arg, type_name) for arg in args}
                return False if False in known else None if None in known else True
            case Or(args=args):
                known = {self.of_type(arg, type_name) for arg in args}
                return True if True in known else None if None in known else False
            case _:
                return None


PLAIN: Judge = PlainJudge()
BY_TYPE: Judge = TypeJudge()


def micros(count: int) -> timedelta:
    """So many of the units in which the streams' time is counted."""
    return timedelta(microseconds=count)


def fed(
    type_name: str,
    begin: int,
    end: int | None = None,
    *,
    uid: int,
    moment: int | None = None,
    features: Any = (),
    region: Region | None = None,
    subject: Region | None = None,
) -> Fed:
    """An event from `begin` to `end` (by default an instant), certain at its end or at a later `moment`."""
    end = begin if end is None else end
    interval = Interval(begin=from_micros(begin), end=from_micros(end))
    event = Event(
        type=type_name,
        interval=interval,
        features=features,
        region=region,
        subject=subject,
        agent="armar7",
        uid=UUID(int=uid),
    )
    stored = StoredEvent(
        id=uid,
        uid=event.uid,
        type=event.type,
        interval=interval,
        recorded_at=from_micros(end),
        region=event.region,
        subject=event.subject,
        features=event.features,
        agent=event.agent,
    )
    return Fed(event=stored, moment=end if moment is None else moment, begin=begin)


# Streams

OBJECTS: tuple[tuple[FeatureValue, ...], ...] = (
    *[(1,)] * 4,
    *((1.0,), (True,), ("1",), (2,), (), (1, 2), (1.0, "1"), (2, True)),
)
PLACES: tuple[Region | None, ...] = (
    Region.box(0, 0, 1, 1),
    Region.box(1, 0, 2, 1),
    Region.box(2, 1, 3, 2),
    Region.box(4, 0, 5, 1),
    Region.box(0, 0, 1, 1, frame="odom"),
    None,
)
STARTS = (0, 1, -4, 1_767_261_600_000_000)
"""When streams begin: also before 1970 and at moments that cross zero."""


@st.composite
def streams(draw: st.DrawFn, *, most: int = 8) -> list[Fed]:
    """Events in the order in which they are fed; what recognizers found may come later than it ended."""
    start = draw(st.sampled_from(STARTS))
    count = draw(st.sampled_from([size for size in (0, 1, 2, 3, 4, 5, 5, 6, 6, 7, 8, 8) if size <= most]))
    drawn = draw(
        st.lists(
            st.tuples(
                st.sampled_from(range(8)),
                st.sampled_from((0, 0, 0, 1, 3)),
                st.sampled_from((0, 0, 0, 0, 0, 2)),
                st.sampled_from(("A", "B", "A1", "C")),
                st.sampled_from(OBJECTS),
                st.sampled_from(PLACES),
                st.sampled_from(PLACES),
            ),
            min_size=count,
            max_size=count,
        )
    )
    uids = draw(st.permutations(range(1, len(drawn) + 1)))
    stream = [
        fed(
            type_name,
            start + begin,
            start + begin + length,
            uid=uid,
            moment=start + begin + length + lag,
            features=[("object", value) for value in objects],
            region=region,
            subject=subject,
        )
        for uid, (begin, length, lag, type_name, objects, region, subject) in zip(uids, drawn, strict=True)
    ]
    # Those fed at the moment of their end are in order; recognized ones come after what made them certain.
    return sorted(stream, key=lambda each: (each.moment, _recognized(each), each.begin, each.event.uid))


def _recognized(each: Fed) -> bool:
    return each.moment > each.event.interval.micros[1]


# Patterns

NAMES = ("w", "x", "y", "z")
CUES: tuple[Cue, ...] = (
    cues.is_a("A"),
    cues.is_a("A"),
    cues.is_a("B"),
    cues.is_a("B"),
    cues.is_a("C"),
    cues.exactly("A"),
    cues.exactly("A1"),
    cues.everything(),
    cues.any_of(cues.is_a("A"), cues.is_a("B")),
    ~cues.is_a("B"),
    cues.feature("object", "=", 1),
    cues.is_a("A") & cues.feature("object", "=", 1),
    cues.is_a("B") | cues.feature("object", "=", 2),
)
COUNTS = (*[(1, 1)] * 6, (0, 1), (0, 1), (1, 2), (2, 2), (2, 3), (1, MOST_TAKEN), (1, MOST_TAKEN), (0, MOST_TAKEN))
ABSOLUTE = (Contiguity.SKIP_TILL_NEXT, Contiguity.SKIP_TILL_NEXT, Contiguity.STRICT)


def conditions(known: Sequence[str]) -> SearchStrategy[Condition]:
    """One condition of any kind on one of the steps."""
    steps, of = st.sampled_from(list(known)), st.sampled_from(Of)
    place = st.sampled_from(Place)
    return st.one_of(
        st.builds(lambda step, of: same("object", step, of=of), steps, of),
        st.builds(lambda relation, step, of: allen(relation, step, of=of), st.sampled_from(AllenRelation), steps, of),
        st.builds(
            lambda metres, step, place, of: near(metres, step, place=place, of=of),
            st.sampled_from((0, 1, 2.5)),
            steps,
            place,
            of,
        ),
        st.builds(lambda step, place, of: same_region(step, place=place, of=of), steps, place, of),
        st.builds(
            lambda comparison, step, of: compare("object", comparison, step, of=of),
            st.sampled_from([each for each in Comparison if each is not Comparison.LIKE]),
            steps,
            of,
        ),
        st.builds(lambda step, of: told("greater id", _greater_id, step, of=of), steps, of),
    )


def _greater_id(event: StoredEvent, other: StoredEvent) -> bool:
    return event.id > other.id


def _several(known: Sequence[str]) -> SearchStrategy[tuple[Condition, ...]]:
    return st.sampled_from((0, 0, 0, 0, 0, 0, 1, 1, 2)).flatmap(
        lambda count: st.lists(conditions(known), min_size=count, max_size=count).map(tuple)
    )


@st.composite
def patterns(draw: st.DrawFn, *, divides: bool | None = None) -> Pattern:
    """A pattern of up to four steps; `divides` says whether some step may skip till any."""
    if divides is None:
        divides = draw(st.booleans())
    names = NAMES[: draw(st.sampled_from((1, 2, 2, 3, 3, 4)))]
    elements: list[Element] = []
    for index, name in enumerate(names):
        if index and draw(st.integers(0, 3)) == 0:
            elements.append(Without(cue=draw(st.sampled_from(CUES)), conditions=draw(_several(names[:index]))))
        counts = COUNTS if index else [each for each in COUNTS if each[0]]
        least, most = draw(st.sampled_from(counts))
        elements.append(
            Step(
                name=name,
                cue=draw(st.sampled_from(CUES)),
                conditions=draw(_several(names[: index + 1])),
                least=least,
                most=most,
                contiguity=draw(st.sampled_from((*ABSOLUTE, *[Contiguity.SKIP_TILL_ANY] * 3) if divides else ABSOLUTE)),
                longest_gap=draw(st.sampled_from((None, None, None, None, 1, 2, 4)).map(_maybe_micros)),
            )
        )
    if draw(st.integers(0, 2)) == 0:
        elements.append(
            Absent(
                cue=draw(st.sampled_from(CUES)),
                duration=micros(draw(st.sampled_from((0, 1, 2, 4, 20)))),
                conditions=draw(_several(names)),
            )
        )
    return Pattern(
        name="random",
        version=1,
        type="Found",
        elements=elements,
        within=micros(draw(st.sampled_from((0, 2, 4, 6, 8, 8, 30, 30, 30)))),
        among=draw(st.sampled_from((*[None] * 2 * len(CUES), *CUES))),
        partition=draw(st.sampled_from(((), (), (), ("object",)))),
        after_match=draw(st.sampled_from(AfterMatch)),
        timed_out=None if _may_divide(elements) else draw(st.sampled_from((None, "Late", "Late"))),
    )


def _maybe_micros(count: int | None) -> timedelta | None:
    return None if count is None else micros(count)


def _may_divide(elements: Sequence[Element]) -> bool:
    return any(isinstance(each, Step) and each.contiguity is Contiguity.SKIP_TILL_ANY for each in elements)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A pattern, what it is fed, and the moment till which time then passes; None: as the events prove only."""

    pattern: Pattern
    stream: list[Fed]
    until: int | None

    @property
    def end(self) -> int:
        """A moment beyond every deadline of random patterns."""
        return max((each.moment for each in self.stream), default=0) + 1_000


@st.composite
def cases(draw: st.DrawFn, *, divides: bool | None = None) -> Case:
    """Random ones; time passes not at all, a little, or beyond every deadline."""
    case = Case(pattern=draw(patterns(divides=divides)), stream=draw(streams()), until=None)
    length = draw(st.sampled_from((None, *range(13), *[case.end] * 6)))
    if length is None or length == case.end:
        return replace(case, until=length)
    return replace(case, until=length + min((each.begin for each in case.stream), default=0))
