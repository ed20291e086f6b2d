"""What each operator of a pattern means, as examples worked out by hand that tell it from its neighbours.

A stream is written as types and times: `A0 B1-3` is an instant and an interval, event 1 and event 2. A result names
which step took which event, `@` the moment at which it was certain; `waited` has the deadline as a part, and `late` is
a time-out. The enumeration that judges the engine is judged by the same examples.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import pytest

from elm import cues
from elm.cues.relations import Place
from elm.event import StoredEvent
from elm.features import FeatureValue
from elm.geometry import Region
from elm.interval import AllenRelation
from elm.recognizers.base import Fed
from elm.recognizers.conditions import Condition, Of, allen, compare, near, same, same_region, told
from elm.recognizers.elements import Element, absent, step, without
from elm.recognizers.measures import count, greatest, mean
from elm.recognizers.patterns import Pattern
from tests.recognition.oracle import Found, key_of, results
from tests.recognition.streams import PLAIN, Case, fed, micros
from tests.recognition.test_patterns import Harness, run

A, B, C, D = cues.is_a("A"), cues.is_a("B"), cues.is_a("C"), cues.feature("last", "=", True)
FAR = 1_000


def pattern(*elements: Element, within: int = 100, **options: Any) -> Pattern:
    """A pattern of these elements, of which every match counts unless `options` say otherwise."""
    options = {"after_match": "all", **options}
    return Pattern(name="table", version=1, type="Found", elements=elements, within=micros(within), **options)


def stream(text: str) -> list[Fed]:
    """`A0 A1@7 B8-9 C9:cup`: types, begins and ends, and the values of the feature `object`; D is a C called last."""
    events = []
    for uid, word in enumerate(text.split(), start=1):
        found = re.fullmatch(r"(A1@|[A-D])(\d+)(?:-(\d+))?(?::(.*))?", word)
        assert found, word
        name, begin, end, objects = found.groups()
        features: list[tuple[str, FeatureValue]] = [("object", each) for each in (objects or "").split(",") if each]
        if name == "D":
            name, features = "C", [*features, ("last", True)]
        events.append(fed(name.removesuffix("@"), int(begin), int(end or begin), uid=uid, features=features))
    assert events == sorted(events, key=lambda each: each.moment), text
    return events


def told_of(found: Found) -> str:
    """A result as the tables write it."""
    taken = " ".join(f"{name}{uid.int}" for name, uid in found.taken)
    how = {"timed out": " late", "match": "" if found.deadline is None else " waited"}[found.output]
    assert found.deadline in (None, found.moment)
    return f"{taken} @{found.moment}{how}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One stream, and what each pattern of its family finds in it till `until`."""

    why: str
    stream: str
    found: dict[str, list[str]]
    until: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """Patterns that differ in one operator, and rows that tell every two of them apart."""

    name: str
    patterns: Mapping[str, Pattern]
    rows: Sequence[Row]
    alike: Sequence[set[str]] = ()
    """Patterns that mean the same wherever this family's pattern has a meaning."""


def rows(table: str) -> list[Row]:
    """The rows of a table: a stream, till when time then passes, and why; then which patterns find what in it.

    Those that find nothing are not named; without `till` time passes beyond every deadline.
    """
    found: list[Row] = []
    for line in filter(str.strip, table.splitlines()):
        if "#" in line:
            events, why = line.split("#")
            text, _, time = map(str.strip, events.partition("|"))
            until = int(time.removeprefix("till ") or FAR) if time != "no time passes" else None
            found.append(Row(why=why.strip(), stream=text, until=until, found={}))
        else:
            names, _, told = line.partition(":")
            for name in names.split():
                found[-1].found.setdefault(name, []).extend(map(str.strip, told.split(";")))
    return found


a, b, c, d = step("a", A), step("b", B), step("c", C), step("d", D)

