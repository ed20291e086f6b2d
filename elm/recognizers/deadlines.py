"""Until when the runs of a pattern wait, and which of their deadlines nobody else need wait for."""

from __future__ import annotations

from elm.recognizers.plan import Plan, Rules, Target
from elm.recognizers.runs import Queue, Run


class Deadlines:
    """The deadlines of a pattern's runs: those at which something is told, and silent ones, that end runs only."""

    __slots__ = ("_plan", "_pushed", "_rules", "silent", "telling")

    def __init__(self, rules: Rules, plan: Plan) -> None:
        self._rules = rules
        self._plan = plan
        self.telling = Queue(lambda pushed, run: run.alive and run.timer == pushed)
        self.silent = Queue(lambda pushed, run: run.alive and run.timer == pushed)
        self._pushed = 0

    def set(self, run: Run, targets: tuple[Target, ...], held: int) -> None:
        """Have a run wait as long as it may for its targets; `held` is how many runs there are."""
        absent = self._plan.absent
        if absent is not None and absent not in run.closed and self._plan.accepts(run.taken[1], run.count):
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
            queue = self.silent if ends_silently else self.telling
            queue.push(deadline, self._pushed, run)
            queue.tidy(held)

    def _tells_at_its_end(self, run: Run, targets: tuple[Target, ...]) -> bool:
        """Whether something is emitted when time has passed beyond a run's deadline."""
        if not self._plan.accepts(run.taken[1], run.count):
            return self._rules.timed_out is not None
        if self._plan.absent is not None:
            return self._plan.absent not in run.closed
        return not targets[0].divides

    def first(self) -> int | None:
        """The first deadline at which something is told."""
        return self.telling.first()

    def due(self, deadline: int) -> list[Run]:
        """The runs that tell something at the first deadline, which is this one; they wait no longer."""
        found: list[Run] = []
        while self.telling.first() == deadline:
            run = self.telling.pop()
            run.deadline, run.timer = None, 0
            found.append(run)
        return found

    def silent_before(self, moment: int) -> list[Run]:
        """The runs whose time was over before a moment, and that nothing comes of; they wait no longer."""
        found: list[Run] = []
        while (deadline := self.silent.first()) is not None and deadline < moment:
            found.append(self.silent.pop())
        return found
