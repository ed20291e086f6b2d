"""Every query finds what the documents say, over random memories; and some by hand, for the eye."""

from __future__ import annotations

from datetime import timedelta

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from armem_bridge.memory_id import MemoryID
from armem_bridge.working import (
    Commit,
    CoreSegmentDefinition,
    EntityUpdate,
    MemoryServer,
    Query,
    QueryBuilder,
    QueryTarget,
    Snapshot,
)
from armem_bridge.working.query import (
    AllNames,
    AllSnapshots,
    Approximate,
    AtOrBefore,
    BeforeTime,
    CoreSegmentQuery,
    EntityQuery,
    IndexRange,
    LatestSnapshots,
    MemoryQuery,
    RegexNames,
    SingleName,
    SingleSnapshot,
    SnapshotQuery,
    TimeRange,
)
from armem_bridge.working.refusals import InvalidQuery
from tests.armem.working.oracle import (
    about_the_cup,
    answer,
    histories,
    means,
    memories,
    queries,
    snapshot_queries,
    what_counts,
)
from tests.armem.working.scenes import CUP, commit, contents, moments, object_memory, snapshot, update


def filled(versions: list[Snapshot]) -> MemoryServer:
    """A server to which these versions were committed, one by one."""
    server = object_memory()
    for each in versions:
        instances = tuple(instance.data for instance in each.instances)
        commit(
            server,
            EntityUpdate(entity=each.id.entity_id, instances=instances, referenced=each.referenced, sent=each.sent),
        )
    return server


@settings(max_examples=150)
@given(memories, queries)
def test_a_query_finds_what_it_means(versions: list[Snapshot], query: Query) -> None:
    assert contents(filled(versions).query(query)) == answer(query, what_counts(versions))


@given(histories, st.lists(snapshot_queries, min_size=1, max_size=3))
def test_snapshots_of_one_entity(versions: list[Snapshot], wanted: list[SnapshotQuery]) -> None:
    query = about_the_cup(*wanted)

    assert contents(filled(versions).query(query)) == answer(query, what_counts(versions))


@given(memories, queries)
def test_without_data_the_tree_is_the_same(versions: list[Snapshot], query: Query) -> None:
    server = filled(versions)
    bare = server.query(replace(query, with_data=False))

    assert contents(bare) == {
        core: {
            provider: {entity: [each.without_data() for each in found] for entity, found in entities.items()}
            for provider, entities in providers.items()
        }
        for core, providers in contents(server.query(query)).items()
    }
    assert all(instance.data is None for _, instance in bare.instances())


@given(queries)
def test_queries_can_be_written_down(query: Query) -> None:
    assert msgspec.json.decode(msgspec.json.encode(query), type=Query) == query


H = [snapshot(moment) for moment in (10, 20, 30, 40)]


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        (AllSnapshots(), [10, 20, 30, 40]),
        (SingleSnapshot(timestamp=20), [20]),
        (SingleSnapshot(timestamp=21), []),
        (SingleSnapshot(), [40]),
        (SingleSnapshot(timestamp=-(2**63)), [40]),
        (LatestSnapshots(), [40]),
        (LatestSnapshots(count=2), [30, 40]),
        (LatestSnapshots(count=0), []),
        (LatestSnapshots(count=2**60), [10, 20, 30, 40]),
        (IndexRange(), [10, 20, 30, 40]),
        (IndexRange(first=0, last=0), [10]),
        (IndexRange(first=1, last=-2), [20, 30]),
        (IndexRange(first=-2, last=-1), [30, 40]),
        (IndexRange(first=-9, last=1), [10, 20]),
        (IndexRange(first=-9, last=-5), []),
        (IndexRange(first=3, last=9), [40]),
        (IndexRange(first=4, last=9), []),
        (IndexRange(first=2, last=1), []),
        (BeforeTime(timestamp=30), [20]),
        (BeforeTime(timestamp=30, max_entries=5), [10, 20]),
        (BeforeTime(timestamp=31, max_entries=2), [20, 30]),
        (BeforeTime(timestamp=99, max_entries=-1), [10, 20, 30, 40]),
        (BeforeTime(timestamp=99, max_entries=0), []),
        (BeforeTime(timestamp=10), []),
        (AtOrBefore(timestamp=30), [30]),
        (AtOrBefore(timestamp=39), [30]),
        (AtOrBefore(timestamp=9), []),
        (TimeRange(min_timestamp=20, max_timestamp=30), [20, 30]),
        (TimeRange(min_timestamp=21, max_timestamp=29), []),
        (TimeRange(min_timestamp=30, max_timestamp=20), []),
        (TimeRange(min_timestamp=20), [20, 30, 40]),
        (TimeRange(max_timestamp=20), [10, 20]),
        (TimeRange(), [10, 20, 30, 40]),
        (Approximate(timestamp=20, eps=100), [20]),
        (Approximate(timestamp=24, eps=5), [20]),
        (Approximate(timestamp=25, eps=5), [20, 30]),
        (Approximate(timestamp=25, eps=4), []),
        (Approximate(timestamp=25), [20, 30]),
        (Approximate(timestamp=99, eps=59), [40]),
        (Approximate(timestamp=0, eps=0), []),
    ],
)
def test_the_queries_by_hand(query: SnapshotQuery, expected: list[int]) -> None:
    assert moments(filled(H).query(about_the_cup(query))) == expected
    assert [each.referenced for each in means(query, H)] == expected, "the oracle"


