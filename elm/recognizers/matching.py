"""The engine of patterns: runs that take events, divide, end and time out, as docs/recognition.md says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self
from uuid import UUID

from elm.features import Feature, FeatureValue
from elm.interval import from_micros
from elm.recognizers.base import Emission, Fed, Judge
from elm.recognizers.hits import Hits
from elm.recognizers.partition import Key, keys_of, values_of
from elm.recognizers.plan import Plan, Rules, Target
from elm.recognizers.runs import NOTHING, Queue, Run, Taken, run_of, told

MATCH, TIMED_OUT = "match", "timed out"


class Matching:
    """A pattern at work: its unfinished runs by partition, and their deadlines. A `Process`."""

    def __init__(self, rules: Rules, plan: Plan, around: Judge) -> None:
        self._rules = rules
        self._plan = plan
        self._around = around
        self._runs: dict[Key, list[Run]] = {}
        self._timers = Queue(lambda pushed, run: run.alive and run.timer == pushed)
        self._silent = Queue(lambda pushed, run: run.alive and run.timer == pushed)
        """Deadlines of runs that nothing comes of: nobody need wait for them."""
        self._oldest: Queue | None = None
        """Runs as they began, kept from the first time on that there were too many."""
        self._place = 0
        self._serial = 0
        self._pushed = 0
        self._held = 0
        self._has_ended = False
        """Whether a run has ended since the event at hand came in."""
        self._dropped = 0
        self._by_type: dict[str, tuple[bool | None, ...] | None] = {}

    # What comes in

    def feed(self, fed: Fed) -> Sequence[Emission]:
        """Take in an event; those that matched because of it."""
        event = fed.event
        if self._silent.may_begin_before(fed.moment):
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

    def _targets(self, run: Run) -> tuple[Target, ...]:
        return self._plan.targets(run.taken[1], run.count)

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
        targets = self._targets(run)
        if self._is_accepting(run) and self._plan.absent is None and (not targets or targets[0].divides):
            # A copy stands for the match; the run itself goes on, if it can.
            certain.append(self._copy(run))
            if not targets:
                self._end(run)
                return
        self._set_deadline(run, targets)

    def _pass_over(self, run: Run, targets: tuple[Target, ...], hits: Hits, certain: list[Run]) -> None:
        run.passed = True
        plan, step = self._plan, run.taken[1]
        met = [g for g in plan.guards_behind[step] if g not in run.closed and hits.of(g) and hits.holds(g, run.taken)]
        absent = plan.absent
        waits = absent is not None and absent not in run.closed and self._is_accepting(run)
        if waits and absent is not None and hits.of(absent) and hits.holds(absent, run.taken):
            met.append(absent)
            waits = False
        if met:
            run.closed = run.closed.union(met)
        if not met and not plan.has_strict:
            return
        if waits or any(not (each.strict or run.closed.intersection(each.guards)) for each in targets):
            if absent in run.closed:
                self._set_deadline(run, targets)
            return
        if absent is None and self._is_match_at_its_end(run, targets):
            certain.append(self._copy(run))
        self._end(run)

    # What follows

    def _is_accepting(self, run: Run) -> bool:
        step = run.taken[1]
        return run.count >= self._plan.least[step] and self._plan.may_end[step]

    def _is_match_at_its_end(self, run: Run, targets: tuple[Target, ...]) -> bool:
        """Whether an accepting run waited to take more; if its first target divides it was a match at once."""
        return self._is_accepting(run) and not targets[0].divides

    def _set_deadline(self, run: Run, targets: tuple[Target, ...]) -> None:
        absent = self._plan.absent
        if absent is not None and absent not in run.closed and self._is_accepting(run):
            deadline = run.last + self._plan.absent_for
        else:
            deadline = run.begin + self._rules.within
            gaps = [each.gap for each in targets if each.gap is not None]
            if gaps and len(gaps) == len(targets):
                deadline = min(deadline, run.last + max(gaps))
        ends_silently = not self._tells_at_its_end(run, targets)
        if deadline != run.deadline or ends_silently is not run.ends_silently:
            run.deadline, run.ends_silently = deadline, ends_silently
            self._pushed += 1
            run.timer = self._pushed
            queue = self._silent if ends_silently else self._timers
            queue.push(deadline, self._pushed, run)
            queue.tidy(self._held)

    def _tells_at_its_end(self, run: Run, targets: tuple[Target, ...]) -> bool:
        """Whether something is emitted when time has passed beyond a run's deadline."""
        if not self._is_accepting(run):
            return self._rules.timed_out is not None
        if self._plan.absent is not None:
            return self._plan.absent not in run.closed
        return not targets[0].divides

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

    # Which matches count

    def _decided(self, certain: list[Run], moment: int) -> list[Emission]:
        """The results among matches that are certain at one moment, of one partition or of several."""
        found: list[Emission] = []
        barred_to: dict[Key, int] = {}
        barred: set[tuple[Key, int]] = set()
        for run in sorted(certain, key=Run.rank):
            if run.start <= barred_to.get(run.key, 0) or (run.key, run.start) in barred:
                continue
            found.append(self._emission(run, MATCH, self._rules.type, moment))
            if self._rules.bars_overlaps:
                barred_to[run.key] = run.taken[3]
                self._bar(run.key, 0, run.taken[3])
            elif self._rules.bars_same_start:
                barred.add((run.key, run.start))
                self._bar(run.key, run.start, run.start)
        return found

    def _bar(self, key: Key, first: int, last: int) -> None:
        """End the runs of a partition that began from one place to another."""
        for other in self._runs.get(key, ()):
            if first <= other.start <= last:
                self._end(other)

    def _emission(self, run: Run, output: str, kind: str, moment: int) -> Emission:
        trail = run.trail()
        waited = output == TIMED_OUT or self._plan.absent is not None
        return Emission(
            type=kind,
            parts=tuple((self._plan.names[step], fed.event) for _, step, fed, _ in trail),
            output=output,
            key=values_of(run.key),
            features=self._measured(trail),
            deadline=from_micros(moment) if waited else None,
        )

    def _measured(self, trail: Sequence[Taken]) -> tuple[Feature, ...]:
        found: list[tuple[str, FeatureValue]] = []
        for name, measure in self._rules.measures.items():
            of_step = [fed.event for _, at, fed, _ in trail if measure.step in (None, self._plan.names[at])]
            value = measure.of(of_step)
            if value is not None:
                found.append((name, value))
        return tuple(found)

    # What time brings

    def deadline(self) -> int | None:
        """The moment after which `expire` has something to tell."""
        return self._timers.first()

    def _end_silent(self, moment: int) -> None:
        """Let go of runs whose time was over before a moment, and that nothing comes of."""
        keys: set[Key] = set()
        while (deadline := self._silent.first()) is not None and deadline < moment:
            run = self._silent.pop()
            self._end(run)
            keys.add(run.key)
        for key in keys:
            self._clear(key)

    def expire(self, moment: int) -> Sequence[Emission]:
        """Time has passed beyond `moment`: what matched or timed out because of it, by deadline."""
        found: list[Emission] = []
        while (deadline := self.deadline()) is not None and deadline <= moment:
            due: list[Run] = []
            while self.deadline() == deadline:
                due.append(self._timers.pop())
                due[-1].deadline, due[-1].timer = None, 0
            found += self._expired(due, deadline)
        self._end_silent(moment + 1)
        return found

    def _expired(self, due: list[Run], deadline: int) -> list[Emission]:
        certain, late = [], []
        for run in due:
            if self._is_accepting(run):
                certain.append(self._copy(run))
                self._end(run)
            else:
                late.append(run)
        found = self._decided(certain, deadline) if certain else []
        for run in sorted(late, key=Run.rank):
            # Only with a type for what timed out is a run that did not match waited for.
            if run.alive and self._rules.timed_out is not None:
                found.append(self._emission(run, TIMED_OUT, self._rules.timed_out, deadline))
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
            process._set_deadline(run, process._targets(run))
        return process
