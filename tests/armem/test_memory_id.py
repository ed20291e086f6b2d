"""Memory IDs: their text, their order, what they contain, and what they cannot be."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.memory_id import InvalidMemoryID, Level, MemoryID

CUP = MemoryID(
    memory="Object", core_segment="Instance", provider_segment="ObjectLocalizer", entity="blue-cup", timestamp=42
)

names = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1, max_size=8) | (
    st.sampled_from(["/", "%", "%2F", "a/b", "..", " ", "ü", "'", '"', ".*", "\\/", "\n"])
)
PARTS = ("memory", "core_segment", "provider_segment", "entity", "timestamp", "instance")


@st.composite
def gapless(draw: st.DrawFn) -> MemoryID:
    values = (*(draw(names) for _ in range(4)), draw(st.integers(0, 2**63 - 1)), draw(st.integers(0, 2**31 - 1)))
    return MemoryID(**dict(zip(PARTS[: draw(st.integers(0, 6))], values, strict=False)))  # type: ignore[arg-type]


few = st.sampled_from(["", "a", "b"])
any_id = st.builds(
    MemoryID,
    memory=few,
    core_segment=few,
    provider_segment=few,
    entity=few,
    timestamp=st.integers(-1, 1),
    instance=st.integers(-1, 1),
)


def parts_of(one: MemoryID) -> list[str | int]:
    return [getattr(one, part) for part in PARTS]


@given(gapless())
def test_the_text_is_the_id(one: MemoryID) -> None:
    assert MemoryID.parse(str(one)) == one


@given(gapless(), gapless())
def test_two_ids_never_have_one_text(one: MemoryID, other: MemoryID) -> None:
    assert (str(one) == str(other)) == (one == other)


def test_the_text_is_that_of_armarx() -> None:
    assert str(CUP) == "Object/Instance/ObjectLocalizer/blue-cup/42"
    assert str(CUP.with_instance(0)) == "Object/Instance/ObjectLocalizer/blue-cup/42/0"
    assert str(MemoryID()) == ""
    assert str(MemoryID(memory="50% a/b ü")) == "50%25 a%2Fb ü"
    assert MemoryID.parse("50%25%20a%2fb%20%C3%BC").memory == "50% a/b ü"


def test_the_text_ends_at_the_first_part_not_set() -> None:
    gap = MemoryID(memory="Object", provider_segment="P", entity="cup", timestamp=1)

    assert str(gap) == "Object"
    assert gap.level is Level.MEMORY
    assert gap.has_gap
    assert not CUP.has_gap
    assert MemoryID(memory="m", instance=0).has_gap


def test_levels_go_down_part_by_part() -> None:
    full = CUP.with_instance(3)

    assert [full.cut(level).level for level in Level] == list(Level)
    assert full.cut(Level.INSTANCE) == full
    assert full.cut(Level.ENTITY) == full.entity_id == CUP.entity_id
    assert [str(level) for level in Level][3] == "provider segment"


def test_one_level_further_down() -> None:
    memory = MemoryID(memory="Object")
    core = memory.with_core_segment("Instance")
    provider = core.with_provider_segment("ObjectLocalizer")

    assert provider.with_entity("blue-cup").with_timestamp(42) == CUP
    assert CUP.with_entity("mug") == provider.with_entity("mug"), "what was below is not set any more"
    assert CUP.with_core_segment("Class") == memory.with_core_segment("Class")


@given(any_id, any_id)
def test_containment_is_part_by_part(one: MemoryID, other: MemoryID) -> None:
    meaning = all(
        mine in ("", -1) or mine == theirs for mine, theirs in zip(parts_of(one), parts_of(other), strict=True)
    )

    assert one.contains(other) == meaning


@pytest.mark.parametrize("part", PARTS)
def test_what_is_set_must_be_the_same(part: str) -> None:
    values = ("", "a", "b") if part in PARTS[:4] else (-1, 0, 1)
    below = {each: "x" if each in PARTS[:4] else 0 for each in PARTS}
    for mine in values:
        for others in values:
            one, other = (MemoryID(**below | {part: value}) for value in (mine, others))  # type: ignore[arg-type]
            assert one.contains(other) == (mine == values[0] or mine == others)


@given(gapless())
def test_whatever_is_cut_contains_the_whole(one: MemoryID) -> None:
    assert all(one.cut(level).contains(one) for level in Level)
    assert all(not one.contains(one.cut(level)) for level in Level if level < one.level)


@given(any_id, any_id)
def test_the_order_is_that_of_the_parts(one: MemoryID, other: MemoryID) -> None:
    assert (one < other) == (parts_of(one) < parts_of(other))
    assert (one <= other) == (parts_of(one) <= parts_of(other))


def test_what_is_above_comes_first() -> None:
    full = CUP.with_instance(3)

    assert all(above < below for above, below in pairwise(full.cut(level) for level in Level))


def test_all_negative_numbers_mean_not_set() -> None:
    assert MemoryID(timestamp=-(2**63), instance=-7) == MemoryID()
    assert hash(MemoryID(timestamp=-(2**63))) == hash(MemoryID())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a//c", "the core segment in 'a//c' is empty"),
        ("/a", "the memory"),
        ("a/", "the core segment"),
        ("a/b/c/d/", "the snapshot"),
        ("a/b/c/d/x", "microseconds"),
        ("a/b/c/d/-1", "microseconds"),
        ("a/b/c/d/1.5", "microseconds"),
        ("a/b/c/d/\u0661", "microseconds"),
        ("a/b/c/d/99999999999999999999", "microseconds"),
        ("a/b/c/d/9999999999999999999", "64 bits"),
        ("a/b/c/d/1/x", "position"),
        ("a/b/c/d/1/4294967296", "32 bits"),
        ("a/b/c/d/1/0/e", "at most six"),
        ("50%", "write % itself as %25"),
        ("a%2", "write % itself as %25"),
        ("a%zz", "write % itself as %25"),
        ("a%FF", "UTF-8"),
        ("a%00b", "NUL"),
        ("a\ud800", "UTF-8"),
    ],
)
def test_texts_that_are_no_ids(text: str, words: str) -> None:
    with pytest.raises(InvalidMemoryID, match=words):
        MemoryID.parse(text)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"memory": None}, "the memory of a memory ID is text"),
        ({"entity": 3}, "the entity of a memory ID is text"),
        ({"entity": "a\0"}, "the entity name .* NUL"),
        ({"core_segment": "\udcff"}, "surrogate"),
        ({"timestamp": 1.0}, "64 bits"),
        ({"timestamp": True}, "64 bits"),
        ({"timestamp": 2**63}, "64 bits"),
        ({"instance": 2**31}, "32 bits"),
        ({"instance": "0"}, "32 bits"),
    ],
)
def test_parts_that_none_can_have(parts: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidMemoryID, match=words):
        MemoryID(**parts)  # type: ignore[arg-type]