def test_selections_at_one_level_are_united_in_order_of_time() -> None:
    server = filled(H)

    assert moments(server.query(about_the_cup(LatestSnapshots(), SingleSnapshot(timestamp=10)))) == [10, 40]
    one, other = about_the_cup(SingleSnapshot(timestamp=30)), about_the_cup(SingleSnapshot(timestamp=20))
    assert moments(server.query(Query(memories=[*one.memories, *other.memories]))) == [20, 30]


def test_what_exists_and_was_asked_for_is_there_even_if_empty() -> None:
    server = filled(H)
    found = server.query(about_the_cup(SingleSnapshot(timestamp=11)))

    assert contents(found) == {"Instance": {"ObjectLocalizer": {"blue-cup": []}}}
    assert contents(server.query(about_the_cup())) == contents(found)
    cores = Query(memories=[MemoryQuery(names=AllNames(), core_segments=[CoreSegmentQuery(names=AllNames())])])
    assert contents(server.query(cores)) == {"Class": {}, "Instance": {}, "a/b ü": {}}


def test_what_does_not_exist_is_simply_not_there() -> None:
    server = filled(H)
    single = [CoreSegmentQuery(names=SingleName(name=name)) for name in ("Instance", "Grasp")]

    assert contents(server.query(Query())) == {}
    assert server.query(Query()).id == MemoryID(memory="Object")
    assert contents(server.query(Query(memories=[MemoryQuery(names=AllNames(), core_segments=single)]))) == {
        "Instance": {}
    }
    elsewhere = MemoryQuery(names=SingleName(name="Grasp"), core_segments=single)
    assert contents(server.query(Query(memories=[elsewhere]))) == {}


def test_snapshots_are_shared_not_copied() -> None:
    server = filled(H)
    one, other = (next(iter(server.query(about_the_cup(LatestSnapshots())).snapshots())) for _ in range(2))

    assert one is other
    assert server.get(CUP) is one


def test_a_result_does_not_change_with_the_memory() -> None:
    server = filled(H)
    found = server.query(about_the_cup(AllSnapshots()))
    before = contents(found)
    commit(server, update(50), update(20, 1, sent=5), update(1, entity=CUP.with_entity("mug")))

    assert contents(found) == before


def test_the_tree_knows_its_ids() -> None:
    found = filled(H).query(about_the_cup(AllSnapshots()))
    provider = found.core_segments["Instance"].provider_segments["ObjectLocalizer"]
    entity = provider.entities["blue-cup"]

    assert str(provider.id) == "Object/Instance/ObjectLocalizer"
    assert entity.id == CUP
    assert entity.latest is not None
    assert str(entity.latest.id) == "Object/Instance/ObjectLocalizer/blue-cup/40"
    assert [str(each)[-5:] for each, _ in found.instances()] == ["/10/0", "/20/0", "/30/0", "/40/0"]
    assert list(provider.snapshots()) == list(found.snapshots())
    assert found.entity(CUP) is entity
    assert found.entity(CUP.with_entity("mug")) is None


@pytest.mark.parametrize(
    ("wanted", "moment"), [(CUP, 40), (CUP.with_timestamp(20), 20), (CUP.with_timestamp(20).with_instance(0), 20)]
)
def test_an_id_names_a_snapshot(wanted: MemoryID, moment: int) -> None:
    for target in QueryTarget.WM, QueryTarget.BOTH:
        found = filled(H).get(wanted, target=target)
        assert found is not None
        assert found.referenced == moment