FAMILIES = (
    Family(
        name="contiguity",
        patterns={
            "strict": pattern(a, b.strict()),
            "next": pattern(a, b.skip_till_next()),
            "any": pattern(a, b.skip_till_any()),
        },
        rows=rows(
            """
            A0 B1  # nothing between
                strict next any: a1 b2 @1
            A0 C1 B2  # one between
                next any: a1 b3 @2
            A0 B1 B2  # two that fit
                strict next: a1 b2 @1
                any: a1 b2 @1; a1 b3 @2
            A0 A1 B2  # the run's own type between
                strict: a2 b3 @2
                next any: a1 b3 @2; a2 b3 @2
            A0 B0  # at one moment, in the order fed
                strict next any: a1 b2 @0
            B0 A0  # at one moment, the other way round
            A1@10 B11  # a sub-type
                strict next any: a1 b2 @11
            """
        ),
    ),
    Family(
        name="how many, at the end",
        patterns={
            "one": pattern(a, b),
            "two": pattern(a, b.times(2)),
            "one_or_two": pattern(a, b.times(1, 2)),
            "many": pattern(a, b.one_or_more()),
            "optional": pattern(a, b.optional()),
            "any_number": pattern(a, b.one_or_more().optional()),
        },
        rows=rows(
            """
            A0  # none: certain once time is over
                optional any_number: a1 @100
            A0 B1  # one
                one optional: a1 b2 @1
                one_or_two many any_number: a1 b2 @100
            A0 B1 B2  # two
                one optional: a1 b2 @1
                two one_or_two: a1 b2 b3 @2
                many any_number: a1 b2 b3 @100
            A0 B1 B2 B3  # three
                one optional: a1 b2 @1
                two one_or_two: a1 b2 b3 @2
                many any_number: a1 b2 b3 b4 @100
            A0 B1 | till 99  # the time is not over yet
                one optional: a1 b2 @1
            A0 B100  # an event at the deadline still counts
                one one_or_two many optional any_number: a1 b2 @100
            A0 B101 | no time passes  # one behind it does not
                optional any_number: a1 @100
            """
        ),
    ),
    Family(
        name="how many, before a further step",
        patterns={
            "one": pattern(a, b, c),
            "two": pattern(a, b.times(2), c),
            "one_or_two": pattern(a, b.times(1, 2), c),
            "many": pattern(a, b.one_or_more(), c),
            "optional": pattern(a, b.optional(), c),
            "any_number": pattern(a, b.times(0, 9), c),
        },
        rows=rows(
            """
            A0 C1  # none
                optional any_number: a1 c2 @1
            A0 B1 C2  # one
                one one_or_two many optional any_number: a1 b2 c3 @2
            A0 B1 B2 B3 C4  # three
                one optional: a1 b2 c5 @4
                two one_or_two: a1 b2 b3 c5 @4
                many any_number: a1 b2 b3 b4 c5 @4
            """
        ),
    ),
    Family(
        name="contiguity in a loop",
        patterns={
            "strict": pattern(a, b.one_or_more().strict()),
            "next": pattern(a, b.one_or_more()),
            "any": pattern(a, b.one_or_more().skip_till_any()),
        },
        rows=rows(
            """
            A0 B1 C2 B3  # an event between closes the strict loop, which is certain then
                strict: a1 b2 @2
                next: a1 b2 b4 @100
                any: a1 b2 @1; a1 b2 b4 @3; a1 b4 @3
            A0 B1 B2  # nothing between
                strict next: a1 b2 b3 @100
                any: a1 b2 @1; a1 b2 b3 @2; a1 b3 @2
            """
        ),
    ),
    Family(
        name="optional steps are passed over in order",
        patterns={
            "next": pattern(a, step("x", B).optional(), step("y", B)),
            "first_any": pattern(a, step("x", B).optional().skip_till_any(), step("y", B)),
            "second_any": pattern(a, step("x", B).optional(), step("y", B).skip_till_any()),
            "first_strict": pattern(a, step("x", B).optional().strict(), step("y", B)),
            "both_optional": pattern(a, step("x", B).optional(), step("y", B).optional()),
        },
        rows=rows(
            """
            A0 B1  # one: the first target takes it
                first_any: a1 y2 @1
                both_optional: a1 x2 @100
            A0 B1 B2  # two
                next second_any first_strict both_optional: a1 x2 y3 @2
                first_any: a1 y2 @1; a1 x2 y3 @2; a1 y3 @2
            A0 C1 B2  # behind another
                first_any first_strict: a1 y3 @2
                both_optional: a1 x3 @100
            A0 B1 B2 B3  # three
                next first_strict both_optional: a1 x2 y3 @2
                first_any: a1 y2 @1; a1 x2 y3 @2; a1 y3 @2; a1 x3 y4 @3; a1 y4 @3
                second_any: a1 x2 y3 @2; a1 x2 y4 @3
            """
        ),
    ),
    Family(
        name="times are inclusive",
        patterns={
            "gap_5": pattern(a, b.gap(micros(5))),
            "gap_4": pattern(a, b.gap(micros(4))),
            "within_5": pattern(a, b, within=5),
            "within_4": pattern(a, b, within=4),
        },
        rows=rows(
            """
            A0 B5  # at the limit
                gap_5 within_5: a1 b2 @5
            A0-4 B6  # a gap runs from the moment, within from the begin
                gap_5 gap_4: a1 b2 @6
            A5 B1-6  # the earliest begin of all
                gap_5 gap_4 within_5: a1 b2 @6
            A0-5 B5  # the first event alone is longer
                gap_5 gap_4 within_5: a1 b2 @5
            """
        ),
    ),
    Family(
        name="a gap in a loop",
        patterns={
            "loop": pattern(a, b.one_or_more().gap(micros(3))),
            "step": pattern(a, b.one_or_more(), c.gap(micros(3))),
            "all": pattern(a, b.one_or_more().gap(micros(3)), c.optional().gap(micros(5))),
            "some": pattern(a, b.one_or_more().gap(micros(3)), c.optional()),
        },
        rows=rows(
            """
            A0 B3 B6 B10  # each event of the loop restarts it; the greatest gap of the targets is the deadline
                loop: a1 b2 b3 @9
                all: a1 b2 b3 @11
                some: a1 b2 b3 @100
            A0 B3 C7  # to the step after it
                loop: a1 b2 @6
                all some: a1 b2 c3 @7
            A0 B3 C6  # and at its limit
                loop: a1 b2 @6
                step all some: a1 b2 c3 @6
            """
        ),
    ),
    Family(
        name="without",
        patterns={
            "nothing": pattern(a, b),
            "without": pattern(a, without(C), b),
            "of_the_same": pattern(a, without(C, same("object", "a")), b),
            "strict": pattern(a, b.strict()),
        },
        rows=rows(
            """
            A0 C1 B2  # one between
                nothing of_the_same: a1 b3 @2
            A0 A1 B2  # another between
                nothing without of_the_same: a1 b3 @2; a2 b3 @2
                strict: a2 b3 @2
            A0:cup C1:cup B2  # of one object between
                nothing: a1 b3 @2
            A0:cup C1:jug B2  # of another between
                nothing of_the_same: a1 b3 @2
            C0 A1 B2 C3  # before and behind
                nothing without of_the_same strict: a2 b3 @2
            A0 C0 B1  # at the moment of the first, after it
                nothing of_the_same: a1 b3 @1
            A0 B1 C1  # at the moment of the second, after it
                nothing without of_the_same strict: a1 b2 @1
            A0 C1 B1  # at the moment of the second, before it
                nothing of_the_same: a1 b3 @1
            """
        ),
    ),
    Family(
        name="where a without stands",
        patterns={
            "before_loop": pattern(a, without(C), b.times(0, 9), d),
            "after_loop": pattern(a, b.times(0, 9), without(C & ~D), d),
            "both": pattern(a, without(C & ~D), b.times(0, 9), without(C & ~D), d),
        },
        rows=rows(
            """
            A0 C1 B2 D3  # before the loop
                after_loop: a1 b3 d4 @3
            A0 B1 C2 B3 D4  # in the loop
                before_loop after_loop both: a1 b2 b4 d5 @4
            A0 B1 C2 D3  # behind the loop
                before_loop: a1 b2 d4 @3
            A0 C1 D2  # where the loop takes nothing it lies between all the same
            A0 D1  # nowhere
                before_loop after_loop both: a1 d2 @1
            """
        ),
    ),
    Family(
        name="a without that can still be avoided",
        patterns={
            "optional": pattern(a, without(C), b.optional()),
            "loop": pattern(a, b.one_or_more(), without(C), d.optional()),
            "needed": pattern(a, without(C), b, timed_out="Late"),
        },
        rows=rows(
            """
            A0 C1  # closes the last way: certain by that event, or over without a time-out
                optional: a1 @1
            A0 B1 C2  # closes one of two ways: waits for the other
                optional needed: a1 b2 @1
                loop: a1 b2 @100
            A0  # does not come
                optional: a1 @100
                needed: a1 @100 late
            """
        ),
    ),
    Family(
        name="absent",
        patterns={
            "for_5": pattern(a, absent(C, micros(5))),
            "for_4": pattern(a, absent(C, micros(4))),
            "of_the_same": pattern(a, absent(C, micros(5), same("object", "a"))),
            "not_at_once": pattern(a, absent(C, micros(0))),
            "anything": pattern(a, absent(cues.everything(), micros(5))),
        },
        rows=rows(
            """
            A0 C5  # comes when the time is just not over
                for_4: a1 @4 waited
                of_the_same: a1 @5 waited
                not_at_once: a1 @0 waited
            A0:cup C5:cup  # of one object
                for_4: a1 @4 waited
                not_at_once: a1 @0 waited
            A1 C1  # at once
                of_the_same: a1 @6 waited
            C1 A1  # just before
                for_5 of_the_same anything: a2 @6 waited
                for_4: a2 @5 waited
                not_at_once: a2 @1 waited
            A1 A5 | no time passes  # a further event proves that the time is over only if it is later
                not_at_once: a1 @1 waited
            A1 A6 A7 | no time passes  # as one does that is
                for_5 of_the_same: a1 @6 waited
                for_4: a1 @5 waited
                not_at_once: a1 @1 waited; a2 @6 waited
            A1 | till 6  # time reaches the end of the duration
                for_5 of_the_same anything: a1 @6 waited
                for_4: a1 @5 waited
                not_at_once: a1 @1 waited
            A1 | till 5  # time does not
                for_4: a1 @5 waited
                not_at_once: a1 @1 waited
            """
        ),
    ),
    Family(
        name="absent after a loop",
        patterns={
            "within_6": pattern(a, b.one_or_more(), absent(C, micros(3)), within=6, timed_out="Late"),
            "within_100": pattern(a, b.one_or_more(), absent(C, micros(3)), timed_out="Late"),
            "any": pattern(a, b.one_or_more().skip_till_any(), absent(C, micros(3))),
            "gap": pattern(a, b.one_or_more().gap(micros(1)), absent(C, micros(3)), timed_out="Late"),
        },
        rows=rows(
            """
            A0 B1 B4 B6  # taking one more waits anew, beyond within too
                within_6 within_100: a1 b2 b3 b4 @9 waited
                any: a1 b2 @4 waited; a1 b2 b3 @7 waited; a1 b3 @7 waited
                any: a1 b2 b3 b4 @9 waited; a1 b3 b4 @9 waited; a1 b4 @9 waited
                gap: a1 b2 @4 waited
            A0 B1 C2 B3  # closed, and opened again by the loop
                within_6 within_100: a1 b2 b4 @6 waited
                any: a1 b2 b4 @6 waited; a1 b4 @6 waited
            A0 B1 C2  # closed for good: it was accepting, and is no time-out
            A0  # never begun
                within_6: a1 @6 late
                within_100: a1 @100 late
                gap: a1 @1 late
            A0 B1 B5  # the absence ends the run that could take more
                within_6 within_100 gap: a1 b2 @4 waited
                any: a1 b2 @4 waited; a1 b3 @8 waited
            """
        ),
    ),
    Family(
        name="time-outs",
        patterns={
            "within": pattern(a, b, within=5, timed_out="Late"),
            "gap": pattern(a, b.gap(micros(3)), within=5, timed_out="Late"),
            "strict": pattern(a, b.strict(), within=5, timed_out="Late"),
            "silent": pattern(a, b, within=5),
            "optional": pattern(a, b.optional(), within=5, timed_out="Late"),
        },
        rows=rows(
            """
            A1  # nothing comes
                within strict: a1 @6 late
                gap: a1 @4 late
                optional: a1 @6
            A1 C2  # something else comes
                within: a1 @6 late
                gap: a1 @4 late
                optional: a1 @6
            A1 B6  # it comes at the deadline
                within strict silent optional: a1 b2 @6
                gap: a1 @4 late
            A1 B7 | no time passes  # it comes too late
                within strict: a1 @6 late
                gap: a1 @4 late
                optional: a1 @6
            A1-4  # the time runs from the begin
                within gap strict: a1 @6 late
                optional: a1 @6
            A1-7  # an event that is longer than within begins nothing
            A1 | till 5  # the time is not over
                gap: a1 @4 late
            """
        ),
    ),
    Family(
        name="after a match",
        alike=[{"past_last", "default"}],
        patterns={
            "all": pattern(a, b.skip_till_any(), after_match="all"),
            "next_start": pattern(a, b.skip_till_any(), after_match="next_start"),
            "past_last": pattern(a, b.skip_till_any(), after_match="past_last"),
            "default": Pattern(
                name="table", version=1, type="Found", elements=(a, b.skip_till_any()), within=micros(100)
            ),
        },
        rows=rows(
            """
            A0 A1 B2 B3 A4 B5  # two begins, two ends, and once more
                all: a1 b3 @2; a2 b3 @2; a1 b4 @3; a2 b4 @3; a1 b6 @5; a2 b6 @5; a5 b6 @5
                next_start: a1 b3 @2; a2 b3 @2; a5 b6 @5
                past_last default: a1 b3 @2; a5 b6 @5
            """
        ),
    ),
    Family(
        name="after a match, time-outs",
        # One event begins one run, unless a step skips till any, and then time-outs are refused.
        alike=[{"all", "next_start"}],
        patterns={
            "all": pattern(a, step("b", B, same("object", "a")), within=9, timed_out="Late", after_match="all"),
            "next_start": pattern(
                a, step("b", B, same("object", "a")), within=9, timed_out="Late", after_match="next_start"
            ),
            "past_last": pattern(
                a, step("b", B, same("object", "a")), within=9, timed_out="Late", after_match="past_last"
            ),
        },
        rows=rows(
            """
            A0:cup A1:jug B2:jug  # a run that began before the end of a result
                all next_start: a2 b3 @2; a1 @9 late
                past_last: a2 b3 @2
            A0:cup B1:cup A2:jug  # a run that began after it
                all next_start past_last: a1 b2 @1; a3 @11 late
            A0:cup A1:jug B10:jug  # a time-out bars nothing
                all next_start past_last: a2 b3 @10; a1 @9 late
            """
        ),
    ),
    Family(
        name="the order in which matches become certain",
        patterns={
            "past_last": pattern(a, step("b", B, same("object", "a")), after_match="past_last"),
            "all": pattern(a, step("b", B, same("object", "a"))),
            "waiting": pattern(a, step("b", B, same("object", "a")).times(0, 1), within=2, after_match="past_last"),
            "waiting_all": pattern(a, step("b", B, same("object", "a")).times(0, 1), within=2),
        },
        rows=rows(
            """
            A0:cup A1:jug B2:jug B2:cup  # at one moment what an earlier event makes certain is first
                past_last waiting: a2 b3 @2
                all waiting_all: a2 b3 @2; a1 b4 @2
            A0:cup A1:jug B2:jug  # at one moment what an event makes certain is before what time does
                past_last all waiting: a2 b3 @2
                waiting_all: a2 b3 @2; a1 @2
            A0:cup A0:jug  # of those that time makes certain the first positions are first
                waiting waiting_all: a1 @2; a2 @2
            """
        ),
    ),
    Family(
        name="the filter",
        patterns={
            "none": pattern(a, b.strict()),
            "among": pattern(a, b.strict(), among=A | B),
            "among_objects": pattern(a, b.strict(), among=cues.feature("object", "=", "cup")),
        },
        rows=rows(
            """
            A0 C1 B2  # what does not pass does not count
                among: a1 b3 @2
            A0:cup B1 B2:cup  # nor is it taken
                none among: a1 b2 @1
                among_objects: a1 b3 @2
            """
        ),
    ),
    Family(
        name="the partition",
        patterns={
            "none": pattern(a, without(C), b),
            "object": pattern(a, without(C), b, partition=["object"]),
            "strict": pattern(a, b.strict(), partition=["object"]),
        },
        rows=rows(
            """
            A0:cup A1:jug B2:cup  # each value by itself
                none: a1 b3 @2; a2 b3 @2
                object strict: a1 b3 @2
            A0:cup A1:cup B2:cup  # what is in the same one is
                none object: a1 b3 @2; a2 b3 @2
                strict: a2 b3 @2
            A0:cup C1:jug B2:cup  # what is in another partition is not between
                object strict: a1 b3 @2
            A0:cup C1 B2:cup  # what is in none is not between
                object strict: a1 b3 @2
            A0:cup C1:cup,jug B2:cup  # what is in several is in each
            A0 B1  # what lacks the feature is never taken
                none: a1 b2 @1
            A0:cup,jug B1:cup,jug  # found once in each
                none: a1 b2 @1
                object strict: a1 b2 @1; a1 b2 @1
            A0:cup B1:cup A2:jug | no time passes  # another partition's event proves that time is over
                none object strict: a1 b2 @1
            """
        ),
    ),
    Family(
        name="which event of a step is compared with",
        patterns={
            each.value: pattern(a.one_or_more(), step("b", B, same("object", "a", of=each)).strict(), among=A | B)
            for each in Of
        },
        rows=rows(
            """
            A0:jug A1:cup B2:cup  # the last and another first
                last: a1 a2 b3 @2; a2 b3 @2
                first every: a2 b3 @2
            A0:cup A1:jug B2:cup  # the first and another last
                first: a1 a2 b3 @2
            A0:cup A1:cup B2:cup  # all
                last first every: a1 a2 b3 @2; a2 b3 @2
            """
        ),
    ),
    Family(
        name="a step that names itself",
        patterns={
            each.value: pattern(step("a", A), step("b", B, same("object", "b", of=each)).times(3), after_match="all")
            for each in Of
        },
        rows=rows(
            """
            A0 B1:cup B2:cup,jug B3:jug B4:cup  # a chain, the first with nothing before it
                last: a1 b2 b3 b4 @3
                first every: a1 b2 b3 b5 @4
            A0 B1:cup,pan B2:cup,jug B3:pan B4:jug B5:cup  # one that has both
                last: a1 b2 b3 b5 @4
                first: a1 b2 b3 b4 @3
                every: a1 b2 b3 b6 @5
            """
        ),
    ),
    Family(
        name="a condition on a step that took nothing",
        patterns={
            "on_optional": pattern(a, b.optional(), step("c", C, same("object", "b"))),
            "on_first": pattern(a, b.optional(), step("c", C, same("object", "a"))),
        },
        rows=rows(
            """
            A0:cup C1:jug  # holds
                on_optional: a1 c2 @1
            A0:cup B1:jug C2:cup  # what was taken is compared with
                on_first: a1 b2 c3 @2
            """
        ),
    ),
)

