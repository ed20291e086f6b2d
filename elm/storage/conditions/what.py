"""Conditions on features: whole sets, sets of names, and the comparison of single values."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, assert_never

from sqlalchemy import (
    ARRAY,
    BigInteger,
    FromClause,
    Numeric,
    Text,
    and_,
    any_,
    case,
    cast,
    column,
    exists,
    false,
    func,
    literal_column,
    not_,
    or_,
    select,
    true,
)
from sqlalchemy.dialects.postgresql import array
from sqlalchemy.types import TypeEngine

from elm.cues.algebra import FeatureCue, FeatureNamesCue, FeaturesCue
from elm.cues.relations import Comparison, SetRelation
from elm.features import ends, ends_within, fold, kind_of, name_tokens, token, tokens, value_text
from elm.storage.conditions.compare import COMPARE
from elm.storage.conditions.rule import TEXTS, Bind, Rule, SqlCondition, exactly, indexed
from elm.storage.tables import last_names_key, names_key


def feature_names(cue: FeatureNamesCue) -> Rule:
    """The names of an event's features against a given set."""
    given = name_tokens(cue.names)
    rule = _text_set("feature_names", cue.relation, given, "feature_names")
    # For whole sets the inverted index would visit all events that share a name, or all that have it; IS TRUE keeps
    # the planner from taking it.
    match cue.relation:
        case SetRelation.EQUAL:
            return indexed(
                rule.key,
                rule.values,
                lambda e, p: and_(rule.build(e, p).is_(true()), _is_set(e, p)),
                judge=rule.build,
                look=lambda e, p: exactly(names_key(e.c.feature_names), names_key(p)),
            )
        case SetRelation.SUBSET if len(given) <= _MOST_SUBSETS:
            return _by_subsets(rule, given)
        case SetRelation.SUPERSET if len(given) > 1:
            return _by_size(rule, len(given))
        case _:
            return rule


_MOST_SUBSETS = 8
"""Names of a set up to which a statement with all its subsets, 256, is soon planned."""


def _is_set(e: FromClause, names: Bind) -> SqlCondition:
    return names_key(e.c.feature_names) == names_key(names)


def _by_subsets(rule: Rule, given: Sequence[str]) -> Rule:
    """Few sets lie within a small one: each is looked for by itself (docs/adr/0011)."""
    subsets = [[*chosen] for size in range(len(given) + 1) for chosen in combinations(given, size)]
    values = (*rule.values, *((subset, TEXTS) for subset in subsets))

    def build(e: FromClause, p: Bind, *within: Bind) -> SqlCondition:
        # A parameter for each, not all from one sub-select: the planner then knows how many events have them.
        keys = [names_key(p, len(subset)) for p, subset in zip(within, subsets, strict=True)]
        return and_(rule.build(e, p).is_(true()), names_key(e.c.feature_names) == any_(array(keys)))

    return indexed((*rule.key, "by sets", len(given)), values, build, judge=lambda e, p, *_: rule.build(e, p))


def _by_size(rule: Rule, number: int) -> Rule:
    """Of as many names as given only the same set holds them all: it and the larger ones are asked (docs/adr/0011).

    Where few events have larger sets that is soon done; where many have, the planner takes the inverted index.
    """
    values = (*rule.values, (last_names_key(number), BigInteger()))

    def build(e: FromClause, p: Bind, last: Bind) -> SqlCondition:
        # The larger ones first: most that hold the names are, and then need no second comparison.
        return and_(rule.build(e, p), or_(names_key(e.c.feature_names) > last, _is_set(e, p)))

    return indexed((*rule.key, "by size"), values, build, judge=lambda e, p, _: rule.build(e, p))


def features(cue: FeaturesCue) -> Rule:
    """An event's set of features against a given set."""
    given = tokens(cue.features)
    rule = _text_set("features", cue.relation, given, "feature_tokens")
    if cue.relation is SetRelation.EQUAL:
        return indexed(
            rule.key,
            (*rule.values, (ends(given), BigInteger())),
            lambda e, p, _: rule.build(e, p),
            look=lambda e, _, end: exactly(e.c.feature_ends, end),
        )
    if cue.relation is not SetRelation.SUBSET or len(given) > _MOST_ENDS:
        return rule
    # The inverted index would visit all events that share a token, the ends find the few that may lie within;
    # IS TRUE keeps the planner from taking the former.
    values = (*rule.values, (ends_within(given), ARRAY(BigInteger)))

    def build(e: FromClause, p: Bind, within: Bind) -> SqlCondition:
        return and_(rule.build(e, p).is_(true()), e.c.feature_ends == any_(within))

    return indexed((*rule.key, "by ends"), values, build, judge=lambda e, p, _: rule.build(e, p))


_MOST_ENDS = 50
"""Elements of a set up to which its pairs of ends, some thousand, are fewer than what shares an element."""


def _text_set(op: str, relation: SetRelation, given: list[str], name: str) -> Rule:
    values = ((given, TEXTS),)

    def build(e: FromClause, p: Bind) -> SqlCondition:
        stored = e.c[name]
        match relation:
            case SetRelation.EQUAL:
                return stored == p
            case SetRelation.SUBSET:
                return stored.op("<@", is_comparison=True)(p)
            case SetRelation.SUPERSET:
                return stored.op("@>", is_comparison=True)(p)
            case SetRelation.INTERSECTS:
                return stored.op("&&", is_comparison=True)(p)
            case SetRelation.DISJOINT:
                return not_(stored.op("&&", is_comparison=True)(p))
            case unknown:
                assert_never(unknown)

    search = None if relation is SetRelation.DISJOINT else build
    return Rule(key=(op, relation.value), values=values, build=build, search=search)


_JSON_KIND = {"b": "boolean", "n": "number", "s": "string"}


def feature(cue: FeatureCue) -> Rule:
    """Some value of one name against a given value of the same kind."""
    kind = kind_of(cue.value)
    key = ("feature", cue.compare.value, kind)
    if cue.compare is Comparison.EQ:
        values: tuple[tuple[Any, TypeEngine[Any]], ...] = (([token((cue.name, cue.value))], TEXTS),)
        return indexed(key, values, lambda e, p: e.c.feature_tokens.op("@>", is_comparison=True)(p))
    values = (([fold(cue.name)], TEXTS), (cue.name, Text()), (value_text(cue.value), Text()))

    def search(e: FromClause, names: Bind, *_: Bind) -> SqlCondition:
        return e.c.feature_names.op("@>", is_comparison=True)(names)

    def build(e: FromClause, names: Bind, name: Bind, value: Bind) -> SqlCondition:
        pair = func.json_array_elements(e.c.features).table_valued(column("value"), name="pair").render_derived()
        kind_of_pair = func.json_typeof(pair.c.value.op("->")(literal_column("1")))
        said = pair.c.value.op("->>")(literal_column("1"))
        named = pair.c.value.op("->>")(literal_column("0")) == name
        right_kind = kind_of_pair == literal_column(f"'{_JSON_KIND[kind]}'")
        # Numbers compare as numeric: double precision would merge 2^53 and 2^53 + 1.
        stored = cast(said, Numeric) if kind == "n" else said.collate("C")
        given = cast(value, Numeric) if kind == "n" else value
        # CASE, because AND does not promise to check the kind before it casts.
        holds = case((and_(named, right_kind), COMPARE[cue.compare](stored, given)), else_=false())
        return and_(
            search(e, names),
            exists(select(literal_column("1")).select_from(pair).where(holds)),
        )

    return Rule(key=key, values=values, build=build, search=search)
