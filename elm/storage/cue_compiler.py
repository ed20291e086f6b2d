"""From a cue to one SQL condition: its shape is compiled once and kept, its values are bound anew each time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, assert_never

from sqlalchemy import (
    FromClause,
    Integer,
    LargeBinary,
    Select,
    Text,
    and_,
    any_,
    bindparam,
    false,
    func,
    null,
    or_,
    select,
    true,
)

from elm.cues.algebra import (
    AgentCue,
    And,
    Cue,
    DurationCue,
    FeatureCue,
    FeatureNamesCue,
    FeaturesCue,
    KinCue,
    Not,
    Or,
    PayloadCue,
    RegionCue,
    TimeCue,
    TypeCue,
    UidCue,
    node,
)
from elm.cues.relations import TypeRelation
from elm.storage.conditions.kin import kin
from elm.storage.conditions.rule import UIDS, Bind, Names, Rule, SqlCondition, exactly, indexed
from elm.storage.conditions.what import feature, feature_names, features
from elm.storage.conditions.when import duration, time
from elm.storage.conditions.where import region
from elm.storage.tables import type_closure


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledCue:
    """A cue's shape (equal shapes have equal SQL), its values in order, and its condition on demand."""

    key: tuple[Any, ...]
    values: dict[str, Any]
    condition: Callable[[FromClause], SqlCondition]
    search: Callable[[FromClause], SqlCondition] | None
    """What an index finds: all that match and, unless `is_search`, others; None where no index serves."""
    is_search: bool
    glimpse: Callable[[FromClause], SqlCondition] | None
    """Something cheap that all fulfil that match, to be asked first of rows that no index chose."""
    narrow: Callable[[FromClause], SqlCondition] | None
    """What all fulfil that match, as an index understands it that knows begins too; None without one."""
    outline: Callable[[FromClause], SqlCondition] | None
    """The same with boxes in place of polygons, all that match and others; None where there is no polygon."""
    looks: tuple[Callable[[FromClause], SqlCondition], ...]
    """What each index finds that serves the cue whatever its values: all that match, and perhaps others."""
    alone: Callable[[FromClause], SqlCondition] | None
    """What an index finds, as it is best asked of a cue that is one condition; None where that is as searched."""
    judge: Callable[[FromClause], SqlCondition]
    """The condition, as a plan that does not know the values judges a row as fast."""


def compile_cue(cue: Cue, names: Names, *, prefix: str = "p") -> CompiledCue:
    """The condition on a row of `event` that means what the cue means; its parameters are `prefix`0, `prefix`1 ..."""
    rule = _rule(cue, names)
    values = {f"{prefix}{index}": value for index, (value, _) in enumerate(rule.values)}

    def bound(build: Callable[..., SqlCondition]) -> Callable[[FromClause], SqlCondition]:
        def condition(e: FromClause) -> SqlCondition:
            return build(e, *(bindparam(f"{prefix}{index}", type_=kind) for index, (_, kind) in enumerate(rule.values)))

        return condition

    def bound_if_any(build: Callable[..., SqlCondition] | None) -> Callable[[FromClause], SqlCondition] | None:
        return None if build is None else bound(build)

    return CompiledCue(
        key=rule.key,
        values=values,
        condition=bound(rule.build),
        search=bound_if_any(rule.search),
        is_search=rule.is_search,
        glimpse=bound_if_any(rule.glimpse),
        narrow=bound_if_any(rule.narrow),
        outline=bound_if_any(rule.outline),
        looks=tuple(map(bound, rule.looks)),
        alone=bound_if_any(rule.alone),
        judge=bound(rule.judge or rule.build),
    )


def _rule(cue: Cue, names: Names) -> Rule:
    match node(cue):
        case And(args=args):
            return _combined("and", args, names)
        case Or(args=args):
            return _combined("or", args, names)
        case Not(arg=arg):
            inner = _rule(arg, names)
            # Two-valued logic: what is NULL for a missing component is not true, so its negation is.
            return Rule(
                key=("not", inner.key),
                values=inner.values,
                build=lambda e, *p: inner.build(e, *p).is_not(true()),
                judge=lambda e, *p: (inner.judge or inner.build)(e, *p).is_not(true()),
            )
        case TypeCue() as condition:
            return _type(condition, names)
        case TimeCue() as condition:
            return time(condition)
        case RegionCue() as condition:
            return region(condition, names)
        case FeaturesCue() as condition:
            return features(condition)
        case FeatureNamesCue() as condition:
            return feature_names(condition)
        case FeatureCue() as condition:
            return feature(condition)
        case PayloadCue(data=data):
            # The digest finds it in the index, the bytes decide.
            return indexed(
                ("payload",),
                ((data, LargeBinary()),),
                lambda e, p: and_(func.sha256(e.c.payload) == func.sha256(p), e.c.payload == p),
                look=lambda e, p: exactly(func.sha256(e.c.payload), func.sha256(p)),
            )
        case AgentCue(agent=agent):
            return indexed(
                ("agent",),
                ((agent, Text()),),
                lambda e, p: e.c.agent == p,
                look=lambda e, p: exactly(e.c.agent, p),
            )
        case DurationCue() as condition:
            return duration(condition)
        case KinCue() as condition:
            return kin(condition)
        case UidCue(uids=uids):

            def among(e: FromClause, p: Bind) -> SqlCondition:
                return e.c.uid == any_(p)

            return indexed(("uid",), ((list(uids), UIDS),), among, look=among)
        case unknown:
            assert_never(unknown)