ROWS = [
    pytest.param(family.patterns[name], each, name, id=f"{family.name}: {each.why}: {name}")
    for family in FAMILIES
    for each in family.rows
    for name in family.patterns
]


def by_enumeration(case: Case) -> list[Found]:
    """What the oracle finds."""
    return results(case.pattern, case.stream, case.until, PLAIN)


@pytest.mark.parametrize("find", [by_enumeration, run])
@pytest.mark.parametrize(("given", "example", "name"), ROWS)
def test_finds_what_was_worked_out_by_hand(
    given: Pattern, example: Row, name: str, find: Callable[[Case], list[Found]]
) -> None:
    found = find(Case(pattern=given, stream=stream(example.stream), until=example.until))

    matches = [told_of(each) for each in found if each.output == "match"]
    late = [told_of(each) for each in found if each.output == "timed out"]
    assert matches + late == example.found.get(name, [])


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_every_two_patterns_of_a_family_are_told_apart(family: Family) -> None:
    assert all(each.found.keys() <= family.patterns.keys() for each in family.rows)
    for one, other in combinations(family.patterns, 2):
        if {one, other} not in family.alike:
            assert any(each.found.get(one) != each.found.get(other) for each in family.rows), (one, other)


# Partitions

VALUES: tuple[FeatureValue, ...] = (1, True, "1", 1.0, 2)


