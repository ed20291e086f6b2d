"""The forgetter: takes from a memory what a plan says, through a port that any long-term memory can stand behind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from armem_bridge.forgetting.plan import Plan
from armem_bridge.forgetting.refusals import require_count
from armem_bridge.memory_id import MemoryID

BATCH: Final = 1_000
"""Snapshots that the port is told at once."""


class Forgetting(Protocol):
    """A memory that can forget, as the forgetter sees it."""

    def forget(self, snapshots: Sequence[MemoryID]) -> int:
        """Forget these snapshots, every version of each, and say how many there were to forget.

        What is not there, or may not go for now, is left out of the number and is no error: a plan that was
        stopped half-way can be applied again.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Applied:
    """What applying a plan did: of the `planned` snapshots `forgotten` went, the others were gone or are held."""

    planned: int
    forgotten: int

    @property
    def left(self) -> int:
        """How many did not go."""
        return self.planned - self.forgotten


class Forgetter:
    """Applies plans to one memory."""

    def __init__(self, memory: Forgetting, *, batch: int = BATCH) -> None:
        require_count(batch, what="the number of snapshots that are forgotten at once")
        self._memory = memory
        self._batch = batch

    def apply(self, plan: Plan, *, progress: Callable[[int], None] | None = None) -> Applied:
        """Forget exactly what the plan names, the earliest of each entity first; `progress` is told how far it is."""
        snapshots = plan.snapshots
        forgotten = 0
        for begin in range(0, len(snapshots), self._batch):
            part = snapshots[begin : begin + self._batch]
            forgotten += self._memory.forget(part)
            if progress is not None:
                progress(begin + len(part))
        return Applied(planned=len(snapshots), forgotten=forgotten)
