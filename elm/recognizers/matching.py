"""The engine of patterns: runs that take events, divide, end and time out, as docs/recognition.md says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self
from uuid import UUID

from elm.recognizers.base import Emission, Fed, Judge
from elm.recognizers.deadlines import Deadlines
from elm.recognizers.decisions import counting, match_of, time_out_of
from elm.recognizers.hits import Hits
from elm.recognizers.partition import Key, keys_of
from elm.recognizers.plan import Plan, Rules, Target
from elm.recognizers.runs import NOTHING, Queue, Run, Taken, run_of, told


class Matching:
    """A pattern at work: its unfinished runs by partition, and their deadlines. A `Process`."""

    def __init__(self, rules: Rules, plan: Plan, around: Judge) -> None:
        self._rules = rules
        self._plan = plan
        self._around = around
        self._runs: dict[Key, list[Run]] = {}
        self._deadlines = Deadlines(rules, plan)
        self._oldest: Queue | None = None
        """Runs as they began, kept from the first time on that there were too many."""
        self._place = 0
        self._serial = 0
        self._held = 0
        self._has_ended = False
        """Whether a run has ended since the event at hand came in."""
        self._dropped = 0
        self._by_type: dict[str, tuple[bool | None, ...] | None] = {}

    # What comes in

    def feed(self, fed: Fed) -> Sequence[Emission]:
        """Take in an event; those that matched because of it."""
        event = fed.event
        if self._deadlines.silent.may_begin_before(fed.moment):
            self._end_silent(fed.moment)
        try:
            statics = self._by_type[event.type]
        except KeyError:
            statics = self._by_type[event.type] = self._statics(event.type)
        if statics is None:
            return ()
        among = self._rules.among
        if among is not None and not self._around.matches(among, event):
            return ()
        self._place += 1
        hits = Hits(self._plan, self._around, fed, statics)
        found: list[Emission] = []
        for key in keys_of(event, self._rules.partition):
            found += self._feed_one(key, fed, hits)
        if self._held > self._rules.most_runs:
            self._drop()
        return found

    def _statics(self, type_name: str) -> tuple[bool | None, ...] | None:
        """Of each atom whether events of the type match its cue; None when no event of it can change anything."""
        statics = tuple(self._around.of_type(atom.cue, type_name) for atom in self._plan.atoms)
        if not self._plan.has_strict and all(each is False for each in statics):
            return None
        return statics

    def _feed_one(self, key: Key, fed: Fed, hits: Hits) -> list[Emission]:
        certain: list[Run] = []
        self._has_ended = False
        runs = self._runs.get(key)
        if runs is not None:
            for run in runs[:]:
                self._offer(run, fed, hits, certain)
        if hits.of(0) and fed.moment - fed.begin <= self._rules.within and hits.holds(0, None):
            self._serial += 1
            taken: Taken = (None, 0, fed, self._place)
            self._begin(Run(self._serial, key, self._place, taken, 1, fed.begin, fed.moment), certain)
        if not certain and not self._has_ended:
            return []
        found = self._decided(certain, fed.moment)
        self._clear(key)
        return found

    def _offer(self, run: Run, fed: Fed, hits: Hits, certain: list[Run]) -> None:
        """Have a run take the event, divide, or pass over it."""
        targets = self._plan.targets(run.taken[1], run.count)
        first = None
        for target in targets:
            # Most runs wait for another kind of event.
            if hits.of(target.step) and self._is_possible(run, target, fed, hits):
                first = target
                break
        if first is None:
            if self._plan.watches[run.taken[1]]:
                self._pass_over(run, targets, hits, certain)
        elif not first.divides:
            self._take(run, first, fed, certain)
        else:
            for target in targets:
                if self._is_possible(run, target, fed, hits):
                    self._serial += 1
                    other = Run(self._serial, run.key, run.start, run.taken, run.count, run.begin, run.last)
                    self._hold(other)
                    self._take(other, target, fed, certain)
            if self._plan.watches[run.taken[1]]:
                self._pass_over(run, targets, hits, certain)

    def _is_possible(self, run: Run, target: Target, fed: Fed, hits: Hits) -> bool:
        if not hits.of(target.step) or (target.strict and run.passed):
            return False
        if fed.moment - min(run.begin, fed.begin) > self._rules.within:
            return False
        if target.gap is not None and fed.moment - run.last > target.gap:
            return False
        if run.closed and not run.closed.isdisjoint(target.guards):
            return False
        return hits.holds(target.step, run.taken)

    def _begin(self, run: Run, certain: list[Run]) -> None:
        self._hold(run)
        self._go_on(run, certain)

    def _hold(self, run: Run) -> None:
        self._runs.setdefault(run.key, []).append(run)
        self._held += 1
        if self._oldest is not None:
            self._oldest.push(run.start, run.serial, run)
            self._oldest.tidy(self._held)

    def _take(self, run: Run, target: Target, fed: Fed, certain: list[Run]) -> None:
        run.count = run.count + 1 if target.step == run.taken[1] else 1
        run.taken = (run.taken, target.step, fed, self._place)
        run.begin = min(run.begin, fed.begin)
        run.last = fed.moment
        run.closed = NOTHING
        run.passed = False
        self._go_on(run, certain)

    def _go_on(self, run: Run, certain: list[Run]) -> None:
        """What follows from an event just taken: a match, and until when the run waits."""
        plan, step = self._plan, run.taken[1]
        targets = plan.targets(step, run.count)
        if plan.absent is None and plan.accepts(step, run.count) and (not targets or targets[0].divides):
            # A copy stands for the match; the run itself goes on, if it can.
            certain.append(self._copy(run))
            if not targets:
                self._end(run)
                return
        self._deadlines.set(run, targets, self._held)

    def _pass_over(self, run: Run, targets: tuple[Target, ...], hits: Hits, certain: list[Run]) -> None:
        run.passed = True
        plan, step = self._plan, run.taken[1]
        met = [g for g in plan.guards_behind[step] if g not in run.closed and hits.of(g) and hits.holds(g, run.taken)]
        absent = plan.absent
        waits = absent is not None and absent not in run.closed and plan.accepts(step, run.count)
        if waits and absent is not None and hits.of(absent) and hits.holds(absent, run.taken):
            met.append(absent)
            waits = False
        if met:
            run.closed = run.closed.union(met)
        if not met and not plan.has_strict:
            return
        if waits or any(not (each.strict or run.closed.intersection(each.guards)) for each in targets):
            if absent in run.closed:
                self._deadlines.set(run, targets, self._held)
            return
        # An accepting run has waited to take more: if its first target divides it was a match at once.
        if absent is None and plan.accepts(step, run.count) and not targets[0].divides:
            certain.append(self._copy(run))
        self._end(run)

    # What becomes of runs

    def _copy(self, run: Run) -> Run:
        copy = Run(run.serial, run.key, run.start, run.taken, run.count, run.begin, run.last)
        copy.alive = run.alive
        return copy

    def _end(self, run: Run) -> None:
        if run.alive:
            run.alive = False
            self._held -= 1
            self._has_ended = True

    def _clear(self, key: Key) -> None:
        """Let go of a partition's runs that have ended."""
        left = [run for run in self._runs.get(key, ()) if run.alive]
        if left:
            self._runs[key] = left
        else:
            self._runs.pop(key, None)

    def _drop(self) -> None:
        """Keep to the bound: drop the runs that began first."""
        if self._oldest is None:
            self._oldest = Queue(lambda serial, run: run.alive)
            for runs in self._runs.values():
                for run in runs:
                    self._oldest.push(run.start, run.serial, run)
        keys: set[Key] = set()
        while self._held > self._rules.most_runs and self._oldest.first() is not None:
            run = self._oldest.pop()
            self._end(run)
            self._dropped += 1
            keys.add(run.key)
        for key in keys:
            self._clear(key)

    def _bar(self, key: Key, first: int, last: int) -> None:
        """End the runs of a partition that began from one place to another."""
        for other in self._runs.get(key, ()):
            if first <= other.start <= last:
                self._end(other)

    def _decided(self, certain: list[Run], moment: int) -> list[Emission]:
        """The results among matches that are certain at one moment, of one partition or of several."""
        return [match_of(run, self._rules, self._plan, moment) for run in counting(certain, self._rules, self._bar)]

    # What time brings

    def deadline(self) -> int | None:
        """The moment after which `expire` has something to tell."""
        return self._deadlines.first()

    def _end_silent(self, moment: int) -> None:
        """Let go of runs whose time was over before a moment, and that nothing comes of."""
        keys: set[Key] = set()
        for run in self._deadlines.silent_before(moment):
            self._end(run)
            keys.add(run.key)
        for key in keys:
            self._clear(key)

    def expire(self, moment: int) -> Sequence[Emission]:
        """Time has passed beyond `moment`: what matched or timed out because of it, by deadline."""
        found: list[Emission] = []
        while (deadline := self.deadline()) is not None and deadline <= moment:
            found += self._expired(self._deadlines.due(deadline), deadline)
        self._end_silent(moment + 1)
        return found

    def _expired(self, due: list[Run], deadline: int) -> list[Emission]:
        certain, late = [], []
        for run in due:
            if self._plan.accepts(run.taken[1], run.count):
                certain.append(self._copy(run))
                self._end(run)
            else:
                late.append(run)
        found = self._decided(certain, deadline) if certain else []
        for run in sorted(late, key=Run.rank):
            # Only with a type for what timed out is a run that did not match waited for.
            kind = self._rules.timed_out
            if run.alive and kind is not None:
                found.append(time_out_of(run, self._rules, self._plan, type_name=kind, deadline=deadline))
                self._end(run)
        for key in {run.key for run in due}:
            self._clear(key)
        return found

    # What is kept

    def counts(self) -> Mapping[str, int]:
        """Unfinished runs, and how many were dropped."""
        return {"partial": self._held, "dropped": self._dropped}

    def held(self) -> Sequence[Fed]:
        """The events that unfinished runs have taken, each once."""
        found: dict[UUID, Fed] = {}
        for runs in self._runs.values():
            for run in runs:
                for _, _, fed, _ in run.trail():
                    found[fed.event.uid] = fed
        return list(found.values())

    def snapshot(self) -> Any:
        """The state as plain JSON."""
        return {
            "place": self._place,
            "serial": self._serial,
            "dropped": self._dropped,
            "runs": [told(run) for runs in self._runs.values() for run in runs],
        }

    @classmethod
    def resumed(cls, rules: Rules, plan: Plan, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Self:
        """The process of which `snapshot` was taken."""
        process = cls(rules, plan, around)
        process._place, process._serial = snapshot["place"], snapshot["serial"]
        process._dropped = snapshot["dropped"]
        for each in snapshot["runs"]:
            run = run_of(each, held)
            process._hold(run)
            process._deadlines.set(run, plan.targets(run.taken[1], run.count), process._held)
        return process