@pytest.mark.parametrize("find", [by_enumeration, run])
@pytest.mark.parametrize("ours", VALUES)
@pytest.mark.parametrize("other", VALUES)
def test_partitions_are_told_apart_by_kind_and_value(
    ours: FeatureValue, other: FeatureValue, find: Callable[[Case], list[Found]]
) -> None:
    events = [fed("A", 0, uid=1, features={"object": ours}), fed("B", 1, uid=2, features={"object": other})]
    found = find(Case(pattern=pattern(a, b, partition=["object"]), stream=events, until=None))

    alike = key_of([ours]) == key_of([other])
    assert [each.key for each in found] == ([key_of([ours])] if alike else [])
    assert alike == (ours is other or {repr(ours), repr(other)} == {"1", "1.0"})


@pytest.mark.parametrize("find", [by_enumeration, run])
def test_a_partition_by_two_features_is_every_pair_of_their_values(find: Callable[[Case], list[Found]]) -> None:
    both = [("object", "cup"), ("object", "jug"), ("hand", "left"), ("hand", "right")]
    events = [
        fed("A", 0, uid=1, features=both),
        fed("B", 1, uid=2, features={"object": "jug", "hand": "left"}),
        fed("B", 2, uid=3, features={"object": "jug"}),
        fed("B", 3, uid=4, features={"object": "cup", "hand": "right"}),
    ]
    found = find(Case(pattern=pattern(a, b, partition=["object", "hand"]), stream=events, until=None))

    assert {(each.key, told_of(each)) for each in found} == {
        (key_of(["jug", "left"]), "a1 b2 @1"),
        (key_of(["cup", "right"]), "a1 b4 @3"),
    }


