"""What complex events have from their parts."""

from __future__ import annotations

from uuid import UUID, uuid4

import pytest

from elm.event import StoredEvent
from elm.extents import common_agent, in_uid_order
from elm.extents import span as span_of
from elm.tombstone import Tombstone
from tests.clock import at, span


def part(agent: str | None, number: int = 1) -> StoredEvent:
    return StoredEvent(id=number, uid=UUID(int=number), type="A", interval=span(0, 1), recorded_at=at(1), agent=agent)


def gone(agent: str | None, number: int = 1) -> Tombstone:
    return Tombstone(uid=UUID(int=number), interval=span(0, 1), agent=agent, run=uuid4())


def test_from_the_first_begin_to_the_last_end() -> None:
    assert span_of([span(2, 3), span(0, 1), span(1, 5)]) == span(0, 5)


def test_open_while_one_of_them_is() -> None:
    assert span_of([span(2, None), span(0, 9)]) == span(0, None)


@pytest.mark.parametrize(
    ("agents", "common"),
    [(["a"], "a"), (["a", "a"], "a"), (["a", "b"], None), (["a", None], None), ([None], None), ([], None)],
)
def test_the_agent_that_all_parts_have(agents: list[str | None], common: str | None) -> None:
    assert common_agent([part(agent) for agent in agents]) == common
    assert common_agent([gone(agent) for agent in agents]) == common


def test_parts_count_in_the_order_of_their_uids() -> None:
    parts: list[StoredEvent | Tombstone] = [part(None, 3), gone(None, 1), part(None, 2)]
    assert [each.uid.int for each in in_uid_order(parts)] == [1, 2, 3]
