"""`like` means SQL's LIKE with backslash as escape, in every store, whatever the pattern."""

from __future__ import annotations

import random
import re
from collections.abc import Iterable, Sequence
from uuid import UUID

from elm import cues
from elm.event import Event
from elm.query import Query
from elm.store import Store
from elm.taxonomy import EventType
from elm.writer import Writer
from tests.clock import span

CHARACTERS = ("a", "b", "A", "\n", "\r", "%", "_", "\\", ".", "*", "ä", "e\u0301", "\U0001f600")
"""Few, so that coincidences are frequent: letters, line breaks, what patterns and expressions are made of."""
TOKENS = ("%", "%", "%", "_", "_", *(character for character in CHARACTERS if character not in "%_\\"))


def texts(source: random.Random, count: int) -> list[str]:
    drawn = {
        "".join(source.choices(CHARACTERS[: source.choice((2, 5, 13))], k=source.randrange(9))) for _ in range(count)
    }
    return sorted({"", *drawn})


def patterns(source: random.Random, count: int) -> list[str]:
    """Random ones, with escapes of all that can be escaped."""
    escaped = [f"\\{character[0]}" for character in CHARACTERS]
    tokens = [*TOKENS, *TOKENS[:6], *source.sample(escaped, 5)]
    drawn = {
        "".join(source.choices(source.choice((tokens, "ab%", "a_%", escaped)), k=source.randrange(9)))
        for _ in range(count)
    }
    return sorted({"", *drawn})


def as_expression(pattern: str) -> re.Pattern[str]:
    """The pattern as a regular expression, which goes through all ways to match it."""
    tokens = re.findall(r"\\.|[^\\]", pattern, flags=re.DOTALL)
    wild = {"%": ".*", "_": "."}
    return re.compile("".join(wild.get(token, re.escape(token[-1])) for token in tokens), flags=re.DOTALL)


def tell(store: Store, told: Iterable[str]) -> None:
    store.add_types([EventType(name="Event")])
    events = [
        Event(type="Event", uid=UUID(int=number), interval=span(number, number), features={"v": text})
        for number, text in enumerate(told)
    ]
    Writer(store).commit_all(events)


def found(store: Store, pattern: str, told: Sequence[str]) -> list[str]:
    return [told[event.uid.int] for event in store.find(Query(cue=cues.feature("v", "like", pattern)))]


def test_random_patterns_match_what_they_say(store: Store) -> None:
    source = random.Random(11)
    told = texts(source, 250)
    tell(store, told)

    asked = patterns(source, 300)
    fitting = {pattern: [text for text in told if as_expression(pattern).fullmatch(text)] for pattern in asked}
    assert sum(0 < len(few) < len(told) for few in fitting.values()) > 75
    assert {pattern: found(store, pattern, told) for pattern in asked} == fitting