def test_measures_are_of_the_events_taken() -> None:
    measured = pattern(
        a,
        b.one_or_more().strict(),
        measures={"n": count("b"), "all": count(), "height": mean("height", "b"), "top": greatest("height", "a")},
    )
    events = [
        fed("A", 0, uid=1, features={"height": 9}),
        fed("B", 1, uid=2, features={"height": 1}),
        fed("B", 2, uid=3, features={"height": 2}),
        fed("C", 3, uid=4, features={"height": 7}),
    ]
    harness = Harness(measured, PLAIN)
    emitted = [each for event in events for each in harness.process.feed(event)]

    assert [set(each.features) >= {("n", 2), ("all", 3), ("height", 1.5), ("top", 9)} for each in emitted] == [True]


# Conditions


def event(
    begin: int = 0,
    end: int | None = None,
    *,
    region: Region | None = None,
    subject: Region | None = None,
    **features: FeatureValue | Iterable[FeatureValue],
) -> StoredEvent:
    """An event with features of one or of several values."""
    pairs = [
        (name, value)
        for name, given in features.items()
        for value in ([given] if isinstance(given, str | int | float) else given)
    ]
    return fed("A", begin, end, uid=1, features=pairs, region=region, subject=subject).event


@pytest.mark.parametrize(
    ("ours", "other", "holds"),
    [
        (event(x="cup"), event(x="cup"), True),
        (event(x="cup"), event(x="Cup"), False),
        (event(x=1), event(x=1.0), True),
        (event(x=1), event(x=True), False),
        (event(x=1), event(x="1"), False),
        (event(x="1"), event(x=True), False),
        (event(x=True), event(x=True), True),
        (event(x=0), event(x=False), False),
        (event(x=0), event(x=-0.0), True),
        (event(x=2**53), event(x=2**53 + 1), False),
        (event(x=["cup", "jug"]), event(x=["jug", "pan"]), True),
        (event(x=["cup", "jug"]), event(x=["pan", "pot"]), False),
        (event(x="cup"), event(y="cup"), False),
        (event(), event(x="cup"), False),
        (event(x="cup"), event(), False),
        (event(), event(), False),
    ],
)
def test_same(ours: StoredEvent, other: StoredEvent, holds: bool) -> None:
    condition = same("x", "a")

    assert condition.holds(ours, [other]) is holds
    assert condition.holds(other, [ours]) is holds


