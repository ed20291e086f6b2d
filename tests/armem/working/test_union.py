"""A query that targets working memory and long-term memory does not see where a snapshot is kept."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from armem_bridge.memory_id import MemoryID
from armem_bridge.working import AddSegment, Evicted, Query, QueryTarget, Snapshot
from armem_bridge.working.evaluation import evaluate
from armem_bridge.working.query import (
    AllSnapshots,
    Approximate,
    AtOrBefore,
    BeforeTime,
    IndexRange,
    LatestSnapshots,
    SingleSnapshot,
    SnapshotQuery,
    TimeRange,
)
from armem_bridge.working.union import UnionSource
from tests.armem.working.archives import ListArchive
from tests.armem.working.oracle import (
    NaiveHistory,
    NaiveSource,
    about_the_cup,
    answer,
    histories,
    memories,
    queries,
    snapshot_queries,
    what_counts,
)
from tests.armem.working.scenes import CUP, commit, contents, moments, object_memory, snapshot, update

places = st.lists(st.sampled_from(["first", "second", "both"]), min_size=25, max_size=25)


def split(versions: list[Snapshot], where: list[str]) -> UnionSource:
    """Two sources, each with some of the versions."""
    first, second = (
        [each for each, place in zip(versions, where, strict=False) if place in (name, "both")]
        for name in ("first", "second")
    )
    return UnionSource(NaiveSource(first), NaiveSource(second))


@given(memories, places, queries)
def test_the_split_does_not_show(versions: list[Snapshot], where: list[str], query: Query) -> None:
    assert contents(evaluate(query, split(versions, where), "Object")) == answer(query, what_counts(versions))


@given(histories, places, st.lists(snapshot_queries, min_size=1, max_size=3))
def test_the_split_of_a_history_does_not_show(
    versions: list[Snapshot], where: list[str], wanted: list[SnapshotQuery]
) -> None:
    query = about_the_cup(*wanted)

    assert contents(evaluate(query, split(versions, where), "Object")) == answer(query, what_counts(versions))


@given(histories, histories, st.lists(snapshot_queries, min_size=1, max_size=3))
def test_working_memory_and_an_archive_are_one(
    recent: list[Snapshot], archived: list[Snapshot], wanted: list[SnapshotQuery]
) -> None:
    server = object_memory(archive=ListArchive(on_eviction_only=True, kept=archived))
    for each in recent:
        value = each.instances[0].data.elements["value"].value  # type: ignore[union-attr]
        commit(server, update(each.referenced, value, sent=each.sent))
    query = about_the_cup(*wanted)

    both = server.query(replace(query, target=QueryTarget.BOTH))
    assert contents(both) == answer(query, what_counts([*recent, *archived]))
    assert contents(server.query(replace(query, target=QueryTarget.LTM))) == answer(
        query,
        what_counts([*archived, *_superseded(recent)]),
    )
    assert contents(server.query(query)) == answer(query, what_counts(recent))


def _superseded(versions: list[Snapshot]) -> list[Snapshot]:
    """The versions that do not count, and so leave working memory."""
    counting = what_counts(versions)
    return [each for each in versions if not any(each == other for other in counting)]


def test_by_hand() -> None:
    server = object_memory(archive=ListArchive(kept=[snapshot(10), snapshot(20), snapshot(30, "old", sent=1)]))
    commit(server, update(30, "new", sent=2), update(40), update(15))

    def find(query: SnapshotQuery) -> list[int]:
        return moments(server.query(replace(about_the_cup(query), target=QueryTarget.BOTH)))

    assert find(AllSnapshots()) == [10, 15, 20, 30, 40]
    assert find(LatestSnapshots(count=3)) == [20, 30, 40]
    assert find(IndexRange(first=1, last=-2)) == [15, 20, 30]
    assert find(IndexRange(first=-3, last=-2)) == [20, 30]
    assert find(IndexRange(first=2, last=9)) == [20, 30, 40]
    assert find(IndexRange(first=0, last=0)) == [10]
    assert find(IndexRange(first=-9, last=1)) == [10, 15]
    assert find(BeforeTime(timestamp=20, max_entries=2)) == [10, 15]
    assert find(AtOrBefore(timestamp=29)) == [20]
    assert find(TimeRange(min_timestamp=15, max_timestamp=30)) == [15, 20, 30]
    assert find(Approximate(timestamp=17, eps=2)) == [15]
    assert find(SingleSnapshot()) == [40]
    latest = server.get(CUP.with_timestamp(30), target=QueryTarget.BOTH)
    assert latest is not None
    assert latest.sent == 2


def test_without_an_archive_there_is_no_long_term_memory() -> None:
    server = object_memory()
    commit(server, update(1))
    query = about_the_cup(AllSnapshots())

    assert contents(server.query(replace(query, target=QueryTarget.LTM))) == {}
    assert contents(server.query(replace(query, target=QueryTarget.BOTH))) == contents(server.query(query))
    assert server.get(CUP, target=QueryTarget.LTM) is None


class Moving(ListArchive):
    """Moves a snapshot out of working memory between the two halves of a query."""

    def __init__(self) -> None:
        super().__init__(on_eviction_only=True)
        self.move: Callable[[], None] = lambda: None

    def source(self, memory: str) -> NaiveSource:
        return _Late(self)


class _Late(NaiveSource):
    def __init__(self, archive: Moving) -> None:
        super().__init__(archive.kept)
        self._archive = archive

    def history(self, entity: MemoryID) -> NaiveHistory:
        return _ThenMoving(super().history(entity).h, self._archive)


class _ThenMoving(NaiveHistory):
    def __init__(self, history: list[Snapshot], archive: Moving) -> None:
        super().__init__(history)
        self._archive = archive

    def all(self) -> Sequence[Snapshot]:
        found = super().all()
        self._archive.move()
        return found


def test_what_moves_while_a_query_runs_is_not_missed() -> None:
    archive = Moving()
    server = object_memory(archive=archive, limits={CUP: 1})
    commit(server, update(1))
    archive.move = lambda: commit(server, update(2))
    found = moments(server.query(replace(about_the_cup(AllSnapshots()), target=QueryTarget.BOTH)))

    assert found == [1]
    assert moments(server.query(about_the_cup(AllSnapshots()))) == [2]


class _Leaving(NaiveHistory):
    """Lets go of everything just before it answers, as working memory does when the limit drops a snapshot then."""

    def __init__(self, history: list[Snapshot], archived: list[Snapshot]) -> None:
        super().__init__(history)
        self._archived = archived

    def all(self) -> Sequence[Snapshot]:
        self._archived += self.h
        self.h.clear()
        return []

    def latest(self, count: int) -> Sequence[Snapshot]:
        return self.all()

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        return self.all()

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        return self.all()

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        return self.all()

    def at(self, moment: int) -> Snapshot | None:
        return next(iter(self.all()), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        return self.all()


class _Emptying(NaiveSource):
    def __init__(self, archived: list[Snapshot]) -> None:
        super().__init__([snapshot(1)])
        self._archived = archived

    def history(self, entity: MemoryID) -> NaiveHistory:
        return _Leaving(super().history(entity).h, self._archived)


@pytest.mark.parametrize(
    "asked",
    [
        AllSnapshots(),
        LatestSnapshots(count=1),
        SingleSnapshot(timestamp=1),
        IndexRange(first=0, last=0),
        BeforeTime(timestamp=2, max_entries=1),
        AtOrBefore(timestamp=1),
        TimeRange(min_timestamp=0, max_timestamp=5),
        Approximate(timestamp=1, eps=1),
    ],
    ids=lambda asked: type(asked).__name__,
)
def test_what_leaves_before_the_first_source_answers_is_not_missed(asked: SnapshotQuery) -> None:
    archived: list[Snapshot] = []
    source = UnionSource(_Emptying(archived), UnionSource(NaiveSource(archived)))

    assert moments(evaluate(about_the_cup(asked), source, "Object")) == [1]


class Hesitating(ListArchive):
    """An archive that is handed what leaves working memory, and takes it when it is let to."""

    def __init__(self) -> None:
        super().__init__(on_eviction_only=True)
        self.entered, self.go_on = threading.Event(), threading.Event()

    def on_eviction(self, evicted: Sequence[Evicted]) -> None:
        self.entered.set()
        assert self.go_on.wait(30)
        super().on_eviction(evicted)


@pytest.mark.parametrize("leaving", ["by the limit", "by clearing"])
@pytest.mark.parametrize("asked", ["get", SingleSnapshot(timestamp=1), AllSnapshots()], ids=["get", "single", "all"])
def test_what_is_leaving_is_not_missed(leaving: str, asked: str | SnapshotQuery) -> None:
    archive = Hesitating()
    server = object_memory(archive=archive, limits={CUP: 1})
    commit(server, update(1))
    clear = AddSegment(core_segment="Instance", provider_segment="ObjectLocalizer", clear_when_exists=True)
    found: list[int] = []

    def leave() -> None:
        if leaving == "by the limit":
            commit(server, update(2))
        else:
            server.add_segments([clear])

    def look() -> None:
        if isinstance(asked, str):
            known = server.get(CUP.with_timestamp(1), target=QueryTarget.BOTH)
            found.extend([] if known is None else [known.referenced])
        else:
            found.extend(moments(server.query(replace(about_the_cup(asked), target=QueryTarget.BOTH))))

    leaver, looker = threading.Thread(target=leave), threading.Thread(target=look)
    leaver.start()
    assert archive.entered.wait(30)
    looker.start()
    # Whoever looks now must wait for the archive; one that does not is over by then, and has missed it.
    looker.join(0.2)
    archive.go_on.set()
    leaver.join(30)
    looker.join(30)
    assert 1 in found