@pytest.mark.parametrize(
    "wanted",
    [
        CUP.with_timestamp(21),
        CUP.with_entity("mug"),
        CUP.cut(CUP.level - 1),  # type: ignore[arg-type]
        MemoryID(memory="Grasp", core_segment="Instance", provider_segment="ObjectLocalizer", entity="blue-cup"),
    ],
)
def test_ids_of_nothing(wanted: MemoryID) -> None:
    assert filled(H).get(wanted) is None


@pytest.mark.parametrize("name", ["a/b", "'; DROP TABLE event; --", '"', "ü☃\u200b", "(a+)+$", "\\", "%2F", " ", "\n"])
def test_names_are_any_text(name: str) -> None:
    server = MemoryServer(name, [CoreSegmentDefinition(name=name)])
    entity = MemoryID(memory=name, core_segment=name, provider_segment=name, entity=name)
    commit(server, update(1, entity=entity))
    below = EntityQuery(names=SingleName(name=name), snapshots=[AllSnapshots()])
    query = about_the_cup().memories[0].core_segments[0].provider_segments[0]
    query = replace(query, names=SingleName(name=name), entities=(below,))
    core = CoreSegmentQuery(names=SingleName(name=name), provider_segments=[query])
    found = server.query(Query(memories=[MemoryQuery(names=SingleName(name=name), core_segments=[core])]))

    assert [str(each.id) for each in found.snapshots()] == [str(MemoryID.parse(str(entity.with_timestamp(1))))]
    assert contents(found).keys() == {name}


@pytest.mark.parametrize("size", [{"count": -1}, {"count": 1.0}, {"count": True}])
def test_numbers_of_snapshots_that_are_none(size: dict[str, object]) -> None:
    with pytest.raises(InvalidQuery, match="latest snapshots"):
        LatestSnapshots(**size)  # type: ignore[arg-type]


def test_times_that_are_needed_are_given() -> None:
    for kind in BeforeTime, AtOrBefore, Approximate:
        with pytest.raises(InvalidQuery, match="not set"):
            kind(timestamp=-1)
        with pytest.raises(InvalidQuery, match="64 bits"):
            kind(timestamp=2**63)
    with pytest.raises(InvalidQuery, match="64 bits"):
        TimeRange(min_timestamp=1.5)  # type: ignore[arg-type]


class Newer:
    """A query of a class that this version of the bridge does not have."""


def test_classes_of_queries_that_are_unknown_are_named() -> None:
    with pytest.raises(InvalidQuery, match="of the class Newer is unknown here: take one of AllSnapshots"):
        EntityQuery(names=AllNames(), snapshots=[Newer()])  # type: ignore[list-item]
    with pytest.raises(InvalidQuery, match="of the class EntityQuery is unknown"):
        Query(memories=[EntityQuery(names=AllNames())])  # type: ignore[list-item]
    with pytest.raises(InvalidQuery, match="not by a Newer"):
        EntityQuery(names=Newer())  # type: ignore[arg-type]
    with pytest.raises(InvalidQuery, match="text"):
        SingleName(name=None)  # type: ignore[arg-type]
    with pytest.raises(InvalidQuery, match="wm, ltm, both"):
        Query(target="all")  # type: ignore[arg-type]


def test_targets_may_be_given_by_their_words() -> None:
    assert Query(target="both").target is QueryTarget.BOTH  # type: ignore[arg-type]
    assert Commit().updates == ()
    assert RegexNames(pattern="a.*").pattern == "a.*"


def test_what_is_no_query_is_refused() -> None:
    with pytest.raises(InvalidQuery, match=r"not with a QueryBuilder: .* with build\(\)"):
        object_memory().query(QueryBuilder())  # type: ignore[arg-type]


def test_text_selects_nothing() -> None:
    with pytest.raises(InvalidQuery, match=r"is a MemoryID, not 'Object/Instance': .* MemoryID\.parse"):
        QueryBuilder().select("Object/Instance")  # type: ignore[arg-type]


def test_queries_know_whole_snapshots_only() -> None:
    of_instance, of_snapshot = QueryBuilder(), QueryBuilder()
    of_instance.select(CUP.with_timestamp(5).with_instance(1))
    of_snapshot.select(CUP.with_timestamp(5))

    assert of_instance.build() == of_snapshot.build()


def test_a_tolerance_may_be_a_timedelta() -> None:
    def built(eps: int | timedelta) -> Query:
        builder = QueryBuilder()
        builder.core_segments.all().provider_segments.all().entities.all().snapshots.approximate(5, eps=eps)
        return builder.build()

    assert built(timedelta(milliseconds=2)) == built(2000)