ORDERED: Mapping[str, Callable[[Any, Any], bool]] = {
    "=": lambda ours, other: ours == other,
    "!=": lambda ours, other: ours != other,
    "<": lambda ours, other: ours < other,
    "<=": lambda ours, other: ours <= other,
    ">": lambda ours, other: ours > other,
    ">=": lambda ours, other: ours >= other,
}


@pytest.mark.parametrize(
    ("ours", "other", "holding"),
    [
        (1, 2, {"!=", "<", "<="}),
        (2, 1, {"!=", ">", ">="}),
        (1, 1.0, {"=", "<=", ">="}),
        (2**53, 2**53 + 1, {"!=", "<", "<="}),
        (1, True, set()),
        (1, "1", set()),
        (True, "True", set()),
        (True, True, {"="}),
        (False, True, {"!="}),
        ([1, 3], [2], {"!=", "<", "<=", ">", ">="}),
        ([1, 2], [2], {"=", "!=", "<", "<=", ">="}),
        ([1, "2"], [2], {"!=", "<", "<="}),
        ([], [2], set()),
        ([2], [], set()),
    ],
)
def test_compare(ours: Any, other: Any, holding: set[str]) -> None:
    for comparison in ORDERED:
        condition = compare("x", comparison, "a", "y")

        assert condition.holds(event(x=ours, y=99), [event(y=other, x=99)]) is (comparison in holding), comparison
        alike = compare("x", comparison, "a")
        assert alike.holds(event(x=ours), [event(x=other)]) is (comparison in holding), comparison


