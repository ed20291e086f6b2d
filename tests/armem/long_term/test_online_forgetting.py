"""Online forgetting before long-term memory: versions, late arrivals and restarts, also against brute force."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armem_bridge import moments
from armem_bridge.aron.conversion import to_python
from armem_bridge.forgetting import (
    Exponential,
    Frequency,
    OnlineForgetting,
    Similarity,
    TimeDecay,
    consolidated,
)
from armem_bridge.forgetting.mechanisms import Online
from armem_bridge.forgetting_gate import ForgettingGate
from armem_bridge.long_term import Consolidation, LongTermMemory, When
from armem_bridge.long_term.source import LongTermSource
from armem_bridge.working import EntityUpdate, MemoryServer, QueryTarget, Snapshot
from armem_bridge.working.query import AllSnapshots
from armem_bridge.working.snapshot import supersedes
from elm.app import Memory
from tests.armem.long_term.memories import behind, in_process
from tests.armem.long_term.test_source import HeldStore
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import CUP, MEMORY, NOW, commit, object_memory, snapshot, update

SECOND = 1_000_000
LEAVING = Consolidation(when=When.ON_EVICTION, patience=0.0, least_pause=0.001, at_stop=False)
DECAY = TimeDecay(activation=Exponential(tau=5.0), minimum=0.5)


def gated(
    memory: Memory, *mechanisms: Online, keep_rest: bool = False, clock: Callable[[], int] = moments.now
) -> LongTermMemory:
    """Long-term memory that takes what leaves working memory and what the mechanisms keep of it."""
    gate = ForgettingGate(OnlineForgetting(mechanisms)) if mechanisms else None
    return LongTermMemory(memory, replace(LEAVING, at_stop=keep_rest), gate=gate, clock=clock)


def at(second: float, value: object = 0, *, sent: int = -1) -> EntityUpdate:
    return update(round(second * SECOND), value, sent=sent)


def values(found: Sequence[Snapshot]) -> dict[float, Any]:
    """What is known of each second."""
    return {each.referenced / SECOND: _value(each) for each in found}


def _value(of: Snapshot) -> Any:
    return to_python(of.instances[0].data)["value"]


def kept(memory: Memory) -> dict[float, Any]:
    return values(LongTermSource(memory).history(CUP).all())


# Versions


@pytest.mark.parametrize("mechanisms", [(), (Frequency(wait=1.0),), (DECAY,)], ids=["all", "frequency", "decay"])
def test_a_correction_is_kept_and_not_what_it_corrects(mechanisms: tuple[Online, ...]) -> None:
    archive = gated(in_process(), *mechanisms, clock=lambda: NOW)
    with behind(archive, limits={MEMORY: 2}) as server:
        commit(server, at(10, "wrong", sent=1))
        commit(server, at(10, "corrected", sent=2))
        for second in (20, 30, 40):
            commit(server, at(second, "x", sent=3))
        assert archive.flush(timeout=30)
        for target in (QueryTarget.LTM, QueryTarget.BOTH):
            found = list(
                server.query(msgspec.structs.replace(about_the_cup(AllSnapshots()), target=target)).snapshots()
            )
            assert values(found)[10] == "corrected", target


def test_a_correction_is_forgotten_by_its_own_merits() -> None:
    now = [0]
    memory = in_process()
    archive = gated(memory, DECAY, clock=lambda: now[0])
    with behind(archive, limits={MEMORY: 1}, clock=lambda: now[0]) as server:
        commit(server, at(10, "wrong", sent=1))
        commit(server, at(10, "corrected", sent=2))
        now[0] = 100 * SECOND
        commit(server, at(20, "x", sent=3))
        # What was sent before it comes only now, and does not take its place.
        commit(server, at(10, "wrong", sent=1))
        assert archive.flush(timeout=30)
        assert kept(memory) == {}
        assert archive.status()["forgotten"] == 3
        # What is sent after it is judged anew.
        commit(server, at(10, "corrected again", sent=4))
    assert kept(memory) == {10: "corrected again"}


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("mechanism", [Frequency(wait=50.0), Similarity(distance="mse", minimum=5.0)])
def test_a_correction_that_comes_late_takes_the_place_of_what_was_consolidated(
    mechanism: Online, restart: bool
) -> None:
    memory = in_process()
    updates = [at(0, 0.0, sent=1), at(100, 10.0, sent=1), at(200, 20.0, sent=1), at(300, 30.0, sent=1)]
    late = [at(100, 11.0, sent=2), at(100, 10.5, sent=1), at(100, 1.0, sent=0)]
    with behind(gated(memory, mechanism), limits={MEMORY: 1}) as server:
        commit(server, *updates, *([] if restart else late))
    if restart:
        with behind(gated(memory, mechanism), limits={MEMORY: 1}) as server:
            commit(server, at(300, 30.0, sent=1), *late)
    assert kept(memory) == {0: 0.0, 100: 11.0, 200: 20.0}
    # The one before it was not sent after what is there; the last one was, for the other came late too.
    assert memory.recall().count() == 4


# Late arrivals


def streamed(memory: Memory, seconds: Sequence[float], *, wait: float, restart_after: int = -1) -> list[float]:
    """What is kept of an entity by frequency, the moments coming in this order."""
    parts = [seconds] if restart_after < 0 else [seconds[:restart_after], seconds[restart_after:]]
    for part in parts:
        with behind(gated(memory, Frequency(wait=wait), keep_rest=True), limits={MEMORY: 2}) as server:
            for second in part:
                commit(server, at(second))
    return list(kept(memory))


def test_what_comes_late_does_not_defeat_the_frequency() -> None:
    """Ten a second, every second one of them two seconds late."""
    arriving = sorted((number / 10 + (2.0 if number % 2 else 0.0), number / 10) for number in range(200))
    in_order = streamed(in_process(), [number / 10 for number in range(200)], wait=1.0)
    late = streamed(in_process(), [second for _, second in arriving], wait=1.0)

    assert len(in_order) == 20
    assert len(late) <= 20
    assert all(after - before >= 1.0 for before, after in pairwise(late))


@pytest.mark.parametrize("remembered", [1, 3, 256])
def test_a_recording_that_is_replayed_is_forgotten_like_what_is_new(
    remembered: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(consolidated, "REMEMBERED", remembered)
    live = [1000 + number / 2 for number in range(40)]
    replayed = [number / 2 for number in range(40)]
    mixed = [second for pair in zip(live, replayed, strict=True) for second in pair]

    whole = [*map(float, range(20)), *map(float, range(1000, 1020))]
    for order in (live + replayed, mixed):
        for restart_after in (-1, 45, 60):
            assert streamed(in_process(), order, wait=1.0, restart_after=restart_after) == whole


# Brute force


@dataclass
class Oracle:
    """Working memory with a limit and Algorithm 1 behind it, with everything in lists that are looked through."""

    limit: int
    wait: float
    minimum: float
    count: int
    idle: float
    gated: bool
    here: dict[int, tuple[Snapshot, int]] = field(default_factory=dict)
    """By reference time, and when it came."""
    kept: dict[int, list[Snapshot]] = field(default_factory=dict)
    forgotten: dict[int, int] = field(default_factory=dict)

    def put(self, coming: Snapshot, now: int) -> None:
        moment = coming.referenced
        if moment in self.here:
            known, since = self.here[moment]
            takes_over = supersedes(coming, known)
            self.here[moment] = (coming, now) if takes_over else (known, since)
            if not self.gated:
                self.kept.setdefault(moment, []).append(known if takes_over else coming)
            return
        self.here[moment] = (coming, now)
        if len(self.here) > self.limit:
            self.leave(min(self.here), now)

    def leave(self, moment: int, now: int) -> None:
        leaving, since = self.here.pop(moment)
        if self.keeps(leaving, now - since):
            self.kept.setdefault(moment, []).append(leaving)
        else:
            self.forgotten[moment] = max(self.forgotten.get(moment, -1), leaving.sent)

    def keeps(self, leaving: Snapshot, idle: int) -> bool:
        if not self.gated:
            return True
        moment = leaving.referenced
        if moment in self.kept:
            return leaving.sent >= max(each.sent for each in self.kept[moment])
        if moment in self.forgotten and leaving.sent <= self.forgotten[moment]:
            return False
        if any(abs(other - moment) < self.wait * SECOND for other in self.kept):
            return False
        before = [_value(what_counts(self.kept[other])) for other in sorted(self.kept) if other < moment]
        last = before[-self.count :]
        value = _value(leaving)
        apart = sum(abs(value - other) for other in last) / len(last) if last else math.inf
        return apart >= self.minimum and idle <= self.idle * SECOND

    def stop(self, now: int) -> None:
        for moment in sorted(self.here):
            self.leave(moment, now)
        self.forgotten.clear()

    def answer(self) -> dict[float, Any]:
        return values([what_counts(self.kept[moment]) for moment in sorted(self.kept)])


def what_counts(versions: Sequence[Snapshot]) -> Snapshot:
    best = versions[0]
    for each in versions[1:]:
        best = each if supersedes(each, best) else best
    return best


STEPS = st.lists(
    st.one_of(
        st.tuples(st.integers(0, 12), st.integers(0, 3), st.integers(0, 4)),
        st.just("restart"),
        st.just("time passes"),
    ),
    max_size=30,
)


@settings(max_examples=100, deadline=None)
@given(
    STEPS,
    st.integers(1, 3),
    st.integers(0, 4),
    st.integers(0, 3),
    st.integers(1, 3),
    st.booleans(),
    st.sampled_from([1, 2, 256]),
    st.booleans(),
)
def test_against_brute_force(
    steps: list[Any],
    limit: int,
    wait: int,
    minimum: int,
    count: int,
    is_gated: bool,
    remembered: int,
    at_once: bool,
) -> None:
    """Versions, late arrivals, restarts; what was decided long ago may be written or not when it is looked for."""
    now = [0]
    mechanisms: list[Online] = [
        Frequency(wait=float(wait)),
        Similarity(distance="mae", minimum=float(minimum), count=count),
        TimeDecay(activation=Exponential(1.0), minimum=math.exp(-20.5)),
    ]
    oracle = Oracle(limit=limit, wait=wait, minimum=minimum, count=count, idle=20.5, gated=is_gated)
    store = HeldStore()
    memory = Memory(store)
    arrived: dict[int, list[Snapshot]] = {}
    restarted = False

    def running() -> tuple[LongTermMemory, MemoryServer]:
        if at_once:
            store.go.clear()
        else:
            store.go.set()
        archive = gated(memory, *(mechanisms if is_gated else ()), keep_rest=True, clock=lambda: now[0])
        server = object_memory(archive=archive, limits={MEMORY: limit}, clock=lambda: now[0])
        archive.serve(server)
        return archive, server

    def stop(archive: LongTermMemory, server: MemoryServer) -> None:
        store.go.set()
        server.close()
        archive.close()
        oracle.stop(now[0])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(consolidated, "REMEMBERED", remembered)
        parts = running()
        for step in steps:
            if step == "restart":
                stop(*parts)
                restarted = True
                parts = running()
            elif step == "time passes":
                now[0] += 20 * SECOND
            else:
                second, sent, value = step
                now[0] += SECOND
                coming = snapshot(second * SECOND, float(value), sent=sent, arrived=now[0])
                arrived.setdefault(second * SECOND, []).append(coming)
                oracle.put(coming, now[0])
                commit(parts[1], at(second, float(value), sent=sent))
        stop(*parts)
    found = kept(memory)
    assert found == oracle.answer()
    if not restarted:
        for second, value in found.items():
            best = max(each.sent for each in arrived[round(second * SECOND)])
            assert value in {_value(each) for each in arrived[round(second * SECOND)] if each.sent == best}
