"""What a cue tells about its answer before it is asked: whether its size is known, and when its events began."""

from __future__ import annotations

from collections.abc import Iterator

from elm.cues.algebra import (
    And,
    Condition,
    Cue,
    DurationCue,
    FeatureCue,
    FeatureNamesCue,
    FeaturesCue,
    KinCue,
    Not,
    Or,
    PayloadCue,
    TimeCue,
    TypeCue,
    UidCue,
)
from elm.cues.relations import Kin, SetRelation, TimeAxis, TypeRelation
from elm.interval import AllenRelation, Window
from elm.query import Nearest, Query


def of_query(query: Query) -> tuple[bool, Window]:
    """Whether a query's cue is pinned, and when what matches begins."""
    return is_pinned(query.cue), begins_within(query.cue)


def conjuncts(cue: Cue) -> tuple[Cue, ...]:
    """The cues that must all hold for `cue` to hold."""
    return cue.args if isinstance(cue, And) else (cue,)


def conditions(cue: Cue) -> Iterator[Condition]:
    """All conditions of a cue, whatever and, or and not they stand under."""
    if isinstance(cue, And | Or):
        for arg in cue.args:
            yield from conditions(arg)
    elif isinstance(cue, Not):
        yield from conditions(cue.arg)
    else:
        assert isinstance(cue, Condition)  # noqa: S101 - no other node is left
        yield cue


def is_pinned(cue: Cue) -> bool:
    """Whether a cue names events or their relatives one by one, so that few can match and an index finds them."""
    match cue:
        case And(args=args):
            return any(map(is_pinned, args))
        case UidCue() | PayloadCue():
            return True
        case KinCue(uids=uids, relation=relation):
            return bool(uids) and relation in (SetRelation.EQUAL, SetRelation.SUPERSET, SetRelation.INTERSECTS)
        case _:
            return False


def is_planned_once(query: Query) -> bool:
    """Whether a query's cue says nothing more than that: then one plan is good for whatever is named."""
    is_named = not isinstance(query.cue, And) and is_pinned(query.cue)
    return is_named and not isinstance(query.order, Nearest)


def gathers_kin(cue: Cue) -> bool:
    """Whether judging the first event takes all relatives of what the cue names, which may be half of the memory."""
    return any(
        isinstance(each, KinCue)
        and each.relation is not SetRelation.SUBSET
        and (each.transitive or each.kin is Kin.WHOLES or each.relation in _GATHERED)
        for each in conditions(cue)
    )


_GATHERED = frozenset({SetRelation.INTERSECTS, SetRelation.DISJOINT})


def names_features(cue: Cue) -> bool:
    """Whether a condition on features stands somewhere in a cue."""
    return any(isinstance(each, FeatureCue | FeatureNamesCue | FeaturesCue) for each in conditions(cue))


def is_guess(cue: Cue) -> bool:
    """Whether the planner takes a third of what else matches for the answer, having nothing to tell it by."""
    return any(map(is_guess, cue.args)) if isinstance(cue, And) else isinstance(cue, DurationCue)


def is_in_order(cue: Cue) -> bool:
    """Whether one index has exactly what matches, in order of begin: its first rows are the answer's."""
    return isinstance(cue, TypeCue) and cue.relation is TypeRelation.EXACTLY


def begins_within(cue: Cue) -> Window:
    """A window in which every matching event begins, as far as the cue's own conditions on time tell."""
    match cue:
        case TimeCue(axis=TimeAxis.TIME, window=window, relation=relation):
            if relation in _BEGIN_INSIDE:
                return window
            return Window(end=window.end) if relation in _BEGIN_UNTIL_END else Window()
        case And(args=args):
            windows = [begins_within(arg) for arg in args]
            begins = [window.begin for window in windows if window.begin is not None]
            ends = [window.end for window in windows if window.end is not None]
            first, last = max(begins, default=None), min(ends, default=None)
            # Conditions that contradict each other match nothing; any window will do.
            return (
                Window() if first is not None and last is not None and last < first else Window(begin=first, end=last)
            )
        case _:
            return Window()


_BEGIN_INSIDE = frozenset(
    {
        SetRelation.EQUAL,
        SetRelation.SUBSET,
        AllenRelation.EQUALS,
        AllenRelation.DURING,
        AllenRelation.STARTS,
        AllenRelation.FINISHES,
        AllenRelation.OVERLAPPED_BY,
    }
)
_BEGIN_UNTIL_END = frozenset(
    {
        SetRelation.INTERSECTS,
        SetRelation.SUPERSET,
        AllenRelation.BEFORE,
        AllenRelation.MEETS,
        AllenRelation.OVERLAPS,
        AllenRelation.CONTAINS,
        AllenRelation.FINISHED_BY,
    }
)