def _combined(op: str, args: Sequence[Cue], names: Names) -> Rule:
    rules = [_rule(arg, names) for arg in args]
    values = tuple(value for rule in rules for value in rule.values)

    def joined(
        e: FromClause, binds: Sequence[Bind], builds: Sequence[Callable[..., SqlCondition] | None]
    ) -> SqlCondition:
        rest = iter(binds)
        taken = [_take(rest, len(rule.values)) for rule in rules]
        built = [build(e, *own) for build, own in zip(builds, taken, strict=True) if build is not None]
        return and_(true(), *built) if op == "and" else or_(false(), *built)

    def combined(parts: Sequence[Callable[..., SqlCondition] | None]) -> Callable[..., SqlCondition] | None:
        """What is made of those that have this: of some of those that hold together, or of all alternatives."""
        has = [part is not None for part in parts]
        if not (any(has) if op == "and" else has and all(has)):
            return None
        return lambda e, *binds: joined(e, binds, parts)

    def build(e: FromClause, *binds: Bind) -> SqlCondition:
        return joined(e, binds, [rule.build for rule in rules])

    has_outline = any(rule.outline is not None for rule in rules)
    return Rule(
        key=(op, *(rule.key for rule in rules)),
        values=values,
        build=build,
        search=build if rules and all(rule.is_search for rule in rules) else combined([rule.search for rule in rules]),
        glimpse=combined([rule.glimpse for rule in rules]),
        narrow=combined([rule.narrow for rule in rules]),
        outline=combined([rule.outline or rule.build for rule in rules]) if has_outline else None,
        looks=tuple(islice(_looks(rules), _MOST_LOOKS)) if op == "and" else (),
        judge=combined([rule.judge or rule.build for rule in rules]),
    )


_MOST_LOOKS = 8
"""Conditions of a cue that are looked at by their indexes, one after the other."""


def _looks(rules: Sequence[Rule]) -> Iterator[Callable[..., SqlCondition]]:
    """The looks of all rules that hold together, each of which takes the parameters of all."""
    first = 0
    for rule in rules:
        own = slice(first, first + len(rule.values))
        for look in rule.looks:
            yield lambda e, *binds, look=look, own=own: look(e, *binds[own])
        first = own.stop


def _take(binds: Iterator[Bind], count: int) -> list[Bind]:
    return [next(binds) for _ in range(count)]


def _type(cue: TypeCue, names: Names) -> Rule:
    values = ((names.type_id(cue.type), Integer()),)
    match cue.relation:
        case TypeRelation.EXACTLY:

            def same(e: FromClause, p: Bind) -> SqlCondition:
                return e.c.type_id == p

            def look(e: FromClause, p: Bind) -> SqlCondition:
                return exactly(e.c.type_id, p)

            return Rule(key=("type", "exactly"), values=values, build=same, search=same, narrow=same, looks=(look,))
        case TypeRelation.IS_A:

            def is_a(e: FromClause, p: Bind) -> SqlCondition:
                # IN (SELECT ...), not = ANY(ARRAY(SELECT ...)): the latter took 170 ms where this takes 2.
                return e.c.type_id.in_(_below(p))

            def narrow(e: FromClause, p: Bind) -> SqlCondition:
                # But between two begins this is one probe for each type, where that is a join with all in between.
                return e.c.type_id == any_(func.array(_below(p).scalar_subquery()))

            def alone(e: FromClause, p: Bind) -> SqlCondition:
                # And for a few of them by the index on types: the planner takes types below it for frequent, and would
                # read all events for a rare one, but of types between two that it does not know it expects few.
                below, descendant = type_closure.c.ancestor_id == p, type_closure.c.descendant_id
                first, last = (select(end(descendant)).where(below).scalar_subquery() for end in (func.min, func.max))
                return and_(narrow(e, p), e.c.type_id.between(first, last))

            def judge(e: FromClause, p: Bind) -> SqlCondition:
                # And for a row by itself one probe, where a plan for any type might gather all that are below it.
                below = _below(p).where(type_closure.c.descendant_id == e.c.type_id).correlate(e)
                return below.scalar_subquery().is_not(null())

            return Rule(
                key=("type", "is_a"), values=values, build=is_a, search=is_a, narrow=narrow, alone=alone, judge=judge
            )
        case unknown:
            assert_never(unknown)


def _below(ancestor: Bind) -> Select[Any]:
    """The types that are the given one or below it."""
    return select(type_closure.c.descendant_id).where(type_closure.c.ancestor_id == ancestor)