@pytest.mark.parametrize(
    ("ours", "other", "holding"),
    [
        ((0, 1), (2, 3), {"before"}),
        ((2, 3), (0, 1), {"after"}),
        ((0, 2), (2, 3), {"meets"}),
        ((2, 3), (0, 2), {"met_by"}),
        ((0, 2), (1, 3), {"overlaps"}),
        ((1, 3), (0, 2), {"overlapped_by"}),
        ((0, 1), (0, 2), {"starts"}),
        ((0, 2), (0, 1), {"started_by"}),
        ((1, 2), (0, 3), {"during"}),
        ((0, 3), (1, 2), {"contains"}),
        ((1, 2), (0, 2), {"finishes"}),
        ((0, 2), (1, 2), {"finished_by"}),
        ((0, 2), (0, 2), {"equals"}),
        ((1, 1), (1, 1), {"equals", "meets", "met_by"}),
        ((1, 1), (1, 2), {"starts", "meets"}),
        ((2, 2), (1, 2), {"finishes", "met_by"}),
        ((1, 2), (2, 2), {"finished_by", "meets"}),
        ((1, 2), (1, 1), {"started_by", "met_by"}),
        ((1, 1), (2, 2), {"before"}),
    ],
)
def test_allen(ours: tuple[int, int], other: tuple[int, int], holding: set[str]) -> None:
    holds = {each.value for each in AllenRelation if allen(each, "a").holds(event(*ours), [event(*other)])}

    assert holds == holding


