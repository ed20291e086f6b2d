"""What is handed to cues and queries by mistake is refused when they are made, by name and with the remedy."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from typing import Any
from uuid import UUID

import numpy as np
import pytest

from elm import cues
from elm.app import connect
from elm.cues.algebra import And, Cue, Or, TimeCue
from elm.cues.relations import SetRelation
from elm.errors import InvalidValue
from elm.geometry import Region
from elm.interval import AllenRelation, Interval, Window
from elm.query import Cursor, Join, JoinRelation, Nearest, Query
from tests.clock import at

A = UUID(int=1)
BOX = Region.box(0, 0, 1, 1)
HERE, THERE = cues.is_a("Here"), cues.is_a("There")


def wrong(given: object) -> Any:
    """Anything in the place of anything."""
    return given


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: cues.time("during", wrong((at(0), at(1)))), "one Interval"),
        (lambda: cues.recorded("during", wrong([at(0), at(1)])), "one Interval"),
        (lambda: cues.time("during", Interval(begin=at(0), end=at(1)), at(2)), "has an end"),
        (lambda: cues.time("during", at(0).replace(tzinfo=None)), "naive"),
        (lambda: cues.uid(wrong([A])), "one after the other"),
        (lambda: cues.uid("not a uid"), "uuid.UUID"),
        (lambda: cues.parts("equal", wrong(A)), "uids of a cue"),
        (lambda: cues.wholes("equal", wrong(None)), "uids of a cue"),
        (lambda: cues.parts("equal", wrong(str(A))), "uids of a cue"),
        (lambda: cues.parts("equal", [wrong([A])]), "uuid.UUID"),
        (lambda: cues.feature_names("equal", wrong(None)), "feature names"),
        (lambda: cues.feature_names("equal", wrong(5)), "feature names"),
        (lambda: cues.feature_names("equal", "ab"), "feature names"),
        (lambda: cues.within(wrong("5"), BOX), "metres.*'5'"),
        (lambda: cues.all_of(wrong([HERE])), "combines with cues"),
        (lambda: cues.any_of(Cue()), "combines with cues"),
        (lambda: And(args=wrong(5)), "arguments of and"),
        (lambda: Or(args=wrong("ab")), "arguments of or"),
        (lambda: ~Cue(), "combines with cues"),
        (lambda: HERE and THERE, "&"),
        (lambda: HERE or THERE, "&"),
        (lambda: not HERE, "~"),
        (lambda: Query(cue=wrong(None)), "a cue"),
        (lambda: Query(order=wrong("end")), "order"),
        (lambda: Join(anchors=wrong(HERE), relation=JoinRelation.BEFORE, cue=HERE), "Query"),
        (lambda: Join(anchors=Query(), relation=wrong("next"), cue=HERE), "relation of a join"),
        (lambda: Cursor(begin=at(0), id=wrong("1")), "id of a cursor"),
        (lambda: Cursor(begin=at(0), id=True), "id of a cursor"),
        (lambda: Cursor(begin=at(0), id=wrong(np.float64(1))), "id of a cursor"),
        (lambda: Cursor.parse(wrong(5)), "cursor"),
        (lambda: Cursor.after(wrong("x")), "StoredEvent"),
        (lambda: Query(order=wrong("nearest")), r"elm\.Nearest"),
        (lambda: cues.feature("f", "<", 2**64), "as a float"),
        (lambda: cues.region("subset", wrong(BOX.polygon)), r"Region\(polygon="),
        (lambda: Nearest(to=wrong(BOX.polygon)), r"Region\(polygon="),
        (lambda: connect(wrong(5)), "DSN"),
        (lambda: connect(wrong(timedelta())), "DSN"),
    ],
    ids=range(37),
)
def test_mistakes_are_refused_by_name(call: Callable[[], object], named: str) -> None:
    with pytest.raises(InvalidValue, match=named):
        call()


def test_a_cue_that_says_the_same_is_found_among_others() -> None:
    """That a cue is neither true nor false says nothing of what it equals."""
    assert cues.is_a("There") in (HERE, THERE)
    assert [HERE, THERE].index(THERE) == 1


@pytest.mark.parametrize("relation", ["before", "after", "meets", "met_by"])
def test_relations_to_one_moment_take_it_in_either_place(relation: Any) -> None:
    """They look at one end of the window: where that were unbounded, nothing would match."""
    for build in (cues.time, cues.recorded):
        for cue in (build(relation, at(4)), build(relation, None, at(4)), build(relation, Interval.at(at(4)))):
            assert isinstance(cue, TimeCue)
            assert cue.window == Window(begin=at(4), end=at(4))
        unbounded = build(relation)
        assert isinstance(unbounded, TimeCue)
        assert unbounded.window == Window()


def test_other_relations_to_one_moment_are_unbounded_behind_or_before_it() -> None:
    assert cues.time("intersects", at(4)) == TimeCue(relation=SetRelation.INTERSECTS, window=Window(begin=at(4)))
    assert cues.time("during", None, at(4)) == TimeCue(relation=AllenRelation.DURING, window=Window(end=at(4)))


def test_uids_of_cues_may_be_given_as_text() -> None:
    text = str(A)
    assert cues.uid(text, A) == cues.uid(A)
    assert cues.parts("superset", [text]) == cues.parts("superset", [A])
    assert cues.wholes("intersects", [text], transitive=True) == cues.wholes("intersects", [A], transitive=True)
