"""The fold over the log: clocks, events held until their time has come, and the strands that are fed with them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop
from typing import Any, TypeVar
from uuid import UUID

from elm.event import StoredEvent
from elm.log import LogEntry, LogKind, Tick
from elm.recognition.bench import RecognizerFailure
from elm.recognition.clocks import NEVER, Clocks, Timing
from elm.recognition.results import Result, moment_of
from elm.recognition.ticking import deadlines, due_ticks
from elm.recognition.waiting import Queue, Waiting, fed_at, keep, merge, push
from elm.recognition.work import Work
from elm.recognizers.base import RECOGNIZER, Fed

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Harvest:
    """What a stretch of the log brought about: results by strand, in the order of detection, and failures."""

    results: tuple[tuple[str, Result], ...]
    failures: tuple[tuple[str, RecognizerFailure], ...]


class Fold:
    """F(A(P), W(P)): what some strands find in the log up to a position.

    A `complete` one feeds what came too late as well, each event in its place: nothing is fed before `finish`.
    """

    def __init__(self, works: Sequence[Work], timing: Timing, own: frozenset[str], *, complete: bool = False) -> None:
        self.works = {each.strand.name: each for each in works}
        self.clocks = Clocks(timing)
        self._own = own
        self._queues: dict[str | None, Queue] = {}
        self._shared: Queue = []
        self._waiting: dict[str | None, Waiting] = {}
        self._waiting_across = Waiting([])
        self._wants: dict[str, tuple[tuple[Work, ...], tuple[Work, ...]]] = {}
        self._results: list[tuple[str, Result]] = []
        self._failures: list[tuple[str, RecognizerFailure]] = []
        self._moved: dict[str | None, None] = {}
        self._has_across = any(each.has_across for each in works)
        self._complete = complete
        self.last_late: tuple[str | None, int] | None = None
        """The agent of the last event that came too late, and by how many microseconds."""

    # Taking entries in

    def take(self, entries: Iterable[LogEntry]) -> Harvest:
        """Take in entries; what is found does not depend on how they are divided into calls."""
        for entry in entries:
            self._take(entry)
            self._moved[entry.agent] = None
            if self._complete:
                self.clocks.share()
            elif self._has_across:
                # Results of single agents must find recognizers across agents where these were before this entry.
                self._settle()
        if not self._complete:
            self._settle()
        return self._told()

    def finish(self) -> Harvest:
        """Feed all that has come of age by now."""
        self._moved.update(dict.fromkeys(self.clocks.agents))
        self._settle()
        return self._told()

    def _told(self) -> Harvest:
        results, failures = self._results, tuple(self._failures)
        self._results, self._failures = [], []
        failed = {name for name, _ in failures}
        kept = tuple((name, result) for name, result in results if name not in failed)
        return Harvest(results=kept, failures=failures)

    def _take(self, entry: LogEntry) -> None:
        event = entry.event
        if event is None or entry.kind not in (LogKind.COMMIT, LogKind.CLOSE):
            self.clocks.tell(entry, None)
            if entry.is_forgotten:
                for work in self.works.values():
                    work.tally.forgotten += 1
            return
        end = moment_of(event)
        before, shared = self.clocks.watermark(entry.agent), self.clocks.shared
        recognizer = event.value(RECOGNIZER)
        self.clocks.tell(entry, end if recognizer is None else None)
        if recognizer is None:
            self._accept(entry.agent, event, end, before, shared)
        elif recognizer not in self._own:
            self._accept(entry.agent, event, end, before, shared, is_result=True)

    def _accept(
        self, agent: str | None, event: StoredEvent, moment: int, before: int, shared: int, *, is_result: bool = False
    ) -> None:
        single, across = self._wanted(event.type)
        if is_result and not self._complete:
            # Certain long after its end, perhaps: never late, and fed behind what has been fed.
            moment, moment_across = max(moment, before), max(moment, shared)
        else:
            moment_across = moment
        if moment < before and not self._complete:
            self._pass_by(single, agent, before - moment)
        elif not self._has_room(self._waiting.setdefault(agent, Waiting([])), moment, before):
            for work in single:
                work.tally.passed_over += 1
        elif single and (not is_result or agent in self.clocks.agents):
            # What another consumer found across agents belongs to none whose time could come.
            push(self._queues.setdefault(agent, []), event, moment)
        if not self._has_across:
            return
        if moment_across < shared and not self._complete:
            self._pass_by(across, agent, shared - moment_across)
        elif not self._has_room(self._waiting_across, moment_across, shared):
            for work in across:
                work.tally.passed_over += 1
        elif across:
            push(self._shared, event, moment_across)

    def _pass_by(self, works: Sequence[Work], agent: str | None, behind: int) -> None:
        for work in works:
            work.tally.late += 1
            self.last_late = (agent, behind)

    def _has_room(self, waiting: Waiting, moment: int, watermark: int) -> bool:
        return self._complete or waiting.has_room(moment, watermark)

    def _wanted(self, type_name: str) -> tuple[tuple[Work, ...], tuple[Work, ...]]:
        known = self._wants.get(type_name)
        if known is None:
            works = self.works.values()
            single = tuple(each for each in works if each.wants(type_name))
            across = tuple(each for each in works if each.wants_across(type_name))
            known = self._wants[type_name] = (single, across)
        return known

    # Feeding what has come of age

    def _settle(self) -> None:
        for agent in self._moved:
            self._settle_agent(agent)
        self._moved.clear()
        if not self._has_across:
            return
        watermark = self.clocks.share()
        while self._shared and self._shared[0][0] < watermark:
            fed = heappop(self._shared)[3]
            for work in self._wanted(fed.event.type)[1]:
                self._found(work, work.across.feed, fed)
        for work in list(self.works.values()):
            self._found(work, work.across.pass_time, watermark)

    def _settle_agent(self, agent: str | None) -> None:
        watermark = self.clocks.watermark(agent)
        queue = self._queues.get(agent)
        while queue and queue[0][0] < watermark:
            fed = heappop(queue)[3]
            for work in self._wanted(fed.event.type)[0]:
                if found := self._found(work, work.bench(agent).feed, fed):
                    self._share(found)
        for work in list(self.works.values()):
            if (bench := work.benches.get(agent)) is not None:
                self._share(self._found(work, bench.pass_time, watermark))

    def _found(self, work: Work, look: Callable[[T], list[Result]], given: T) -> list[Result]:
        """What a strand finds when it is given an event, or the time; a strand that fails is let go of."""
        try:
            found = look(given)
        except RecognizerFailure as failure:
            self._failures.append((work.strand.name, failure))
            self.remove(work.strand.name)
            return []
        if found:
            self._results += [(work.strand.name, result) for result in found]
        return found

    def _share(self, found: Sequence[Result]) -> None:
        """What was found of one agent is fed across agents too, not before what has been fed there."""
        if not self._has_across:
            return
        for result in found:
            event = result.fed.event
            if self._wanted(event.type)[1]:
                moment = result.fed.moment
                push(self._shared, event, moment if self._complete else max(moment, self.clocks.shared))

    def remove(self, name: str) -> None:
        """Let go of a strand, and of what waits for it alone: it will be fed anew when it is back."""
        if self.works.pop(name, None) is None:
            return
        self._wants.clear()
        self._has_across = any(each.has_across for each in self.works.values())
        for queue in self._queues.values():
            keep(queue, lambda fed: bool(self._wanted(fed.event.type)[0]))
        keep(self._shared, lambda fed: bool(self._wanted(fed.event.type)[1]))
        if not self._has_across:
            self.clocks.shared = NEVER
            self._waiting_across = Waiting([])

    # Time

    def ticks(self, now: int) -> tuple[list[Tick], int | None]:
        """The ticks that would make something certain if written `now`, and when the next one would be due."""
        benches = [work.across for work in self.works.values() if work.has_across]
        across = [item[0] for item in self._shared] + deadlines(benches)
        return due_ticks(self.clocks, self._waits_for, across, now)

    def _waits_for(self, agent: str | None) -> list[int]:
        benches = [bench for work in self.works.values() if (bench := work.benches.get(agent)) is not None]
        return [item[0] for item in self._queues.get(agent, ())] + deadlines(benches)

    # What is kept

    def snapshot(self, name: str) -> tuple[Any, list[StoredEvent]]:
        """The state of one strand as plain JSON (clocks, what waits for it, its processes), and the events it names."""
        work = self.works[name]
        named: dict[UUID, StoredEvent] = {}

        def told(held: Iterable[Fed]) -> list[tuple[str, int]]:
            # With its moment each time: across agents an event may be certain later than for its own agent.
            found = []
            for fed in held:
                named[fed.event.uid] = fed.event
                found.append((str(fed.event.uid), fed.moment))
            return found

        queues = [(agent, [item[3] for item in sorted(queue)]) for agent, queue in self._queues.items()]
        state = {
            "clocks": self.clocks.snapshot(),
            "queues": [
                (agent, told(fed for fed in queue if work.wants(fed.event.type))) for agent, queue in queues if queue
            ],
            "shared": told(item[3] for item in sorted(self._shared) if work.wants_across(item[3].event.type)),
            "benches": [(agent, bench.snapshot(), told(bench.held())) for agent, bench in work.benches.items()],
            "across": (work.across.snapshot(), told(work.across.held())),
            "waiting": [
                (agent, moments)
                for agent, each in self._waiting.items()
                if (moments := each.passed(self.clocks.watermark(agent)))
            ],
            "waiting_across": self._waiting_across.passed(self.clocks.shared),
            "tally": work.tally.snapshot(),
        }
        return state, list(named.values())

    def resume(self, name: str, told: Any, named: Mapping[str, StoredEvent]) -> None:
        """Have a strand, the only one here, in the state of which a snapshot was taken."""
        work = self.works[name]
        self.clocks = Clocks.resumed(self.clocks.timing, told["clocks"])
        for agent, waiting in told["queues"]:
            for uid, moment in waiting:
                push(self._queues.setdefault(agent, []), named[uid], moment)
        for uid, moment in told["shared"]:
            push(self._shared, named[uid], moment)
        for agent, states, held in told["benches"]:
            work.bench(agent).resume(states, {uid: fed_at(named[uid], moment) for uid, moment in held})
        states, held = told["across"]
        work.across.resume(states, {uid: fed_at(named[uid], moment) for uid, moment in held})
        self._waiting = {agent: Waiting(moments) for agent, moments in told["waiting"]}
        self._waiting_across = Waiting(told["waiting_across"])
        work.tally.resume(told["tally"])

    def may_adopt(self, other: Fold) -> bool:
        """Whether both have come to know the same, so that what they find does not depend on who keeps it."""
        if self.clocks.agents != other.clocks.agents or self.clocks.log_time != other.clocks.log_time:
            return False
        if self._has_across and other._has_across and self.clocks.shared != other.clocks.shared:
            return False
        return self._still_waiting() == other._still_waiting()

    def _still_waiting(self) -> dict[str | None, list[int]]:
        passed = {agent: each.passed(self.clocks.watermark(agent)) for agent, each in self._waiting.items()}
        return {agent: sorted(moments) for agent, moments in passed.items() if moments}

    def adopt(self, other: Fold) -> None:
        """Take over the strands of a fold that knows the same."""
        self.works |= other.works
        self._wants.clear()
        if other._has_across and not self._has_across:
            self._has_across = True
            self.clocks.shared = other.clocks.shared
            self._waiting_across = other._waiting_across
        for agent, queue in other._queues.items():
            merge(self._queues.setdefault(agent, []), queue)
        merge(self._shared, other._shared)