UNIT = Region.box(0, 0, 1, 1)
PLACES: Mapping[str, tuple[Region | None, float | None]] = {
    "the same": (Region.box(0, 0, 1, 1), 0),
    "a shared edge": (Region.box(1, 0, 2, 1), 0),
    "a shared corner": (Region.box(1, 1, 2, 2), 0),
    "inside": (Region.box(0.25, 0.25, 0.5, 0.5), 0),
    "a metre off": (Region.box(2, 0, 3, 1), 1),
    "off across the corner": (Region.box(4, 5, 6, 6), 5),
    "another frame": (Region.box(0, 0, 1, 1, frame="odom"), None),
    "unknown": (None, None),
}


def placed(place: Place, here: Region | None, elsewhere: Region | None) -> StoredEvent:
    """An event with one place here and the other one elsewhere."""
    return event(region=here, subject=elsewhere) if place is Place.REGION else event(region=elsewhere, subject=here)


@pytest.mark.parametrize("place", list(Place))
@pytest.mark.parametrize("name", PLACES)
def test_near_and_same_region(name: str, place: Place) -> None:
    there, apart = PLACES[name]
    elsewhere = Region.box(500, 500, 501, 501)
    ours = placed(place, UNIT, elsewhere)

    for other in (placed(place, there, known) for known in (elsewhere, None, UNIT)):
        for metres in (0, 0.999999, 1, 4.999999, 5, 1000):
            condition = near(metres, "a", place=place)
            assert condition.holds(ours, [other]) is (apart is not None and apart <= metres)
            assert condition.holds(other, [ours]) is (apart is not None and apart <= metres)
        condition = same_region("a", place=place)
        assert condition.holds(ours, [other]) is (apart == 0)
        assert condition.holds(other, [ours]) is (apart == 0)


def test_no_place_is_not_near_no_place() -> None:
    assert not near(1000, "a").holds(event(), [event()])
    assert not same_region("a").holds(event(), [event()])


def test_told_has_the_event_at_hand_first() -> None:
    condition = told("is the later one", lambda ours, other: ours.interval.begin > other.interval.begin, "a")

    assert condition.holds(event(2), [event(1)])
    assert not condition.holds(event(1), [event(2)])


@pytest.mark.parametrize(
    ("taken", "holding"),
    [
        ([], {"last", "first", "every"}),
        ([1], {"last", "first", "every"}),
        ([2], set()),
        ([1, 2], {"first"}),
        ([2, 1], {"last"}),
        ([1, 2, 1], {"first", "last"}),
        ([1, 1], {"last", "first", "every"}),
    ],
)
def test_which_event_of_several(taken: list[int], holding: set[str]) -> None:
    conditions: Mapping[Of, Condition] = {each: same("x", "a", of=each) for each in Of}
    known = [event(x=value) for value in taken]

    assert {of.value for of, condition in conditions.items() if condition.holds(event(x=1), known)} == holding
